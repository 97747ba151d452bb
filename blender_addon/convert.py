# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of Blender's own nodes, as the model of this extension that comes nearest.

Each candidate's width is sought so that it misplaces least of the light, and the candidate that
misplaces least is taken; the formulas of the models come as NumPy with the extension. Nothing is
changed before apply().
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import bpy
import numpy as np

from . import native_bsdf, nodes, pack
from .i18n import Sentence, say
from .native_bsdf import Native

#: Views at which models are compared, as cosines, and directions of light for each.
VIEWS = (0.95, 0.75, 0.5, 0.25)
DIRECTIONS = 256
#: Roughnesses at which a model is to be near where a texture gives it.
ROUGHNESSES = (0.2, 0.5, 0.8)
#: Colour at which one that a texture gives is compared.
GREY = (0.5, 0.5, 0.5)

#: Custom property of a group node: the name of the node that it stands in for.
BEFORE = "brdfc_before"
#: Of nodes that were added for it: the name of the group node.
HELPS = "brdfc_helps"


@dataclass(frozen=True)
class Width:
    """The parameter that says how wide a lobe is: in proportion to roughness^power."""

    name: str
    low: float
    high: float
    power: float
    #: Parameters of the same meaning across the tangent, and what stretch does to both.
    across: str = ""
    stretched: float = 0.0


@dataclass(frozen=True)
class Candidate:
    model: str
    #: From the node's values: parameters, as pack.check_value takes them.
    values: Callable
    width: Width | None = None
    #: Which of the node's sockets is which parameter.
    links: dict = field(default_factory=dict)


def _grey(color):
    return sum(color) / 3


def _mixed(native):
    """Reflectance along the normal."""
    m = native.metallic
    return tuple((1 - m) * native.f0 + m * c for c in native.color)


def _base(native):
    return tuple((1 - native.metallic) * c for c in native.color)


_SLOPE = {"low": 1e-3, "high": 1.0, "power": 2}
_EXPONENT = {"low": 1.0, "high": 1e6, "power": -4}
_COLORED = (
    Candidate(
        "cook_torrance",
        lambda n: {"f0": n.color},
        Width("m", **(_SLOPE | {"low": 1e-4})),
        {"f0": "Color"},
    ),
    Candidate(
        "ward",
        lambda n: {"ks": n.color},
        Width("ax", **_SLOPE, across="ay", stretched=0.5),
        {"ks": "Color"},
    ),
    Candidate("blinn", lambda n: {"ks": n.color}, Width("e", **_EXPONENT), {"ks": "Color"}),
    Candidate("max_phong", lambda n: {"ks": n.color}, Width("e", **_EXPONENT), {"ks": "Color"}),
    Candidate(
        "modified_phong", lambda n: {"ks": n.color}, Width("e", **_EXPONENT), {"ks": "Color"}
    ),
)
_MATTE = (
    Candidate("lambert", lambda n: {"rho": n.color}, None, {"rho": "Color"}),
    *(
        Candidate(
            "oren_nayar",
            lambda n, form=form: {"rho": n.color, "form": form},
            Width("sigma", 1e-3, 0.66, 1),
            {"rho": "Color"},
        )
        for form in ("full", "qualitative")
    ),
)
_MIRROR = Candidate("lambertian_specular", lambda n: {"rd": 0.0, "rs": _grey(n.color)})
_COATED = Candidate("coupled", lambda n: {"r0": n.f0, "rm": n.color}, None, {"rm": "Color"})


def _polished(links):
    """A highlight over a base that gives way to it."""
    width = Width("nu", **_EXPONENT, across="nv", stretched=-1.0)
    return tuple(
        Candidate(
            "ashikhmin_shirley",
            lambda n, diffuse=diffuse: {"rs": _mixed(n), "rd": _base(n), "diffuse": diffuse},
            width,
            links,
        )
        for diffuse in ("paper", "tabulated")
    )


def candidates(native):
    """What may stand for a node. A model without a highlight is none for a node that has one,
    however little of the light that is."""
    if native.kind == "diffuse" or (native.kind == "principled" and _mixed(native) == (0, 0, 0)):
        return _MATTE
    if native.is_mirror:
        return (_COATED,) if native.kind == "principled" and native.metallic == 0 else (_MIRROR,)
    if native.kind == "glossy":
        return _COLORED
    if native.metallic == 1:
        return (*_COLORED, *_polished({"rs": "Color"}))
    return _polished({"rd": "Color"} if native.metallic == 0 else {})


# ---- how near ------------------------------------------------------------------------------------


class Directions:
    """Views and directions of light that see a node's lobe, with weights of an integral over wi."""

    def __init__(self, native):
        azimuths = (0.3,) if native.stretch == 1 else (0.2, 1.3)
        self.each = np.array(
            [
                (math.sqrt(1 - c * c) * math.cos(a), math.sqrt(1 - c * c) * math.sin(a), c)
                for c in VIEWS
                for a in azimuths
            ]
        )
        i = np.arange(DIRECTIONS)
        u = (0.5 + np.outer(i, (0.8191725134, 0.6710436067))) % 1
        r, phi = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
        flat = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - u[:, 0])], -1)
        alpha = tuple(max(a, 0.02) for a in native.alpha)
        h = native_bsdf.draw_facets(u, alpha)
        wi, wo, weight, which = [], [], [], []
        for k, w in enumerate(self.each):
            drawn = 2 * (h @ w)[:, None] * h - w
            # A sample below the surface stands for none: it must not count as one either.
            both = np.concatenate([flat, drawn])
            up = both[:, 2] > 1e-4
            both = both[up]
            here = np.broadcast_to(w, both.shape)
            half = native_bsdf.half(both, here)
            of_lobe = native_bsdf.distribution(half, alpha, False) * half[:, 2]
            of_lobe /= 4 * np.maximum((half * here).sum(-1), 1e-6)
            density = (both[:, 2] / np.pi + of_lobe) / 2
            wi.append(both)
            wo.append(here)
            weight.append(1 / (density * 2 * DIRECTIONS))
            which.append(np.full(len(both), k))
        self.wi, self.wo = np.concatenate(wi), np.concatenate(wo)
        self.weight, self.which = np.concatenate(weight), np.concatenate(which)

    def light(self, f_cos):
        """Integral over the directions of light by view, (k, 3)."""
        weighed = f_cos * self.weight[:, None]
        return np.stack([np.bincount(self.which, weighed[:, c]) for c in range(3)], -1)


class Target:
    """A node's light at these directions."""

    def __init__(self, native):
        self.native, self.at = native, Directions(native)
        self.f_cos = native_bsdf.f_cos(
            native, self.at.wi, self.at.wo, (self.at.each, self.at.which)
        )
        self.mirror = native_bsdf.mirror(native, self.at.each)
        self.total = self.at.light(self.f_cos) + self.mirror

    def error(self, model, values):
        """Part of the light that the model sends elsewhere, mean over views and channels."""
        from .brdfc import model as formulas

        formula, at = formulas(model), self.at
        f = formula.eval(at.wi, at.wo, **values) * at.wi[:, 2:]
        off = at.light(np.abs(f - self.f_cos))
        off += np.abs(formula.mirror(at.each, **values) - self.mirror)
        return float((off.sum(1) / np.maximum(self.total.sum(1), 1e-9)).mean())


def _with_width(candidate, native, factor):
    """Values of a candidate whose width is `factor` times the power of the roughness."""
    values, width = dict(candidate.values(native)), candidate.width
    if width is None:
        return values
    size = factor * max(native.roughness, 1e-3) ** width.power
    stretch = native.stretch**width.stretched if width.across else 1.0
    for name, share in ((width.name, stretch), (width.across, 1 / stretch)):
        if name:
            values[name] = float(min(max(size * share, width.low), width.high))
    return values


def nearest_factor(candidate, targets):
    """The factor of the width with the least mean error over the targets, and that error."""

    def error(factor):
        return sum(
            t.error(candidate.model, _with_width(candidate, t.native, factor)) for t in targets
        ) / len(targets)

    if candidate.width is None:
        return 1.0, error(1.0)
    width, r = candidate.width, np.array([max(t.native.roughness, 1e-3) for t in targets])
    ends = np.log([width.low, width.high])[:, None] - width.power * np.log(r)[None]
    low, high = ends.min(), ends.max()
    grid = np.linspace(low, high, 16)
    errors = [error(math.exp(x)) for x in grid]
    best = int(np.argmin(errors))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    golden = (math.sqrt(5) - 1) / 2
    for _ in range(10):
        a, b = high - golden * (high - low), low + golden * (high - low)
        low, high = (low, b) if error(math.exp(a)) < error(math.exp(b)) else (a, high)
    factor = math.exp((low + high) / 2)
    return min((error(f), f) for f in (factor, math.exp(grid[best])))[::-1]


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


def _value(node, name, default=0.0):
    """Of a socket that nothing may be linked to."""
    socket = node.inputs.get(name)
    if socket is None:
        return default
    if socket.is_linked:
        raise Refused(say("{socket} is linked", socket=Sentence(name)))
    value = socket.default_value
    return tuple(value)[:3] if hasattr(value, "__len__") else float(value)


def _color(node, name):
    socket = node.inputs[name]
    return GREY if socket.is_linked else tuple(socket.default_value)[:3]


def natives(node):
    """The node as Native, at one roughness or, where that is linked, at several. Raises Refused."""
    kind = KINDS[node.bl_idname]
    color = "Base Color" if kind == "principled" else "Color"
    given = {"kind": kind, "color": tuple(min(max(c, 0.0), 1.0) for c in _color(node, color))}
    if kind in ("glossy", "principled"):
        if node.distribution not in ("GGX", "MULTI_GGX", "BECKMANN"):
            kind = node.bl_rna.properties["distribution"].enum_items[node.distribution].name
            raise Refused(say("its distribution is {kind}", kind=Sentence(kind)))
        given["beckmann"] = node.distribution == "BECKMANN"
        given["multiscatter"] = node.distribution == "MULTI_GGX"
        given["stretch"] = _stretch(node, kind)
    if kind == "principled":
        for name, (off, what) in _OFF.items():
            if name in node.inputs and (_value(node, name) != off):
                raise Refused(say("it has {what}", what=Sentence(what)))
        if _value(node, "Specular Tint", (1, 1, 1)) != (1, 1, 1):
            raise Refused(say("it has a Specular Tint"))
        level, ior = _value(node, "Specular IOR Level"), _value(node, "IOR")
        given["f0"] = min(((ior - 1) / (ior + 1)) ** 2 * 2 * level, 0.9)
        given["metallic"] = min(max(_value(node, "Metallic"), 0.0), 1.0)
        given["diffuse_roughness"] = _value(node, "Diffuse Roughness")
    linked = node.inputs["Roughness"].is_linked
    roughnesses = ROUGHNESSES if linked else (min(max(_value(node, "Roughness"), 0.0), 1.0),)
    return [Native(**given, roughness=r) for r in roughnesses]


def _stretch(node, kind):
    """Width of the lobe along the tangent over that across it."""
    a = _value(node, "Anisotropic" if kind == "principled" else "Anisotropy")
    if a == 0:
        return 1.0
    turn = _value(node, "Anisotropic Rotation" if kind == "principled" else "Rotation")
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
    #: Part of the light that goes elsewhere.
    error: float = 0.0
    #: Parameter by the node's socket.
    links: dict = field(default_factory=dict)
    #: Parameters that follow a linked roughness: (name, factor, power).
    widths: tuple = ()
    refusal: str = ""

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
            "{material}, {node}: {model}, off by {percent} % of the light",
            **of,
            percent=f"{100 * self.error:.2g}",
        )


def _plan_glass(material, node):
    color, roughness = _value(node, "Color"), _value(node, "Roughness")
    if roughness > 1e-3:
        raise Refused(say("no model is of rough glass"))
    if _value(node, "Thin Film Thickness") != 0:
        raise Refused(say("it has {what}", what=Sentence("Thin Film")))
    # Blender's glass tints what it reflects and what it lets through.
    error = sum(abs(1 - c) for c in color) / max(sum(color), 1e-6)
    ior = node.inputs["IOR"]
    values = {} if ior.is_linked else {"ior": ior.default_value}
    return Plan(material, node, "fresnel_dielectric", values, error, {"ior": "IOR"})


def _plan_node(material, node):
    if KINDS[node.bl_idname] == "glass":
        return _plan_glass(material, node)
    targets = [Target(n) for n in natives(node)]
    found = []
    for candidate in candidates(targets[0].native):
        if candidate.model not in pack.model_names():
            continue  # a pack that is cut to a scene
        width = candidate.width
        if targets[0].native.stretch != 1 and not (width and width.across):
            continue
        factor, error = nearest_factor(candidate, targets)
        found.append((error, factor, candidate))
    if not found:
        raise Refused(say("this extension has no model that is near"))
    error, factor, candidate = min(found, key=lambda f: f[0])
    native, width = targets[0].native, candidate.width
    color = "Base Color" if native.kind == "principled" else "Color"
    if node.inputs[color].is_linked and "Color" not in candidate.links.values():
        raise Refused(
            say(
                "{socket} is linked, and its nearest model has more than one colour",
                socket=Sentence(color),
            )
        )
    links = {name: color if s == "Color" else s for name, s in candidate.links.items()}
    values, widths = _with_width(candidate, native, factor), ()
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
                if material.library is not None or not material.is_editable:
                    raise Refused(say("it is linked from another file"))
                if grouped:
                    raise Refused(say("its shader is inside this node group: ungroup it first"))
                plans.append(_plan_node(material, node))
            except Refused as why:
                plans.append(Plan(material, node, refusal=why.args[0]))
    return plans


# ---- there and back ------------------------------------------------------------------------------


def apply(plans):
    """Puts the models into the materials: links stay, and the nodes of before, which nothing shows
    any more, so that restore() finds them. Returns how many nodes were converted.

    All groups are made before anything is changed. Raises ValueError, CompileError.
    """
    wanted = [p for p in plans if not p.refusal]
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
    """Puts the nodes of before back; where they are gone, the twin, which Blender's own nodes are
    as well. Returns how many nodes were put back. Raises ValueError where there is neither."""
    if material.node_tree is None:
        return 0
    tree = material.node_tree
    pairs = [(n, _before(n)) for n in tree.nodes if is_converted(n)]
    for group, before in pairs:
        if before is None:  # refused before anything is changed
            pack.resolve(nodes.identity(group)[0], "twin", nodes.all_values(group))
    for group, before in pairs:
        if before is None:
            nodes.switch(group, "twin")
            del group[BEFORE]
            continue
        for link in list(group.outputs["BSDF"].links):
            target = link.to_socket
            tree.links.remove(link)
            tree.links.new(before.outputs[0], target)
        before.location = group.location
        for helper in [n for n in tree.nodes if n.get(HELPS) == group.name]:
            tree.nodes.remove(helper)
        tree.nodes.remove(group)
    nodes.remove_unused_groups()
    return len(pairs)
