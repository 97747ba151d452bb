# SPDX-License-Identifier: GPL-3.0-or-later
"""Rooms include or import what is below them alone; the page that draws them is that of now."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import rooms_page

ROOT = Path(__file__).resolve().parents[2]
ROOMS = rooms_page.listed()
BELOW = rooms_page.included(ROOMS)
LINTER = Path(sys.executable).with_name("lint-imports")


def test_every_folder_is_a_room():
    assert {p.parent.name for p in (ROOT / "generator").glob("*/*.cpp")} == set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_includes_what_it_links_and_that_is_above(room):
    order = list(ROOMS)
    listed = ROOMS[room][1]
    assert BELOW[room] == listed, (
        f"files in generator/{room} include headers of {sorted(set(BELOW[room]) - set(listed))}, "
        f"which generator/CMakeLists.txt does not list for that room, and none of "
        f"{sorted(set(listed) - set(BELOW[room]))}, which it lists; the order is that of the file"
    )
    assert all(order.index(other) < order.index(room) for other in BELOW[room])


def helpers(source):
    """Functions with their parameters, types and constants of the anonymous namespaces of a
    source."""
    for body in re.findall(r"^namespace \{\n(.*?)^\}  // namespace$", source, re.S | re.M):
        body = re.sub(r"//.*", "", body)
        yield from re.findall(r"^(?:struct|class|enum class) (\w+)", body, re.M)
        yield from re.findall(r"^(?:constexpr|const) [^(\n]*?(\w+)(?:\[\])?(?: =|\{)", body, re.M)
        for name, parameters in re.findall(
            r"^\w[^\n=(]*[ &*>](\w+)\(([^{;]*)\)[^;{]*\{", body, re.M
        ):
            types = [re.sub(r"(\W)\w+$", r"\1", p.strip()) for p in parameters.split(",")]
            yield f"{name}({', '.join(' '.join(t.split()) for t in types)})"


@pytest.mark.parametrize("room", ROOMS)
def test_sources_of_a_room_have_helpers_of_different_names(room):
    """The preset `release` compiles several sources as one: a new file moves others together."""
    found = {}
    for path in sorted((ROOT / "generator" / room).glob("*.cpp")):
        for name in set(helpers(path.read_text(encoding="utf-8"))):
            found.setdefault(name, []).append(path.name)
    assert not {name: files for name, files in found.items() if len(files) > 1}


def test_a_helper_that_two_sources_have_is_found():
    one = (
        "namespace {\n\nvoid run(const Path& out) {\n}\nconstexpr int kMost = 1;\n}  // namespace\n"
    )
    other = (
        "namespace {\nvoid run(const Path& folder) {\n}\nvoid run(int x) {\n}\n}  // namespace\n"
    )
    assert set(helpers(one)) == {"run(const Path&)", "kMost"}
    assert set(helpers(other)) == {"run(const Path&)", "run(int)"}


def test_the_extension_imports_downwards_alone():
    done = subprocess.run([LINTER, "--no-cache"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("common/argument_checks.py", "from ..groups import nodes"),
        ("trees/animation.py", "def f():\n    from ..lamps import slots"),
        ("new_room/__init__.py", "x = 1"),
    ],
)
def test_an_import_upwards_or_an_unlisted_room_is_found(tmp_path, module, line):
    shutil.copytree(ROOT / "blender_addon", tmp_path / "blender_addon")
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    changed = tmp_path / "blender_addon" / module
    changed.parent.mkdir(exist_ok=True)
    with changed.open("a", encoding="utf-8") as out:
        out.write(f"\n{line}\n")
    done = subprocess.run([LINTER, "--no-cache"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode != 0 and changed.parent.name in done.stdout


def test_the_page_is_that_of_now():
    def without_lines(page):  # they change with every change
        return re.sub(r"\| \d+ \|$", "|", page, flags=re.M)

    addon = rooms_page.addon_rooms()
    addon_below = rooms_page.imported(addon)
    written = rooms_page.PAGE.read_text(encoding="utf-8")
    now = rooms_page.page(ROOMS, BELOW, addon, addon_below)
    assert without_lines(written) == without_lines(now), "script/rooms"
    for file, below in ((rooms_page.DRAWING, BELOW), (rooms_page.ADDON_DRAWING, addon_below)):
        drawn = rooms_page.arrows(file.read_text(encoding="utf-8"))
        assert drawn == rooms_page.arrows(rooms_page.drawing(below)), "script/rooms"
