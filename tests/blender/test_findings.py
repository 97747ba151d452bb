# SPDX-License-Identifier: GPL-3.0-or-later
"""Findings about a scene's lamps, each code at most once; and messages to scripts and consoles."""

import inspect
import math
import re
from importlib import import_module
from pathlib import Path

import bpy
import helpers
import numpy as np
import pytest
from helpers import add_lamp

ROOT = Path(__file__).resolve().parents[2]


def ring(scene, count, turn=0.0, **settings):
    """Adds equal lamps at equal distances from the origin."""
    turns = [turn + 2 * math.pi * i / count for i in range(count)]
    return [
        add_lamp(scene, name=f"Lamp{i}", location=(3 * math.cos(t), 3 * math.sin(t), 4), **settings)
        for i, t in enumerate(turns)
    ]


def ball(extension, scene, model="ashikhmin_shirley", form="aimed", **values):
    extension.scene_loader.apply_clean_settings(scene, max_bounces=0)
    extension.api.enable_osl(scene)
    material = extension.api.new_material(model, form, **values)
    item = helpers.add_sphere(scene, material)
    bpy.context.view_layer.objects.active = item
    bpy.context.view_layer.update()
    assert extension.api.warnings(material, scene) == []
    return material


def found(extension, material, scene):
    """{code: message} of the findings, each code at most once."""
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()  # runs Blender's handlers
    findings = extension.api.warnings(material, scene)
    assert len({f.code for f in findings}) == len(findings)
    return {f.code: f.message for f in findings}


def offered(extension, material, scene):
    layout = helpers.Layout()
    extension.ui.draw_findings(layout, extension.checks.warnings(material, scene))
    return [line for line in layout.log if line.startswith("operator")]


def light_of(scene, samples=64):
    """Mean radiance of a small picture."""
    if scene.camera is None:
        helpers.add_camera(scene, location=(0, -3, 3), rotation=(np.pi / 4, 0, 0))
    scene.render.resolution_x = scene.render.resolution_y = 24
    scene.cycles.samples = samples
    return helpers.render(scene)[..., :3].mean()


# ---- documented code -----------------------------------------------------------------------------


@pytest.mark.many
@pytest.mark.parametrize("page", ["README.md", "docs/blender.md"])
def test_documented_code_shows_the_material_in_a_new_file(extension, page):
    text = (ROOT / page).read_text(encoding="utf-8")
    block = next(b for b in re.findall(r"(?:^    .*\n|^\n)+", text, re.M) if "new_material(" in b)
    code = "\n".join(line[4:] for line in block.splitlines())
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene = bpy.context.scene
    exec(compile(code, page, "exec"), {})
    scene.render.resolution_x, scene.render.resolution_y = 32, 18
    # New files are rendered with EEVEE, whose 64 samples take half a minute without a GPU.
    scene.eevee.taa_render_samples, scene.cycles.samples = 1, 16
    red, green, blue = helpers.render(scene)[6:12, 13:19, :3].mean((0, 1))
    assert red > 3 * green and red > 3 * blue and red > 0.02


def test_documented_code_of_the_module_is_that_of_the_readme(extension):
    code = [line.strip() for line in extension.api.__doc__.splitlines() if line.startswith("    ")]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(code) == 3 and all(f"    {line}\n" in readme for line in code)


def test_every_function_for_scripts_is_exported_and_in_the_table(extension):
    api = extension.api
    functions = {
        name
        for name, item in inspect.getmembers(api, inspect.isfunction)
        if item.__module__ == api.__name__ and not name.startswith("_")
    }
    assert "scene_warnings" in functions
    assert functions <= set(api.__all__)
    page = (ROOT / "docs" / "blender.md").read_text(encoding="utf-8")
    assert not {name for name in functions if f"`{name}(" not in page}


@pytest.mark.parametrize("given", [None, "Material", 3])
def test_no_material_is_an_error_that_says_so(extension, empty, given):
    api = extension.api
    for call in (
        lambda: api.set_parameters(given, e=20.0),
        lambda: api.get_parameters(given),
        lambda: api.switch_representation(given, "sampled"),
        lambda: api.make_local(given),
        lambda: api.prepare_material(given),
        lambda: api.add_albedo(given),
        lambda: api.set_substance(given, "gold"),
        lambda: api.convert_back(given),
        lambda: api.warnings(given, empty),
        lambda: api.plan_conversion([given]),
    ):
        with pytest.raises(ValueError, match=f"Expected a material, got {given!r}"):
            call()


@pytest.mark.parametrize("given", [None, "Scene", 3])
def test_no_scene_node_or_plan_is_an_error_that_says_so(extension, empty, given):
    api = extension.api
    material = api.new_material("lossless")
    (node,) = extension.model_nodes.group_nodes(material)
    for call, what in (
        (lambda: api.warnings(material, given), "a scene"),
        (lambda: api.scene_warnings(given), "a scene"),
        (lambda: api.enable_osl(given), "a scene"),
        (lambda: api.see_lamps(given), "a scene"),
        (lambda: api.enlarge_lamps(given), "a scene"),
        (lambda: api.set_kernel(given, node), "a node"),
        (lambda: api.set_kernel(node, given), "a node"),
        (lambda: api.bake(given), "a plan"),
        (lambda: api.convert_materials([given]), "a plan"),
    ):
        with pytest.raises(ValueError, match=f"Expected {what}, got {given!r}"):
            call()
    for call in (api.plan_conversion, api.convert_materials):
        with pytest.raises(ValueError, match="Expected a (list|material|plan), got"):
            call(given)


# ---- lamps that materials do not aim at ----------------------------------------------------------


@pytest.mark.long
@pytest.mark.slow
def test_lamps_without_a_size_beyond_the_slots_are_lost_until_they_have_one(extension, empty):
    material = ball(extension, empty, "radziszewski_alda")  # it has no base that would show them
    first = ring(empty, 8, shadow_soft_size=0.0, energy=50)
    assert found(extension, material, empty) == {}
    alone = light_of(empty)
    second = ring(empty, 8, turn=0.3, shadow_soft_size=0.0, energy=50)
    message = found(extension, material, empty)["lost_lamps"]
    assert "and 5 more" in message and "fainter than the 8" in message
    assert offered(extension, material, empty) == ["operator brdfc.enlarge_lamps Give Lamps a Size"]
    shown = light_of(empty)
    for item in first:
        item.hide_render = True
    bpy.context.view_layer.update()
    both = alone + light_of(empty)
    for item in first:
        item.hide_render = False
    assert shown < 0.6 * both
    assert bpy.ops.brdfc.enlarge_lamps() == {"FINISHED"}
    assert all(item.data.shadow_soft_size > 0 for item in (*first, *second))
    assert list(found(extension, material, empty)) == ["not_aimed"], "what is left is noise"
    # The lost light returns as rare dots; larger lamps show it in a small picture.
    for item in (*first, *second):
        item.data.shadow_soft_size = 0.25
    assert light_of(empty, 2048) == pytest.approx(both, rel=0.05)


def test_small_lamps_of_sampled_forms_get_a_size_by_the_same_button(extension, empty):
    material = ball(extension, empty, form="sampled")
    lamps = [
        add_lamp(empty, shadow_soft_size=0.0),
        add_lamp(empty, "SUN", "Sun", angle=0.0),
        add_lamp(empty, "AREA", "Area", shape="RECTANGLE", size=1.0, size_y=0.001),
    ]
    message = found(extension, material, empty)["zero_size_lights"]
    assert all(lamp.name in message for lamp in lamps)
    assert offered(extension, material, empty) == ["operator brdfc.enlarge_lamps Give Lamps a Size"]
    assert extension.api.enlarge_lamps(empty) == (["Lamp", "Sun", "Area"], [])
    assert found(extension, material, empty) == {}
    assert lamps[2].data.size == 1 and extension.api.enlarge_lamps(empty) == ([], [])


def test_lamps_that_no_picture_shows_are_no_finding(extension, empty):
    material = ball(extension, empty, form="sampled")
    lamp = add_lamp(empty, shadow_soft_size=0.0)
    assert list(found(extension, material, empty)) == ["zero_size_lights"]
    lamp.hide_render = True
    assert found(extension, material, empty) == {}
    lamp.hide_render = False
    collection = bpy.data.collections.new("Hidden")
    empty.collection.children.link(collection)
    collection.objects.link(lamp)
    empty.collection.objects.unlink(lamp)
    assert list(found(extension, material, empty)) == ["zero_size_lights"]
    collection.hide_render = True
    assert found(extension, material, empty) == {}


def test_bright_lamps_that_are_not_aimed_at_are_one_finding(extension, empty):
    material = ball(extension, empty)
    ring(empty, 16, shadow_soft_size=0.2, energy=50)
    messages = found(extension, material, empty)
    assert list(messages) == ["not_aimed"]
    assert "and 5 more" in messages["not_aimed"] and "fainter than the 8" in messages["not_aimed"]
    for item in list(empty.objects):
        if item.type == "LIGHT" and int(item.name[4:]) >= 8:
            item.data.energy = 1
    assert found(extension, material, empty) == {}, "dim ones drown in the others"


def emissive(strength):
    material = bpy.data.materials.new("Emissive")
    tree = helpers.empty_tree(material)
    node = tree.nodes.new("ShaderNodeEmission")
    node.inputs["Strength"].default_value = strength
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def test_meshes_that_shine(extension, empty):
    material = ball(extension, empty)
    add_lamp(empty, energy=100, shadow_soft_size=0.2)
    mesh = bpy.data.meshes.new("Tube")
    # Two strips at right angles.
    points = [(-1, 0, 0), (1, 0, 0), (1, 0.1, 0), (-1, 0.1, 0), (-1, 0, 0.1), (1, 0, 0.1)]
    mesh.from_pydata(points, [], [(0, 1, 2, 3), (0, 1, 5, 4)])
    mesh.materials.append(emissive(0.01))
    tube = bpy.data.objects.new("Tube", mesh)
    tube.location = (0, 0, 6)
    empty.collection.objects.link(tube)
    assert found(extension, material, empty) == {}, "it is dim"
    mesh.materials[0] = emissive(20.0)
    messages = found(extension, material, empty)
    assert list(messages) == ["not_aimed"]
    assert messages["not_aimed"].endswith(
        "Noisy under Tube: a mesh that is neither flat, round nor small"
    )


def test_a_world_that_can_not_be_followed(extension, empty):
    material = ball(extension, empty)
    tree, background = helpers.add_world(empty)
    image = bpy.data.images.new("Sky", 64, 32, float_buffer=True)
    pixels = np.full((32, 64, 4), 0.1, np.float32)
    pixels[24, 20] = 5000
    image.pixels.foreach_set(pixels.ravel())
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    tree.links.new(node.outputs["Color"], background.inputs["Color"])
    extension.api.see_lamps(empty)
    assert found(extension, material, empty) == {}
    node.projection = "MIRROR_BALL"
    messages = found(extension, material, empty)
    assert list(messages) == ["not_aimed"]
    assert "Sky, bright spot 1: its vector or projection" in messages["not_aimed"]


@pytest.mark.long
@pytest.mark.slow
def test_lamps_that_take_light_are_aimed_at(extension, empty):
    """Lamps of negative power: random rays can't hit one without a size, so closures account for
    all of it."""
    ball(extension, empty)
    lamp = add_lamp(empty, location=(1, -2, 4), energy=100, shadow_soft_size=0.0)
    bpy.context.view_layer.update()
    given = light_of(empty)
    helpers.add_world(empty, 5.0)
    both = light_of(empty, 1024)
    lamp.data.energy = -100
    (seen,) = extension.api.see_lamps(empty)
    assert seen.slot == 1 and seen.irradiance > 0
    less = light_of(empty, 1024)
    assert given > 0.01
    assert both - less == pytest.approx(2 * given, rel=0.02)


# ---- materials of another file -------------------------------------------------------------------


def linked_from_a_file(extension, folder, material, objects=()):
    """Saves the open file as library.blend, and links the material and objects with these names
    from it into a new one. Returns its scene, the objects and the material."""
    bpy.context.view_layer.update()
    path = folder / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    name = material.name
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=0)
    extension.api.enable_osl(scene)
    with bpy.data.libraries.load(str(path), link=True) as (_, to):
        to.materials, to.objects = [name], [*objects]
    return scene, to.objects, to.materials[0]


@pytest.mark.parametrize("with_object", [False, True])
def test_linked_materials_aim_at_their_own_files_lamps(extension, empty, tmp_path, with_object):
    material = ball(extension, empty)
    add_lamp(empty, name="There", location=(5, 0, 5), energy=100, shadow_soft_size=0.1)
    objects = ["Sphere", "There"] if with_object else []
    scene, linked, material = linked_from_a_file(extension, tmp_path, material, objects)
    if with_object:
        item, there = linked
        scene.collection.objects.link(item)
        scene.collection.objects.link(there)
        material = item.active_material
        assert found(extension, material, scene) == {}, "its lamp is here too"
    else:
        item = helpers.add_sphere(scene, material)
    bpy.context.view_layer.objects.active = item
    add_lamp(scene, name="Here", location=(1, -2, 4), energy=100, shadow_soft_size=0.1)
    message = found(extension, material, scene)["linked_lamps"]
    assert "Noisy under Here" in message and "library.blend" in message
    assert offered(extension, material, scene) == ["operator brdfc.make_local Make Local"]
    bpy.data.lights["Here"].shadow_soft_size = 0.0
    message = found(extension, material, scene)["linked_lamps"]
    assert "Light of lamps without a size (Here) is lost" in message
    assert bpy.ops.brdfc.make_local() == {"FINISHED"}
    material = bpy.context.object.active_material
    assert material.library is None
    assert found(extension, material, scene) == {}
    (node,) = extension.model_nodes.group_nodes(material)
    assert node.node_tree.library is None
    lamps = import_module(f"{extension.package}.lamps")
    (shared,) = [
        n.node_tree for n in node.node_tree.nodes if lamps.is_group(getattr(n, "node_tree", {}))
    ]
    assert shared == lamps.find_group() and shared.library is None
    assert light_of(scene) > 0


LIKE = {
    "point": ("POINT", {"location": (5, 0, 5), "energy": 100, "shadow_soft_size": 0.1}),
    "spot": ("SPOT", {"location": (0, 0, 6), "energy": 100, "shadow_soft_size": 0.1}),
    "sun": ("SUN", {"location": (0, 0, 6), "energy": 1, "angle": 0.03}),
    "area": ("AREA", {"location": (0, 0, 6), "energy": 100, "size": 0.3}),
}


@pytest.mark.parametrize("kind", LIKE)
def test_a_lamp_like_that_of_the_linked_file_is_none_to_warn_of(extension, empty, tmp_path, kind):
    """Materials aim at places, so it does not matter that the lamp is another object."""
    kind, inputs = LIKE[kind]
    material = ball(extension, empty)
    add_lamp(empty, kind, name="There", **inputs)
    scene, _, material = linked_from_a_file(extension, tmp_path, material)
    bpy.context.view_layer.objects.active = helpers.add_sphere(scene, material)
    here = add_lamp(scene, kind, name="Here", **inputs)
    bpy.context.view_layer.update()
    assert "linked_lamps" not in found(extension, material, scene)
    # Elsewhere it is one. A sun is the same wherever it stands.
    if kind == "SUN":
        here.location = (1, 2, 3)
        bpy.context.view_layer.update()
        assert "linked_lamps" not in found(extension, material, scene)
        here.rotation_euler = (0.5, 0, 0)
    else:
        here.location.x -= 2
    bpy.context.view_layer.update()
    assert "Here" in found(extension, material, scene)["linked_lamps"]


# ---- physics that a lamp's settings bring out ----------------------------------------------------


def test_small_lamps_in_an_ideal_mirror(extension, empty):
    mirror = ball(extension, empty, "schlick")
    matte = extension.api.new_material("lambert")
    lamp = add_lamp(empty, shadow_soft_size=0.05)
    messages = found(extension, mirror, empty)
    assert list(messages) == ["small_in_mirror"] and "Lamp" in messages["small_in_mirror"]
    assert found(extension, matte, empty) == {}
    for size in (0.0, 0.1, 0.5):  # mirrors don't show lamps without a size; 0.1 is a new lamp
        lamp.data.shadow_soft_size = size
        assert found(extension, mirror, empty) == {}
    lamp.data.shadow_soft_size = 0.05
    for rough, linked, warned in ((0.49, False, True), (0.5, False, False), (0.5, True, True)):
        extension.api.set_parameters(mirror, rough=rough)  # without a mirror from 0.5 on
        if linked:
            (node,) = extension.model_nodes.group_nodes(mirror)
            texture = mirror.node_tree.nodes.new("ShaderNodeTexNoise")
            mirror.node_tree.links.new(
                texture.outputs[0], extension.model_nodes.sockets(node)["rough"]
            )
        assert ("small_in_mirror" in found(extension, mirror, empty)) == warned


def test_what_is_wrong_with_several_nodes_is_said_once(extension, empty):
    """A clamp that darkens both models of each of three materials."""
    lobes = [("ward", {}), ("blinn", {}), ("ward", {"ks": 0.1})]
    made = [extension.api.new_sum(lobes, "sampled", name=name) for name in ("A", "B", "C")]
    extension.scene_loader.apply_clean_settings(empty)
    empty.cycles.sample_clamp_indirect = empty.cycles.sample_clamp_direct = 3.0
    for material in made:
        ours = extension.model_nodes.group_nodes(material)
        names = ", ".join(dict.fromkeys(node.label or node.name for node in ours))
        clamped = [
            (f.code, f.message)
            for f in extension.api.warnings(material, empty)
            if f.code.startswith("clamp")
        ]
        print(clamped)
        assert sorted(code for code, _ in clamped) == ["clamp_direct", "clamp_indirect"]
        for _, message in clamped:
            assert message.startswith(f"{names}: ") and message.count("clamped") == 1


def test_sheared_area_lamps(extension, empty):
    material = extension.api.new_material("ward", "nodes")
    helpers.add_sphere(empty, material)
    lamp = helpers.add_lamp(empty, "AREA", "Lamp", (0, -2, 3), (0.5, 0.3, 0))
    lamp.parent = bpy.data.objects.new("Parent", None)
    empty.collection.objects.link(lamp.parent)
    for scale, codes in (((1, 1, 1), []), ((2, 1, 1), ["sheared_lamps"]), ((2, 2, 2), [])):
        lamp.parent.scale = scale
        bpy.context.view_layer.update()
        assert [c for c in found(extension, material, empty) if c == "sheared_lamps"] == codes
    lamp.parent.scale = (2, 1, 1)
    bpy.context.view_layer.update()
    aimed = extension.api.new_material("ward", "aimed")
    assert "sheared_lamps" not in found(extension, aimed, empty)


def test_sheared_instances_of_area_lamps(extension, empty):
    material = extension.api.new_material("ward", "nodes")
    helpers.add_sphere(empty, material)
    collection = bpy.data.collections.new("Lamps")
    lamp = helpers.add_lamp(empty, "AREA", "Lamp", (0, -2, 3), (0.5, 0.3, 0))
    empty.collection.objects.unlink(lamp)
    collection.objects.link(lamp)
    copy = bpy.data.objects.new("Copy", None)
    copy.instance_type, copy.instance_collection = "COLLECTION", collection
    empty.collection.objects.link(copy)
    for scale, expected in (((1, 1, 1), False), ((1, 1.1, 1), True), ((2, 2, 2), False)):
        copy.scale = scale
        messages = found(extension, material, empty)
        assert ("sheared_lamps" in messages) == expected
        assert not expected or "Copy/Lamp" in messages["sheared_lamps"]
    copy.scale = (1, 1.1, 1)
    sampled = extension.api.new_material("ward", "sampled")
    aimed = extension.api.new_material("ward", "aimed")
    assert "sheared_lamps" in found(extension, sampled, empty)
    assert "sheared_lamps" not in found(extension, aimed, empty)
    lamp.data.type = "POINT"
    assert "sheared_lamps" not in found(extension, material, empty)


@pytest.mark.parametrize("rays", ["visible_diffuse", "visible_glossy"])
def test_ray_visibility_of_lamps(extension, empty, rays):
    material = ball(extension, empty)
    lamp = add_lamp(empty)
    assert found(extension, material, empty) == {}
    setattr(lamp, rays, False)
    messages = found(extension, material, empty)
    assert list(messages) == ["ray_visibility"] and "Lamp" in messages["ray_visibility"]
    lamp.hide_render = True
    assert found(extension, material, empty) == {}


# ---- AOVs, which OSL leaves black ----------------------------------------------------------------


def write_aov(tree, name):
    node = tree.nodes.new("ShaderNodeOutputAOV")
    node.aov_name = name
    node.inputs["Color"].default_value = (0.2, 0.4, 0.6, 1)
    return node


def test_aovs_are_black_under_osl(extension, empty):
    """This also affects materials that do not use this extension."""
    material = bpy.data.materials.new("diffuse")
    write_aov(helpers.empty_tree(material), "ID")
    empty.view_layers[0].aovs.add().name = "ID"
    helpers.sphere_scene(empty, material, size=8, samples=1)
    for osl, seen in ((False, (0.2, 0.4, 0.6)), (True, (0, 0, 0))):
        empty.cycles.shading_system = osl
        assert helpers.render_passes(empty)["ID"][4, 4, :3] == pytest.approx(seen, abs=1e-6)


def in_the_material(material):
    write_aov(material.node_tree, "ID")


def in_another_one(material):
    write_aov(helpers.empty_tree(bpy.data.materials.new("other")), "ID")


def in_a_group(material):
    group = bpy.data.node_groups.new("group", "ShaderNodeTree")
    write_aov(group, "ID")
    material.node_tree.nodes.new("ShaderNodeGroup").node_tree = group


def in_the_world(material):
    write_aov(helpers.add_world(bpy.context.scene)[0], "ID")


def test_osl_is_missed_only_where_a_material_needs_it(extension, empty):
    api = extension.api
    empty.render.engine, empty.cycles.shading_system = "CYCLES", False
    api.new_material("ward")
    assert api.scene_warnings(empty) == []
    api.new_material("ward", "aimed")
    assert [f.code for f in api.scene_warnings(empty)] == ["osl_off"]


@pytest.mark.parametrize("write", [in_the_material, in_another_one, in_a_group, in_the_world])
def test_black_aovs_are_a_finding(extension, empty, write):
    api = extension.api
    material = ball(extension, empty)
    layer = empty.view_layers[0]
    layer.aovs.add().name = "ID"
    layer.aovs.add().name = "nothing writes it"
    assert found(extension, material, empty) == {}
    write(material)
    messages = found(extension, material, empty)
    assert list(messages) == ["black_aovs"] and "black (ID)" in messages["black_aovs"]
    assert [f.severity for f in api.warnings(material, empty)] == ["WARNING"]
    assert [f.code for f in api.scene_warnings(empty)] == ["black_aovs"]
    empty.cycles.shading_system = False
    assert [f.code for f in api.scene_warnings(empty)] == ["osl_off"]
    empty.cycles.shading_system = True
    layer.aovs.remove(layer.aovs[0])
    assert found(extension, material, empty) == {}


def test_turning_osl_on_says_that_aovs_will_be_black(extension, empty, capfd):
    material = ball(extension, empty)
    in_the_material(material)
    empty.view_layers[0].aovs.add().name = "ID"
    empty.cycles.shading_system = False
    capfd.readouterr()
    assert bpy.ops.brdfc.enable_osl() == {"FINISHED"}
    assert "Cycles leaves AOVs black (ID)" in "".join(capfd.readouterr())


# ---- the console ---------------------------------------------------------------------------------


def test_a_render_without_osl_says_so_once(extension, empty, capsys, monkeypatch):
    """It names the material and its error: a twin with 15 %; glass, whose error is unknown; and
    lean materials, which have no stand-in."""
    material = ball(extension, empty, "phong", "aimed")
    light_of(empty, 1)
    assert "brdfc: " not in capsys.readouterr().out
    empty.cycles.shading_system = False
    light_of(empty, 1)
    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith("brdfc: ")]
    stands_in = "Blender's own nodes stand in, error 15 %: Phong"
    assert said == [f"brdfc: Open Shading Language is off: {stands_in}"]
    empty.cycles.shading_system = True
    console = import_module(f"{extension.package}.warnings.console")
    monkeypatch.setattr(extension.device, "gpu_backend", lambda: "CUDA")
    empty.cycles.device = "GPU"
    glass = extension.api.new_material("glass", "exact")
    lean = extension.api.new_material("lambert", "exact")
    (node,) = extension.model_nodes.group_nodes(lean)
    node.node_tree.nodes.remove(node.node_tree.nodes["Runs"])
    for made in (glass, lean):
        bpy.data.objects["Sphere"].data.materials.append(made)
    console._before_render(empty)
    assert capsys.readouterr().out == (
        f"brdfc: CUDA devices can't run these shaders: {stands_in}\n"
        "brdfc: CUDA devices can't run these shaders: Blender's own nodes stand in: Glass\n"
        "brdfc: CUDA devices can't run these shaders: Lambert will be black\n"
    )
    for made in (material, glass, lean):
        made.user_clear()
    bpy.data.objects["Sphere"].data.materials.clear()
    console._before_render(empty)
    assert capsys.readouterr().out == ""
