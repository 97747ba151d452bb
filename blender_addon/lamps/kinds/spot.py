# SPDX-License-Identifier: GPL-3.0-or-later
"""Spot lights: balls that shine within a cone."""

import math

import numpy as np

from .. import slots
from .light import ASIDE, seen_from
from .point import Point, as_ball


class Spot(Point):
    objects = frozenset({"SPOT"})

    def slot(self, light, placed, sign):
        # The shader finds the blend in what the number of the shape is above a whole one.
        shape = slots.Driven(light, "spot_blend", 0.45, slots.BALL)
        radius = slots.Driven(light, "shadow_soft_size", sign)
        return slots.numbers(
            shape, *as_ball(light, *placed), (radius, slots.Driven(light, "spot_size"))
        )

    def irradiance(self, light, matrix, power, points):
        _, along = seen_from(points, matrix)
        inside = np.where(along > math.cos(light.spot_size / 2), 1.0, ASIDE)
        return super().irradiance(light, matrix, power, points) * inside

    def is_even(self, light, matrix):
        # A non-uniformly scaled spot has no circular cone, which shaders can't represent.
        return super().is_even(light, matrix) and not slots.is_stretched(matrix)

    def is_like_new(self, light):
        return False
