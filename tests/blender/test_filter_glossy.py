# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' Filter Glossy blurs Blender's nodes and Formula Nodes, and shaders in Open Shading
Language only where they are one of Cycles' closures: what Convert says of it is what pictures
show."""

import bpy
import helpers
import numpy as np
import pytest
from converting import material_of, only

WHITE, BLACK = (0.8, 0.8, 0.8), (0.05, 0.05, 0.05)


def metal(roughness, tint=1.0):
    look = {"Roughness": roughness, "Base_Color": WHITE, "Specular_Tint": (tint,) * 3}
    return "principled", {"Metallic": 1.0} | look


def plastic(roughness, ior=1.5):
    return "principled", {"Roughness": roughness, "Base_Color": BLACK, "IOR": ior}


#: Node, and whether the picture changes by more than 1 %.
CASES = [
    (metal(0.1), False),  # its model is the same closure
    (metal(0.1, 0.95), True),
    (metal(0.6, 0.95), True),
    (metal(0.7), False),
    (metal(0.0), False),  # its model is a mirror, too
    (plastic(0.3), False),  # as the metal of 0.1
    (plastic(0.3, 2.5), True),
    (plastic(0.5), False),
    (("glossy", {"Roughness": 0.4, "Color": WHITE}), False),
    (("diffuse", {"Roughness": 0.4, "Color": WHITE}), False),
]


def room(scene, material):
    """A floor of a material, white walls, a ball, and an area lamp; the floor's object."""
    white = material_of("diffuse", Color=WHITE)[0]

    def plane(location=(0, 0, 0), rotation=(0, 0, 0), of=white):
        bpy.ops.mesh.primitive_plane_add(size=6, location=location, rotation=rotation)
        bpy.context.object.data.materials.append(of)
        return bpy.context.object

    floor = plane(of=material)
    plane((0, 3, 3), (np.pi / 2, 0, 0))
    plane((-3, 0, 3), (0, np.pi / 2, 0))
    plane((3, 0, 3), (0, np.pi / 2, 0))
    ball = helpers.add_sphere(scene, white)
    ball.location, ball.scale = (0.8, 0.6, 0.6), (0.6, 0.6, 0.6)
    helpers.add_lamp(scene, "AREA", location=(0, 0, 3.5), energy=200, size=1.0)
    helpers.add_camera(scene, (0, -5.5, 2.2), (1.25, 0, 0))
    helpers.add_world(scene, 0.05)
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.cycles.samples, scene.cycles.max_bounces = 64, 8
    scene.cycles.sample_clamp_indirect = 0
    return floor


def pictures(scene, floor, material):
    """Without and with the setting of new files."""
    floor.data.materials[0], seen = material, []
    with helpers.compiled_once(scene):
        for setting in (0.0, 1.0):
            scene.cycles.blur_glossy = setting
            seen.append(helpers.render(scene)[..., :3].reshape(8, 4, 8, 4, 3).mean((1, 3, 4)))
    return seen


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize(("node", "differs"), CASES)
def test_convert_says_whether_the_setting_shows(extension, convert, empty, node, differs):
    kind, inputs = node
    material, _ = material_of(kind, None if kind == "diffuse" else "GGX", **inputs)
    floor = room(empty, material)
    empty.cycles.shading_system = False
    native = pictures(empty, floor, material)
    for osl in (False, True):
        copy = material.copy()
        empty.cycles.shading_system, empty.cycles.blur_glossy = osl, 1.0
        plan = only(extension.api.plan_conversion([copy]))
        said = extension.api.conversion_warning([plan], empty)
        assert extension.api.convert_materials([plan]) == 1
        model = pictures(empty, floor, copy)
        # What the setting alone does, beyond what the model is off without it.
        off = np.abs((model[1] - native[1]) - (model[0] - native[0])).sum() / native[1].sum()
        print(f"{kind} {inputs}, OSL {osl}: {100 * off:.2f} %, said: {said}")
        assert plan.filtered == differs and bool(said) == (differs and osl)
        assert off > 0.01 if differs and osl else off < 0.01


def test_the_warning_is_of_what_is_converted_with_the_setting(extension, convert, empty):
    kind, inputs = metal(0.1, 0.95)
    material, node = material_of(kind, "GGX", **inputs)
    ask = extension.api.conversion_warning
    plans = extension.api.plan_conversion([material])
    extension.api.enable_osl(empty)
    empty.cycles.blur_glossy = 0.05
    assert ask(plans, empty) is None
    empty.cycles.blur_glossy = 0.5
    assert ask(plans, empty).startswith("Filter Glossy is 0.5: ")
    empty.render.engine = "BLENDER_WORKBENCH"
    assert ask(plans, empty) is None
    empty.render.engine = "CYCLES"
    empty.cycles.shading_system = False
    assert ask(plans, empty) is None
    empty.cycles.shading_system = True
    node.inputs["Thin Film Thickness"].default_value = 300
    assert ask(extension.api.plan_conversion([material]), empty) is None


def test_the_button_reports_it(extension, convert, empty):
    kind, inputs = metal(0.1, 0.95)
    ball = helpers.add_sphere(empty, material_of(kind, "GGX", **inputs)[0])
    ball.select_set(True)
    extension.api.enable_osl(empty)
    bpy.context.view_layer.objects.active = ball
    empty.cycles.blur_glossy = 1.0
    from importlib import import_module
    from types import SimpleNamespace

    operator = import_module(f"{extension.package}.operators.convert").BRDFC_OT_convert
    said = []
    last = SimpleNamespace(limit=35.0, report=lambda kind, text: said.append(text))
    last._plans = extension.api.plan_conversion([ball.active_material])
    last._within, last.layout = lambda: operator._within(last), helpers.Layout()
    operator.draw(last, bpy.context)
    assert any("Filter Glossy is 1" in line for line in last.layout.log)
    assert operator.execute(last, bpy.context) == {"FINISHED"}
    assert any("Filter Glossy is 1" in line for line in said)
