# SPDX-License-Identifier: GPL-3.0-or-later
"""Removes the label of a model from a node that Blender puts in the model's place: Swap (from 5.0
on) copies labels. Models need theirs, as Blender would show the names of their groups, which begin
with a dot."""

import bpy
from bpy.app.handlers import persistent

from ..common import app_handlers, editable
from ..packs import pack
from . import model_nodes

#: By the session's number of a material or node group: {name of a node: the label of its model}.
#: The label is None for other nodes, and for a model's node with a label of the user.
_known = {}


#: What has nodes of models.
_OWNERS = bpy.types.Material | bpy.types.ShaderNodeTree


def _label(node):
    if not model_nodes.is_ours(node):
        return None
    name = node.node_tree[model_nodes.TAG]["model"]
    if name not in pack.model_names() or node.label != pack.model(name).label:
        return None
    return node.label


def _labels(tree):
    return {node.name: _label(node) for node in tree.nodes}


def _tree_of(block):
    """The tree of a block that may contain nodes of models; None for other blocks."""
    if isinstance(block, bpy.types.Material):
        return block.node_tree
    if isinstance(block, bpy.types.ShaderNodeTree) and not block.is_embedded_data:
        return None if model_nodes.TAG in block else block
    return None


def _follow(block):
    tree = _tree_of(block)
    if tree is None or editable.refusal(block):
        return
    before, now = _known.get(block.session_uid, {}), _labels(tree)
    lost = {label for name, label in before.items() if label and not now.get(name)}
    if lost:
        for node in tree.nodes:
            if node.name not in before and now[node.name] is None and node.label in lost:
                node.label = ""
    _known[block.session_uid] = now


@persistent
def _after_update(_scene, depsgraph):
    try:
        changed = [update.id for update in depsgraph.updates if isinstance(update.id, _OWNERS)]
        for block in dict.fromkeys(evaluated.original for evaluated in changed):
            _follow(block)
    except pack.PackError:  # the panel says so
        pass


@persistent
def _after_load(*_):
    _known.clear()
    for block in (*bpy.data.materials, *bpy.data.node_groups):
        try:
            _follow(block)
        except pack.PackError:
            return


_HANDLERS = {"depsgraph_update_post": _after_update, "load_post": _after_load}


def register():
    if bpy.app.version >= (5, 0, 0):
        app_handlers.register(_HANDLERS)


def unregister():
    app_handlers.unregister(_HANDLERS)
    _known.clear()
