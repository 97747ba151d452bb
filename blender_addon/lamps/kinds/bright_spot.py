# SPDX-License-Identifier: GPL-3.0-or-later
"""Small bright spots of environment images, such as the sun or a window."""

import numpy as np
from mathutils import Euler, Matrix, Vector

from ...common import color
from ...common.i18n import say
from ...trees import shader_trees, shader_values
from ...trees.image_pixels import OfImages
from .. import bright_spots, slots
from .kind import Kind


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


def _find(image, pixels, is_float):
    if pixels.shape[-1] < 3:
        pixels = pixels[..., :1].repeat(3, axis=-1)
    pixels = pixels[..., :3]
    # Float buffers are in the working space already. For bytes, undoing the sRGB curve is enough to
    # find bright spots.
    if not is_float and not image.colorspace_settings.is_data:
        pixels = color.from_srgb(pixels)
    luminance = np.nan_to_num(np.maximum(color.luminance(pixels), 0), posinf=0.0)
    return bright_spots.find(luminance)


_spots = OfImages(_find)


class BrightSpot(Kind):
    nodes = frozenset({"ShaderNodeTexEnvironment"})

    def of_node(self, shown, strength):
        node = shown.node
        if node.image is None:
            return
        name = node.image.name
        turn = _turn_of(shown) if node.projection == "EQUIRECTANGULAR" else None
        for index, (direction, angle, irradiance) in enumerate(_spots.of(node.image) or ()):
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
                candidate.why = say("its vector or projection is not supported")
            else:
                quaternion, w = slots.turned(back)
                candidate.values = slots.numbers(
                    slots.SUN, turn=quaternion, scale=(1, 1, w), sizes=(angle, 0.0)
                )
            yield candidate

    def forget(self):
        _spots.forget()
