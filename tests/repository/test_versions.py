# SPDX-License-Identifier: GPL-3.0-or-later
"""The version stands in CMakeLists.txt; other files name the same one."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def found(name, pattern):
    (version,) = re.findall(pattern, (ROOT / name).read_text(encoding="utf-8"), re.M)
    return version


@pytest.mark.parametrize(
    ("name", "pattern"),
    [
        ("blender_addon/blender_manifest.toml", r'^version = "(.*)"$'),
        ("CITATION.cff", r"^version: (.*)$"),
        ("CHANGELOG.md", r"\A(?:(?!^## ).*\n)*## \[(.*)\]"),  # of the newest section
    ],
)
def test_version_is_that_of_the_build(name, pattern):
    assert found(name, pattern) == found("CMakeLists.txt", r"^project\(brdfc VERSION ([0-9.]+) ")
