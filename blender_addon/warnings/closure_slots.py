# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts how many of Cycles' closure slots at a shading point a material takes.

A closure that finds no free slot is dropped, and its light is lost. The slots of the models'
closures come from the generator (closures/closure.h).
"""

from dataclasses import dataclass

import bpy

from ..groups import nodes
from ..packs import pack
from ..trees import shader_trees

#: Slots that Blender's own nodes take. In Cycles 4.5 to 5.2 (kernel/osl/closures_setup.h,
#: kernel/svm/closure.h) a closure takes one, and a second one for its Fresnel term.
_NATIVE_SLOTS = {
    "ShaderNodeMixShader": 0,
    "ShaderNodeAddShader": 0,
    "ShaderNodeEmission": 0,
    "ShaderNodeBackground": 0,
    "ShaderNodeBsdfGlass": 2,
    "ShaderNodeBsdfMetallic": 3,
    "ShaderNodeBsdfHairPrincipled": 3,
    "ShaderNodeSubsurfaceScattering": 3,
    "ShaderNodeBsdfPrincipled": 3,
}
#: Additional slots of a Principled node for each socket that is linked or differs from this value.
_PRINCIPLED_SLOTS = {
    "Metallic": (0.0, 2),
    "Transmission Weight": (0.0, 2),
    "Coat Weight": (0.0, 2),
    "Sheen Weight": (0.0, 1),
    "Subsurface Weight": (0.0, 3),
    "Alpha": (1.0, 1),
}


@dataclass(frozen=True)
class ClosureUsage:
    """The closure slots that the shaders of a material take without lamps, and for each lamp."""

    slots: int
    slots_per_lamp: int

    def lamps(self):
        """How many lamps there is room for; None if nothing aims at lamps."""
        if not self.slots_per_lamp:
            return None
        return max((most() - self.slots) // self.slots_per_lamp, 0)


def most():
    """The number of closure slots in Cycles."""
    return pack.manifest()["closure_slots"]["most"]


def _native_slots(node):
    taken = _NATIVE_SLOTS.get(node.bl_idname, 1)
    if node.bl_idname == "ShaderNodeBsdfPrincipled":
        for name, (off, more) in _PRINCIPLED_SLOTS.items():
            socket = node.inputs.get(name)
            if socket is not None and (
                shader_trees.is_driven(socket) or socket.default_value != off
            ):
                taken += more
    return taken


def _times(node):
    """How often a node contributes to the sum: once for each link from its output."""
    links = (link for s in node.outputs if s.type == "SHADER" for link in s.links)
    return max(sum(map(shader_trees.counts, links)), 1)


def of_material(material):
    """The ClosureUsage of a material: of all nodes that its output for Cycles depends on."""
    a_lamp = pack.manifest()["closure_slots"]["lamp"]
    slots, slots_per_lamp = 0, 0
    for node in (shown.node for shown in shader_trees.shown(material)):
        if nodes.is_ours(node) and (made := nodes.manifest_entry(node)):
            aimed_at = made[0].get("lamps") or 0
            slots += _times(node) * (made[0].get("slots", 0) - aimed_at * a_lamp)
            slots_per_lamp += _times(node) * a_lamp * bool(aimed_at)
        else:
            slots += _times(node) * _native_slots(node)
    return ClosureUsage(slots, slots_per_lamp)


def lamps_that_fit():
    """(count, material): how many lamps the materials of the open file can aim at, and the material
    that sets this limit. All materials share one list of lamps, so the largest material decides.
    None if no material aims at lamps."""
    rooms = [
        (room, material)
        for material in bpy.data.materials
        if material.users and (room := of_material(material).lamps()) is not None
    ]
    return min(rooms, key=lambda found: found[0], default=None)
