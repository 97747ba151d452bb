# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells shaders where the lamps are: forms that aim closures at lamps read one shared node group.

Its outputs, four vectors per slot, are constants to Cycles. Moving lamps are followed by drivers
without Python expressions; so a saved file renders and animates correctly even where the extension
is not installed and scripts may not run. An outdated list causes noise, and loses the light of
lamps without a size that are missing from it; apart from that, forms stay correct.
"""

from .filling import (
    ask,
    count,
    current_scene,
    ensure_group,
    follow,
    last_found,
    not_followed,
    refresh,
    room_needed,
)
from .handlers import register, unregister
from .kinds import of_light as kind_of
from .kinds.light import has_importance
from .scenes import lamps_of
from .shared_group import find as find_group
from .shared_group import is_shared as is_group
from .shared_group import remove_unused as remove_unused_group
from .sizes import enlarge, sizeless
from .slots import (
    NO_NEED,
    SLOTS,
    WHOLE,
    Budget,
    Lamp,
    Room,
    by_slot,
    elsewhere,
    part_names,
    too_many,
)

__all__ = [
    "NO_NEED",
    "SLOTS",
    "WHOLE",
    "Budget",
    "Lamp",
    "Room",
    "ask",
    "by_slot",
    "count",
    "current_scene",
    "elsewhere",
    "enlarge",
    "ensure_group",
    "find_group",
    "follow",
    "has_importance",
    "is_group",
    "kind_of",
    "lamps_of",
    "last_found",
    "not_followed",
    "part_names",
    "refresh",
    "register",
    "remove_unused_group",
    "room_needed",
    "sizeless",
    "too_many",
    "unregister",
]
