# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes by quadrature how highlights must look: the model's f, from the tool, times the cosine
and the lamp's radiance, integrated over the lamp. Also provides a stage whose pictures are compared
with the result.

A lamp is a function send(p, u) of surface points, (n, 1, 3), and numbers in [0, 1), (n, m, 2). It
returns m directions from each point to the lamp, (n, m, 3), and the radiance divided by their pdf,
(n, m).
"""

import math

import bpy
import numpy as np
from goniometer import frame, unit
from helpers import add_camera, add_sphere, evaluate
from mathutils import Vector

#: Side in pixels of a block, and of an item's part of the picture.
BLOCK, SIDE = 8, 32


def sequence(count, dimensions):
    """Evenly distributed points in [0, 1)^d (M. Roberts' additive recurrence)."""
    root = 2.0
    for _ in range(60):
        root = (1 + root) ** (1 / (dimensions + 1))
    return (0.5 + np.outer(np.arange(count), root ** -np.arange(1.0, dimensions + 1))) % 1.0


def disk(u):
    """Uniformly distributed points of the unit disk."""
    radius, angle = np.sqrt(u[..., 0]), 2 * np.pi * u[..., 1]
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)


def across(axis):
    """Two axes perpendicular to directions, (..., 3) each."""
    a = unit(np.cross(np.where(np.abs(axis[..., 2:]) < 0.9, [0.0, 0, 1], [1.0, 0, 0]), axis))
    return a, np.cross(axis, a)


def everywhere(_wi):
    return 1.0


def facing_disk(place, radius, intensity, beam=everywhere):
    """A point or spot light with Soft Falloff: a disk that faces the shaded point."""

    def send(p, u):
        to = place - p
        axis = unit(to)
        a, b = across(axis)
        at = radius * disk(u)
        at = to + at[..., :1] * a + at[..., 1:] * b
        wi = unit(at)
        return wi, intensity * (wi * axis).sum(-1) / (at**2).sum(-1) * beam(wi)

    return send


def sphere(place, radius, intensity, beam=everywhere):
    def send(p, u):
        to = place - p
        axis = unit(to)
        a, b = across(axis)
        drop = 1 - np.sqrt(1 - radius**2 / (to**2).sum(-1))
        z, turn = 1 - u[..., 0] * drop, 2 * np.pi * u[..., 1]
        x, y = (np.sqrt(1 - z**2) * f(turn) for f in (np.cos, np.sin))
        wi = z[..., None] * axis + x[..., None] * a + y[..., None] * b
        return wi, intensity * 2 * drop / radius**2 * np.ones_like(z) * beam(wi)

    return send


def cone_of(light, axis):
    """Falloff of a spot light that points along an axis."""
    edge = math.cos(light.spot_size / 2)

    def beam(wi):
        into = (-(wi @ axis) - edge) / max((1 - edge) * light.spot_blend, 1e-6)
        into = np.clip(into, 0, 1)
        return into**2 * (3 - 2 * into)

    return beam


def sun(towards, angle, irradiance):
    radius = math.tan(angle / 2)

    def send(p, u):
        axis = np.broadcast_to(towards, (len(p), u.shape[1], 3))
        a, b = across(axis)
        at = radius * disk(u)
        wi = unit(axis + at[..., :1] * a + at[..., 1:] * b)
        return wi, irradiance * (wi @ towards) ** 3 / math.cos(angle / 2) ** 2

    return send


def patch(matrix, sizes, intensity, is_round=False, spread=np.pi):
    """An area lamp, which emits along its own -z. `intensity`: straight ahead."""
    axes, place = np.array(matrix.to_3x3()), np.array(matrix.translation)
    x, y = (size / 2 * axes[:, i] for i, size in enumerate(sizes))
    ahead = -unit(axes[:, 2])

    def send(p, u):
        at = disk(u) if is_round else 2 * u - 1
        at = place + at[..., :1] * x + at[..., 1:] * y - p
        wi = unit(at)
        cosine = np.maximum(-(wi @ ahead), 0)
        light = intensity * cosine / (at**2).sum(-1)
        if spread < np.pi:
            # Cycles, kernel/light/area.h.
            most = math.tan(spread / 2)
            tangent = np.sqrt(1 - cosine**2) / np.maximum(cosine, 1e-6)
            light = light * np.maximum(most - tangent, 0) / (most - spread / 2)
        return wi, light

    return send


def of_light(item):
    """The send() function for the object of a Blender light."""
    light, matrix = item.data, item.matrix_world
    place, axis = np.array(matrix.translation), unit(np.array(matrix.col[2].to_3d()))
    energy, radius = light.energy, light.shadow_soft_size if light.type in {"POINT", "SPOT"} else 0
    if light.type == "SUN":
        size = math.pi * math.sin(light.angle / 2) ** 2
        return sun(axis, light.angle, energy * (1.0 if light.normalize else size))
    if light.type == "AREA":
        is_round = light.shape in {"DISK", "ELLIPSE"}
        sizes = light.size, light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size
        own = sizes[0] * sizes[1] * (math.pi / 4 if is_round else 1)
        energy *= 1.0 if light.normalize else own
        return patch(matrix, sizes, energy / math.pi, is_round, light.spread)
    energy *= 1.0 if light.normalize else 4 * math.pi * radius**2
    beam = cone_of(light, -axis) if light.type == "SPOT" else everywhere
    shape = facing_disk if light.use_soft_falloff or radius == 0 else sphere
    return shape(place, radius or 1e-6, energy / (4 * math.pi), beam)


def blocks(picture, mask):
    """Means over a mask's pixels for each block, (..., rows, columns); and the number of these
    pixels."""
    height, width = mask.shape
    shape = height // BLOCK, BLOCK, width // BLOCK, BLOCK
    counts = np.maximum(mask.reshape(shape).sum((1, 3)), 1)
    sums = np.where(mask, picture, 0).reshape(*np.shape(picture)[:-2], *shape).sum((-3, -1))
    return sums / counts, counts


class Stage:
    """Pieces of a floor, or balls, side by side in a picture: a white diffuse one, and one of each
    model. `cases`: [(model, values)].
    """

    def __init__(self, scene, cases, ball=False):
        self.cases, self.ball = [None, *cases], ball
        self.centres = [
            np.array((2.2 * (i - len(cases) / 2), 0, 0)) for i in range(len(self.cases))
        ]
        self.items = [self._add(scene, centre) for centre in self.centres]
        self.eye = np.array((0, -14.0, 0) if ball else (0, -9.0, 7.0))
        turn = Vector(-self.eye).to_track_quat("-Z", "Y").to_euler()
        camera = add_camera(scene, tuple(self.eye), turn)
        camera.sensor_fit = "HORIZONTAL"
        self.turn = np.array(turn.to_matrix())
        self.wide = 2.2 * len(self.cases) / np.linalg.norm(self.eye)
        camera.angle = 2 * math.atan(self.wide / 2)
        self.size = SIDE, SIDE * len(self.cases)
        scene.render.resolution_y, scene.render.resolution_x = self.size
        scene.render.resolution_percentage = 100

    def _add(self, scene, centre):
        if self.ball:
            item = add_sphere(scene, None, segments=128)
        else:
            mesh = bpy.data.meshes.new("Floor")
            corners = [(-1.1, -1.1, 0), (1.1, -1.1, 0), (1.1, 1.1, 0), (-1.1, 1.1, 0)]
            mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
            mesh.materials.append(None)
            item = bpy.data.objects.new("Floor", mesh)
            scene.collection.objects.link(item)
        item.location = centre
        if self.ball:  # so that none shades another
            for ray in ("diffuse", "glossy", "transmission", "shadow"):
                setattr(item, f"visible_{ray}", False)
        return item

    def set_materials(self, materials):
        for item, material in zip(self.items, materials, strict=True):
            item.data.materials[0] = material

    def hits(self, x, y):
        """Where rays through this position in each pixel hit the items: points, normals, and the
        item's index; -1 where they miss."""
        height, width = self.size
        across, up = np.meshgrid(np.arange(width) + x, np.arange(height) + y)
        place = [(across / width - 0.5) * self.wide, (up - height / 2) / width * self.wide]
        d = unit(np.stack([*place, -np.ones(self.size)], -1)) @ self.turn.T
        points, normals = np.zeros_like(d), np.zeros_like(d)
        which = np.full(self.size, -1)
        for i, centre in enumerate(self.centres):
            if self.ball:
                to = self.eye - centre
                along = d @ to
                root = along**2 - (to @ to - 1)
                met = root > 0
                p = self.eye + (-along - np.sqrt(np.maximum(root, 0)))[..., None] * d
                n = p - centre
            else:
                p = self.eye - self.eye[2] / d[..., 2:] * d
                met = (np.abs(p - centre)[..., :2] < 1.1).all(-1)
                n = np.broadcast_to([0.0, 0, 1], d.shape)
            points[met], normals[met], which[met] = p[met], n[met], i
        return points, normals, which

    def whole(self):
        """The item that covers the whole of each pixel, in its part of the picture; -1 if there is
        none."""
        corners = [self.hits(x, y)[2] for x in (0, 1) for y in (0, 1)]
        own = np.broadcast_to(np.arange(self.size[1]) // SIDE, self.size)
        return np.where(np.all([c == own for c in corners], 0), own, -1)

    def expected(self, tool, sends, least, most, seed):
        """Radiance of the models' green channel by block, (rows, columns). NaN in blocks that are
        below `least` times the item's brightest block, and in all but about the `most`
        brightest."""
        whole, rng = self.whole(), np.random.default_rng(seed)
        # A rough estimate, with one point per pixel and lamp, selects these blocks.
        rough = self._radiance(tool, sends, whole, 1, 1, np.random.default_rng(0))
        rough, _ = blocks(rough, whole >= 0)
        by_item = rough.reshape(-1, len(self.cases), SIDE // BLOCK)
        ranked = np.sort(by_item.transpose(1, 0, 2).reshape(len(self.cases), -1))
        dark = np.maximum(least * ranked[:, -1], ranked[:, -most])
        bright = (by_item >= dark[:, None]).reshape(rough.shape)
        chosen = np.where(bright.repeat(BLOCK, 0).repeat(BLOCK, 1), whole, -1)
        picture = self._radiance(tool, sends, chosen, 2, 6, rng)
        return np.where(bright, blocks(picture, whole >= 0)[0], np.nan)

    def _radiance(self, tool, sends, chosen, grid, points, rng):
        picture = np.zeros(self.size)
        places = [((i + 0.5) / grid, (j + 0.5) / grid) for i in range(grid) for j in range(grid)]
        # All points of a block share one sequence of lamp points.
        numbers = sequence(BLOCK**2 * len(places) * points, 2) + rng.uniform(size=2)
        rows, columns = np.indices(self.size) % BLOCK
        for i, case in enumerate(self.cases):
            parts = []
            mask = chosen == i
            for k, place in enumerate(places):
                p, n, _ = (a[mask] for a in self.hits(*place))
                t, b = frame(n)
                axes = np.stack([t, b, n], -2)[:, None]
                first = ((rows * BLOCK + columns)[mask] * len(places) + k) * points
                for send in sends:
                    u = numbers[first[:, None] + np.arange(points)] % 1.0
                    wi, light = send(p[:, None], u)
                    wi = (axes @ wi[..., None])[..., 0]
                    wo = (axes @ unit(self.eye - p)[:, None, :, None])[..., 0]
                    light = light * np.maximum(wi[..., 2], 0) / points / len(places)
                    parts.append((wi, np.broadcast_to(wo, wi.shape), light))
            wi, wo, light = (np.stack(a) for a in zip(*parts, strict=True))
            f = np.zeros(light.shape)
            lit = light > 0
            if lit.any():
                f[lit] = (
                    1 / np.pi if case is None else evaluate(tool, *case, wi[lit], wo[lit])[:, 1]
                )
            picture[mask] = (f * light).sum((0, 2))
        return picture
