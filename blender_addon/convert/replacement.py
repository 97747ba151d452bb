# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts models, and the nodes that connect them, in the place of one of Blender's nodes."""

import math
from dataclasses import dataclass

from ..groups import bump_correction, model_nodes, nodes
from ..nearest import native_bsdf
from ..packs import pack
from ..trees import animation, shader_trees, shader_values
from .effect_nodes import EffectNodes
from .kept_effects import TRANSMISSION
from .node_values import ANISOTROPY, KINDS, RATIO
from .references import HELPS, helpers, refer

#: Custom property of a group node: the name of the node that it replaces.
BEFORE = "brdfc_before"
#: Whether Bump Map Correction was on at that time. Missing if an earlier version converted the
#: node: that version turned it off. Missing as well in node groups, which several materials share.
CORRECTED = "brdfc_before_bump_map_correction"
#: Custom property of a node to which animation was moved: {name: identifier of the socket of the
#: replaced node from which it comes}. The name is that of a model's parameter, of a node's output,
#: or INPUT and the identifier of a node's input.
MOVED = "brdfc_moved"
INPUT = "input "


@dataclass(frozen=True)
class PreparedPart:
    """A Part with the group of its model, and its values as sockets take them."""

    part: object
    values: dict

    @property
    def known(self):
        """The values, with None for linked parameters."""
        flat = ("f0", "tint") if self.part.flat else ()
        linked = (*self.part.links, *flat, *self.part.laws, *self.part.root[:1])
        return self.values | dict.fromkeys(linked)


class Replacement(EffectNodes):
    """Replaces the node of a Plan."""

    def __init__(self, plan, parts, readers):
        """`readers`: the animation.Readers of the file."""
        super().__init__(plan)
        self._readers = readers
        #: The tangent of an anisotropic node, once it is made.
        self._turned = None
        groups = [self._add(prepared) for prepared in parts]
        self._group, *others = groups
        refer(self._group, BEFORE, self._node)
        for i, other in enumerate(others):
            refer(other, HELPS, self._group)
            other.location.y -= 300 * (i + 1)
            for helper in helpers(other):
                refer(helper, HELPS, self._group)
        for prepared, group in zip(parts, groups, strict=True):
            for name, parameter in prepared.part.links.items():
                if self._direct.get(parameter) == (prepared.part, name):
                    self._given[parameter] = model_nodes.sockets(group)[name]
        self._put(self._joined(groups))
        self._move_animation()
        self._redirect_readers()

    def _put(self, shader):
        """Links the shader where the node was."""
        node = self._node
        for link in [link for link in node.outputs[0].links if shader_trees.counts(link)]:
            target = link.to_socket
            self._tree.links.remove(link)
            self._tree.links.new(shader, target)
        node.location = (node.location.x, node.location.y - 700)

    def _move_animation(self):
        """Moves the animation of the node's sockets to a parameter, if it has just that effect, or
        to the output of the node that was added for it."""
        pairs = []
        for name, source in self._moving.items():
            socket, output = self._node.inputs[name], source.outputs[0]
            target = output.links[0].to_socket if len(output.links) == 1 else None
            if (
                target is not None
                and model_nodes.is_ours(target.node)
                and target.type == socket.type
            ):
                names = {s: parameter for parameter, s in model_nodes.sockets(target.node).items()}
                self._mark(target.node, names[target], socket)
                target.default_value = socket.default_value
                self._tree.nodes.remove(source)
            else:
                target = output
                self._mark(source, output.name, socket)
            pairs.append((socket, target))
        animation.move(pairs, self._readers)

    def _redirect_readers(self):
        """Has drivers that read a value of the node read it at its new place."""
        pairs = []
        for name, place in self._given.items():
            socket = self._node.inputs[name]
            if name in self._moving or place.is_linked or not self._readers.of(socket):
                continue
            if model_nodes.is_ours(place.node):
                names = {s: parameter for parameter, s in model_nodes.sockets(place.node).items()}
                self._mark(place.node, names[place], socket)
            else:
                self._mark(place.node, INPUT + place.identifier, socket)
            pairs.append((socket, place))
        self._readers.redirect(pairs)

    @staticmethod
    def _mark(node, name, socket):
        marks = node[MOVED].to_dict() if MOVED in node else {}
        node[MOVED] = marks | {name: socket.identifier}

    def _add(self, prepared):
        """The group node of a model, with the links of the node that it replaces."""
        tree, node = self._tree, self._node
        group = nodes.add_group_node(tree, prepared.part.model, values=prepared.known)
        group.location = node.location
        if tree.is_embedded_data:
            group[CORRECTED] = bump_correction.recorded(self._plan.material)
        self._group = group
        for name, value in prepared.values.items():
            model_nodes.set_value(group, name, value)
        present = model_nodes.sockets(group)
        for name, socket in prepared.part.links.items():
            if source := self._source(socket):
                tree.links.new(source, present[name])
        for name, source in (
            (pack.NORMAL, self._vector("Normal")),
            (pack.TANGENT, self._tangent()),
        ):
            if source is not None and name in present:
                tree.links.new(source, present[name])
        if prepared.part.again:
            tree.links.new(self._again(prepared.part.again), present["again"])
        if prepared.part.root:
            name, color = prepared.part.root
            tree.links.new(self._root(color), present[name])
        if prepared.part.flat:
            self._brightest = self._flat(prepared.part.flat, present)
        for name, law in prepared.part.laws.items():
            tree.links.new(self._followed(law, prepared.part.varying), present[name])
        for name, *law in prepared.part.widths:
            tree.links.new(self._follow(prepared.part.rough, *law), present[name])
        return group

    def _joined(self, groups):
        """The shader that replaces the node: its models, and the node's effects that they lack."""
        plan, links = self._plan, self._tree.links
        shader, *others = (group.outputs["BSDF"] for group in groups)
        dims = plan.varying.dimmed if plan.varying else 0.0
        if plan.flat or dims or plan.scale != 1:
            # An input without a link is black.
            dimmed = self._helper("ShaderNodeMixShader")
            dimmed.inputs[0].default_value = plan.scale
            if plan.flat:
                links.new(self._brightest, dimmed.inputs[0])
            if dims:
                share = self._operation("ShaderNodeMath", "DIVIDE", self._share(), dims)
                links.new(share, dimmed.inputs[0])
            links.new(shader, dimmed.inputs[2])
            shader = dimmed.outputs[0]
        if plan.base:
            left = self._helper("ShaderNodeMixShader")
            links.new(self._rest(), left.inputs[0])
            links.new(self._scattering(others[0]), left.inputs[2])
            shader = self._sum(shader, left.outputs[0])
        else:
            shader = self._scattering(shader)
        if plan.transmits:
            shader = self._mix(TRANSMISSION, shader, self._glass())
        if plan.metal:
            shader = self._mix("Metallic", shader, others[-1])
        if plan.uppers:
            shader = self._covered(shader)
        elif plan.glows:
            emission = self._helper("ShaderNodeEmission")
            for name, socket in (("Color", "Emission Color"), ("Strength", "Emission Strength")):
                self._give(emission.inputs[name], socket)
            shader = self._sum(shader, emission.outputs[0])
        if plan.transparent:
            clear = self._helper("ShaderNodeBsdfTransparent")
            shader = self._mix("Alpha", clear.outputs[0], shader)
        return shader

    def _rest(self):
        """Nodes for the light that a layer leaves to its base, the polynomial of layer.rest()."""
        rest = self._plan.rest
        varies = len(rest[0]) > 1
        of = (self._share if self._plan.varying else self._roughness)() if varies else None
        rows = [self._polynomial(row, of) for row in rest]
        return self._polynomial(rows, self._facing(self._source("Normal")))

    def _share(self):
        """The largest channel of the input of Plan.varying, as a share between 0 and 1."""
        top = self._plan.varying.top
        return self._clamped(self._plan.varying.socket, 1 / top)

    def _followed(self, law, varying):
        """Nodes for a row of Part.laws."""
        of = self._source(varying.socket)
        if varying.top != 1:
            of = self._operation("ShaderNodeVectorMath", "MULTIPLY", of, 1 / varying.top)
        of = self._operation("ShaderNodeVectorMath", "MAXIMUM", of, varying.dimmed)
        of = self._operation("ShaderNodeVectorMath", "MINIMUM", of, 1.0)
        found = law[-1]
        for c in reversed(law[:-1]):
            found = self._operation("ShaderNodeVectorMath", "MULTIPLY_ADD", found, of, c)
        found = self._operation("ShaderNodeVectorMath", "MAXIMUM", found, 0.0)
        return self._operation("ShaderNodeVectorMath", "MINIMUM", found, 1.0)

    def _again(self, law):
        """Nodes for native_bsdf.interreflection() of a linked colour or roughness."""
        slope, offset, mean, color = law

        def vector(operation, *operands):
            return self._operation("ShaderNodeVectorMath", operation, *operands)

        source = self._source(color) or shader_values.constant(self._node.inputs[color])
        average = vector("MULTIPLY_ADD", source, slope, offset)
        roughness = self._roughness() if len(mean) > 1 else None
        mean = self._polynomial(mean, roughness)
        lost = self._operation("ShaderNodeMath", "SUBTRACT", mean, 1.0)
        left = vector("MULTIPLY_ADD", average, lost, 1.0)
        return vector("DIVIDE", vector("MULTIPLY", average, mean), left)

    def _root(self, color):
        """Nodes for the root of a linked colour, each channel of which is held between 0 and 1."""
        held = self._operation("ShaderNodeVectorMath", "MAXIMUM", self._source(color), 0.0)
        held = self._operation("ShaderNodeVectorMath", "MINIMUM", held, 1.0)
        root = self._helper("ShaderNodeGamma")
        root.inputs["Gamma"].default_value = 0.5
        self._tree.links.new(held, root.inputs["Color"])
        return root.outputs[0]

    def _flat(self, color, present):
        """Nodes for the values of a model that reflects a linked colour at all angles. Returns the
        output with its brightest channel."""

        def vector(operation, *operands):
            return self._operation("ShaderNodeVectorMath", operation, *operands)

        def math(operation, *operands):
            return self._operation("ShaderNodeMath", operation, *operands)

        source = self._source(color)
        channels = self._helper("ShaderNodeSeparateColor")
        self._tree.links.new(source, channels.inputs[0])
        red, green, blue = channels.outputs
        brightest = math("MAXIMUM", math("MAXIMUM", red, green), math("MAXIMUM", blue, 1e-6))
        f0 = vector("DIVIDE", source, brightest)
        # As native_bsdf.flat_tint().
        edge = (1 - native_bsdf.TINTED) ** 5
        tint = vector("DIVIDE", f0, vector("MULTIPLY_ADD", f0, 1 - edge, edge))
        self._tree.links.new(f0, present["f0"])
        self._tree.links.new(tint, present["tint"])
        return brightest

    def _follow(self, rough, factor, power, low, high, stretched):
        """Nodes for a row of Part.widths. `rough`: the socket that they follow."""
        found = None
        if power:
            found = self._math("MAXIMUM", self._source(rough), 1e-3)
            found = self._math("POWER", found, power)
        if stretched:
            ratio = self._math("MULTIPLY_ADD", self._source(self._sockets[0]), RATIO, 1.0)
            ratio = self._math("MINIMUM", self._math("MAXIMUM", ratio, 1 + RATIO), 1.0)
            ratio = self._math("POWER", ratio, stretched)
            found = self._math("MULTIPLY", found, ratio) if found else ratio
        found = self._math("MAXIMUM", self._math("MULTIPLY", found, factor), low)
        return self._math("MINIMUM", found, high)

    @property
    def _sockets(self):
        """The names of the node's sockets of anisotropy and rotation."""
        return ANISOTROPY[KINDS[self._node.bl_idname]]

    def _tangent(self):
        """The tangent of the replaced node. Nodes without a link take that of a Tangent node."""
        linked = self._vector("Tangent")
        if not self._plan.anisotropic:
            return linked
        if self._turned is None:
            self._turned = self._turn(linked or self._radial())
        return self._turned

    def _radial(self):
        tangent = self._helper("ShaderNodeTangent")
        tangent.direction_type, tangent.axis = "RADIAL", "Z"
        return tangent.outputs[0]

    def _turn(self, tangent):
        """The tangent, turned about the normal."""
        socket = self._node.inputs[self._sockets[1]]
        linked, angle = self._source(socket.name), shader_values.constant(socket)
        if not linked and not angle:
            return tangent
        rotate = self._helper("ShaderNodeVectorRotate")
        axis = self._vector("Normal") or self._helper("ShaderNodeNewGeometry").outputs["Normal"]
        self._tree.links.new(tangent, rotate.inputs["Vector"])
        self._tree.links.new(axis, rotate.inputs["Axis"])
        if linked:
            turned = self._math("MULTIPLY", linked, math.tau)
            self._tree.links.new(turned, rotate.inputs["Angle"])
        else:
            rotate.inputs["Angle"].default_value = math.tau * angle
        return rotate.outputs[0]
