# SPDX-License-Identifier: GPL-3.0-or-later
"""Which model would stand in for a node, with which values and links, and how far it is off."""

import math
from dataclasses import dataclass, field, replace

from .. import lamps
from ..common import editable
from ..common.i18n import Sentence, say
from ..groups import nodes
from ..nearest.native_bsdf import Native
from ..nearest.nearest_model import nearest, with_width
from ..packs import device, pack
from ..trees import shader_trees
from .node_values import (
    KINDS,
    KNOWN_SOCKETS,
    STAYING,
    Inputs,
    Refused,
    color_of,
    given_of,
    glows,
    is_transparent,
)
from .seen_node import SeenNode

#: Error of a plan above which it is refused where no other limit is given.
LIMIT = 0.35


@dataclass(frozen=True)
class Part:
    """A model with its values, in place of a node or of the metal in one."""

    model: str = ""
    values: dict = field(default_factory=dict)
    #: Parameter by the node's socket.
    links: dict = field(default_factory=dict)
    #: Parameters that follow a linked roughness: (name, factor, power, low, high).
    widths: tuple = ()


@dataclass(frozen=True)
class Plan(Part):
    """How a node of a material would be converted; or, with a `refusal`, why it would not."""

    material: object = None
    node: object = None
    #: Part of the light that goes elsewhere, as a picture of lamps that are as wide as windows
    #: shows; seen from 0.95 to 0.25 in cosine. Where it depends on what is linked, the largest.
    #: Infinite with a refusal that knows of no model.
    error: float = math.inf
    #: The smallest where it depends on what is linked.
    least_error: float = math.inf
    #: The model of the metal in the node, mixed with the other by the node's Metallic.
    metal: Part | None = None
    #: Whether an Emission node is added, and a Transparent one mixed in by the node's Alpha.
    glows: bool = False
    transparent: bool = False
    refusal: str = ""
    #: What the plan was made of.
    seen: SeenNode | None = None

    @property
    def parts(self):
        return [self, self.metal] if self.metal else [self]

    def within(self, limit):
        """The same, refused where its error is above a limit."""
        if self.refusal or self.error <= limit:
            return self
        why = say(
            "its nearest model, {model}, sends {percent} % of the light in other directions",
            model=self._label(),
            percent=self._percent(),
        )
        return replace(self, refusal=why)

    def _label(self):
        model, *metal = (pack.model(part.model)["label"] for part in self.parts)
        if metal:
            return say("{model} mixed with {metal} by Metallic", model=model, metal=metal[0])
        return model

    def _percent(self):
        low, high = (f"{100 * error:.2g}" for error in (self.least_error, self.error))
        return high if low == high else say("{low} to {high}", low=low, high=high)

    def line(self):
        """What becomes of the node, in words."""
        of = {"material": self.material.name, "node": Sentence(self.node.bl_label)}
        if self.node.bl_idname == "ShaderNodeGroup":
            of["node"] = self.node.node_tree.name
        if self.refusal:
            return say("{material}, {node}: stays, {why}", **of, why=self.refusal)
        of["model"] = self._label()
        if self.error < 1e-6:
            return say("{material}, {node}: {model}, the same", **of)
        return say(
            "{material}, {node}: {model}, {percent} % of the light in other directions",
            **of,
            percent=self._percent(),
        )


def _plan_glass(material, node):
    inputs = Inputs(node)
    inputs.setting("mute")
    inputs.check_unknown(KNOWN_SOCKETS["glass"])
    color, roughness = inputs.value("Color"), inputs.value("Roughness")
    if roughness > 1e-3:
        raise Refused(say("no model is of rough glass"))
    if inputs.value("Thin Film Thickness") != 0:
        raise Refused(say("it has {what}", what=Sentence("Thin Film")))
    # Blender's glass tints what it reflects and what it lets through.
    error = sum(abs(1 - c) for c in color) / max(sum(color), 1e-6)
    values = {} if inputs.follows("IOR") else {"ior": inputs.constant("IOR")}
    links = {"ior": "IOR"}
    return Plan("fresnel_dielectric", values, links, (), material, node, error, error)


def _is_shown(model, values):
    """Whether a model with these values is what a scene shows: a pack that is cut to a scene may
    lack it, and without Open Shading Language a twin stands in for some choices."""
    if model not in pack.model_names():
        return False
    form = pack.native_form(model)
    if form is None or not device.lacks_osl(lamps.current_scene()):
        return True
    return pack.refusal(model, form, pack.canonical(values)) is None


def _part(inputs, native, fit):
    """The Part that a Fit to a node is; `native`: the first of those that it was fitted to."""
    color = color_of(native.kind)
    candidate, factor, width = fit.candidate, fit.factor, fit.candidate.width
    links = {name: color if s == "Color" else s for name, s in candidate.links.items()}
    values, widths = with_width(candidate, native, factor), ()
    if width and inputs.reaches("Roughness"):
        stretch = native.stretch**width.stretched if width.across else 1.0
        named = [(width.name, stretch), (width.across, 1 / stretch)]
        widths = tuple((n, factor * s, width.power, width.low, width.high) for n, s in named if n)
    return Part(candidate.model, values, links, widths)


def _plan_node(material, node):
    if KINDS[node.bl_idname] == "glass":
        return _plan_glass(material, node)
    inputs = Inputs(node)
    given, roughnesses = given_of(node, inputs)
    color = color_of(given["kind"])
    _, colors = inputs.colors(color)

    def near(**other):
        """The Part for what of the node has these values, and its Fit."""
        looked = tuple(Native(**given | other, roughness=r) for r in roughnesses)
        fit = nearest(looked, colors, inputs.reaches(color), _is_shown)
        if fit is None:
            raise Refused(say("this extension has no model that is near"))
        return _part(inputs, looked[0], fit), fit

    def plan(part, fits, errors, **more):
        if inputs.follows(color) and any(fit.lost for fit in fits):
            raise Refused(
                say(
                    "{socket} is linked, and its nearest model has more than one colour",
                    socket=Sentence(color),
                )
            )
        more |= {"material": material, "node": node}
        more |= {"error": max(errors), "least_error": min(errors)}
        return Plan(part.model, part.values, part.links, part.widths, **more)

    if given["kind"] != "principled":
        part, fit = near()
        return plan(part, [fit], [error for _, error in fit.found])
    more = {"glows": glows(inputs), "transparent": is_transparent(inputs)}
    if not inputs.follows("Metallic"):
        part, fit = near()
        if not (fit.lost and inputs.follows(color)) or given["metallic"] in (0, 1):
            return plan(part, [fit], [error for _, error in fit.found], **more)
    (part, plain), (metal, fit) = near(metallic=0.0), near(metallic=1.0)
    if (share := inputs.mean("Metallic")) is None:
        errors = [error for _, error in (*plain.found, *fit.found)]
    else:
        share = min(max(share, 0.0), 1.0)
        errors = [_mixed(share, *both) for both in zip(plain.found, fit.found, strict=True)]
    return plan(part, [plain, fit], errors, metal=metal, **more)


def _mixed(share, plain, metal):
    """The error of a mix of (light, error) of both."""
    lights = (1 - share) * plain[0], share * metal[0]
    return (lights[0] * plain[1] + lights[1] * metal[1]) / max(sum(lights), 1e-9)


def plan(materials):
    """A Plan for each node of these materials that is Diffuse, Glossy, Principled or Glass and that
    Cycles shows. Refused are other nodes that reflect, and groups that have one of the four inside,
    for other materials may share these."""
    plans = []
    for material in materials:
        for node in _convertible(material):
            try:
                if why := editable.refusal(material):
                    raise Refused(why)
                if shader_trees.shading(material) is None:
                    raise Refused(shader_trees.nodes_off())
                if node.bl_idname == "ShaderNodeGroup":
                    raise Refused(say("its shader is inside this node group: ungroup it first"))
                if node.bl_idname not in KINDS:
                    raise Refused(say("this extension has no model that is near"))
                made = _plan_node(material, node)
            except Refused as why:
                made = Plan(material=material, node=node, refusal=why.args[0])
            plans.append(replace(made, seen=SeenNode(material, node)))
    return plans


def _convertible(material):
    """The nodes of a material that there is a Plan for, in the order of its tree."""
    if material.node_tree is None:
        return []
    found = set()
    for shown in shader_trees.shown_by(material.node_tree):
        if shown.within:
            found |= {shown.within[0]} if shown.node.bl_idname in KINDS else set()
        elif shown.node.bl_idname not in STAYING and not nodes.is_ours(shown.node):
            found.add(shown.node)
    return [node for node in material.node_tree.nodes if node in found]
