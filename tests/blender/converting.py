# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of Blender's own nodes, for tests of their conversion."""

import bpy
import helpers
import numpy as np

OUTPUT = "ShaderNodeOutputMaterial"
KINDS = {
    "diffuse": "ShaderNodeBsdfDiffuse",
    "glossy": "ShaderNodeBsdfAnisotropic",
    "principled": "ShaderNodeBsdfPrincipled",
    "glass": "ShaderNodeBsdfGlass",
    "metallic": "ShaderNodeBsdfMetallic",
}


def material_of(kind, distribution=None, **inputs):
    """A material of one node; inputs by name, with underscores for spaces."""
    material = bpy.data.materials.new(kind)
    tree = helpers.empty_tree(material)
    node = tree.nodes.new(KINDS[kind])
    if distribution:
        node.distribution = distribution
    for name, value in inputs.items():
        socket = node.inputs[name.replace("_", " ")]
        socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material, node


def only(plans):
    (plan,) = plans
    return plan


def linked(material, node, socket, kind="ShaderNodeRGB"):
    source = material.node_tree.nodes.new(kind)
    material.node_tree.links.new(source.outputs[0], node.inputs[socket])
    return source


def keyed(socket, name="default_value"):
    socket.keyframe_insert(name, frame=1)


def driven(socket):
    curve = socket.driver_add("default_value")
    (curve[0] if isinstance(curve, list) else curve).driver.expression = "frame / 100"


def played(socket):
    """By a strip in the Nonlinear Animation editor."""
    keyed(socket)
    data = socket.id_data.animation_data
    action, slot = data.action, data.action_slot
    data.nla_tracks.new().strips.new("Strip", 1, action).action_slot = slot
    data.action = None


def picture_node(tree, *pixels, data=True):
    """An Image Texture with one row of pixels, (r, g, b) or (r, g, b, a) each."""
    floats = {"float_buffer": max(map(max, pixels)) > 1}  # bytes can't exceed 1
    image = bpy.data.images.new("Image", len(pixels), 1, alpha=True, is_data=data, **floats)
    image.pixels.foreach_set(np.array([(*p, 1.0)[:4] for p in pixels], np.float32).ravel())
    image.pack()
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = image, "Closest"
    return node


def flat(scene, material):
    """Colours of a plane in a white world, from left to right over the image on it."""
    if "Plane" not in bpy.data.objects:
        bpy.ops.mesh.primitive_plane_add(size=2, rotation=(np.pi / 2, 0, 0))
        helpers.add_camera(scene, orthographic=2)
        helpers.add_world(scene)
        scene.render.resolution_x = scene.render.resolution_y = 8
        scene.cycles.samples, scene.cycles.max_bounces = 512, 8
        scene.cycles.sample_clamp_indirect = 0
    bpy.data.objects["Plane"].data.materials.clear()
    bpy.data.objects["Plane"].data.materials.append(material)
    seen = helpers.render(scene)[2:6, :, :3]
    return seen[:, :4].mean((0, 1)), seen[:, 4:].mean((0, 1))
