# SPDX-License-Identifier: GPL-3.0-or-later
"""brdfc Shaders: reflection models compiled for Cycles, as node groups around an OSL script node.

Scripts use `api`: `from bl_ext.user_default.brdfc_shaders import api`.
"""

from . import lamps, operators, ui


def register():
    operators.register()
    ui.register()
    lamps.register()


def unregister():
    lamps.unregister()
    ui.unregister()
    operators.unregister()
