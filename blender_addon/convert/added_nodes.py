# SPDX-License-Identifier: GPL-3.0-or-later
"""What adds nodes beside one of Blender's nodes that a conversion replaces."""

import bpy

from ..content import group_content
from ..trees import animation, shader_trees, shader_values
from .node_values import has_own_animation
from .references import HELPS, helpers, refer


class AddedNodes:
    """The nodes that are added to replace the node of a Plan."""

    def __init__(self, plan):
        self._plan, self._node, self._tree = plan, plan.node, plan.node.id_data
        self._direct = plan.direct
        #: The group node that the added nodes help: the last one that was made.
        self._group = None
        #: The sockets that have taken over the value of one of the replaced node, by its name.
        self._given = {}
        self._animated = animation.animated_properties(plan.node)
        #: The nodes whose output has the animation of a socket of the replaced node, by its name.
        self._moving = {}
        #: The output of a Clamp node by socket, once it is made.
        self._clamps = {}

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

    def _vector(self, name):
        return self._source(name) if name in self._node.inputs else None

    def _give(self, socket, name):
        """Passes what reaches a socket of the replaced node on to another socket."""
        if source := self._source(name):
            self._tree.links.new(source, socket)
            return
        value = shader_values.constant(self._node.inputs[name])
        socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
        if name in self._direct:
            self._given[name] = socket

    def _helper(self, kind):
        """A node that is added along with a group to replace the node."""
        tree, group = self._tree, self._group
        count = len(helpers(group))
        helper = tree.nodes.new(kind)
        helper.location = (group.location.x + 220, group.location.y + 60 - 60 * count)
        helper.hide = True
        refer(helper, HELPS, group)
        return helper

    def _sum(self, first, second):
        add = self._helper("ShaderNodeAddShader")
        self._tree.links.new(first, add.inputs[0])
        self._tree.links.new(second, add.inputs[1])
        return add.outputs[0]

    def _mix(self, name, first, second):
        mix = self._helper("ShaderNodeMixShader")
        self._give(mix.inputs[0], name)
        self._tree.links.new(first, mix.inputs[1])
        self._tree.links.new(second, mix.inputs[2])
        return mix.outputs[0]

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

    def _math(self, operation, *operands):
        """A Math node before the group."""
        output = self._operation("ShaderNodeMath", operation, *operands)
        output.node.location.x -= 440
        return output

    def _polynomial(self, coefficients, of):
        """Nodes for Horner's rule. Coefficients are numbers or outputs of nodes."""
        found = coefficients[-1]
        for c in reversed(coefficients[:-1]):
            found = self._operation("ShaderNodeMath", "MULTIPLY_ADD", found, of, c)
        return found

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

    def _roughness(self):
        """The linked roughness between 0 and 1."""
        return self._clamped("Roughness")

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
