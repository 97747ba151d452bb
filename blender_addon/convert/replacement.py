# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts models, and the nodes that connect them, in the place of one of Blender's nodes."""

import math
from dataclasses import dataclass

import bpy

from ..content import group_content
from ..groups import bump_correction, model_nodes, nodes
from ..nearest import native_bsdf
from ..packs import pack
from ..trees import animation, shader_trees, shader_values
from .kept_effects import SUBSURFACE, TRANSMISSION, TRANSMISSION_SHARED
from .node_values import ANISOTROPY, KINDS, RATIO, has_own_animation
from .planned_node import HELPS

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


class Replacement:
    """Replaces the node of a Plan."""

    def __init__(self, plan, parts, readers):
        """`readers`: the animation.Readers of the file."""
        self._plan, self._node, self._tree = plan, plan.node, plan.node.id_data
        self._readers, self._direct = readers, plan.direct
        #: The sockets that have taken over the value of one of the replaced node, by its name.
        self._given = {}
        self._animated = animation.animated_properties(plan.node)
        #: The nodes whose output has the animation of a socket of the replaced node, by its name.
        self._moving = {}
        #: The output of a Clamp node by socket, once it is made.
        self._clamps = {}
        #: The tangent of an anisotropic node, once it is made.
        self._turned = None
        groups = [self._add(prepared) for prepared in parts]
        self._group, *others = groups
        self._group[BEFORE] = self._node.name
        for i, other in enumerate(others):
            other[HELPS] = self._group.name
            other.location.y -= 300 * (i + 1)
            for helper in self._tree.nodes:
                if helper.get(HELPS) == other.name:
                    helper[HELPS] = self._group.name
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

    def _source(self, name):
        """The output that controls a socket of the node; None if its own value does, which is not
        animated."""
        socket = self._node.inputs[name]
        if shader_trees.is_driven(socket):
            return next(link.from_socket for link in socket.links if shader_trees.counts(link))
        if name not in self._moving and has_own_animation(socket, self._animated):
            is_color = socket.type == "RGBA"
            source = self._helper("ShaderNodeRGB" if is_color else "ShaderNodeValue")
            source.location.x -= 440
            source.label, source.outputs[0].default_value = name, socket.default_value
            self._moving[name] = source
        return self._moving[name].outputs[0] if name in self._moving else None

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

    def _scattering(self, base):
        """A base, part of which scatters light beneath the surface."""
        if not self._plan.subsurface:
            return base
        scattering = self._helper("ShaderNodeSubsurfaceScattering")
        scattering.falloff = self._node.subsurface_method
        # Where a Principled node has a socket for this, that replaces it.
        scattering.inputs["IOR"].default_value = self._plan.subsurface
        self._give(scattering.inputs["Color"], "Base Color")
        for socket in scattering.inputs:
            name = f"Subsurface {socket.name}"
            if name in self._node.inputs and name != SUBSURFACE:
                self._give(socket, name)
        if "Roughness" in scattering.inputs:
            # Of this node it is the width of the facets, of a Principled node the root of it.
            if self._source("Roughness"):
                rough = self._roughness()
                rough = self._operation("ShaderNodeMath", "MULTIPLY", rough, rough)
                self._tree.links.new(rough, scattering.inputs["Roughness"])
            else:
                rough = shader_values.constant(self._node.inputs["Roughness"])
                scattering.inputs["Roughness"].default_value = min(max(rough, 0.0), 1.0) ** 2
        self._link_vectors(scattering)
        return self._mix(SUBSURFACE, base, scattering.outputs[0])

    def _glass(self):
        """A Principled node with the transmission of the replaced one alone."""
        glass = self._helper("ShaderNodeBsdfPrincipled")
        glass.distribution = self._node.distribution
        glass.inputs[TRANSMISSION].default_value = 1
        for name in TRANSMISSION_SHARED:
            self._give(glass.inputs[name], name)
        self._link_vectors(glass)
        return glass.outputs[0]

    def _link_vectors(self, helper):
        """Gives a node the normal and the tangent of the replaced one."""
        for name in ("Normal", "Tangent"):
            if name in helper.inputs and (source := self._vector(name)):
                self._tree.links.new(source, helper.inputs[name])

    def _covered(self, below):
        """A shader under the Uppers of the node: a Principled node that has no other effect but
        emission, which Cycles dims by them."""
        uppers = self._helper("ShaderNodeBsdfPrincipled")
        # An IOR of 1 reflects nothing.
        uppers.inputs["Base Color"].default_value = 0, 0, 0, 1
        uppers.inputs["IOR"].default_value = 1
        shown = tuple(f"{upper.name} " for upper in self._plan.uppers)
        shown += ("Emission ",) if self._plan.glows else ()
        for socket in uppers.inputs:
            if socket.name in ("Normal", "Coat Normal"):
                if source := self._source(socket.name):
                    self._tree.links.new(source, socket)
            elif socket.name.startswith(shown):
                self._give(socket, socket.name)
        left = None
        for upper in self._plan.uppers:
            share = self._left_by(upper)
            left = self._operation("ShaderNodeMath", "MULTIPLY", left, share) if left else share
        dimmed = self._helper("ShaderNodeMixShader")
        self._tree.links.new(left, dimmed.inputs[0])
        self._tree.links.new(below, dimmed.inputs[2])
        return self._sum(uppers.outputs[0], dimmed.outputs[0])

    def _left_by(self, upper):
        """Nodes for the share of light that an Upper leaves to what lies below."""
        rough = self._clamped(upper.roughness) if len(upper.rest[0]) > 1 else None
        rows = [self._polynomial(row, rough) for row in upper.rest]
        rest = self._polynomial(rows, self._facing(self._normal_of(upper)))
        taken = self._operation("ShaderNodeMath", "SUBTRACT", 1.0, rest)
        weight = self._source(upper.weight)
        if weight is None:
            weight = max(shader_values.constant(self._node.inputs[upper.weight]), 0.0)
        taken = self._operation("ShaderNodeMath", "MULTIPLY", taken, weight)
        if upper.top != 1:
            taken = self._operation("ShaderNodeMath", "MULTIPLY", taken, upper.top)
        share = self._operation("ShaderNodeMath", "SUBTRACT", 1.0, taken)
        return self._operation("ShaderNodeMath", "MAXIMUM", share, 0.0)

    def _normal_of(self, upper):
        """The normal of an Upper: an output, or None for the surface's own. Cycles gives sheen that
        of the coat as far as the coat covers it."""
        normal, coat = self._source("Normal"), self._source("Coat Normal")
        if coat is None or upper.name == "Coat":
            return coat or normal
        if "Coat" not in [other.name for other in self._plan.uppers]:
            return normal
        if self._source("Coat Weight"):
            weight = self._clamped("Coat Weight")
        else:
            weight = shader_values.constant(self._node.inputs["Coat Weight"])
            weight = min(max(weight, 0.0), 1.0)
        normal = normal or self._helper("ShaderNodeNewGeometry").outputs["Normal"]
        turn = self._operation("ShaderNodeVectorMath", "SUBTRACT", coat, normal)
        turned = self._operation("ShaderNodeVectorMath", "MULTIPLY_ADD", turn, weight, normal)
        return self._operation("ShaderNodeVectorMath", "NORMALIZE", turned)

    def _helper(self, kind):
        """A node that is added along with a group to replace the node."""
        tree, group = self._tree, self._group
        count = sum(n.get(HELPS) == group.name for n in tree.nodes)
        helper = tree.nodes.new(kind)
        helper.location = (group.location.x + 220, group.location.y + 60 - 60 * count)
        helper.hide, helper[HELPS] = True, group.name
        return helper

    def _sum(self, first, second):
        add = self._helper("ShaderNodeAddShader")
        self._tree.links.new(first, add.inputs[0])
        self._tree.links.new(second, add.inputs[1])
        return add.outputs[0]

    def _rest(self):
        """Nodes for the light that a layer leaves to its base, the polynomial of layer.rest()."""
        rest = self._plan.rest
        varies = len(rest[0]) > 1
        of = (self._share if self._plan.varying else self._roughness)() if varies else None
        rows = [self._polynomial(row, of) for row in rest]
        return self._polynomial(rows, self._facing(self._source("Normal")))

    def _facing(self, normal):
        """1 minus the cosine of the view. `normal`: an output, or None for the surface's own."""
        # With this Blend, Facing is 1 minus the cosine.
        view = self._helper("ShaderNodeLayerWeight")
        view.inputs["Blend"].default_value = 0.5
        if normal:
            # Where the normal faces away from the viewer, Cycles bends it back.
            if group := group_content.bent_normal_group(self._plan.model):
                bent = self._helper("ShaderNodeGroup")
                bent.node_tree = group
                self._tree.links.new(normal, bent.inputs["Normal"])
                normal = bent.outputs["Normal"]
            self._tree.links.new(normal, view.inputs["Normal"])
        return view.outputs["Facing"]

    def _roughness(self):
        """The linked roughness between 0 and 1."""
        return self._clamped("Roughness")

    def _share(self):
        """The largest channel of the input of Plan.varying, as a share between 0 and 1."""
        top = self._plan.varying.top
        return self._clamped(self._plan.varying.socket, 1 / top)

    def _clamped(self, name, factor=1.0):
        if name not in self._clamps:
            source = self._source(name)
            if self._node.inputs[name].type == "RGBA":
                channels = self._helper("ShaderNodeSeparateColor")
                self._tree.links.new(source, channels.inputs[0])
                red, green, blue = channels.outputs
                source = self._operation("ShaderNodeMath", "MAXIMUM", red, green)
                source = self._operation("ShaderNodeMath", "MAXIMUM", source, blue)
            if factor != 1:
                source = self._operation("ShaderNodeMath", "MULTIPLY", source, factor)
            clamped = self._helper("ShaderNodeClamp")
            self._tree.links.new(source, clamped.inputs["Value"])
            self._clamps[name] = clamped.outputs[0]
        return self._clamps[name]

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

    def _polynomial(self, coefficients, of):
        """Nodes for Horner's rule. Coefficients are numbers or outputs of nodes."""
        found = coefficients[-1]
        for c in reversed(coefficients[:-1]):
            found = self._operation("ShaderNodeMath", "MULTIPLY_ADD", found, of, c)
        return found

    def _operation(self, kind, operation, *operands):
        """A Math or Vector Math node. Operands are numbers, vectors or outputs of nodes."""
        step = self._helper(kind)
        step.operation = operation
        for socket, operand in zip(step.inputs, operands, strict=False):
            if isinstance(operand, bpy.types.NodeSocket):
                self._tree.links.new(operand, socket)
            elif isinstance(operand, float) and kind == "ShaderNodeVectorMath":
                socket.default_value = (operand,) * 3
            else:
                socket.default_value = operand
        return step.outputs[0]

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

    def _mix(self, name, first, second):
        mix = self._helper("ShaderNodeMixShader")
        self._give(mix.inputs[0], name)
        self._tree.links.new(first, mix.inputs[1])
        self._tree.links.new(second, mix.inputs[2])
        return mix.outputs[0]

    def _give(self, socket, name):
        """Passes what reaches a socket of the replaced node on to another socket."""
        if source := self._source(name):
            self._tree.links.new(source, socket)
            return
        value = shader_values.constant(self._node.inputs[name])
        socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
        if name in self._direct:
            self._given[name] = socket

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

    def _math(self, operation, *operands):
        """A Math node before the group."""
        output = self._operation("ShaderNodeMath", operation, *operands)
        output.node.location.x -= 440
        return output

    @property
    def _sockets(self):
        """The names of the node's sockets of anisotropy and rotation."""
        return ANISOTROPY[KINDS[self._node.bl_idname]]

    def _vector(self, name):
        return self._source(name) if name in self._node.inputs else None

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
