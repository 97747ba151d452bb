# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that Cycles computes what script/native_nodes.py assumes of Blender's own nodes: the fits
rely on that."""

import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
from goniometer import Goniometer, tilted, unit

sys.path.append(str(Path(__file__).resolve().parents[2] / "script"))
import native_nodes

GOLD = [0.9, 0.6, 0.2]
CASES = {
    "glossy": ("glossy", {"color": GOLD, "alpha": [0.3, 0.3]}),
    "glossy, stretched": ("glossy", {"color": GOLD, "alpha": [0.1, 0.6]}),
    "glossy, turned": ("glossy", {"color": GOLD, "alpha": [0.6, 0.1], "rotation": 0.5}),
    "metallic": ("metallic", {"color": GOLD, "edge": [0.2, 0.5, 0.9], "alpha": [0.4, 0.4]}),
    "metallic, stretched": (
        "metallic",
        {"color": GOLD, "edge": [0.2, 0.5, 0.9], "alpha": [0.2, 0.5]},
    ),
    "principled": ("principled", {"color": GOLD, "alpha": [0.3, 0.3], "ior": 1.6, "metallic": 0}),
    "principled, half metal": (
        "principled",
        {"color": GOLD, "alpha": [0.5, 0.2], "ior": 1.4, "metallic": 0.5},
    ),
}


@pytest.fixture(scope="module")
def tool(program, tool):
    """The tool, with cached answers."""
    made = native_nodes.Tool(program)
    made.ask = tool
    return made


@pytest.fixture(scope="module")
def fresnel(tool):
    return native_nodes.Fresnel(tool)


def turned(directions, angle):
    """Directions in a frame rotated about the normal."""
    x, y, z = np.asarray(directions).T
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x + s * y, c * y - s * x, z], -1)


def start(extension, kind, p, normals, samples, bounces, **options):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=bounces)
    material, _ = extension.scene_loader.native_material("native", kind, p)
    return Goniometer(scene, material, normals, samples, **options)


@pytest.mark.long
@pytest.mark.parametrize("case", CASES)
def test_node_under_a_sun(extension, tool, fresnel, case):
    kind, p = CASES[case]
    p = {"rotation": 0.0} | p
    rng = np.random.default_rng(2)
    # Views of the fits: only a few, because the node's albedo is measured for each.
    cosines = rng.choice(native_nodes.VIEWS, 200)
    normals = tilted(cosines, rng.uniform(0, 6.28, 200))
    meter = start(extension, kind, p, normals, 4, 0)
    wi = meter.local(meter.add_sun(unit((0.4, -0.3, 0.85))))
    measured, wo = meter.measure(), meter.wo()
    lit = wi[:, 2] > 1e-3
    wi, wo = turned(wi[lit], p["rotation"]), turned(wo[lit], p["rotation"])
    lobe = native_nodes.Lobe(tool, p["alpha"], wi, wo)
    expected = native_nodes.f_cos(fresnel, kind, p, lobe)
    error = np.abs(measured[lit] - expected).sum() / expected.sum()
    print(f"{case}: relative L1 {error:.2g}")
    # Principled takes the fraction of light left to its base from Cycles' own tables.
    assert error < (0.03 if kind == "principled" else 1e-3)


@pytest.mark.parametrize(
    ("kind", "more"),
    [("glossy", {}), ("metallic", {"edge": [0.2, 0.5, 0.9]}), ("principled", {"ior": 1.6})],
)
def test_mirror_in_a_furnace(extension, fresnel, kind, more):
    p = {"color": GOLD, "alpha": [0.0, 0.0], "rotation": 0.0, "metallic": 0.0} | more
    cosines = np.repeat((1.0, 0.5, 0.15), 16)
    meter = start(extension, kind, p, tilted(cosines, 0.5), 1024, 1)
    meter.add_world()
    measured = meter.measure().reshape(3, 16, 3).mean(1)
    expected = native_nodes.mirror(fresnel, kind, p, cosines[::16])
    if kind == "principled":
        expected = expected + np.array(GOLD) * (1 - expected)
    assert measured == pytest.approx(expected, abs=0.01)
