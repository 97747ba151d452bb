# SPDX-License-Identifier: GPL-3.0-or-later
"""A node of Blender's own as a plan of its conversion saw it."""

import bpy

from ..common.i18n import Sentence, say
from ..groups import usage
from ..trees import animation, shader_trees, shader_values


def _settings(node):
    """{(identifier, label): value} of all that decides what a node looks like."""
    moved, values = animation.moved(node), shader_values.Constants()
    settings = {("distribution", "Distribution"): getattr(node, "distribution", None)}
    for socket in node.inputs:
        value = values.told(socket)
        if value is None:
            animated = animation.value_of(socket) in moved
            value = "animated" if animated else "linked"
        settings[socket.identifier, socket.name] = (shader_trees.is_driven(socket), value)
    return settings


class SeenNode:
    def __init__(self, material, node):
        # Names too: of what is removed Blender tells nothing, or crashes.
        self._material, self._of, self._name = material, material.name, node.name
        self._kind, self._settings = node.bl_idname, _settings(node)

    def now(self):
        """The node. Raises ValueError where it is not as it was."""
        material = next((m for m in bpy.data.materials if m == self._material), None)
        tree = material.node_tree if material is not None else None
        node = tree.nodes.get(self._name) if tree is not None else None
        if node is None or node.bl_idname != self._kind:
            raise usage.stale(self._of, say("there is no such node any more"))
        if node not in [shown.node for shown in shader_trees.shown(material)]:
            raise usage.stale(self._of, say("nothing shows the node any more"))
        for key, value in _settings(node).items():
            if value != self._settings.get(key):
                what = say("{setting} is another one", setting=Sentence(key[1]))
                raise usage.stale(self._of, what)
        return node
