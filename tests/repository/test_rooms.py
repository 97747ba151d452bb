# SPDX-License-Identifier: GPL-3.0-or-later
"""Each room includes only rooms that it links, and that are above it; the page that draws them is
up to date."""

import re
from pathlib import Path

import pytest
import rooms_page

ROOT = Path(__file__).resolve().parents[2]
ROOMS = rooms_page.listed()
BELOW = rooms_page.included(ROOMS)


def test_every_folder_is_a_room():
    assert {p.parent.name for p in (ROOT / "generator").glob("*/*.cpp")} == set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_includes_what_it_links_and_that_is_above(room):
    order = list(ROOMS)
    assert BELOW[room] == ROOMS[room][1], "as generator/CMakeLists.txt lists it, in its order"
    assert all(order.index(other) < order.index(room) for other in BELOW[room])


def test_the_page_is_that_of_now():
    def without_lines(page):  # they change with every change
        return re.sub(r"\| \d+ \|$", "|", page, flags=re.M)

    written = rooms_page.PAGE.read_text(encoding="utf-8")
    assert without_lines(written) == without_lines(rooms_page.page(ROOMS, BELOW)), "script/rooms"
    drawing = rooms_page.DRAWING.read_text(encoding="utf-8")
    assert drawing == rooms_page.drawing(BELOW), "script/rooms"
