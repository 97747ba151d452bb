# SPDX-License-Identifier: GPL-3.0-or-later
"""Emissive objects as lamps: flat ones as a rectangle or an ellipse; others as their bounding ball,
if they resemble one."""

import math
from dataclasses import dataclass

import numpy as np
from mathutils import Matrix, Vector, geometry

from ...common.i18n import say
from .. import emission, slots
from .kind import Kind

#: A lobe covers the whole bounding ball of a mesh, and averages the model and the visible part of
#: the lamp separately. So a mesh must fill its ball well, as a cube does, or look small; a mesh
#: that looks large must be a ball; and wide ones are left to random rays. Angular radii in radians.
_FILLS_BALL, _IS_BALL = 0.5, 0.95
#: The scale of a ball that stands for a mesh (generator/forms/node_cones.h).
_NO_LAMP = 0.0, 0.0, 1.0
_LOOKS_SMALL, _LOOKS_LARGE, _LOOKS_WIDE = 0.03, 0.3, 0.4
#: The same for rectangles and ellipses: the fraction of its bounding rectangle that a flat mesh
#: must fill, and its maximum thickness relative to the shorter side.
_FILLS_RECTANGLE, _FILLS_ELLIPSE, _THICK = 0.95, 0.7, 0.1
#: Types of objects that have faces.
FACED = frozenset({"MESH", "CURVE", "SURFACE", "META", "FONT"})


def _evaluated(item, depsgraph):
    """The object whose data has the faces; in Edit Mode that is not Blender's evaluated object."""
    return item.evaluated_get(depsgraph) if depsgraph is not None and item.mode != "EDIT" else item


def _own_materials(item):
    """Materials of the faces of an evaluated object or of an instance from geometry nodes, by
    index."""
    found = [s.material for s in item.material_slots]
    if item.type == "MESH" and len(item.data.materials) > len(found):
        found = list(item.data.materials)
    return [m.original if m is not None else None for m in found]


def _materials_of(item, depsgraph):
    """Materials of an object's faces by index, including those that geometry nodes assign."""
    if item.type == "MESH" and any(m.type == "NODES" for m in item.modifiers):
        found = _evaluated(item, depsgraph).data.materials
        return [m.original if m is not None else None for m in found]
    return [s.material for s in item.material_slots]


@dataclass(frozen=True)
class _Shape:
    """The emissive part of an object."""

    points: np.ndarray  # (n, 3), in object space
    triangles: np.ndarray  # (m, 3), of these points; empty if not a mesh, or too large a one
    radiance: float
    uneven: bool

    def ball(self):
        """Centre and radius of a bounding ball."""
        low, high = self.points.min(0), self.points.max(0)
        middle = (low + high) / 2
        return middle, float(np.sqrt(((self.points - middle) ** 2).sum(-1).max()))


def _shape(own, materials, emitting):
    """The _Shape of an evaluated object, given the materials of its faces; None if it does not emit
    or has no points. `emitting`: radiance by material."""
    glowing = set(materials) & set(emitting)
    if not glowing:
        return None
    points, triangles = _lit(own, materials, emitting)
    if len(points) == 0:
        return None
    radiance = sum(emitting[m] for m in glowing)
    uneven = len(glowing) > 1 or not all(emission.is_even(m) for m in glowing)
    return _Shape(points, triangles, radiance, uneven)


def _lit(own, materials, emitting):
    """Points and triangles of an object's emissive faces; see _Shape."""
    mesh = own.data
    none = np.empty((0, 3), np.int32)
    if own.type != "MESH" or len(mesh.vertices) == 0 or len(mesh.vertices) > 200000:
        return np.array(own.bound_box), none
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3)
    mesh.calc_loop_triangles()
    triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    triangles = triangles.reshape(-1, 3)
    lit_slots = np.array([m in emitting for m in materials])
    if lit_slots.all():
        return points, triangles
    index = np.empty(len(triangles), np.int32)
    mesh.loop_triangles.foreach_get("material_index", index)
    triangles = triangles[lit_slots[np.clip(index, 0, len(lit_slots) - 1)]]
    kept, triangles = np.unique(triangles, return_inverse=True)
    return points[kept], triangles.reshape(-1, 3)


def _flat(points, areas):
    """A flat mesh as a lamp: its kind, centre, axes as rows (the normal last), and two sizes; None
    if it is not flat, or neither a rectangle nor an ellipse. In world space; `areas`: see
    _areas()."""
    if len(areas) == 0:
        return None
    across = areas[(areas**2).sum(-1).argmax()]
    size = np.linalg.norm(across)
    if not size > 0:
        return None
    across = across / size
    # Front and back of a thin box are counted separately.
    area = max(np.maximum(side * areas @ across, 0).sum() for side in (1, -1))
    frame = np.array(Vector(across).to_track_quat("Z", "Y").to_matrix()).T
    flat = (points - points[0]) @ frame.T
    if np.ptp(flat[:, 2]) > _THICK * np.ptp(flat[:, :2], 0).max():
        return None
    flat = _outermost(flat[:, :2])
    turns = {
        slots.RECTANGLE: geometry.box_fit_2d([Vector(p) for p in flat]),
        slots.ELLIPSE: -_main_axis(flat),
    }
    for kind, turn in turns.items():
        turned = np.array(Matrix.Rotation(turn, 3, "Z")) @ frame
        places = (points - points[0]) @ turned.T
        low, high = places.min(0), places.max(0)
        middle, (width, height, thickness) = (low + high) / 2, high - low
        if not thickness <= _THICK * min(width, height):
            continue
        filled = area / (width * height)
        if kind == slots.ELLIPSE:
            # No corner may lie outside the ellipse.
            away = ((places - middle)[:, :2] / ((high - low)[:2] / 2)) ** 2
            fits = filled >= _FILLS_ELLIPSE and away.sum(-1).max() < 1.05
        else:
            fits = _FILLS_RECTANGLE <= filled <= 2 - _FILLS_RECTANGLE
        if fits:
            return kind, points[0] + middle @ turned, turned, (width, height)
    return None


def _areas(points, triangles):
    """Normals of triangles, whose lengths are the triangles' areas."""
    edges = points[triangles[:, 1:]] - points[triangles[:, :1]]
    return np.cross(edges[:, 0], edges[:, 1]) / 2


def _outermost(places):
    """Removes most interior points from (n, 2): keeps the outermost one in each of many
    directions."""
    if len(places) <= 200:
        return places
    angles = np.arange(360) * np.pi / 180
    reach = places @ np.array([np.cos(angles), np.sin(angles)])
    return places[np.unique(reach.argmax(0))]


def _main_axis(places):
    """Angle of the axis along which points, (n, 2), have their largest extent."""
    covariance = np.cov(places.T)
    return math.atan2(2 * covariance[0, 1], covariance[0, 0] - covariance[1, 1]) / 2


#: Number of instances that are examined one by one; the brightest are chosen.
_COPIES = 4 * slots.SLOTS


class Mesh(Kind):
    objects = FACED

    def of_object(self, item, search):
        materials = _materials_of(item, search.depsgraph) if search.emitting else []
        if not any(m in search.emitting for m in materials):
            return None
        shape = _shape(_evaluated(item, search.depsgraph), materials, search.emitting)
        if shape is None:
            return None
        search.survey.glowing.add(item.name_full)
        return _candidate(item, item.name, shape, search.matrix(item).copy())

    def of_copy(self, instance, search):
        """Its light at the subject, name, shape and matrix."""
        if not search.emitting:
            return None
        item, shapes = instance.object, search.shared
        key = item.data.as_pointer() if item.data is not None else 0
        if key not in shapes:
            shapes[key] = _shape(item, _own_materials(item), search.emitting)
        if shapes[key] is None:
            return None
        search.survey.glowing.add(item.original.name_full)
        matrix = instance.matrix_world.copy()
        middle, radius = shapes[key].ball()
        away = np.array(matrix @ Vector(middle)) - search.survey.subject
        size = radius * max(abs(s) for s in matrix.to_scale())
        squared = np.maximum((away**2).sum(-1), max(size**2, 1e-12))
        light = float(np.mean(shapes[key].radiance * math.pi * size**2 / squared))
        return light, search.name_of(instance), shapes[key], matrix

    def of_copies(self, found):
        """If there are many, one each for the brightest and a single one for all others."""
        found = sorted(found, key=lambda copy: -copy[0])
        for _, name, shape, matrix in found[:_COPIES]:
            yield _candidate(None, name, shape, matrix)
        if others := found[_COPIES:]:
            name = others[0][1]
            if others[1:]:
                name = say("{lamps} and {count} more", lamps=name, count=len(others) - 1)
            all_light = sum(copy[0] for copy in others)
            nothing = slots.angular_size_distant(0.0)
            yield slots.Candidate(
                name,
                None,
                lambda points: np.full(len(points), all_light),
                nothing,
                why=slots.too_many(slots.SLOTS),
            )

    def may_shine(self, item, emitting):
        return emission.is_painted(item, emitting)

    def is_changed(self, update, survey, crowded):
        item = update.id
        return item.original.name_full in survey.glowing or (
            update.is_updated_geometry
            and any(
                s.material and survey.emission.get(s.material.name_full, 0.0) > 0
                for s in item.material_slots
            )
        )


def _candidate(item, name, shape, matrix):
    """An emissive shape at the position in `matrix`. If `item` is its object, drivers follow it;
    None for an instance."""
    points, radiance, uneven = shape.points, shape.radiance, shape.uneven
    world = points @ np.array(matrix.to_3x3()).T + np.array(matrix.translation)
    areas = _areas(world, shape.triangles)
    if flat := _flat(world, areas):
        candidate = _sheet(name, radiance, *flat)
        candidate.uneven = uneven
        return candidate
    low, high = points.min(0), points.max(0)
    centre = Vector((low + high) / 2)
    radius = float(np.sqrt(((points - np.array(centre)) ** 2).sum(-1).max()))
    # Every point lies within the radius times the largest scale around the centre.
    scales = [abs(s) for s in matrix.to_scale()]
    largest = max(range(3), key=lambda i: scales[i])
    place, size = matrix @ centre, radius * scales[largest]
    if item is None or centre.length > 1e-4 * radius or slots.is_sheared(matrix):
        values = slots.numbers(slots.BALL, tuple(place), scale=_NO_LAMP, sizes=(size, 0.0))
    else:
        where = tuple(slots.Driven(item, f"LOC_{axis}") for axis in "XYZ")
        values = slots.numbers(
            slots.BALL,
            where,
            scale=_NO_LAMP,
            sizes=(slots.Driven(item, f"SCALE_{'XYZ'[largest]}", radius), 0.0),
        )
    middle = np.array(place)

    def irradiance(points):
        squared = ((points - middle) ** 2).sum(-1)
        return radiance * math.pi * size**2 / np.maximum(squared, max(size**2, 1e-12))

    angular_size = slots.angular_size_at(middle, size)
    candidate = slots.Candidate(name, values, irradiance, angular_size, uneven=uneven)
    extent = min((high - low) * np.array(scales)) / 2
    surface = np.linalg.norm(areas, axis=1).sum()
    if np.linalg.norm(areas.sum(0)) > 0.05 * surface:
        extent = 0.0  # an open surface: only part of a ball

    def judge(points):
        distance = np.sqrt(((points - middle) ** 2).sum(-1)).min()
        angle, fills = size / max(distance, 1e-9), extent / max(size, 1e-12)
        # A convex body's silhouette has a quarter of its surface, on average over its turns.
        wide = math.pi * (_LOOKS_LARGE / 2 * distance) ** 2
        met_often = len(areas) == 0 or surface / 4 > wide
        if angle > (_LOOKS_WIDE if fills >= _IS_BALL else _LOOKS_LARGE) and met_often:
            candidate.why = slots.NO_NEED
        elif angle > _LOOKS_SMALL and fills < _FILLS_BALL:
            candidate.why = say("a mesh that is neither flat, round nor small")

    candidate.judge = judge
    return candidate


def _sheet(name, radiance, kind, middle, frame, sizes):
    """A flat mesh, which emits on both sides, as a lamp that emits towards the subject."""
    area = sizes[0] * sizes[1] * (1 if kind == slots.RECTANGLE else math.pi / 4)

    def irradiance(points):
        to = points - middle
        squared = np.maximum((to**2).sum(-1), max(area / math.pi, 1e-12))
        return radiance * area * np.abs(to @ frame[2]) / squared**1.5

    angular_size = slots.angular_size_at(middle, math.hypot(*sizes) / 2)
    candidate = slots.Candidate(name, (), irradiance, angular_size)

    def judge(points):
        # Lamps emit along their own -z.
        z = -frame[2] * (1 if ((points - middle) @ frame[2]).mean() > 0 else -1)
        axes = Matrix((frame[0], np.cross(z, frame[0]), z)).transposed()
        turn = axes.to_quaternion()
        candidate.values = slots.numbers(
            kind, tuple(middle), (turn.x, turn.y, turn.z), (1, 1, turn.w), sizes
        )
        rows = np.array(axes.transposed())
        candidate.sheet = slots.Sheet(middle, rows, tuple(sizes), stays=True)

    candidate.judge = judge
    return candidate
