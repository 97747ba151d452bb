# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces nodes by models, and restores them."""

from dataclasses import dataclass, replace

import bpy

from ..common import editable
from ..groups import bump_correction, nodes
from ..packs import pack
from ..trees import shader_trees, shader_values
from .node_values import KINDS
from .plans import Part

#: Custom property of a group node: the name of the node that it replaces.
BEFORE = "brdfc_before"
#: Whether Bump Map Correction was on at that time. Missing if an earlier version converted the
#: node: that version turned it off.
CORRECTED = "brdfc_before_bump_map_correction"
#: Custom property of the nodes that were added along with it: the name of the group node.
HELPS = "brdfc_helps"


def apply(plans):
    """Puts the models into the materials; returns the number of converted nodes.

    Links stay, and so do the original nodes, unlinked, for restore(). All groups are made before
    anything is changed. Raises ValueError, also if a node has changed since the plan was made, and
    CompileError.
    """
    wanted = [replace(p, node=p.seen.now()) for p in plans if not p.refusal]
    editable.check(*(p.material for p in wanted))
    # A linked parameter may take any value.
    prepared = [[_PreparedPart(part, _values(part)) for part in p.parts] for p in wanted]
    known = set(bpy.data.node_groups)
    try:
        for one in (one for each in prepared for one in each):
            nodes.ensure_group(one.part.model, values=one.known)
    except BaseException:
        nodes.remove_unused_groups(known)
        raise
    for p, parts in zip(wanted, prepared, strict=True):
        _replace(p, parts)
    return len(wanted)


@dataclass(frozen=True)
class _PreparedPart:
    """A Part with the group of its model, and its values as sockets take them."""

    part: Part
    values: dict

    @property
    def known(self):
        """The values, with None for linked parameters."""
        return self.values | dict.fromkeys(self.part.links)


def _values(part):
    return {k: pack.check_value(part.model, k, v) for k, v in part.values.items()}


def _source(socket):
    """The output that is linked to a socket, if the link has an effect."""
    if not shader_trees.is_driven(socket):
        return None
    return next(link.from_socket for link in socket.links if shader_trees.counts(link))


def _replace(p, parts):
    node = p.node
    groups = [_add(p, prepared) for prepared in parts]
    group, *others = groups
    group[BEFORE] = node.name
    for i, other in enumerate(others):
        other[HELPS] = group.name
        other.location.y -= 300 * (i + 1)
        for helper in p.material.node_tree.nodes:
            if helper.get(HELPS) == other.name:
                helper[HELPS] = group.name
    shader = _joined(p, groups)
    for link in [link for link in node.outputs[0].links if shader_trees.counts(link)]:
        target = link.to_socket
        p.material.node_tree.links.remove(link)
        p.material.node_tree.links.new(shader, target)
    node.location = (node.location.x, node.location.y - 700)


def _add(p, prepared):
    """The group node of a model, with the links of the node that it replaces."""
    tree, node = p.material.node_tree, p.node
    group = nodes.add_group_node(tree, prepared.part.model, values=prepared.known)
    group.location = node.location
    group[CORRECTED] = bump_correction.recorded(p.material)
    for name, value in prepared.values.items():
        nodes.set_value(group, name, value)
    present = nodes.sockets(group)
    for name, socket in prepared.part.links.items():
        if source := _source(node.inputs[socket]):
            tree.links.new(source, present[name])
    for name in (pack.NORMAL, pack.TANGENT):
        if name in node.inputs and (source := _source(node.inputs[name])):
            tree.links.new(source, present[name])
    if prepared.part.again:
        tree.links.new(_again(p, group, prepared.part.again), present["again"])
    for name, *law in prepared.part.widths:
        tree.links.new(_follow(tree, group, _source(node.inputs["Roughness"]), *law), present[name])
    return group


def _joined(p, groups):
    """The shader that replaces a node: its models, and the node's effects that they lack."""
    shader, *others = (group.outputs["BSDF"] for group in groups)
    if p.base:
        left = _helper(p, groups[0], "ShaderNodeMixShader")
        p.material.node_tree.links.new(_rest(p, groups[0]), left.inputs[0])
        p.material.node_tree.links.new(others[0], left.inputs[2])
        shader = _sum(p, groups[0], shader, left.outputs[0])
    if p.metal:
        shader = _mix(p, groups[0], "Metallic", shader, others[-1])
    if p.glows:
        emission = _helper(p, groups[0], "ShaderNodeEmission")
        for name, socket in (("Color", "Emission Color"), ("Strength", "Emission Strength")):
            _give(p, emission.inputs[name], socket)
        shader = _sum(p, groups[0], shader, emission.outputs[0])
    if p.transparent:
        clear = _helper(p, groups[0], "ShaderNodeBsdfTransparent")
        shader = _mix(p, groups[0], "Alpha", clear.outputs[0], shader)
    return shader


def _helper(p, group, kind):
    """A node that is added along with a group to replace another node."""
    tree = p.material.node_tree
    count = sum(n.get(HELPS) == group.name for n in tree.nodes)
    helper = tree.nodes.new(kind)
    helper.location = (group.location.x + 220, group.location.y + 60 - 60 * count)
    helper.hide, helper[HELPS] = True, group.name
    return helper


def _sum(p, group, first, second):
    add = _helper(p, group, "ShaderNodeAddShader")
    p.material.node_tree.links.new(first, add.inputs[0])
    p.material.node_tree.links.new(second, add.inputs[1])
    return add.outputs[0]


def _rest(p, group):
    """Nodes for the light that a layer leaves to its base, the polynomial of layer.rest()."""
    tree = p.material.node_tree
    # With this Blend, Facing is 1 minus the cosine.
    view = _helper(p, group, "ShaderNodeLayerWeight")
    view.inputs["Blend"].default_value = 0.5
    if source := _source(p.node.inputs["Normal"]):
        tree.links.new(source, view.inputs["Normal"])
    roughness = _roughness(p, group) if len(p.rest[0]) > 1 else None
    rows = [_polynomial(p, group, row, roughness) for row in p.rest]
    return _polynomial(p, group, rows, view.outputs["Facing"])


def _roughness(p, group):
    """The linked roughness between 0 and 1."""
    clamped = _helper(p, group, "ShaderNodeClamp")
    p.material.node_tree.links.new(_source(p.node.inputs["Roughness"]), clamped.inputs["Value"])
    return clamped.outputs[0]


def _polynomial(p, group, coefficients, of):
    """Nodes for Horner's rule. Coefficients are numbers or outputs of nodes."""
    found = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        found = _operation(p, group, "ShaderNodeMath", "MULTIPLY_ADD", found, of, c)
    return found


def _operation(p, group, kind, operation, *operands):
    """A Math or Vector Math node. Operands are numbers, vectors or outputs of nodes."""
    step = _helper(p, group, kind)
    step.operation = operation
    for socket, operand in zip(step.inputs, operands, strict=False):
        if isinstance(operand, bpy.types.NodeSocket):
            p.material.node_tree.links.new(operand, socket)
        elif isinstance(operand, float) and kind == "ShaderNodeVectorMath":
            socket.default_value = (operand,) * 3
        else:
            socket.default_value = operand
    return step.outputs[0]


def _again(p, group, law):
    """Nodes for native_bsdf.interreflection() of a linked colour or roughness."""
    slope, offset, mean, color = law

    def vector(operation, *operands):
        return _operation(p, group, "ShaderNodeVectorMath", operation, *operands)

    source = _source(p.node.inputs[color]) or shader_values.constant(p.node.inputs[color])
    average = vector("MULTIPLY_ADD", source, slope, offset)
    roughness = _roughness(p, group) if len(mean) > 1 else None
    mean = _polynomial(p, group, mean, roughness)
    lost = _operation(p, group, "ShaderNodeMath", "SUBTRACT", mean, 1.0)
    left = vector("MULTIPLY_ADD", average, lost, 1.0)
    return vector("DIVIDE", vector("MULTIPLY", average, mean), left)


def _mix(p, group, name, first, second):
    mix = _helper(p, group, "ShaderNodeMixShader")
    _give(p, mix.inputs[0], name)
    p.material.node_tree.links.new(first, mix.inputs[1])
    p.material.node_tree.links.new(second, mix.inputs[2])
    return mix.outputs[0]


def _give(p, socket, name):
    """Passes what reaches a socket of the replaced node on to another socket."""
    own = p.node.inputs[name]
    if source := _source(own):
        p.material.node_tree.links.new(source, socket)
        return
    value = shader_values.constant(own)
    socket.default_value = (*value, 1.0) if isinstance(value, tuple) else value


def _follow(tree, group, roughness, factor, power, low, high):
    """Nodes for factor * roughness^power, clamped to the range of the parameter."""
    source = roughness
    for i, (operation, *operands) in enumerate(
        (
            ("MAXIMUM", 1e-3),
            ("POWER", power),
            ("MULTIPLY", factor),
            ("MAXIMUM", low),
            ("MINIMUM", high),
        )
    ):
        math_node = tree.nodes.new("ShaderNodeMath")
        math_node.operation, math_node.hide = operation, True
        math_node.location = (group.location.x - 200, group.location.y - 40 * i)
        math_node[HELPS] = group.name
        tree.links.new(source, math_node.inputs[0])
        math_node.inputs[1].default_value = operands[0]
        source = math_node.outputs[0]
    return source


def is_converted(node):
    """Whether a node replaces one of Blender's own."""
    return nodes.is_ours(node) and BEFORE in node


def _before(group):
    before = group.id_data.nodes.get(group[BEFORE])
    return before if before is not None and before.bl_idname in KINDS else None


def _outgoing(group, helpers):
    """The outgoing links of a group and of the nodes added along with it."""
    every = [group, *helpers]
    shaders = [s for node in every for s in node.outputs if s.type == "SHADER"]
    return [link for s in shaders for link in s.links if link.to_node not in every]


def restore(material):
    """Restores the original nodes and settings; where these nodes were deleted, uses the twin,
    which also consists of Blender's own nodes. Returns the number of nodes. Raises ValueError if
    there is neither."""
    editable.check(material)
    if material.node_tree is None:
        return 0
    tree = material.node_tree
    pairs = [(n, _before(n)) for n in tree.nodes if is_converted(n)]
    for group, before in pairs:
        if before is None:  # refuses before anything is changed
            others = [n for n in tree.nodes if n.get(HELPS) == group.name and nodes.is_ours(n)]
            for model in (group, *others):
                pack.resolve(nodes.identity(model)[0], "twin", nodes.all_values(model))
    corrected = [bool(group.get(CORRECTED, True)) for group, _ in pairs]
    for group, before in pairs:
        helpers = [n for n in tree.nodes if n.get(HELPS) == group.name]
        if before is None:
            for model in [group, *filter(nodes.is_ours, helpers)]:
                nodes.switch(model, "twin")
            for key in (BEFORE, CORRECTED):
                group.pop(key, None)
            continue
        for link in _outgoing(group, helpers):
            target = link.to_socket
            tree.links.remove(link)
            tree.links.new(before.outputs[0], target)
        before.location = group.location
        for helper in helpers:
            tree.nodes.remove(helper)
        tree.nodes.remove(group)
    if pairs:
        bump_correction.restore(material, all(corrected))
    nodes.remove_unused_groups()
    return len(pairs)
