# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of Blender's own nodes, as the model of this extension that comes nearest.

Nothing is changed before apply().
"""

import math
from dataclasses import dataclass, field, replace

import bpy

from . import animation, bump_correction, editable, nodes, pack
from .i18n import Sentence, say
from .native_bsdf import Native
from .nearest_model import Target, candidates, nearest_factor, with_width
from .seen_node import SeenNode

#: Roughnesses at which a model is to be near where a texture gives it.
ROUGHNESSES = (0.2, 0.5, 0.8)
#: Colour at which one that a texture gives is compared.
GREY = (0.5, 0.5, 0.5)
#: Error of a plan above which it is refused where no other limit is given.
LIMIT = 0.35

#: Custom property of a group node: the name of the node that it stands in for.
BEFORE = "brdfc_before"
#: And whether Bump Map Correction was on then; without it an earlier version converted the node,
#: which turned it off.
CORRECTED = "brdfc_before_bump_map_correction"
#: Of nodes that were added for it: the name of the group node.
HELPS = "brdfc_helps"


# ---- what a node is ------------------------------------------------------------------------------

KINDS = {
    "ShaderNodeBsdfDiffuse": "diffuse",
    "ShaderNodeBsdfAnisotropic": "glossy",
    "ShaderNodeBsdfPrincipled": "principled",
    "ShaderNodeBsdfGlass": "glass",
}
#: Sockets that must keep the value at which they do nothing; no model has what they do.
_OFF = {
    "Alpha": (1.0, "Alpha"),
    "Subsurface Weight": (0.0, "Subsurface"),
    "Transmission Weight": (0.0, "Transmission"),
    "Coat Weight": (0.0, "Coat"),
    "Sheen Weight": (0.0, "Sheen"),
    "Emission Strength": (0.0, "Emission"),
    "Thin Film Thickness": (0.0, "Thin Film"),
}


class Refused(ValueError):
    """Why a node is not converted, in a few words."""


class _Inputs:
    """What a node's sockets have. Raises Refused for what varies in a way that no model follows."""

    def __init__(self, node):
        self._node, self._moved = node, animation.moved(node)

    def __contains__(self, name):
        return name in self._node.inputs

    def is_linked(self, name):
        """For what may be linked, and then stays so; but not animated, which ends with the node."""
        socket = self._node.inputs[name]
        if socket.is_linked:
            return True
        if animation.value_of(socket) in self._moved:
            raise Refused(say("{socket} is animated", socket=Sentence(name)))
        return False

    def value(self, name, default=0.0):
        """Of a socket that nothing may be linked to."""
        if name not in self:
            return default
        if self.is_linked(name):
            raise Refused(say("{socket} is linked", socket=Sentence(name)))
        value = self._node.inputs[name].default_value
        return tuple(value)[:3] if hasattr(value, "__len__") else float(value)

    def color(self, name):
        return GREY if self.is_linked(name) else self.value(name)

    def setting(self, name):
        """Of the node itself."""
        if (self._node.as_pointer(), name) in self._moved:
            label = self._node.bl_rna.properties[name].name
            raise Refused(say("{socket} is animated", socket=Sentence(label)))
        return getattr(self._node, name)


def natives(node):
    """The node as Native, at one roughness or, where that is linked, at several. Raises Refused."""
    kind, inputs = KINDS[node.bl_idname], _Inputs(node)
    color = "Base Color" if kind == "principled" else "Color"
    given = {"kind": kind, "color": tuple(max(c, 0.0) for c in inputs.color(color))}
    if kind in ("glossy", "principled"):
        distribution = inputs.setting("distribution")
        if distribution not in ("GGX", "MULTI_GGX", "BECKMANN"):
            name = node.bl_rna.properties["distribution"].enum_items[distribution].name
            raise Refused(say("its distribution is {kind}", kind=Sentence(name)))
        given["beckmann"] = distribution == "BECKMANN"
        given["multiscatter"] = distribution == "MULTI_GGX"
        given["stretch"] = _stretch(node, inputs, kind)
    if kind == "principled":
        for name, (off, what) in _OFF.items():
            if name in inputs and (inputs.value(name) != off):
                raise Refused(say("it has {what}", what=Sentence(what)))
        if inputs.value("Specular Tint", (1, 1, 1)) != (1, 1, 1):
            raise Refused(say("it has a Specular Tint"))
        level, ior = inputs.value("Specular IOR Level"), inputs.value("IOR")
        given["f0"] = min(((ior - 1) / (ior + 1)) ** 2 * 2 * level, 0.9)
        given["metallic"] = min(max(inputs.value("Metallic"), 0.0), 1.0)
        given["diffuse_roughness"] = inputs.value("Diffuse Roughness")
    linked = inputs.is_linked("Roughness")
    roughnesses = ROUGHNESSES if linked else (min(max(inputs.value("Roughness"), 0.0), 1.0),)
    return [Native(**given, roughness=r) for r in roughnesses]


def _stretch(node, inputs, kind):
    """Width of the lobe along the tangent over that across it."""
    a = inputs.value("Anisotropic" if kind == "principled" else "Anisotropy")
    if a == 0:
        return 1.0
    turn = inputs.value("Anisotropic Rotation" if kind == "principled" else "Rotation")
    if turn != 0 or not node.inputs["Tangent"].is_linked:
        raise Refused(say("it is anisotropic without a Tangent that is linked, or turned"))
    if kind == "principled":
        return 1 / (1 - 0.9 * min(max(a, 0.0), 1.0))
    return (1 - a) ** 2 if a > 0 else 1 / (1 + a) ** 2


# ---- plans ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Plan:
    """How a node of a material would be converted; or, with a `refusal`, why it would not."""

    material: object
    node: object
    model: str = ""
    values: dict = field(default_factory=dict)
    #: Part of the light that goes elsewhere, as a picture of lamps that are as wide as windows
    #: shows; seen from 0.95 to 0.25 in cosine. Infinite with a refusal that knows of no model.
    error: float = math.inf
    #: Parameter by the node's socket.
    links: dict = field(default_factory=dict)
    #: Parameters that follow a linked roughness: (name, factor, power).
    widths: tuple = ()
    refusal: str = ""
    #: What the plan was made of.
    seen: SeenNode | None = None

    def within(self, limit):
        """The same, refused where its error is above a limit."""
        if self.refusal or self.error <= limit:
            return self
        why = say(
            "its nearest model, {model}, sends {percent} % of the light in other directions",
            model=pack.model(self.model)["label"],
            percent=self._percent(),
        )
        return replace(self, refusal=why)

    def _percent(self):
        return f"{100 * self.error:.2g}"

    def line(self):
        """What becomes of the node, in words."""
        of = {"material": self.material.name, "node": Sentence(self.node.bl_label)}
        if self.node.bl_idname == "ShaderNodeGroup":
            of["node"] = self.node.node_tree.name
        if self.refusal:
            return say("{material}, {node}: stays, {why}", **of, why=self.refusal)
        of["model"] = pack.model(self.model)["label"]
        if self.error < 1e-6:
            return say("{material}, {node}: {model}, the same", **of)
        return say(
            "{material}, {node}: {model}, {percent} % of the light in other directions",
            **of,
            percent=self._percent(),
        )


def _plan_glass(material, node):
    inputs = _Inputs(node)
    color, roughness = inputs.value("Color"), inputs.value("Roughness")
    if roughness > 1e-3:
        raise Refused(say("no model is of rough glass"))
    if inputs.value("Thin Film Thickness") != 0:
        raise Refused(say("it has {what}", what=Sentence("Thin Film")))
    # Blender's glass tints what it reflects and what it lets through.
    error = sum(abs(1 - c) for c in color) / max(sum(color), 1e-6)
    values = {} if inputs.is_linked("IOR") else {"ior": inputs.value("IOR")}
    return Plan(material, node, "fresnel_dielectric", values, error, {"ior": "IOR"})


def _plan_node(material, node):
    if KINDS[node.bl_idname] == "glass":
        return _plan_glass(material, node)
    targets = [Target(n) for n in natives(node)]
    native = targets[0].native
    color = "Base Color" if native.kind == "principled" else "Color"
    colored, found = node.inputs[color].is_linked, []
    for candidate in candidates(native):
        if candidate.model not in pack.model_names():
            continue  # a pack that is cut to a scene
        if native.stretch != 1 and not (candidate.width and candidate.width.across):
            continue
        factor, error = nearest_factor(candidate, targets)
        lost = colored and "Color" not in candidate.links.values()
        found.append((lost, error, factor, candidate))
    if not found:
        raise Refused(say("this extension has no model that is near"))
    lost, error, factor, candidate = min(found, key=lambda f: f[:2])
    width = candidate.width
    if lost:
        raise Refused(
            say(
                "{socket} is linked, and its nearest model has more than one colour",
                socket=Sentence(color),
            )
        )
    links = {name: color if s == "Color" else s for name, s in candidate.links.items()}
    values, widths = with_width(candidate, native, factor), ()
    if width and node.inputs["Roughness"].is_linked:
        stretch = native.stretch**width.stretched if width.across else 1.0
        named = [(width.name, stretch), (width.across, 1 / stretch)]
        widths = tuple((n, factor * s, width.power, width.low, width.high) for n, s in named if n)
    return Plan(material, node, candidate.model, values, error, links, widths)


def _holds_a_kind(group):
    """Whether a node is a group, not one of ours, with a node inside that could be converted."""
    trees = nodes.trees_within(group)
    return any(n.bl_idname in KINDS and n.outputs[0].is_linked for t in trees for n in t.nodes)


def plan(materials):
    """A Plan for each node of these materials that is Diffuse, Glossy, Principled or Glass, and for
    each group that has such a node inside, which is refused: other materials may share it."""
    plans = []
    for material in materials:
        if material.node_tree is None:
            continue
        for node in material.node_tree.nodes:
            grouped = _holds_a_kind(node)
            if node.bl_idname not in KINDS and not grouped:
                continue
            if not any(socket.is_linked for socket in node.outputs):
                continue
            try:
                if why := editable.refusal(material):
                    raise Refused(why)
                if grouped:
                    raise Refused(say("its shader is inside this node group: ungroup it first"))
                made = _plan_node(material, node)
            except Refused as why:
                made = Plan(material, node, refusal=why.args[0])
            plans.append(replace(made, seen=SeenNode(material, node)))
    return plans


# ---- there and back ------------------------------------------------------------------------------


def apply(plans):
    """Puts the models into the materials: links stay, and the nodes of before, which nothing shows
    any more, so that restore() finds them. Returns how many nodes were converted.

    All groups are made before anything is changed. Raises ValueError, also where a node is not
    what the plan was made of any more, CompileError.
    """
    wanted = [replace(p, node=p.seen.now()) for p in plans if not p.refusal]
    editable.check(*(p.material for p in wanted))
    checked = [{k: pack.check_value(p.model, k, v) for k, v in p.values.items()} for p in wanted]
    # What is linked may have any value.
    forms = [
        pack.resolve(p.model, "auto", values | dict.fromkeys(p.links))
        for p, values in zip(wanted, checked, strict=True)
    ]
    known = set(bpy.data.node_groups)
    try:
        for p, form in zip(wanted, forms, strict=True):
            nodes.ensure_group(p.model, form)
    except BaseException:
        nodes.remove_unused_groups(known)
        raise
    for p, form, values in zip(wanted, forms, checked, strict=True):
        _replace(p, nodes.add_group_node(p.material.node_tree, p.model, form), values)
    return len(wanted)


def _source(socket):
    return socket.links[0].from_socket if socket.is_linked else None


def _replace(p, group, values):
    tree, node = p.material.node_tree, p.node
    group.location, group[BEFORE] = node.location, node.name
    group[CORRECTED] = bump_correction.recorded(p.material)
    for name, value in values.items():
        nodes.set_value(group, name, value)
    present = nodes.sockets(group)
    for name, socket in p.links.items():
        if source := _source(node.inputs[socket]):
            tree.links.new(source, present[name])
    for name in (pack.NORMAL, pack.TANGENT):
        if name in node.inputs and (source := _source(node.inputs[name])):
            tree.links.new(source, present[name])
    for name, *law in p.widths:
        tree.links.new(_follow(tree, group, _source(node.inputs["Roughness"]), *law), present[name])
    for link in list(node.outputs[0].links):
        target = link.to_socket
        tree.links.remove(link)
        tree.links.new(group.outputs["BSDF"], target)
    node.location = (node.location.x, node.location.y - 700)


def _follow(tree, group, roughness, factor, power, low, high):
    """factor * roughness^power, held to the range of the parameter."""
    source = roughness
    for i, (operation, *operands) in enumerate(
        (
            ("MAXIMUM", 1e-3),
            ("POWER", power),
            ("MULTIPLY", factor),
            ("MAXIMUM", low),
            ("MINIMUM", high),
        )
    ):
        math_node = tree.nodes.new("ShaderNodeMath")
        math_node.operation, math_node.hide = operation, True
        math_node.location = (group.location.x - 200, group.location.y - 40 * i)
        math_node[HELPS] = group.name
        tree.links.new(source, math_node.inputs[0])
        math_node.inputs[1].default_value = operands[0]
        source = math_node.outputs[0]
    return source


def is_converted(node):
    """Whether a node stands in for one of Blender's own."""
    return nodes.is_ours(node) and BEFORE in node


def _before(group):
    before = group.id_data.nodes.get(group[BEFORE])
    return before if before is not None and before.bl_idname in KINDS else None


def restore(material):
    """Puts the nodes of before back, and the settings; where they are gone, the twin, which
    Blender's own nodes are as well. Returns how many nodes were put back. Raises ValueError where
    there is neither."""
    editable.check(material)
    if material.node_tree is None:
        return 0
    tree = material.node_tree
    pairs = [(n, _before(n)) for n in tree.nodes if is_converted(n)]
    for group, before in pairs:
        if before is None:  # refused before anything is changed
            pack.resolve(nodes.identity(group)[0], "twin", nodes.all_values(group))
    corrected = [bool(group.get(CORRECTED, True)) for group, _ in pairs]
    for group, before in pairs:
        if before is None:
            nodes.switch(group, "twin")
            for key in (BEFORE, CORRECTED):
                group.pop(key, None)
            continue
        for link in list(group.outputs["BSDF"].links):
            target = link.to_socket
            tree.links.remove(link)
            tree.links.new(before.outputs[0], target)
        before.location = group.location
        for helper in [n for n in tree.nodes if n.get(HELPS) == group.name]:
            tree.nodes.remove(helper)
        tree.nodes.remove(group)
    if pairs:
        bump_correction.restore(material, all(corrected))
    nodes.remove_unused_groups()
    return len(pairs)
