# SPDX-License-Identifier: GPL-3.0-or-later
"""Has materials whose form is left to choose by itself follow the settings of the scene: a form of
scripts where Open Shading Language runs, and one of Blender's own nodes where Cycles lacks it.

What is exchanged is the content of the models' groups. Materials keep their nodes, and so values,
links, animation and drivers. Blender calls handlers after a step of undo is recorded, and when it
goes back takes what the step before has in common with it to be unchanged. So groups that were
filled by a handler are emptied before a step back, for what they hold may be gone with it, and
filled again afterwards.
"""

from bpy.app.handlers import persistent

from .. import lamps
from ..common import app_handlers
from ..common.i18n import of_error
from ..packs import device
from . import nodes

#: Whether groups are being filled; the scene of which a picture is being made; session_uid of
#: groups that were filled by a handler.
_busy = False
_rendering = None
_filled = set()


def follow(scene=None):
    """Has the groups of the file suit a scene, or that of the first window."""
    global _busy
    if _busy or nodes.is_at_work():
        return
    groups = nodes.automatic_groups()
    scene = scene or lamps.current_scene()
    if not groups or scene is None:
        return
    _busy = True
    try:
        lacks_osl = device.lacks_osl(scene)
        for group in groups:
            if nodes.suit(group, lacks_osl):
                _filled.add(group.session_uid)
    finally:
        _busy = False


def _quietly(scene=None):
    try:
        follow(scene)
    except RuntimeError as error:  # CompileError and PackError: materials stay as they are
        print(f"brdfc: {of_error(error)[0]}")


@persistent
def _after_update(scene, _depsgraph):
    if _rendering is None and not _busy and scene == lamps.current_scene():
        _quietly(scene)


@persistent
def _before_render(scene, *_):
    global _rendering
    _rendering = scene.session_uid
    _quietly(scene)


@persistent
def _before_bake(*_):
    """Blender calls no other handler before it bakes textures."""
    if _rendering is None:
        _quietly()


@persistent
def _now(*_):
    """A file was loaded or is to be saved, a picture is over."""
    global _rendering
    _rendering = None
    _quietly()


@persistent
def _after_load(*_):
    _filled.clear()
    _now()


@persistent
def _before_undo(*_):
    for group in nodes.automatic_groups():
        if group.session_uid in _filled:
            nodes.empty(group)


_HANDLERS = {
    "depsgraph_update_post": _after_update,
    "object_bake_pre": _before_bake,
    "render_init": _before_render,
    "render_pre": _before_render,
    "render_complete": _now,
    "render_cancel": _now,
    "save_pre": _now,
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
