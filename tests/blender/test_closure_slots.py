# SPDX-License-Identifier: GPL-3.0-or-later
"""What the extension does when the shaders of a material take most of Cycles' 64 closure slots."""

import re
from importlib import import_module

import bpy
import helpers
import numpy as np
import pytest


def put(scene, material):
    """A ball with a material."""
    return helpers.add_sphere(scene, material, segments=8)


def add_lamps(scene, count):
    """Adds lamps, brightest first."""
    for i in range(count):
        item = bpy.data.objects.new(f"Lamp{i}", bpy.data.lights.new(f"Lamp{i}", "POINT"))
        item.location, item.data.energy = (i, 0, 5), 100 / (i + 1)
        scene.collection.objects.link(item)


def filled():
    """The number of slots that hold a lamp after Blender's handlers have run."""
    for _ in range(2):
        bpy.context.view_layer.update()
    nodes = bpy.data.node_groups[".brdfc Lamps"].nodes
    return sum(nodes[f"LampShape{i}"].inputs[0].default_value > 0 for i in range(1, 9))


def panel(extension, material, scene):
    layout = helpers.Layout()
    extension.ui.draw_material(layout, material, scene)
    return " ".join(layout.log)


def codes(extension, material, scene):
    return {w.code: w for w in extension.api.warnings(material, scene)}


def mix_of(extension, scene, model, count=1, extra=(), others=()):
    """A material of `count` nodes of a model, nodes of other models and other shaders, in equal
    parts by Mix Shaders."""
    material = extension.api.new_material(model)
    tree = material.node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    (first,) = extension.model_nodes.group_nodes(material)
    names = [model] * (count - 1) + list(others)
    more = [extension.nodes.add_group_node(tree, name).outputs["BSDF"] for name in names]
    more += [tree.nodes.new(kind).outputs[0] for kind in extra]
    shader = first.outputs["BSDF"]
    for i, other in enumerate(more):
        mix = tree.nodes.new("ShaderNodeMixShader")
        mix.inputs[0].default_value = 1 / (i + 2)
        tree.links.new(shader, mix.inputs[1])
        tree.links.new(other, mix.inputs[2])
        shader = mix.outputs[0]
    tree.links.new(shader, output.inputs["Surface"])
    return material


@pytest.fixture
def cpu(extension, empty):
    extension.scene_loader.apply_clean_settings(empty, samples=1)
    return empty


def test_several_models_in_one_material_aim_at_fewer_lamps(extension, cpu):
    """By hand: phong takes 8 slots, and 3 more for each lamp."""
    put(cpu, extension.api.new_material("phong"))
    add_lamps(cpu, 8)
    assert filled() == 8
    two = put(cpu, mix_of(extension, cpu, "phong", 2)).active_material
    assert filled() == 8  # (64 - 2 * 8) / 6
    assert "closures" not in codes(extension, two, cpu)
    four = put(cpu, mix_of(extension, cpu, "phong", 4)).active_material
    assert filled() == 2  # (64 - 4 * 8) / 12 = 2.7
    finding = codes(extension, four, cpu)["closures"]
    assert finding.severity == "WARNING" and "room for 2 lamps" in finding.message
    assert "closures" not in codes(extension, two, cpu), "it is not the one"
    assert "room for 2 lamps beside the shaders of" in panel(extension, two, cpu)
    nine = mix_of(extension, cpu, "phong", 9)
    assert codes(extension, nine, cpu)["closures"].severity == "ERROR"


def test_blenders_own_shaders_in_a_material_count(extension, cpu):
    pool = import_module(f"{extension.package}.warnings.closure_slots")
    alone = pool.of_material(mix_of(extension, cpu, "phong", 1)).slots
    kinds = ("ShaderNodeBsdfGlass", "ShaderNodeBsdfPrincipled", "ShaderNodeBsdfDiffuse")
    material = mix_of(extension, cpu, "phong", 1, kinds)
    assert pool.of_material(material).slots == alone + 2 + 3 + 1
    principled = next(n for n in material.node_tree.nodes if n.bl_idname == kinds[1])
    principled.inputs["Coat Weight"].default_value = 0.5
    assert pool.of_material(material).slots == alone + 2 + 5 + 1


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize("count", [4, 6])
def test_a_mix_of_equal_nodes_is_as_bright_as_one(extension, cpu, count):
    """Under eight point lamps, six phong nodes used to be 37.6 % too dark."""

    def mean(material):
        ball = put(cpu, material)
        cpu.view_layers[0].update()
        value = helpers.render(cpu)[..., :3].mean()
        bpy.data.objects.remove(ball)
        bpy.data.materials.remove(material)
        return value

    helpers.add_camera(cpu)
    for i in range(8):
        angle = i * 0.8
        place = (4 * np.cos(angle), -4, 4 * np.sin(angle))
        helpers.add_lamp(cpu, "POINT", location=place, energy=200, shadow_soft_size=0.3)
    cpu.cycles.samples = 512
    cpu.render.resolution_x = cpu.render.resolution_y = 32
    alone = mean(mix_of(extension, cpu, "phong", 1))
    assert mean(mix_of(extension, cpu, "phong", count)) == pytest.approx(alone, rel=0.02)


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize(("models", "room"), [(1, 8), (2, 4), (3, 3), (4, 2)])
def test_several_models_as_formula_nodes_are_not_black(extension, cpu, models, room):
    """Under eight area lamps, two different models in a material were black: Cycles keeps at most
    255 numbers at a time."""
    cpu.cycles.shading_system, cpu.cycles.samples = False, 64
    helpers.add_camera(cpu)
    names = ("schlick", "cook_torrance", "ashikhmin_shirley")[: models - 1]
    material = mix_of(extension, cpu, "ward", others=names)
    put(cpu, material)
    for index in range(8):
        turn = 2.4 * index
        place = (4 * np.sin(turn), -4 * np.cos(turn), 3 + 0.3 * index)
        helpers.add_lamp(cpu, "AREA", f"Lamp{index}", place, energy=60, size=1 + 0.1 * index)
    assert filled() == room
    assert ("closures" in codes(extension, material, cpu)) == (models > 1)
    cpu.render.resolution_x = cpu.render.resolution_y = 16
    centre = helpers.render(cpu)[6:10, 6:10, :3]
    assert centre.mean() > 0.1  # parts of the ball are dark, under lamps alone


@pytest.mark.slow
@pytest.mark.parametrize("osl", [False, True], ids=["nodes", "aimed"])
def test_a_closure_of_cycles_takes_no_room_of_lamps(extension, cpu, osl):
    """A metal that Blender has aims at nothing, so it leaves others of the file, and a second model
    in its material, all lamps."""
    cpu.cycles.shading_system = osl
    slots = import_module(f"{extension.package}.warnings.closure_slots")
    metal = extension.api.new_material("microfacet")
    (node,) = extension.model_nodes.group_nodes(metal)
    sockets = extension.model_nodes.sockets(node)
    assert slots.of_material(metal) == slots.ClosureUsage(3, 0, 0)
    both = extension.api.new_sum([("ward", {}), ("microfacet", {})])
    assert slots.of_material(both).lamps() == 8
    sockets["tint"].default_value = (0.9, 1.0, 1.0, 1.0)
    assert slots.of_material(metal).lamps() == 8
    sockets["tint"].default_value = (1.0, 1.0, 1.0, 1.0)
    assert slots.of_material(metal).lamps() is None
    color = metal.node_tree.nodes.new("ShaderNodeRGB")
    metal.node_tree.links.new(color.outputs[0], sockets["f0"])
    assert slots.of_material(metal).lamps() is None
    metal.node_tree.links.new(color.outputs[0], sockets["tint"])
    assert slots.of_material(metal).lamps() == (8 if osl else 4)


# ---- numbers on SVM's stack ----------------------------------------------------------------------

#: SVM_STACK_SIZE in Cycles. A material that needs more is black.
STACK = 255


#: The models that keep the most numbers.
LARGEST = {"factors", "microfacet", "phong_material", "radziszewski_alda", "thin_film"}


@pytest.mark.slow
@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="Blender 4.5 logs the use of the stack")
@pytest.mark.parametrize(
    ("which", "count", "linked"),
    [
        pytest.param("largest", 8, False, marks=pytest.mark.long),
        ("factors", 8, True),
        ("microfacet", 8, True),
        ("thin_film", 8, True),
        pytest.param("all", 8, False, marks=pytest.mark.long),
        pytest.param("all", 4, False, marks=pytest.mark.long),
        pytest.param("all but factors", 8, True, marks=pytest.mark.long),
    ],
)
def test_models_fit_the_stack(extension, empty, tmp_path, third_of, which, count, linked):
    """Area lamps with a Spread take the most numbers: each has up to four cones within the part
    that shines on the shading point. With a texture on every socket those of the textures come on
    top. All materials aim at the same lamps, so `factors`, which then leaves room for a single one,
    is tried by itself. Of all models a third is tried, for Cycles takes seconds for each, beside
    those that leave the least room for lamps."""
    every = {m for m, e in extension.api.models().items() if "nodes" in e["representations"]}
    assert every > LARGEST
    names = {
        "all": {"factors", "thin_film", *third_of(sorted(every))},
        "all but factors": ({"microfacet", "thin_film", *third_of(sorted(every))}) - {"factors"},
        "largest": LARGEST,
    }.get(which, {which})
    empty.render.engine, empty.cycles.shading_system = "CYCLES", False
    empty.cycles.samples = 1
    empty.render.resolution_x = empty.render.resolution_y = 8
    helpers.add_camera(empty, location=(0, 0, 9))
    for i in range(count):
        angle = 2 * np.pi * i / 8
        location = (5 * np.cos(angle), 5 * np.sin(angle), 3)
        turn = (0.5, 0.2 * i, 0)
        helpers.add_lamp(empty, "AREA", f"Lamp{i}", location, turn, size=1.0, spread=2.0)
    materials = [extension.api.new_material(name, "nodes") for name in names]
    for material in materials:
        put(empty, material)
        if linked:
            _link_textures(material)
    extension.api.see_lamps(empty)
    used = _stack_used(tmp_path)
    assert len(used) >= len(names)
    assert max(used) > 0.7 * STACK  # microfacet with textures: 0.74


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="Blender 4.5 logs the use of the stack")
@pytest.mark.parametrize("count", [1, 4])
@pytest.mark.parametrize("linked", [["Roughness"], ["Base Color", "Roughness", "Anisotropic"]])
def test_a_textured_material_of_two_models_fits_the_stack(
    extension, empty, tmp_path, count, linked
):
    """A Principled node that is half a metal becomes two models, whose roughnesses are linked."""
    empty.render.engine, empty.cycles.shading_system = "CYCLES", False
    empty.cycles.samples = 1
    empty.render.resolution_x = empty.render.resolution_y = 8
    helpers.add_camera(empty, location=(0, 0, 9))
    for i in range(count):
        helpers.add_lamp(empty, "AREA", f"Lamp{i}", (3 * i, 1, 3), size=1.0, spread=2.0)
    material = helpers.node_material("ShaderNodeBsdfPrincipled", Metallic=0.5)
    tree = material.node_tree
    node = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    for name in linked:
        tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs["Color"], node.inputs[name])
    assert extension.api.convert_materials(extension.api.plan_conversion([material])) == 1
    pool = import_module(f"{extension.package}.warnings.closure_slots")
    assert pool.of_material(material).trees == 2
    put(empty, material)
    extension.api.see_lamps(empty)
    assert max(_stack_used(tmp_path)) > 0.5 * STACK


def _stack_used(folder):
    """The numbers that Cycles keeps for each shader of the open file, all of which have to fit."""
    path = folder / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    log = helpers.log_without_the_extension(path, folder)
    used = [int(n) for n in re.findall(r"Peak stack usage: *(\d+)", log)]
    assert used, log[-2000:]
    print(f"numbers kept: {sorted(used)}")
    assert "stack space" not in log
    assert max(used) < STACK
    return used


def _link_textures(material):
    """Links a texture of its own to each socket of the model's node."""
    tree = material.node_tree
    (group,) = (n for n in tree.nodes if n.bl_idname == "ShaderNodeGroup")
    for i, socket in enumerate(group.inputs):
        texture = tree.nodes.new("ShaderNodeTexNoise")
        texture.inputs["Scale"].default_value = i + 1
        tree.links.new(texture.outputs["Color"], socket)
