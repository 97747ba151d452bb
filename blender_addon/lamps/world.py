# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps of a world: the suns of Sky Textures and the bright spots of environment images."""

import numpy as np
from mathutils import Euler, Matrix, Vector

from ..common import color
from ..common.i18n import say
from ..trees import shader_trees, shader_values
from . import bright_spots, emission, slots

#: Types of Sky Texture that show a sun; NISHITA was split in two in 5.0.
_SKIES_WITH_SUN = {"NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING"}
#: Irradiance by which the sun of a Sky Texture of strength and intensity 1 is ranked: in daylight
#: it outshines any lamp.
_SKY_SUN_IRRADIANCE = 100.0


def _turn_of(shown):
    """How the direction of a ray is mapped to that of a texture, or None if that is unknown."""
    matrix = Matrix.Identity(3)
    reached = shown.reach(shown.node.inputs["Vector"])
    while reached.output is not None and reached.node.bl_idname == "ShaderNodeMapping":
        source, inputs = reached.node, reached.node.inputs
        angles, sizes = (
            shader_values.current(inputs[name], reached.within) for name in ("Rotation", "Scale")
        )
        if angles is None or sizes is None:
            return None
        if source.vector_type in {"POINT", "TEXTURE"}:  # others have no location
            place = shader_values.current(inputs["Location"], reached.within)
            if place is None or any(place):
                return None
        turn, scale = Euler(angles).to_matrix(), Matrix.Diagonal(sizes)
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
        reached = shader_trees.reach(inputs["Vector"], reached.within)
    if reached.output is None or (reached.node.bl_idname, reached.output.name) in {
        ("ShaderNodeTexCoord", "Generated"),
        ("ShaderNodeNewGeometry", "Position"),
    }:
        return matrix
    return None


#: Cached by image: a large one takes half a second. Painting raises no event.
_spots = {}


def forget_images():
    """Clears the cache, so that images are examined anew."""
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
        # Float buffers are in the working space already. For bytes, undoing the sRGB curve is
        # enough to find bright spots.
        if not image.is_float and not image.colorspace_settings.is_data:
            pixels = color.from_srgb(pixels)
        luminance = np.nan_to_num(np.maximum(color.luminance(pixels), 0), posinf=0.0)
        _spots[key] = bright_spots.find(luminance)
    return _spots[key]


def _sky(node, strength):
    """The sun of a Sky Texture. The dependency graph knows node sockets but not other properties:
    drivers of these would print errors and miss changes, so handlers keep them up to date."""
    name = say("sun of {node}", node=node.label or node.name)
    power = _SKY_SUN_IRRADIANCE * strength * node.sun_intensity
    turn = (node.sun_elevation, node.sun_rotation, 0.0)
    values = slots.numbers(slots.SKY_SUN, turn=turn, sizes=(node.sun_size, 0.0))
    angular_size = slots.angular_size_distant(node.sun_size)
    return slots.Candidate(name, values, lambda p: np.full(len(p), power), angular_size)


def _environment(shown, strength):
    """The bright spots of an Environment Texture."""
    node = shown.node
    if node.image is None:
        return
    name = node.image.name
    turn = _turn_of(shown) if node.projection == "EQUIRECTANGULAR" else None
    for index, (direction, angle, irradiance) in enumerate(_image_spots(node.image)):
        which = say("{image}, bright spot {number}", image=name, number=index + 1)
        power = irradiance * strength
        candidate = slots.Candidate(
            which,
            None,
            lambda p, power=power: np.full(len(p), power),
            slots.angular_size_distant(angle),
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
    seen = []
    for background in shader_trees.shown(world):
        if background.node.bl_idname not in {"ShaderNodeBackground", "ShaderNodeEmission"}:
            continue
        inputs, within = background.node.inputs, background.within
        strength = shader_values.current(inputs["Strength"], within)
        strength = 1.0 if strength is None else strength
        if strength <= 0 and not emission.animated(tree):
            continue
        for shown in shader_trees.upstream(inputs["Color"], within=within):
            node = shown.node
            if node in seen:
                continue
            seen.append(node)
            if node.bl_idname == "ShaderNodeTexEnvironment":
                yield from _environment(shown, strength)
            elif node.bl_idname == "ShaderNodeTexSky":
                if node.sky_type in _SKIES_WITH_SUN and node.sun_disc:
                    yield _sky(node, strength)
