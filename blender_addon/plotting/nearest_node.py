# SPDX-License-Identifier: GPL-3.0-or-later
"""The Principled node that comes nearest to a model's node, or to a whole material of models."""

from ..common.i18n import say
from ..groups import model_nodes, stacks
from ..packs import pack
from ..trees import shader_trees, shader_values


def values(node):
    """A node's values by name, and the names of linked parameters, which have the value None."""
    model = pack.model(model_nodes.identity(node).model)
    found = model.fixed | {name: model_nodes.get_value(node, name) for name in model.parameters}
    return found, [name for name, value in found.items() if value is None]


def of_node(node):
    """nearest.principled.Nearest to a model with a node's values, or with its default where one is
    linked; None for a black one. Raises ValueError for a model that the extension lacks."""
    return _of_model(model_nodes.identity(node).model, values(node)[0]).nearest()


def of_material(material):
    """The same for a material of models, BLACK for a black one; None for a material without models,
    for one with other shaders beside them, and where the extension lacks a model. For exporters,
    which may have found a Principled node in others, as below a coat."""
    if not material or not model_nodes.shown_nodes(material):
        return None
    try:
        return of_surface(material)
    except (ValueError, pack.PackError):  # a model may be of another version
        return None


def of_surface(material, linked=None):
    """The same for the light of all shaders of a material; see light()."""
    # It imports NumPy, as below.
    from ..nearest.principled import BLACK

    return light(material, linked).nearest() or BLACK


def light(material, linked=None):
    """reflected.Reflected by all shaders of a material: models, Diffuse nodes without roughness,
    sums and mixes with a constant factor, and coats. Raises ValueError that names other nodes.
    `linked`: the value of linked colours; None for their defaults."""
    return _reflected(_surface(material), linked)


def _surface(material):
    return shader_trees.reach(stacks.surface_of(material).to_socket)


def _of_model(name, found):
    # NumPy's formulas are imported on first use.
    from .. import brdfc
    from . import reflected

    model = brdfc.model(name)
    return reflected.of_model(model, reflected.values_in_range(model, found))


def _reflected(reached, linked):
    from . import reflected

    def of(name, within=reached.within):
        return _reflected(shader_trees.reach(_input(name), within), linked)

    def _input(name):
        return node.inputs[name]

    node = reached.node
    if node is None:
        return reflected.nothing()
    if reached.within and stacks.puts_layer(reached.within[-1]):
        *within, node = reached.within
        return of(stacks.LAYER, tuple(within)).over(of(stacks.BELOW, tuple(within)))
    if model_nodes.is_ours(node):
        return _of_node(node, linked)
    if node.bl_idname == "ShaderNodeAddShader":
        return of(0) + of(1)
    if node.bl_idname == "ShaderNodeMixShader":
        factor = shader_values.constant(node.inputs[0], reached.within)
        if factor is not None:
            factor = min(max(factor, 0.0), 1.0)
            return (1 - factor) * of(1) + factor * of(2)
    if node.bl_idname == "ShaderNodeBsdfDiffuse":
        color, roughness = (
            shader_values.constant(node.inputs[name], reached.within)
            for name in ("Color", "Roughness")
        )
        if color is not None and roughness == 0:
            return _of_model("lambert", {"rho": color})
    raise ValueError(
        say("No Principled node can stand for the node {node!r}", node=node.label or node.name)
    )


def _of_node(node, linked):
    name = model_nodes.identity(node).model
    found, of_links = values(node)
    for parameter in of_links:
        if linked is not None and model_nodes.sockets(node)[parameter].type == "RGBA":
            found[parameter] = (linked,) * 3
    return _of_model(name, found)
