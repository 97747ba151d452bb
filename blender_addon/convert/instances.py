# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a node is shown: a node of a node group may be shown by several materials, and by several
group nodes of one, whose inputs have different values."""

from dataclasses import dataclass

import bpy

from ..common import editable
from ..trees import shader_trees


@dataclass(frozen=True)
class Instance:
    """A place where a node is shown; `within` as for shader_trees.reach()."""

    material: object
    within: tuple = ()


class Instances:
    """Finds the instances of nodes. The file must not change meanwhile, as it is searched once."""

    def __init__(self):
        self._found = None

    def of(self, node):
        """[Instance] of a node that a material shows."""
        tree = node.id_data
        if tree.is_embedded_data:
            return [Instance(editable.named(tree))]
        if self._found is None:
            self._found = _in_groups()
        return self._found.get(node.as_pointer(), [])


def _in_groups():
    """{pointer: [Instance]} of every node that materials show in node groups."""
    found = {}
    for material in bpy.data.materials:
        for shown in shader_trees.shown_by(material.node_tree) if material.node_tree else ():
            if shown.within:
                place = Instance(material, shown.within)
                found.setdefault(shown.node.as_pointer(), []).append(place)
    return found
