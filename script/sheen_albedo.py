#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes blender_addon/nearest/sheen_albedo.py: what Cycles' sheen keeps from what lies below.

Runs in a Python that has `bpy`. Cycles dims emission by 1 minus the albedo of the sheen above it,
which it reads from a table, so a picture without noise shows that albedo: a glowing ball with sheen
in a black world, seen by an orthographic camera, has every view cosine.
"""

import sys
import tempfile
import textwrap
from pathlib import Path

import bpy
import numpy as np

FILE = Path(__file__).parents[1] / "blender_addon" / "nearest" / "sheen_albedo.py"
ROUGHNESSES = np.linspace(0, 1, 21)
COSINES = np.array([0.06, 0.1, 0.15, *np.linspace(0.2, 1, 17)])
#: Pixels across the ball, and rows of them: Blender renders no fewer.
PIXELS, ROWS = 1024, 4


MODULE = '''# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' albedo of sheen by view cosine and roughness. script/sheen_albedo.py made this file with
Blender {version}."""

import numpy as np


def _numbers(text):
    return np.array(text.split(), float)


COSINES = _numbers("""
{cosines}
""")
ROUGHNESSES = _numbers("""
{roughnesses}
""")
#: A row for each roughness.
ALBEDOS = _numbers("""
{albedos}
""").reshape(len(ROUGHNESSES), len(COSINES))
'''


def filled(numbers, form):
    """Numbers as lines of text."""
    return textwrap.fill(" ".join(format(x, form) for x in numbers), 96)


def new_scene():
    """A ball in a black world; returns its Principled node."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.resolution_x, scene.render.resolution_y = PIXELS, ROWS
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=1)
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    bpy.ops.object.camera_add(location=(0, -4, 0), rotation=(np.pi / 2, 0, 0))
    scene.camera = bpy.context.object
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 2.0
    material = bpy.data.materials.new("Sheen")
    material.use_nodes = True
    ball.data.materials.append(material)
    (node,) = (n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    for name, value in (
        ("Base Color", (0, 0, 0, 1)),
        ("IOR", 1),
        ("Emission Color", (1, 1, 1, 1)),
        ("Emission Strength", 1),
        ("Sheen Weight", 1),
    ):
        node.inputs[name].default_value = value
    return node


def albedo(node, roughness):
    """The albedo of the sheen at COSINES."""
    node.inputs["Sheen Roughness"].default_value = roughness
    with tempfile.TemporaryDirectory() as folder:
        path = bpy.context.scene.render.filepath = str(Path(folder) / "ball.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(path)
        row = np.array(image.pixels).reshape(ROWS, PIXELS, 4)[ROWS // 2, :, 0]
        bpy.data.images.remove(image)
    x = (np.arange(PIXELS) + 0.5) / PIXELS * 2 - 1
    cosine = np.sqrt(np.maximum(1 - x * x - (1 / PIXELS) ** 2, 0))
    half = slice(0, PIXELS // 2)
    return 1 - np.interp(COSINES, cosine[half], row[half])


def main():
    node = new_scene()
    rows = [albedo(node, roughness) for roughness in ROUGHNESSES]
    FILE.write_text(
        MODULE.format(
            version=bpy.app.version_string,
            cosines=filled(COSINES, "g"),
            roughnesses=filled(ROUGHNESSES, "g"),
            albedos="\n".join(filled(row, ".4f") for row in rows),
        ),
        encoding="utf-8",
    )
    print(f"{FILE.name}: Blender {bpy.app.version_string}", file=sys.stderr)


main()
