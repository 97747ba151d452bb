# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects that emit as lamps: each as the ball around it, where it looks like one."""

import math
from types import SimpleNamespace

import numpy as np
from mathutils import Vector

from ..i18n import say
from . import slots

#: A lobe covers the whole ball around a mesh, and within it the model and what is seen of the lamp
#: are averaged apart. So a mesh must fill its ball, as a cube does, or look small; a wide one is
#: met by drawn directions anyway. Angular radii in radians.
_FILLS_BALL, _LOOKS_SMALL, _LOOKS_WIDE = 0.5, 0.03, 0.3
#: Types of objects that have faces.
TYPES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}


def _points(item, materials, depsgraph):
    """Points of an object's faces of some materials, in its own space."""
    own = item.evaluated_get(depsgraph) if depsgraph is not None else item
    mesh = own.data
    if item.type != "MESH" or len(mesh.vertices) == 0 or len(mesh.vertices) > 200000:
        return np.array(own.bound_box)
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3)
    lit_slots = [s.material in materials for s in item.material_slots]
    if all(lit_slots):
        return points
    index = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", index)
    totals = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", totals)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    lit = np.array(lit_slots)[np.clip(index, 0, len(lit_slots) - 1)]
    return points[np.unique(corners[np.repeat(lit, totals)])]


def candidate_of(item, materials, matrix, depsgraph):
    """An object that emits, as a ball; None where none of its faces does."""
    points = _points(item, materials, depsgraph)
    if len(points) == 0:
        return None
    low, high = points.min(0), points.max(0)
    centre = Vector((low + high) / 2)
    radius = float(np.sqrt(((points - np.array(centre)) ** 2).sum(-1).max()))
    # Every point lies within the radius times the largest scale of the centre.
    scales = [abs(s) for s in matrix.to_scale()]
    largest = max(range(3), key=lambda i: scales[i])
    place, size = matrix @ centre, radius * scales[largest]
    if centre.length > 1e-4 * radius or slots.is_sheared(matrix):
        values = slots.numbers(slots.BALL, tuple(place), sizes=(size, 0.0))
    else:
        where = tuple(slots.Driven(item, f"LOC_{axis}") for axis in "XYZ")
        values = slots.numbers(
            slots.BALL, where, sizes=(slots.Driven(item, f"SCALE_{'XYZ'[largest]}", radius), 0.0)
        )
    radiance = sum(materials[m] for m in {s.material for s in item.material_slots} & set(materials))
    middle = np.array(place)

    def irradiance(points):
        squared = ((points - middle) ** 2).sum(-1)
        return radiance * math.pi * size**2 / np.maximum(squared, max(size**2, 1e-12))

    candidate = slots.Candidate(item.name, values, irradiance)
    extent = min((high - low) * np.array(scales)) / 2
    candidate.ball = SimpleNamespace(
        place=middle, radius=size, fills=size > 0 and extent >= _FILLS_BALL * size
    )
    return candidate


def judge(candidate, points):
    """Leaves a mesh out that is no ball from where the subject is."""
    ball = candidate.ball
    if ball is None:
        return
    distance = np.sqrt(((points - ball.place) ** 2).sum(-1)).min()
    angle = ball.radius / max(distance, 1e-9)
    if angle > _LOOKS_WIDE:
        candidate.why = slots.NO_NEED
    elif angle > _LOOKS_SMALL and not ball.fills:
        candidate.why = say("a mesh that is neither round nor small")
