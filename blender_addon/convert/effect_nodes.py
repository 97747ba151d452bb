# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes for the effects of a Principled node that stay Blender's own (kept_effects.py)."""

from ..trees import shader_values
from .added_nodes import AddedNodes
from .kept_effects import SUBSURFACE, TRANSMISSION, TRANSMISSION_SHARED


class EffectNodes(AddedNodes):
    """Puts a node's own effects over, beneath and beside its models."""

    def _scattering(self, base):
        """A base, part of which scatters light beneath the surface."""
        if not self._plan.subsurface:
            return base
        scattering = self._helper("ShaderNodeSubsurfaceScattering")
        scattering.falloff = self._node.subsurface_method
        if "IOR" in scattering.inputs:
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

    def _link_vectors(self, helper):
        """Gives a node the normal and the tangent of the replaced one."""
        for name in ("Normal", "Tangent"):
            if name in helper.inputs and (source := self._vector(name)):
                self._tree.links.new(source, helper.inputs[name])
