#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures what a material costs before the first sample of a render: Cycles reads its nodes and
compiles its shader, in every render.

Runs in a Python that has `bpy`. Each picture has one sample of 16 x 16 pixels, of cubes with
different materials of one model under the lamp of a new file. Forms and Blender's Principled BSDF
take turns, and the least time of each counts. Prints a table of CPU seconds for each material.
"""

import argparse
import os
import random
import sys
import tempfile
import time

# Blender reads it when bpy is imported.
_FOLDER = tempfile.TemporaryDirectory(prefix="brdfc-start-")
os.environ["BLENDER_USER_RESOURCES"] = _FOLDER.name

import bpy  # noqa: E402

#: What a material gets with Open Shading Language off.
AUTO = "auto"


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--extension", required=True, help="zip of the extension")
    parser.add_argument("--model", action="append", help="only this model; may be repeated")
    parser.add_argument("--materials", type=int, default=8, help="materials in a picture")
    parser.add_argument("--repeat", type=int, default=3, help="pictures of each form")
    return parser.parse_args(sys.argv[1:])


def install(zip_):
    """Installs the extension; returns its api."""
    bpy.ops.preferences.addon_enable(module="bl_pkg")
    bpy.ops.extensions.package_install_files(
        filepath=zip_, repo="user_default", enable_on_install=True
    )
    from bl_ext.user_default.brdfc_shaders import api

    return api


def new_file(count):
    """A new file with so many cubes, whose pictures take hardly any time to sample."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = 16
    mesh = bpy.data.objects["Cube"].data
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    for index in range(count):
        cube = bpy.data.objects.new("Cube", mesh.copy())
        cube.location, cube.scale = (index % 8, index // 8, 0), (0.1,) * 3
        scene.collection.objects.link(cube)
    return scene


def varied(material):
    """A copy of a material with numbers of its own, so that no two shaders are equal."""
    copy = material.copy()
    for node in copy.node_tree.nodes:
        for socket in node.inputs if node.type in ("GROUP", "BSDF_PRINCIPLED") else ():
            if socket.type == "RGBA" and not socket.is_linked:
                socket.default_value = (*(random.uniform(0.1, 0.9) for _ in range(3)), 1)
    return copy


def seconds(scene, materials):
    """CPU seconds of a picture of these materials."""
    cubes = [item for item in scene.objects if item.type == "MESH"]
    for cube, material in zip(cubes, materials, strict=True):
        cube.data.materials.clear()
        cube.data.materials.append(material)
    begin = time.process_time()
    bpy.ops.render.render()
    return time.process_time() - begin


def script_forms(entry):
    """The forms of a model that need Open Shading Language."""
    return [form for form, made in entry["representations"].items() if made.get("shader")]


def measured(api, model, options):
    """{form: CPU seconds for each material}, including that of the Principled BSDF."""
    scene = new_file(options.materials)
    originals = {"principled": bpy.data.materials.new("Principled")}
    originals["principled"].use_nodes = True
    scripts = script_forms(api.models()[model])
    for form in (AUTO, *scripts):
        originals[form] = api.new_material(model, representation=form)
    sets = {f: [varied(m) for _ in range(options.materials)] for f, m in originals.items()}
    least = dict.fromkeys(["empty", *sets], float("inf"))
    for _ in range(options.repeat):
        for form, materials in [("empty", [None] * options.materials), *sets.items()]:
            scene.cycles.shading_system = form in scripts
            least[form] = min(least[form], seconds(scene, materials))
    empty = least.pop("empty")
    return {form: (s - empty) / options.materials for form, s in least.items()}


def main():
    options = arguments()
    random.seed(1)
    api = install(options.extension)
    models = api.models()
    if unknown := set(options.model or ()) - set(models):
        sys.exit(f"no model is named {', '.join(sorted(unknown))}")
    columns = list(dict.fromkeys(f for entry in models.values() for f in script_forms(entry)))
    columns = ["principled", AUTO, *columns]
    print("model," + ",".join(columns), flush=True)
    for model in options.model or list(models):
        found = measured(api, model, options)
        row = [f"{found[c]:.3f}" if c in found else "" for c in columns]
        print(",".join([model, *row]), flush=True)


main()
