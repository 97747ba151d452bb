# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of lamps, one file each. A new kind is a file and an entry in KINDS: see
docs/add-a-lamp.md."""

from .area import Area
from .bright_spot import BrightSpot
from .mesh import Mesh
from .point import Point
from .sky_sun import SkySun
from .spot import Spot
from .sun import Sun

#: Every kind of lamp.
KINDS = (Sun(), Point(), Spot(), Area(), Mesh(), SkySun(), BrightSpot())


def of_object(item):
    """The kind of lamp that an object may be, or None."""
    read = item.data.type if item.type == "LIGHT" else item.type
    return next((kind for kind in KINDS if read in kind.objects), None)


def of_light(light):
    """The kind of one of Blender's lights."""
    return next(kind for kind in KINDS if light.type in kind.objects)


def of_node(node):
    """The kind of the lamps that a node of a world shows, or None."""
    return next((kind for kind in KINDS if node.bl_idname in kind.nodes), None)


def forget():
    """Clears what kinds have cached, so that files are examined anew."""
    for kind in KINDS:
        kind.forget()
