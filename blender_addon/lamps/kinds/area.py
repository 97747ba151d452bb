# SPDX-License-Identifier: GPL-3.0-or-later
"""Area lights: rectangles and ellipses that shine on one side, within an angle, their Spread."""

import math

import numpy as np

from .. import slots
from .light import ASIDE, Light, keeps_its_place, seen_from

#: Watts per square metre. Measured under lamps of 100 W and 1 m, 40 W and 2 m, 60 W and 0.5 m: a
#: clamp at 10 takes nothing of matte models, and of cook_torrance, radziszewski_alda and ward 0.1 %
#: in the worst block of 8 x 8 pixels.
_MODERATE = 240


def _is_round(light):
    return light.shape in {"DISK", "ELLIPSE"}


class Area(Light):
    objects = frozenset({"AREA"})

    def sizes(self, light):
        return "size", "size_y" if light.shape in {"RECTANGLE", "ELLIPSE"} else "size"

    def extent(self, light):
        width, height = (getattr(light, side) for side in self.sizes(light))
        return width * height * (math.pi / 4 if _is_round(light) else 1.0)

    def slot(self, light, placed, sign):
        shape = slots.ELLIPSE if _is_round(light) else slots.RECTANGLE
        first, second = self.sizes(light)
        sizes = slots.Driven(light, first, sign), slots.Driven(light, second)
        # What the number of the shape is above a whole one: nothing for a spread of half a turn,
        # and for a spread of 0 less than would round to the next shape.
        most = 0.499
        spread = slots.Driven(light, "spread", -most / math.pi, shape + most)
        return slots.numbers(spread, *placed, sizes)

    def sheet(self, item, light, matrix):
        if self.is_distorted(matrix):
            return None
        axes = np.array([column.normalized() for column in matrix.to_3x3().transposed()])
        centre, stays = np.array(matrix.translation), item is None or keeps_its_place(item)
        return slots.Sheet(centre, axes, self._scaled(light, matrix), stays)

    def _scaled(self, light, matrix):
        """Its two sizes in world space."""
        return tuple(
            getattr(light, side) * abs(scale)
            for side, scale in zip(self.sizes(light), matrix.to_scale(), strict=False)
        )

    def irradiance(self, light, matrix, power, points):
        squared, along = seen_from(points, matrix)
        return power / math.pi / squared * np.maximum(along, ASIDE)

    def angular_size(self, light, matrix):
        radius = math.hypot(*self._scaled(light, matrix)) / 2
        return slots.angular_size_at(matrix.translation, radius)

    def is_sizeless(self, light):
        return False

    def is_moderate(self, light):
        return light.normalize and light.energy <= _MODERATE * self.extent(light)

    def is_distorted(self, matrix):
        return slots.is_sheared(matrix)

    def is_lamp(self, light):
        return not light.cycles.is_portal and super().is_lamp(light)
