#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the page about the rooms of the code: the description of each room in
generator/CMakeLists.txt, what its files include, and a drawing of both."""

import itertools
import re
from pathlib import Path

from markdown_table import heading, line

ROOT = Path(__file__).resolve().parent.parent
PAGE, DRAWING = ROOT / "docs/tables/rooms.md", ROOT / "docs/tables/rooms.svg"


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


def reduced(below):
    """The arrows without those that longer paths imply."""

    def reached(room):
        return set(below[room]).union(*(reached(b) for b in below[room]))

    return {
        room: [b for b in direct if not any(b in reached(other) for other in direct)]
        for room, direct in below.items()
    }


def bends(new, at, below):
    return sum(abs(column - at[b][0]) for room, (column, _) in new.items() for b in below[room])


def places(below):
    """By room: column and row in the drawing. The longest path goes straight down; other rooms are
    beside it, near those that they build on."""

    def way(room):
        return [*max((way(b) for b in below[room]), key=len, default=[]), room]

    rows = {room: len(way(room)) - 1 for room in below}
    trunk = max((way(room) for room in below), key=len)
    at = {room: (0, rows[room]) for room in trunk}
    for row in range(len(trunk)):
        beside = [room for room in below if rows[room] == row and room not in at]

        ways = itertools.permutations((1, -1, 2, -2), len(beside))
        placed = [dict(zip(beside, ((c, row) for c in columns), strict=True)) for columns in ways]
        at |= min(placed, key=lambda new, at=at: bends(new, at, below))
    return at


def drawing(below):
    below = reduced(below)
    at = places(below)
    wide, high, box, tall = 150, 66, 110, 34
    left = min(column for column, _ in at.values())
    middle = {
        room: (box / 2 + 1 + (column - left) * wide, tall / 2 + 1 + row * high)
        for room, (column, row) in at.items()
    }
    size = [max(m[i] for m in middle.values()) + e / 2 + 1 for i, e in ((0, box), (1, tall))]
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{size[0]:g}" height="{size[1]:g}" '
        'font-family="sans-serif" font-size="15" text-anchor="middle">',
        '<marker id="tip" markerWidth="8" markerHeight="8" refX="7" refY="4" orient="auto">'
        '<path d="M0 0 8 4 0 8z" fill="#789"/></marker>',
    ]
    for room, others in below.items():
        x1, y1 = middle[room][0], middle[room][1] - tall / 2
        for other in others:
            x0, y0 = middle[other][0], middle[other][1] + tall / 2
            # Down its own column, then across to the room.
            turn = y1 - high + tall
            lines.append(
                f'<path d="M{x0:g} {y0:g}V{turn:g}C{x0:g} {y1:g} {x1:g} {turn:g} {x1:g} {y1:g}" '
                'fill="none" stroke="#789" stroke-width="1.5" marker-end="url(#tip)"/>'
            )
    for room, (x, y) in middle.items():
        lines.append(
            f'<rect x="{x - box / 2:g}" y="{y - tall / 2:g}" width="{box}" height="{tall}" rx="6" '
            f'fill="#e8eef4" stroke="#789"/><text x="{x:g}" y="{y + 5:g}">{room}</text>'
        )
    return "\n".join([*lines, "</svg>", ""])


def page(rooms, below):
    lines = [
        "# Rooms of the code, drawn",
        "",
        "Made by `script/rooms` of `generator/CMakeLists.txt` and of what files include. An arrow",
        "leads to a room that includes the other; what a longer way says has none. Models register",
        "themselves, so nothing includes them.",
        "",
        "![Rooms and arrows](rooms.svg)",
        "",
        *heading("Room of `generator/`", "What it is for", "Includes", "Lines, about"),
    ]
    for room, (doc, _) in rooms.items():
        count = sum(len(text.splitlines()) for text in sources(room))
        uses = ", ".join(below[room]) or "-"
        lines.append(line(f"`{room}`", doc, uses, round(count, -2)))
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    rooms = listed()
    below = included(rooms)
    PAGE.write_text(page(rooms, below), encoding="utf-8")
    DRAWING.write_text(drawing(below), encoding="utf-8")
