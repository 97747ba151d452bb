# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicates of warnings about a material as a whole."""

from .. import lamps
from ..groups import model_nodes
from ..trees import shader_trees
from . import closure_slots
from .rows import when


def nodes_off(at):
    """The material has nodes, which Use Nodes in its settings turns off."""
    return when(shader_trees.shading(at.material) is None and model_nodes.group_nodes(at.material))


def too_many_closures(at):
    """The shaders of the material take more than the 64 closures that Cycles keeps at a shading
    point."""
    most = closure_slots.most()
    if at.nodes and at.use.slots > most:
        yield {"slots": at.use.slots, "most": most}


def few_lamps(at):
    """The closures of this material, or the numbers that several models as Formula Nodes keep,
    leave room in Cycles for fewer lamps than the scene has."""
    most = closure_slots.most()
    if not at.nodes or at.use.slots > most:
        return
    room = at.use.lamps()
    if room in (None, lamps.SLOTS):
        return
    if all(lamp.why != lamps.too_many(room) for lamp in at.of_scene.found_lamps):
        return
    if at.use.is_limited_by_stack():
        what = f"{at.use.trees} models" if at.use.trees > 1 else "a large model"
        taken = f"{what} as Formula Nodes, and Cycles has room for 255 numbers"
    else:
        taken = f"{at.use.slots} of {most} slots of closures, and {at.use.slots_per_lamp} a lamp"
    yield {"count": room, "taken": taken}
