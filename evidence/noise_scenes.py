# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes in which evidence/noise_table.py measures noise: a ball on a floor, each under one
kind of light, with the settings of a new Blender file except for those in settings().

Needs `bpy`. Lamps have similar brightness: a white diffuse surface that faces one has a radiance of
about 1.
"""

import dataclasses
import math
from collections.abc import Callable

import bpy
import numpy as np
from mathutils import Matrix, Vector

#: Side of the picture in pixels; the ball takes 6/7 of it.
SIZE = 42
#: Irradiance, in W/m^2, of a surface that faces the lamps.
IRRADIANCE = 3.0
#: Direction from the ball's centre to single lamps, and their distance.
TOWARDS, FAR = Vector((0.5, -0.62, 0.6)).normalized(), 6.0
CENTRE = Vector((0, 0, 1))
CAMERA = Vector((0, -6.5, 2.2))
#: The part of the ball's disc that is measured; beyond it the pixel filter mixes in the floor.
INSIDE = 0.95


@dataclasses.dataclass(frozen=True)
class Condition:
    """A light condition. `light` adds lamps to the scene. `samples` is the default list of sample
    counts. `timed_as` names the condition whose run times are used for this one. `picked` restricts
    it to the cases of noise_table.REPRESENTATIVE_CASES unless others are named."""

    title: str
    light: Callable
    timed_as: str
    samples: tuple = (64,)
    picked: bool = False
    penumbra: bool = False
    floor: bool = True


# ---- parts -------------------------------------------------------------------------------------


def empty_tree(owner):
    if owner.node_tree is None:
        owner.use_nodes = True  # deprecated in 5.0, where the tree exists from the start
    owner.node_tree.nodes.clear()
    return owner.node_tree


def node_material(name, kind, **inputs):
    """Makes a material of one of Blender's own nodes."""
    material = bpy.data.materials.new(name)
    tree = empty_tree(material)
    node = tree.nodes.new(kind)
    if hasattr(node, "distribution"):
        node.distribution = "GGX"
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def link(scene, name, data, location=(0, 0, 0)):
    item = bpy.data.objects.new(name, data)
    item.location = location
    scene.collection.objects.link(item)
    return item


def aim(item, direction):
    """Rotates an object so that its -z axis, along which lamps shine and cameras look, has the
    direction."""
    item.rotation_euler = Vector(direction).to_track_quat("-Z", "Y").to_euler()


def sphere(scene, name, material, radius, location, segments=128):
    import bmesh

    mesh = bpy.data.meshes.new(name)
    build = bmesh.new()
    bmesh.ops.create_uvsphere(build, u_segments=segments, v_segments=segments // 2, radius=radius)
    build.to_mesh(mesh)
    build.free()
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    if material is not None:
        mesh.materials.append(material)
    return link(scene, name, mesh, location)


def quads(scene, name, material, corners):
    """Adds one mesh of quads with four corners each."""
    mesh = bpy.data.meshes.new(name)
    faces = [range(4 * i, 4 * i + 4) for i in range(len(corners))]
    mesh.from_pydata([c for quad in corners for c in quad], [], faces)
    if material is not None:
        mesh.materials.append(material)
    return link(scene, name, mesh)


def rectangle(x0, x1, y0, y1, z):
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]


def grey(name, value):
    return node_material(name, "ShaderNodeBsdfDiffuse", Color=(value, value, value, 1))


def world(scene, strength=0.05):
    """Adds the grey world of a new file. Returns its tree and Background node."""
    made = bpy.data.worlds.new("World")
    scene.world = made
    tree = empty_tree(made)
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    background.inputs["Strength"].default_value = strength
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    return tree, background


# ---- lights ------------------------------------------------------------------------------------


def lamp(scene, kind, name="Lamp", towards=TOWARDS, distance=FAR, share=1.0, **values):
    """Adds a lamp that gives the ball's centre `share` of IRRADIANCE."""
    data = bpy.data.lights.new(name, kind)
    for key, value in values.items():
        setattr(data, key, value)
    per_watt = {"SUN": 1.0, "POINT": 1 / (4 * math.pi * distance**2)}
    per_watt["AREA"] = 1 / (math.pi * distance**2)
    data.energy = share * IRRADIANCE / per_watt[kind]
    item = link(scene, name, data, CENTRE + distance * towards)
    aim(item, -towards)
    return item


def point(scene, _folder):
    lamp(scene, "POINT", shadow_soft_size=0.1)


def four_points(scene, _folder):
    for index, (x, y, z) in enumerate(
        ((0.5, -0.62, 0.6), (-0.7, -0.4, 0.6), (0.1, 0.5, 0.9), (-0.2, -0.9, 0.15))
    ):
        towards = Vector((x, y, z)).normalized()
        lamp(scene, "POINT", f"Lamp {index}", towards, share=0.4, shadow_soft_size=0.1)


def sun(scene, _folder):
    lamp(scene, "SUN", angle=math.radians(0.5))


def sun_without_angle(scene, _folder):
    lamp(scene, "SUN", angle=0.0)


def area(scene, _folder):
    lamp(scene, "AREA", shape="SQUARE", size=1.0)


def strip(scene, _folder):
    """Adds a softbox of 2 x 0.3 m."""
    lamp(scene, "AREA", shape="RECTANGLE", size=2.0, size_y=0.3)


def window(scene, _folder):
    """Adds four panes of 0.5 m with common edges, which make up a lamp of 1 m."""
    axes = TOWARDS.to_track_quat("Z", "Y").to_matrix().transposed()
    for x in (-0.25, 0.25):
        for y in (-0.25, 0.25):
            pane = lamp(scene, "AREA", f"Pane {x} {y}", share=0.25, shape="SQUARE", size=0.5)
            pane.location += x * axes[0] + y * axes[1]


def softboxes(scene, _folder):
    """Adds an arc of five softboxes of 1.8 m that face the ball. Circles around them overlap."""
    for degrees in range(-60, 61, 30):
        turn = Matrix.Rotation(math.radians(degrees), 3, "Z")
        lamp(scene, "AREA", f"At {degrees}", turn @ TOWARDS, share=0.2, shape="SQUARE", size=1.8)


def emissive_ball(scene, _folder):
    radius, distance = 0.2, 4.0
    strength = IRRADIANCE * distance**2 / (math.pi * radius**2)
    material = node_material("Lamp", "ShaderNodeEmission", Strength=strength)
    sphere(scene, "Lamp", material, radius, CENTRE + distance * TOWARDS, segments=24)


def emissive_plane(scene, _folder):
    """Adds a softbox as users often make it: a plane of 1.5 x 1 m with an Emission node."""
    width, height, distance = 1.5, 1.0, 4.0
    strength = IRRADIANCE * distance**2 / (width * height)
    material = node_material("Lamp", "ShaderNodeEmission", Strength=strength)
    plane = quads(
        scene,
        "Lamp",
        material,
        [rectangle(-width / 2, width / 2, -height / 2, height / 2, 0)],
    )
    plane.location = CENTRE + distance * TOWARDS
    aim(plane, -TOWARDS)


def sky_texture(scene, _folder):
    """Adds the Sky Texture node with its defaults and its sun, only dimmed and turned to light the
    ball."""
    tree, background = world(scene, strength=0.05)
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sun_elevation = math.radians(37)
    sky.sun_rotation = math.radians(140)
    tree.links.new(sky.outputs["Color"], background.inputs["Color"])


def _gradient(direction):
    """A smooth sky that is bright upwards and to one side. (n, 3) to (n,)."""
    return 0.35 + 0.3 * direction @ np.array(TOWARDS)


def smooth_sky(scene, _folder):
    tree, background = world(scene)
    place = tree.nodes.new("ShaderNodeTexCoord")
    dot = tree.nodes.new("ShaderNodeVectorMath")
    dot.operation = "DOT_PRODUCT"
    dot.inputs[1].default_value = TOWARDS
    tree.links.new(place.outputs["Generated"], dot.inputs[0])
    scaled = tree.nodes.new("ShaderNodeMath")
    scaled.operation = "MULTIPLY_ADD"
    scaled.inputs[1].default_value, scaled.inputs[2].default_value = 0.3, 0.35
    tree.links.new(dot.outputs["Value"], scaled.inputs[0])
    tree.links.new(scaled.outputs[0], background.inputs["Strength"])


#: For the environment image: azimuth and height in degrees, radius of the blob in radians,
#: radiance.
BLOBS = ((-51, 37, 0.06, 120.0), (-150, 20, 0.04, 150.0), (60, 50, 0.1, 20.0))


def environment_image(scene, folder):
    """A smooth sky with a few bright blobs."""
    height = 256
    v, u = np.mgrid[0:height, 0 : 2 * height] + 0.5
    z = math.pi * (v / height - 0.5)
    azimuth = 2 * math.pi * (0.5 - u / (2 * height))
    d = np.stack([np.cos(z) * np.cos(azimuth), np.cos(z) * np.sin(azimuth), np.sin(z)], -1)
    radiance = np.repeat(_gradient(d)[..., None], 3, -1) * (0.8, 0.9, 1.0)
    for turn, rise, radius, value in BLOBS:
        turn, rise = math.radians(turn), math.radians(rise)
        axis = (math.cos(rise) * math.cos(turn), math.cos(rise) * math.sin(turn), math.sin(rise))
        radiance += (value * np.exp((d @ axis - 1) / radius**2))[..., None]
    pixels = np.ones((height, 2 * height, 4), np.float32)
    pixels[..., :3] = radiance
    image = bpy.data.images.new("sky", 2 * height, height, float_buffer=True)
    image.colorspace_settings.is_data = True
    image.pixels.foreach_set(pixels.ravel())
    image.file_format, image.filepath_raw = "OPEN_EXR", str(folder / "sky.exr")
    image.save()
    bpy.data.images.remove(image)
    tree, background = world(scene, strength=1.0)
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = bpy.data.images.load(str(folder / "sky.exr"))
    node.image.colorspace_settings.is_data = True
    tree.links.new(node.outputs["Color"], background.inputs["Color"])


def interior(scene, _folder):
    """Adds a room around ball and camera. A sun shines through a hole in its ceiling on the floor
    behind the ball, which sees no lamp directly."""
    x0, x1, y0, y1, top = -4.0, 4.0, -7.5, 4.5, 4.0
    hole = (-3.5, -0.5, 0.8, 3.8)
    corners = [
        [(x0, y0, 0), (x1, y0, 0), (x1, y0, top), (x0, y0, top)],
        [(x0, y1, 0), (x1, y1, 0), (x1, y1, top), (x0, y1, top)],
        [(x0, y0, 0), (x0, y1, 0), (x0, y1, top), (x0, y0, top)],
        [(x1, y0, 0), (x1, y1, 0), (x1, y1, top), (x1, y0, top)],
        rectangle(x0, hole[0], y0, y1, top),
        rectangle(hole[1], x1, y0, y1, top),
        rectangle(hole[0], hole[1], y0, hole[2], top),
        rectangle(hole[0], hole[1], hole[3], y1, top),
    ]
    quads(scene, "Room", grey("Room", 0.8), corners)
    towards = Vector((-0.05, -0.1, 1)).normalized()
    lamp(scene, "SUN", towards=towards, share=8, angle=math.radians(0.5))


CONDITIONS = {
    "point": Condition("point lamp, radius 0.1", point, "point"),
    "four_points": Condition("four point lamps", four_points, "four_points"),
    "sun": Condition("sun, 0.5°", sun, "point"),
    "sun_angle_0": Condition("sun, angle 0", sun_without_angle, "point"),
    "area": Condition("area lamp, 1 m", area, "point"),
    "emissive_ball": Condition("emissive ball, radius 0.2", emissive_ball, "point"),
    "emissive_plane": Condition("emissive plane, 1.5 x 1 m", emissive_plane, "point"),
    "sky_texture": Condition("Sky Texture with sun", sky_texture, "point"),
    "smooth_sky": Condition("smooth sky", smooth_sky, "smooth_sky"),
    # Light from the floor takes many random numbers, which hides how fast closures converge.
    "open_sky": Condition(
        "smooth sky, no floor", smooth_sky, "smooth_sky", (64, 1024), floor=False
    ),
    "environment": Condition("environment image", environment_image, "environment"),
    "interior": Condition("interior, indirect light", interior, "point"),
    "penumbra": Condition(
        "penumbra of a ball, area lamp", None, "point", (1024,), picked=True, penumbra=True
    ),
}

#: Conditions that only evidence/nodes measures.
FLAT_CONDITIONS = {
    "strip": Condition("strip, 2 x 0.3 m", strip, "point"),
    "window": Condition("four panes of 0.5 m", window, "point"),
    "softboxes": Condition("five softboxes of 1.8 m", softboxes, "point"),
}


# ---- scenes ------------------------------------------------------------------------------------


def settings(scene, size):
    """Settings other than those of a new file: equal samples, raw pictures, one thread."""
    cycles, render = scene.cycles, scene.render
    render.engine = "CYCLES"
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.use_animated_seed = False
    # Shaders and importance maps are computed once for all pictures of a scene.
    render.use_persistent_data = True
    render.threads_mode, render.threads = "FIXED", 1
    render.use_compositing = render.use_sequencer = False
    render.dither_intensity = 0
    render.resolution_x = render.resolution_y = size
    render.resolution_percentage = 100
    image = render.image_settings
    image.file_format, image.color_mode = "OPEN_EXR", "RGBA"
    image.color_depth, image.exr_codec = "32", "NONE"
    scene.view_settings.view_transform = "Raw"


def camera(scene, location, target, angle):
    data = bpy.data.cameras.new("Camera")
    data.sensor_fit, data.angle = "VERTICAL", angle
    scene.camera = link(scene, "Camera", data, location)
    aim(scene.camera, target - location)


def build(name, folder, size=SIZE):
    """Builds the scene of a condition in an empty file. Returns (scene, the object that gets the
    model's material, mask of the measured pixels with row 0 at the bottom)."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene, condition = bpy.context.scene, (CONDITIONS | FLAT_CONDITIONS)[name]
    settings(scene, size)
    if condition.penumbra:
        return scene, *_penumbra(scene, size)
    world(scene)
    if condition.floor:
        quads(scene, "Floor", grey("Floor", 0.5), [rectangle(-20, 20, -20, 20, 0)])
    ball = sphere(scene, "Ball", None, 1.0, CENTRE)
    distance = (CAMERA - CENTRE).length
    half = math.asin(1 / distance)
    camera(scene, CAMERA, CENTRE, 2 * math.atan(math.tan(half) * 7 / 6))
    condition.light(scene, folder)
    x, y = _screen(size)
    return scene, ball, x**2 + y**2 <= (INSIDE * 6 / 7) ** 2


def _screen(size):
    """Coordinates of the pixels in the picture, from -1 to 1."""
    y, x = np.mgrid[0:size, 0:size]
    return (2 * x + 1) / size - 1, (2 * y + 1) / size - 1


def _penumbra(scene, size):
    """Adds a floor with the model, seen in the mirror direction of an area lamp where the edge of a
    ball's shadow crosses it. There f and the lamp's visibility both vary over the lamp."""
    world(scene)
    floor = quads(scene, "Floor", None, [rectangle(-20, 20, -20, 20, 0)])
    towards = Vector((0, 0.75, 0.65)).normalized()
    light = lamp(scene, "AREA", towards=towards, shape="SQUARE", size=1.0)
    light.location = FAR * towards
    # The line from the lamp's centre to the origin touches the ball.
    centre = 2.0 * towards + Vector((1, 0, 0))
    sphere(scene, "Ball", grey("Ball", 0.5), 1.0, centre)
    eye = FAR * Vector((0, -towards.y, towards.z))
    half = math.atan(0.5 / FAR)
    camera(scene, eye, Vector((0, 0, 0)), 2 * half)
    bpy.context.view_layer.update()

    # Where each pixel's ray meets the floor, and the part of the lamp that is visible from there.
    x, y = _screen(size)
    turn = np.array(scene.camera.matrix_world.to_3x3())
    rays = np.stack([x * math.tan(half), y * math.tan(half), -np.ones_like(x)], -1) @ turn.T
    places = np.array(eye) - rays * (eye.z / rays[..., 2:])
    i, j = (np.mgrid[0:16, 0:16].reshape(2, -1) + 0.5) / 16 - 0.5
    axes = np.array(light.matrix_world.to_3x3())
    points = np.array(light.location) + np.outer(i, axes[:, 0]) + np.outer(j, axes[:, 1])
    along = points - places[..., None, :]
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    off = np.array(centre) - places[..., None, :]
    nearest = np.linalg.norm(np.cross(along, off), axis=-1)
    seen = (nearest > 1).mean(-1)
    return floor, (seen > 0.02) & (seen < 0.98)
