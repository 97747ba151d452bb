# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds objects that place instances of light sources: by object instancing, particles or geometry
nodes."""

import bpy

from . import emission, kinds

#: Maximum depth of nested collection instances.
_DEPTH = 4


def _inputs_of(modifier):
    """Values of the inputs of a geometry nodes modifier."""
    if hasattr(modifier, "properties"):  # since 5.2
        inputs = modifier.properties.inputs
        return [getattr(getattr(inputs, key), "value", None) for key in inputs.keys()]
    return [modifier[key] for key in modifier.keys()]


class Instancers:
    """Examines objects one at a time, and each collection and node tree only once. `emitting`: the
    emissive materials."""

    def __init__(self, emitting):
        self._emitting = set(emitting)
        self._collections, self._trees = {}, {}

    def places(self, item, depth=0):
        """Whether an object places instances of lamps or of emissive objects."""
        if item.instance_type == "COLLECTION":
            if self._collection(item.instance_collection, depth):
                return True
        elif item.instance_type in {"VERTS", "FACES"}:
            if any(self._shines(child, depth) for child in item.children):
                return True
        for system in item.particle_systems:
            settings = system.settings
            if settings.render_type == "OBJECT" and self._shines(settings.instance_object, depth):
                return True
            if settings.render_type == "COLLECTION" and self._collection(
                settings.instance_collection, depth
            ):
                return True
        for modifier in item.modifiers:
            if modifier.type == "NODES" and modifier.node_group is not None:
                found, made, painted = self._tree(modifier.node_group, depth)
                values = _inputs_of(modifier)
                painted = painted or emission.is_painted(item, self._emitting)
                painted = painted or any(v in self._emitting for v in _blocks(values))
                if found or (made and painted) or self._any(values, depth):
                    return True
        return False

    def _shines(self, item, depth):
        if item is None:
            return False
        kind = kinds.of_object(item)
        if kind is not None and kind.may_shine(item, self._emitting):
            return True
        return depth < _DEPTH and self.places(item, depth + 1)

    def _collection(self, collection, depth):
        if collection is None:
            return False
        if collection not in self._collections:
            self._collections[collection] = False  # the answer while it is being examined
            self._collections[collection] = any(
                self._shines(item, depth) for item in collection.all_objects
            )
        return self._collections[collection]

    def _any(self, values, depth):
        """Whether one of these values is an emissive object or a collection that contains one."""
        for value in _blocks(values):
            if isinstance(value, bpy.types.Object) and self._shines(value, depth):
                return True
            if isinstance(value, bpy.types.Collection) and self._collection(value, depth):
                return True
        return False

    def _tree(self, tree, depth):
        """Whether a geometry node tree refers to a light source, makes instances, or assigns an
        emissive material."""
        if tree not in self._trees:
            self._trees[tree] = (False, False, False)
            found = made = painted = False
            for node in tree.nodes:
                values = [getattr(socket, "default_value", None) for socket in node.inputs]
                found = found or self._any(values, depth)
                made = made or node.bl_idname == "GeometryNodeInstanceOnPoints"
                painted = painted or any(v in self._emitting for v in _blocks(values))
                if inner := getattr(node, "node_tree", None):
                    parts = self._tree(inner, depth)
                    found, made, painted = (
                        a or b for a, b in zip((found, made, painted), parts, strict=True)
                    )
            self._trees[tree] = found, made, painted
        return self._trees[tree]


def _blocks(values):
    return [value for value in values if isinstance(value, bpy.types.ID)]
