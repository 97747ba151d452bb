# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of Blender's own nodes, as the model of this extension that comes nearest.

Nothing is changed before apply().
"""

import functools
import math
from dataclasses import dataclass, field, replace

import bpy

from . import animation, bump_correction, editable, nodes, pack, shader_trees, shader_values
from .i18n import Sentence, say
from .native_bsdf import Native
from .nearest_model import nearest, with_width
from .seen_node import SeenNode

#: Roughnesses at which a model is to be near where a texture gives it.
ROUGHNESSES = (0.2, 0.5, 0.8)
#: Colour at which the width is sought where nothing is known of what is linked.
GREY = (0.5, 0.5, 0.5)
#: Colours between which that one may lie: the error of a plan is a range.
DARK, BRIGHT = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
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
#: Nodes that stay beside models, for they do what models don't.
_STAYING = {
    f"ShaderNode{name}"
    for name in (
        *("AddShader", "Background", "BsdfTransparent", "Emission", "Holdout", "MixShader"),
        "Script",
    )
}
#: Sockets that must keep the value at which they do nothing; no model has what they do.
_OFF = {
    "Subsurface Weight": (0.0, "Subsurface"),
    "Transmission Weight": (0.0, "Transmission"),
    "Coat Weight": (0.0, "Coat"),
    "Sheen Weight": (0.0, "Sheen"),
    "Thin Film Thickness": (0.0, "Thin Film"),
    "Thin Wall": (0.0, "Thin Wall"),
}
#: Sockets whose meaning is known here, by kind; what is set of others is a refusal. Those of
#: subsurface, coat, sheen and thin film do nothing while that is off.
KNOWN_SOCKETS = {
    "diffuse": {"Color", "Roughness", "Normal", "Weight"},
    "glossy": {"Color", "Roughness", "Anisotropy", "Rotation", "Normal", "Tangent", "Weight"},
    "glass": {
        *("Color", "Roughness", "IOR", "Normal", "Weight"),
        *("Thin Film Thickness", "Thin Film IOR"),
    },
    "principled": {
        *_OFF,
        *("Base Color", "Metallic", "Roughness", "IOR", "Alpha", "Normal", "Weight"),
        *("Diffuse Roughness", "Specular IOR Level", "Specular Tint"),
        *("Anisotropic", "Anisotropic Rotation", "Tangent"),
        *("Subsurface Radius", "Subsurface Scale", "Subsurface IOR", "Subsurface Anisotropy"),
        *("Coat Roughness", "Coat IOR", "Coat Tint", "Coat Normal"),
        *("Sheen Roughness", "Sheen Tint", "Thin Film IOR"),
        *("Emission Color", "Emission Strength"),
    },
}
#: The same of settings of the nodes themselves.
_KNOWN_SETTINGS = {"distribution", "subsurface_method"}


#: Sockets of which importers and makers of materials often have an image that is one colour.
_OFTEN_ONE_COLOR = {"Alpha", "Base Color", "Color", "Emission Color", "Metallic"}


class Refused(ValueError):
    """Why a node is not converted, in a few words."""


@functools.cache
def _fresh(kind):
    """{identifier: value} of the sockets of a new node."""
    tree = bpy.data.node_groups.new("Fresh", "ShaderNodeTree")
    try:
        return {s.identifier: _held(s) for s in tree.nodes.new(kind).inputs}
    finally:
        bpy.data.node_groups.remove(tree)


def _held(socket):
    value = getattr(socket, "default_value", None)
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


class _Inputs:
    """What reaches a node's sockets. Raises Refused for what varies in a way that no model
    follows."""

    def __init__(self, node):
        self._node, self._moved = node, animation.moved(node)
        self._values = shader_values.Constants(), shader_values.Constants(images=True)
        self._found = {}

    def __contains__(self, name):
        return name in self._node.inputs

    def reaches(self, name):
        """Whether the output of a node reaches a socket; the link to it may stay."""
        return shader_trees.is_driven(self._node.inputs[name])

    def constant(self, name):
        """The value of a socket, also behind links; None where it is not constant."""
        if name not in self._found:
            values = self._values[name in _OFTEN_ONE_COLOR]
            self._found[name] = values.told(self._node.inputs[name])
        return self._found[name]

    def mean(self, name):
        """The value, or its mean over images; None where neither is known."""
        known = self.constant(name)
        return shader_values.mean(self._node.inputs[name]) if known is None else known

    def follows(self, name):
        """Whether a link gives a socket a value that is not constant. An animation of the socket
        itself is refused, for it would end with the node."""
        if self.constant(name) is not None:
            return False
        if self.reaches(name):
            return True
        raise Refused(say("{socket} is animated", socket=Sentence(name)))

    def value(self, name, default=0.0):
        """Of a socket that has to be constant."""
        if name not in self:
            return default
        if self.follows(name):
            raise Refused(say("{socket} is linked", socket=Sentence(name)))
        return self.constant(name)

    def colors(self, name):
        """The colour at which a model is sought, and those at which its error is told."""
        if self.follows(name) and (known := self.mean(name)) is None:
            return GREY, (DARK, BRIGHT)
        known = tuple(max(c, 0.0) for c in self.mean(name))
        return known, (known,)

    def setting(self, name):
        """Of the node itself."""
        if (self._node.as_pointer(), name) in self._moved:
            label = self._node.bl_rna.properties[name].name
            raise Refused(say("{socket} is animated", socket=Sentence(label)))
        return getattr(self._node, name)

    def check_unknown(self, known):
        """Raises Refused for what is set of the sockets and settings that a later version of
        Blender has added."""
        for socket in self._node.inputs:
            if socket.name in known or not socket.enabled:
                continue
            fresh = _fresh(self._node.bl_idname).get(socket.identifier)
            animated = animation.value_of(socket) in self._moved
            if self.reaches(socket.name) or animated or _held(socket) != fresh:
                raise Refused(say("it has {what}", what=Sentence(socket.name)))
        for setting in self._node.bl_rna.properties:
            name = setting.identifier
            if name in _KNOWN_SETTINGS or name in bpy.types.ShaderNode.bl_rna.properties:
                continue
            plain = setting.type in {"BOOLEAN", "INT", "FLOAT", "ENUM"}
            if plain and not setting.is_readonly and self.setting(name) != setting.default:
                raise Refused(say("it has {what}", what=Sentence(setting.name)))


def _given(node, inputs):
    """What all Natives of a node share, and the roughnesses that they have."""
    kind = KINDS[node.bl_idname]
    inputs.setting("mute")
    inputs.check_unknown(KNOWN_SOCKETS[kind])
    given = {"kind": kind, "color": inputs.colors(_color_of(kind))[0]}
    if kind in ("glossy", "principled"):
        distribution = inputs.setting("distribution")
        if distribution not in ("GGX", "MULTI_GGX", "BECKMANN"):
            name = node.bl_rna.properties["distribution"].enum_items[distribution].name
            raise Refused(say("its distribution is {kind}", kind=Sentence(name)))
        given["beckmann"] = distribution == "BECKMANN"
        given["multiscatter"] = distribution == "MULTI_GGX"
        given["stretch"] = _stretch(inputs, kind)
    if kind == "principled":
        for name, (off, what) in _OFF.items():
            if inputs.value(name, off) != off:
                raise Refused(say("it has {what}", what=Sentence(what)))
        if inputs.value("Specular Tint", (1, 1, 1)) != (1, 1, 1):
            raise Refused(say("it has a Specular Tint"))
        level, ior = inputs.value("Specular IOR Level"), inputs.value("IOR")
        given["f0"] = min(((ior - 1) / (ior + 1)) ** 2 * 2 * level, 0.9)
        metallic = 0.5 if (known := inputs.mean("Metallic")) is None else known
        given["metallic"] = min(max(metallic, 0.0), 1.0)
        given["diffuse_roughness"] = inputs.value("Diffuse Roughness")
    if inputs.follows("Roughness"):
        return given, ROUGHNESSES
    return given, (min(max(inputs.value("Roughness"), 0.0), 1.0),)


def _color_of(kind):
    return "Base Color" if kind == "principled" else "Color"


def natives(node):
    """The node as Native, at one roughness or, where that is linked, at several. Raises Refused."""
    given, roughnesses = _given(node, _Inputs(node))
    return [Native(**given, roughness=r) for r in roughnesses]


def _stretch(inputs, kind):
    """Width of the lobe along the tangent over that across it."""
    a = inputs.value("Anisotropic" if kind == "principled" else "Anisotropy")
    if a == 0:
        return 1.0
    turn = inputs.value("Anisotropic Rotation" if kind == "principled" else "Rotation")
    if turn != 0 or not inputs.reaches("Tangent"):
        raise Refused(say("it is anisotropic without a Tangent that is linked, or turned"))
    if kind == "principled":
        return 1 / (1 - 0.9 * min(max(a, 0.0), 1.0))
    return (1 - a) ** 2 if a > 0 else 1 / (1 + a) ** 2


def _glows(inputs):
    """Whether a Principled node shines by itself."""
    names = ("Emission Color", "Emission Strength")
    for name in names:
        known = inputs.constant(name)
        if known is not None and not any(known if isinstance(known, tuple) else (known,)):
            return False
    for name in names:
        inputs.follows(name)
    return True


# ---- plans ---------------------------------------------------------------------------------------


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
    inputs = _Inputs(node)
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


def _part(inputs, native, fit):
    """The Part that a Fit to a node is; `native`: the first of those that it was fitted to."""
    color = _color_of(native.kind)
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
    inputs = _Inputs(node)
    given, roughnesses = _given(node, inputs)
    color = _color_of(given["kind"])
    _, colors = inputs.colors(color)

    models = tuple(pack.model_names())

    def near(**other):
        """The Part for what of the node has these values, and its Fit."""
        looked = tuple(Native(**given | other, roughness=r) for r in roughnesses)
        fit = nearest(looked, colors, inputs.reaches(color), models)
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
    more = {"glows": _glows(inputs), "transparent": _is_transparent(inputs)}
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


def _is_transparent(inputs):
    """Whether a Principled node lets something of what is behind it through."""
    return inputs.follows("Alpha") or inputs.constant("Alpha") < 1


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
        elif shown.node.bl_idname not in _STAYING and not nodes.is_ours(shown.node):
            found.add(shown.node)
    return [node for node in material.node_tree.nodes if node in found]


# ---- there and back ------------------------------------------------------------------------------


def apply(plans):
    """Puts the models into the materials: links stay, and the nodes of before, which nothing shows
    any more, so that restore() finds them. Returns how many nodes were converted.

    All groups are made before anything is changed. Raises ValueError, also where a node is not
    what the plan was made of any more, CompileError.
    """
    wanted = [replace(p, node=p.seen.now()) for p in plans if not p.refusal]
    editable.check(*(p.material for p in wanted))
    # What is linked may have any value.
    made = [[_Made(part, *_resolved(part)) for part in p.parts] for p in wanted]
    known = set(bpy.data.node_groups)
    try:
        for one in (one for each in made for one in each):
            nodes.ensure_group(one.part.model, one.form)
    except BaseException:
        nodes.remove_unused_groups(known)
        raise
    for p, parts in zip(wanted, made, strict=True):
        _replace(p, parts)
    return len(wanted)


@dataclass(frozen=True)
class _Made:
    """A Part, its form, and its values as sockets take them."""

    part: Part
    form: str
    values: dict


def _resolved(part):
    values = {k: pack.check_value(part.model, k, v) for k, v in part.values.items()}
    return pack.resolve(part.model, "auto", values | dict.fromkeys(part.links)), values


def _source(socket):
    """The output that is linked to a socket, if that has any effect."""
    if not shader_trees.is_driven(socket):
        return None
    return next(link.from_socket for link in socket.links if shader_trees.counts(link))


def _replace(p, parts):
    node = p.node
    groups = [_add(p, made) for made in parts]
    group, *metal = groups
    group[BEFORE] = node.name
    for other in metal:
        other[HELPS] = group.name
        other.location.y -= 300
    shader = _joined(p, groups)
    for link in [link for link in node.outputs[0].links if shader_trees.counts(link)]:
        target = link.to_socket
        p.material.node_tree.links.remove(link)
        p.material.node_tree.links.new(shader, target)
    node.location = (node.location.x, node.location.y - 700)


def _add(p, made):
    """The group node of a model, with the links of the node that it stands in for."""
    tree, node = p.material.node_tree, p.node
    group = nodes.add_group_node(tree, made.part.model, made.form)
    group.location = node.location
    group[CORRECTED] = bump_correction.recorded(p.material)
    for name, value in made.values.items():
        nodes.set_value(group, name, value)
    present = nodes.sockets(group)
    for name, socket in made.part.links.items():
        if source := _source(node.inputs[socket]):
            tree.links.new(source, present[name])
    for name in (pack.NORMAL, pack.TANGENT):
        if name in node.inputs and (source := _source(node.inputs[name])):
            tree.links.new(source, present[name])
    for name, *law in made.part.widths:
        tree.links.new(_follow(tree, group, _source(node.inputs["Roughness"]), *law), present[name])
    return group


def _joined(p, groups):
    """The shader of what stands in for a node: its models, and what else of it they lack."""
    shader, *metal = (group.outputs["BSDF"] for group in groups)
    if metal:
        shader = _mix(p, groups[0], "Metallic", shader, metal[0])
    if p.glows:
        emission = _helper(p, groups[0], "ShaderNodeEmission")
        for name, socket in (("Color", "Emission Color"), ("Strength", "Emission Strength")):
            _give(p, emission.inputs[name], socket)
        add = _helper(p, groups[0], "ShaderNodeAddShader")
        p.material.node_tree.links.new(shader, add.inputs[0])
        p.material.node_tree.links.new(emission.outputs[0], add.inputs[1])
        shader = add.outputs[0]
    if p.transparent:
        clear = _helper(p, groups[0], "ShaderNodeBsdfTransparent")
        shader = _mix(p, groups[0], "Alpha", clear.outputs[0], shader)
    return shader


def _helper(p, group, kind):
    """A node that helps a group to stand in for another node."""
    tree = p.material.node_tree
    count = sum(n.get(HELPS) == group.name for n in tree.nodes)
    helper = tree.nodes.new(kind)
    helper.location = (group.location.x + 220, group.location.y + 60 - 60 * count)
    helper.hide, helper[HELPS] = True, group.name
    return helper


def _mix(p, group, name, first, second):
    mix = _helper(p, group, "ShaderNodeMixShader")
    _give(p, mix.inputs[0], name)
    p.material.node_tree.links.new(first, mix.inputs[1])
    p.material.node_tree.links.new(second, mix.inputs[2])
    return mix.outputs[0]


def _give(p, socket, name):
    """What reaches a socket of the node that is replaced, for another socket."""
    own = p.node.inputs[name]
    if source := _source(own):
        p.material.node_tree.links.new(source, socket)
        return
    value = shader_values.constant(own)
    socket.default_value = (*value, 1.0) if isinstance(value, tuple) else value


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


def _outgoing(group, helpers):
    """The links by which a group and the nodes that help it are shown."""
    every = [group, *helpers]
    shaders = [s for node in every for s in node.outputs if s.type == "SHADER"]
    return [link for s in shaders for link in s.links if link.to_node not in every]


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
            others = [n for n in tree.nodes if n.get(HELPS) == group.name and nodes.is_ours(n)]
            for model in (group, *others):
                pack.resolve(nodes.identity(model)[0], "twin", nodes.all_values(model))
    corrected = [bool(group.get(CORRECTED, True)) for group, _ in pairs]
    for group, before in pairs:
        helpers = [n for n in tree.nodes if n.get(HELPS) == group.name]
        if before is None:
            for model in [group, *filter(nodes.is_ours, helpers)]:
                nodes.switch(model, "twin")
            for key in (BEFORE, CORRECTED):
                group.pop(key, None)
            continue
        for link in _outgoing(group, helpers):
            target = link.to_socket
            tree.links.remove(link)
            tree.links.new(before.outputs[0], target)
        before.location = group.location
        for helper in helpers:
            tree.nodes.remove(helper)
        tree.nodes.remove(group)
    if pairs:
        bump_correction.restore(material, all(corrected))
    nodes.remove_unused_groups()
    return len(pairs)
