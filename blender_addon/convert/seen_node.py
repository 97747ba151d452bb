# SPDX-License-Identifier: GPL-3.0-or-later
"""The state of a Blender node when its conversion was planned."""

import bpy

from ..common.i18n import Sentence, say
from ..groups import usage
from ..trees import animation, shader_trees, shader_values


def _settings(node):
    """{(identifier, label): value} of everything that affects the node's appearance."""
    properties, values = animation.animated_properties(node), shader_values.Constants()
    settings = {("distribution", "Distribution"): getattr(node, "distribution", None)}
    for socket in node.inputs:
        value = values.told(socket)
        if value is None:
            animated = animation.value_key(socket) in properties
            value = "animated" if animated else "linked"
        settings[socket.identifier, socket.name] = (shader_trees.is_driven(socket), value)
    return settings


class SeenNode:
    def __init__(self, material, node):
        # Remembers names as well: accessing a removed material or node fails or crashes Blender.
        self._material, self._of, self._name = material, material.name, node.name
        self._kind, self._settings = node.bl_idname, _settings(node)

    def now(self):
        """Returns the node. Raises ValueError if it has changed."""
        material = next((m for m in bpy.data.materials if m == self._material), None)
        tree = material.node_tree if material is not None else None
        node = tree.nodes.get(self._name) if tree is not None else None
        if node is None or node.bl_idname != self._kind:
            raise usage.stale_error(self._of, say("there is no such node any more"))
        if node not in [shown.node for shown in shader_trees.shown(material)]:
            raise usage.stale_error(self._of, say("nothing shows the node any more"))
        for key, value in _settings(node).items():
            if value != self._settings.get(key):
                what = say("{setting} is another one", setting=Sentence(key[1]))
                raise usage.stale_error(self._of, what)
        return node
