# SPDX-License-Identifier: GPL-3.0-or-later
"""Several shaders in one material: added up, or one over another."""

import bpy

from ..common.i18n import say
from ..content.group_content import ALBEDO
from ..content.wiring import Wiring
from ..trees import shader_trees
from . import nodes

#: Marks the node group that puts a layer over a shader, and the names of its inputs for these.
_TAG = "brdfc_layer"
LAYER, BELOW = "Layer", "Below"


def add_shaders(tree, node, others):
    """Adds the light of other nodes to that of a model's node by Add Shader nodes. Links of the
    node's BSDF lead to the sum afterwards."""
    sum_so_far = node.outputs["BSDF"]
    targets = [link.to_socket for link in sum_so_far.links]
    x, y = node.location
    for index, other in enumerate(others):
        other.location = (x, y + 300 * (index + 1))
        both = tree.nodes.new("ShaderNodeAddShader")
        both.location = (x + 250 + 180 * index, y + 150 * (index + 1))
        tree.links.new(other.outputs[0], both.inputs[0])
        tree.links.new(sum_so_far, both.inputs[1])
        sum_so_far = both.outputs[0]
    for target in targets:
        target.node.location.x += 180 * len(others) + 100
        tree.links.new(sum_so_far, target)


def add_matte(tree, node, albedo):
    """Adds the light of a Lambert surface to that of a model's node: Blender's Diffuse node with a
    roughness of 0."""
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*albedo, 1.0)
    diffuse.inputs["Roughness"].default_value = 0.0
    add_shaders(tree, node, [diffuse])


def put_layers(tree, top, others):
    """Puts a model's node over others, each of which lies over the next. Links of the node's BSDF
    lead to all together afterwards. Raises what nodes.add_albedo() raises."""
    *uppers, lowest = layers = [top, *others]
    targets = [link.to_socket for link in top.outputs["BSDF"].links]
    below = lowest.outputs["BSDF"]
    lowest.location.y -= 300 * (len(layers) - 1)
    for layer in reversed(uppers):
        below = _put_over(layer, below)
    for target in targets:
        _lead_to(below, target)


def add_coat(coat, surface):
    """Puts a model's node over the shader that a link leads to a surface. Raises what
    nodes.add_albedo() raises."""
    target, node = surface.to_socket, surface.from_node
    shown = _put_over(coat, surface.from_socket)
    # A Principled node is so tall that above it the coat would be out of sight.
    coat.location = (node.location.x + node.width + 60, node.location.y)
    shown.node.location = (coat.location.x + coat.width + 60, node.location.y)
    _lead_to(shown, target)


def _put_over(layer, below):
    """The output of a node that puts a model's node over the shader of an output: what lies below
    gets the light that the layer leaves, 1 minus the largest channel of its albedo for the view, as
    in the Principled node."""
    nodes.add_albedo(layer)
    tree = layer.id_data
    x, y = below.node.location
    both = tree.nodes.new("ShaderNodeGroup")
    both.node_tree, both.label = _layer_over(), "Layer Over"
    layer.location = (x, y + 300)
    both.location = (x + max(layer.width, below.node.width) + 60, y + 100)
    tree.links.new(layer.outputs["BSDF"], both.inputs[LAYER])
    tree.links.new(layer.outputs[ALBEDO], both.inputs[ALBEDO])
    tree.links.new(below, both.inputs[BELOW])
    return both.outputs[0]


def puts_layer(node):
    """Whether a group node is one that puts a layer over a shader."""
    return bool(getattr(node, "node_tree", None)) and bool(node.node_tree.get(_TAG))


def _lead_to(output, target):
    """Links an output to a socket of a node that stands to the right of it."""
    target.node.location.x = max(target.node.location.x, output.node.location.x + 200)
    output.id_data.links.new(output, target)


def surface_of(material):
    """The link to the surface of a material that Cycles shows. Raises ValueError without one."""
    tree = shader_trees.shading(material)
    if tree is None:
        raise ValueError(shader_trees.NODES_OFF)
    link = shader_trees.surface_link(tree)
    if link is None:
        raise ValueError(
            say(
                "Nothing is connected to the surface of material {material!r}",
                material=material.name,
            )
        )
    return link


def _layer_over():
    """The node group that puts a shader over another one."""
    for group in bpy.data.node_groups:
        if group.library is None and group.get(_TAG):
            return group
    group = bpy.data.node_groups.new("Layer Over", "ShaderNodeTree")
    group[_TAG] = True
    for name, kind in ((LAYER, "Shader"), (ALBEDO, "Color"), (BELOW, "Shader")):
        group.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    w = Wiring(group)
    start, end = w.node("NodeGroupInput"), w.node("NodeGroupOutput")
    red, green, blue = w.separate(start.outputs[ALBEDO])
    largest = w.math("MAXIMUM", w.math("MAXIMUM", red, green), blue)
    left = w.shown(w.math("SUBTRACT", 1.0, largest), start.outputs[BELOW])
    w.give(end.inputs[0], w.sum([start.outputs[LAYER], left]))
    w.place_nodes()
    return group
