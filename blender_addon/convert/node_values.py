# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads one of Blender's nodes for its conversion: its kind, its values, and why it can't be
converted."""

import functools

import bpy
import numpy as np

from ..common.i18n import Sentence, say
from ..nearest import native_bsdf, specular
from ..nearest.native_bsdf import Native
from ..trees import animation, shader_trees, shader_values, value_bounds

#: The roughnesses and anisotropies at which a model is fitted when a texture provides them; and in
#: which pairs, if it provides both.
ROUGHNESSES = (0.2, 0.5, 0.8)
_ANISOTROPIES = (0.5, 0.8, 0.2)
#: A linked colour that is unknown may lie anywhere between these: a plan's error is then a range.
DARK, BRIGHT = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
#: Models are not compared with linked roughnesses below this: Cycles shows a mirror there.
_LEAST_ROUGHNESS = 0.05
#: If the instances of a node have more colours, the error is computed for the darkest and the
#: brightest.
_MOST_COLORS = 4

KINDS = {
    "ShaderNodeBsdfDiffuse": "diffuse",
    "ShaderNodeBsdfAnisotropic": "glossy",
    "ShaderNodeBsdfPrincipled": "principled",
    "ShaderNodeBsdfGlass": "glass",
    "ShaderNodeBsdfMetallic": "metallic",
}
#: Nodes that stay beside models, as they do what models can't. Cycles shows nothing of a volume's
#: node in a surface, where importers put one.
STAYING = {
    f"ShaderNode{name}"
    for name in (
        *("AddShader", "Background", "BsdfTransparent", "Emission", "Holdout", "MixShader"),
        *("Script", "VolumeAbsorption", "VolumeScatter", "VolumePrincipled", "VolumeCoefficients"),
    )
}
#: Sockets that must have the value at which they have no effect, as no model offers their effect.
_OFF = {"Thin Film Thickness": (0.0, "Thin Film"), "Thin Wall": (0.0, "Thin Wall")}
#: Sockets that the conversion understands, by kind; any other socket with a changed value is a
#: reason to refuse.
KNOWN_SOCKETS = {
    "diffuse": {"Color", "Roughness", "Normal", "Weight"},
    "glossy": {"Color", "Roughness", "Anisotropy", "Rotation", "Normal", "Tangent", "Weight"},
    "glass": {
        *("Color", "Roughness", "IOR", "Normal", "Weight"),
        *("Thin Film Thickness", "Thin Film IOR"),
    },
    "metallic": {
        *("Base Color", "Edge Tint", "Roughness", "Anisotropy", "Rotation", "Normal", "Tangent"),
        *("Weight", "IOR", "Extinction", "Thin Film Thickness", "Thin Film IOR"),
    },
    "principled": {
        *_OFF,
        *("Base Color", "Metallic", "Roughness", "IOR", "Alpha", "Normal", "Weight"),
        *("Diffuse Roughness", "Specular IOR Level", "Specular Tint"),
        *("Anisotropic", "Anisotropic Rotation", "Tangent", "Transmission Weight"),
        *("Subsurface Weight", "Subsurface Radius", "Subsurface Scale", "Subsurface IOR"),
        *("Subsurface Anisotropy", "Coat Weight", "Coat Roughness", "Coat IOR", "Coat Tint"),
        *("Coat Normal", "Sheen Weight", "Sheen Roughness", "Sheen Tint", "Thin Film IOR"),
        *("Emission Color", "Emission Strength"),
    },
}
#: The settings of nodes that the conversion understands.
_KNOWN_SETTINGS = {"distribution", "subsurface_method", "fresnel_type"}


#: Sockets to which importers and material generators often link an image of a single colour.
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


def has_own_animation(socket, animated):
    """Whether a socket takes its own value, which is animated; `animated`: the properties of its
    node that are."""
    if animation.value_key(socket) not in animated:
        return False
    reached = shader_trees.reach(socket)
    return reached.output is None and reached.holder == socket


class Inputs:
    """The values of a node's sockets, which have to hold within all of its instances: `withins` as
    for shader_trees.reach(). Raises Refused if one varies in a way that no model can follow."""

    def __init__(self, node, withins=((),)):
        self._node, self._animated = node, animation.animated_properties(node)
        self._withins = withins
        self._values = shader_values.Constants(), shader_values.Constants(images=True)
        self._found = {}

    def __contains__(self, name):
        return name in self._node.inputs

    @property
    def kind(self):
        """The kind of the node, a value of KINDS."""
        return KINDS[self._node.bl_idname]

    def moves(self, name):
        """Whether a socket has a value of its own that is animated or driven: it can be moved."""
        return name in self and has_own_animation(self._node.inputs[name], self._animated)

    def reaches(self, name):
        """Whether the output of a node, or an animation, controls a socket; either can be kept."""
        return shader_trees.is_driven(self._node.inputs[name]) or self.moves(name)

    def is_same_everywhere(self, name):
        """Whether a link reaches a socket in all instances of the node, or in none as it has no
        link."""
        socket = self._node.inputs[name]
        if not shader_trees.is_driven(socket):
            return True
        return all(shader_trees.reach(socket, w).output is not None for w in self._withins)

    def constant(self, name):
        """The value of a socket, also through links; None if it is not constant."""
        if name not in self._found:
            values, socket = self._values[name in _OFTEN_ONE_COLOR], self._node.inputs[name]
            told = {values.told(socket, within) for within in self._withins}
            self._found[name] = told.pop() if len(told) == 1 else None
        return self._found[name]

    def means(self, name, part="mean"):
        """The distinct values, or means of images; None if one of them is unknown. `part`: as for
        shader_values.mean()."""
        if (known := self.constant(name)) is not None:
            return [known]
        socket = self._node.inputs[name]
        found = dict.fromkeys(shader_values.mean(socket, within, part) for within in self._withins)
        return None if None in found else list(found)

    def bounds(self, name):
        """The smallest and the largest value of a socket, (low, high), of each channel of a
        colour. What is unknown counts as between 0 and 1."""
        socket = self._node.inputs[name]
        found = [None] if self.moves(name) else []
        found += [value_bounds.bounds(socket, within) for within in self._withins]
        if None in found:
            return (DARK, BRIGHT) if socket.type == "RGBA" else (0.0, 1.0)
        low, high = np.min([pair[0] for pair in found], 0), np.max([pair[1] for pair in found], 0)
        return (tuple(low), tuple(high)) if np.ndim(low) else (float(low), float(high))

    def ends(self, name):
        """The same as two numbers, of a colour those of its channels."""
        low, high = self.bounds(name)
        return float(np.min(low)), float(np.max(high))

    def mean(self, name):
        """The mean of these; None if one of them is unknown."""
        found = self.means(name)
        if found is None or not isinstance(found[0], tuple):
            return found and sum(found) / len(found)
        return tuple(sum(channel) / len(found) for channel in zip(*found, strict=True))

    def follows(self, name):
        """Whether a socket has a value that varies, linked or animated. Raises Refused if something
        behind its link is animated that Cycles passes over."""
        if self.constant(name) is None and not self.reaches(name):
            raise Refused(say("{socket} is animated", socket=Sentence(name)))
        return self.constant(name) is None

    def value(self, name, default=0.0):
        """The value of a socket that has to be constant."""
        if name not in self:
            return default
        if self.follows(name):
            what = Sentence(name)
            if self.moves(name):
                raise Refused(say("{socket} is animated", socket=what))
            raise Refused(say("{socket} is linked, and converts only as one value", socket=what))
        return self.constant(name)

    def colors(self, name):
        """The colour for which a model is fitted, and the colours for which its error is computed:
        of images the mean, and those of the darkest and of the brightest tenth of the pixels; of
        others the darkest and the brightest."""
        if self.follows(name) and self.means(name) is None:
            ends = tuple(tuple(max(float(c), 0.0) for c in end) for end in self.bounds(name))
            return tuple(sum(c) / 2 for c in zip(*ends, strict=True)), ends
        parts = ("dark", "mean", "bright") if self.follows(name) else ("mean",)
        found = dict.fromkeys(color for part in parts for color in self.means(name, part))
        known = [tuple(max(c, 0.0) for c in color) for color in found]
        if len(known) > _MOST_COLORS:
            known.sort(key=sum)
            known = [known[0], known[-1]]
        return tuple(max(c, 0.0) for c in self.mean(name)), tuple(known)

    def setting(self, name):
        """A setting of the node itself."""
        if (self._node.as_pointer(), name) in self._animated:
            label = self._node.bl_rna.properties[name].name
            raise Refused(say("{socket} is animated", socket=Sentence(label)))
        return getattr(self._node, name)

    def check_unknown(self, known):
        """Raises Refused if sockets or settings are in use that a later version of Blender has
        added."""
        for socket in self._node.inputs:
            if socket.name in known or not socket.enabled:
                continue
            fresh = _fresh(self._node.bl_idname).get(socket.identifier)
            animated = animation.value_key(socket) in self._animated
            if self.reaches(socket.name) or animated or _held(socket) != fresh:
                raise Refused(say("it has {what}", what=Sentence(socket.name)))
        for setting in self._node.bl_rna.properties:
            name = setting.identifier
            if name in _KNOWN_SETTINGS or name in bpy.types.ShaderNode.bl_rna.properties:
                continue
            plain = setting.type in {"BOOLEAN", "INT", "FLOAT", "ENUM"}
            if plain and not setting.is_readonly and self.setting(name) != setting.default:
                raise Refused(say("it has {what}", what=Sentence(setting.name)))


def check_off(inputs):
    """Raises Refused if a Principled node has an effect that no model offers and that can't stay
    Blender's own."""
    for name, (off, what) in _OFF.items():
        if inputs.value(name, off) != off:
            raise Refused(say("it has {what}", what=Sentence(what)))


def given_of(node, inputs):
    """What all Natives of a node have in common, what they differ in, and what others differ in of
    which the error is computed too: at the ends of inputs that vary."""
    kind = inputs.kind
    inputs.setting("mute")
    if kind == "metallic" and inputs.setting("fresnel_type") != "F82":
        raise Refused(say("its metal is given by IOR and Extinction"))
    inputs.check_unknown(KNOWN_SOCKETS[kind])
    given, bases = {"kind": kind, "color": inputs.colors(color_of(kind))[0]}, (0.0,)
    if kind in ANISOTROPY:
        distribution = inputs.setting("distribution")
        if distribution not in ("GGX", "MULTI_GGX", "BECKMANN"):
            name = node.bl_rna.properties["distribution"].enum_items[distribution].name
            raise Refused(say("its distribution is {kind}", kind=Sentence(name)))
        given["beckmann"] = distribution == "BECKMANN"
        given["multiscatter"] = distribution == "MULTI_GGX"
    if kind == "metallic":
        # The same as a Principled node that is metal all over.
        check_off(inputs)
        tint = tuple(max(c, 0.0) for c in inputs.value("Edge Tint"))
        given |= {"kind": "principled", "metallic": 1.0, "tint": tint}
    if kind == "principled":
        check_off(inputs)
        metallic = 0.5 if (known := inputs.mean("Metallic")) is None else known
        given["metallic"] = min(max(metallic, 0.0), 1.0)
        if is_plastic(inputs):
            given["f0"] = f0_of(inputs)
            bases = roughnesses_of(inputs, "Diffuse Roughness")
        varying = varying_of(inputs)
        if varying and varying.socket == specular.TINT.socket:
            tint = (varying.top,) * 3
        else:
            tint = inputs.value("Specular Tint", (1.0, 1.0, 1.0))
        given["tint"] = tuple(max(c, 0.0) for c in tint)
    roughnesses = roughnesses_of(inputs, "Roughness")
    stretches = (1.0,)
    if kind in ANISOTROPY and not is_mirror(roughnesses):
        stretches = _stretches(inputs, kind)
    count = max(len(roughnesses), len(stretches), len(bases))
    looks = {"roughness": roughnesses, "stretch": stretches, "diffuse_roughness": bases}
    ends = {
        "roughness": _ends_of(inputs, "Roughness", roughnesses),
        "diffuse_roughness": _ends_of(inputs, "Diffuse Roughness", bases),
    }
    if len(stretches) > 1:
        found = inputs.ends(ANISOTROPY[kind][0])
        ends["stretch"] = tuple(map(_stretch_of, found))
    ends = {name: values for name, values in ends.items() if values}
    return given, _in_turn(looks, count), _in_turn(looks | ends, 2) if ends else []


def _in_turn(looks, count):
    """`count` dicts of values from {name: values}, which are repeated."""
    looks = {name: (values * count)[:count] for name, values in looks.items()}
    return [{name: looks[name][i] for name in looks} for i in range(count)]


def roughnesses_of(inputs, name):
    """The roughness of a socket, or several."""
    return ROUGHNESSES if inputs.follows(name) else (min(max(inputs.value(name), 0.0), 1.0),)


def _ends_of(inputs, name, roughnesses):
    """The lowest and the highest roughness of a socket that varies; none if it is one."""
    if len(roughnesses) == 1:
        return ()
    least = _LEAST_ROUGHNESS if name == "Roughness" else 0.0
    return tuple(min(max(end, least), 1.0) for end in inputs.ends(name))


def is_plastic(inputs):
    """Whether a Principled node is not metal all over."""
    known = inputs.mean("Metallic")
    return inputs.follows("Metallic") or known is None or known < 1


def varying_of(inputs):
    """The specular.Varying of a Principled node; None if it has none that has an effect. Raises
    Refused if there are two."""
    if not is_plastic(inputs):
        return None
    both = (specular.LEVEL, specular.TINT)
    found = [v for v in both if v.socket in inputs and inputs.follows(v.socket)]
    if len(found) > 1:
        raise both_linked(*(v.socket for v in found))
    return found[0].between(*inputs.ends(found[0].socket)) if found else None


def both_linked(socket, other):
    """The Refused for two links of which one model can't follow both."""
    return Refused(
        say(
            "{socket} and {other} are linked, and only one of them can stay",
            socket=Sentence(socket),
            other=Sentence(other),
        )
    )


def f0_of(inputs):
    """Reflectance of the interface of a Principled node at normal incidence, at the highest level
    if the level varies."""
    varying = varying_of(inputs)
    varies = varying and varying.socket == specular.LEVEL.socket
    level = varying.top if varies else inputs.value("Specular IOR Level")
    ior = inputs.value("IOR")
    if ior < 1:
        # As seen from within glass: beyond some angle everything is reflected.
        raise Refused(say("its {socket} is below 1", socket=Sentence("IOR")))
    return min(((ior - 1) / (ior + 1)) ** 2 * 2 * max(level, 0.0), 1.0)


def is_mirror(roughnesses):
    """Whether these roughnesses are that of a mirror alone."""
    return max(roughnesses) < native_bsdf.SMOOTH


def color_of(kind):
    return "Base Color" if kind in ("principled", "metallic") else "Color"


def natives(node):
    """The node as Natives: one, or several if roughness or anisotropy are linked. Raises
    Refused."""
    given, looks, _ = given_of(node, Inputs(node))
    return [Native(**given, **look) for look in looks]


#: Sockets of the anisotropy and of its rotation, by kind of node.
ANISOTROPY = {
    "glossy": ("Anisotropy", "Rotation"),
    "metallic": ("Anisotropy", "Rotation"),
    "principled": ("Anisotropic", "Anisotropic Rotation"),
}
#: The square of the ratio of the widths of a Principled or Metallic node, across and along the
#: tangent, is 1 + RATIO * anisotropy.
RATIO = -0.9
#: Cycles clamps the Anisotropy of a Glossy node to this, and to its negative.
_MOST_GLOSSY = 0.99


def _stretch_of(anisotropic):
    """Ratio of the lobe's width along the tangent to that across it, of a Principled or Metallic
    node."""
    return 1 / (1 + RATIO * min(max(anisotropic, 0.0), 1.0))


def _stretches(inputs, kind):
    """Ratio of the lobe's width along the tangent to that across it, or several."""
    name, rotation = ANISOTROPY[kind]
    if kind != "glossy" and inputs.follows(name):
        found = _ANISOTROPIES
    else:
        found = (inputs.value(name),)
    if found == (0,):
        return (1.0,)
    # A model's own tangent is another one, and nodes that turn a vector take no default normal.
    turned = inputs.follows(rotation) or inputs.constant(rotation) != 0
    for socket in ("Tangent", *(["Normal"] if turned else [])):
        if not inputs.is_same_everywhere(socket):
            said = say(
                "{socket} is a group input that is not linked everywhere", socket=Sentence(socket)
            )
            raise Refused(said)
    if kind != "glossy":
        return tuple(_stretch_of(a) for a in found)
    found = tuple(min(max(a, -_MOST_GLOSSY), _MOST_GLOSSY) for a in found)
    return tuple((1 - a) ** 2 if a > 0 else 1 / (1 + a) ** 2 for a in found)


def glows(inputs):
    """Whether a Principled node emits light."""
    names = ("Emission Color", "Emission Strength")
    for name in names:
        known = inputs.constant(name)
        if known is not None and not any(known if isinstance(known, tuple) else (known,)):
            return False
    for name in names:
        inputs.follows(name)
    return True


def is_transparent(inputs):
    """Whether a Principled node is partly transparent (Alpha)."""
    return inputs.follows("Alpha") or inputs.constant("Alpha") < 1
