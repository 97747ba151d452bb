# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the shared group up to date, through Blender's handlers."""

import bpy
from bpy.app.handlers import persistent

from ..common import app_handlers
from . import emission, filling, kinds, shared_group

#: The scene being rendered.
_rendering = None


def _concerns(update, scene):
    """Whether an update of the dependency graph may change the contents of the slots."""
    item, survey = update.id, filling.memory.survey
    if isinstance(item, bpy.types.Object):
        kind = kinds.of_object(item)
        crowded = len(survey.candidates) > filling.memory.budget.lamps()
        if kind is not None and kind.is_changed(update, survey, crowded):
            return True
        if item.original.name_full in survey.instancers:
            return True
        changed = item.type == "EMPTY" and update.is_updated_geometry
        return changed and item.instance_type != "NONE"
    if isinstance(item, bpy.types.Material):
        known = survey.emission.get(item.original.name_full, 0.0)
        even = item.original.name_full not in survey.uneven
        return emission.of_material(item.original) != known or (
            known > 0 and emission.is_even(item.original) != even
        )
    if isinstance(item, bpy.types.NodeTree):
        # Materials report their own updates.
        return scene.world is not None and item.original == scene.world.node_tree
    return isinstance(
        item, bpy.types.Light | bpy.types.World | bpy.types.Scene | bpy.types.Collection
    )


def _is_limited_anew(updates):
    """Whether there may be room for more or fewer lamps beside the materials. Counting takes time,
    so this looks only at changes of a material or a setting."""
    types = bpy.types.Scene | bpy.types.Material | bpy.types.NodeTree
    if not any(isinstance(u.id, types) for u in updates):
        return False
    return filling.budget_of_file() != filling.memory.budget


@persistent
def _after_update(scene, depsgraph):
    # While another scene renders, its lamps must not be replaced by those of the window's scene.
    group = shared_group.find()
    if filling.memory.busy or _rendering or group is None or scene != filling.current_scene():
        return
    if filling.memory.scene != scene.session_uid or not shared_group.is_whole(group):
        filling.quietly(scene, depsgraph)
        return
    updates = list(depsgraph.updates)
    limited = _is_limited_anew(updates)
    if not limited and not any(_concerns(update, scene) for update in updates):
        return
    structural = any(isinstance(u.id, bpy.types.Scene | bpy.types.Collection) for u in updates)
    # An update of the scene alone is a change of selection; other changes also report objects.
    if structural and len(updates) == 1 and not limited:
        return
    filling.quietly(scene, depsgraph, subject=None if structural else filling.memory.survey.subject)


@persistent
def _after_frame(scene, depsgraph):
    if shared_group.find() is not None and scene.session_uid in {
        _rendering,
        filling.current_scene().session_uid,
    }:
        filling.quietly(scene, depsgraph)


@persistent
def _before_render(scene, *_):
    global _rendering
    _rendering = scene.session_uid
    if shared_group.find() is not None:
        filling.quietly(scene)


@persistent
def _now(*_):
    """After a file was loaded, before it is saved, after an undo, and after a render; and when the
    extension is enabled in an open file, whose lamps may have changed meanwhile."""
    global _rendering
    _rendering = filling.memory.scene = None
    filling.follow()


_HANDLERS = {
    "depsgraph_update_post": _after_update,
    "frame_change_post": _after_frame,
    "render_init": _before_render,
    "render_pre": _before_render,
    "render_complete": _now,
    "render_cancel": _now,
    "save_pre": _now,
    "load_post": _now,
    "undo_post": _now,
    "redo_post": _now,
}


def register():
    """Registers the handlers."""
    app_handlers.register(_HANDLERS)
    # Blender's data can't be read while the extension is being enabled. Without a window timers do
    # not run, and Blender 4.5 as a module does not end while one is registered.
    if not bpy.app.background:
        bpy.app.timers.register(_now, first_interval=0)


def unregister():
    """Unregisters them."""
    if bpy.app.timers.is_registered(_now):
        bpy.app.timers.unregister(_now)
    app_handlers.unregister(_HANDLERS)
