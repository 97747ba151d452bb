# SPDX-License-Identifier: GPL-3.0-or-later
"""Point lights: balls that shine in all directions alike."""

import math

from .. import slots
from .light import Light, seen_from

#: Power and radius of a new light in Blender.
_NEW = 1000, 0.1


def as_ball(light, place, turn, scale):
    """slots.placed() as balls have it: the second scale is 0 for a sphere, while lamps with soft
    falloff are disks (generator/forms/node_cones.h)."""
    return place, turn, scale if light.use_soft_falloff else (scale[0], 0.0, scale[2])


class Point(Light):
    objects = frozenset({"POINT"})

    def sizes(self, light):
        return ("shadow_soft_size",)

    def extent(self, light):
        return 4 * math.pi * light.shadow_soft_size**2

    def slot(self, light, placed, sign):
        radius = slots.Driven(light, "shadow_soft_size", sign)
        return slots.numbers(slots.BALL, *as_ball(light, *placed), (radius, 0.0))

    def irradiance(self, light, matrix, power, points):
        squared, _ = seen_from(points, matrix)
        return power / (4 * math.pi) / squared

    def angular_size(self, light, matrix):
        return slots.angular_size_at(matrix.translation, light.shadow_soft_size)

    def is_like_new(self, light):
        radius = _NEW[1]
        return self.is_moderate(light) and light.shadow_soft_size >= radius * (1 - 1e-6)

    def is_moderate(self, light):
        # Smaller ones are brighter, but random rays meet them less often.
        return light.energy <= _NEW[0]
