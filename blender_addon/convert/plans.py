# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the model that replaces a node, with its values and links, and estimates the error."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from .. import lamps
from ..common import editable
from ..common.i18n import Sentence, in_percent, say
from ..groups import nodes
from ..nearest import layer, native_bsdf
from ..nearest.native_bsdf import Native
from ..nearest.nearest_model import base_of, candidates, matte_of, nearest, scale_of, with_width
from ..packs import device, pack
from ..trees import animation, shader_trees, shader_values
from .filter_glossy import is_filtered
from .instances import Instances
from .node_values import (
    ANISOTROPY,
    GREY,
    KINDS,
    KNOWN_SOCKETS,
    STAYING,
    Inputs,
    Refused,
    check_off,
    color_of,
    effective_sockets,
    given_of,
    glows,
    is_transparent,
)
from .seen_node import SeenNode

#: A row of a plan names this many other materials at most.
_MOST_NAMES = 6
#: The model of smooth glass.
_CLEAR = "fresnel_dielectric"
#: Glass is white if no channel of its colour is farther from 1. Two surfaces double this.
_WHITE = 0.005
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

    @property
    def label(self):
        label = pack.model(self.model)["label"]
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
        low, high = map(in_percent, (self.least_error, self.error))
        return high if low == high else say("{low} to {high}", low=low, high=high)

    @property
    def kept(self):
        """The sockets of the node whose links stay."""
        parts = [part for part in self.parts if part.model]
        found = {socket for part in parts for socket in part.links.values()}
        found |= {"Normal", "Tangent"} & set(self.node.inputs.keys())
        if any(part.widths or part.again for part in parts) or self.rest and len(self.rest[0]) > 1:
            found.add("Roughness")
        if self.anisotropic:
            found |= set(ANISOTROPY[KINDS[self.node.bl_idname]])
        found |= {part.again[3] for part in parts if part.again}
        found |= {part.flat for part in parts if part.flat}
        found |= {"Metallic"} if self.metal else set()
        found |= {"Alpha"} if self.transparent else set()
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
                "{row}. Drivers of {names} read its {sockets}, and go on reading the replaced node",
                row=said,
                names=", ".join(self.readers),
                sockets=", ".join(self.read),
            )
        return said


def _plan_glass(material, node, inputs):
    inputs.setting("mute")
    inputs.check_unknown(KNOWN_SOCKETS["glass"])
    color, roughness = inputs.value("Color"), inputs.value("Roughness")
    if roughness > 1e-3:
        raise Refused(say("no model is of rough glass"))
    if inputs.value("Thin Film Thickness") != 0:
        raise Refused(say("it has {what}", what=Sentence("Thin Film")))
    # Blender's glass tints both reflected and transmitted light.
    return _glass_of(material, node, inputs, "Color", [max(c, 0.0) for c in color])


def _is_clear(inputs):
    """Whether a Principled node transmits all light that enters it, as glass does."""
    name = "Transmission Weight"
    return name in inputs and inputs.constant(name) == 1 and inputs.constant("Metallic") == 0


def _plan_clear(material, node, inputs):
    """The Plan for a Principled node that is smooth glass."""
    inputs.setting("mute")
    inputs.check_unknown(KNOWN_SOCKETS["principled"])
    check_off(inputs, but={"Transmission Weight"})
    if inputs.value("Roughness") > 1e-3:
        raise Refused(say("no model is of rough glass"))
    if inputs.value("Specular IOR Level") != 0.5:
        raise Refused(say("it has {what}", what=Sentence("Specular IOR Level")))
    if inputs.value("Specular Tint", (1.0, 1.0, 1.0)) != (1, 1, 1):
        raise Refused(say("it has {what}", what=Sentence("Specular Tint")))
    # Such a node tints the transmitted light alone.
    tint = [min(max(c, 0.0), 1.0) ** 0.5 for c in inputs.value("Base Color")]
    more = {"glows": glows(inputs), "transparent": is_transparent(inputs)}
    return _glass_of(material, node, inputs, "Base Color", tint, **more)


def _glass_of(material, node, inputs, color, tint, **more):
    """The Plan for smooth glass, which its socket `color` tints."""
    if _CLEAR not in pack.model_names():
        raise Refused(say("this extension lacks the models that are near: {models}", models=_CLEAR))
    if any(abs(1 - c) > _WHITE for c in tint):
        # Light passes two surfaces or more, and pictures of white glass show no colour at all: an
        # error of one surface would be no warning.
        said = say(
            "its {socket} is not white, and {model} has no colour",
            socket=Sentence(color),
            model=pack.model(_CLEAR)["label"],
        )
        raise Refused(said)
    values = {} if inputs.follows("IOR") else {"ior": inputs.constant("IOR")}
    part = Part(_CLEAR, values, {"ior": "IOR"})
    found = {"material": material, "node": node, "error": 0.0, "least_error": 0.0}
    return Plan(**vars(part), **found, **more)


def _check_ranges(parts):
    """Raises Refused if a parameter would have a value that its model does not take."""
    for part in parts:
        for name, value in part.values.items():
            parameter = pack.parameters(part.model).get(name, {})
            low, high = parameter.get("min"), parameter.get("max")
            if low is None or all(low <= c <= high for c in np.atleast_1d(value)):
                continue
            said = say(
                "{parameter} of {model} would be {value}, and may be {low} to {high}",
                parameter=parameter["label"],
                model=part.label,
                value=f"{np.max(value):g}",
                low=f"{low:g}",
                high=f"{high:g}",
            )
            raise Refused(said)


@functools.cache
def _shown(without_osl):
    """Whether a scene with or without OSL can show a model with some values, as a function of both:
    a pack cut to a scene may lack the model, and without OSL some choices are shown by a twin. The
    same function each time, as nearest() keeps what it found by it."""

    def has(model, values):
        if model not in pack.model_names():
            return False
        form = pack.native_form(model)
        if form is None or not without_osl:
            return True
        return pack.reason_unavailable(model, form, pack.canonical(values)) is None

    return has


def _widths(inputs, native, width, factor):
    """Part.widths of a fit; `native`: the first Native of the fit."""
    rough = _follows_roughness(inputs, native)
    stretched = native.kind == "principled" and inputs.follows(ANISOTROPY["principled"][0])
    if not rough and not stretched:
        return
    if not rough:
        factor *= max(native.roughness, 1e-3) ** width.power
    for name, sign in ((width.name, 1), (width.across, -1)):
        if name:
            power = sign * width.stretched if width.across else 0
            own = factor if stretched else factor * native.stretch**power
            law = (width.power if rough else 0, width.low, width.high)
            yield name, own, *law, -power if stretched else 0


def _follows_roughness(inputs, native):
    """Whether a link or an animation controls the roughness of a node that is taken for `native`.
    The base of a Principled node has another one, which is constant."""
    is_base = native.kind == "diffuse" and "Base Color" in inputs
    return not is_base and inputs.reaches("Roughness")


def _part(inputs, native, fit, color):
    """The Part for a Fit to a node; `native`: the first Native of the fit; `color`: the socket of
    its colour."""
    candidate, factor, width = fit.candidate, fit.factor, fit.candidate.width
    links = {name: color if s == "Color" else s for name, s in candidate.links.items()}
    values = with_width(candidate, native, factor)
    widths = tuple(_widths(inputs, native, width, factor)) if width else ()
    rough = _follows_roughness(inputs, native)
    base, below = None, base_of(candidate, native, rough)
    if below:
        linked = {name: color for name in candidate.base.candidate.links}
        base = Part(below.model, below.values, linked)
    again = ()
    if "again" in values and (rough or inputs.reaches(color)):
        slope, offset = (tuple(law.tolist()) for law in native_bsdf.facet_law(native))
        mean = layer.mean_albedo()
        if not rough:
            mean = (float(native_bsdf.mean_facet_albedo(native.alpha)),)
        again = slope, offset, mean, color
    rest = below.rest if below else ()
    scale, flat = scale_of(candidate, native), ""
    if candidate.is_flat and inputs.reaches(color):
        links, flat = {}, color
    return Part(candidate.model, values, links, widths, base, rest, again, scale, flat)


def _lacking(natives, colors):
    """Why no model is near: a sentence."""
    if fit := nearest(natives, colors, False, _shown(False)):
        return say(
            "its nearest model, {model}, which sends {percent} % of the light in other directions "
            "than the node, needs Open Shading Language for its values",
            model=pack.model(fit.candidate.model)["label"],
            percent=in_percent(max(error for _, error in fit.found)),
        )
    models = dict.fromkeys(c.model for c in candidates(natives[0]))
    return say("this extension lacks the models that are near: {models}", models=", ".join(models))


#: Values to which those of a node are changed, one after the other, to find what makes an error
#: large: as in a new node, but for the colour; and the socket with this value.
_PLAIN = {
    "color": (GREY, ""),
    "tint": ((1.0, 1.0, 1.0), "Specular Tint"),
    "diffuse_roughness": (0.0, "Diffuse Roughness"),
    "stretch": (1.0, "Anisotropic"),
    "f0": (0.04, "IOR"),
    "metallic": (0.0, "Metallic"),
    "roughness": (0.5, "Roughness"),
}


def _cause(given, looks, error, error_without):
    """The name of the socket that makes an error large: as in a new node, it would at least halve
    the error. "" if there is none."""
    new = _PLAIN | ({"roughness": (0.0, "Roughness")} if given["kind"] == "diffuse" else {})
    for name, (value, socket) in new.items():
        had = {given.get(name, value), *(look.get(name, value) for look in looks)}
        if had != {value} and error_without(**{name: value}) < 0.5 * error:
            is_turn = name == "stretch" and given["kind"] == "glossy"
            return ANISOTROPY["glossy"][0] if is_turn else socket or color_of(given["kind"])
    return ""


def _plan_node(material, node, inputs):
    if KINDS[node.bl_idname] == "glass":
        return _plan_glass(material, node, inputs)
    if KINDS[node.bl_idname] == "principled" and _is_clear(inputs):
        return _plan_clear(material, node, inputs)
    given, looks = given_of(node, inputs)
    color = color_of(given["kind"])
    _, colors = inputs.colors(color)

    has = _shown(device.lacks_osl(lamps.current_scene()))

    def looked(**other):
        """The Natives of the node with these values changed."""
        found = tuple(Native(**given | look | other) for look in looks)
        # Without a highlight, roughness and anisotropy of a Principled node have no effect.
        is_base = found[0].is_matte and found[0].kind == "principled"
        return (matte_of(found[0]),) if is_base else found

    def near(**other):
        """The Part for the node with these values changed, and its Fit."""
        natives = looked(**other)
        fit = nearest(natives, colors, inputs.reaches(color), has)
        if fit is None:
            raise Refused(_lacking(natives, colors))
        return _part(inputs, natives[0], fit, color), fit

    def error_without(**other):
        """The error of one model for the node with these values changed."""
        shades = (other["color"],) if "color" in other else colors
        fit = nearest(looked(**other), shades, False, has)
        return math.inf if fit is None else max(error for _, error in fit.found)

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
        more |= {"anisotropic": any(look["stretch"] != 1 for look in looks)}
        more |= {"filtered": any(is_filtered(Native(**given, **look)) for look in looks)}
        cause = functools.cache(functools.partial(_cause, given, looks, max(errors), error_without))
        return Plan(**vars(part), **more, cause=cause)

    if given["kind"] != "principled":
        part, fit = near()
        return plan(part, [fit], [error for _, error in fit.found])
    more = {"glows": glows(inputs), "transparent": is_transparent(inputs)}
    single = None
    if not inputs.follows("Metallic"):
        part, fit = near()
        is_pure = given["metallic"] in (0, 1)
        if is_pure or not (fit.lost and inputs.follows(color)):
            single = plan(part, [fit], [error for _, error in fit.found], **more)
        if is_pure:
            return single
    (part, plain), (metal, fit) = near(metallic=0.0), near(metallic=1.0)
    if (share := inputs.mean("Metallic")) is None:
        errors = [error for _, error in (*plain.found, *fit.found)]
    else:
        share = min(max(share, 0.0), 1.0)
        errors = [_mixed(share, *both) for both in zip(plain.found, fit.found, strict=True)]
    mixed = plan(part, [plain, fit], errors, metal=metal, **more)
    return mixed if single is None or mixed.error < single.error else single


def _mixed(share, plain, metal):
    """The error of a mixture of two parts, given (light, error) of each."""
    lights = (1 - share) * plain[0], share * metal[0]
    return (lights[0] * plain[1] + lights[1] * metal[1]) / max(sum(lights), 1e-9)


def plan(materials):
    """A Plan for each visible Diffuse, Glossy, Principled or Glass node of these materials, also of
    those in node groups, once each. Refused are other reflecting nodes, and group nodes with one of
    the four inside if their groups are linked from another file."""
    plans, instances, readers = {}, Instances(), animation.Readers()
    for material in materials:
        for node in _convertible(material):
            place = node.as_pointer()
            if place in plans and not plans[place].refusal:
                continue
            try:
                if why := editable.refusal(material, node.id_data):
                    raise Refused(why)
                if shader_trees.shading(material) is None:
                    raise Refused(shader_trees.NODES_OFF)
                if getattr(node, "node_tree", None) is not None:
                    raise Refused(editable.refusal(node.node_tree))
                if node.bl_idname not in KINDS:
                    raise Refused(say("only Principled, Glossy, Diffuse and Glass nodes convert"))
                withins = [instance.within for instance in instances.of(node)]
                inputs = Inputs(node, withins)
                made = _plan_node(material, node, inputs)
                _check_ranges(made.parts)
                made = _with_readers(made, inputs, readers)
            except Refused as why:
                made = Plan(material=material, node=node, refusal=why.args[0])
            else:
                made = _of_group(made)
            plans[place] = replace(made, seen=SeenNode(material, node, instances))
    return list(plans.values())


def _with_readers(made, inputs, readers):
    """The Plan with what its row says of drivers that read the node's values, and that apply()
    can't redirect."""
    direct, read, names = made.direct, [], {}
    for socket in made.node.inputs:
        if shader_trees.is_driven(socket):
            continue  # its own value has no effect
        moves = socket.name in made.kept and inputs.moves(socket.name)
        found = readers.stuck if moves or socket.name in direct else readers.of
        if blocks := found(socket):
            read.append(socket.name)
            names |= dict.fromkeys(block.name for block in blocks)
    return replace(made, read=tuple(read), readers=tuple(names))


def _of_group(made):
    """The Plan with what its row says of the group that the node is in."""
    tree = made.node.id_data
    if tree.is_embedded_data:
        return made
    others = tuple(m for m in nodes.users_of(tree) if m != made.material)
    effective = effective_sockets(made.node)
    kept = {name for socket in made.kept for name in _group_inputs(made.node.inputs[socket])}
    lost = [name for socket in effective for name in _group_inputs(socket) if name not in kept]
    return replace(made, others=others, unused=tuple(dict.fromkeys(lost)))


def _group_inputs(socket):
    """The names of the inputs of its node group on which a socket depends."""
    found, seen, waiting = [], set(), [shader_trees.reach(socket)]
    while waiting:
        reached = waiting.pop()
        if reached.output is None or reached in seen:
            continue
        seen.add(reached)
        if reached.node.bl_idname == "NodeGroupInput":
            found.append(reached.output.name)
        else:
            waiting += [shader_trees.reach(s, reached.within) for s in reached.node.inputs]
    return found


def _convertible(material):
    """The nodes of a material for which there is a Plan, in the order of its trees. In place of
    nodes in a group that is linked from another file, the group node."""
    if material.node_tree is None:
        return []
    found = set()
    for shown in shader_trees.shown_by(material.node_tree):
        locked = (group for group in shown.within if not editable.keeps_changes(group.node_tree))
        if (group := next(locked, None)) is not None:
            found |= {group} if shown.node.bl_idname in KINDS else set()
        elif shown.node.bl_idname not in STAYING and not nodes.is_ours(shown.node):
            found.add(shown.node)
    return [node for node in nodes.all_nodes(material) if node in found]
