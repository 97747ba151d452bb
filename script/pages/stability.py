# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes DIR/index.html about the maps of rounding errors in DIR.

    python -m pages.stability DIR

`brdfc stability --maps DIR` writes the maps, and maps.json, which says what they show.
"""

import json_view

from pages import page


def write(folder):
    maps = json_view.read(folder / "maps.json")
    maps.get("format").choice(1)
    page.write_page(folder, "stability.html.j2", maps=maps.value)


if __name__ == "__main__":
    page.main(__doc__, write)
