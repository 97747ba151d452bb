# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables in Markdown, for the pages that scripts make."""


def line(*cells):
    """A row of a table; cells are converted by str()."""
    return f"| {' | '.join(str(cell) for cell in cells)} |"


def heading(*cells):
    """The lines above the first row of cells."""
    return [line(*cells), "|---" * len(cells) + "|"]


def percent(part):
    """A share in percent, to two digits; 0 if only rounding errors are left."""
    return "0" if part < 1e-5 else f"{float(f'{100 * part:.2g}'):g} %"
