# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights as lamps: those of a scene, and instances that other objects place."""

import math

import numpy as np

from . import emission, slots

#: Rank factor of lamps that do not shine on the subject: low, but above 0.
_ASIDE = 0.01


def is_lamp(light):
    """Whether a light emits light, or takes it by a negative power."""
    return not (light.type == "AREA" and light.cycles.is_portal) and emission.of_light(light) > 0


def shines(item):
    """Whether an object is a lamp that is visible in renders."""
    return (
        item.type == "LIGHT"
        and (not item.hide_render or emission.animated(item))
        and is_lamp(item.data)
    )


def is_sizeless(light):
    """Whether random rays can't hit a light."""
    if light.type == "SUN":
        return light.angle == 0
    return light.type in {"POINT", "SPOT"} and light.shadow_soft_size == 0


def has_importance(light):
    """Whether Multiple Importance is on: without it Cycles hides a light from random rays."""
    return light.cycles.use_multiple_importance_sampling


def _values(light, item, matrix):
    place, turn, scale = slots.placed(item, matrix)
    # A negative sign tells the shaders that random rays do not hit the lamp, or not behind other
    # objects, so that the lobe must carry all of its light.
    sign = 1.0 if has_importance(light) and light.use_shadow else -1.0
    if light.type == "SUN":
        angle = slots.Driven(light, "angle", sign)
        return slots.numbers(slots.SUN, place, turn, scale, (angle, 0.0))
    if light.type in {"POINT", "SPOT"}:
        kind, cone = slots.BALL, 0.0
        if light.type == "SPOT":
            kind = slots.Driven(light, "spot_blend", 0.45, slots.BALL)
            cone = slots.Driven(light, "spot_size")
        radius = slots.Driven(light, "shadow_soft_size", sign)
        return slots.numbers(kind, place, turn, scale, (radius, cone))
    round_ = light.shape in {"DISK", "ELLIPSE"}
    first, second = emission.sides(light)
    sizes = slots.Driven(light, first, sign), slots.Driven(light, second)
    kind = slots.ELLIPSE if round_ else slots.RECTANGLE
    spread = slots.Driven(light, "spread", -0.5 / math.pi, kind + 0.5)
    return slots.numbers(spread, place, turn, scale, sizes)


def _irradiance(light, matrix):
    """Irradiance of a lamp at points that face it; see docs/cycles.md for units of power."""
    power = emission.of_light(light)
    if light.type == "SUN":
        return lambda points: np.full(len(points), power)
    place, axis = np.array(matrix.translation), -np.array(matrix.col[2].to_3d().normalized())

    def irradiance(points):
        to = points - place
        squared = np.maximum((to**2).sum(-1), 1e-6)
        along = to @ axis / np.sqrt(squared)
        if light.type == "AREA":
            return power / math.pi / squared * np.maximum(along, _ASIDE)
        inside = 1.0
        if light.type == "SPOT":
            inside = np.where(along > math.cos(light.spot_size / 2), 1.0, _ASIDE)
        return power / (4 * math.pi) / squared * inside

    return irradiance


def _looks(light, matrix):
    if light.type == "SUN":
        return slots.angular_size_distant(light.angle)
    if light.type != "AREA":
        return slots.angular_size_at(matrix.translation, light.shadow_soft_size)
    scaled = (
        getattr(light, side) * scale
        for side, scale in zip(emission.sides(light), matrix.to_scale(), strict=False)
    )
    return slots.angular_size_at(matrix.translation, math.hypot(*scaled) / 2)


def candidate_of(item, name, light, matrix):
    """A light at the position in `matrix`. If `item` is its object, drivers follow it; None for an
    instance."""
    values = _values(light, item, matrix)
    return slots.Candidate(
        name,
        values,
        _irradiance(light, matrix),
        _looks(light, matrix),
        sizeless=is_sizeless(light),
        met=has_importance(light) and not is_sizeless(light),
        # A non-uniformly scaled spot has no circular cone, which shaders can't represent.
        uneven=not emission.is_even(light) or (light.type == "SPOT" and slots.is_stretched(matrix)),
    )


def instances(depsgraph):
    """A candidate for each light that an object instances."""
    for instance in depsgraph.object_instances:
        item = instance.object
        if not instance.is_instance or item.type != "LIGHT" or item.hide_render:
            continue
        parent = instance.parent
        if parent is None or parent.original.hide_render or not is_lamp(item.data):
            continue
        light, matrix = item.data.original, instance.matrix_world.copy()
        yield candidate_of(None, f"{parent.name}/{item.name}", light, matrix)
