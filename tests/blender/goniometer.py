# SPDX-License-Identifier: GPL-3.0-or-later
"""A virtual gonioreflectometer in Cycles.

One camera sees a grid of small flat facets, one per pixel, each with its own normal. Facets are
visible to camera rays only, so they don't shade one another. Colours are divided by coverage. There
are two set-ups:

- for closures: an orthographic camera and a pixel filter so narrow that all facets have the same
  view direction; a sun gives f cos(theta_i), a white world the albedo;
- for forms that derive random numbers from position and view: a perspective camera and the whole
  facet, because such a form needs different positions.

The frame of a facet is that of the shaders: t is the object's z axis (here the world's) projected
onto the facet, or x where they are parallel, and b = n x t.
"""

import bpy
import numpy as np
from helpers import add_camera, add_world, render

#: Half the side of a facet, relative to the distance between pixels. Half its diagonal must stay
#: below 1/2, or facets would hide each other.
HALF = 0.35
#: Distance of the perspective camera, relative to the grid's width: view directions differ by less
#: than 0.6 degrees, symmetrically, and positions are still sufficiently precise.
DISTANCE = 100.0


def unit(v):
    v = np.asarray(v, np.float64)
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def frame(normal):
    """(t, b), each of the shape of the normals."""
    axis = np.broadcast_to([0.0, 0.0, 1.0], normal.shape)
    t = axis - normal * (normal * axis).sum(-1, keepdims=True)
    parallel = (t * t).sum(-1) < 1e-8
    x = np.broadcast_to([1.0, 0.0, 0.0], normal.shape)
    t = np.where(parallel[..., None], x - normal * (normal * x).sum(-1, keepdims=True), t)
    t = unit(t)
    return t, np.cross(normal, t)


def tilted(cosines, azimuths):
    """Normals that the camera, which looks down the z axis, sees at these cosines."""
    cosines = np.asarray(cosines, np.float64)
    sines = np.sqrt(1 - cosines**2)
    return np.stack([sines * np.cos(azimuths), sines * np.sin(azimuths), cosines], -1)


class Goniometer:
    """`normals` (n, 3): of the facets, in the frame of a camera that looks along -z.

    Facets are distributed randomly over the pixels, so that variations over the picture average out
    for facets of the same kind. `materials`: one, or several, of which `which`, (n,), selects one
    for each facet, so that one render measures many. `attributes`: arrays (n,) or (n, 3) that
    shaders can read.
    """

    def __init__(
        self, scene, materials, normals, samples, perspective=False, which=None, attributes=None
    ):
        normals = unit(normals)
        materials = materials if isinstance(materials, list) else [materials]
        self.count, self.scene = len(normals), scene
        self.side = int(np.ceil(np.sqrt(self.count)))
        grid = np.random.default_rng(0).permutation(self.count)
        centre = (self.side - 1) / 2
        self.columns, self.rows = grid % self.side, grid // self.side
        positions = np.stack(
            [self.columns - centre, self.rows - centre, np.zeros(self.count)], -1
        ).astype(np.float64)
        height = DISTANCE * self.side
        eye = np.array([0.0, 0.0, height]) - positions
        #: Direction from the centre of each facet to the camera, in world space.
        self.views = unit(eye) if perspective else np.broadcast_to([0.0, 0.0, 1.0], eye.shape)
        self._build(materials, positions, normals, which)
        for name, values in (attributes or {}).items():
            self._add_attribute(name, np.asarray(values, np.float32))
        self._camera(perspective, height)
        self._settings(samples, perspective)

    def _build(self, materials, positions, normals, which):
        t, b = frame(normals)
        signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
        corners = [positions + HALF * (i * t + j * b) for i, j in signs]
        vertices = np.stack(corners, 1).astype(np.float32)
        # Cycles computes normals from the rounded corners.
        exact = vertices.astype(np.float64)
        self.normals = unit(np.cross(exact[:, 2] - exact[:, 0], exact[:, 3] - exact[:, 1]))
        mesh = bpy.data.meshes.new("facets")
        faces = np.arange(4 * self.count).reshape(-1, 4)
        mesh.from_pydata(vertices.reshape(-1, 3).tolist(), [], faces.tolist())
        for material in materials:
            mesh.materials.append(material)
        if which is not None:
            mesh.polygons.foreach_set("material_index", np.ascontiguousarray(which, np.int32))
            mesh.update()
        self.mesh = mesh
        facets = bpy.data.objects.new("facets", mesh)
        for ray in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
            setattr(facets, f"visible_{ray}", False)
        self.scene.collection.objects.link(facets)

    def _add_attribute(self, name, values):
        kind, field = ("FLOAT", "value") if values.ndim == 1 else ("FLOAT_VECTOR", "vector")
        attribute = self.mesh.attributes.new(name, kind, "FACE")
        attribute.data.foreach_set(field, np.ascontiguousarray(values).ravel())

    def _camera(self, perspective, height):
        camera = add_camera(
            self.scene, (0, 0, height), (0, 0, 0), None if perspective else self.side
        )
        camera.clip_start, camera.clip_end = 0.01, 10 * height
        if perspective:
            camera.sensor_fit = "VERTICAL"
            camera.angle = 2 * np.arctan(0.5 / DISTANCE)

    def _settings(self, samples, perspective):
        scene = self.scene
        render_, cycles = scene.render, scene.cycles
        render_.resolution_x = render_.resolution_y = self.side
        render_.resolution_percentage = 100
        render_.film_transparent = True
        cycles.samples = samples
        cycles.pixel_filter_type = "BOX" if perspective else "BLACKMAN_HARRIS"
        if not perspective:
            cycles.filter_width = 0.01

    def own_wo(self):
        """Each facet's exact view direction in its frame, (n, 3)."""
        return self.local(self.views)

    def local(self, directions):
        """Transforms directions (n, 3) or (3,) from world space to the facets' frames, (n, 3)."""
        t, b = frame(self.normals)
        directions = np.broadcast_to(directions, self.normals.shape)
        return np.stack([(directions * a).sum(-1) for a in (t, b, self.normals)], -1)

    def wo(self):
        """The mean view direction in the facets' frames, (n, 3)."""
        return self.local(np.array([0.0, 0.0, 1.0]))

    def add_sun(self, towards):
        """Adds a sun of angle 0 and irradiance 1 in the direction `towards`."""
        from mathutils import Vector

        data = bpy.data.lights.new("Sun", "SUN")
        data.energy, data.angle = 1.0, 0.0
        sun = bpy.data.objects.new("Sun", data)
        sun.rotation_mode = "QUATERNION"
        sun.rotation_quaternion = Vector(towards).to_track_quat("Z", "Y")
        self.scene.collection.objects.link(sun)
        bpy.context.view_layer.update()
        # The actual direction of the light: its matrix is in single precision.
        return unit(np.array(sun.matrix_world.col[2][:3]))

    def add_world(self):
        """Adds a white world that only BSDF sampling finds. Returns its tree and node."""
        tree, background = add_world(self.scene)
        self.scene.world.cycles.sampling_method = "NONE"
        return tree, background

    def measure(self):
        """Radiance of each facet, (n, 3). Sets `coverage`, (n,), to the fraction of rays that hit
        it."""
        picture = render(self.scene)[self.rows, self.columns]
        self.coverage = picture[:, 3]
        assert (self.coverage > 0).all(), "a facet was missed"
        return picture[:, :3] / self.coverage[:, None]
