# SPDX-License-Identifier: GPL-3.0-or-later
"""Several shaders in one material: added up, or one over another."""

import bpy

from ..common.i18n import say
from ..content.group_content import ALBEDO
from ..trees import shader_trees
from . import nodes

#: Marks the node group that puts a layer over a shader.
_TAG = "brdfc_layer"


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


def put_over(layer, below, target):
    """Puts a model's node over a shader: what lies below gets the light that the layer leaves, 1
    minus the largest channel of its albedo for the view, as in the Principled node.

    `below`: the output that leads to `target`, which gets both together. Raises what
    nodes.add_albedo() raises.
    """
    nodes.add_albedo(layer)
    tree = layer.id_data
    x, y = below.node.location
    both = tree.nodes.new("ShaderNodeGroup")
    both.node_tree, both.label = _layer_over(), "Layer Over"
    layer.location = (x, y + 300)
    both.location = (x + max(layer.width, below.node.width) + 60, y + 100)
    target.node.location.x = max(target.node.location.x, both.location.x + 200)
    tree.links.new(layer.outputs["BSDF"], both.inputs["Layer"])
    tree.links.new(layer.outputs[ALBEDO], both.inputs[ALBEDO])
    tree.links.new(below, both.inputs["Below"])
    tree.links.new(both.outputs[0], target)


def surface_of(material):
    """The output that Cycles shows as a material's surface, and the socket it leads to. Raises
    ValueError without one."""
    tree = shader_trees.shading(material)
    link = shader_trees.surface_link(tree) if tree is not None else None
    if link is None:
        raise ValueError(
            say("Nothing leads to the surface of material {material!r}", material=material.name)
        )
    return link.from_socket, link.to_socket


def _layer_over():
    """The node group that puts a shader over another one."""
    for group in bpy.data.node_groups:
        if group.library is None and group.get(_TAG):
            return group
    group = bpy.data.node_groups.new("Layer Over", "ShaderNodeTree")
    group[_TAG] = True
    for name, kind in (("Layer", "Shader"), (ALBEDO, "Color"), ("Below", "Shader")):
        group.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    kinds = ("SeparateColor", "Math", "Math", "MixShader", "AddShader")
    split, larger, largest, left, both = (group.nodes.new(f"ShaderNode{kind}") for kind in kinds)
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    larger.operation = largest.operation = "MAXIMUM"
    for index, node in enumerate((start, split, larger, largest, left, both, end)):
        node.location = (200 * index, 0)
    for output, socket in (
        (start.outputs[ALBEDO], split.inputs[0]),
        (split.outputs[0], larger.inputs[0]),
        (split.outputs[1], larger.inputs[1]),
        (larger.outputs[0], largest.inputs[0]),
        (split.outputs[2], largest.inputs[1]),
        (largest.outputs[0], left.inputs["Fac"]),
        (start.outputs["Below"], left.inputs[1]),
        (start.outputs["Layer"], both.inputs[0]),
        (left.outputs[0], both.inputs[1]),
        (both.outputs[0], end.inputs[0]),
    ):
        group.links.new(output, socket)
    return group
