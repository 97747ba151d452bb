# SPDX-License-Identifier: GPL-3.0-or-later
"""Twins without Open Shading Language: Blender's own nodes make of the curves what the tool judges,
and stand where the shader does."""

import math

import bpy
import eevee
import numpy as np
import pytest
from goniometer import Goniometer, tilted, unit
from helpers import (
    add_camera,
    add_sphere,
    arguments,
    pairs_csv,
    read_csv,
    read_picture,
    render,
)

#: One colour for all closures, and three channels beside a mirror.
MATERIALS = {
    "phong": {"e": 40.0, "ks": (0.9, 0.6, 0.2)},
    "schlick_double": {"rd": (0.8, 0.4, 0.1)},
}
SUNS = [(0, 0, 1), (0.3, -0.2, 0.9), (-0.5, 0.8, 0.3)]
FACETS = 96


@pytest.fixture
def lean(extension, use_pack):
    """The extension with a pack of these materials alone."""
    listed = {name: {"model": name, "parameters": values} for name, values in MATERIALS.items()}
    # A second one, so that the first one's colour is a socket.
    listed["grey"] = {"model": "phong", "parameters": MATERIALS["phong"] | {"ks": 0.4}}
    use_pack(listed, "--twin")
    return extension


def start(lean):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    lean.scene_loader.apply_clean_settings(scene, max_bounces=0)
    scene.cycles.shading_system = False
    return scene, [lean.api.new_material(name, "twin", **v) for name, v in MATERIALS.items()]


@pytest.mark.full
def test_a_sun_on_a_twin(lean, tool):
    """Every pair is within 1e-3 of the largest value of what the tool says of the nodes."""
    rng = np.random.default_rng(3)
    which = np.repeat(np.arange(len(MATERIALS)), FACETS)
    found = {name: [] for name in MATERIALS}
    for towards in SUNS:
        scene, materials = start(lean)
        normals = tilted(rng.uniform(0.05, 1, len(which)), rng.uniform(0, 2 * math.pi, len(which)))
        half = unit(unit(towards) + (0, 0, 1))
        near = unit(half + 0.1 * rng.normal(size=(len(which), 3)))
        normals = np.where((np.arange(len(which)) % 2 == 0)[:, None], near, normals)
        meter = Goniometer(scene, materials, normals, samples=4, which=which)
        wi = meter.local(meter.add_sun(unit(towards)))
        wo, picture = meter.wo(), meter.measure()
        for i, name in enumerate(MATERIALS):
            lit = (which == i) & (wi[:, 2] > 1e-3) & (wo[:, 2] > 0.02)
            found[name].append(np.hstack([wi[lit], wo[lit], picture[lit]]))
    for name, rows in found.items():
        wi, wo, measured = np.split(np.concatenate(rows), 3, axis=1)
        values = arguments(MATERIALS[name])
        stdin = pairs_csv(wi, wo)
        expected = read_csv(tool("fit", name, *values, "--twin", "--pairs", stdin=stdin))[1]
        off, largest = np.abs(measured - expected).max(), expected.max()
        print(f"{name}: off by {off:.2g} of {largest:.2g}")
        assert largest > 0.1, name
        assert off <= 1e-3 * largest, name


def test_a_twin_stands_beside_its_model(lean, empty):
    """The shader is for Cycles, the twin for EEVEE; that OSL is off concerns the shader alone."""
    api = lean.api
    material = api.new_material("phong", "aimed")
    tree = material.node_tree
    bump = tree.nodes.new("ShaderNodeBump")
    node = lean.nodes.group_nodes(material)[0]
    tree.links.new(bump.outputs["Normal"], lean.nodes.sockets(node)["Normal"])
    empty.cycles.shading_system = False
    assert "osl_off" in {f.code for f in api.warnings(material, empty)}
    api.add_twin(material)
    outputs = {n.target: n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial"}
    assert set(outputs) == {"CYCLES", "EEVEE"}
    shown = {t: o.inputs["Surface"].links[0].from_node for t, o in outputs.items()}
    assert [lean.nodes.identity(shown[t])[1] for t in ("CYCLES", "EEVEE")] == ["aimed", "twin"]
    twin = shown["EEVEE"]
    assert lean.nodes.sockets(twin)["Normal"].links[0].from_node == bump
    assert not any(n.bl_idname == "ShaderNodeScript" for n in twin.node_tree.nodes)
    with pytest.raises(ValueError, match="output for EEVEE already"):
        api.add_twin(material)

    api.switch_representation(material, "twin")
    assert "osl_off" not in {f.code for f in api.warnings(material, empty)}
    api.switch_representation(material, "aimed")
    assert lean.nodes.identity(shown["CYCLES"])[1] == "aimed"


@pytest.mark.full
def test_a_twin_in_eevee(extension, use_pack, tmp_path):
    """Two balls in the sun look as Cycles shows the same nodes: as bright, to 5 %, and their
    highlights where those are. EEVEE's lobes are its own, so pixels differ by more."""
    from mathutils import Vector

    balls = {"phong": {"e": 20.0, "ks": (0.9, 0.6, 0.2)}, "oren_nayar": {"sigma": 0.5}}
    listed = {name: {"model": name, "parameters": values} for name, values in balls.items()}
    use_pack(listed, "--twin")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, samples=64, max_bounces=0)
    materials = [extension.api.new_material(name, "aimed", **v) for name, v in balls.items()]
    for x, material in zip((-1.1, 1.1), materials, strict=True):
        extension.api.add_twin(material)
        add_sphere(scene, material).location.x = x
    add_camera(scene, orthographic=4.4)
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.angle = 3, 0.1
    sun = bpy.data.objects.new("Sun", data)
    sun.rotation_mode = "QUATERNION"
    sun.rotation_quaternion = Vector((0.5, -1, 0.7)).to_track_quat("Z", "Y")
    scene.collection.objects.link(sun)
    scene.render.resolution_x, scene.render.resolution_y = 96, 48

    scene.render.engine = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"
    scene.eevee.taa_render_samples = 16
    scene.render.filepath = str(tmp_path / "eevee.exr")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "eevee.blend"))
    if missing := eevee.picture_of(tmp_path / "eevee.blend", scene.render.filepath):
        pytest.skip(missing)
    shown = read_picture(tmp_path / "eevee.exr")[..., :3]
    scene.render.engine = "CYCLES"
    for material in materials:
        extension.api.switch_representation(material, "twin")
    expected = render(scene)[..., :3]
    for name, part in {"phong": np.s_[:, :48], "oren_nayar": np.s_[:, 48:]}.items():
        a, b = expected[part], shown[part]
        brighter = b.mean((0, 1)) / a.mean((0, 1))
        like = np.corrcoef(a.ravel(), b.ravel())[0, 1]
        apart = np.subtract(
            *(np.argwhere(p[..., 0] > 0.9 * p[..., 0].max()).mean(0) for p in (a, b))
        )
        print(f"{name}: {brighter} times as bright, correlation {like:.4f}, {apart} pixels apart")
        assert brighter == pytest.approx(1, abs=0.05), name
        assert like > 0.98, name
        assert np.abs(apart).max() < 1.5, name


def test_a_twin_is_too_bright_in_an_old_version(lean, empty):
    material = lean.api.new_material("phong", "twin")
    found = {f.code for f in lean.api.warnings(material, empty)}
    assert ("leaning_facets" in found) == (bpy.app.version < (5, 0, 0))
    empty.render.engine = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"
    assert "leaning_facets" not in {f.code for f in lean.api.warnings(material, empty)}


def test_no_twin_in_the_whole_extension(extension, empty):
    material = extension.api.new_material("phong")
    with pytest.raises(ValueError, match="has no form 'twin'"):
        extension.api.add_twin(material)
    assert len(material.node_tree.nodes) == 2
