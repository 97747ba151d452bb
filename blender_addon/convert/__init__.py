# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts materials of Blender's own nodes to the nearest models of this extension.

Nothing is changed before apply().
"""

from .apply_restore import apply, is_converted, is_of_conversion, restore
from .cost import cost
from .filter_glossy import warning
from .for_export import has_replaced, replace_by_principled, restore_models
from .node_values import KNOWN_SOCKETS, natives
from .planned_node import LIMIT, Plan
from .plans import plan

__all__ = [
    "KNOWN_SOCKETS",
    "LIMIT",
    "Plan",
    "apply",
    "cost",
    "has_replaced",
    "is_converted",
    "is_of_conversion",
    "natives",
    "plan",
    "replace_by_principled",
    "restore",
    "restore_models",
    "warning",
]
