# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion of anisotropic nodes: tangents, rotations, and links."""

import bpy
import helpers
import numpy as np
import pytest
from converting import keyed, linked, material_of, only, picture_node
from test_convert_groups import group_of, user_of

GOLD = (0.9, 0.6, 0.2)
GLOSSY = ("glossy", {"Color": GOLD, "Roughness": 0.4, "Anisotropy": 0.6})
METAL = ("principled", {"Base_Color": GOLD, "Metallic": 1.0, "Roughness": 0.4, "Anisotropic": 0.7})
PLASTIC = ("principled", {"Base_Color": GOLD, "Roughness": 0.3, "Anisotropic": 0.7})


def ball(scene, material):
    """A turned ball under a sun as wide as a window, which shows the tangent everywhere."""
    if "Sphere" not in bpy.data.objects:
        helpers.sphere_scene(scene, material, size=32, samples=256)
        scene.world, scene.cycles.max_bounces = None, 1
        helpers.add_lamp(scene, "SUN", turn=(0.7, 0.5, 0), energy=3, angle=0.4)
        bpy.data.objects["Sphere"].rotation_euler = (0.4, 0.3, 0.2)
    bpy.data.objects["Sphere"].data.materials[0] = material
    # Blocks of pixels, as Formula Nodes are noisy.
    return helpers.render(scene)[..., :3].reshape(8, 4, 8, 4, 3).mean((1, 3))


def off(one, other):
    return np.abs(one - other).sum() / one.sum()


def plain(material, node):
    pass


def turned(material, node):
    node.inputs[rotation_of(node)].default_value = 0.2


def turned_by_a_link(material, node):
    linked(material, node, rotation_of(node), "ShaderNodeValue").outputs[0].default_value = 0.2


def turned_and_linked(material, node):
    """The tangent as well."""
    turned(material, node)
    linked(material, node, "Tangent", "ShaderNodeTangent").axis = "X"


def turned_about_a_bent_normal(material, node):
    turned(material, node)
    bent = linked(material, node, "Normal", "ShaderNodeBump")
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    bent.inputs["Strength"].default_value = 0.3
    material.node_tree.links.new(noise.outputs[0], bent.inputs["Height"])


def turned_by_keys(material, node):
    node.inputs[rotation_of(node)].default_value = 0.2
    keyed(node.inputs[rotation_of(node)])


def rotation_of(node):
    return "Rotation" if "Rotation" in node.inputs else "Anisotropic Rotation"


CASES = [
    (*GLOSSY, plain),
    *(
        (*METAL, change)
        for change in (
            plain,
            turned,
            turned_by_a_link,
            turned_and_linked,
            turned_about_a_bent_normal,
            turned_by_keys,
        )
    ),
]


def assert_as_before(extension, scene, material):
    """Converts without and with Open Shading Language, each time back; returns the plans."""
    scene.cycles.shading_system, plans = False, []
    before, names = ball(scene, material), {n.name for n in material.node_tree.nodes}
    for osl in (False, True):
        scene.cycles.shading_system = osl
        plan = only(extension.api.plan_conversion([material]))
        assert not plan.refusal and plan.anisotropic
        assert extension.api.convert_materials([plan]) == 1
        found = off(before, ball(scene, material))
        print(f"{plan.line()}, OSL {osl}: {found:.3g}, said {plan.error:.3g}")
        assert found < plan.error + (0.005 if osl else 0.02)
        assert extension.api.convert_back(material) == 1
        assert {n.name for n in material.node_tree.nodes} == names
        plans.append(plan)
    return plans


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize(("kind", "inputs", "change"), CASES)
def test_a_picture_of_anisotropy_is_as_before(extension, convert, empty, kind, inputs, change):
    material, node = material_of(kind, "GGX", **inputs)
    change(material, node)
    assert_as_before(extension, empty, material)


def test_the_tangent_shows(convert, empty):
    """In these pictures, in which a wrong one would be seen."""
    material, node = material_of(METAL[0], "GGX", **METAL[1])
    before = ball(empty, material)
    turned(material, node)
    assert off(before, ball(empty, material)) > 0.1


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize("rough", ["constant", "linked"])
@pytest.mark.parametrize(("kind", "inputs"), [METAL, PLASTIC])
def test_an_anisotropy_that_is_linked_is_followed(extension, convert, empty, kind, inputs, rough):
    material, node = material_of(kind, "MULTI_GGX", **inputs)
    tree = material.node_tree
    picture = picture_node(tree, (0.0, 0.0, 0.0), (0.9, 0.9, 0.9), (0.5, 0.5, 0.5))
    place = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(place.outputs["Generated"], picture.inputs["Vector"])
    tree.links.new(picture.outputs["Color"], node.inputs["Anisotropic"])
    if rough == "linked":
        other = picture_node(tree, (0.5, 0.5, 0.5), (0.3, 0.3, 0.3))
        tree.links.new(place.outputs["Generated"], other.inputs["Vector"])
        tree.links.new(other.outputs["Color"], node.inputs["Roughness"])
    for plan in assert_as_before(extension, empty, material):
        assert all(row[-1] for part in plan.parts for row in part.widths)


@pytest.mark.parametrize("roughness", [0.0, 5e-4])
def test_a_mirror_has_no_anisotropy(convert, roughness):
    inputs = METAL[1] | {"Roughness": roughness}
    plan = only(convert.plan([material_of("principled", **inputs)[0]]))
    assert plan.model == "schlick" and not plan.anisotropic


def test_an_anisotropy_of_both_signs_is_not_followed(convert):
    """The Glossy node's: one formula is for positive, another for negative values."""
    material, node = material_of("glossy", "GGX", **GLOSSY[1])
    linked(material, node, "Anisotropy", "ShaderNodeTexNoise")
    assert (
        only(convert.plan([material])).refusal
        == "Anisotropy is linked, and converts only as one value"
    )


@pytest.mark.parametrize(
    ("names", "turn", "why"),
    [
        (["Normal"], 0.0, ""),
        (["Normal"], 0.2, "Normal is a group input that is not linked everywhere"),
        (["Tangent"], 0.0, "Tangent is a group input that is not linked everywhere"),
    ],
)
def test_a_group_has_to_have_the_vectors(convert, names, turn, why):
    tree, _ = group_of("glossy", inputs=names, Anisotropy=0.6, Roughness=0.4, Rotation=turn)
    users = [user_of(tree) for _ in range(2)]
    own, node = users[0][0].node_tree, users[0][1]
    own.links.new(own.nodes.new("ShaderNodeTangent").outputs[0], node.inputs[0])
    assert only(convert.plan([users[0][0]])).refusal == why
    own, node = users[1][0].node_tree, users[1][1]
    own.links.new(own.nodes.new("ShaderNodeTangent").outputs[0], node.inputs[0])
    assert not only(convert.plan([users[0][0]])).refusal
