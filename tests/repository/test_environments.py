# SPDX-License-Identifier: GPL-3.0-or-later
"""When `script/lib.sh` makes a Python environment again."""

import subprocess
import sys
from pathlib import Path

LIB = Path(__file__).parents[2] / "script" / "lib.sh"
REQUIREMENTS = LIB.parent / "requirements"


def bash(code, *args):
    """Exit status of some lines of bash that have the functions of the scripts."""
    return subprocess.run(["bash", "-c", f'source "$0"; {code}', LIB, *args]).returncode


def test_an_environment_that_was_moved_is_made_again(tmp_path):
    made, moved = tmp_path / "made", tmp_path / "moved"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", made], check=True)
    (made / "bin" / "pip").write_text(f"#!{made}/bin/python\n")
    (made / ".stamp").write_text("3.11 abc\n")
    ready = 'env_is_ready "$1" "$2"'
    assert bash(ready, made, "3.11 abc") == 0
    assert bash(ready, made, "3.11 other") != 0
    made.rename(moved)
    # Its interpreter runs, but its programs name one that is not there.
    assert subprocess.run([moved / "bin" / "python", "-c", ""]).returncode == 0
    assert bash(ready, moved, "3.11 abc") != 0


def test_environments_are_made_where_they_are_and_not_under_a_link(tmp_path):
    """Several clones may share them through a link, and the clone that made one may go."""
    clone, shared = tmp_path / "clone", tmp_path / "shared"
    (clone / "script").mkdir(parents=True), shared.mkdir()
    (clone / "script" / "lib.sh").symlink_to(LIB)
    (clone / ".env").symlink_to(shared)
    command = 'source "$0"; printf %s "$ENVS"'
    printed = subprocess.check_output(["bash", "-c", command, clone / "script" / "lib.sh"])
    assert printed.decode() == str(shared)


def test_pages_are_tested_with_the_versions_that_make_them():
    def pinned(name):
        lines = (REQUIREMENTS / name).read_text(encoding="utf-8").splitlines()
        return {line for line in lines if not line.startswith("#")}

    assert pinned("page.txt") <= pinned("tools.txt")
