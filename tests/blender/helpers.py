# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes and pictures for the tests."""

import csv
import io
import json
import os
import tempfile
import zipfile
from pathlib import Path

import bpy
import numpy as np


def with_every_model(form, *cases):
    """Cases (model, values), and the default values of each model with the form that has no case.

    So a new model is measured without a word in the tests. `form` None: any form.
    """
    path = os.environ.get("BRDFC_EXTENSION_ZIP", "")
    if not Path(path).is_file():
        return list(cases)  # the fixtures say what is missing
    with zipfile.ZipFile(path) as archive:
        models = json.loads(archive.read("manifest.json"))["models"]
    have_form = [m for m, e in models.items() if form is None or form in e["representations"]]
    covered = {model for model, _ in cases}
    present = [case for case in cases if case[0] in have_form]
    return present + [(model, {}) for model in have_form if model not in covered]


def render(scene):
    """Renders the scene; (height, width, 4) float64, row 0 at the bottom."""
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode = "OPEN_EXR", "RGBA"
    settings.color_depth, settings.exr_codec = "32", "NONE"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True, scene=scene.name)
        return read_picture(path)


def read_picture(path):
    """Pixels of an EXR as they are in the file; (height, width, 4), row 0 at the bottom."""
    image = bpy.data.images.load(str(path))
    try:
        image.colorspace_settings.name = "Non-Color"
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(image.size[1], image.size[0], 4).astype(np.float64)
    finally:
        bpy.data.images.remove(image)


def add_world(scene, strength=1.0):
    """A white world; returns its node tree and the Background node."""
    world = bpy.data.worlds.new("World")
    scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    background.inputs["Strength"].default_value = strength
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    return tree, background


def add_camera(scene, location=(0, -6, 0), rotation=(np.pi / 2, 0, 0), orthographic=None):
    data = bpy.data.cameras.new("Camera")
    if orthographic:
        data.type, data.ortho_scale = "ORTHO", orthographic
    scene.camera = bpy.data.objects.new("Camera", data)
    scene.camera.location, scene.camera.rotation_euler = location, rotation
    scene.collection.objects.link(scene.camera)
    return data


def add_sphere(scene, material, segments=32):
    import bmesh

    mesh = bpy.data.meshes.new("Sphere")
    build = bmesh.new()
    bmesh.ops.create_uvsphere(build, u_segments=segments, v_segments=segments // 2, radius=1)
    build.to_mesh(mesh)
    build.free()
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    mesh.materials.append(material)
    ball = bpy.data.objects.new("Sphere", mesh)
    scene.collection.objects.link(ball)
    return ball


def sphere_scene(scene, material, size=16, samples=16):
    """A sphere in a white world that fills most of a small picture."""
    add_sphere(scene, material)
    add_camera(scene)
    add_world(scene)
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.cycles.samples = samples


def read_csv(text):
    """Columns of a CSV with a header line: (names, array of shape (rows, columns))."""
    names = next(csv.reader(io.StringIO(text)))
    return names, np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1, ndmin=2)


def to_csv(names, rows):
    lines = [",".join(names)]
    lines += [",".join(f"{x:.17g}" for x in row) for row in rows]
    return "\n".join(lines) + "\n"


def arguments(values):
    """Parameters as the tool takes them."""
    return [
        f"{name}={','.join(map(str, v)) if isinstance(v, tuple | list) else v}"
        for name, v in values.items()
    ]


def evaluate(tool, model, values, wi, wo):
    """f of the model, (n, 3), for directions of shape (n, 3) in the local frame."""
    header = ("wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z")
    text = tool("eval", model, *arguments(values), stdin=to_csv(header, np.hstack([wi, wo])))
    return read_csv(text)[1][:, :3]


def albedo(tool, model, values, cosines, phi=0.0):
    """Directional albedo of the model by quadrature, (n, 3)."""
    stdin = to_csv(("cos_theta_o",), np.reshape(cosines, (-1, 1)))
    text = tool("albedo", model, *arguments(values), "--phi", repr(float(phi)), stdin=stdin)
    return read_csv(text)[1][:, 1:4]
