#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The rooms of the generator and of the extension: what each is for, what its files include or
import, and both as a page with drawings by Graphviz."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import grimp
from markdown_table import heading, line

ROOT = Path(__file__).resolve().parent.parent
TABLES = ROOT / "docs/tables"
PAGE, DRAWING, ADDON_DRAWING = (TABLES / n for n in ("rooms.md", "rooms.svg", "addon_rooms.svg"))
ADDON = "blender_addon"


def listed():
    """By room, in the order of the file: its purpose, and the rooms that it links."""
    text = (ROOT / "generator/CMakeLists.txt").read_text(encoding="utf-8")
    found = re.findall(r'^brdfc_room\((\w+) "(.*?)"([^)]*)\)', text, re.M | re.S)
    links = re.compile(r"\bROOMS\b([\sa-z]*)")
    return {
        name: (doc, links.search(rest)[1].split() if "ROOMS" in rest else [])
        for name, doc, rest in found
    }


def sources(room):
    folder = ROOT / "generator" / room
    return [p.read_text(encoding="utf-8") for s in ("*.h", "*.cpp") for p in folder.glob(s)]


def included(rooms):
    """By room: the other rooms that its files include, in the order of `rooms`."""
    out = {}
    for room in rooms:
        named = set(re.findall(r'^#include "(\w+)/', "\n".join(sources(room)), re.M))
        out[room] = [other for other in rooms if other in named - {room}]
    return out


def addon_rooms():
    """By room of the extension, the lowest first: what it is for. The order is that of
    pyproject.toml, which import-linter holds imports to."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (contract,) = settings["tool"]["importlinter"]["contracts"]
    return {room: purpose(room) for room in reversed(contract["layers"])}


def addon_files(room):
    folder = ROOT / ADDON / room
    return sorted(folder.rglob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]


def purpose(room):
    """The first sentence of a room's docstring."""
    folder = ROOT / ADDON / room
    file = folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")
    doc = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8")))
    return doc.split("\n\n")[0].replace("\n", " ")


def imported(rooms):
    """By room of the extension: the other rooms that its modules import, in the order of
    `rooms`."""
    sys.path.insert(0, str(ROOT))  # where grimp looks for the package, which it does not run
    graph = grimp.build_graph(ADDON, cache_dir=None)
    named = {room: set() for room in rooms}
    for module in graph.modules:
        if module.count(".") and (room := module.split(".")[1]) in rooms:
            found = graph.find_modules_directly_imported_by(module)
            named[room] |= {other.split(".")[1] for other in found if other.count(".")}
    return {room: [other for other in rooms if other in named[room] - {room}] for room in rooms}


def lines_of(paths):
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in paths)


def drawing(below):
    """An SVG of what each room builds on, without arrows that longer ways imply."""
    edges = [f"{other} -> {room};" for room, others in below.items() for other in others]
    text = "\n".join(
        [
            "digraph rooms {",
            'node [shape=box, style="rounded,filled", fillcolor="#e8eef4", color="#778899",',
            '  fontname="sans-serif", fontsize=13, width=1.3];',
            'edge [color="#778899", arrowsize=0.7];',
            *(f"{room};" for room in below),
            *edges,
            "}",
        ]
    )
    for command in (["tred"], ["dot", "-Tsvg"]):
        text = subprocess.run(
            command, input=text, capture_output=True, text=True, check=True
        ).stdout
    return text


def arrows(svg):
    """The rooms and arrows of a drawing, wherever Graphviz placed them."""
    return set(re.findall(r"<title>(.*?)</title>", svg))


def page(rooms, below, addon, addon_below):
    lines = [
        "# Rooms of the code, drawn",
        "",
        "Made by `script/rooms` from `generator/CMakeLists.txt`, `pyproject.toml`, and the",
        "files' includes and imports. An arrow leads from a room to one that builds on it;",
        "arrows that follow from others are omitted.",
        "",
        "## The generator",
        "",
        "Models register themselves, so nothing includes them.",
        "",
        "![Rooms and arrows](rooms.svg)",
        "",
        *heading("Room of `generator/`", "What it is for", "Includes", "Lines, about"),
    ]
    for room, (doc, _) in rooms.items():
        count = sum(len(text.splitlines()) for text in sources(room))
        uses = ", ".join(below[room]) or "-"
        lines.append(line(f"`{room}`", doc, uses, round(count, -2)))
    lines += [
        "",
        "## The extension",
        "",
        "![Rooms and arrows](addon_rooms.svg)",
        "",
        *heading(f"Room of `{ADDON}/`", "What it is for", "Imports", "Lines, about"),
    ]
    for room, doc in addon.items():
        uses = ", ".join(addon_below[room]) or "-"
        lines.append(line(f"`{room}`", doc, uses, round(lines_of(addon_files(room)), -1)))
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    rooms, addon = listed(), addon_rooms()
    below, addon_below = included(rooms), imported(addon)
    PAGE.write_text(page(rooms, below, addon, addon_below), encoding="utf-8")
    DRAWING.write_text(drawing(below), encoding="utf-8")
    ADDON_DRAWING.write_text(drawing(addon_below), encoding="utf-8")
