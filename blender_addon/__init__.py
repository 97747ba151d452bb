# SPDX-License-Identifier: GPL-3.0-or-later
"""brdfc Shaders: reflection models compiled for Cycles, as node groups around an OSL script node.

Scripts use `api`: `from bl_ext.user_default.brdfc_shaders import api`.
"""

import bpy

from . import lamps, operators, usd
from .common import enabling, i18n
from .gltf import glTF2ExportUserExtension as glTF2ExportUserExtension
from .groups import automatic, choice_sockets, imports, update
from .panels import plot_panel, ui
from .warnings import closure_slots, console


def _refuse_beside_another():
    """Refuses to register beside another installed brdfc extension.

    A lean extension, cut to one scene, registers the same menus and operators as the full one;
    whichever is disabled first would unregister the other's."""
    other = getattr(bpy.types, ui.MATERIAL_PT_brdfc.__name__, None)
    if other is not None and other.__module__ != ui.__name__:
        package = other.__module__.removesuffix(".ui").removesuffix(".panels")
        raise RuntimeError(f"{package} is enabled, which has the same menus: disable it first")


def register():
    _refuse_beside_another()
    i18n.register()
    lamps.ask(closure_slots.budget_of_file, lambda: not update.others())
    operators.register()
    ui.register()
    plot_panel.register()
    lamps.register()
    choice_sockets.register()  # before what makes groups anew
    automatic.register()  # after lamps: its handlers read how many there are
    imports.register()
    update.register()
    console.register()
    usd.register()
    enabling.set_registered(True)


def unregister():
    enabling.set_registered(False)
    usd.unregister()
    console.unregister()
    update.unregister()
    imports.unregister()
    lamps.unregister()
    automatic.unregister()
    choice_sockets.unregister()
    plot_panel.unregister()
    ui.unregister()
    operators.unregister()
    i18n.unregister()
