# SPDX-License-Identifier: GPL-3.0-or-later
"""A virtual gonioreflectometer in Cycles.

A grid of small flat facets, one a pixel, each with its own normal, seen by one camera. Facets are
visible to camera rays only, so that each meets the lights as if it were alone. Colour is divided by
coverage. Two set-ups:

- for closures: orthographic camera and a pixel filter so narrow that each pixel has one view
  direction; a sun gives f cos(theta_i), a white world the albedo;
- for forms that draw their own random numbers from position and view: perspective camera and the
  whole facet, because such a form needs positions that differ.

The frame of a facet is that of the shaders: t is the object's z axis (the world's, here) laid into
the facet, x where they are parallel, and b = n x t.
"""

import bpy
import numpy as np
from helpers import add_camera, add_world, render

#: Half the side of a facet, in units of the distance between pixels. Half its diagonal must stay
#: below 1/2, or facets hide each other.
HALF = 0.35
#: Distance of the perspective camera in units of the grid's width: view directions differ by less
#: than 0.6 degrees, evenly about the middle one, and positions still have digits to spare.
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
    """Normals that the camera, looking down the z axis, sees at these cosines."""
    cosines = np.asarray(cosines, np.float64)
    sines = np.sqrt(1 - cosines**2)
    return np.stack([sines * np.cos(azimuths), sines * np.sin(azimuths), cosines], -1)


class Goniometer:
    """`normals` (n, 3): one facet each, as seen by a camera that looks along -z.

    Facets are strewn over the pixels, so that what differs over the picture averages out over
    facets of the same kind. `materials`: one, or several of which `which`, (n,), tells each
    facet's, so that one render measures many. `attributes`: arrays (n,) or (n, 3) that shaders
    can read.
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
        #: Towards the camera from the middle of each facet, in world coordinates.
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
        # The normals that Cycles sees are those of the rounded corners.
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
        """Each facet's own view direction in its frame, (n, 3)."""
        return self.local(self.views)

    def local(self, directions):
        """Directions (n, 3) or (3,) of the world in the frames of the facets, (n, 3)."""
        t, b = frame(self.normals)
        directions = np.broadcast_to(directions, self.normals.shape)
        return np.stack([(directions * a).sum(-1) for a in (t, b, self.normals)], -1)

    def wo(self):
        """The middle view direction in the frames of the facets, (n, 3)."""
        return self.local(np.array([0.0, 0.0, 1.0]))

    def add_sun(self, towards):
        """One sun of angle 0 and irradiance 1 in the direction `towards`."""
        from mathutils import Vector

        data = bpy.data.lights.new("Sun", "SUN")
        data.energy, data.angle = 1.0, 0.0
        sun = bpy.data.objects.new("Sun", data)
        sun.rotation_mode = "QUATERNION"
        sun.rotation_quaternion = Vector(towards).to_track_quat("Z", "Y")
        self.scene.collection.objects.link(sun)
        bpy.context.view_layer.update()
        # What the light really has: its matrix is in single precision.
        return unit(np.array(sun.matrix_world.col[2][:3]))

    def add_world(self):
        """A white world that is found by following the material's own rays; its tree and node."""
        tree, background = add_world(self.scene)
        self.scene.world.cycles.sampling_method = "NONE"
        return tree, background

    def measure(self):
        """Radiance of each facet, (n, 3). `coverage`, (n,), becomes the share of rays that hit."""
        picture = render(self.scene)[self.rows, self.columns]
        self.coverage = picture[:, 3]
        assert (self.coverage > 0).all(), "a facet was missed"
        return picture[:, :3] / self.coverage[:, None]
