# SPDX-License-Identifier: GPL-3.0-or-later
"""What a resolved scene file holds, and the meshes, camera and lamps that Blender makes of it."""

import math
from pathlib import Path

import bpy
import json_view
import numpy as np
from mathutils import Euler, Matrix, Vector


class View(json_view.View):
    """A value of a scene file."""

    def numbers(self, count):
        if not isinstance(self.value, list) or len(self.value) != count:
            raise self.error(f"{count} numbers")
        return [v.number() for _, v in self.items()]

    def vector(self):
        return Vector(self.numbers(3))

    def number_or(self, key, default):
        return self.get(key).number() if self.has(key) else default

    def flag(self, key):
        if not self.has(key):
            return False
        view = self.get(key)
        if not isinstance(view.value, bool):
            raise view.error("true or false")
        return view.value

    def color_or(self, key, default):
        if not self.has(key):
            return default
        view = self.get(key)
        return view.numbers(3) if isinstance(view.value, list) else [view.number()] * 3

    def file_path(self):
        path = Path(self.file).parent / self.text()
        if not path.is_file():
            raise ValueError(f"{self.file}: {self.path}: file {path} does not exist")
        return path


def array(view, columns):
    path = view.file_path()
    try:
        data = np.load(path, allow_pickle=False)
    except ValueError as error:
        raise ValueError(f"{view.file}: {view.path}: {path}: {error}") from error
    if data.ndim != 2 or data.shape[1] != columns or not np.isfinite(data).all():
        raise ValueError(
            f"{view.file}: {view.path}: {path}: expected finite numbers of shape (n, {columns}), "
            f"got {data.shape}"
        )
    return data


def build_mesh(name, vertices, triangles, normals=None, uvs=None):
    """Mesh datablock from arrays: (n, 3) float, (m, 3) int, and per vertex (n, 3) and (n, 2).

    Normals are stored in single precision, unchanged. Without them the triangles are flat.
    """
    triangles = np.ascontiguousarray(triangles, np.int32)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.full(len(triangles), normals is not None))
    if uvs is not None:
        layer = mesh.uv_layers.new(name="UVMap")
        layer.uv.foreach_set("vector", np.ascontiguousarray(uvs, np.float32)[triangles].ravel())
    mesh.update(calc_edges=True)
    if normals is not None:
        # Blender's other way to store custom normals would round them to 16 bits.
        attribute = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
        attribute.data.foreach_set("vector", np.ascontiguousarray(normals, np.float32).ravel())
        mesh.update()
    return mesh


def mesh_arrays(shape):
    """The arguments of build_mesh(), from the files that a shape names."""
    if shape.get("type").text() != "mesh" or not shape.has("vertices"):
        raise shape.error("a mesh of arrays; resolve the scene first")
    vertices = array(shape.get("vertices"), 3)
    triangles = array(shape.get("triangles"), 3)
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise shape.get("triangles").error(f"indices from 0 to {len(vertices) - 1}")
    extra = {
        key: array(shape.get(key), columns) if shape.has(key) else None
        for key, columns in (("normals", 3), ("uvs", 2))
    }
    for key, rows in extra.items():
        if rows is not None and len(rows) != len(vertices):
            raise shape.get(key).error(f"{len(vertices)} rows, one a vertex")
    return {"vertices": vertices, "triangles": triangles, **extra}


def transform(view):
    if not view.has("transform"):
        return Matrix.Identity(4)
    view = view.get("transform")
    translate = view.get("translate").vector() if view.has("translate") else Vector()
    degrees = view.get("rotate_degrees").numbers(3) if view.has("rotate_degrees") else [0] * 3
    scale = view.color_or("scale", [1.0] * 3)  # a single number, or three
    rotation = Euler([math.radians(d) for d in degrees], "XYZ").to_matrix().to_4x4()
    return Matrix.Translation(translate) @ rotation @ Matrix.Diagonal((*scale, 1.0))


def link(scene, name, data, matrix):
    item = bpy.data.objects.new(name, data)
    item.matrix_world = matrix
    scene.collection.objects.link(item)
    return item


def _aimed(position, direction, up=None):
    """Matrix of an object that looks along its own -z."""
    back = -direction.normalized()
    up = up if up is not None else Vector((0, 0, 1))
    if back.cross(up).length < 1e-6 * up.length:
        up = Vector((0, 1, 0)) if abs(back.y) < 0.9 else Vector((1, 0, 0))
    right = up.cross(back).normalized()
    matrix = Matrix((right, back.cross(right), back)).transposed().to_4x4()
    matrix.translation = position
    return matrix


def camera(scene, view):
    data = bpy.data.cameras.new("Camera")
    data.sensor_fit = "VERTICAL"
    kind = view.get("type").text()
    if kind == "perspective":
        data.type, data.angle = "PERSP", math.radians(view.get("fov_y_degrees").number())
    elif kind == "orthographic":
        data.type, data.ortho_scale = "ORTHO", view.get("height").number()
    else:
        raise view.get("type").error("perspective or orthographic")
    position = view.get("position").vector()
    direction = view.get("look_at").vector() - position
    if direction.length == 0:
        raise view.get("look_at").error("another point than the camera's position")
    # In effect no clipping: the reference renderer has none.
    data.clip_start, data.clip_end = 1e-4, 1e6
    up = view.get("up").vector() if view.has("up") else None
    scene.camera = link(scene, "Camera", data, _aimed(position, direction, up))


def light(scene, index, view):
    kind = view.get("type").text()
    types = {"point": "POINT", "sun": "SUN", "area": "AREA", "disk": "AREA"}
    if kind not in types:
        raise view.get("type").error(f"one of {', '.join(types)}")
    data = bpy.data.lights.new(f"{kind}{index}", types[kind])
    data.use_shadow = True
    data.color = view.color_or("color", [1.0] * 3)
    position, direction = Vector(), Vector((0, 0, -1))
    if kind != "sun":
        position = view.get("position").vector()
        data.energy = view.get("power").number()
    if kind != "point":
        direction = view.get("direction").vector()
    if kind == "point":
        data.shadow_soft_size = view.number_or("radius", 0.0)
        data.use_soft_falloff = False  # a spherical light; Blender would soften it
    elif kind == "sun":
        data.energy = view.get("irradiance").number()
        data.angle = math.radians(view.number_or("angle_degrees", 0.0))
    else:
        size = view.get("size")
        sizes = size.numbers(2) if isinstance(size.value, list) else [size.number()] * 2
        data.shape = "RECTANGLE" if kind == "area" else "ELLIPSE"  # sizes are diameters
        data.size, data.size_y = sizes
    up = view.get("up").vector() if view.has("up") else None
    lamp = link(scene, f"{kind}{index}", data, _aimed(position, direction, up))
    lamp.visible_camera = view.flag("camera_visible")
