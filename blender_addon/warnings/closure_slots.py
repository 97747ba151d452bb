# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts how much of Cycles' memory at a shading point a material takes.

A closure that finds no free slot is dropped, and its light is lost. The slots of the models'
closures come from the generator (closures/closure.h). Without Open Shading Language, Cycles also
keeps at most 255 numbers at a time; a material that needs more is black.
"""

from dataclasses import dataclass

import bpy

from ..groups import model_nodes
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


#: How many lamps there is room for beside several models as Formula Nodes. Cycles computes what
#: their parts have in common first, for all lamps, and keeps it. Of 255 numbers, two models were
#: measured to need 223 under four area lamps (254 if one is `factors`), three 210 under three, four
#: and five 183 under two. With GLOG_v=3 in its environment, Blender prints the number.
_STACK_ROOM = {2: 4, 3: 3, 4: 2, 5: 2}


@dataclass(frozen=True)
class ClosureUsage:
    """The closure slots that the shaders of a material take without lamps, and for each lamp; and
    the number of its models that are Formula Nodes."""

    slots: int
    slots_per_lamp: int
    trees: int

    def lamps(self):
        """How many lamps there is room for; None if nothing aims at lamps."""
        if not self.slots_per_lamp:
            return None
        return min(self._slot_room(), self._stack_room())

    def is_limited_by_stack(self):
        """Whether numbers are scarcer than slots."""
        return self._stack_room() < self._slot_room()

    def _slot_room(self):
        return max((most() - self.slots) // self.slots_per_lamp, 0)

    def _stack_room(self):
        return _STACK_ROOM.get(self.trees, 1) if self.trees > 1 else most()


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
    slots, slots_per_lamp, trees = 0, 0, 0
    for node in (shown.node for shown in shader_trees.shown(material)):
        if model_nodes.is_ours(node) and (made := model_nodes.manifest_entry(node)):
            aimed_at = made.form.get("lamps") or 0
            slots += _times(node) * (made.form.get("slots", 0) - aimed_at * a_lamp)
            slots_per_lamp += _times(node) * a_lamp * bool(aimed_at)
            trees += bool(aimed_at) and model_nodes.identity(node).form == "nodes"
        else:
            slots += _times(node) * _native_slots(node)
    return ClosureUsage(slots, slots_per_lamp, trees)


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
