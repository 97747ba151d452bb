# SPDX-License-Identifier: GPL-3.0-or-later
"""What the extension does when there is little room for closures: the slots in Cycles, and the
memory of limited size on OptiX, which is simulated. Expected numbers are computed by hand from
those in tests/pack/pack_test.cpp; the memory has 1016 bytes."""

from importlib import import_module

import bpy
import helpers
import numpy as np
import pytest


@pytest.fixture
def optix(extension, empty, monkeypatch):
    """The empty scene on an OptiX device with Open Shading Language on."""
    monkeypatch.setattr(extension.device, "gpu_backend", lambda: "OPTIX")
    extension.api.enable_osl(empty)
    empty.cycles.device = "GPU"
    empty.cycles.sample_clamp_indirect = empty.cycles.blur_glossy = 0
    return empty


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
    nodes = bpy.data.node_groups["brdfc Lamps"].nodes
    return sum(nodes[f"LampShape{i}"].inputs[0].default_value > 0 for i in range(1, 9))


def panel(extension, material, scene):
    layout = helpers.Layout()
    extension.ui.draw_material(layout, material, scene)
    return " ".join(layout.log)


def codes(extension, material, scene):
    return {w.code: w for w in extension.api.warnings(material, scene)}


def test_forms_state_what_they_take(extension):
    pack = extension.pack
    assert extension.pack.manifest()["closure_pool"] == {"bytes": 1016, "mix": 72, "add": 24}
    assert pack.representation("ward", "aimed")["closure_bytes"] == 72 + 136 + 24
    assert pack.representation("ward", "aimed")["lamp_bytes"] == 136 + 24
    for model in pack.model_names():
        for form in pack.model(model)["representations"].values():
            assert form["closure_bytes"] >= 40
            assert bool(form["lamp_bytes"]) == bool(form["lamps"])


def test_optix_is_an_error_until_a_run_is_on_record(extension, optix, monkeypatch):
    material = extension.api.new_material("lambert")
    assert codes(extension, material, optix)["optix_untested"].severity == "ERROR"
    monkeypatch.setattr(extension.scene_rules, "OPTIX_RUN", "some device")
    assert codes(extension, material, optix) == {}


@pytest.mark.parametrize(("setting", "value"), [("device", "CPU"), ("shading_system", False)])
def test_elsewhere_nothing_is_limited(extension, optix, setting, value):
    setattr(optix.cycles, setting, value)
    material = extension.api.new_material("ward")
    put(optix, material)
    add_lamps(optix, 9)
    assert filled() == 8
    assert "OptiX" not in panel(extension, material, optix)


def test_lamps_are_as_many_as_the_largest_material_has_room_for(extension, optix):
    first = put(optix, extension.api.new_material("radziszewski_alda"))  # (1016 - 160) / 160
    add_lamps(optix, 7)
    assert filled() == 5
    found = extension.api.see_lamps(optix)
    assert [lamp.slot for lamp in found] == [1, 2, 3, 4, 5, None, None]
    assert found[5].why == "fainter than the 5 that a material has room for"
    text = panel(extension, first.active_material, optix)
    assert "OptiX has memory for 5 lamps" in text and "Mix Shader" in text
    # Updates by handlers: another material, which needs more; its removal; another device.
    ward = put(optix, extension.api.new_material("ward"))  # (1016 - 232) / 160
    assert filled() == 4
    bpy.data.materials.remove(ward.active_material)
    put(optix, first.active_material)
    assert filled() == 5
    # Scripts can change Cycles' settings without an event; the next change of anything triggers
    # one.
    for device, count in (("CPU", 7), ("GPU", 5)):
        optix.cycles.device = device
        first.location.x += 1
        assert filled() == count
    optix.cycles.device = "CPU"
    assert sum(lamp.slot is not None for lamp in extension.api.see_lamps(optix)) == 7


def mixed(extension, scene):
    """Two models in one material, by a Mix Shader."""
    material = extension.api.new_material("ward")
    tree = material.node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    ward = extension.nodes.group_nodes(material)[0]
    other = extension.nodes.add_group_node(tree, "radziszewski_alda")
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(ward.outputs["BSDF"], mix.inputs[1])
    tree.links.new(other.outputs["BSDF"], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    put(scene, material)
    return material, mix


def test_models_that_are_mixed_share_the_pool(extension, optix):
    material, mix = mixed(extension, optix)
    add_lamps(optix, 4)
    assert filled() == 1  # (1016 - 232 - 160 - 72) / (2 * 160)
    assert not {"closure_pool", "closure_pool_shared"} & codes(extension, material, optix).keys()
    # What is not linked does not run; the size of Blender's own nodes is unknown.
    tree = material.node_tree
    tree.links.remove(mix.inputs[2].links[0])
    assert filled() == 4  # (1016 - 232 - 72) / 160
    glossy = tree.nodes.new("ShaderNodeBsdfGlossy")
    tree.links.new(glossy.outputs[0], mix.inputs[2])
    warning = codes(extension, material, optix)["closure_pool_shared"]
    assert warning.severity == "WARNING" and "take 304, and 160 a lamp" in warning.message


def test_a_form_that_does_not_fit_is_refused(extension, optix):
    api = extension.api
    material = api.new_material("phong")
    text = panel(extension, material, optix)
    assert "Fitted takes more memory than OptiX has: it is for the CPU" in text
    assert "operator brdfc.switch Fitted" not in text and "brdfc.switch Sampled" in text
    # A material may already have this form.
    api.switch_representation(material, "fitted")
    finding = codes(extension, material, optix)["closure_pool"]
    assert finding.severity == "ERROR" and "1256 bytes" in finding.message
    optix.cycles.device = "CPU"
    assert "closure_pool" not in codes(extension, material, optix)
    assert "operator brdfc.switch Fitted" in panel(extension, material, optix)


# ---- slots of closures, of which Cycles has 64 on every device ----------------------------------


def mix_of(extension, scene, model, count, extra=()):
    """A material of `count` nodes of a model and other shaders, in equal parts by Mix Shaders."""
    material = extension.api.new_material(model)
    tree = material.node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    (first,) = extension.nodes.group_nodes(material)
    more = [extension.nodes.add_group_node(tree, model).outputs["BSDF"] for _ in range(count - 1)]
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
    pool = import_module(f"{extension.package}.warnings.closure_pool")
    alone = pool.of_material(mix_of(extension, cpu, "phong", 1)).slots
    kinds = ("ShaderNodeBsdfGlass", "ShaderNodeBsdfPrincipled", "ShaderNodeBsdfDiffuse")
    material = mix_of(extension, cpu, "phong", 1, kinds)
    assert pool.of_material(material).slots == alone + 2 + 3 + 1
    principled = next(n for n in material.node_tree.nodes if n.bl_idname == kinds[1])
    principled.inputs["Coat Weight"].default_value = 0.5
    assert pool.of_material(material).slots == alone + 2 + 5 + 1


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
