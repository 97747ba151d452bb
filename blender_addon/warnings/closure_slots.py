# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts how much of Cycles' memory at a shading point a material takes.

A closure that finds no free slot is dropped, and its light is lost. The slots of the models'
closures come from the generator (closures/closure.h). Without Open Shading Language, Cycles also
keeps at most 255 numbers at a time; a material that needs more is black.
"""

import math
from dataclasses import dataclass

import bpy

from .. import lamps
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


#: Numbers that Cycles keeps at a time without Open Shading Language.
_STACK = 255
#: How many of them a material with one model takes besides those of lamps (lamps.Budget) and of the
#: model's formula: `numbers` in the manifest, and those of linked sockets, each with a part of what
#: is computed from it. With GLOG_v=3 in its environment, Blender prints the sum. 22 models were
#: measured to take at most 192 under four area lamps and 243 under eight, `factors` 234 and 247.
#: With all sockets linked, `radziszewski_alda` takes 253 under eight, and `factors`, which has 22
#: colours, 235 under one. `microfacet`, whose base has Metallic nodes with sockets of their own,
#: takes 239 under two, and with linked sockets _METALS more are counted. `thin_film`, whose formula
#: keeps most, has room for five lamps, or three if all of its sockets are linked.
_OF_MATERIAL, _LINKED, _METALS = 85, 1.27, 45
#: How many lamps there is room for beside several models as Formula Nodes. Cycles computes what
#: their parts have in common first, for all lamps, and keeps it. Two models were measured to take
#: 201 under four area lamps (233 if one is `factors`), three 185 under three, four and five 179
#: under two.
_LAMPS_BESIDE = {2: 4, 3: 3, 4: 2, 5: 2}
#: The same where sockets are linked: what follows from them is kept for each lamp and model. Two
#: `microfacet` with one linked socket were measured to take 107 numbers, and 45 to 53 more for each
#: lamp with one cone; a lamp with four takes 150, so no lamp has more than one here.
_LAMPS_BESIDE_LINKED = {2: 2}


@dataclass(frozen=True)
class ClosureUsage:
    """The closure slots that the shaders of a material take without lamps, and for each lamp; the
    number of its models that are Formula Nodes, the numbers that the largest of them keeps, and
    whether any of them has a linked socket."""

    slots: int
    slots_per_lamp: int
    trees: int
    numbers: float = 0
    is_linked: bool = False

    def budget(self):
        """What it leaves for lamps; None if nothing aims at lamps."""
        if not self.slots_per_lamp:
            return None
        return lamps.Budget(max((most() - self.slots) // self.slots_per_lamp, 0), self._numbers())

    def lamps(self):
        """How many lamps there is room for; None if nothing aims at lamps."""
        budget = self.budget()
        return None if budget is None else budget.lamps()

    def is_limited_by_stack(self):
        """Whether numbers are scarcer than slots."""
        budget = self.budget()
        return budget.lamps() < min(budget.closures, lamps.SLOTS)

    def _numbers(self):
        if self.trees > 1:
            beside = _LAMPS_BESIDE_LINKED if self.is_linked else _LAMPS_BESIDE
            return lamps.Budget.LAMP * beside.get(self.trees, 1)
        return _STACK - _OF_MATERIAL - self.numbers if self.trees else math.inf


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
    slots, slots_per_lamp, trees, numbers, is_linked = 0, 0, 0, 0, False
    for node in (shown.node for shown in shader_trees.shown(material)):
        if model_nodes.is_ours(node) and (made := model_nodes.manifest_entry(node)):
            aimed_at = made.form.get("lamps") or 0
            if aimed_at and model_nodes.is_closure(node):
                slots += _times(node) * _NATIVE_SLOTS["ShaderNodeBsdfMetallic"]
                continue
            slots += _times(node) * (made.form.get("slots", 0) - aimed_at * a_lamp)
            slots_per_lamp += _times(node) * a_lamp * bool(aimed_at)
            if aimed_at and model_nodes.identity(node).form == "nodes":
                trees += 1
                linked = sum(
                    3 if s.type in ("VECTOR", "RGBA") else 1 for s in node.inputs if s.is_linked
                )
                own = made.form.get("numbers", 0) + _LINKED * linked
                if linked and pack.model(model_nodes.identity(node).model).may_be_closure:
                    own += _METALS
                numbers, is_linked = max(numbers, own), is_linked or linked > 0
        else:
            slots += _times(node) * _native_slots(node)
    return ClosureUsage(slots, slots_per_lamp, trees, numbers, is_linked)


def _budgets():
    """[(budget, material)] of the materials of the open file that aim at lamps."""
    found = [(of_material(m).budget(), m) for m in bpy.data.materials if m.users]
    return [(budget, material) for budget, material in found if budget is not None]


def lamps_that_fit():
    """(count, material): how many lamps the materials of the open file can aim at, and the material
    that sets this limit. All materials share one list of lamps, so the largest material decides.
    None if no material aims at lamps."""
    rooms = [(budget.lamps(), material) for budget, material in _budgets()]
    return min(rooms, key=lambda found: found[0], default=None)


def budget_of_file():
    """What the materials of the open file leave for lamps, all of which share one list."""
    budgets = [budget for budget, _ in _budgets()]
    if not budgets:
        return lamps.Budget(most())
    return lamps.Budget(*map(min, zip(*budgets, strict=True)))
