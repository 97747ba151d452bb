#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the previews of the library's materials for the Asset Browser.

Installs the extension as a user would. Runs in a Python that has the `bpy` module; see
script/assets. Each preview shows a ball on a tiled floor under a sky, with a lamp at the upper left
and a small one beside the camera. Previews whose material and scene match made.csv are not rendered
again.
"""

import argparse
import hashlib
import importlib
import json
import sys
import tempfile
from pathlib import Path

import render_scene

#: Version of the scene; raising it renders all pictures again.
SCENE = 1
SIZE, SAMPLES = 160, 32


def lambert(bpy, name):
    """Makes a node tree with a Diffuse node. Returns the node."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return material, tree, diffuse


def add_floor(bpy, scene):
    material, tree, diffuse = lambert(bpy, "Floor")
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


def add_ball(bpy, scene):
    """Adds a ball of radius 1. The tangent of materials runs along its meridians."""
    import bmesh

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


def add_lamp(bpy, scene, kind, location, power, **settings):
    from mathutils import Vector

    data = bpy.data.lights.new(kind.title(), kind)
    data.energy = power
    for key, value in settings.items():
        setattr(data, key, value)
    lamp = bpy.data.objects.new(kind.title(), data)
    lamp.location = location
    towards = Vector((0, 0, 1)) - Vector(location)
    lamp.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(lamp)


def add_sky(bpy, scene):
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


def add_camera(bpy, scene):
    from mathutils import Vector

    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width = 85, 36
    camera = bpy.data.objects.new("Camera", data)
    camera.location = (0, -6.6, 2.1)
    towards = Vector((0, 0, 0.97)) - camera.location
    camera.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(camera)
    scene.camera = camera


def make_scene(bpy, api, size, samples):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    api.enable_osl(scene)
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = samples, False
    scene.cycles.use_denoising, scene.cycles.denoiser = True, "OPENIMAGEDENOISE"
    scene.cycles.seed = 1
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.view_settings.view_transform = "Standard"
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.quality = "JPEG", "RGB", 88
    add_floor(bpy, scene)
    ball = add_ball(bpy, scene)
    add_lamp(bpy, scene, "AREA", (-3.2, -3.0, 5.0), 300, shape="DISK", size=1.2, use_shadow=True)
    add_lamp(bpy, scene, "POINT", (0.35, -6.4, 2.5), 60, shadow_soft_size=0.08)
    add_sky(bpy, scene)
    add_camera(bpy, scene)
    return scene, ball


def fingerprint(entry, size, samples):
    """A text that changes with everything that affects the picture."""
    what = [SCENE, size, samples, entry.model, entry.values]
    what += [entry.substance] if entry.substance else []
    return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()[:16]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True, help="folder of the pictures")
    parser.add_argument("--only", action="append", help="name of a material; may be repeated")
    parser.add_argument("--list", type=Path, help="file for a list of all materials, as JSON")
    parser.add_argument("--size", type=int, default=SIZE)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    options = parser.parse_args()
    made_file = options.out / "made.csv"
    rows = made_file.read_text(encoding="utf-8").split() if made_file.is_file() else []
    made = dict(row.split(",") for row in rows)
    with tempfile.TemporaryDirectory() as resources:
        bpy, loader = render_scene.start_blender(options.extension, Path(resources))
        package = loader.package
        library = importlib.import_module(f"{package}.library")
        api = importlib.import_module(f"{package}.api")
        entries = library.entries()
        unknown = set(options.only or ()) - {entry.name for entry in entries}
        if unknown:
            parser.error(f"--only: the library has no {', '.join(sorted(unknown))}")
        scene, ball = make_scene(bpy, api, options.size, options.samples)
        for entry in entries:
            picture = options.out / entry.preview.name
            now = fingerprint(entry, options.size, options.samples)
            wanted = entry.name in options.only if options.only else made.get(picture.stem) != now
            if not wanted:
                continue
            material = library.make(api, entry)
            ball.material_slots[0].material = material
            api.see_lamps(scene)
            scene.render.filepath = str(picture)
            with render_scene.quiet():
                bpy.ops.render.render(write_still=True)
            bpy.data.materials.remove(material)
            made[picture.stem] = now
            print(f"{entry.name}: {picture.name}", file=sys.stderr)
        if options.list:
            listed = [
                {
                    "name": entry.name,
                    "model": api.models()[entry.model]["label"],
                    "preview": str(options.out.resolve() / entry.preview.name),
                }
                for entry in entries
            ]
            options.list.write_text(json.dumps(listed), encoding="utf-8")
        known = {entry.preview.stem for entry in entries}
        for stale in options.out.glob("*.jpg"):
            if stale.stem not in known:
                stale.unlink()
    lines = [f"{name},{made[name]}\n" for name in sorted(made) if name in known]
    made_file.write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
