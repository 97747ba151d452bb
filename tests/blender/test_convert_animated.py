# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion of nodes with animated and driven values, and back."""

import bpy
import helpers
import numpy as np
import pytest
from converting import driven, flat, material_of, only, played

RED, BLUE = (0.8, 0.1, 0.1, 1.0), (0.1, 0.2, 0.8, 1.0)


def keys(socket, *values):
    """One key per value, at frames 1, 11, ..."""
    for i, value in enumerate(values):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=1 + 10 * i)


def curves(tree):
    """{data path: [keys or expression]} of what animates a tree."""
    data, found = tree.animation_data, {}
    actions = [(data.action, data.action_slot)] if data and data.action else []
    strips = [strip for track in data.nla_tracks for strip in track.strips] if data else []
    for action, slot in actions + [(strip.action, strip.action_slot) for strip in strips]:
        for layer in action.layers:
            for bag in (b for strip in layer.strips for b in strip.channelbags if b.slot == slot):
                for curve in bag.fcurves:
                    points = [tuple(point.co) for point in curve.keyframe_points]
                    found[curve.data_path, curve.array_index] = points
    for curve in data.drivers if data else ():
        found[curve.data_path, curve.array_index] = curve.driver.expression
    return found


def at_frames(scene, material, frames=(1, 6, 11)):
    seen = []
    for frame in frames:
        scene.frame_set(frame)
        seen.append(flat(scene, material))
    return np.array(seen)


def color_of_metal(node):
    """One parameter of one model."""
    node.inputs["Metallic"].default_value = 1.0
    keys(node.inputs["Base Color"], RED, BLUE)


def roughness(node):
    """Two parameters, by formulas."""
    keys(node.inputs["Roughness"], 0.2, 0.9)


def metallic(node):
    """The factor of a Mix Shader."""
    keys(node.inputs["Metallic"], 0.0, 1.0)


def alpha_and_emission(node):
    keys(node.inputs["Alpha"], 1.0, 0.2)
    keys(node.inputs["Emission Strength"], 0.0, 0.5)
    keys(node.inputs["Emission Color"], RED, BLUE)


def a_driver(node):
    driven(node.inputs["Roughness"])


def a_strip(node):
    node.inputs["Metallic"].default_value = 1.0
    played(node.inputs["Base Color"])


CHANGES = [color_of_metal, roughness, metallic, alpha_and_emission, a_driver, a_strip]


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize("distribution", ["GGX", "MULTI_GGX"])
@pytest.mark.parametrize("change", CHANGES)
def test_pictures_of_what_is_animated_are_as_before(
    extension, convert, empty, change, distribution
):
    material, node = material_of("principled", distribution, Base_Color=RED[:3], Roughness=0.5)
    tree = material.node_tree
    change(node)
    before, animated, names = at_frames(empty, material), curves(tree), {n.name for n in tree.nodes}
    extension.api.enable_osl(empty)
    plan = only(extension.api.plan_conversion([material], limit=1))
    print(plan.line())
    assert animated and not plan.refusal
    assert extension.api.convert_materials([plan]) == 1
    moved = curves(tree)
    assert sorted(map(str, moved.values())) == sorted(map(str, animated.values()))
    assert not any(f'"{node.name}"' in path for path, _ in moved)
    after = at_frames(empty, material)
    print(f"{before}\n{after}")
    assert after == pytest.approx(before, rel=0.03, abs=0.02)
    assert extension.api.convert_back(material) == 1
    assert curves(tree) == animated and {n.name for n in tree.nodes} == names
    assert at_frames(empty, material) == pytest.approx(before, rel=1e-3)


def test_what_a_curve_alone_controls_is_a_parameter(extension, convert):
    """Not a node in front of it, which would grey the panel's slider out. Other forms keep it."""
    material, node = material_of("principled", "GGX", Metallic=1.0)
    color_of_metal(node)
    assert convert.apply(convert.plan([material])) == 1
    (group,) = extension.model_nodes.group_nodes(material)
    assert extension.model_nodes.varying(group) == {"f0"} and not group.inputs[0].is_linked
    extension.api.switch_representation(material, "sampled")
    assert extension.model_nodes.varying(group) == {"f0"}
    assert convert.restore(material) == 1
    assert all(f'"{node.name}"' in path for path, _ in curves(material.node_tree))


def test_glass_keeps_the_keys_of_its_index(extension, convert):
    material, node = material_of("glass", Color=(1.0, 1.0, 1.0))
    keys(node.inputs["IOR"], 1.3, 1.7)
    assert convert.apply(convert.plan([material])) == 1
    (group,) = extension.model_nodes.group_nodes(material)
    assert extension.model_nodes.varying(group) == {"ior"}
    assert [len(points) for points in curves(material.node_tree).values()] == [2]


@pytest.mark.slow
def test_an_action_of_two_materials_becomes_two(extension, convert, empty):
    """A copy of a material shares its action: the copy that is not converted keeps its own."""
    material, node = material_of("principled", "GGX", Metallic=1.0)
    color_of_metal(node)
    copy = material.copy()
    other = copy.node_tree
    shared = material.node_tree.animation_data.action
    assert other.animation_data.action == shared
    before = curves(other)
    assert convert.apply(convert.plan([material])) == 1
    assert material.node_tree.animation_data.action != shared == other.animation_data.action
    assert curves(other) == before != curves(material.node_tree)
    for user in (material, copy):
        seen = at_frames(empty, user, (1, 11))
        assert seen[0, 0, 0] > 2 * seen[0, 0, 2] and 2 * seen[1, 0, 0] < seen[1, 0, 2]


def test_keys_of_a_material_itself_move_as_well(extension, convert):
    """As files of old versions have them: the curves stand at the material, not at its tree."""
    material, node = material_of("principled", "GGX", Metallic=1.0)
    data, action = material.animation_data_create(), bpy.data.actions.new("Old")
    data.action, data.action_slot = action, action.slots.new("MATERIAL", "Old")
    strip = action.layers.new("Layer").strips.new(type="KEYFRAME")
    path = 'node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value'
    curve = strip.channelbag(data.action_slot, ensure=True).fcurves.new(path)
    curve.keyframe_points.insert(1, 0.5)
    assert convert.apply(convert.plan([material])) == 1
    (group,) = extension.model_nodes.group_nodes(material)
    assert extension.model_nodes.varying(group) == {"f0"}
    assert convert.restore(material) == 1
    assert all(
        path.startswith('node_tree.nodes["Principled BSDF"]') for path, _ in curves(material)
    )


def test_a_driver_that_reads_what_moves_reads_it_at_its_new_place(extension, convert, empty):
    """One of the same nodes; and back."""
    material, node = material_of("principled", "GGX", Metallic=1.0)
    helpers.add_sphere(empty, material)  # so that Blender evaluates it
    tree = material.node_tree
    keys(node.inputs["Base Color"], RED, BLUE)
    reader = tree.nodes.new("ShaderNodeValue").outputs[0]
    driver = reader.driver_add("default_value").driver
    driver.type = "AVERAGE"
    target = driver.variables.new().targets[0]
    target.id_type, target.id = "MATERIAL", material
    path = node.inputs["Base Color"].path_from_id("default_value")
    target.data_path = before = f"node_tree.{path}[2]"

    def seen(frame):
        empty.frame_set(frame)
        return reader.default_value

    assert [seen(1), seen(11)] == pytest.approx([RED[2], BLUE[2]])
    assert convert.apply(convert.plan([material])) == 1
    assert target.data_path != before
    assert [seen(1), seen(11)] == pytest.approx([RED[2], BLUE[2]])
    assert convert.restore(material) == 1
    assert target.data_path == before
    assert [seen(1), seen(11)] == pytest.approx([RED[2], BLUE[2]])


def read(owner, path, block, place, expression="value"):
    """A driver of a value of `owner` that reads the one of another data-block at `place`."""
    driver = owner.driver_add(path).driver
    driver.expression = expression
    variable = driver.variables.new()
    variable.name = "value"
    kind = "OBJECT" if isinstance(block, bpy.types.Object) else "MATERIAL"
    variable.targets[0].id_type, variable.targets[0].id = kind, block
    variable.targets[0].data_path = place
    return variable.targets[0]


#: What takes over a value of the node, and what does: a parameter, a node beside the models, one in
#: front of them.
ELSEWHERE = [
    ("principled", {"Metallic": 1.0}, "Base Color", None),
    ("principled", {"Alpha": 0.5}, "Alpha", None),
    ("principled", {"Emission_Strength": 0.5}, "Emission Strength", None),
    ("glass", {"Color": (1.0, 1.0, 1.0)}, "IOR", None),
    ("principled", {}, "Roughness", keys),
]


@pytest.mark.parametrize(("kind", "inputs", "name", "animate"), ELSEWHERE)
def test_drivers_elsewhere_read_the_new_node(
    extension, convert, empty, kind, inputs, name, animate
):
    """Of another material, an object, through its material, and of the scene; and back."""
    material, node = material_of(kind, **inputs)
    ball = helpers.add_sphere(empty, material)
    other, reader = material_of("diffuse")
    reader = reader.inputs["Roughness"]
    ball["extra"], socket = 1.0, node.inputs[name]
    if animate:
        animate(socket, 0.2, 0.8)
    place = socket.path_from_id("default_value") + ("[0]" if socket.type == "RGBA" else "")
    through = f"material_slots[0].material.node_tree.{place}"
    direct = f"node_tree.{place}"
    targets = [
        read(reader, "default_value", material, direct),
        read(ball, "pass_index", material, direct),
        read(ball, '["extra"]', ball, through),
        read(empty, "cycles.samples", material, direct),
    ]
    before = [target.data_path for target in targets]
    (plan,) = extension.api.plan_conversion([material], limit=1)
    assert not plan.readers
    assert extension.api.convert_materials([plan]) == 1
    for target, path in zip(targets, before, strict=True):
        assert target.data_path != path
        held = target.id.path_resolve(target.data_path.removesuffix("[0]").rpartition(".")[0])
        assert held.node != node and (held.is_output or not held.is_linked)
    assert convert.restore(material) == 1
    assert [target.data_path for target in targets] == before


def test_drivers_that_read_what_no_parameter_is_are_said(extension, convert, empty):
    """The roughness of plastic becomes two parameters by formulas; the colours of a mixture are
    two. Those that nothing reads are not named."""
    material, node = material_of("principled", Metallic=0.5)
    other, _ = material_of("diffuse")
    other.name = "Follower"
    roughness, color = node.inputs["Roughness"], node.inputs["Base Color"]
    paths = [f"node_tree.{socket.path_from_id('default_value')}" for socket in (roughness, color)]
    targets = [
        read(other.node_tree.nodes[0].inputs["Roughness"], "default_value", material, paths[0]),
        read(empty, "cycles.samples", material, paths[1] + "[1]"),
    ]
    before = [target.data_path for target in targets]
    plan = only(convert.plan([material]))
    print(plan.line())
    assert plan.read == ("Base Color", "Roughness") and plan.readers == (empty.name, "Follower")
    said = f"Drivers of {empty.name}, Follower read its Base Color, Roughness"
    assert f"{said}: they still read the replaced node" in plan.line()
    assert convert.apply([plan]) == 1
    assert [target.data_path for target in targets] == before


def test_what_is_animated_without_a_node_behind_it_is_a_reason(extension, convert):
    """The output of a group of the user's whose value has keys inside the group."""
    tree = bpy.data.node_groups.new("Number", "ShaderNodeTree")
    tree.interface.new_socket("Value", in_out="OUTPUT", socket_type="NodeSocketFloat")
    keys(tree.nodes.new("NodeGroupOutput").inputs[0], 0.3, 0.6)
    material, node = material_of("principled")
    source = material.node_tree.nodes.new("ShaderNodeGroup")
    source.node_tree = tree
    material.node_tree.links.new(source.outputs[0], node.inputs["Roughness"])
    assert only(convert.plan([material])).refusal == "Roughness is animated"


def test_keys_in_a_group_move_too(extension, convert):
    from test_convert_groups import group_of, models_in, user_of

    tree, node = group_of("principled", Metallic=1.0)
    material, _ = user_of(tree)
    color_of_metal(node)
    before = curves(tree)
    assert convert.apply(convert.plan([material])) == 1
    (group,) = models_in(extension, tree)
    assert extension.model_nodes.varying(group) == {"f0"}
    assert convert.restore(material) == 1
    assert curves(tree) == before


@pytest.mark.slow
def test_a_saved_file_moves_without_the_extension(extension, convert, empty, tmp_path):
    material, node = material_of("principled", "GGX", Base_Color=RED[:3])
    roughness(node)
    material.name = "Moving"
    before = at_frames(empty, material)
    assert convert.apply(convert.plan([material])) == 1
    path = str(tmp_path / "moving.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    for i, frame in enumerate((1, 11)):
        seen = helpers.render_without_the_extension(path, frame, tmp_path)
        print(seen.shape, seen[2:6, :4, :3].mean((0, 1)), before[(0, 2)[i]])
        assert seen[2:6, :4, :3].mean((0, 1)) == pytest.approx(before[(0, 2)[i]][0], abs=0.02)
