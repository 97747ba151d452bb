# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light lights and materials emit, according to their nodes and settings."""

import numpy as np

from ..common import color
from ..trees import shader_trees, shader_values
from . import ies

#: The power of a lamp that is dark in this frame and may light up in another one.
DARK = 1e-9


def animated(owner):
    """Whether a data-block is animated itself."""
    data = owner.animation_data
    return data is not None and bool(data.action or data.drivers or data.nla_tracks)


def _luminance(rgb):
    return float(color.luminance(np.array(rgb[:3])))


class _Level(shader_values.Current):
    """The approximate value of an input at the current frame; values that are unknown or vary over
    the surface count as 1."""

    def output(self, reached, of):
        try:
            return super().output(reached, of)
        except shader_values.Unknown:
            return 1.0

    def _lightfalloff(self, node, output, of):  # other kinds than quadratic: value at 1 m
        return of(node.inputs["Strength"])

    def _texies(self, node, output, of):
        return of(node.inputs["Strength"]) * ies.level(node)


def _strength(shown, names):
    """Luminance that a node emits, from its sockets of colour and strength."""
    shade, strength = (_Level().told(shown.node.inputs[n], shown.within) for n in names)
    return (1.0 if shade is None else _luminance(shade)) * (1.0 if strength is None else strength)


_EMITTERS = {
    "ShaderNodeEmission": ("Color", "Strength"),
    "ShaderNodeBsdfPrincipled": ("Emission Color", "Emission Strength"),
}


#: Nodes whose outputs are uniform over an object if their inputs are. All others, such as textures
#: and nodes of later Blender versions, are assumed to vary.
_SAME_EVERYWHERE = {
    f"ShaderNode{name}"
    for name in (
        *("AddShader", "Background", "Blackbody", "BrightContrast", "Clamp", "CombineColor"),
        *("CombineHSV", "CombineRGB", "CombineXYZ", "Emission", "FloatCurve", "Gamma"),
        *("HueSaturation", "Invert", "LightFalloff", "LightPath", "MapRange", "Mapping", "Math"),
        *("Mix", "MixRGB", "MixShader", "ObjectInfo", "ParticleInfo", "RGB", "RGBCurve"),
        *("RGBToBW", "SeparateColor", "SeparateHSV", "SeparateRGB", "SeparateXYZ", "Squeeze"),
        *("ValToRGB", "Value", "VectorCurve", "VectorMath", "VectorRotate", "Wavelength"),
    )
}
#: Inputs that control how a node combines shaders.
_JOINTS = {"ShaderNodeMixShader": (0,), "ShaderNodeAddShader": ()}


def _differs(socket, within, seen):
    """Whether a value varies over the object."""
    reached = shader_trees.reach(socket, within)
    if reached.output is None or reached.shown in seen or _is_other_side(reached.output):
        return False
    seen.add(reached.shown)
    if reached.node.bl_idname not in _SAME_EVERYWHERE:
        return True
    return any(_differs(own, reached.within, seen) for own in reached.node.inputs)


def _is_other_side(output):
    return output.node.bl_idname == "ShaderNodeNewGeometry" and output.name == "Backfacing"


def _is_lit(shown, known):
    """Whether a node emits, or one whose shader reaches it. `known`: the answers so far."""
    if shown not in known:
        known[shown] = False  # the answer while it is being examined
        names = _EMITTERS.get(shown.node.bl_idname)
        reached = [shown.reach(s) for s in shown.node.inputs if s.type == "SHADER"]
        known[shown] = bool(names and _strength(shown, names) != 0) or any(
            _is_lit(r.shown, known) for r in reached if r.output is not None
        )
    return known[shown]


def is_even(owner):
    """Whether a light or a material emits uniformly. Mixes of shaders that do not emit, such as
    those of a layer and its base, don't matter."""
    known = {}
    for shown in shader_trees.shown(owner):
        node = shown.node
        if not _is_lit(shown, known):
            continue
        names = _JOINTS.get(node.bl_idname, ())
        if node.bl_idname in _EMITTERS:
            names = (*_EMITTERS[node.bl_idname], *(("Alpha",) if "Alpha" in node.inputs else ()))
        if any(_differs(node.inputs[name], shown.within, set()) for name in names):
            return False
    return True


def _radiances(material):
    """Radiance of each emitting node that the material shows."""
    return [
        _strength(shown, _EMITTERS[shown.node.bl_idname])
        for shown in shader_trees.shown(material)
        if shown.node.bl_idname in _EMITTERS
    ]


def of_material(material):
    """Radiance of a material as far as Cycles' light sampling includes it; 0 for most."""
    return 0.0 if material.cycles.emission_sampling == "NONE" else sum(_radiances(material))


def may_shine(material):
    """Whether a material emits, now or when animated, even if light sampling excludes it."""
    found = _radiances(material)
    return any(found) or bool(found and animated(material.node_tree))


def is_painted(item, emitting):
    """Whether an object has one of the emissive materials."""
    return any(slot.material in emitting for slot in item.material_slots)


def of_light(light, extent):
    """Power of a light times its colour, as an absolute value: closures aim also at lamps of
    negative power. For a dark lamp that may light up, a very small number. `extent`: area or solid
    angle by which Cycles multiplies the light's power."""
    power = light.energy * _luminance(light.color) * 2.0 ** getattr(light, "exposure", 0.0)
    power *= extent
    if shader_trees.shading(light):
        power *= sum(
            _strength(shown, _EMITTERS["ShaderNodeEmission"])
            for shown in shader_trees.shown(light)
            if shown.node.bl_idname == "ShaderNodeEmission"
        )
    if power == 0 and (animated(light) or (light.node_tree and animated(light.node_tree))):
        return DARK
    return abs(power)
