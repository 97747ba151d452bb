# SPDX-License-Identifier: GPL-3.0-or-later
"""Sun lights, which are as far away as the sky."""

import math

import numpy as np

from .. import slots
from .light import Light

#: From this angle on (radians), a sun that random rays do not meet is noisy in highlights.
_WIDE = 0.5
#: Irradiance of a sun on a clear day, in the units of Blender's suns.
_MODERATE = 3


class Sun(Light):
    objects = frozenset({"SUN"})
    least_size = 0.02
    dot_in_mirror = 0.02

    def sizes(self, light):
        return ("angle",)

    def extent(self, light):
        return math.pi * math.sin(light.angle / 2) ** 2

    def slot(self, light, placed, sign):
        return slots.numbers(slots.SUN, *placed, (slots.Driven(light, "angle", sign), 0.0))

    def irradiance(self, light, matrix, power, points):
        return np.full(len(points), power)

    def angular_size(self, light, matrix):
        return slots.angular_size_distant(light.angle)

    def is_wide(self, light):
        return light.angle > _WIDE

    def is_moderate(self, light):
        return light.energy <= _MODERATE
