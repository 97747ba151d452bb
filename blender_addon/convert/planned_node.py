# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of a node: the models that replace it, their error, and the same in words. plans.py
makes plans, replacement.py carries them out."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ..common.i18n import Sentence, in_percent, say
from ..nearest import specular
from ..packs import pack
from ..trees import shader_values
from .kept_effects import (
    SUBSURFACE_SHARED,
    SUBSURFACE_SOCKETS,
    TRANSMISSION,
    TRANSMISSION_SHARED,
    UPPER_SOCKETS,
)
from .node_values import ANISOTROPY, KINDS
from .seen_node import SeenNode

#: A row of a plan names this many other materials at most.
_MOST_NAMES = 6
#: A plan with a larger error is refused, unless another limit is given.
LIMIT = 0.35
#: The cause of a larger error is looked for, which takes up to seven fits, a second each.
_LARGE = 0.05


@dataclass(frozen=True)
class Part:
    """A model with its values that replaces a node, or the metallic part of one."""

    model: str = ""
    values: dict = field(default_factory=dict)
    #: Parameters by socket of the node.
    links: dict = field(default_factory=dict)
    #: Parameters that follow a linked roughness or anisotropy: (name, factor, power, low, high,
    #: stretched) for factor * roughness^power * (1 - 0.9 anisotropy)^stretched, clamped. A power of
    #: 0 stands for what is not linked.
    widths: tuple = ()
    #: The matte base beneath the model, and the light that it gets: coefficients of layer.rest().
    base: "Part | None" = None
    rest: tuple = ()
    #: How the interreflection of `microfacet` follows a linked colour or roughness: the slope and
    #: offset of the mean reflectance in the colour, the mean albedo of facets that reflect
    #: everything, as coefficients of roughness^j, and the socket of the colour.
    again: tuple = ()
    #: A factor of the model's light; and the socket of the colour, if that is linked: its brightest
    #: channel is the factor, and the model has the colour divided by it.
    scale: float = 1.0
    flat: str = ""
    #: The socket that the widths and the polynomial of the rest follow.
    rough: str = "Roughness"
    #: How parameters follow an input that varies: {name: coefficients (r, g, b) of share^j}, as
    #: specular.VaryingFit has them. The rest then is a polynomial in the largest share.
    laws: dict = field(default_factory=dict)
    varying: specular.Varying | None = None
    #: A parameter that is the root of a linked colour, and the socket of that colour.
    root: tuple = ()

    @property
    def label(self):
        label = pack.model(self.model).label
        return say("{model} over {base}", model=label, base=self.base.label) if self.base else label


@dataclass(frozen=True)
class Plan(Part):
    """How a node of a material would be converted; or the reason (`refusal`) why not."""

    material: object = None
    node: object = None
    #: Fraction of the light that the model misplaces, in a picture lit by lamps as wide as windows,
    #: averaged over view cosines from 0.95 to 0.25. If it depends on linked values, this is the
    #: maximum. Infinite if the plan was refused without a model.
    error: float = math.inf
    #: The minimum, if the error depends on linked values.
    least_error: float = math.inf
    #: The model for the node's metallic part, mixed with the other one by the node's Metallic.
    metal: Part | None = None
    #: Whether an Emission node is added, and whether a Transparent node is mixed in by the node's
    #: Alpha.
    glows: bool = False
    transparent: bool = False
    #: The kept_effects.Uppers that lie over the models.
    uppers: tuple = ()
    #: The IOR of the Subsurface Scattering node that is mixed into the base; 0 if there is none.
    subsurface: float = 0.0
    #: Whether a Principled node that transmits light is mixed in by the node's Transmission Weight.
    transmits: bool = False
    #: Whether the models need the node's tangent: that of its link or Cycles' default one, turned.
    anisotropic: bool = False
    #: Whether Filter Glossy blurs the node so that it shows, but not its model.
    filtered: bool = False
    refusal: str = ""
    #: If the node is in a node group: the other materials that contain it, and the group's inputs
    #: that had an effect on the node and have none on its replacement.
    others: tuple = ()
    unused: tuple = ()
    #: The sockets of the node that drivers read, where these go on reading the replaced node, and
    #: the names of the materials, objects and so on that have such drivers.
    read: tuple = ()
    readers: tuple = ()
    #: The state of the node when the plan was made.
    seen: SeenNode | None = None
    #: Finds the input that makes the error large, and returns its name, or "".
    cause: Callable = field(default=str, repr=False, compare=False)

    @property
    def parts(self):
        """The models that replace the node: the first one, its base, and the metal."""
        return [part for part in (self, self.base, self.metal) if part]

    def within(self, limit):
        """The same plan, refused if its error exceeds a limit."""
        if self.refusal or self.error <= limit:
            return self
        of = {"model": self._label(), "percent": self._percent()}
        if self.error > _LARGE and (socket := self.cause()):
            why = say(
                "its nearest model, {model}, sends {percent} % of the light in other directions "
                "than the node, because of its {socket}",
                **of,
                socket=Sentence(socket),
            )
        else:
            why = say(
                "its nearest model, {model}, sends {percent} % of the light in other directions "
                "than the node",
                **of,
            )
        return replace(self, refusal=why)

    def _label(self):
        if self.metal:
            metal = self.metal.label
            return say("{model} mixed with {metal} by Metallic", model=self.label, metal=metal)
        return self.label

    def _percent(self):
        # A model that is brighter than the node may misplace more light than that has.
        low, high = (in_percent(min(error, 1.0)) for error in (self.least_error, self.error))
        return high if low == high else say("{low} to {high}", low=low, high=high)

    @property
    def effects(self):
        """The sockets of those effects of the node that stay Blender's own."""
        found = {name for upper in self.uppers for name in UPPER_SOCKETS[upper.name]}
        found |= {TRANSMISSION} if self.transmits else set()
        subsurface = SUBSURFACE_SOCKETS if self.subsurface else ()
        return found | {name for name in subsurface if name in self.node.inputs}

    @property
    def kept(self):
        """The sockets of the node whose links stay."""
        parts = [part for part in self.parts if part.model]
        found = {socket for part in parts for socket in part.links.values()}
        found |= {"Normal", "Tangent"} & set(self.node.inputs.keys())
        found |= {part.rough for part in parts if part.widths}
        if any(part.again for part in parts) or len(self.rest and self.rest[0]) > 1:
            found.add(self.varying.socket if self.varying else "Roughness")
        if self.anisotropic:
            found |= set(ANISOTROPY[KINDS[self.node.bl_idname]])
        found |= {part.again[3] for part in parts if part.again}
        found |= {part.flat for part in parts if part.flat}
        found |= {part.root[1] for part in parts if part.root}
        found |= {"Metallic"} if self.metal else set()
        found |= {"Alpha"} if self.transparent else set()
        found |= self.effects
        found |= set(SUBSURFACE_SHARED) if self.subsurface else set()
        found |= set(TRANSMISSION_SHARED) if self.transmits else set()
        return found | ({"Emission Color", "Emission Strength"} if self.glows else set())

    @property
    def direct(self):
        """{socket: (part, parameter)} of the node's sockets whose value becomes that of one
        parameter, or {socket: None} if it becomes that of a node beside the models."""
        found = {}
        for part in self.parts:
            for name, socket in part.links.items():
                value = shader_values.constant(self.node.inputs[socket])
                given = part.values.get(name)
                known = None not in (value, given) and part.scale == 1
                same = known and np.allclose(value, given, atol=1e-4)
                found.setdefault(socket, []).append((part, name) if same else ())
        for socket, used in (
            ("Metallic", self.metal),
            ("Alpha", self.transparent),
            ("Emission Color", self.glows),
            ("Emission Strength", self.glows),
        ):
            if used:
                found.setdefault(socket, []).append(None)
        for name in self.effects:
            # The weight of an Upper also becomes that of the light below.
            is_upper = any(name.startswith(upper.name) for upper in self.uppers)
            found.setdefault(name, []).append(() if is_upper else None)
        for names, used in (
            (SUBSURFACE_SHARED, self.subsurface),
            (TRANSMISSION_SHARED, self.transmits),
        ):
            for name in names if used else ():
                found.setdefault(name, []).append(())
        return {name: at[0] for name, at in found.items() if len(at) == 1 and at[0] != ()}

    @property
    def materials(self):
        """Every material that changes."""
        return (self.material, *self.others)

    def line(self):
        """What the node becomes, in words."""
        of = {"material": self.material.name, "node": Sentence(self.node.bl_label)}
        if getattr(self.node, "node_tree", None) is not None:
            of["node"] = self.node.node_tree.name
        tree = self.node.id_data
        if not tree.is_embedded_data:
            of["node"] = say("{node} in {group}", node=of["node"], group=tree.name)
        if self.refusal:
            return say("{material}, {node}: stays, {why}", **of, why=self.refusal)
        of["model"] = self._label()
        if self.error < 1e-6:
            said = say("{material}, {node}: {model}, the same", **of)
        else:
            said = say(
                "{material}, {node}: {model}, {percent} % of the light in other directions than "
                "the node's",
                **of,
                percent=self._percent(),
            )
        if self.others:
            names = [material.name for material in self.others]
            if len(names) > _MOST_NAMES:
                rest = len(names) - _MOST_NAMES
                listed = ", ".join(names[:_MOST_NAMES])
                listed = say("{names} and {count} more", names=listed, count=rest)
            else:
                listed = ", ".join(names)
            said = say("{row}. It changes {materials} too", row=said, materials=listed)
        if self.unused:
            names = ", ".join(self.unused)
            said = say("{row}. Inputs of the group without effect: {names}", row=said, names=names)
        if self.readers:
            said = say(
                "{row}. Drivers of {names} read its {sockets}: they still read the replaced node",
                row=said,
                names=", ".join(self.readers),
                sockets=", ".join(self.read),
            )
        return said
