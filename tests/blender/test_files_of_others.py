# SPDX-License-Identifier: GPL-3.0-or-later
"""Files from other sources: how Cycles treats non-finite and negative values in images, as the tool
assumes; and the scene loader under OpenColorIO configurations of studios."""

import json
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
from helpers import add_camera, open_image_io, render_passes

DRIVER = Path(__file__).parents[2] / "script" / "render_scene.py"


def write(path, pixels):
    oiio = open_image_io()
    height, width, channels = pixels.shape
    buffer = oiio.ImageBuf(oiio.ImageSpec(width, height, channels, oiio.FLOAT))
    buffer.set_pixels(oiio.ROI(), np.ascontiguousarray(pixels, np.float32))
    assert buffer.write(str(path))


def test_what_is_not_finite_is_black_and_what_is_negative_stays(empty, tmp_path):
    """From 5.2 on the whole pixel is black, as in the tool; before, its other channels stay in some
    cases."""
    pixels = np.full((4, 4, 3), 0.5)
    pixels[0, 1, 0], pixels[1, 2], pixels[2, 0, 1] = np.nan, np.inf, -np.inf
    pixels[3, 3], pixels[3, 0, 2] = -2, -6e-8
    write(tmp_path / "a.exr", pixels)
    image = bpy.data.images.load(str(tmp_path / "a.exr"))
    image.colorspace_settings.is_data = True
    mesh = bpy.data.meshes.new("plane")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new()
    for corner, uv in zip(layer.data, [(0, 0), (1, 0), (1, 1), (0, 1)], strict=True):
        corner.uv = uv
    material = bpy.data.materials.new("m")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    picture = tree.nodes.new("ShaderNodeTexImage")
    picture.image, picture.interpolation = image, "Closest"
    emission = tree.nodes.new("ShaderNodeEmission")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(picture.outputs[0], emission.inputs[0])
    tree.links.new(emission.outputs[0], output.inputs[0])
    mesh.materials.append(material)
    empty.collection.objects.link(bpy.data.objects.new("plane", mesh))
    add_camera(empty, (0, 0, 5), (0, 0, 0), orthographic=2)
    empty.render.resolution_x = empty.render.resolution_y = 4
    empty.cycles.samples, empty.cycles.use_denoising = 1, False
    empty.cycles.pixel_filter_type = "BOX"
    seen = render_passes(empty)["Combined"][::-1, :, :3]
    bad = ~np.isfinite(pixels)
    of_pixel = np.broadcast_to(bad.any(-1, keepdims=True), bad.shape)
    assert (seen[of_pixel if bpy.app.version >= (5, 2) else bad] == 0).all()
    kept = ~of_pixel & (pixels != -6e-8)
    np.testing.assert_allclose(seen[kept], pixels[kept], atol=1e-6)


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize(
    "config",
    ["cg-config-v1.0.0_aces-v1.3_ocio-v2.1", "studio-config-v2.2.0_aces-v1.3_ocio-v2.4"],
)
def test_scenes_load_under_configurations_of_aces(extension_zip, tmp_path, config):
    """Numbers of the working space are passed on unchanged; a preview uses the display's default
    view."""
    sky = np.full((4, 8, 3), [0.2, 0.6, 0.1])
    write(tmp_path / "sky.exr", sky)
    content = {
        "name": "sky",
        "settings": {"width": 4, "height": 4, "spp": 1, "max_bounces": 1},
        "camera": {
            "type": "perspective",
            "position": [0, -4, 0],
            "look_at": [0, 0, 0],
            "fov_y_degrees": 25,
        },
        "materials": {},
        "objects": [],
        "lights": [],
        "environment": {"image": "sky.exr", "strength": 1},
    }
    # The configuration's own working space, and another one, which Blender can select from 5.0 on.
    own, other = "ACEScg", "Linear Rec.2020"
    (tmp_path / "s.json").write_text(json.dumps(content), encoding="utf-8")
    for space in (own, other):
        named = content | {"working_space": space, "environment": {"color": [0.2, 0.6, 0.1]}}
        (tmp_path / f"{space}.json").write_text(json.dumps(named), encoding="utf-8")

    def drive(*pairs):
        """Renders scenes, (file, picture), in one Blender."""
        jobs = [
            {"scene": str(tmp_path / source), "out": str(tmp_path / out), "timed": False}
            for source, out in pairs
        ]
        (tmp_path / "jobs.json").write_text(json.dumps(jobs), encoding="utf-8")
        return subprocess.run(
            [sys.executable, DRIVER, "--extension", extension_zip]
            + ["--jobs", tmp_path / "jobs.json"],
            capture_output=True,
            text=True,
            env=os.environ | {"OCIO": f"ocio://{config}"},
        )

    def assert_unchanged(out):
        found = open_image_io().ImageBuf(str(tmp_path / out)).get_pixels()[..., :3]
        np.testing.assert_allclose(found, np.broadcast_to([0.2, 0.6, 0.1], found.shape), rtol=1e-4)

    done = drive(("s.json", "a.exr"), ("s.json", "a.png"), (f"{own}.json", "own.exr"))
    assert done.returncode == 0, done.stderr[-2000:]
    assert (tmp_path / "a.png").is_file()
    assert_unchanged("a.exr")
    assert_unchanged("own.exr")
    done = drive((f"{other}.json", "other.exr"))
    if hasattr(bpy.data, "colorspace"):
        assert done.returncode == 0, done.stderr[-2000:]
        assert_unchanged("other.exr")
    else:
        assert done.returncode == 2
        assert "expected 'ACEScg', the working space of Blender" in done.stderr
