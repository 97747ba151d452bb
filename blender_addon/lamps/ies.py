# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates IES Textures: how much light they let through."""

import functools
import math
from pathlib import Path

import bpy

#: Cycles' conversion of a candela: radiant power of a lamp over the intensity of a lamp of 1 W.
_OF_CANDELA = 0.0706650768394


@functools.lru_cache(maxsize=64)
def _peak(text):
    """The largest candela value of an IES file; None if the text is not one."""
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
        # Skips the TILT data: the geometry, a count, and that many angles and factors.
        numbers = numbers[2 + 2 * int(numbers[1]) :]
    if not tilt or len(numbers) < 13:
        return None
    factor, vertical, horizontal = numbers[2], int(numbers[3]), int(numbers[4])
    factor *= numbers[10] * numbers[11]  # ballast factors
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
    """Maximum over directions of an IES Texture's Fac output at Strength 1; 1 if unreadable."""
    peak = _peak(_text(node))
    return 1.0 if peak is None else _OF_CANDELA * peak
