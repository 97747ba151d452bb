# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts a Principled node in the place of a material's models, for files that can't hold these, and
puts the models back."""

from dataclasses import dataclass, replace

import numpy as np

from ..common import editable
from ..common.i18n import in_percent, say
from ..groups import model_nodes, stacks
from ..packs import pack
from ..plotting import nearest_node
from ..trees import shader_trees
from .apply_restore import is_converted
from .references import HELPS, find, helpers, mark, refer

#: Custom property of a Principled node: name of the node that it replaces, and identifier of that
#: node's output.
_REPLACES = "brdfc_replaces"

#: Values of a linked colour at which the base colour is determined; the other inputs are those for
#: the middle one. How far the base colour may be from a linear function of these, and the smallest
#: slope of a node that follows the colour at all: a metal's may where a dielectric's does not.
_GREYS, _LINEAR, _FLAT = (0.2, 0.5, 0.8), 0.03, 0.1
#: How far the slope may be from 1 for a link without nodes between. It is all that exporters to FBX
#: and OBJ understand, and to lose a texture is worse.
_SAME = 0.1


@dataclass(frozen=True)
class Replaced:
    """What replace_by_principled() did to a material."""

    material: object
    #: Fraction of the light from 45 degrees that the Principled node misplaces.
    error: float
    #: Labels of linked parameters whose links did not fit the Principled node.
    lost: tuple

    def line(self):
        """The same in words."""
        of = {"material": self.material.name, "percent": in_percent(round(self.error, 4))}
        if not self.lost:
            return say("{material}: Principled node, error {percent} %", **of)
        return say(
            "{material}: Principled node, error {percent} %, without the links of {names}",
            **of,
            names=", ".join(self.lost),
        )


@dataclass(frozen=True)
class _ColorLink:
    """A linked colour that the base colour of a node follows: `slope` times it plus `offset`."""

    near: object
    output: object
    slope: np.ndarray
    offset: np.ndarray


def replace_by_principled(material):
    """Links the nearest Principled node to the surface, in the place of all shaders of a material;
    these stay in it for restore_models(). Links of normals, of tangents and of a colour stay, where
    the node has an input for them. Returns Replaced. Raises ValueError, with nothing changed, for a
    material without models, or with what no Principled node can stand for."""
    editable.check(material)
    ours = model_nodes.shown_nodes(material)
    of = {"material": material.name}
    if not ours:
        raise ValueError(say("Material {material!r} shows no model", **of))
    if any(map(is_converted, ours)):
        raise ValueError(
            say("Material {material!r} was converted: put its own nodes back instead", **of)
        )
    surface = stacks.surface_of(material)
    linked, vectors = _links(material, ours)
    color = _color_link(material, linked)
    near = color.near if color else nearest_node.of_surface(material)
    lost = [label for label, output in linked.values() if not color or output != color.output]
    lost += [name for name, outputs in vectors.items() if len(outputs) > 1]
    tree = surface.id_data
    node = _add(tree, near, surface.from_node)
    node[_REPLACES] = [surface.from_node.name, surface.from_socket.identifier]
    mark(node, _REPLACES, surface.from_node)
    if color:
        _link_color(tree, node, color)
    for name, outputs in vectors.items():
        if len(outputs) == 1:
            tree.links.new(outputs.pop(), node.inputs[name])
    tree.links.new(node.outputs[0], surface.to_socket)
    return Replaced(material, near.error, tuple(dict.fromkeys(lost)))


def has_replaced(material):
    """Whether restore_models() has something to put back."""
    return any(_REPLACES in node for node in _nodes(material))


def restore_models(material):
    """Undoes replace_by_principled(). Returns whether there was something to undo. Raises
    ValueError, with nothing changed, if the node that the models' light came from is gone."""
    editable.check(material)
    found = [node for node in _nodes(material) if _REPLACES in node]
    pairs = [(node, _replaced(material, node)) for node in found]
    tree = material.node_tree
    for node, output in pairs:
        for link in list(node.outputs[0].links):
            tree.links.new(output, link.to_socket)
        for helper in helpers(node):
            tree.nodes.remove(helper)
        tree.nodes.remove(node)
    return bool(pairs)


def _nodes(material):
    return material.node_tree.nodes if material.node_tree else ()


def _replaced(material, node):
    name, identifier = node[_REPLACES]
    before = find(node, _REPLACES, name)
    output = before and next((o for o in before.outputs if o.identifier == identifier), None)
    if output is None:
        raise ValueError(
            say(
                "Material {material!r} has no node {node!r} any more, which the Principled node "
                "replaced",
                material=material.name,
                node=name,
            )
        )
    return output


def _links(material, ours):
    """By node and parameter, the parameter's label and the output that reaches it, None for one
    inside a node group; and the outputs that reach Normal and Tangent, by name."""
    linked, vectors = {}, {}
    for shown in shader_trees.shown(material):
        if shown.node not in ours:
            continue
        parameters = pack.model(model_nodes.identity(shown.node).model).parameters
        for name, socket in model_nodes.sockets(shown.node).items():
            reached = shown.reach(socket)
            if reached.output is None:
                continue
            output = None if reached.within else reached.output
            if name in (pack.NORMAL, pack.TANGENT):
                vectors.setdefault(name, set()).add(output)
            elif name in parameters:
                linked[shown.node.name, name] = parameters[name]["label"], output
    return linked, {name: outputs for name, outputs in vectors.items() if None not in outputs}


def _color_link(material, linked):
    """The _ColorLink of the only colour that is linked to the models; None if there is another
    number of them, or if no such function is near enough."""
    outputs = {output for _, output in linked.values()}
    if len(outputs) != 1 or None in outputs:
        return None
    (output,) = outputs
    if output.type != "RGBA":
        return None
    lights = [nearest_node.light(material, grey) for grey in _GREYS]
    near = lights[1].nearest()
    metal = near and not near.transmission and replace(near, metallic=1.0)
    for one in filter(None, (near, metal)):
        nodes = [light.like(one) for light in lights]
        colors = np.array([node.color for node in nodes])
        # Exporters understand a product, but not a sum.
        product = colors.T @ _GREYS / np.dot(_GREYS, _GREYS), np.zeros(3)
        for slope, offset in (product, np.polyfit(_GREYS, colors, 1)):
            off = np.abs(np.outer(_GREYS, slope) + offset - colors).max()
            if off <= _LINEAR and slope.max() >= _FLAT:
                return _ColorLink(nodes[1], output, slope, offset)
    return None


def _add(tree, near, before):
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.location = (before.location.x, before.location.y + 700)
    values = {
        "Base Color": (*near.color, 1.0),
        "Metallic": near.metallic,
        "Roughness": near.roughness,
        "IOR": near.ior,
        "Transmission Weight": float(near.transmission),
    }
    for name, value in values.items():
        node.inputs[name].default_value = value
    return node


def _link_color(tree, node, color):
    target = node.inputs["Base Color"]
    if color.offset.any():
        helper = tree.nodes.new("ShaderNodeVectorMath")
        helper.operation = "MULTIPLY_ADD"
        source, *operands = helper.inputs
        for operand, value in zip(operands, (color.slope, color.offset), strict=False):
            operand.default_value = value
        output = helper.outputs[0]
    elif np.abs(color.slope - 1).max() > _SAME:
        # Exporters to glTF know this one.
        helper = tree.nodes.new("ShaderNodeMix")
        helper.data_type, helper.blend_type = "RGBA", "MULTIPLY"
        factor, source, other = (s for s in helper.inputs if s.enabled)
        factor.default_value, other.default_value = 1.0, (*color.slope, 1.0)
        output = next(s for s in helper.outputs if s.enabled)
    else:
        tree.links.new(color.output, target)
        return
    helper.location = (node.location.x - 220, node.location.y)
    helper.hide = True
    refer(helper, HELPS, node)
    tree.links.new(color.output, source)
    tree.links.new(output, target)
