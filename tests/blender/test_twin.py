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


def facets(rng, count, towards):
    """Normals of so many facets under a sun: every second one is near where its highlight is."""
    normals = tilted(rng.uniform(0.05, 1, count), rng.uniform(0, 2 * math.pi, count))
    half = unit(unit(towards) + (0, 0, 1))
    near = unit(half + 0.1 * rng.normal(size=(count, 3)))
    return np.where((np.arange(count) % 2 == 0)[:, None], near, normals)


@pytest.mark.full
def test_a_sun_on_a_twin(lean, tool):
    """Every pair is within 1e-3 of the largest value of what the tool says of the nodes."""
    rng = np.random.default_rng(3)
    which = np.repeat(np.arange(len(MATERIALS)), FACETS)
    found = {name: [] for name in MATERIALS}
    for towards in SUNS:
        scene, materials = start(lean)
        normals = facets(rng, len(which), towards)
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


def test_the_whole_extension_has_twins_that_follow_their_models(extension, empty, tmp_path):
    """Beside the model without the program brdfc: the twin's values are the model's, also after a
    change, and in the file that was saved. To single precision: a driver computes."""

    def follows(material, **expected):
        found = extension.nodes.group_nodes(material)
        assert [extension.nodes.identity(n)[1] for n in found] == ["aimed", "twin"]
        depsgraph = bpy.context.evaluated_depsgraph_get()
        depsgraph.update()
        tree = material.evaluated_get(depsgraph).node_tree
        for node in found:
            values = extension.nodes.all_values(tree.nodes[node.name])
            for name, value in expected.items():
                assert values[name] == pytest.approx(value, rel=1e-6), (node.name, name)

    made = {"cook_torrance": {"f0": (0.9, 0.6, 0.2), "m": 0.3}, "phong": {"e": 300.0}}
    changed = {"cook_torrance": {"f0": (0.1, 0.2, 0.3), "m": 0.5}, "phong": {"e": 12.5}}
    names = {}
    for model, values in made.items():
        material = extension.api.new_material(model, **values)
        names[model] = material.name
        extension.api.add_twin(material)
        add_sphere(empty, material)
        follows(material, **values)
        for name, value in changed[model].items():
            extension.nodes.set_value(extension.nodes.group_nodes(material)[0], name, value)
        follows(material, **changed[model])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "twin.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "twin.blend"))
    for model, name in names.items():
        follows(bpy.data.materials[name], **changed[model])
    material = bpy.data.materials[names["phong"]]
    extension.nodes.set_value(extension.nodes.group_nodes(material)[0], "e", 700.0)
    follows(material, e=700)


def test_all_models_that_scatter_have_a_twin_and_none_takes_it_unasked(extension):
    for name, entry in extension.api.models().items():
        assert ("twin" in entry["representations"]) == entry["scatter"], name
        assert entry["auto"] != "twin"
        values = {p["name"]: None for p in entry["parameters"]}  # all linked
        assert extension.pack.resolve(name, "auto", values) != "twin"


def test_every_twin_renders_without_osl(extension):
    """A row of balls, pixels a ball: none is black or has a value that is no number."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene, pixels = bpy.context.scene, 12
    extension.scene_loader.apply_clean_settings(scene, max_bounces=0)
    scene.cycles.shading_system = False
    models = [m for m, e in extension.api.models().items() if "twin" in e["representations"]]
    for i, model in enumerate(models):
        add_sphere(scene, extension.api.new_material(model, "twin")).location.x = 2.2 * i
    middle = 1.1 * (len(models) - 1)
    add_camera(scene, (middle, -6, 0), orthographic=2.2 * len(models))
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.render.resolution_x, scene.render.resolution_y = pixels * len(models), pixels
    scene.cycles.samples = 16
    picture = render(scene)[..., :3]
    assert np.isfinite(picture).all()
    for i, model in enumerate(models):
        ball = picture[3:-3, pixels * i + 3 : pixels * (i + 1) - 3]
        assert 1e-3 < ball.mean() < 0.1, f"{model}: {ball.mean():.3g} in a world of 0.05"


def test_no_twin_for_other_values_than_it_has(extension, empty):
    material = extension.api.new_material("ward", ax=0.0625, ay=0.3)
    with pytest.raises(ValueError, match="Twin is only for .* = 0.15, not for 0.0625"):
        extension.api.add_twin(material)
    assert len(material.node_tree.nodes) == 2


#: By model a value of the number that its twin runs over, away from the middle between two rows of
#: its tables, and what it mixes. Of two colours, none, and a mirror's.
SLIDERS = {
    "phong": {"e": 73.0, "ks": (0.9, 0.6, 0.2)},
    "cook_torrance": {"m": 0.37, "f0": (0.9, 0.3, 0.05)},
    "schlick": {"rough": 0.21, "r": (0.7, 0.4, 0.1)},
    "coupled": {"r0": 0.15, "rm": (0.8, 0.3, 0.5)},
}


@pytest.mark.full
def test_tables_over_a_slider_are_what_the_tool_judges(extension, tool, empty):
    """Nodes with values in their sockets, half of all highlights, as test_a_sun_on_a_twin."""
    rng = np.random.default_rng(5)
    count = 64
    which = np.repeat(np.arange(len(SLIDERS)), count)
    towards = (0.3, -0.2, 0.9)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=0)
    scene.cycles.shading_system = False
    materials = [extension.api.new_material(m, "twin", **v) for m, v in SLIDERS.items()]
    normals = facets(rng, len(which), towards)
    meter = Goniometer(scene, materials, normals, samples=4, which=which)
    wi = meter.local(meter.add_sun(unit(towards)))
    wo, picture = meter.wo(), meter.measure()
    for i, (name, values) in enumerate(SLIDERS.items()):
        lit = (which == i) & (wi[:, 2] > 1e-3) & (wo[:, 2] > 0.02)
        axis = extension.pack.representation(name, "twin")["axis"]
        mixed = [n for n in values if n in ("f0", "r", "r0")]
        over = ["--over", axis["name"]] if axis else []
        over += ["--any", *mixed] if mixed else []
        stdin = pairs_csv(wi[lit], wo[lit])
        pairs = ["fit", name, *arguments(values), "--twin", *over, "--pairs"]
        expected = read_csv(tool(*pairs, stdin=stdin))[1]
        off, largest = np.abs(picture[lit] - expected).max(), expected.max()
        print(f"{name}: off by {off:.2g} of {largest:.2g}")
        assert largest > 0.1, name
        assert off <= 2e-3 * largest, name
