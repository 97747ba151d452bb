# SPDX-License-Identifier: GPL-3.0-or-later
"""The state of a Blender node when its conversion was planned."""

import bpy

from ..common.i18n import Sentence, say
from ..groups import usage
from ..trees import animation, shader_trees, shader_values


def _settings(node, instances):
    """{(identifier, label): value} of everything that affects the node's appearance, in each of its
    instances."""
    properties, values = animation.animated_properties(node), shader_values.Constants()
    settings = {("distribution", "Distribution"): getattr(node, "distribution", None)}
    for socket in node.inputs:
        told = {values.told(socket, instance.within) for instance in instances}
        if None in told:
            animated = animation.value_key(socket) in properties
            told = "animated" if animated else "linked"
        settings[socket.identifier, socket.name] = (shader_trees.is_driven(socket), told)
    return settings


class SeenNode:
    def __init__(self, material, node, instances):
        # Remembers names as well: accessing a removed material or node fails or crashes Blender.
        self._material, self._of, self._name = material, material.name, node.name
        tree = node.id_data
        self._group = None if tree.is_embedded_data else tree.session_uid
        self._kind, self._settings = node.bl_idname, _settings(node, instances.of(node))

    def _tree(self):
        if self._group is not None:
            return next((g for g in bpy.data.node_groups if g.session_uid == self._group), None)
        material = next((m for m in bpy.data.materials if m == self._material), None)
        return material.node_tree if material is not None else None

    def now(self, instances):
        """Returns the node. Raises ValueError if it has changed. `instances`: the Instances of the
        file as it is now."""
        tree = self._tree()
        node = tree.nodes.get(self._name) if tree is not None else None
        if node is None or node.bl_idname != self._kind:
            raise usage.stale_error(self._of, say("there is no such node any more"))
        places = instances.of(node)
        materials = dict.fromkeys(place.material for place in places)
        if node not in [shown.node for m in materials for shown in shader_trees.shown(m)]:
            raise usage.stale_error(self._of, say("nothing shows the node any more"))
        for key, value in _settings(node, places).items():
            if value != self._settings.get(key):
                what = say("{setting} is another one", setting=Sentence(key[1]))
                raise usage.stale_error(self._of, what)
        return node
