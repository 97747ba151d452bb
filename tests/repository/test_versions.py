# SPDX-License-Identifier: GPL-3.0-or-later
"""The version is in CMakeLists.txt; no other file states one, except the list of changes."""

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def read(name):
    return (ROOT / name).read_text(encoding="utf-8")


def version():
    (found,) = re.findall(r"^project\(brdfc VERSION ([0-9.]+) ", read("CMakeLists.txt"), re.M)
    return found


def test_the_newest_changes_are_those_of_the_build():
    (newest,) = re.findall(r"\A(?:(?!^## ).*\n)*## \[(.*)\]", read("CHANGELOG.md"), re.M)
    assert newest == version()


def test_the_manifest_gets_the_version_from_the_build():
    assert re.findall(r"^version = .*$", read("blender_addon/blender_manifest.toml"), re.M) == [
        'version = "@version@"'
    ]


def test_nothing_else_names_the_version():
    files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    pages = [
        f for f in files.stdout.split("\0") if f.endswith((".md", ".py", ".toml", ".cff", ".yml"))
    ]
    assert len(pages) > 100
    name = re.compile(rf"brdfc[ _-]?(shaders-)?{re.escape(version())}|^version[:=] *\W?\d", re.M)
    assert [f for f in pages if name.search(read(f))] == []


def test_the_notes_of_a_release_are_the_section_of_its_version():
    done = subprocess.run([ROOT / "script" / "release", "--notes"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    section = read("CHANGELOG.md").split(f"## [{version()}]", 1)[1].split("\n", 1)[1]
    assert done.stdout.strip() == re.split(r"^## ", section, flags=re.M)[0].strip()
    assert done.stdout.startswith("### ")
