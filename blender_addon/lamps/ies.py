# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light an IES Texture lets through."""

import functools
import math
from pathlib import Path

import bpy

#: What Cycles makes of a candela: watts of a lamp over the intensity of one of 1 W.
_OF_CANDELA = 0.0706650768394


@functools.lru_cache(maxsize=64)
def _peak(text):
    """The largest of a file's candelas; None where it is no IES file."""
    _, tilt, rest = text.partition("TILT=")
    numbers = []
    for word in rest.partition("\n")[2].replace(",", " ").split():
        try:
            numbers.append(float(word))
        except ValueError:
            return None
        if not math.isfinite(numbers[-1]):
            return None
    if rest.startswith("INCLUDE"):
        if len(numbers) < 2:
            return None
        # Geometry, a count, and as many angles and factors.
        numbers = numbers[2 + 2 * int(numbers[1]) :]
    if not tilt or len(numbers) < 13:
        return None
    factor, vertical, horizontal = numbers[2], int(numbers[3]), int(numbers[4])
    factor *= numbers[10] * numbers[11]  # of the ballast
    candelas = numbers[13 + vertical + horizontal :]
    return factor * max(candelas[: vertical * horizontal], default=0.0)


def _text(node):
    if node.mode == "INTERNAL":
        return node.ies.as_string() if node.ies is not None else ""
    try:
        path = bpy.path.abspath(node.filepath, library=node.id_data.library)
        return Path(path).read_text(encoding="latin-1")
    except OSError:
        return ""


def level(node):
    """The most that the Fac output of an IES Texture is in any direction, where its Strength is 1;
    1 of what can't be read."""
    peak = _peak(_text(node))
    return 1.0 if peak is None else _OF_CANDELA * peak
