# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and preferences, one file per subject."""

import bpy

from .adding import BRDFC_OT_add_node, BRDFC_OT_new_material, BRDFC_OT_search
from .convert import (
    BRDFC_OT_convert,
    BRDFC_OT_convert_back,
    BRDFC_OT_to_models,
    BRDFC_OT_to_principled,
)
from .lean import BRDFC_OT_bake, BRDFC_OT_bake_apply, BRDFC_OT_bake_plan, BRDFC_OT_write_materials
from .measured import (
    BRDFC_FH_measured,
    BRDFC_OT_choose_measured,
    BRDFC_OT_new_measured_library,
    BRDFC_OT_new_measured_material,
)
from .model import (
    BRDFC_OT_add_albedo,
    BRDFC_OT_add_coat,
    BRDFC_OT_details,
    BRDFC_OT_kernel,
    BRDFC_OT_more,
    BRDFC_OT_substance,
    BRDFC_OT_switch,
    BRDFC_OT_update,
)
from .preferences import BRDFC_OT_add_library, BRDFC_OT_remove_library, BrdfcPreferences
from .settings import (
    BRDFC_OT_enable_osl,
    BRDFC_OT_enlarge_lamps,
    BRDFC_OT_find_lamps,
    BRDFC_OT_fix_material,
    BRDFC_OT_make_local,
    BRDFC_OT_no_guiding,
)

_CLASSES = (
    BrdfcPreferences,
    BRDFC_OT_bake,
    BRDFC_OT_bake_plan,
    BRDFC_OT_bake_apply,
    BRDFC_OT_add_albedo,
    BRDFC_OT_add_coat,
    BRDFC_OT_convert,
    BRDFC_OT_convert_back,
    BRDFC_OT_to_models,
    BRDFC_OT_to_principled,
    BRDFC_OT_details,
    BRDFC_OT_more,
    BRDFC_OT_update,
    BRDFC_OT_find_lamps,
    BRDFC_OT_write_materials,
    BRDFC_OT_add_node,
    BRDFC_OT_new_material,
    BRDFC_OT_new_measured_material,
    BRDFC_OT_new_measured_library,
    BRDFC_OT_choose_measured,
    BRDFC_FH_measured,
    BRDFC_OT_search,
    BRDFC_OT_add_library,
    BRDFC_OT_remove_library,
    BRDFC_OT_enable_osl,
    BRDFC_OT_enlarge_lamps,
    BRDFC_OT_fix_material,
    BRDFC_OT_make_local,
    BRDFC_OT_no_guiding,
    BRDFC_OT_substance,
    BRDFC_OT_switch,
    BRDFC_OT_kernel,
)
register, unregister = bpy.utils.register_classes_factory(_CLASSES)
