# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of Blender's own nodes, as the model of this extension that comes nearest.

Nothing is changed before apply().
"""

from .node_values import KNOWN_SOCKETS, natives
from .plans import LIMIT, Plan, plan
from .there_and_back import apply, is_converted, restore

__all__ = [
    "KNOWN_SOCKETS",
    "LIMIT",
    "Plan",
    "apply",
    "is_converted",
    "natives",
    "plan",
    "restore",
]
