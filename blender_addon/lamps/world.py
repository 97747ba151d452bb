# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps of a world: suns of Sky Textures and bright spots of environment images."""

import numpy as np
from mathutils import Euler, Matrix, Vector

from .. import color, shader_trees
from ..i18n import say
from . import bright_spots, emission, slots

#: Types of Sky Texture that show a sun; NISHITA became two in 5.0.
_SKIES_WITH_SUN = {"NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING"}
#: Irradiance that a sun of a Sky Texture of strength and intensity 1 is ranked by: in
#: daylight it outshines any lamp.
_SKY_SUN_IRRADIANCE = 100.0


def _reroute(socket):
    """The node at the other end of a socket's link, and the socket there."""
    while socket.is_linked:
        link = socket.links[0]
        if link.from_node.bl_idname != "NodeReroute":
            return link.from_node, link.from_socket
        socket = link.from_node.inputs[0]
    return None, None


def _turn_of(node):
    """How the direction of a ray becomes that of a texture, or None where that is not known."""
    matrix = Matrix.Identity(3)
    source, socket = _reroute(node.inputs["Vector"])
    while source is not None and source.bl_idname == "ShaderNodeMapping":
        inputs = source.inputs
        if inputs["Rotation"].is_linked or inputs["Scale"].is_linked:
            return None
        moves = inputs["Location"].is_linked or any(inputs["Location"].default_value)
        if moves and source.vector_type in {"POINT", "TEXTURE"}:
            return None
        turn = Euler(inputs["Rotation"].default_value).to_matrix()
        scale = Matrix.Diagonal(inputs["Scale"].default_value)
        try:
            step = {
                "POINT": lambda t, s: t @ s,
                "VECTOR": lambda t, s: t @ s,
                "TEXTURE": lambda t, s: (t @ s).inverted(),
                "NORMAL": lambda t, s: t @ s.inverted(),
            }[source.vector_type](turn, scale)
        except ValueError:
            return None
        matrix = matrix @ step
        source, socket = _reroute(inputs["Vector"])
    if source is None or (source.bl_idname, socket.name) in {
        ("ShaderNodeTexCoord", "Generated"),
        ("ShaderNodeNewGeometry", "Position"),
    }:
        return matrix
    return None


#: Spots by image: a large picture takes half a second. Nothing tells when pixels are painted.
_spots = {}


def forget_images():
    """Has images looked at anew."""
    _spots.clear()


def _image_spots(image):
    key = (image.session_uid, image.filepath, tuple(image.size), image.source)
    if key not in _spots:
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        if len(pixels) == 0 or len(pixels) != len(image.pixels):
            return []
        image.pixels.foreach_get(pixels)
        pixels = pixels.reshape(height, width, image.channels)
        if image.channels < 3:
            pixels = pixels[..., :1].repeat(3, axis=-1)
        pixels = pixels[..., :3]
        # Floats are in the working space already. Of bytes the curve is enough, to find what is
        # bright.
        if not image.is_float and not image.colorspace_settings.is_data:
            pixels = color.from_srgb(pixels)
        luminance = np.nan_to_num(np.maximum(color.luminance(pixels), 0), posinf=0.0)
        _spots[key] = bright_spots.find(luminance)
    return _spots[key]


def _sky(node, strength):
    """The sun of a Sky Texture. The dependency graph knows sockets of nodes and no other
    properties: a driver would print errors and miss changes, so handlers keep it current."""
    name = say("sun of {node}", node=node.label or node.name)
    power = _SKY_SUN_IRRADIANCE * strength * node.sun_intensity
    turn = (node.sun_elevation, node.sun_rotation, 0.0)
    values = slots.numbers(slots.SKY_SUN, turn=turn, sizes=(node.sun_size, 0.0))
    looks = slots.looks_alike(node.sun_size)
    return slots.Candidate(name, values, lambda p: np.full(len(p), power), looks)


def _environment(node, strength):
    """The bright spots of an Environment Texture."""
    if node.image is None:
        return
    name = node.image.name
    turn = _turn_of(node) if node.projection == "EQUIRECTANGULAR" else None
    for index, (direction, angle, irradiance) in enumerate(_image_spots(node.image)):
        which = say("{image}, bright spot {number}", image=name, number=index + 1)
        power = irradiance * strength
        candidate = slots.Candidate(
            which, None, lambda p, power=power: np.full(len(p), power), slots.looks_alike(angle)
        )
        back = None
        if turn is not None and abs(turn.determinant()) > 1e-9:
            back = turn.inverted() @ Vector(direction)
        if back is None or back.length < 1e-9:
            candidate.why = say("its vector or projection is not one that can be followed")
        else:
            quaternion, w = slots.turned(back)
            candidate.values = slots.numbers(
                slots.SUN, turn=quaternion, scale=(1, 1, w), sizes=(angle, 0.0)
            )
        yield candidate


def candidates(world):
    """A candidate for each sun and bright spot that a world shows; `world` may be None."""
    tree = shader_trees.shading(world) if world is not None else None
    if tree is None or world.cycles.sampling_method == "NONE":
        return
    output = shader_trees.output(tree, "ShaderNodeOutputWorld")
    if output is None:
        return
    seen = []
    for background in shader_trees.upstream(output.inputs["Surface"], "SHADER"):
        if background.bl_idname not in {"ShaderNodeBackground", "ShaderNodeEmission"}:
            continue
        socket = background.inputs["Strength"]
        strength = 1.0 if socket.is_linked else socket.default_value
        if strength <= 0 and not emission.animated(tree):
            continue
        for node in shader_trees.upstream(background.inputs["Color"]):
            if node in seen:
                continue
            seen.append(node)
            if node.bl_idname == "ShaderNodeTexEnvironment":
                yield from _environment(node, strength)
            elif node.bl_idname == "ShaderNodeTexSky":
                if node.sky_type in _SKIES_WITH_SUN and node.sun_disc:
                    yield _sky(node, strength)
