# SPDX-License-Identifier: GPL-3.0-or-later
"""The tangent of a model's node, the first axis of anisotropy."""

from ..packs import pack
from . import model_nodes


def turn(node, angle):
    """Turns the tangent of a new node, which is the object's z axis along the surface, by an angle
    in radians about the normal, from the tangent to the bitangent."""
    tree, (x, y) = node.id_data, node.location
    axis, normal, turned = (
        tree.nodes.new(f"ShaderNode{kind}")
        for kind in ("VectorTransform", "NewGeometry", "VectorRotate")
    )
    axis.vector_type, axis.convert_from, axis.convert_to = "VECTOR", "OBJECT", "WORLD"
    axis.inputs[0].default_value = (0.0, 0.0, 1.0)
    turned.rotation_type = "AXIS_ANGLE"
    turned.inputs["Center"].default_value = (0.0, 0.0, 0.0)
    turned.inputs["Angle"].default_value = angle
    axis.location, normal.location, turned.location = (x - 400, y), (x - 400, y - 200), (x - 200, y)
    links = (
        (axis.outputs[0], turned.inputs["Vector"]),
        (normal.outputs["Normal"], turned.inputs["Axis"]),
        (turned.outputs[0], model_nodes.sockets(node)[pack.TANGENT]),
    )
    for output, socket in links:
        tree.links.new(output, socket)
