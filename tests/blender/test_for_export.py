# SPDX-License-Identifier: GPL-3.0-or-later
"""Principled nodes in the place of models, for export, and the models back."""

import bpy
import helpers
import numpy as np
import pytest


def _principled(material):
    (node,) = (n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    return node


def _state(material):
    """All nodes with the values of their sockets, and all links."""
    tree = material.node_tree
    nodes = {}
    for node in tree.nodes:
        values = (getattr(s, "default_value", None) for s in node.inputs)
        nodes[node.name] = [tuple(v) if hasattr(v, "__len__") else v for v in values]
    links = {
        (k.from_node.name, k.from_socket.identifier, k.to_node.name, k.to_socket.identifier)
        for k in tree.links
    }
    return nodes, links


def _misplaced(scene, material, replace):
    """The fraction of a ball's light that `replace` misplaces, in blocks of 4 x 4 pixels under a
    large sun and a grey world."""

    def light():
        return helpers.render(scene)[..., :3].reshape(6, 4, 6, 4, 3).mean((1, 3))

    helpers.sphere_scene(scene, material, size=24, samples=256)
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.3
    helpers.add_lamp(scene, "SUN", turn=(0.7, 0.3, 0), energy=2, angle=0.5)
    before = light()
    replace()
    return np.abs(light() - before).sum() / before.sum()


def _sum(api):
    return api.new_sum([("modified_phong", {"e": 20.0}), ("lambert", {"rho": (0.3, 0.1, 0.1)})])


def _layers(api):
    material = api.new_material("lambert", rho=(0.1, 0.3, 0.6))
    api.add_coat(material, ax=0.04, ay=0.04)
    return material


def _mix(api):
    """A quarter of a matte model, and the rest of Blender's Diffuse node."""
    material = api.new_material("oren_nayar")
    tree = material.node_tree
    mix, diffuse = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.1, 0.6, 0.2, 1)
    mix.inputs[0].default_value = 0.75
    target = tree.get_output_node("CYCLES").inputs["Surface"]
    tree.links.new(target.links[0].from_socket, mix.inputs[1])
    tree.links.new(diffuse.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], target)
    return material


def _tinted(api):
    return api.new_material("fresnel_dielectric", refracted=(0.5, 0.7, 0.9))


def _frosted(api):
    return api.new_material("rough_glass", alpha=0.2, refracted=(0.5, 0.7, 0.9))


@pytest.mark.parametrize(
    "make, most",
    [(_sum, 0.05), (_layers, 0.03), (_mix, 0.01), (_tinted, 1e-3), (_frosted, 0.05)],
    ids=["sum", "layers", "mix", "glass", "frosted"],
)
def test_one_node_stands_for_all(extension, empty, make, most):
    """Several used to be exported white, coloured glass too bright, and frosted glass opaque."""
    material = make(extension.api)
    before = _state(material)
    off = _misplaced(empty, material, lambda: extension.api.replace_by_principled(material))
    print(f"{off:.4f}")
    assert off <= most
    assert extension.api.restore_models(material)
    assert _state(material) == before
    assert not extension.api.restore_models(material)


def _half(api):
    """Half a matte model, and half nothing."""
    material = _mix(api)
    (mix,) = (n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.5
    mix.inputs[2].links[0].from_node.inputs["Color"].default_value = (0, 0, 0, 1)
    return material


@pytest.mark.parametrize(
    "make, between, most",
    [
        (lambda api: api.new_material("lambert"), None, 0.01),
        (_half, "ShaderNodeMix", 0.03),
        (lambda api: api.new_material("microfacet", ax=0.01, ay=0.01), None, 0.02),
        (lambda api: api.new_material("ward"), "ShaderNodeMix", 0.2),
        (lambda api: api.new_material("coupled"), None, 0.05),
        (_layers, "ShaderNodeMix", 0.07),
        (_mix, "ShaderNodeVectorMath", 0.01),
    ],
    ids=["same", "half", "metal", "ward", "coupled", "coated", "mix"],
)
def test_links_of_colours_and_normals_stay(extension, empty, make, between, most):
    """Where the base colour is the parameter itself, exporters find the texture at the node."""
    api, model_nodes, pack = extension.api, extension.model_nodes, extension.pack
    material = make(api)
    *_, node = model_nodes.group_nodes(material)
    tree, sockets = material.node_tree, model_nodes.sockets(node)
    texture, bump = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeBump")
    color = next(socket for socket in sockets.values() if socket.type == "RGBA")
    tree.links.new(texture.outputs["Color"], color)
    for each in model_nodes.group_nodes(material):
        tree.links.new(bump.outputs["Normal"], model_nodes.sockets(each)[pack.NORMAL])
    before = _state(material)
    done = api.replace_by_principled(material)
    assert done.lost == ()
    found = _principled(material).inputs
    assert found["Normal"].links[0].from_node == bump
    (link,) = found["Base Color"].links
    assert link.from_node == texture if between is None else link.from_node.bl_idname == between
    # What the colour counts as is near the texture's mean, so that pictures may be compared.
    for socket in texture.inputs:
        if socket.name == "Scale":
            socket.default_value = 0.0
    api.restore_models(material)
    off = _misplaced(empty, material, lambda: api.replace_by_principled(material))
    print(f"{off:.4f}")
    assert off < most
    api.restore_models(material)
    assert _state(material)[1] == before[1]


@pytest.mark.parametrize("make", [_tinted, _frosted], ids=["glass", "frosted"])
def test_tints_of_refraction_are_not_linked(extension, empty, make):
    """Cycles multiplies refracted light by the root of the base colour, which is not linear."""
    material = make(extension.api)
    (node,) = extension.model_nodes.group_nodes(material)
    color = material.node_tree.nodes.new("ShaderNodeTexNoise").outputs["Color"]
    material.node_tree.links.new(color, extension.model_nodes.sockets(node)["refracted"])
    done = extension.api.replace_by_principled(material)
    assert len(done.lost) == 1
    assert not _principled(material).inputs["Base Color"].is_linked


def test_error_is_that_of_the_node_which_follows_the_colour(extension, empty):
    """It was that of a node which is nearer, but does not follow it."""
    material = extension.api.new_material("ashikhmin_shirley")
    (node,) = extension.model_nodes.group_nodes(material)
    sockets = extension.model_nodes.sockets(node)
    color = next(socket for socket in sockets.values() if socket.type == "RGBA")
    color.default_value = (0.5, 0.5, 0.5, 1)
    near = extension.api.nearest_principled(material)
    texture = material.node_tree.nodes.new("ShaderNodeTexNoise").outputs["Color"]
    material.node_tree.links.new(texture, color)
    done = extension.api.replace_by_principled(material)
    assert _principled(material).inputs["Base Color"].is_linked
    assert done.error > near["error"]


def test_links_that_have_no_input_are_named(extension, empty):
    material = extension.api.new_material("modified_phong")
    (node,) = extension.model_nodes.group_nodes(material)
    value = material.node_tree.nodes.new("ShaderNodeTexNoise").outputs[0]
    material.node_tree.links.new(value, extension.model_nodes.sockets(node)["e"])
    done = extension.api.replace_by_principled(material)
    label = extension.pack.model("modified_phong").parameters["e"]["label"]
    assert done.lost == (label,) and label in str(done.line())
    assert not _principled(material).inputs["Roughness"].is_linked


def _with_fresnel(api):
    material = _mix(api)
    tree = material.node_tree
    (mix,) = (n for n in tree.nodes if n.bl_idname == "ShaderNodeMixShader")
    tree.links.new(tree.nodes.new("ShaderNodeFresnel").outputs[0], mix.inputs[0])
    return material


def _with_glass(api):
    material = _mix(api)
    (mix,) = (n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeMixShader")
    glass = material.node_tree.nodes.new("ShaderNodeBsdfGlass")
    material.node_tree.links.new(glass.outputs[0], mix.inputs[2])
    return material


def _without_models(api):
    return helpers.node_material("ShaderNodeBsdfPrincipled")


def _converted(api):
    material = helpers.node_material("ShaderNodeBsdfPrincipled", Metallic=1.0)
    api.convert_materials(api.plan_conversion([material]))
    return material


@pytest.mark.parametrize(
    "make, words",
    [
        (_with_fresnel, "Mix"),
        (_with_glass, "Glass"),
        (_without_models, "shows no model"),
        (_converted, "put its own nodes back"),
    ],
)
def test_what_no_node_stands_for_is_refused(extension, empty, make, words):
    material = make(extension.api)
    before = _state(material)
    with pytest.raises(ValueError, match=words):
        extension.api.replace_by_principled(material)
    assert _state(material) == before


def test_models_that_are_gone_are_named(extension, empty):
    material = extension.api.new_material("lambert")
    extension.api.replace_by_principled(material)
    (node,) = extension.model_nodes.group_nodes(material)
    name = node.name
    material.node_tree.nodes.remove(node)
    before = _state(material)
    with pytest.raises(ValueError, match=name):
        extension.api.restore_models(material)
    assert _state(material) == before


def test_models_come_back_after_nodes_got_other_names(extension, empty):
    """Another node may have the name meanwhile."""
    material = extension.api.new_material("ward")
    tree = material.node_tree
    tree.links.new(
        tree.nodes.new("ShaderNodeTexImage").outputs[0],
        extension.model_nodes.sockets(extension.model_nodes.group_nodes(material)[0])["ax"],
    )
    before = _state(material)
    extension.api.replace_by_principled(material)
    (node,) = extension.model_nodes.group_nodes(material)
    name = node.name
    node.name = "Varnish"
    other = tree.nodes.new("ShaderNodeBsdfDiffuse")
    other.name = name
    principled, own = _principled(material), "Principled BSDF"
    principled.name = "For Export"
    tree.nodes.new("ShaderNodeBsdfPrincipled").name = own
    assert extension.api.restore_models(material)
    tree.nodes.remove(other)
    tree.nodes.remove(tree.nodes[own])
    node.name = name
    assert _state(material) == before


def test_operators(extension, empty):
    """Of all selected objects; materials without models stay."""
    made = [_sum(extension.api), _without_models(extension.api), _with_glass(extension.api)]
    for material in made:
        helpers.add_sphere(empty, material, segments=8).select_set(True)
    before = [_state(material) for material in made]
    ball = empty.objects[0]
    bpy.context.view_layer.objects.active = ball
    assert bpy.ops.brdfc.to_principled() == {"FINISHED"}
    assert [_state(m) == b for m, b in zip(made, before, strict=True)] == [False, True, True]
    assert _principled(made[0]).outputs[0].links[0].to_socket.name == "Surface"
    assert bpy.ops.brdfc.to_models() == {"FINISHED"}
    assert [_state(material) for material in made] == before
    assert bpy.ops.brdfc.to_models() == {"CANCELLED"}


def test_wavefront_files_get_the_nearest_principled_material(extension, empty, tmp_path):
    """They used to get a white one, as this exporter has no hook."""
    material = extension.api.new_material("microfacet", f0=(0.9, 0.6, 0.3), ax=0.09, ay=0.09)
    material.name = "copper"
    helpers.add_sphere(empty, material, segments=8)
    extension.api.replace_by_principled(material)
    bpy.ops.wm.obj_export(filepath=str(tmp_path / "ball.obj"))
    text = (tmp_path / "ball.mtl").read_text()
    color = next(line for line in text.splitlines() if line.startswith("Kd "))
    near = extension.api.nearest_principled(material)
    assert [float(c) for c in color.split()[1:]] == pytest.approx(near["base_color"], abs=1e-4)
