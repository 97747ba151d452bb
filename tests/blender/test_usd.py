# SPDX-License-Identifier: GPL-3.0-or-later
"""Export to USD, by Blender's exporter."""

import os
import re
import subprocess
import sys
from importlib import import_module

import bpy
import helpers
import numpy as np
import pytest

SINCE_5 = bpy.app.version >= (5, 0, 0)

#: Matte, a rough metal, matte under a smooth coat, glass, and one whose curve no node has; and the
#: fraction of a ball's light that the imported material may misplace.
MODELS = {
    "lambert": ({}, 1e-3),
    "microfacet": ({"f0": (0.9, 0.6, 0.3), "ax": 0.09, "ay": 0.09}, 0.04),
    "coupled": ({"rm": (0.1, 0.3, 0.6)}, 0.03),
    "fresnel_dielectric": ({"ior": 1.45}, 0.05),
    "oren_nayar": ({}, 0.03),
    "rough_glass": ({"alpha": 0.2}, 0.1),
}


@pytest.fixture
def exporter(extension, monkeypatch):
    """Blender's exporter with the extension's hook, which was not registered without pxr."""
    if not SINCE_5:
        pytest.skip("no hook: it makes processes of the module bpy hang at their exit")
    monkeypatch.setattr(sys, "path", [*sys.path])
    bpy.utils.expose_bundled_modules()
    usd = import_module(f"{extension.package}.usd")
    usd.unregister()
    usd.register()
    yield
    usd.unregister()


def _export(path):
    bpy.ops.wm.usd_export(filepath=str(path), export_lights=False, export_cameras=False)
    return path.read_text()


def _import(path):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(path))


def _surface(text, material):
    """The inputs of the shader that a file of text connects to a material; None without one."""
    path = rf"<[^>]*/{material}/(\w+)\.outputs:surface>"
    connected = re.search(rf"token outputs:surface\.connect = {path}", text)
    if connected is None:
        return None
    within = text.split(f'def Material "{material}"')[1]
    shader = re.search(rf'def Shader "{connected[1]}"\s*{{(.*?)}}', within, re.S)[1]
    assert 'info:id = "UsdPreviewSurface"' in shader
    # Of the inputs that are not linked.
    found = re.findall(r"inputs:(\w+) = (.+)", shader)
    return {name: np.array(value.strip("()").split(","), float) for name, value in found}


def _balls(extension, scene, osl):
    scene.cycles.shading_system = osl
    for place, (name, (values, _)) in enumerate(MODELS.items()):
        material = extension.api.new_material(name, **values)
        material.name = name
        helpers.add_sphere(scene, material).location.x = 2.5 * place


@pytest.mark.parametrize("osl", [False, True], ids=["nodes", "osl"])
def test_materials_are_written_as_the_nearest_principled_nodes(
    extension, empty, exporter, tmp_path, osl
):
    """They used to be written without a shader."""
    _balls(extension, empty, osl)
    text = _export(tmp_path / "balls.usda")
    for name in MODELS:
        near = extension.api.nearest_principled(bpy.data.materials[name])
        found = _surface(text, name)
        assert found["diffuseColor"] == pytest.approx(near["base_color"], abs=1e-6), name
        for key in ("metallic", "roughness", "ior"):
            assert found[key] == pytest.approx(near[key], abs=1e-6), name
        assert found["opacity"] == 1 - near["transmission"], name
    # By hand.
    assert _surface(text, "lambert")["diffuseColor"] == pytest.approx((0.8, 0.8, 0.8), abs=0.01)
    assert _surface(text, "microfacet")["metallic"] > 0.9
    assert _surface(text, "microfacet")["roughness"] == pytest.approx(0.3, abs=0.02)
    assert _surface(text, "fresnel_dielectric")["opacity"] == 0


def _light(scene):
    """By ball: its pixels, in blocks of 4 x 4."""
    count = len(MODELS)
    helpers.add_camera(scene, (1.25 * (count - 1), -6, 0), orthographic=2.5 * count)
    helpers.add_world(scene, 0.3)
    helpers.add_lamp(scene, "SUN", turn=(0.7, 0.3, 0), energy=2, angle=0.5)
    scene.render.engine, scene.cycles.samples = "CYCLES", 64
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = count * 24, 24
    blocks = helpers.render(scene)[..., :3].reshape(6, 4, 6 * count, 4, 3).mean((1, 3))
    return np.split(blocks, count, 1)


def test_imported_materials_reflect_nearly_the_same_light(extension, empty, exporter, tmp_path):
    _balls(extension, empty, True)
    _export(tmp_path / "balls.usda")
    before = _light(empty)
    _import(tmp_path / "balls.usda")
    after = _light(bpy.context.scene)
    for (name, (_, least)), a, b in zip(MODELS.items(), before, after, strict=True):
        misplaced = np.abs(a - b).sum() / a.sum()
        print(f"{name}: {misplaced:.4f}")
        assert misplaced <= least, name


def test_other_materials_are_exported_as_ever(extension, empty, exporter, tmp_path):
    helpers.add_balls_of_other_shaders(empty, extension.api)
    text = _export(tmp_path / "balls.usda")
    for name in ("plain", "coated"):
        assert _surface(text, name)["roughness"] == 0.25
    assert "NearestPrincipled" not in text


def test_a_sum_of_models_is_written_as_one_node(extension, empty, exporter, tmp_path):
    """It used to be written without a shader."""
    material = extension.api.new_sum(
        [("lambert", {"rho": rho}) for rho in ((0.4, 0.1, 0.1), (0.1, 0.1, 0.4))]
    )
    material.name = "sum"
    helpers.add_sphere(empty, material, segments=8)
    found = _surface(_export(tmp_path / "ball.usda"), "sum")["diffuseColor"]
    assert found == pytest.approx((0.5, 0.2, 0.5), abs=0.01)


def test_a_black_material_arrives_black(extension, empty, exporter, tmp_path):
    black = extension.api.new_material("lambert", rho=0)
    black.name = "black"
    helpers.add_sphere(empty, black, segments=8)
    found = _surface(_export(tmp_path / "ball.usda"), "black")
    assert not found["diffuseColor"].any() and found["metallic"] == 0
    _import(tmp_path / "ball.usda")
    assert _light(bpy.context.scene)[0][2:4, 2:4].max() < 1e-3


def test_of_two_nodes_the_file_has_the_one_that_is_shown(extension, convert, exporter, tmp_path):
    """The exporter takes any Principled node, linked or not. The one that conversion leaves in a
    material has its textures."""
    scene, api = bpy.context.scene, extension.api
    unused = api.new_material("lambert", rho=(0.2, 0.4, 0.6))
    unused.name = "unused"
    unused.node_tree.nodes.new("ShaderNodeBsdfPrincipled")
    for name in ("turned", "painted"):
        material = helpers.node_material("ShaderNodeBsdfPrincipled", Roughness=0.5, Metallic=1.0)
        material.name = name
        tree = material.node_tree
        if name == "painted":
            texture = tree.nodes.new("ShaderNodeTexImage")
            texture.image = bpy.data.images.new("painted", 8, 8)
            principled = tree.nodes["Principled BSDF"]
            tree.links.new(texture.outputs["Color"], principled.inputs["Base Color"])
        assert api.convert_materials(api.plan_conversion([material], limit=1)) == 1
        (node,) = extension.model_nodes.group_nodes(material)
        extension.model_nodes.set_value(node, "ax", 0.09)
        extension.model_nodes.set_value(node, "ay", 0.09)
    for material in bpy.data.materials:
        helpers.add_sphere(scene, material, segments=8)
    text = _export(tmp_path / "balls.usda")
    assert _surface(text, "unused")["diffuseColor"] == pytest.approx((0.2, 0.4, 0.6), abs=0.01)
    assert _surface(text, "turned")["roughness"] == pytest.approx(0.3, abs=0.01)
    painted = _surface(text, "painted")
    assert painted["roughness"] == 0.5 and "diffuseColor" not in painted
    assert "inputs:diffuseColor.connect" in text


_IN_A_PROCESS = """
import sys
import bpy
extension, file, exposed = sys.argv[1:]
if exposed == "True":
    bpy.utils.expose_bundled_modules()
bpy.ops.preferences.addon_enable(module="bl_pkg")
bpy.ops.extensions.package_install_files(
    filepath=extension, repo="user_default", enable_on_install=True
)
from bl_ext.user_default.brdfc_shaders import api
bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
bpy.ops.mesh.primitive_plane_add()
bpy.context.object.data.materials.append(api.new_material("lambert"))
bpy.ops.wm.usd_export(filepath=file)
"""


@pytest.mark.slow
@pytest.mark.parametrize("exposed", [False, True], ids=["hidden", "exposed"])
def test_a_process_that_exported_ends(extension_zip, tmp_path, exposed):
    """With a hook, Blender aborts where it does not find pxr, and the module bpy of 4.5 hangs."""
    path = tmp_path / "plane.usda"
    done = subprocess.run(
        [sys.executable, "-c", _IN_A_PROCESS, extension_zip, path, str(exposed)],
        env=os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "user")},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert ("NearestPrincipled" in path.read_text()) == (exposed and SINCE_5)
