# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light lights and materials give, as their nodes and settings have it."""

import math

import bpy
import numpy as np

from .. import color, shader_trees
from . import ies


def animated(owner):
    """Whether a data-block has animation of its own."""
    data = owner.animation_data
    return data is not None and bool(data.action or data.drivers or data.nla_tracks)


def _luminance(rgb):
    return float(color.luminance(np.array(rgb[:3])))


def _level(socket):
    """Luminance of a colour, or a number, that a socket has: about, where a link controls it, and 1
    where nothing is known of that."""
    if not socket.is_linked:
        value = socket.default_value
        return _luminance(value) if hasattr(value, "__len__") else value
    source = socket.links[0].from_socket
    node = source.node
    if node.bl_idname == "NodeReroute":
        return _level(node.inputs[0])
    if node.bl_idname in {"ShaderNodeValue", "ShaderNodeRGB"}:
        value = source.default_value
        return _luminance(value) if hasattr(value, "__len__") else value
    if node.bl_idname == "ShaderNodeLightFalloff":  # others than quadratic falloff as at 1 m
        return _level(node.inputs["Strength"])
    if node.bl_idname == "ShaderNodeTexIES":
        return _level(node.inputs["Strength"]) * ies.level(node)
    if node.bl_idname == "ShaderNodeMath" and node.operation == "MULTIPLY":
        return _level(node.inputs[0]) * _level(node.inputs[1])
    return 1.0  # so has a Blackbody


def _strength(node, *names):
    """Luminance that a node emits, by its sockets of colour and strength."""
    return math.prod(_level(node.inputs[name]) for name in names)


_EMITTERS = {
    "ShaderNodeEmission": ("Color", "Strength"),
    "ShaderNodeBsdfPrincipled": ("Emission Color", "Emission Strength"),
}


#: Nodes by which light differs from place to place, beside textures.
_PLACES = {
    f"ShaderNode{name}"
    for name in (
        *("NewGeometry", "UVMap", "Attribute", "VertexColor", "Tangent", "Bevel", "Wireframe"),
        *("AmbientOcclusion", "LayerWeight", "Fresnel", "CameraData", "Script"),
    )
}
#: What goes through a node that joins shaders.
_JOINTS = {"ShaderNodeMixShader": (0,), "ShaderNodeAddShader": ()}


def _differs(socket, seen):
    """Whether a value differs from place to place."""
    for link in socket.links:
        node = link.from_node
        if node.bl_idname == "ShaderNodeNewGeometry" and link.from_socket.name == "Backfacing":
            continue  # the other side
        if node.bl_idname.startswith("ShaderNodeTex") or node.bl_idname in _PLACES:
            return True
        if node not in seen:
            seen.append(node)
            ends = shader_trees.ends(node)
            if any(_differs(own, seen) for end in ends for own in end.inputs):
                return True
    return False


def _shines_unevenly(socket, seen):
    """The same of the light of a shader. What does not emit does not count."""
    for link in socket.links:
        node = link.from_node
        if node in seen:
            continue
        seen.append(node)
        values = _JOINTS.get(node.bl_idname, ())
        if node.bl_idname in _EMITTERS:
            values = (*_EMITTERS[node.bl_idname], *(("Alpha",) if "Alpha" in node.inputs else ()))
        if any(_differs(node.inputs[name], []) for name in values):
            return True
        ends = shader_trees.ends(node)
        for own in (own for end in ends for own in end.inputs):
            if own.type == "SHADER":
                if _shines_unevenly(own, seen):
                    return True
            # What a group makes of its inputs is not looked into.
            elif len(ends) > 1 and _differs(own, []):
                return True
    return False


def _surface(owner):
    """The socket by which nodes shade a light or a material, or None."""
    kind = "Material" if isinstance(owner, bpy.types.Material) else "Light"
    tree = shader_trees.shading(owner)
    output = shader_trees.output(tree, f"ShaderNodeOutput{kind}") if tree is not None else None
    return output.inputs["Surface"] if output is not None else None


def is_even(owner):
    """Whether a light or a material emits the same at every place of it."""
    surface = _surface(owner)
    return surface is None or not _shines_unevenly(surface, [])


def of_material(material):
    """Radiance of a material that light sampling looks for, 0 of most."""
    surface = _surface(material)
    if surface is None or material.cycles.emission_sampling == "NONE":
        return 0.0
    return sum(
        _strength(node, *_EMITTERS[node.bl_idname])
        for node in shader_trees.upstream(surface, "SHADER")
        if node.bl_idname in _EMITTERS
    )


def sides(light):
    """Names of the properties that are an area lamp's two sizes."""
    return "size", "size_y" if light.shape in {"RECTANGLE", "ELLIPSE"} else "size"


def _size(light):
    """Area of a light, of a sun its solid angle: what the energy of one counts for each of that is
    not normalised; 0 where it has no size."""
    if light.type == "SUN":
        return math.pi * math.sin(light.angle / 2) ** 2
    if light.type != "AREA":
        return 4 * math.pi * light.shadow_soft_size**2
    width, height = (getattr(light, side) for side in sides(light))
    return width * height * (math.pi / 4 if light.shape in {"DISK", "ELLIPSE"} else 1.0)


def of_light(light):
    """Energy of a light times its colour, negative as it is positive: closures aim at lamps that
    take light as at others. Of a dark one that may light up, next to nothing."""
    power = light.energy * _luminance(light.color) * 2.0 ** getattr(light, "exposure", 0.0)
    if not light.normalize:
        power *= _size(light) or 1.0
    if shader_trees.shading(light):
        surface = _surface(light)
        nodes = shader_trees.upstream(surface, "SHADER") if surface else []
        power *= sum(
            _strength(n, "Color", "Strength") for n in nodes if n.bl_idname == "ShaderNodeEmission"
        )
    if power == 0 and (animated(light) or (light.node_tree and animated(light.node_tree))):
        return 1e-9
    return abs(power)
