# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicates of warnings about a material as a whole."""

from .. import lamps
from ..groups import nodes
from ..trees import shader_trees
from . import closure_pool
from .rows import when


def nodes_off(at):
    """The material has nodes, which Use Nodes in its settings turns off."""
    return when(shader_trees.shading(at.material) is None and nodes.group_nodes(at.material))


def too_many_closures(at):
    """The shaders of the material take more than the 64 closures that Cycles keeps at a shading
    point."""
    most = closure_pool.most_slots()
    if at.nodes and at.use.slots > most:
        yield {"slots": at.use.slots, "most": most}


def few_lamps(at):
    """Beside the closures of this material Cycles has room for fewer lamps than the scene has."""
    most = closure_pool.most_slots()
    if not at.nodes or at.use.slots > most:
        return
    room = at.use.lamps(on_optix=False)
    if room is None or all(lamp.why != lamps.too_many(room) for lamp in at.of_scene.found_lamps):
        return
    a_lamp = at.use.slots_per_lamp
    yield {"slots": at.use.slots, "most": most, "slots_per_lamp": a_lamp, "count": room}


def too_much_memory(at):
    """On OptiX, the models of the material take more memory than there is for closures."""
    room = closure_pool.capacity()
    if at.nodes and at.on_optix and at.use.size > room:
        yield {"size": at.use.size, "room": room}


def shared_memory(at):
    """On OptiX, the material has shaders of Blender too, whose memory is unknown."""
    room = closure_pool.capacity()
    if at.nodes and at.on_optix and at.use.size <= room and at.use.has_others:
        yield {"size": at.use.size, "room": room, "per_lamp": at.use.per_lamp}
