# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans: animated parameters stay inputs; and a file that has changed since, or an invalid budget,
is an error that changes nothing."""

import math
from types import SimpleNamespace

import bpy
import helpers
import pytest
from helpers import add_lamp, add_sphere, counts, empty_tree, node_material


@pytest.fixture
def api(extension, empty, kept_program, monkeypatch):
    monkeypatch.setenv("BRDFC_TOOL", str(kept_program))
    return extension.api


def socket(extension, material, name="r0"):
    (node,) = extension.model_nodes.group_nodes(material)
    return extension.model_nodes.sockets(node)[name]


def key(socket, values=((1, 0.05), (10, 0.6))):
    for frame, value in values:
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    return socket.id_data.animation_data


def by_driver(socket):
    socket.driver_add("default_value").driver.expression = "0.05 + 0.55 * (frame - 1) / 9"


def by_strip(socket):
    data = key(socket)
    data.nla_tracks.new().strips.new("Keys", 1, data.action)
    data.action = None


def by_name(socket):
    """A path as scripts write it."""
    data = key(socket)
    (curve,) = data.action.layers[0].strips[0].channelbags[0].fcurves
    curve.data_path = f'{socket.node.path_from_id()}.inputs["{socket.name}"].default_value'


def by_the_material(socket):
    material = next(m for m in bpy.data.materials if m.node_tree == socket.id_data)
    action = bpy.data.actions.new("Of the material")
    slot = action.slots.new("MATERIAL", "Material")
    strip = action.layers.new("Layer").strips.new(type="KEYFRAME")
    path = f"node_tree.{socket.path_from_id('default_value')}"
    curve = strip.channelbag(slot, ensure=True).fcurves.new(path)
    for frame, value in ((1, 0.05), (10, 0.6)):
        curve.keyframe_points.insert(frame, value)
    data = material.animation_data_create()
    data.action, data.action_slot = action, slot


def seen_at(extension, material, name="r0"):
    values = []
    for frame in (1, 10):
        bpy.context.scene.frame_set(frame)
        bpy.context.view_layer.update()
        values.append(socket(extension, material, name).default_value)
    bpy.context.scene.frame_set(1)
    return values


@pytest.mark.many
@pytest.mark.parametrize("animate", [key, by_driver, by_strip, by_name, by_the_material])
def test_what_is_animated_stays_an_input_and_moves(extension, empty, api, animate):
    material = api.new_material("cook_torrance", "sampled", m=0.05)
    add_sphere(empty, material)  # Blender evaluates only what is used
    before = socket(extension, material, "m").path_from_id("default_value")
    animate(socket(extension, material, "m"))
    assert seen_at(extension, material, "m") == pytest.approx([0.05, 0.6], abs=1e-3)
    assert api.used_materials()[material.name]["parameters"]["m"] == {"varies": True}
    assert api.get_parameters(material)["m"] == pytest.approx(0.05)
    plan = api.plan()
    assert "without parameter m:" not in "\n".join(plan.lines())
    assert plan.explanation["models"][0]["free"] == ["m"]
    assert api.bake(plan) == 1
    assert socket(extension, material, "m").path_from_id("default_value") != before
    assert seen_at(extension, material, "m") == pytest.approx([0.05, 0.6], abs=1e-3)
    api.switch_representation(material, "aimed")
    assert seen_at(extension, material, "m") == pytest.approx([0.05, 0.6], abs=1e-3)


@pytest.mark.slow
def test_a_farm_renders_what_is_animated(extension, empty, api, tmp_path):
    """Frame 10 looks as before, with the same shader but fewer inputs, and without the
    extension."""
    api.enable_osl(empty)
    material = api.new_material("coupled", r0=0.05)
    key(socket(extension, material))
    helpers.sphere_scene(empty, material, size=16, samples=4)
    empty.frame_set(10)
    before = helpers.render(empty)
    empty.frame_set(1)
    first = helpers.render(empty)
    assert first[8, 8, :3].mean() / before[8, 8, :3].mean() < 0.98, "what r0 does is seen"
    assert api.bake(api.plan()) == 1
    empty.frame_set(10)
    assert helpers.render(empty) == pytest.approx(before, rel=1e-3)
    path = tmp_path / "lean.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    found = helpers.render_without_the_extension(path, 10, tmp_path)
    assert found == pytest.approx(before, rel=1e-3)


def test_a_muted_curve_can_be_unmuted_later(extension, empty, api):
    material = api.new_material("coupled", r0=0.3)
    add_sphere(empty, material)
    data = key(socket(extension, material))
    (curve,) = data.action.layers[0].strips[0].channelbags[0].fcurves
    curve.mute = True
    assert api.bake(api.plan()) == 1
    curve.mute = False
    assert seen_at(extension, material) == pytest.approx([0.05, 0.6])


def test_a_choice_that_is_driven_stays_one(extension, empty, api):
    material = api.new_material("ward")
    add_sphere(empty, material)
    choice = socket(extension, material, "normalisation")
    if choice.type == "MENU":
        pytest.skip("from Blender 5.0 a choice can't be animated")
    choice.driver_add("default_value").driver.expression = "1 if frame > 5 else 0"
    first, last = extension.pack.model("ward").parameters["normalisation"]["choices"][:2]
    assert api.bake(api.plan()) == 1
    for frame, expected in ((1, first), (10, last)):
        empty.frame_set(frame)
        bpy.context.view_layer.update()
        assert api.get_parameters(material)["normalisation"] == expected


def test_materials_that_share_an_action_keep_their_own_paths(extension, empty, api):
    first = api.new_material("cook_torrance", "sampled")
    key(socket(extension, first, "m"))
    second = first.copy()
    shared = first.node_tree.animation_data.action
    assert second.node_tree.animation_data.action == shared
    for material in (first, second):
        add_sphere(empty, material)
    assert api.bake(api.plan()) == 2
    for material in (first, second):
        assert seen_at(extension, material, "m") == pytest.approx([0.05, 0.6])
    api.switch_representation(first, "sampled")  # its sockets have other indices again
    for material in (first, second):
        assert seen_at(extension, material, "m") == pytest.approx([0.05, 0.6])


def test_a_form_for_one_value_is_none_for_what_is_animated(extension, api):
    material = api.new_material("lafortune", "aimed", cz=0.8)
    key(socket(extension, material, "cz"), ((1, 0.8), (10, 0.5), (20, 0.8)))
    with pytest.raises(ValueError, match="only for cz=0.8, not for a linked or animated value"):
        api.switch_representation(material, "fitted")


# ---- a file that has changed since ---------------------------------------------------------------


@pytest.fixture
def used(extension, empty, api):
    first = api.new_material("coupled", r0=0.05)
    second = api.new_material("phong", "aimed", e=40.0)
    return SimpleNamespace(extension=extension, api=api, scene=empty, first=first, second=second)


def link(used):
    value = used.first.node_tree.nodes.new("ShaderNodeValue")
    used.first.node_tree.links.new(value.outputs[0], socket(used.extension, used.first))


def two_nodes(used):
    tree = used.first.node_tree
    used.extension.nodes.add_group_node(tree, "lambert")


CHANGES = {
    "a value": (
        lambda used: used.api.set_parameters(used.first, r0=0.6),
        "'Coupled.*' has changed since the plan was made: r0 was 0.05 and is 0.6. Make a new plan",
    ),
    "a link": (link, "r0 was 0.05 and is linked or animated"),
    "animation": (lambda used: key(socket(used.extension, used.first)), "linked or animated"),
    "a form": (
        lambda used: used.api.switch_representation(used.first, "sampled"),
        "its render method was .* and is Sampled",
    ),
    "no material": (
        lambda used: bpy.data.materials.remove(used.first),
        "'Coupled.*' has changed since the plan was made: there is no such model any more",
    ),
    "no node": (
        lambda used: used.first.node_tree.nodes.clear(),
        "there is no such model any more",
    ),
    "another model": (
        lambda used: (
            used.first.node_tree.nodes.clear(),
            used.extension.nodes.add_group_node(used.first.node_tree, "lambert"),
        ),
        "it has another model",
    ),
    "a second node": (two_nodes, "there is no such model any more"),
    "a lamp": (
        lambda used: add_lamp(used.scene, energy=1000.0),
        "The lamps have changed since the plan was made: there were 0 and there are 1",
    ),
    "baked": (lambda used: used.api.bake(used.api.plan()), "it has another shader"),
}


def groups():
    return {
        (material.name, node.name): node.node_tree
        for material in bpy.data.materials
        for node in material.node_tree.nodes
        if node.bl_idname == "ShaderNodeGroup"
    }


@pytest.mark.many
@pytest.mark.parametrize("change", CHANGES)
def test_a_stale_plan_is_refused_and_nothing_changes(used, change):
    apply, said = CHANGES[change]
    plan = used.api.plan()
    apply(used)
    before = counts(), groups()
    with pytest.raises(ValueError, match=said):
        used.api.bake(plan)
    assert (counts(), groups()) == before


def test_what_changes_while_it_is_baked_is_seen(used):
    job = used.api.start_bake(used.api.plan())
    before = groups()
    assert job.step() is not None
    used.api.set_parameters(used.second, e=41.0)
    with pytest.raises(ValueError, match="e was 40 and is 41"):
        job.wait()
    assert groups() == before


def test_an_albedo_output_does_not_age_a_plan(used):
    plan = used.api.plan()
    used.api.add_albedo(used.first)
    node, tree = socket(used.extension, used.first).node, used.first.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(node.outputs["Albedo"], emission.inputs["Color"])
    bpy.data.materials.new("Another")
    assert used.api.bake(plan) == 2
    assert emission.inputs["Color"].is_linked


def test_models_of_one_name_in_two_groups_are_two(extension, api):
    """Each keeps its value."""
    material = bpy.data.materials.new("Groups")
    tree, inner = empty_tree(material), []
    for r0 in (0.1, 0.3):
        group = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
        inner.append(extension.nodes.add_group_node(group, "coupled"))
        extension.model_nodes.set_value(inner[-1], "r0", r0)
        tree.nodes.new("ShaderNodeGroup").node_tree = group
    assert len({node.name for node in inner}) == 1
    listed = api.used_materials()
    assert [entry["parameters"]["r0"] for entry in listed.values()] == [0.1, 0.3]
    assert len(listed) == 2
    assert api.bake(api.plan()) == 2
    found = [extension.model_nodes.get_value(node, "r0") for node in inner]
    assert found == pytest.approx([0.1, 0.3])


@pytest.fixture
def native(api):
    material = node_material("ShaderNodeBsdfDiffuse")
    material.name = "Native"
    return material, material.node_tree.nodes["Diffuse BSDF"]


def paint(material, node):
    node.inputs["Color"].default_value = (0.1, 0.2, 0.9, 1)


def link_color(material, node):
    color = material.node_tree.nodes.new("ShaderNodeRGB")
    material.node_tree.links.new(color.outputs[0], node.inputs["Color"])


def animate_color(material, node):
    node.inputs["Color"].keyframe_insert("default_value", frame=1)


@pytest.mark.parametrize(
    "change, said",
    [
        (paint, "'Native' has changed since the plan was made: Color"),
        (link_color, "'Native' has changed since the plan was made: Color"),
        (animate_color, "'Native' has changed since the plan was made: Color"),
        (lambda m, n: m.node_tree.nodes.remove(n), "there is no such node any more"),
        (lambda m, n: bpy.data.materials.remove(m), "'Native' .*: there is no such node any more"),
        (lambda m, n: m.node_tree.links.clear(), "nothing shows the node"),
    ],
)
def test_a_stale_conversion_is_refused_and_nothing_changes(api, native, change, said):
    plans = api.plan_conversion([native[0]])
    change(*native)
    before = counts()
    with pytest.raises(ValueError, match=said):
        api.convert_materials(plans)
    assert counts() == before


def test_a_conversion_is_done_once(api, native):
    plans = api.plan_conversion([native[0]])
    assert api.convert_materials(plans) == 1
    with pytest.raises(ValueError, match="nothing shows the node"):
        api.convert_materials(plans)


def test_a_refused_conversion_is_no_good_one(api, native):
    material, node = native
    other = material.node_tree.nodes.new("ShaderNodeBsdfGlass")
    other.inputs["Roughness"].default_value = 0.5
    shader = material.node_tree.nodes.new("ShaderNodeMixShader")
    material.node_tree.links.new(node.outputs[0], shader.inputs[1])
    material.node_tree.links.new(other.outputs[0], shader.inputs[2])
    output = material.node_tree.nodes["Material Output"]
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    plans = sorted(api.plan_conversion([material]), key=lambda plan: plan.error)
    assert [bool(plan.refusal) for plan in plans] == [False, True]
    assert plans[-1].error == math.inf


# ---- what is none --------------------------------------------------------------------------------


@pytest.mark.slow
def test_budgets_are_those_of_the_program(api):
    api.new_material("phong", e=40.0)
    taken = api.plan(error=5).materials
    assert [entry["representation"] for entry in taken.values()] == ["auto"]
    for budget in ({"error": "5%"}, {"error": "5"}):
        explained = api.plan(**budget).explanation
        assert explained == api.plan(error=5).explanation
    assert api.plan(time="1.2x").explanation == api.plan(time=1.2).explanation


@pytest.mark.parametrize("given", ["5x", "", "much", -1, 101, math.nan, True, [5]])
def test_another_error_is_said_before_a_program_is_missed(api, monkeypatch, tmp_path, given):
    monkeypatch.setenv("BRDFC_TOOL", str(tmp_path / "absent"))
    with pytest.raises(ValueError, match="error: expected percent from 0 to 100, as 5 or '5%'"):
        api.plan(error=given)


@pytest.mark.parametrize("given", ["5%", "x", 0, -1.2, math.inf, math.nan, False, (1, 2)])
def test_another_time_is_said_before_a_program_is_missed(api, monkeypatch, tmp_path, given):
    monkeypatch.setenv("BRDFC_TOOL", str(tmp_path / "absent"))
    with pytest.raises(ValueError, match="time: expected a positive number, as 1.2 or '1.2x'"):
        api.plan(time=given)


def test_what_no_function_takes_is_said(api, tmp_path):
    import numpy as np

    glass = api.new_material("fresnel_dielectric")
    for given in ("x", None, np.array([0.2, 0.5]), [0.2]):
        with pytest.raises(ValueError, match=r"cos_theta_o: expected a number in \(0, 1\]"):
            api.albedo("phong", given)
    assert api.albedo("phong", np.float32(0.5)) == api.albedo("phong", 0.5)
    for given in (None, 3):
        with pytest.raises(ValueError, match=f"expected the name of a substance .* got {given}"):
            api.set_substance(glass, given)
    file = tmp_path / "absent" / "x.json"
    with pytest.raises(OSError) as refused:
        api.write_materials(file)
    assert str(refused.value) == f"{file} can't be written: No such file or directory"
