# SPDX-License-Identifier: GPL-3.0-or-later
"""Twins without Open Shading Language: Blender's own nodes must reproduce what the tool evaluates,
and replace the shader."""

import contextlib
import math
import re
import shutil
from importlib import import_module

import bpy
import eevee
import numpy as np
import pytest
from goniometer import Goniometer, tilted, unit
from helpers import (
    add_camera,
    add_sphere,
    add_world,
    arguments,
    pairs_csv,
    read_csv,
    render,
    show_albedo,
)

#: One with a single colour for all closures, and one with three channels and a mirror.
MATERIALS = {
    "phong": {"e": 40.0, "ks": (0.9, 0.6, 0.2)},
    "schlick_double": {"rd": (0.8, 0.4, 0.1)},
}
SUNS = [(0, 0, 1), (0.3, -0.2, 0.9), (-0.5, 0.8, 0.3)]
FACETS = 96


@pytest.fixture
def lean(extension, use_pack):
    """The extension with a pack for these materials alone."""
    listed = {name: {"model": name, "parameters": values} for name, values in MATERIALS.items()}
    # A second material, which makes the first one's colour a socket.
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
    """Normals of facets under a sun; every second one is near the highlight."""
    normals = tilted(rng.uniform(0.05, 1, count), rng.uniform(0, 2 * math.pi, count))
    half = unit(unit(towards) + (0, 0, 1))
    near = unit(half + 0.1 * rng.normal(size=(count, 3)))
    return np.where((np.arange(count) % 2 == 0)[:, None], near, normals)


@pytest.mark.evidence
@pytest.mark.full
def test_a_sun_on_a_twin(lean, tool):
    """Every pair is within 1e-3 of the largest value that the tool states for the nodes."""
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


#: By model: a form, and values other than the defaults.
STAND_INS = {
    "phong": ("aimed", {"e": 300.0, "ks": (0.9, 0.6, 0.2)}),
    "cook_torrance": ("sampled", {"f0": (0.1, 0.2, 0.3), "m": 0.5}),
    "coupled": ("exact", {"rm": (0.1, 0.8, 0.3), "r0": 0.2}),
}


@pytest.fixture
def balls(extension):
    """Shows materials side by side under a sun and a grey sky: balls(materials, osl=...)."""

    def show(materials, osl):
        scene = bpy.context.scene
        scene.cycles.shading_system = osl
        for item in [o for o in scene.objects if o.type == "MESH"]:
            bpy.data.objects.remove(item)
        for x, material in enumerate(materials):
            add_sphere(scene, material).location.x = 2.2 * (x - 1)
        bpy.context.view_layer.update()
        return render(scene)[..., :3]

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, samples=16, max_bounces=0)
    add_camera(scene, orthographic=7)
    add_world(scene, strength=0.2)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.angle, sun.rotation_euler = 0.1, (1.0, 0.3, 0)
    scene.collection.objects.link(sun)
    scene.render.resolution_x, scene.render.resolution_y = 96, 32
    return show


def test_a_twin_stands_in_where_shaders_do_not_run(extension, balls):
    """Pixel by pixel, up to rounding: with OSL the shader alone, without it the twin."""
    api = extension.api
    made = [api.new_material(m, form) for m, (form, _) in STAND_INS.items()]
    for material, (_, values) in zip(made, STAND_INS.values(), strict=True):
        api.set_parameters(material, **values)
    shader, stood_in = balls(made, osl=True), balls(made, osl=False)
    for material in made:
        (node,) = extension.model_nodes.group_nodes(material)
        mix = next(n for n in node.node_tree.nodes if n.bl_idname == "ShaderNodeMixShader")
        alone = mix.inputs[2].links[0].from_socket
        node.node_tree.links.new(alone, mix.outputs[0].links[0].to_socket)
    np.testing.assert_allclose(balls(made, osl=True), shader, rtol=1e-5)
    twins = [api.new_material(m, "twin", **v) for m, (_, v) in STAND_INS.items()]
    np.testing.assert_allclose(balls(twins, osl=False), stood_in, rtol=1e-5)
    assert np.abs(shader - stood_in).max() > 0.01 and stood_in.mean() > 0.02


#: Models with two widths, of which each is narrow in one material and wide in another.
TWO_WIDTHS = {
    "microfacet": ({"ax": 0.03, "ay": 0.03}, {"ax": 0.5, "ay": 0.5, "tint": (0.5, 0.8, 1.0)}),
    "thin_film": (
        {"ax": 0.05, "ay": 0.05},
        {"ax": 0.4, "ay": 0.4, "thickness": 150, "film_ior": 2.2},
    ),
    "ward": ({"ax": 0.05, "ay": 0.05}, {"ax": 0.4, "ay": 0.4}),
    "ashikhmin_shirley": (
        {"nu": 500.0, "nv": 500.0, "rd": (0.5, 0.1, 0.1)},
        {"nu": 10.0, "nv": 10.0, "rs": 0.5, "part": "specular"},
    ),
    "phong_material": ({"e": 400.0, "es": 100.0}, {"e": 20.0, "es": 4.0}),
}


@pytest.mark.many
@pytest.mark.parametrize("model", TWO_WIDTHS)
def test_both_widths_show_where_shaders_do_not_run(extension, balls, model):
    """Blender's nodes in their place, as in EEVEE, are like the model at every width."""
    for values in TWO_WIDTHS[model]:
        stood_in, formulas = (
            balls([extension.api.new_material(model, form, **values)], osl=False)
            for form in ("sampled", "nodes")
        )
        like = np.corrcoef(stood_in.ravel(), formulas.ravel())[0, 1]
        print(f"{values}: {stood_in.mean() / formulas.mean():.3f} times as bright, {like:.4f}")
        assert stood_in.mean() == pytest.approx(formulas.mean(), rel=0.15)
        assert like > 0.96


@pytest.mark.long
@pytest.mark.parametrize("model", TWO_WIDTHS)
def test_both_widths_show_in_eevee(extension, balls, model, tmp_path):
    narrow, wide = (extension.api.new_material(model, **v) for v in TWO_WIDTHS[model])
    expected = balls([narrow, wide], osl=False)
    shown = eevee.render(bpy.context.scene, tmp_path)
    for part in (np.s_[:, :32], np.s_[:, 32:64]):
        assert np.corrcoef(expected[part].ravel(), shown[part].ravel())[0, 1] > 0.9


def test_what_is_linked_reaches_the_twin_too(extension, balls):
    def bumpy(form):
        material = extension.api.new_material("phong", form)
        tree, (node,) = material.node_tree, extension.model_nodes.group_nodes(material)
        noise, bump = (tree.nodes.new(f"ShaderNode{n}") for n in ("TexNoise", "Bump"))
        tree.links.new(noise.outputs[0], bump.inputs["Height"])
        sockets = extension.model_nodes.sockets(node)
        tree.links.new(bump.outputs["Normal"], sockets["Normal"])
        tree.links.new(noise.outputs["Color"], sockets["ks"])
        return material

    stood_in = balls([bumpy("aimed")], osl=False)
    np.testing.assert_allclose(balls([bumpy("twin")], osl=False), stood_in, rtol=1e-5)
    assert np.ptp(stood_in.mean((0, 1))) > 1e-3, "the noise has colours"


def test_the_albedo_output_is_the_twins_too(extension, balls):
    """Of a model without choices and with one width at most: others have the tables' albedo, see
    test_the_albedo_output_without_osl_follows_choices_and_widths."""

    def shining(form):
        material = extension.api.new_material("shirley_1991", form)
        (node,) = extension.model_nodes.group_nodes(material)
        show_albedo(material, node)
        return material

    shone = {osl: balls([shining("exact")], osl) for osl in (True, False)}
    np.testing.assert_allclose(balls([shining("twin")], osl=False), shone[False], rtol=1e-5)
    np.testing.assert_allclose(shone[True], shone[False], atol=0.02)
    assert np.ptp(shone[True]) > 0.1


def test_a_group_that_lost_what_tells_where_shaders_run_is_made_anew(extension, empty):
    material = extension.api.new_material("phong")
    (node,) = extension.model_nodes.group_nodes(material)
    node.node_tree.nodes.remove(node.node_tree.nodes["Runs"])
    found = {f.code: f.message for f in extension.api.warnings(material, empty)}
    assert "has lost its node Runs" in found["script_failed"]
    extension.api.switch_representation(material, "aimed")
    assert "script_failed" not in {f.code for f in extension.api.warnings(material, empty)}
    assert "Runs" in node.node_tree.nodes


def test_linked_materials_become_the_files_own_with_their_twins(extension, empty, tmp_path):
    for model, form in (("phong", "aimed"), ("phong", "sampled"), ("glass", "exact")):
        extension.api.new_material(model, form).use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (there, here):
        here.materials = there.materials
    for material in here.materials:
        extension.api.make_local(material)
    for kind, count in (("materials", 3), ("node_groups", 5), ("texts", 4), ("images", 1)):
        found = getattr(bpy.data, kind)
        assert len(found) == count, [f.name for f in found]
        assert not [f.name for f in found if f.library]


def test_what_is_said_is_of_the_twin_where_that_stands_in(extension, empty):
    extension.scene_loader.apply_clean_settings(empty)
    empty.cycles.use_guiding = True  # the warning is for the shader only
    empty.cycles.caustics_reflective = False  # and this one for the twin
    material = extension.api.new_material("phong", "aimed")
    before = {f.code for f in extension.api.warnings(material, empty)}
    assert "path_guiding" in before and "caustics" not in before
    empty.cycles.shading_system = False
    as_twin = extension.api.new_material("phong", "twin")
    said = [{f.code for f in extension.api.warnings(m, empty)} for m in (material, as_twin)]
    assert said[0] == said[1] | {"osl_off"}


def test_animation_stays_with_its_socket_when_the_form_changes(extension, empty):
    """The twin of lafortune has fewer sockets, so they have other indices."""
    material = extension.api.new_material("lafortune")
    add_sphere(empty, material)  # Blender evaluates only what is used
    (node,) = extension.model_nodes.group_nodes(material)
    sockets = extension.model_nodes.sockets
    for frame, value in ((1, 10.0), (11, 60.0)):
        sockets(node)["e"].default_value = value
        sockets(node)["e"].keyframe_insert("default_value", frame=frame)
    driver = sockets(node)["ks"].driver_add("default_value", 1)
    driver.driver.expression = "0.25"
    before = sockets(node)["e"].path_from_id("default_value")
    for form in ("twin", "aimed", "sampled"):
        extension.api.switch_representation(material, form)
        empty.frame_set(6)
        bpy.context.view_layer.update()
        assert sockets(node)["e"].default_value == pytest.approx(35), form
        assert sockets(node)["ks"].default_value[1] == pytest.approx(0.25), form
        moved = sockets(node)["e"].path_from_id("default_value") != before
        assert moved == (form == "twin")


def test_a_twin_goes_with_its_shader(extension, empty):
    material = extension.api.new_material("phong", "aimed")
    assert [t.name for t in bpy.data.node_groups if "twin" in t.name] == [".Phong (twin)"]
    other = extension.api.new_material("phong", "sampled")
    assert len(bpy.data.node_groups) == 4, "two forms, one twin, lamps"
    assert len([t for t in bpy.data.texts if "runs" in t.name]) == 1
    bpy.data.materials.remove(material)
    bpy.data.materials.remove(other)
    extension.nodes.remove_unused_groups()
    assert not bpy.data.node_groups and not bpy.data.texts


@pytest.mark.long
@pytest.mark.full
def test_a_twin_in_eevee(extension, use_pack, tmp_path):
    """Two balls in the sun must look like the same nodes in Cycles: equally bright, to 5 %, with
    highlights in the same places. EEVEE's lobes differ, so single pixels differ more."""
    from mathutils import Vector

    balls = {"phong": {"e": 20.0, "ks": (0.9, 0.6, 0.2)}, "oren_nayar": {"sigma": 0.5}}
    listed = {name: {"model": name, "parameters": values} for name, values in balls.items()}
    use_pack(listed, "--twin")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, samples=64, max_bounces=0)
    materials = [extension.api.new_material(name, "aimed", **v) for name, v in balls.items()]
    for x, material in zip((-1.1, 1.1), materials, strict=True):
        add_sphere(scene, material).location.x = x
    add_camera(scene, orthographic=4.4)
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.angle = 3, 0.1
    sun = bpy.data.objects.new("Sun", data)
    sun.rotation_mode = "QUATERNION"
    sun.rotation_quaternion = Vector((0.5, -1, 0.7)).to_track_quat("Z", "Y")
    scene.collection.objects.link(sun)
    scene.render.resolution_x, scene.render.resolution_y = 96, 48

    shown = eevee.render(scene, tmp_path)
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


def test_a_twin_is_too_bright_in_an_old_version(extension, empty):
    material = extension.api.new_material("phong", "twin")
    found = {f.code for f in extension.api.warnings(material, empty)}
    assert ("leaning_facets" in found) == (bpy.app.version < (5, 0, 0))
    empty.render.engine = eevee.engine()
    assert "leaning_facets" not in {f.code for f in extension.api.warnings(material, empty)}


def test_all_models_that_scatter_have_a_twin_and_none_takes_it_unasked(extension):
    for name, entry in extension.api.models().items():
        # A model that lets light through with all of its choices has a Glass node.
        assert ("twin" in entry["representations"]) == (entry["scatter"] and name != "rough_glass")
        assert entry["auto"] != "twin"
        values = {p["name"]: None for p in entry["parameters"]}  # all linked
        assert extension.pack.model(name).resolve("auto", values).name != "twin"


@pytest.mark.slow
def test_every_model_renders_without_osl(extension, third_of):
    """A row of balls of a third of the models, and their pixels: none is black or has a non-finite
    value. Glass and ideal mirrors are Blender's own nodes."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene, pixels = bpy.context.scene, 12
    extension.scene_loader.apply_clean_settings(scene, max_bounces=4)
    scene.cycles.shading_system = False
    models = third_of(extension.api.models())
    for i, model in enumerate(models):
        add_sphere(scene, extension.api.new_material(model)).location.x = 2.2 * i
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


def test_how_far_off_a_twin_is_is_said_where_that_is_known(extension, empty):
    extension.scene_loader.apply_clean_settings(empty)
    empty.cycles.shading_system = False
    for values, off in (
        ({}, " error 1.2 %"),
        ({"ax": 0.0625, "ay": 0.3}, None),
    ):
        material = extension.api.new_material("ward", "aimed", **values)
        (found,) = [f for f in extension.api.warnings(material, empty) if f.code == "osl_off"]
        said = "Open Shading Language is off: Blender's own nodes stand in"
        assert found.message == said + ("" if off is None else f",{off}")
        assert found.severity == "WARNING"
    with pytest.raises(ValueError, match="Blender Nodes is only for .* = 0.15, not for 0.0625"):
        extension.api.new_material("ward", "twin", ax=0.0625, ay=0.3)


#: By model: a value of the number that its twin's tables run over, between two rows but not in the
#: middle, and the other parameters. Models with two colours, with none, and with a mirror.
SLIDERS = {
    "phong": {"e": 73.0, "ks": (0.9, 0.6, 0.2)},
    "cook_torrance": {"m": 0.37, "f0": (0.9, 0.3, 0.05)},
    "schlick": {"rough": 0.21, "r": (0.7, 0.4, 0.1)},
    "coupled": {"r0": 0.15, "rm": (0.8, 0.3, 0.5)},
}


@pytest.mark.full
def test_tables_over_a_slider_are_what_the_tool_judges(extension, tool, empty):
    """Nodes with socket values, half of the facets in the highlight, as in test_a_sun_on_a_twin."""
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
        axis = extension.pack.model(name).forms["twin"].entry["axis"]
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


def test_an_exported_material_does_not_shine(extension, empty, tmp_path):
    """Exporters take an Emission node inside a group for light."""
    import json

    empty.cycles.shading_system = False
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    for model in ("lambert", "microfacet", "coupled"):
        add_sphere(empty, extension.api.new_material(model))
    path = tmp_path / "balls.gltf"
    bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLTF_SEPARATE")
    materials = json.loads(path.read_text())["materials"]
    assert len(materials) == 3
    assert not any("emissiveFactor" in material for material in materials)


def test_arguments_that_python_lacks_a_number_for(extension, empty):
    api, before = extension.api, set(bpy.data.materials)
    with pytest.raises(ValueError, match="expected a number from 0 to 1e"):
        api.new_material("max_phong", e=10**400)
    with pytest.raises(ValueError, match="Expected a text, got None"):
        api.new_sum([("lambert", {})], name=None)
    assert set(bpy.data.materials) == before


@pytest.mark.parametrize(
    ("model", "form", "osl"),
    [
        ("kelemen", "auto", False),
        ("kelemen", "auto", True),
        ("ward", "auto", True),
        ("ward", "aimed", True),
    ],
)
def test_what_was_painted_on_a_table_is_undone_when_the_file_is_saved(
    extension, empty, tmp_path, model, form, osl
):
    """Texture Paint offers all images in a material, and takes a table as its canvas. Those of
    ward's albedo stand beside its script."""
    empty.cycles.shading_system = osl
    material = extension.api.new_material(model, form)
    table = import_module(f"{extension.package}.content.twin").TABLE

    def tables():
        return [i for i in bpy.data.images if table in i]

    images = tables()
    assert images and not any(image.is_dirty for image in images)
    before = [np.array(image.pixels[:]) for image in images]
    for image in images:
        image.pixels[0] = 17.0
    assert all(image.is_dirty for image in images)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "painted.blend"))
    assert not any(image.is_dirty for image in images)
    for image, pixels in zip(images, before, strict=True):
        np.testing.assert_array_equal(image.pixels[:], pixels)

    # Blender's dialog for modified images packs them before the file is saved.
    for image in images:
        image.pixels[0] = 17.0
        image.pack()
    bpy.ops.wm.save_mainfile()
    assert len(tables()) == len(images)
    for image, pixels in zip(tables(), before, strict=True):
        np.testing.assert_array_equal(image.pixels[:], pixels)
    (node,) = extension.model_nodes.group_nodes(material)
    assert extension.nodes.script_problem(node.node_tree) is None


#: What has images of its own: a twin, formulas, a script's albedo, a coat, a layer, a fit.
WITH_TABLES = {
    "twin": lambda api: api.new_material("kelemen", "twin"),
    "automatic": lambda api: api.new_material("kelemen"),
    "script": lambda api: api.new_material("ward", "aimed"),
    "layers": lambda api: api.new_layers([("microfacet", {}), ("ward", {})]),
    "sum": lambda api: api.new_sum([("kelemen", {}), ("ward", {})]),
}


def _tables(extension):
    table = import_module(f"{extension.package}.content.twin").TABLE
    return [i for i in bpy.data.images if table in i]


def _numbers(extension):
    """By the image's name, without the number that Blender appends while another one has it."""
    return {re.sub(r"\.\d+$", "", i.name): np.array(i.pixels[:]) for i in _tables(extension)}


def _unpacked(extension, scene, folder, make):
    """The name of a material in a file whose images Unpack Resources wrote beside it."""
    material = make(extension.api)
    material.use_fake_user = True
    blend = folder / "unpacked.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.file.unpack_all(method="USE_LOCAL")
    assert any((folder / "textures").iterdir())
    return material.name


def _same(found, wanted):
    assert found.keys() == wanted.keys()
    for name, numbers in wanted.items():
        np.testing.assert_array_equal(found[name], numbers)


@pytest.mark.parametrize("osl", [False, True])
@pytest.mark.parametrize("make", WITH_TABLES.values(), ids=WITH_TABLES)
def test_tables_that_were_unpacked_are_packed_when_the_file_is_saved(
    extension, empty, tmp_path, make, osl
):
    empty.cycles.shading_system = osl
    _unpacked(extension, empty, tmp_path, make)
    before = _numbers(extension)
    assert before
    assert all(image.packed_file is None for image in _tables(extension))
    bpy.ops.wm.save_mainfile()
    assert all(image.packed_file is not None for image in _tables(extension))
    shutil.rmtree(tmp_path / "textures")
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    _same(_numbers(extension), before)


@contextlib.contextmanager
def _without_handlers(name):
    """Files may be saved where the extension is missing."""
    handlers = getattr(bpy.app.handlers, name)
    before = list(handlers)
    handlers.clear()
    try:
        yield
    finally:
        handlers.extend(before)


@pytest.mark.parametrize("osl", [False, True])
@pytest.mark.parametrize("make", WITH_TABLES.values(), ids=WITH_TABLES)
@pytest.mark.parametrize("when", ["opened", "rendered"])
def test_tables_whose_files_are_gone_are_made_anew(extension, empty, tmp_path, make, osl, when):
    empty.cycles.shading_system = osl
    name = _unpacked(extension, empty, tmp_path, make)
    before = _numbers(extension)
    with _without_handlers("save_pre"):
        bpy.ops.wm.save_mainfile()
    shutil.rmtree(tmp_path / "textures")
    with contextlib.ExitStack() as stack:
        if when == "rendered":  # the files went after the file was opened
            stack.enter_context(_without_handlers("load_post"))
        bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    scene, material = bpy.context.scene, bpy.data.materials[name]
    if when == "rendered":
        found = [w for w in extension.api.warnings(material, scene) if w.code == "lost_tables"]
        assert found and found[0].severity == "ERROR" and "put their files back" in found[0].message
        add_camera(scene)
        scene.render.engine, scene.cycles.samples = "CYCLES", 1
        scene.render.resolution_x = scene.render.resolution_y = 4
        render(scene)
    _same(_numbers(extension), before)
    assert all(image.packed_file is not None for image in _tables(extension))
    codes = {w.code for w in extension.api.warnings(material, scene)}
    assert not codes & {"lost_tables", "script_failed"}


@pytest.mark.parametrize("of", ["another version", "another file"])
def test_tables_that_can_not_be_made_again_are_warned_of(extension, empty, tmp_path, of):
    name = _unpacked(extension, empty, tmp_path, WITH_TABLES["twin"])
    (image,) = _tables(extension)
    image = image.name
    if of == "another version":
        for group in bpy.data.node_groups:
            if extension.model_nodes.TAG in group:
                group[extension.model_nodes.TAG]["digest"] = "of another version"
    with _without_handlers("save_pre"):
        bpy.ops.wm.save_mainfile()
    library = bpy.data.filepath
    (tmp_path / "textures").rename(tmp_path / "gone")
    if of == "another version":
        bpy.ops.wm.open_mainfile(filepath=library)
    else:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        with bpy.data.libraries.load(library, link=True) as (there, here):
            here.materials = [name]

    def said():
        found = extension.api.warnings(bpy.data.materials[name], bpy.context.scene)
        return [w.message for w in found if w.code == "lost_tables"]

    assert len(said()) == 1 and image in said()[0]
    (tmp_path / "gone").rename(tmp_path / "textures")
    assert said() == []
