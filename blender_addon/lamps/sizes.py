# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that are too small for random rays: finds and enlarges them."""

import bpy

from . import kinds
from .scenes import lamps_of


def sizeless():
    """Names of the visible lamps of the open file that random rays can't hit."""
    found = {item for scene in bpy.data.scenes for item in lamps_of(scene)}
    return sorted({o.name for o in found if kinds.of_object(o).is_sizeless(o.data)})


def enlarge(scene):
    """Enlarges the lamps of a scene that are too small for random rays to hit often enough; their
    light stays the same. Returns the names of these lamps and of those that belong to another
    file."""
    done, kept = [], []
    for item in lamps_of(scene):
        kind, light = kinds.of_object(item), item.data
        if not kind.is_tiny(light):
            continue
        if light.is_editable:
            for name in kind.sizes(light):
                setattr(light, name, max(getattr(light, name), kind.least_size))
        (done if light.is_editable else kept).append(item.name)
    return done, kept
