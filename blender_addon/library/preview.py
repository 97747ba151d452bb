# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene in which previews of materials are rendered: a ball on a tiled floor under a sky, with
a lamp at the upper left and a small one beside the camera."""

import bmesh
import bpy
import numpy as np
from mathutils import Vector

#: Width and height of a preview in pixels, and samples of each.
SIZE, SAMPLES = 160, 32


def lambert(name):
    """Makes a node tree with a Diffuse node. Returns the node."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return material, tree, diffuse


def add_floor(scene):
    material, tree, diffuse = lambert("Floor")
    place = tree.nodes.new("ShaderNodeTexCoord")
    tiles = tree.nodes.new("ShaderNodeTexChecker")
    tiles.inputs["Color1"].default_value = (0.42, 0.42, 0.42, 1)
    tiles.inputs["Color2"].default_value = (0.16, 0.16, 0.17, 1)
    tiles.inputs["Scale"].default_value = 1.25
    tree.links.new(place.outputs["Object"], tiles.inputs["Vector"])
    tree.links.new(tiles.outputs["Color"], diffuse.inputs["Color"])
    mesh = bpy.data.meshes.new("Floor")
    far = 60.0
    # The pattern is ambiguous on the planes of the checker itself, so the floor is slightly off
    # them.
    corners = [(-far, -far, 0.01), (far, -far, 0.01), (far, far, 0.01), (-far, far, 0.01)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    floor = bpy.data.objects.new("Floor", mesh)
    floor.location.z = -0.01
    scene.collection.objects.link(floor)


def add_ball(scene):
    """Adds a ball of radius 1. The tangent of materials runs along its meridians."""
    mesh = bpy.data.meshes.new("Ball")
    build = bmesh.new()
    bmesh.ops.create_uvsphere(build, u_segments=128, v_segments=64, radius=1)
    build.to_mesh(mesh)
    build.free()
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    mesh.materials.append(None)
    ball = bpy.data.objects.new("Ball", mesh)
    ball.location.z = 1
    scene.collection.objects.link(ball)
    return ball


def add_lamp(scene, kind, location, power, **settings):
    data = bpy.data.lights.new(kind.title(), kind)
    data.energy = power
    for key, value in settings.items():
        setattr(data, key, value)
    lamp = bpy.data.objects.new(kind.title(), data)
    lamp.location = location
    towards = Vector((0, 0, 1)) - Vector(location)
    lamp.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(lamp)


def add_sky(scene):
    """Adds a sky: bright above the horizon, darker at the zenith, dark below."""
    world = bpy.data.worlds.new("Sky")
    scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    place = tree.nodes.new("ShaderNodeTexCoord")
    height = tree.nodes.new("ShaderNodeSeparateXYZ")
    colors = tree.nodes.new("ShaderNodeValToRGB")
    background = tree.nodes.new("ShaderNodeBackground")
    output = tree.nodes.new("ShaderNodeOutputWorld")
    stops = colors.color_ramp.elements
    stops[0].position, stops[0].color = 0.0, (0.75, 0.72, 0.68, 1)
    stops[1].position, stops[1].color = 0.8, (0.27, 0.28, 0.3, 1)
    tree.links.new(place.outputs["Generated"], height.inputs[0])
    tree.links.new(height.outputs["Z"], colors.inputs[0])
    tree.links.new(colors.outputs[0], background.inputs["Color"])
    tree.links.new(background.outputs[0], output.inputs["Surface"])


def add_camera(scene):
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width = 85, 36
    camera = bpy.data.objects.new("Camera", data)
    camera.location = (0, -6.6, 2.1)
    towards = Vector((0, 0, 0.97)) - camera.location
    camera.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(camera)
    scene.camera = camera


def make_scene(size, samples):
    """Makes a new file with the scene. Returns the scene and the ball, whose slot is empty."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = samples, False
    try:
        scene.cycles.denoiser = "OPENIMAGEDENOISE"
    except TypeError:  # Debian's Blender is built without it
        scene.cycles.use_denoising = False
    else:
        scene.cycles.use_denoising = True
    scene.cycles.seed = 1
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.view_settings.view_transform = "Standard"
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.quality = "JPEG", "RGB", 88
    add_floor(scene)
    ball = add_ball(scene)
    add_lamp(scene, "AREA", (-3.2, -3.0, 5.0), 300, shape="DISK", size=1.2, use_shadow=True)
    add_lamp(scene, "POINT", (0.35, -6.4, 2.5), 60, shadow_soft_size=0.08)
    add_sky(scene)
    add_camera(scene)
    return scene, ball


def render(api, scene, ball, material, path):
    """Renders the material on the ball to a file."""
    ball.material_slots[0].material = material
    api.see_lamps(scene)
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def set_preview(material, path):
    """Sets the preview of a material from an image file, which is left unchanged."""
    image = bpy.data.images.load(str(path))
    try:
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        preview = material.preview_ensure()
        preview.image_size = tuple(image.size)
        preview.image_pixels_float.foreach_set(pixels)
    finally:
        bpy.data.images.remove(image)
