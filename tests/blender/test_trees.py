# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares shader_trees with pictures: an emissive surface must show the colour that the extension
says reaches it, and nothing if the extension says so."""

from importlib import import_module

import bpy
import helpers
import numpy as np
import pytest

OWN = (0.1, 0.2, 0.3)
GREEN = (0.0, 1.0, 0.0)
OF_GROUP = (0.9, 0.8, 0.7)
#: From 5.0 on, a socket behind muted or unconnected nodes has its own value; before, it had 0.
SINCE_5 = bpy.app.version >= (5, 0, 0)


def new(tree, kind, **inputs):
    node = tree.nodes.new(kind if kind.startswith("Node") else f"ShaderNode{kind}")
    for name, value in inputs.items():
        node.inputs[name].default_value = (*value, 1) if isinstance(value, tuple) else value
    return node


def rgb(tree, color=GREEN):
    node = new(tree, "RGB")
    node.outputs[0].default_value = (*color, 1)
    return node


class Bench:
    """A surface with an Emission node whose colour is OWN, and the socket of that colour."""

    def __init__(self, tree):
        self.tree = tree
        self.emission = new(tree, "Emission", Color=OWN)
        self.output = new(tree, "OutputMaterial")
        self.socket = self.emission.inputs["Color"]
        self.link(self.emission, self.output.inputs["Surface"])

    def link(self, node, socket, output=0):
        return self.tree.links.new(node.outputs[output], socket)

    def feed(self, node, output=0):
        return self.link(node, self.socket, output)

    def green(self, socket):
        return self.link(rgb(self.tree), socket)

    def group(self, fill):
        """A group with a colour input and output, whose node has OF_GROUP for the input."""
        group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        for name, direction in (("In", "INPUT"), ("Out", "OUTPUT")):
            group.interface.new_socket(name, in_out=direction, socket_type="NodeSocketColor")
        node = new(self.tree, "Group")
        node.node_tree = group
        fill(group)
        node.inputs[0].default_value = (*OF_GROUP, 1)
        return node


def passing(group):
    start, end = new(group, "NodeGroupInput"), new(group, "NodeGroupOutput")
    group.links.new(start.outputs[0], end.inputs[0])
    return start, end


CASES = {}


def case(function):
    CASES[function.__name__] = function
    return function


@case
def nothing_linked(bench):
    pass


@case
def linked(bench):
    bench.green(bench.socket)


@case
def muted_link(bench):
    bench.green(bench.socket).is_muted = True


@case
def muted_link_to_the_surface(bench):
    bench.output.inputs[0].links[0].is_muted = True


@case
def dangling_reroute(bench):
    bench.feed(new(bench.tree, "NodeReroute"))


@case
def dangling_reroutes(bench):
    first, second = new(bench.tree, "NodeReroute"), new(bench.tree, "NodeReroute")
    bench.link(first, second.inputs[0])
    bench.feed(second)


@case
def reroute(bench):
    node = new(bench.tree, "NodeReroute")
    bench.green(node.inputs[0])
    bench.feed(node)


@case
def reroute_behind_a_muted_link(bench):
    node = new(bench.tree, "NodeReroute")
    bench.green(node.inputs[0]).is_muted = True
    bench.feed(node)


@case
def muted_source(bench):
    node = rgb(bench.tree)
    bench.feed(node)
    node.mute = True


@case
def muted_source_behind_a_reroute(bench):
    node, source = new(bench.tree, "NodeReroute"), rgb(bench.tree)
    bench.link(source, node.inputs[0])
    bench.feed(node)
    source.mute = True


@case
def muted_node_that_is_given_a_colour(bench):
    node = new(bench.tree, "HueSaturation", Saturation=0.0)
    bench.green(node.inputs["Color"])
    bench.feed(node)
    node.mute = True


@case
def muted_node_that_is_given_nothing(bench):
    node = new(bench.tree, "HueSaturation", Color=OF_GROUP)
    bench.feed(node)
    node.mute = True


@case
def muted_texture(bench):
    node = new(bench.tree, "TexChecker")
    bench.feed(node)
    node.mute = True


@case
def muted_image(bench):
    node = new(bench.tree, "TexImage")
    bench.feed(node)
    node.mute = True


@case
def muted_shader(bench):
    bench.emission.mute = True


@case
def muted_mix_with_a_second_shader_alone(bench):
    mix = new(bench.tree, "MixShader")
    bench.link(bench.emission, mix.inputs[2])
    bench.link(mix, bench.output.inputs[0])
    mix.mute = True


@case
def muted_mix_with_another_first(bench):
    mix = new(bench.tree, "MixShader")
    bench.link(new(bench.tree, "Emission"), mix.inputs[1])
    bench.link(bench.emission, mix.inputs[2])
    bench.link(mix, bench.output.inputs[0])
    mix.mute = True
    return 1.0


@case
def muted_output(bench):
    bench.output.mute = True


@case
def another_output_is_active(bench):
    other = new(bench.tree, "OutputMaterial")
    other.is_active_output = True


@case
def another_output_that_is_active_is_for_all(bench):
    bench.output.target = "CYCLES"
    new(bench.tree, "OutputMaterial").is_active_output = True


@case
def output_for_eevee(bench):
    bench.output.target = "EEVEE"


@case
def group(bench):
    bench.feed(bench.group(passing))


@case
def group_that_is_given_a_colour(bench):
    node = bench.group(passing)
    bench.green(node.inputs[0])
    bench.feed(node)


@case
def group_behind_a_dangling_reroute(bench):
    node = bench.group(passing)
    bench.link(new(bench.tree, "NodeReroute"), node.inputs[0])
    bench.feed(node)


@case
def group_in_a_group(bench):
    inner = bench.group(passing).node_tree

    def fill(group):
        start, end = new(group, "NodeGroupInput"), new(group, "NodeGroupOutput")
        node = new(group, "Group")
        node.node_tree = inner
        group.links.new(start.outputs[0], node.inputs[0])
        group.links.new(node.outputs[0], end.inputs[0])

    bench.feed(bench.group(fill))


@case
def group_without_an_output(bench):
    bench.feed(bench.group(lambda group: None))


@case
def group_with_a_constant(bench):
    bench.feed(bench.group(lambda group: new(group, "NodeGroupOutput", Out=(0.6, 0.5, 0.4))))


@case
def group_of_two_outputs(bench):
    def fill(group):
        passing(group)
        new(group, "NodeGroupOutput", Out=(0.6, 0.5, 0.4)).is_active_output = True

    bench.feed(bench.group(fill))


@case
def muted_group(bench):
    node = bench.group(lambda group: new(group, "NodeGroupOutput", Out=(0.6, 0.5, 0.4)))
    bench.green(node.inputs[0])
    bench.feed(node)
    node.mute = True


@case
def muted_link_in_a_group(bench):
    node = bench.group(passing)
    node.node_tree.links[0].is_muted = True
    bench.feed(node)


@case
def muted_end_of_a_group(bench):
    node = bench.group(passing)
    node.node_tree.nodes["Group Output"].mute = True
    bench.feed(node)


@case
def muted_start_of_a_group(bench):
    node = bench.group(passing)
    node.node_tree.nodes["Group Input"].mute = True
    bench.feed(node)


@case
def socket_that_is_gone(bench):
    """A socket of a node that was set to another data type."""
    mix = new(bench.tree, "Mix")
    mix.data_type = "RGBA"
    bench.tree.links.new(next(s for s in mix.outputs if s.enabled), bench.socket)
    mix.data_type = "FLOAT"


@case
def shader_as_a_colour(bench):
    bench.feed(new(bench.tree, "Emission"))


@pytest.fixture
def trees(extension):
    return import_module(f"{extension.package}.trees.shader_trees")


@pytest.fixture
def values(extension):
    return import_module(f"{extension.package}.trees.shader_values")


@pytest.fixture
def shown(empty):
    """A plane that fills the picture of one pixel, and its material's tree."""
    mesh = bpy.data.meshes.new("Plane")
    mesh.from_pydata([(-9, 0, -9), (9, 0, -9), (9, 0, 9), (-9, 0, 9)], [], [(0, 1, 2, 3)])
    empty.collection.objects.link(bpy.data.objects.new("Plane", mesh))
    helpers.add_camera(empty)
    empty.render.resolution_x = empty.render.resolution_y = 4
    empty.cycles.samples, empty.cycles.use_denoising = 1, False
    material = bpy.data.materials.new("Shown")
    mesh.materials.append(material)
    helpers.empty_tree(material)
    return material


@pytest.mark.parametrize("name", CASES)
def test_what_reaches_a_socket_is_what_cycles_shows(empty, shown, trees, values, name):
    bench = Bench(shown.node_tree)
    CASES[name](bench)
    bpy.context.view_layer.update()
    # Nodes behind a muted mix have another colour.
    found = [s for s in trees.shown(shown) if s.node.bl_idname == "ShaderNodeEmission"]
    said = values.constant(found[0].node.inputs["Color"], found[0].within) if found else (0, 0, 0)
    seen = helpers.render(empty)[1, 1, :3]
    print(f"{name}: seen {seen}, said {said}")
    assert seen == pytest.approx(np.array(said), abs=1e-3)


def test_versions_differ_in_what_dangles(shown, values):
    bench = Bench(shown.node_tree)
    dangling_reroute(bench)
    assert values.constant(bench.socket) == pytest.approx(OWN if SINCE_5 else (0, 0, 0))


# ---- constants behind links ----------------------------------------------------------------------


def checker(bench, node):
    bench.link(new(bench.tree, "TexChecker"), node.inputs[0])


def math(bench, operation, *operands):
    node = new(bench.tree, "Math")
    node.operation = operation
    for socket, operand in zip(node.inputs, operands, strict=False):
        socket.default_value = operand
    return node


CONSTANTS = {
    "value": lambda b: new_value(b.tree, 0.25),
    "sum": lambda b: math(b, "ADD", 0.2, 0.3),
    "power": lambda b: math(b, "POWER", 0.5, 2.0),
    "quotient": lambda b: math(b, "DIVIDE", 0.5, 2.0),
    "by nothing": lambda b: math(b, "DIVIDE", 0.5, 0.0),
    "clamped": lambda b: clamped(math(b, "MULTIPLY_ADD", 2.0, 2.0, 0.5)),
    "clamp": lambda b: new(b.tree, "Clamp", Value=3.0, Max=0.75),
    "mix": lambda b: mix(b, "MIX", 0.25),
    "multiplied": lambda b: mix(b, "MULTIPLY", 1.0),
    "screened": lambda b: mix(b, "SCREEN", 0.5),
    "inverted": lambda b: new(b.tree, "Invert", Color=(0.2, 0.5, 0.8)),
    "grey": lambda b: new(b.tree, "RGBToBW", Color=(0.2, 0.5, 0.8)),
    "combined": lambda b: new(b.tree, "CombineColor", Red=0.2, Green=0.5, Blue=0.9),
    "axes": lambda b: new(b.tree, "CombineXYZ", X=0.2, Y=0.5, Z=0.9),
    "separated": lambda b: new(b.tree, "SeparateColor", Color=(0.2, 0.5, 0.8)),
    "ramp": lambda b: (
        new(b.tree, "ValToRGB", Fac=0.3) if not SINCE_5 else new(b.tree, "ValToRGB", Factor=0.3)
    ),
}


def new_value(tree, value):
    node = new(tree, "Value")
    node.outputs[0].default_value = value
    return node


def clamped(node):
    node.use_clamp = True
    return node


def mix(bench, blend, factor):
    node = new(bench.tree, "Mix")
    node.data_type, node.blend_type = "RGBA", blend
    own = {s.name: s for s in node.inputs if s.enabled}
    own["Factor"].default_value = factor
    own["A"].default_value, own["B"].default_value = (0.2, 0.5, 0.8, 1), (0.6, 0.5, 0.1, 1)
    return node


@pytest.mark.parametrize("name", CONSTANTS)
def test_a_constant_behind_a_link_is_what_cycles_makes_of_it(empty, shown, values, name):
    bench = Bench(shown.node_tree)
    node = CONSTANTS[name](bench)
    bench.tree.links.new(next(s for s in node.outputs if s.enabled), bench.socket)
    said = values.constant(bench.socket)
    assert said is not None
    assert helpers.render(empty)[1, 1, :3] == pytest.approx(np.array(said), rel=2e-3, abs=1e-5)


def test_what_differs_is_no_constant(shown, values):
    bench = Bench(shown.node_tree)
    product = math(bench, "MULTIPLY", 1.0, 0.5)
    checker(bench, product)
    bench.feed(product)
    assert values.constant(bench.socket) is None
    product.inputs[1].default_value = 0.0  # importers multiply textures by such a factor
    assert values.constant(bench.socket) == (0, 0, 0)


def test_what_is_animated_is_no_constant_but_has_a_value_now(shown, values):
    bench = Bench(shown.node_tree)
    source = rgb(bench.tree)
    bench.feed(source)
    assert values.constant(bench.socket) == pytest.approx(GREEN)
    source.outputs[0].keyframe_insert("default_value", frame=1)
    assert values.constant(bench.socket) is None
    assert values.current(bench.socket) == pytest.approx(GREEN)


def image(pixel, other=None, name="Image", **settings):
    made = bpy.data.images.new(name, 2, 1, alpha=True)
    for key, value in settings.items():
        setattr(made, key, value)
    made.pixels.foreach_set(np.array([*pixel, *(other or pixel)], np.float32))
    made.pack()
    return made


def textured(bench, picture, output="Color"):
    node = new(bench.tree, "TexImage")
    node.image = picture
    bench.link(node, bench.socket, output)
    return node


def test_an_image_of_one_colour_is_a_constant(empty, shown, values):
    bench = Bench(shown.node_tree)
    textured(bench, image((0.6, 0.4, 0.2, 1.0)))
    said = values.Constants(images=True).told(bench.socket)
    assert helpers.render(empty)[1, 1, :3] == pytest.approx(np.array(said), rel=5e-3)


def test_an_image_of_two_has_a_mean(shown, values):
    bench = Bench(shown.node_tree)
    picture = image((1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.5))
    picture.colorspace_settings.name = "Non-Color"
    node = textured(bench, picture)
    assert values.Constants(images=True).told(bench.socket) is None
    assert values.mean(bench.socket) == pytest.approx((0.5, 0.0, 0.5), abs=1e-3)
    bench.link(node, bench.socket, "Alpha")
    assert values.Constants(images=True).told(bench.socket) is None
    picture.alpha_mode = "NONE"
    assert values.Constants(images=True).told(bench.socket) == (1, 1, 1)


# ---- who asks ------------------------------------------------------------------------------------


def test_a_muted_link_leaves_a_parameter_its_value(extension, empty):
    """To scripts, the list of used models, and a lean shader."""
    material = extension.api.new_material("coupled", r0=0.3)
    (node,) = extension.model_nodes.group_nodes(material)
    socket = extension.model_nodes.sockets(node)["r0"]
    link = material.node_tree.links.new(new_value(material.node_tree, 0.9).outputs[0], socket)
    assert "r0" not in extension.api.get_parameters(material)
    link.is_muted = True
    assert extension.api.get_parameters(material)["r0"] == pytest.approx(0.3)
    (used,) = extension.api.used_materials().values()
    assert used["parameters"]["r0"] == pytest.approx(0.3)
    assert extension.model_nodes.constants(node)["r0"] == pytest.approx(0.3)
    extension.api.set_parameters(material, r0=0.4)
    extension.api.switch_representation(material, "sampled")
    (link,) = extension.model_nodes.sockets(node)["r0"].links
    assert link.is_muted, "the link stays, and stays muted"
    assert extension.api.get_parameters(material)["r0"] == pytest.approx(0.4)


def test_a_muted_model_is_not_warned_of(extension, empty):
    material = extension.api.new_material("coupled")
    (node,) = extension.model_nodes.group_nodes(material)
    extension.model_nodes.sockets(node)["r0"].default_value = 7.0
    assert "out_of_range" in {f.code for f in extension.api.warnings(material, empty)}
    node.mute = True
    assert extension.api.warnings(material, empty) == []


def test_nodes_that_are_not_used_are_said(extension, empty):
    material = extension.api.new_material("coupled")
    material.use_nodes = False
    codes = [f.code for f in extension.api.warnings(material, empty)]
    if SINCE_5:  # nodes are always used
        assert "nodes_off" not in codes
    else:
        assert codes == ["nodes_off"]


@pytest.fixture
def glowing(empty):
    """A light whose nodes emit by a linked strength of 5, and the link."""
    item = helpers.add_lamp(empty, energy=10.0)
    tree = helpers.empty_tree(item.data)
    item.data.use_nodes = True
    emission, output = new(tree, "Emission"), new(tree, "OutputLight")
    tree.links.new(emission.outputs[0], output.inputs[0])
    return item.data, tree.links.new(new_value(tree, 5.0).outputs[0], emission.inputs["Strength"])


def test_the_power_of_a_lamp_is_what_reaches_it(extension, glowing):
    light, link = glowing
    kind = import_module(f"{extension.package}.lamps").kind_of(light)
    assert kind.power(light) == pytest.approx(50, rel=1e-4)
    link.is_muted = True
    assert kind.power(light) == pytest.approx(10, rel=1e-4)
    link.to_node.mute = True
    assert kind.power(light) == 0


def test_a_muted_glow_is_no_lamp(extension, empty):
    emission = import_module(f"{extension.package}.lamps.emission")
    material = helpers.node_material("ShaderNodeEmission", Strength=5.0)
    node = material.node_tree.nodes["Emission"]
    assert emission.of_material(material) == pytest.approx(5, rel=1e-4)
    texture = new(material.node_tree, "TexChecker")
    link = material.node_tree.links.new(texture.outputs[0], node.inputs["Strength"])
    assert not emission.is_even(material)
    link.is_muted = True
    assert emission.is_even(material)
    node.mute = True
    assert emission.of_material(material) == 0


def test_light_that_later_nodes_make_is_not_taken_to_be_even(extension, empty):
    emission = import_module(f"{extension.package}.lamps.emission")
    material = helpers.node_material("ShaderNodeEmission", Strength=5.0)
    tree = material.node_tree
    for kind in ("ShaderNodeRaycast", "ShaderNodeRadialTiling", "ShaderNodeTexVoronoi"):
        if not hasattr(bpy.types, kind):
            continue
        made = tree.nodes.new(kind)
        output = next(s for s in made.outputs if s.enabled)
        tree.links.new(output, tree.nodes["Emission"].inputs["Strength"])
        assert not emission.is_even(material), kind


def test_mixes_beside_a_light_do_not_make_it_uneven(extension, empty):
    """As the layer and the base of a converted Principled node, which glows."""
    emission = import_module(f"{extension.package}.lamps.emission")
    material = helpers.node_material("ShaderNodeEmission", Strength=5.0)
    tree = material.node_tree
    mix, add = new(tree, "MixShader"), new(tree, "AddShader")
    tree.links.new(new(tree, "LayerWeight").outputs["Facing"], mix.inputs[0])
    tree.links.new(new(tree, "BsdfDiffuse").outputs[0], mix.inputs[1])
    tree.links.new(mix.outputs[0], add.inputs[0])
    tree.links.new(tree.nodes["Emission"].outputs[0], add.inputs[1])
    surface = tree.get_output_node("CYCLES").inputs["Surface"]
    tree.links.new(add.outputs[0], surface)
    assert emission.is_even(material)
    dark = new(tree, "Emission", Strength=0.0)
    tree.links.new(dark.outputs[0], mix.inputs[2])
    assert emission.is_even(material)
    dark.inputs["Strength"].default_value = 1.0
    assert not emission.is_even(material)
    # In a group around it, and above the light.
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    inner, end = new(group, "Emission", Strength=5.0), new(group, "NodeGroupOutput")
    group.links.new(inner.outputs[0], end.inputs[0])
    user = new(tree, "Group")
    user.node_tree = group
    tree.links.new(user.outputs[0], mix.inputs[2])
    assert not emission.is_even(material)
    group.nodes.remove(inner)
    assert emission.is_even(material)


def test_a_muted_sky_has_no_sun(extension, empty):
    world = import_module(f"{extension.package}.lamps.world")
    tree, background = helpers.add_world(empty)
    sky = tree.nodes.new("ShaderNodeTexSky")
    link = tree.links.new(sky.outputs[0], background.inputs["Color"])
    assert len(list(world.candidates(empty.world))) == 1
    link.is_muted = True
    assert list(world.candidates(empty.world)) == []
    link.is_muted, sky.mute = False, True
    assert list(world.candidates(empty.world)) == []
