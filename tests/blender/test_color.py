# SPDX-License-Identifier: GPL-3.0-or-later
"""Previews through Blender's own OpenColorIO configuration, against what Blender saves."""

import json
import os
import re
import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest
from helpers import open_image_io

CONFIG = Path(bpy.utils.resource_path("LOCAL")) / "datafiles" / "colormanagement" / "config.ocio"
ROOM = Path(__file__).parents[2] / "scenes" / "room-coupled.json"
VERSION = re.search(r"ocio_profile_version: ([\d.]+)", CONFIG.read_text())[1]


def render(folder, view):
    content = json.loads(ROOM.read_text())
    content["settings"] |= {"width": 48, "height": 48, "spp": 4}
    (folder / "room.json").write_text(json.dumps(content))
    command = [os.environ["BRDFC_TOOL"], "render", folder / "room.json", "--view", view]
    command += ["--out", folder / "room.exr", "--preview", folder / "tool.png"]
    return subprocess.run(
        [str(c) for c in command], capture_output=True, text=True, env=os.environ | {"OCIO": CONFIG}
    )


def eight_bits(path):
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return np.round(255 * pixels.reshape(-1, 4)[:, :3])


@pytest.mark.parametrize("view", ["Standard", "Filmic", "AgX"])
def test_view_is_blenders(empty, tmp_path, view):
    """Equal to a step of 8 bits: Blender rounds and dithers in its own way."""
    done = render(tmp_path, view)
    if float(VERSION) > 2.1:  # than the tool's OpenColorIO reads
        assert f"{CONFIG} is of version {VERSION}, later than" in done.stderr
        if view != "Standard":
            assert done.returncode == 2 and "expected one of Standard, Raw" in done.stderr
            return
    assert done.returncode == 0, done.stderr
    # Without the layer of variances, with which Blender takes a file for several pictures.
    oiio = open_image_io()
    mean = oiio.ImageBufAlgo.channels(oiio.ImageBuf(str(tmp_path / "room.exr")), (0, 1, 2))
    assert mean.get_pixels().max() > 1
    assert mean.write(str(tmp_path / "mean.exr"))
    empty.display_settings.display_device = "sRGB"
    empty.view_settings.view_transform = view
    empty.view_settings.look = "None"
    empty.render.image_settings.file_format = "PNG"
    empty.render.image_settings.color_mode = "RGB"
    empty.render.dither_intensity = 0
    image = bpy.data.images.load(str(tmp_path / "mean.exr"))
    image.save_render(str(tmp_path / "blender.png"), scene=empty)
    tool, blender = eight_bits(tmp_path / "tool.png"), eight_bits(tmp_path / "blender.png")
    assert np.ptp(tool) > 100
    assert np.abs(tool - blender).max() <= 1
