# SPDX-License-Identifier: GPL-3.0-or-later
"""The model `thin_film` beside the film of Blender's Metallic node from 5.0 on: the same paper,
with other sensitivities and a truncated series."""

import bpy
import numpy as np
import pytest
from helpers import add_camera, add_sphere, add_world, node_material, render

TITANIUM = {"n": (2.74, 2.51, 2.24), "k": (3.84, 3.4, 3.01)}
IRON = {"n": (2.92, 2.92, 2.55), "k": (3.08, 2.94, 2.75)}
CLEAR = {"n": (1.5, 1.5, 1.5), "k": (0.0, 0.0, 0.0)}
FILMS = [
    (TITANIUM, 2.4, 50.0),
    (TITANIUM, 2.4, 145.0),
    (TITANIUM, 1.5, 300.0),
    (IRON, 2.6, 48.0),
    (IRON, 1.5, 700.0),
    (CLEAR, 2.2, 340.0),
]
ALPHA = 0.04


def of_blender(base, ior, thickness):
    material = node_material("ShaderNodeBsdfMetallic")
    (node,) = (n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfMetallic")
    node.fresnel_type, node.distribution = "PHYSICAL_CONDUCTOR", "GGX"
    node.inputs["IOR"].default_value, node.inputs["Extinction"].default_value = base.values()
    node.inputs["Roughness"].default_value = ALPHA**0.5
    node.inputs["Thin Film Thickness"].default_value = thickness
    node.inputs["Thin Film IOR"].default_value = ior
    return material


def ours(extension, base, ior, thickness):
    values = {f"{x}_{c}": v for x, vs in base.items() for c, v in zip("rgb", vs, strict=True)}
    return extension.api.new_material(
        "thin_film", thickness=thickness, film_ior=ior, ax=ALPHA, ay=ALPHA, **values
    )


@pytest.mark.slow
@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="before, no metal has a film in Blender")
def test_it_is_near_blenders_own(extension, empty, tmp_path):
    """The colours of balls in a white world. Blender's channels have Gaussians of their own, fitted
    under a constant illuminant, and differ from the model's by up to 0.02."""
    empty.render.engine, empty.cycles.shading_system = "CYCLES", False
    extension.scene_loader.apply_clean_settings(empty, samples=64, max_bounces=0)
    add_world(empty, 1.0)
    add_camera(empty, orthographic=2.0 * len(FILMS))
    empty.render.resolution_x, empty.render.resolution_y = 48 * len(FILMS), 48
    shown = []
    for make in (of_blender, lambda *film: ours(extension, *film)):
        for item in [o for o in empty.objects if o.type == "MESH"]:
            bpy.data.objects.remove(item)
        for i, film in enumerate(FILMS):
            add_sphere(empty, make(*film)).location.x = 2.0 * i - len(FILMS) + 1
        bpy.context.view_layer.update()
        shown.append(render(empty)[..., :3])
    y, x = np.mgrid[:48, :48] + 0.5 - 24
    inside = np.hypot(x, y) < 20  # about 56 degrees from the middle
    for i, (_, ior, thickness) in enumerate(FILMS):
        native, model = (s[:, 48 * i : 48 * (i + 1)][inside] for s in shown)
        off = np.abs(native - model).mean(0)
        print(ior, thickness, native.mean(0).round(3), model.mean(0).round(3), off.round(3))
        assert off.max() < 0.03
