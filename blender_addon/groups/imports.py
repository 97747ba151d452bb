# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces the groups that an appended, dragged or pasted material brings by equal groups of the
file, removes the lamps of the other file that these groups bring, and updates the list of lamps.

Blender itself would add another copy with each drag if the file has made its own group.
"""

import re
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from .. import lamps
from ..common import app_handlers, copy_buffer
from ..content import part_groups
from . import automatic, choice_sockets, model_nodes, nodes

#: The objects of linked files that are in no collection, as they were after the last update: type
#: and stem of the name, by library and name. And the session's numbers of the file's own objects.
#: Both are kept only where a list of lamps is linked.
_hidden, _own = {}, set()


def _dependencies(context, kind, copied=None):
    """The blocks of a kind that were imported as dependencies. Those that the user asked for by
    name must stay, as Blender goes on to use them. `copied`: the names of those of a paste."""

    def is_dependency(item):
        if copied is None:
            return "INDIRECT_USAGE" in item.import_info
        return item.name not in copied

    return [
        item.id
        for item in context.import_items
        if item.id_type == kind
        and item.append_action == "MAKE_LOCAL"
        and is_dependency(item)
        and item.id is not None
        and item.id.library is None
    ]


def _copied(context):
    """The names of the objects that the user copied, if this is a paste; None if it is not."""
    paths = {item.source_library.filepath for item in context.import_items if item.source_library}
    if {Path(path).name for path in paths} != {copy_buffer.NAME}:
        return None
    try:
        return copy_buffer.copied_objects(*paths)
    except (ValueError, OSError):  # written by a Blender that is not known yet
        return None


def _remove_lamps(context, groups):
    """Removes the imported objects that nothing reads but the lists of lamps among `groups`, by
    drivers. Blender puts them in the scene, where they would shine."""
    lists = {group for group in groups if lamps.is_group(group)}
    if not lists:
        return
    imported = {item.id for item in context.import_items}
    objects = _dependencies(context, "OBJECT", _copied(context))
    idle = _only_listed(objects, lists, imported)
    held = {one.data for one in idle} - {None}
    bpy.data.batch_remove(idle)
    bpy.data.batch_remove([data for data in held if data.users == 0])


def _only_listed(objects, lists, asked_for=frozenset()):
    """The objects that nothing reads but these lists, scenes and collections that nobody
    `asked_for`, and one another."""
    users, idle = bpy.data.user_map(subset=objects), set()

    def is_needed(user):
        in_scene = isinstance(user, bpy.types.Scene | bpy.types.Collection)
        return user not in lists | idle and not (in_scene and user not in asked_for)

    # A parent is idle once its children are.
    while more := {one for one in users if one not in idle and not any(map(is_needed, users[one]))}:
        idle |= more
    return idle


def _leave_out_lamps(scene):
    """Takes objects out of the scene that Blender's Make Local > All put there, as the lists of
    lamps of linked materials read them. Blender may hold pointers to them while handlers run, so
    they are not removed; without a user they are not saved."""
    global _hidden, _own
    # This runs at each update of the dependency graph.
    if not _hidden and not bpy.data.libraries:
        return
    lists = {group for group in bpy.data.node_groups if lamps.is_group(group)}
    is_linked = any(group.library for group in lists)
    if not _hidden and not is_linked:
        return
    linked = {_of_library(one): one for one in bpy.data.objects if one.library}
    # Make Local replaces the linked objects. As long as they are there, a new object of such a name
    # is the user's: added, duplicated or brought back by undo.
    replaced = {kind for place, kind in _hidden.items() if place not in linked}
    came = replaced and [one for one in scene.objects if _has_come(one, replaced)]
    for one in _only_listed(came, lists) if came else ():
        for collection in one.users_collection:
            collection.objects.unlink(one)
    if not is_linked:
        _forget()
        return
    _hidden = {p: _kind(one) for p, one in linked.items() if not one.users_collection}
    _own = {one.session_uid for one in bpy.data.objects if not one.library}


def _has_come(item, replaced):
    """Whether an object is a local copy of one that was linked."""
    return item.library is None and item.session_uid not in _own and _kind(item) in replaced


def _of_library(item):
    return item.library.filepath, item.name


def _kind(item):
    # Blender numbers a copy if its name is taken.
    return item.type, re.sub(r"\.\d+$", "", item.name)


@persistent
def _after_update(scene, _):
    _leave_out_lamps(scene)


@persistent
def _forget(*_):
    """What is known of a file says nothing about the next one."""
    _hidden.clear()
    _own.clear()


def _is_last(handler, handlers):
    """Whether a handler is the last of those of an event, behind which it puts itself otherwise.
    Those that other add-ons added later would meet pointers to blocks that it has removed."""
    if handlers[-1] != handler:
        handlers.append(handler)
        return False
    while handlers.index(handler) < len(handlers) - 1:
        handlers.remove(handler)  # the first
    return True


@persistent
def _after_import(context):
    if not _is_last(_after_import, bpy.app.handlers.blend_import_post):
        return
    imported = _dependencies(context, "NODETREE")
    _remove_lamps(context, imported)
    # Each further append examines all that the file has, many times.
    known = {group.session_uid for group in imported if not part_groups.is_part(group)}
    part_groups.merge_copies(imported)
    imported = [group for group in bpy.data.node_groups if group.session_uid in known]
    groups = [group for group in imported if model_nodes.TAG in group]
    known = {group.session_uid for group in groups}
    if not nodes.is_at_work():  # groups under construction lack what is told of them
        choice_sockets.carry()
    if groups or any(lamps.is_group(group) for group in imported):
        lamps.follow()
        automatic.follow()
    if any(item.id_type == "NODETREE" for item in context.import_items):
        # Some may be gone already: the parts of a group that has changed its form.
        nodes.merge_duplicates(
            [group for group in bpy.data.node_groups if group.session_uid in known]
        )
    _leave_out_lamps(bpy.context.scene)


_HANDLERS = {
    "blend_import_post": _after_import,
    "depsgraph_update_post": _after_update,
    "load_pre": _forget,
}


def register():
    app_handlers.register(_HANDLERS)


def unregister():
    app_handlers.unregister(_HANDLERS)
