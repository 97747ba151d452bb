# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds whose radiance depends on the direction, as nodes and as functions.

Each function builds the nodes and returns the radiance by direction, (n, 3) to (n,) or (n, 3).
"""

import numpy as np
from goniometer import unit


def white(_tree, _background):
    return lambda d: np.ones(len(d))


def gradient(tree, background):
    """From black to white along an oblique axis."""
    axis = unit((0.6, -0.5, 0.3))
    _along(tree, background, axis, lambda dot: _math(tree, "MULTIPLY_ADD", dot, 0.5, 0.5))
    return lambda d: 0.5 + 0.5 * d @ axis


def spot(tree, background):
    """A smooth spot, about 10 degrees wide, low over the horizon."""
    axis = unit((0.5, 0.6, 0.5))

    def shape(dot):
        return _math(tree, "POWER", _math(tree, "MAXIMUM", dot, 0.0), 60.0)

    _along(tree, background, axis, shape)
    return lambda d: np.maximum(d @ axis, 0) ** 60


def _math(tree, operation, *inputs):
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    for socket, value in zip(node.inputs, inputs, strict=False):
        if isinstance(value, float):
            socket.default_value = value
        else:
            tree.links.new(value, socket)
    return node.outputs[0]


def _along(tree, background, axis, shape):
    direction = tree.nodes.new("ShaderNodeTexCoord")
    dot = tree.nodes.new("ShaderNodeVectorMath")
    dot.operation = "DOT_PRODUCT"
    tree.links.new(direction.outputs["Generated"], dot.inputs[0])
    dot.inputs[1].default_value = axis
    tree.links.new(shape(dot.outputs["Value"]), background.inputs["Strength"])


def half(tree, background):
    """Half white, half black, with an edge 10 degrees wide."""
    axis = unit((0.6, 0.3, 0.2))

    def shape(dot):
        ramp = tree.nodes.new("ShaderNodeMapRange")
        ramp.interpolation_type = "SMOOTHSTEP"
        ramp.inputs["From Min"].default_value = -0.1
        ramp.inputs["From Max"].default_value = 0.1
        tree.links.new(dot, ramp.inputs["Value"])
        return ramp.outputs[0]

    _along(tree, background, axis, shape)

    def radiance(d):
        x = np.clip((d @ axis + 0.1) / 0.2, 0, 1)
        return x * x * (3 - 2 * x)

    return radiance


def coloured(tree, background):
    """Each channel is a gradient along its own axis."""
    direction = tree.nodes.new("ShaderNodeTexCoord")
    scaled = tree.nodes.new("ShaderNodeVectorMath")
    scaled.operation = "MULTIPLY_ADD"
    scaled.inputs[1].default_value = scaled.inputs[2].default_value = (0.5, 0.5, 0.5)
    tree.links.new(direction.outputs["Generated"], scaled.inputs[0])
    tree.links.new(scaled.outputs["Vector"], background.inputs["Color"])
    return lambda d: 0.5 + 0.5 * d
