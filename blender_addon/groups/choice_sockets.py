# SPDX-License-Identifier: GPL-3.0-or-later
"""Carries choices over when a file comes from another version of Blender. From 5.0 on the sockets
of choices are menus, before they are numbers, and neither takes a value of the other. So nodes get
groups with the sockets of this Blender when a file is opened, or when something is appended.

Blender before 5.0 can't read the value of a menu. Each save therefore also writes choices into a
custom property of their node.
"""

import json

import bpy
from bpy.app.handlers import persistent

from ..common import app_handlers
from ..common.i18n import of_error
from ..content.group_sockets import has_menus, has_own_choices
from . import model_nodes, nodes

#: Custom property of a group node: its choices by parameter.
_SAVED = "brdfc_choices"


def _group_nodes():
    """The group nodes of this extension in trees that this file can change."""
    owners = (*bpy.data.materials, *bpy.data.worlds, *bpy.data.lights)
    trees = [owner.node_tree for owner in owners if owner.library is None and owner.node_tree]
    trees += [g for g in bpy.data.node_groups if g.library is None and nodes.TAG not in g]
    return [node for tree in trees for node in tree.nodes if model_nodes.is_ours(node)]


def carry():
    """Gives nodes whose choices are of another Blender a group of this one; values, links and
    animation stay. A node with a linked choice, which a menu can't have, stays as it is, and so do
    those of another version of the extension."""
    for node in _group_nodes():
        group = node.node_tree
        if group.library is not None or has_own_choices(group):
            continue
        if model_nodes.is_baked(node) or not model_nodes.is_current(group):
            continue
        choices = json.loads(group[nodes.TAG]["choices"])
        present = model_nodes.sockets(node)
        if any(present[name].is_linked for name in choices if name in present):
            continue
        saved = node[_SAVED].to_dict() if _SAVED in node else {}
        known = {name: value for name, value in saved.items() if value in choices.get(name, ())}
        try:
            nodes.renew(node, known)
        except (ValueError, RuntimeError) as error:  # CompileError and PackError are RuntimeErrors
            print(f"brdfc: {of_error(error)[0]}")
            continue
        if _SAVED in node:
            del node[_SAVED]


@persistent
def _after_load(*_):
    carry()


@persistent
def _before_save(*_):
    if not has_menus():
        return
    for node in _group_nodes():
        names = json.loads(node.node_tree[nodes.TAG]["choices"])
        found = {name: model_nodes.get_value(node, name) for name in names}
        found = {name: value for name, value in found.items() if value is not None}
        if found and (_SAVED not in node or node[_SAVED].to_dict() != found):
            node[_SAVED] = found


_HANDLERS = {"load_post": _after_load, "save_pre": _before_save}


def register():
    app_handlers.register(_HANDLERS)


def unregister():
    app_handlers.unregister(_HANDLERS)
