# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares whole pictures with the reference renderer, for every model in every form, by Welch's
t-test.

In one scene, each sphere has its own material. Several renders with different seeds give the noise
of every pixel. If a test fails, its pictures stay in pytest's temporary folder.
"""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
DRIVER, SCENES = ROOT / "script" / "render_scene.py", ROOT / "scenes"
#: Number of pictures for each form; approximate diameter of a sphere in pixels; spheres per row.
SEEDS, SIZE, COLUMNS = 8, 24, 8


def write_sky(path, width=64):
    """A smooth sky in which direction and colour vary, without dark or bright spots."""
    phi, theta = np.meshgrid(
        2 * np.pi * (np.arange(width) + 0.5) / width,
        np.pi * (np.arange(width // 2) + 0.5) / width * 2,
    )
    x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    colour = [0.6 + 0.3 * x + 0.2 * z, 0.5 + 0.3 * y * z, 0.5 - 0.3 * z + 0.15 * x * y]
    pixels = np.stack([*colour, np.ones_like(x)], -1).astype(np.float32)
    image = bpy.data.images.new("sky", width, width // 2, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.filepath_raw, image.file_format = str(path), "OPEN_EXR"
    image.save()


def scene(materials, max_bounces, spp):
    """Spheres side by side, seen from far away."""
    rows = math.ceil(len(materials) / COLUMNS)
    columns = min(COLUMNS, len(materials))
    objects = [
        {
            "name": name,
            "shape": {"type": "sphere", "segments": 96},
            "transform": {
                "translate": [
                    2.2 * (i % COLUMNS - (columns - 1) / 2),
                    0,
                    2.2 * ((rows - 1) / 2 - i // COLUMNS),
                ]
            },
            "material": name,
        }
        for i, name in enumerate(materials)
    ]
    return {
        "name": "spheres",
        "description": "A sphere a form",
        "settings": {
            "width": SIZE * columns,
            "height": SIZE * rows,
            "spp": spp,
            "seed": 7,
            "max_bounces": max_bounces,
        },
        "camera": {
            "type": "orthographic",
            "position": [0, -20, 0],
            "look_at": [0, 0, 0],
            "up": [0, 0, 1],
            "height": 2.2 * rows,
        },
        "materials": materials,
        "objects": objects,
    }


def render_both(folder, extension_zip, tool, content, spp):
    """Renders pictures with SEEDS seeds in Blender, and the reference; returns their paths, the
    reference last."""
    source = folder / "source.json"
    source.write_text(json.dumps(content))
    tool("scene", source, "--out", folder)
    tool("render", folder / "scene.json", "--out", folder / "reference.exr")
    jobs = [
        {
            "scene": str(folder / "scene.json"),
            "out": str(folder / f"{s}.exr"),
            "seed": s,
            "spp": spp,
            "timed": False,
        }
        for s in range(1, SEEDS + 1)
    ]
    (folder / "jobs.json").write_text(json.dumps(jobs))
    command = [sys.executable, DRIVER, "--extension", extension_zip, "--jobs", folder / "jobs.json"]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ)
    assert done.returncode == 0, done.stderr
    return [Path(job["out"]) for job in jobs] + [folder / "reference.exr"]


@pytest.fixture
def judge(tmp_path):
    """Runs compare --test on pictures and the reference; returns its JSON. Further arguments are
    passed on."""

    def run(pictures, *arguments):
        command = [os.environ["BRDFC_TOOL"], "compare", *pictures, "--test", "--json"]
        command += ["--keep", tmp_path / "failed", *arguments]
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
        assert done.returncode in (0, 1), done.stderr
        found = json.loads(done.stdout)
        assert found["test"]["passed"] == (done.returncode == 0)
        return found

    return run


@pytest.mark.long
@pytest.mark.full
@pytest.mark.parametrize(
    "name",
    ["small-lamp", *(pytest.param(n, marks=pytest.mark.evidence) for n in ("ra-back", "lamps"))],
)
def test_small_lamps_against_the_reference(extension_zip, tool, tmp_path, judge, name):
    """Scenes in which random rays alone prove nothing, because they show little but dots."""
    content = json.loads((SCENES / f"{name}.json").read_text())
    settings = content["settings"]
    settings |= {"width": 128, "height": round(128 * settings["height"] / settings["width"])}
    settings |= {"spp": 768}
    found = judge(render_both(tmp_path, extension_zip, tool, content, spp=32))
    print(f"{name}: {json.dumps(found['test'])}")
    assert found["test"]["passed"], f"see {tmp_path}"


@pytest.mark.evidence
@pytest.mark.full
def test_every_form_against_the_reference(extension, extension_zip, tool, tmp_path, judge):
    # Forms that equal their model; the errors of the others are tested by test_fitted.py and
    # test_twin.py.
    materials = {
        f"{model}_{form}": {"model": model, "representation": form}
        for model in extension.pack.model_names()
        for form in extension.pack.model(model).forms
        if form not in ("fitted", "twin")
    }
    # Only smooth light: if a form hits a lamp once in a thousand samples, the variance of a few
    # pictures, on which the test relies, underestimates its noise.
    write_sky(tmp_path / "sky.exr")
    content = scene(materials, max_bounces=2, spp=1024) | {"environment": {"image": "sky.exr"}}
    pictures = render_both(tmp_path, extension_zip, tool, content, spp=64)
    found = judge(pictures)
    test = found["test"]
    print(f"{len(materials)} forms: {json.dumps(test)}")
    assert test["passed"], f"see {tmp_path}: spheres are {', '.join(materials)}, row by row"


@pytest.mark.long
@pytest.mark.slow
def test_a_bias_of_one_percent_or_one_in_a_thousand_is_found(
    extension, extension_zip, tool, tmp_path, judge
):
    """The power of the test: it accepts the pictures as rendered, and rejects brightened ones."""
    materials = {"lambert": {"model": "lambert", "representation": "exact"}}
    # With 0 bounces the test also detects a sky that is lost behind the lamp, which is a
    # transparent bounce to Cycles.
    content = scene(materials, max_bounces=0, spp=8192)
    content["camera"]["height"] = 1.2  # nothing but the sphere
    content["environment"] = {"color": [0.5, 0.6, 0.7]}
    content["lights"] = [
        {
            "type": "area",
            "position": [0, -6, 12],
            "direction": [0, 0.45, -0.9],
            "size": [16, 10],
            "power": 300,
        }
    ]
    pictures = render_both(tmp_path, extension_zip, tool, content, spp=1024)
    assert judge(pictures)["test"]["passed"]
    pixels = judge(pictures, "--inject", 0.01)["test"]
    assert pixels["accepted"] < 0.9975
    tiles = judge(pictures, "--inject", 0.001)["test"]
    assert tiles["rejected_tiles"] > 0
    assert tiles["uniform_p"] < 0.01
