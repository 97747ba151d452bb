# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/reference.md lists every command of the tool, and no other."""

import re
import subprocess

from support import ROOT, TOOL


def test_the_reference_lists_every_command():
    help_text = subprocess.run([TOOL, "--help"], capture_output=True, text=True, check=True).stdout
    commands = re.findall(r"^  (\w+) {2,}\S", help_text.split("Subcommands:")[1], re.M)
    page = (ROOT / "docs" / "reference.md").read_text(encoding="utf-8")
    listed = re.findall(r"^    build/brdfc (\w+)", page, re.M)
    assert len(commands) > 15
    assert set(commands) == set(listed)
