# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables in Markdown, for the pages that scripts make."""


def line(*cells):
    """A row; cells as str() has them."""
    return f"| {' | '.join(str(cell) for cell in cells)} |"


def heading(*cells):
    """The lines above the first row."""
    return [line(*cells), "|---" * len(cells) + "|"]


def percent(part):
    """A part of the whole to two digits; 0 where only rounding is left."""
    return "0" if part < 1e-5 else f"{float(f'{100 * part:.2g}'):g} %"
