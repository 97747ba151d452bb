# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces the groups that an appended or dragged material brings by equal groups of the file,
removes the lamps of the other file that these groups bring, and updates the list of lamps.

Blender itself would add another copy with each drag if the file has made its own group.
"""

import bpy
from bpy.app.handlers import persistent

from .. import lamps
from ..common import app_handlers
from ..content import part_groups
from . import automatic, choice_sockets, model_nodes, nodes


def _dependencies(context, kind):
    """The blocks of a kind that were imported as dependencies. Those that the user asked for by
    name must stay, as Blender goes on to use them."""
    return [
        item.id
        for item in context.import_items
        if item.id_type == kind
        and item.append_action == "MAKE_LOCAL"
        and "INDIRECT_USAGE" in item.import_info
        and item.id is not None
        and item.id.library is None
    ]


def _remove_lamps(context, groups):
    """Removes the imported objects that nothing reads but the lists of lamps among `groups`, by
    drivers. Blender puts them in the scene, where they would shine."""
    lists = {group for group in groups if lamps.is_group(group)}
    objects = set(_dependencies(context, "OBJECT")) if lists else set()
    imported = {item.id for item in context.import_items}

    def is_needed(user):
        in_scene = isinstance(user, bpy.types.Scene | bpy.types.Collection)
        return user not in lists and not (in_scene and user not in imported)

    # A parent is idle once its children are removed.
    while idle := _idle(objects, is_needed):
        objects -= idle
        held = {one.data for one in idle} - {None}
        bpy.data.batch_remove(idle)
        bpy.data.batch_remove([data for data in held if data.users == 0])


def _idle(objects, is_needed):
    """The objects of which is_needed(user) is false for all users."""
    users = bpy.data.user_map(subset=objects)
    return {one for one in objects if not any(map(is_needed, users[one]))}


@persistent
def _after_import(context):
    imported = _dependencies(context, "NODETREE")
    _remove_lamps(context, imported)
    # Each further append examines all that the file has, many times.
    known = {group.session_uid for group in imported if not part_groups.is_part(group)}
    part_groups.merge_copies(imported)
    imported = [group for group in bpy.data.node_groups if group.session_uid in known]
    groups = [group for group in imported if model_nodes.TAG in group]
    known = {group.session_uid for group in groups}
    choice_sockets.carry()
    if groups or any(lamps.is_group(group) for group in imported):
        lamps.follow()
        automatic.follow()
    if any(item.id_type == "NODETREE" for item in context.import_items):
        # Some may be gone already: the parts of a group that has changed its form.
        nodes.merge_duplicates(
            [group for group in bpy.data.node_groups if group.session_uid in known]
        )


def register():
    app_handlers.register({"blend_import_post": _after_import})


def unregister():
    app_handlers.unregister({"blend_import_post": _after_import})
