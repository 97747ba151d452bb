# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion of nodes inside the user's node groups, and back."""

import bpy
import helpers
import numpy as np
import pytest
from converting import KINDS, OUTPUT, flat, keyed, material_of, only, picture_node

RED, BLUE = (0.8, 0.1, 0.1), (0.1, 0.2, 0.8)


def group_of(kind, name="Paint", distribution="GGX", inputs=(), **values):
    """A node group with one shader; `inputs`: the names of its sockets that inputs of the group
    control."""
    tree = bpy.data.node_groups.new(name, "ShaderNodeTree")
    tree.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    node, begin = tree.nodes.new(KINDS[kind]), tree.nodes.new("NodeGroupInput")
    end = tree.nodes.new("NodeGroupOutput")
    if hasattr(node, "distribution"):
        node.distribution = distribution
    kinds = {"RGBA": "NodeSocketColor", "VECTOR": "NodeSocketVector"}
    for socket in inputs:
        kind_of_socket = kinds.get(node.inputs[socket].type, "NodeSocketFloat")
        made = tree.interface.new_socket(socket, in_out="INPUT", socket_type=kind_of_socket)
        made.hide_value = kind_of_socket == "NodeSocketVector"
        tree.links.new(begin.outputs[socket], node.inputs[socket])
    for socket, value in values.items():
        given = (*value, 1.0) if isinstance(value, tuple) else value
        node.inputs[socket.replace("_", " ")].default_value = given
    tree.links.new(node.outputs[0], end.inputs[0])
    return tree, node


def user_of(tree, name="Car", **values):
    """A material whose surface is a node group; returns its group node as well."""
    material = bpy.data.materials.new(name)
    own = helpers.empty_tree(material)
    node, output = own.nodes.new("ShaderNodeGroup"), own.nodes.new(OUTPUT)
    node.node_tree = tree
    own.links.new(node.outputs[0], output.inputs["Surface"])
    for socket, value in values.items():
        given = (*value, 1.0) if isinstance(value, tuple) else value
        node.inputs[socket.replace("_", " ")].default_value = given
    return material, node


def nested_in(tree, name):
    """A node group that contains another one."""
    outer = bpy.data.node_groups.new(name, "ShaderNodeTree")
    outer.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    node, end = outer.nodes.new("ShaderNodeGroup"), outer.nodes.new("NodeGroupOutput")
    node.node_tree = tree
    outer.links.new(node.outputs[0], end.inputs[0])
    return outer, node


def models_in(extension, tree):
    return [node for node in tree.nodes if extension.model_nodes.is_ours(node)]


def test_a_node_in_a_group_is_converted_for_all_materials(extension, convert):
    tree, node = group_of("principled", inputs=["Base Color", "Roughness"])
    car, _ = user_of(tree, "Car", Base_Color=RED, Roughness=0.3)
    bike, _ = user_of(tree, "Bike", Base_Color=BLUE, Roughness=0.6)
    plan = only(extension.api.plan_conversion([car, bike]))
    assert not plan.refusal and plan.node == node and plan.others == (bike,)
    assert plan.line().startswith("Car, Principled BSDF in Paint: Microfacet over Lambert, ")
    assert plan.line().endswith(". It changes Bike too")
    before = {n.name for n in tree.nodes}
    assert extension.api.convert_materials([plan]) == 1
    gloss, base = models_in(extension, tree)
    begin = next(n for n in tree.nodes if n.bl_idname == "NodeGroupInput")
    (link,) = extension.model_nodes.sockets(base)["rho"].links
    assert (link.from_node, link.from_socket.name) == (begin, "Base Color")
    assert extension.model_nodes.varying(gloss) == {"ax", "ay"} and not node.outputs[0].is_linked
    for material in (car, bike):
        assert extension.model_nodes.group_nodes(material) == [gloss, base]
        assert extension.model_nodes.shown_nodes(material) == [gloss, base]
        assert not extension.api.plan_conversion([material])
        assert extension.api.warnings(material, bpy.context.scene) is not None
    # Of one material, for all.
    assert extension.api.convert_back(bike) == 1
    assert not extension.model_nodes.group_nodes(car) and {n.name for n in tree.nodes} == before
    assert not [g for g in bpy.data.node_groups if extension.model_nodes.TAG in g]


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize("osl", [False, True])
@pytest.mark.parametrize("distribution", ["GGX", "MULTI_GGX"])
def test_pictures_of_a_group_are_as_before(extension, convert, empty, distribution, osl):
    """In a white world, of two materials, one of which has a bent normal and a picture."""
    names = ["Base Color", "Roughness", "Metallic", "Alpha", "Normal"]
    tree, _ = group_of("principled", distribution=distribution, inputs=names)
    plain = {"Base_Color": RED, "Roughness": 0.5, "Metallic": 0.0, "Alpha": 1.0}
    car, _ = user_of(tree, "Car", **plain)
    bike, node = user_of(tree, "Bike", **(plain | {"Metallic": 1.0, "Alpha": 0.7}))
    own = bike.node_tree
    bent = own.nodes.new("ShaderNodeCombineXYZ")
    for i, value in enumerate((0.3, -0.8, 0.5)):
        bent.inputs[i].default_value = value
    own.links.new(bent.outputs[0], node.inputs["Normal"])
    picture = picture_node(own, (0.9, 0.6, 0.2), (0.4, 0.9, 1.0))
    own.links.new(picture.outputs["Color"], node.inputs["Base Color"])
    before = [flat(empty, m) for m in (car, bike)]
    if osl:
        extension.api.enable_osl(empty)
    plan = only(extension.api.plan_conversion([bike]))
    assert plan.metal and plan.transparent and not plan.unused, plan.line()
    assert extension.api.convert_materials([plan]) == 1
    after = [flat(empty, m) for m in (car, bike)]
    print(f"{before}\n{after}")
    assert np.array(after) == pytest.approx(np.array(before), rel=0.02, abs=0.005)
    assert extension.api.convert_back(car) == 1
    assert np.array([flat(empty, m) for m in (car, bike)]) == pytest.approx(
        np.array(before), rel=1e-3
    )


METAL = {"Metallic": 1.0, "Roughness": 0.5}
FORMS = [
    *(
        ("diffuse", "Color", {"Roughness": 0.5}, form)
        for form in ("nodes", "exact", "sampled", "fitted", "twin")
    ),
    *(("principled", "Base Color", METAL, form) for form in ("nodes", "aimed", "sampled")),
]


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize(("kind", "color", "values", "form"), FORMS)
def test_every_form_works_in_a_group(extension, convert, empty, kind, color, values, form):
    """With a normal and a colour that inputs of the group control, the normal without a link: as
    the same model outside."""
    tree, _ = group_of(kind, inputs=[color, "Normal"], **values)
    color = {color.replace(" ", "_"): RED}
    inside, _ = user_of(tree, "Inside", **color)
    outside, _ = material_of(kind, "GGX" if kind == "principled" else None, **color, **values)
    extension.api.enable_osl(empty)
    plans = extension.api.plan_conversion([inside, outside])
    assert extension.api.convert_materials(plans) == 2
    for material in (inside, outside):
        extension.api.switch_representation(material, form)
        (node,) = extension.model_nodes.group_nodes(material)
        assert extension.model_nodes.identity(node).form == form
    seen = [np.array(flat(empty, m)) for m in (inside, outside)]
    print(seen)
    assert seen[0] == pytest.approx(seen[1], rel=2e-3)


def test_constants_have_to_agree_in_all_materials(extension, convert):
    tree, _ = group_of("principled", inputs=["IOR", "Coat Weight", "Metallic"])
    car, _ = user_of(tree, "Car", IOR=1.5, Coat_Weight=0.0, Metallic=0.0)
    bike, group = user_of(tree, "Bike", IOR=1.5, Coat_Weight=0.0, Metallic=0.0)
    plan = only(convert.plan([car]))
    assert not plan.refusal and not plan.metal and plan.unused == ("Metallic", "IOR", "Coat Weight")
    assert plan.line().endswith(
        ". It changes Bike too. Inputs of the group without effect: Metallic, IOR, Coat Weight"
    )
    group.inputs["Metallic"].default_value = 1.0
    with pytest.raises(ValueError, match="Metallic is another one"):
        convert.apply([plan])
    plan = only(convert.plan([car]))
    assert plan.metal and plan.unused == ("IOR", "Coat Weight")
    group.inputs["IOR"].default_value = 1.6
    assert only(convert.plan([car])).refusal == "IOR is linked, and converts only as one value"
    group.inputs["IOR"].default_value = 1.5
    group.inputs["Coat Weight"].default_value = 0.5
    plan = only(convert.plan([car]))
    assert not plan.refusal and plan.uppers and "Coat Weight" not in plan.unused
    group.inputs["Coat Weight"].default_value = 0.0
    # A second node of the same material counts as well; what nothing shows does not.
    bike.node_tree.links.clear()
    assert not only(convert.plan([car])).refusal


def test_the_error_is_that_of_the_colours_of_all_materials(extension, convert):
    tree, _ = group_of("principled", inputs=["Base Color"], Roughness=0.5)
    users = [user_of(tree, Base_Color=(c, c, c))[0] for c in (0.0, 0.8)]
    plan = only(convert.plan(users[:1]))
    same = [
        only(convert.plan([material_of("principled", "GGX", Base_Color=(c,) * 3)[0]]))
        for c in (0.0, 0.8)
    ]
    assert plan.error == pytest.approx(same[0].error, rel=0.05)
    assert plan.least_error == pytest.approx(same[1].error, rel=0.05)


def test_nested_groups_that_are_used_twice(extension, convert, empty):
    inner, node = group_of("glossy", "Inner", inputs=["Color"], Roughness=0.4)
    inner.interface.items_tree["Color"].default_value = (*RED, 1.0)
    outer, one = nested_in(inner, "Outer")
    two = outer.nodes.new("ShaderNodeGroup")
    two.node_tree = inner
    two.inputs["Color"].default_value = (*BLUE, 1.0)
    one.inputs["Color"].default_value = (*RED, 1.0)
    mix = outer.nodes.new("ShaderNodeMixShader")
    end = next(n for n in outer.nodes if n.bl_idname == "NodeGroupOutput")
    outer.links.new(one.outputs[0], mix.inputs[1])
    outer.links.new(two.outputs[0], mix.inputs[2])
    outer.links.new(mix.outputs[0], end.inputs[0])
    material, _ = user_of(outer, "Grouped")
    before = np.array(flat(empty, material))
    plan = only(extension.api.plan_conversion([material]))
    assert plan.line().startswith("Grouped, Glossy BSDF in Inner: Microfacet")
    assert not plan.others and plan.node == node
    extension.api.enable_osl(empty)
    assert extension.api.convert_materials([plan]) == 1
    (model,) = models_in(extension, inner)
    assert extension.model_nodes.group_nodes(material) == [model]
    assert np.array(flat(empty, material)) == pytest.approx(before, rel=0.02)
    assert extension.api.convert_back(material) == 1
    assert np.array(flat(empty, material)) == pytest.approx(before, rel=1e-3)


def test_bump_map_correction_is_that_of_each_material(extension, convert):
    """Where it was off before, it is off after the way back."""
    tree, _ = group_of("principled", Roughness=0.0, Metallic=1.0)
    users = [user_of(tree, name)[0] for name in ("Car", "Bike", "Boat")]
    users[1].cycles.use_bump_map_correction = False
    assert extension.api.convert_materials(extension.api.plan_conversion(users[:1])) == 1
    extension.api.switch_representation(users[0], "fitted")
    assert [m.cycles.use_bump_map_correction for m in users] == [False, False, False]
    assert extension.api.convert_back(users[2]) == 1
    assert [m.cycles.use_bump_map_correction for m in users] == [True, False, True]


def test_buttons_find_the_nodes_of_groups(extension, convert, empty):
    """Nodes of one name, in the material and in its group."""
    tree, _ = group_of("glossy", Roughness=0.4, Color=BLUE)
    material, group = user_of(tree)
    own = material.node_tree
    outside = extension.nodes.add_group_node(own, "lambert")
    assert extension.api.convert_materials(extension.api.plan_conversion([material])) == 1
    (inside,) = models_in(extension, tree)
    group.name = "Paint"
    inside.name = outside.name = "Group"
    bpy.context.view_layer.objects.active = helpers.add_sphere(empty, material)
    layout = helpers.Layout()
    extension.ui.draw_material(layout, material, empty)
    assert (
        extension.model_nodes.key(inside) == "Paint/Group"
        and extension.model_nodes.key(outside) == "Group"
    )
    assert bpy.ops.brdfc.switch(node="Paint/Group", representation="sampled") == {"FINISHED"}
    assert extension.model_nodes.identity(inside).form == "sampled"
    assert extension.model_nodes.identity(outside).form != "sampled"


def test_panel_lamps_and_lists_know_the_models_of_groups(extension, convert, empty):
    # Without a tint the model would be a closure of Cycles, which aims at nothing.
    look = {"Metallic": 1.0, "Roughness": 0.3, "Specular_Tint": (0.9, 0.9, 0.9)}
    tree, _ = group_of("principled", inputs=["Base Color"], **look)
    users = [user_of(tree, name, Base_Color=RED)[0] for name in ("Car", "Bike")]
    for user in users:
        helpers.add_sphere(empty, user)
    helpers.add_lamp(empty, "POINT", "Bulb", location=(2, -2, 3), shadow_soft_size=0.1)
    extension.api.enable_osl(empty)
    assert extension.api.convert_materials(extension.api.plan_conversion(users)) == 1
    (node,) = models_in(extension, tree)
    assert [lamp.slot for lamp in extension.api.see_lamps(empty)] == [1]
    for user in users:
        layout = helpers.Layout()
        extension.ui.draw_material(layout, user, empty)
        assert any("Free of noise under Bulb" in line for line in layout.log)
        assert any(line.startswith("operator brdfc.convert_back") for line in layout.log)
        assert extension.api.get_parameters(user)["ax"] == pytest.approx(0.09)
        entry = extension.api.used_materials()[user.name]
        assert entry["model"] == "microfacet" and entry["parameters"]["f0"] == {"varies": True}
    empty.cycles.use_guiding = True
    codes = [[found.code for found in extension.api.warnings(m, empty)] for m in users]
    assert codes[0] == codes[1] and "path_guiding" in codes[0]
    # A parameter of both.
    extension.api.set_parameters(users[0], ax=0.2)
    assert extension.api.get_parameters(users[1])["ax"] == pytest.approx(0.2)
    copy = users[0].copy()
    assert extension.model_nodes.group_nodes(copy) == [node]


def test_a_group_of_a_library_stays_and_is_said(extension, convert, tmp_path):
    tree, _ = group_of("principled")
    tree.use_fake_user = True
    path = str(tmp_path / "paints.blend")
    bpy.data.libraries.write(path, {tree})
    bpy.data.node_groups.remove(tree)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.node_groups = ["Paint"]
    material, node = user_of(wanted.node_groups[0])
    plan = only(extension.api.plan_conversion([material]))
    assert (
        plan.refusal
        == f"'Paint' is linked from {node.node_tree.library.filepath}: Make Local first"
    )
    assert extension.api.convert_materials([plan]) == 0
    extension.api.make_local(material)
    plan = only(extension.api.plan_conversion([material]))
    assert extension.api.convert_materials([plan]) == 1


def test_an_animated_input_of_a_group_stays_linked(extension, convert):
    tree, _ = group_of("principled", inputs=["Roughness"])
    material, node = user_of(tree, Roughness=0.4)
    keyed(node.inputs["Roughness"])
    assert convert.apply(convert.plan([material])) == 1
    gloss, _ = models_in(extension, tree)
    assert extension.model_nodes.varying(gloss) == {"ax", "ay"}


def test_a_saved_file_has_the_models_of_a_group(extension, convert, empty, tmp_path):
    tree, _ = group_of("principled", inputs=["Base Color"], Roughness=0.5)
    material, _ = user_of(tree, "Car", Base_Color=RED)
    before = np.array(flat(empty, material))
    assert extension.api.convert_materials(extension.api.plan_conversion([material])) == 1
    path = str(tmp_path / "car.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    scene, material = bpy.context.scene, bpy.data.materials["Car"]
    for osl in (True, False):
        scene.cycles.shading_system = osl
        extension.api.follow_settings(scene)
        ours = extension.model_nodes.group_nodes(material)
        assert len(ours) == 2 and all(map(extension.model_nodes.runs_anywhere, ours)) != osl
        assert np.array(flat(scene, material)) == pytest.approx(before, rel=0.02, abs=0.005)
    assert extension.api.convert_back(material) == 1
    assert np.array(flat(scene, material)) == pytest.approx(before, rel=1e-3)


def test_a_lean_group_is_that_of_all_materials(extension, convert, empty, by_the_tool):
    """The plan lists the model for each material; it is baked once."""
    tree, _ = group_of("principled", inputs=["Base Color"], Metallic=1.0, Roughness=0.3)
    users = [user_of(tree, name, Base_Color=RED)[0] for name in ("Car", "Bike")]
    extension.api.enable_osl(empty)
    assert extension.api.convert_materials(extension.api.plan_conversion(users)) == 1
    (node,) = models_in(extension, tree)
    plan = extension.api.plan()
    assert set(plan.materials) == {"Car", "Bike"}
    assert extension.api.bake(plan) == 1 and extension.model_nodes.is_baked(node)
    assert extension.api.convert_back(users[1]) == 1 and not models_in(extension, tree)


def test_a_linked_material_with_a_converted_group_becomes_local(
    extension, convert, empty, tmp_path
):
    tree, _ = group_of("principled", inputs=["Base Color"], Metallic=1.0, Roughness=0.3)
    material, _ = user_of(tree, "Car", Base_Color=RED)
    before = np.array(flat(empty, material))
    assert extension.api.convert_materials(extension.api.plan_conversion([material])) == 1
    path = str(tmp_path / "car.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    extension.scene_loader.apply_clean_settings(scene)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.materials = ["Car"]
    (linked,) = wanted.materials
    with pytest.raises(ValueError, match="Make Local first"):
        extension.api.convert_back(linked)
    local = extension.api.make_local(linked)
    for osl in (False, True):
        scene.cycles.shading_system = osl
        extension.api.follow_settings(scene)
        (node,) = extension.model_nodes.group_nodes(local)
        assert node.id_data.library is None and node.node_tree.library is None
        assert extension.model_nodes.runs_anywhere(node) != osl
        codes = {found.code for found in extension.api.scene_warnings(scene)}
        assert not codes
        assert np.array(flat(scene, local)) == pytest.approx(before, rel=0.02, abs=0.005)
    scene.render.engine = "BLENDER_WORKBENCH"
    assert "engine" in {found.code for found in extension.api.scene_warnings(scene)}
    scene.render.engine = "CYCLES"
    assert extension.api.convert_back(local) == 1
    assert np.array(flat(scene, local)) == pytest.approx(before, rel=1e-3)


def test_a_row_names_some_of_many_materials(convert):
    tree, _ = group_of("diffuse")
    users = [user_of(tree, f"M{i}")[0] for i in range(9)]
    plan = only(convert.plan(users))
    assert plan.line().endswith(". It changes M1, M2, M3, M4, M5, M6 and 2 more too")
    assert plan.materials == tuple(users)


def test_a_group_is_one_step_of_undo(extension, convert, empty):
    tree, node = group_of("principled", inputs=["Base Color"], Metallic=1.0)
    keyed(node.inputs["Roughness"])
    material, _ = user_of(tree, "Car", Base_Color=RED)
    ball = helpers.add_sphere(empty, material)
    ball.select_set(True)
    bpy.context.view_layer.objects.active = ball

    def state():
        tree = bpy.data.node_groups["Paint"]
        curve = tree.animation_data.action.layers[0].strips[0].channelbags[0].fcurves[0]
        shader = next(n for n in tree.nodes if n.bl_idname == "NodeGroupOutput").inputs[0]
        return curve.data_path, shader.links[0].from_node.bl_idname

    bpy.ops.ed.undo_push(message="Start")
    start = state()
    assert bpy.ops.brdfc.convert() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="Convert")
    converted = state()
    assert converted[0] != start[0] and converted[1] == "ShaderNodeGroup"
    assert bpy.ops.ed.undo() == {"FINISHED"}
    assert state() == start
    assert bpy.ops.ed.redo() == {"FINISHED"}
    assert state() == converted
    bpy.ops.ed.undo_push(message="Again")
    assert bpy.ops.brdfc.convert_back() == {"FINISHED"}
    assert state() == start
