# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's types of lights have in common."""

from abc import ABC, abstractmethod
from functools import partial

import numpy as np

from ...trees import animation
from .. import emission, slots
from .kind import Kind

#: Rank factor of lamps that do not shine on the subject: low, but above 0.
ASIDE = 0.01
#: Sizes are stored in single precision.
_SLACK = 1e-6


def has_importance(light):
    """Whether Multiple Importance is on: without it Cycles hides a light from random rays."""
    return light.cycles.use_multiple_importance_sampling


def keeps_its_place(item):
    """Whether nothing moves or resizes a light while the extension does not run, on a farm: neither
    animation nor constraints of the object or its parents."""
    if emission.animated(item.data):
        return False
    while item is not None:
        if emission.animated(item) or len(item.constraints):
            return False
        item = item.parent
    return True


def seen_from(points, matrix):
    """Squared distance of points, (n, 3), from a light at the position in `matrix`, and the cosine
    between its axis and the direction to them; (n,) each."""
    place, axis = np.array(matrix.translation), -np.array(matrix.col[2].to_3d().normalized())
    to = points - place
    squared = np.maximum((to**2).sum(-1), 1e-6)
    return squared, to @ axis / np.sqrt(squared)


class Light(Kind, ABC):
    """A type of Blender's lights. `light` is the data of an object of that type."""

    #: Below this size, in metres or for a sun in radians, random rays hit it too rarely.
    least_size = 0.01
    #: Up to this size an ideal mirror shows it as a dot. A new light in Blender is larger (0.1):
    #: with its 4,096 samples, blocks of 8 x 8 pixels differ by less than 1 %.
    dot_in_mirror = 0.05

    # ---- what each type answers ------------------------------------------------------------------

    @abstractmethod
    def sizes(self, light):
        """Names of the properties that make up its size."""

    @abstractmethod
    def extent(self, light):
        """Its area, or solid angle if it is distant: what Cycles multiplies its power by if it is
        not normalized. 0 if it has no size."""

    @abstractmethod
    def slot(self, light, placed, sign):
        """The twelve numbers of its slot. `placed`: the result of slots.placed(); `sign`: factor of
        its first size."""

    @abstractmethod
    def irradiance(self, light, matrix, power, points):
        """Irradiance at points, (n, 3), that face it; see docs/cycles.md for units of power."""

    @abstractmethod
    def angular_size(self, light, matrix):
        """A function of points, (n, 3): the tangent of its angular radius seen from there."""

    def sheet(self, item, light, matrix):
        """The slots.Sheet of a flat light, otherwise None. `item`: its object; None for an
        instance."""
        return None

    def is_sizeless(self, light):
        """Whether random rays can't hit it."""
        return self.smallest(light) == 0

    def is_lamp(self, light):
        """Whether it emits light, or takes it by a negative power."""
        return self.power(light) > 0

    def is_even(self, light, matrix):
        """Whether it emits uniformly, as far as shaders can represent it."""
        return emission.is_even(light)

    def is_wide(self, light):
        """Whether it is a noisy highlight without Multiple Importance, because its light is that of
        one closure, with f towards one random point of the light."""
        return False

    def is_distorted(self, matrix):
        """Whether a transform makes another shape of it than Cycles' light sampling assumes."""
        return False

    def is_like_new(self, light):
        """Whether it is of the type of a new light in Blender, no brighter and no smaller."""
        return False

    def is_moderate(self, light):
        """Whether a clamp of indirect light at 10 takes no light of it from materials without a
        mirror."""
        return False

    # ---- what follows from that ------------------------------------------------------------------

    def power(self, light):
        """Power of a light times its colour, see emission.of_light()."""
        return emission.of_light(light, 1.0 if light.normalize else self.extent(light) or 1.0)

    def smallest(self, light):
        """The smallest of its sizes."""
        return min(getattr(light, name) for name in self.sizes(light))

    def is_tiny(self, light):
        """Whether random rays hit it too rarely."""
        return self.smallest(light) < self.least_size * (1 - _SLACK)

    def is_dot_in_mirror(self, light):
        """Whether an ideal mirror shows it as a dot. Lights without a size do not appear there."""
        return 0 < self.smallest(light) <= self.dot_in_mirror * (1 + _SLACK)

    def shines(self, item):
        """Whether an object of this type is a lamp that is visible in renders."""
        return (not item.hide_render or emission.animated(item)) and self.is_lamp(item.data)

    def of_object(self, item, search):
        if not self.shines(item):
            return None
        matrix = search.matrix(item).copy()
        search.survey.transforms[item.name_full] = slots.transform_kind(matrix)
        return self._candidate(item, item.name, item.data, matrix)

    def of_copy(self, instance, search):
        light = instance.object.data
        if not self.is_lamp(light):
            return None
        matrix = instance.matrix_world.copy()
        return self._candidate(None, search.name_of(instance), light.original, matrix)

    def _candidate(self, item, name, light, matrix):
        """A light at the position in `matrix`. If `item` is its object, drivers follow it; None for
        an instance."""
        # A negative sign tells the shaders that random rays do not hit the lamp, or not behind
        # other objects, so that the lobe must carry all of its light.
        sign = 1.0 if has_importance(light) and light.use_shadow else -1.0
        sizeless = self.is_sizeless(light)
        hidden = item is not None and item.hide_render
        power = emission.DARK if hidden else self.power(light)
        values = self.slot(light, slots.placed(item, matrix), sign)
        if item is not None and animation.animates(item, "hide_render"):
            values = slots.while_rendered(values, item)
        return slots.Candidate(
            name,
            values,
            partial(self.irradiance, light, matrix, power),
            self.angular_size(light, matrix),
            sizeless=sizeless,
            met=has_importance(light) and not sizeless,
            uneven=not self.is_even(light, matrix),
            distorted=self.is_distorted(matrix),
            sheet=self.sheet(item, light, matrix),
        )

    def may_shine(self, item, emitting):
        return True

    def is_changed(self, update, survey, crowded):
        item = update.id
        if update.is_updated_geometry or not update.is_updated_transform:
            return True
        # Drivers follow transforms, unless their kind changes; a new ranking needs a survey.
        known = survey.transforms.get(item.original.name_full)
        changed = slots.transform_kind(item.matrix_world) != known
        among_sheets = item.original.name in survey.sheets
        return changed or (known is not None and known[1]) or crowded or among_sheets
