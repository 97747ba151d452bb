# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes of Blender's lights, as far as random rays depend on them."""

import bpy

from .lights import is_sizeless
from .scenes import lamps_of

#: Lamps below this size (metres; radians for a sun) are too rarely hit by random rays.
SMALL_LIGHT = 0.01
SMALL_SUN = 0.02
#: Sizes are stored in single precision.
SLACK = 1e-6


def _sizes_of(light):
    """Names of the properties that make up a light's size."""
    if light.type == "SUN":
        return ("angle",)
    if light.type == "AREA":
        return ("size", "size_y") if light.shape in {"RECTANGLE", "ELLIPSE"} else ("size",)
    return ("shadow_soft_size",)


def smallest(light):
    """The smallest of a light's sizes."""
    return min(getattr(light, name) for name in _sizes_of(light))


def _least_size(light):
    """The size from which random rays hit a light often enough."""
    return SMALL_SUN if light.type == "SUN" else SMALL_LIGHT


def is_tiny(light):
    """Whether random rays hit a light too rarely."""
    return smallest(light) < _least_size(light) * (1 - SLACK)


def sizeless():
    """Names of the visible lamps of the open file that random rays can't hit."""
    found = {item for scene in bpy.data.scenes for item in lamps_of(scene)}
    return sorted({item.name for item in found if is_sizeless(item.data)})


def enlarge(scene):
    """Enlarges the lamps of a scene that are too small for random rays to hit often enough; their
    light stays the same. Returns the names of these lamps and of those that belong to another
    file."""
    done, kept = [], []
    for item in lamps_of(scene):
        light = item.data
        if not is_tiny(light):
            continue
        least = _least_size(light)
        if light.is_editable:
            for name in _sizes_of(light):
                setattr(light, name, max(getattr(light, name), least))
        (done if light.is_editable else kept).append(item.name)
    return done, kept
