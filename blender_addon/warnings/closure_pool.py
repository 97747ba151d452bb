# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts how much of Cycles' closure storage at a shading point a material takes.

On every device the number of closures is limited: one that finds no free slot is dropped, and its
light is lost. On OptiX the number of bytes is limited as well, and Cycles does not check it. The
sizes of the models' closures come from the generator (closures/closure.h, closures/closure_pool.h).
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
    """What the shaders of a material take: closure slots without lamps and for each lamp; likewise
    bytes on OptiX, of the models and of the nodes that combine them; and whether there are other
    shaders, whose sizes are unknown."""

    slots: int
    slots_per_lamp: int
    size: int
    per_lamp: int
    has_others: bool

    def lamps(self, on_optix):
        """How many lamps there is room for; None if nothing aims at lamps."""
        if not self.slots_per_lamp:
            return None
        room = (most_slots() - self.slots) // self.slots_per_lamp
        if on_optix:
            room = min(room, (capacity() - self.size) // self.per_lamp)
        return max(room, 0)


def capacity():
    """Size of OptiX's closure memory in bytes."""
    return pack.manifest()["closure_pool"]["bytes"]


def most_slots():
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
    pool, a_lamp = pack.manifest()["closure_pool"], pack.manifest()["closure_slots"]["lamp"]
    joining = {"ShaderNodeMixShader": pool["mix"], "ShaderNodeAddShader": pool["add"]}
    slots, slots_per_lamp, size, per_lamp, has_others = 0, 0, 0, 0, False
    for node in (shown.node for shown in shader_trees.shown(material)):
        if nodes.is_ours(node) and (made := nodes.manifest_entry(node)):
            aimed_at = made[0].get("lamps") or 0
            slots += _times(node) * (made[0].get("slots", 0) - aimed_at * a_lamp)
            slots_per_lamp += _times(node) * a_lamp * bool(aimed_at)
            size += made[0]["closure_bytes"]
            per_lamp += made[0]["lamp_bytes"]
        elif nodes.is_ours(node) or node.bl_idname not in joining:
            slots += _times(node) * _native_slots(node)
            has_others = True
        else:
            size += joining.get(node.bl_idname, 0)
    return ClosureUsage(slots, slots_per_lamp, size, per_lamp, has_others)


def lamps_that_fit(on_optix):
    """(count, material): how many lamps the materials of the open file can aim at, and the material
    that sets this limit. All materials share one list of lamps, so the largest material decides.
    None if no material aims at lamps."""
    rooms = [
        (room, material)
        for material in bpy.data.materials
        if material.users and (room := of_material(material).lamps(on_optix)) is not None
    ]
    return min(rooms, key=lambda found: found[0], default=None)
