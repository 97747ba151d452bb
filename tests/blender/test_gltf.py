# SPDX-License-Identifier: GPL-3.0-or-later
"""Export to glTF, by the exporter that comes with Blender."""

import bpy
import helpers
import pytest

#: Matte, a rough metal, matte under a smooth coat, glass, and one whose curve no node has.
MODELS = {
    "lambert": {},
    "microfacet": {"f0": (0.9, 0.6, 0.3), "ax": 0.09, "ay": 0.09},
    "coupled": {"rm": (0.1, 0.3, 0.6)},
    "glass": {"ior": 1.45},
    "oren_nayar": {},
}


@pytest.fixture
def exporter():
    # The extension must be enabled, and factory settings know of neither.
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    yield
    bpy.ops.preferences.addon_disable(module="io_scene_gltf2")


def _principled(material):
    tree = material.node_tree
    return next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled").inputs


def _export_and_import(path):
    bpy.ops.export_scene.gltf(filepath=str(path))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path))


@pytest.mark.parametrize("osl", [False, True], ids=["nodes", "osl"])
def test_materials_arrive_as_the_nearest_principled_nodes(
    extension, empty, exporter, tmp_path, osl
):
    """They used to arrive white."""
    empty.cycles.shading_system = osl
    wanted = {}
    for name, values in MODELS.items():
        material = extension.api.new_material(name, **values)
        material.name = name
        helpers.add_sphere(empty, material, segments=8)
        wanted[name] = extension.api.nearest_principled(material)
    _export_and_import(tmp_path / "balls.glb")
    for name, near in wanted.items():
        found = _principled(bpy.data.materials[name])
        assert tuple(found["Base Color"].default_value)[:3] == pytest.approx(
            near["base_color"], abs=1e-5
        )
        for key in ("metallic", "roughness"):
            assert found[key.title()].default_value == pytest.approx(near[key], abs=1e-5), name
        if near["metallic"] < 1:
            assert found["IOR"].default_value == pytest.approx(near["ior"], abs=1e-5), name
        assert found["Transmission Weight"].default_value == near["transmission"], name
    # By hand.
    assert wanted["lambert"]["base_color"] == pytest.approx((0.8, 0.8, 0.8), abs=0.01)
    assert wanted["microfacet"]["metallic"] > 0.9
    assert wanted["microfacet"]["roughness"] == pytest.approx(0.3, abs=0.02)
    assert wanted["glass"]["transmission"] == 1 and wanted["glass"]["ior"] == pytest.approx(1.45)


def test_other_materials_are_exported_as_ever(extension, empty, exporter, tmp_path):
    helpers.add_balls_of_other_shaders(empty, extension.api)
    _export_and_import(tmp_path / "balls.glb")
    for name in ("plain", "coated"):
        assert _principled(bpy.data.materials[name])["Roughness"].default_value == 0.25


def test_a_sum_of_models_arrives_as_one_node(extension, empty, exporter, tmp_path):
    """It used to arrive white."""
    material = extension.api.new_sum(
        [("lambert", {"rho": rho}) for rho in ((0.4, 0.1, 0.1), (0.1, 0.1, 0.4))]
    )
    material.name = "sum"
    helpers.add_sphere(empty, material, segments=8)
    _export_and_import(tmp_path / "ball.glb")
    found = _principled(bpy.data.materials["sum"])["Base Color"].default_value
    assert tuple(found)[:3] == pytest.approx((0.5, 0.2, 0.5), abs=0.01)


def test_a_black_material_arrives_black(extension, empty, exporter, tmp_path):
    """It used to arrive white, as no node is nearest to it."""
    black = extension.api.new_material("lambert", rho=0)
    black.name = "black"
    helpers.add_sphere(empty, black, segments=8)
    _export_and_import(tmp_path / "ball.glb")
    found = _principled(bpy.data.materials["black"])
    assert tuple(found["Base Color"].default_value) == (0, 0, 0, 1)
    assert found["IOR"].default_value == 1 and found["Metallic"].default_value == 0


def test_nearest_principled(extension, empty):
    """Of a linked parameter the default counts, and a black material has none."""
    material = extension.api.new_material("lambert", rho=(0.5, 0.2, 0.1))
    near = extension.api.nearest_principled(material)
    assert near["base_color"] == pytest.approx((0.5, 0.2, 0.1), abs=0.01) and near["error"] < 0.01
    (node,) = extension.model_nodes.group_nodes(material)
    tree = material.node_tree
    link = tree.nodes.new("ShaderNodeTexNoise").outputs["Color"]
    tree.links.new(link, extension.model_nodes.sockets(node)["rho"])
    usual = extension.api.nearest_principled(extension.api.new_material("lambert"))
    found = extension.api.nearest_principled(material)
    for key, value in usual.items():
        assert found[key] == pytest.approx(value), key
    assert extension.api.nearest_principled(extension.api.new_material("lambert", rho=0)) is None
