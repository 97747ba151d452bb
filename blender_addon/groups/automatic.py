# SPDX-License-Identifier: GPL-3.0-or-later
"""Switches materials of the form "auto" when the scene's settings change: to a form of OSL scripts
where Open Shading Language runs, and to a form of Blender's own nodes where it doesn't, which is
made again with more room when lamps are added.

Only the contents of the models' groups are replaced. Materials keep their group nodes, and with
them values, links, animation and drivers.

Undo needs care. Blender calls handlers after it has recorded an undo step; and on undo it assumes
that data shared by two steps is unchanged. A group that a handler filled after the step was
recorded may therefore point to data that undo frees. So groups filled by a handler are emptied
before undo and redo, and filled again afterwards.
"""

import functools

from bpy.app.handlers import persistent

from .. import lamps
from ..common import app_handlers
from ..common.i18n import of_error
from ..packs import device
from . import nodes, tables

#: _busy: whether groups are being filled. _rendering: the scene being rendered. Then the
#: session_uid of the groups that a handler has filled.
_busy = False
_rendering = None
_filled = set()


def follow(scene=None):
    """Adapts the automatic groups of the file to a scene, by default to that of the first
    window."""
    global _busy
    if _busy or nodes.is_at_work():
        return
    groups = nodes.automatic_groups()
    scene = scene or lamps.current_scene()
    if not groups or scene is None:
        return
    _busy = True
    try:
        lacks_osl, room_needed = device.lacks_osl(scene), functools.cache(lamps.room_needed)
        for group in groups:
            if nodes.adapt_to_scene(group, lacks_osl, room_needed):
                _filled.add(group.session_uid)
    finally:
        _busy = False


def follow_quietly(scene=None):
    """The same; prints an error instead of raising it."""
    try:
        follow(scene)
    except RuntimeError as error:  # CompileError, PackError: materials stay as they are
        print(f"brdfc: {of_error(error)[0]}")


@persistent
def _after_update(scene, _depsgraph):
    if _rendering is None and not _busy and scene == lamps.current_scene():
        follow_quietly(scene)


@persistent
def _after_frame(scene, _depsgraph):
    """Lamps may be shown from this frame on."""
    if scene.session_uid == _rendering or scene == lamps.current_scene():
        follow_quietly(scene)


@persistent
def _before_render(scene, *_):
    global _rendering
    _rendering = scene.session_uid
    follow_quietly(scene)


@persistent
def _before_job(scene, *_):
    """Before a render that may have many frames."""
    _restore_tables(unpacked_only=True)
    _before_render(scene)


@persistent
def _before_bake(*_):
    """Baking textures calls no other handler."""
    if _rendering is None:
        _restore_tables(unpacked_only=True)
        follow_quietly()


@persistent
def _now(*_):
    """After a file was loaded, and after a render."""
    global _rendering
    _rendering = None
    follow_quietly()


@persistent
def _before_save(*_):
    """Blender would write the parts of a group that has no user, up to 11 MB, and drop one level of
    them each time that the file is opened. And it would keep what was painted on tables, and leave
    out tables that were unpacked."""
    if not nodes.is_at_work():
        nodes.remove_unused_groups()
    _restore_tables()
    _now()


def _restore_tables(unpacked_only=False):
    if nodes.is_at_work():
        return
    try:
        filled = tables.restore(unpacked_only)
        _filled.update(group.session_uid for group in filled)
    except RuntimeError as error:  # CompileError: tables stay as they are
        print(f"brdfc: {of_error(error)[0]}")


@persistent
def _after_load(*_):
    _filled.clear()
    _restore_tables(unpacked_only=True)
    _now()


@persistent
def _before_undo(*_):
    for group in nodes.automatic_groups():
        if group.session_uid in _filled:
            nodes.empty(group)


_HANDLERS = {
    "depsgraph_update_post": _after_update,
    "frame_change_post": _after_frame,
    "object_bake_pre": _before_bake,
    "render_init": _before_job,
    "render_pre": _before_render,
    "render_complete": _now,
    "render_cancel": _now,
    "save_pre": _before_save,
    "load_post": _after_load,
    "undo_pre": _before_undo,
    "redo_pre": _before_undo,
    "undo_post": _now,
    "redo_post": _now,
}


def register():
    app_handlers.register(_HANDLERS)


def unregister():
    app_handlers.unregister(_HANDLERS)
