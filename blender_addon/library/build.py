# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the library's files; run by a separate Blender, whose open file is discarded:

    blender --background --factory-startup --python build.py -- FOLDER [LIST]

Without a list it makes the library of ready-made materials; the list, which measured.py writes, is
of measured files and what was fitted to them. The extension need not be enabled there. Exit status:
0, or 1 with the reason in the last line.
"""

import importlib.util
import json
import os
import sys
from pathlib import Path

import bpy

AUTHOR = "brdfc contributors"
LICENSE = "GPL-3.0-or-later"
#: What the functions below are given of the extension.
MODULES = ("library", "library.preview", "api")


def load_package():
    """Imports and registers the extension that contains this file, under a name of its own."""
    root = Path(__file__).resolve().parent.parent
    spec = importlib.util.spec_from_file_location(
        "brdfc_at_work", root / "__init__.py", submodule_search_locations=[str(root)]
    )
    package = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = package
    spec.loader.exec_module(package)
    package.register()
    return spec.name


def write(path, materials):
    bpy.data.libraries.write(str(path), materials, compress=True)


def make(library, preview, api, entry):
    material = library.make(api, entry)
    material.name = entry.name
    material.asset_mark()
    data = material.asset_data
    data.description = library.description(entry)
    data.author, data.license = AUTHOR, LICENSE
    data.catalog_id = library.catalog_id(entry.catalog)
    for tag in library.tags(entry):
        data.tags.new(tag, skip_if_exists=True)
    if entry.preview.is_file():
        preview.set_preview(material, entry.preview)
    print(f"brdfc: made {entry.name}", flush=True)
    return material


def make_all(folder, library, preview, api):
    import _cycles  # found once bpy is imported

    found, materials = library.entries(), set()
    for entry in found:
        try:
            materials.add(make(library, preview, api, entry))
        except api.CompileError as error:
            if _cycles.with_osl:
                raise
            print(f"brdfc: left out {entry.name}: {error}", flush=True)
    write(folder / library.BLEND, materials)
    (folder / library.CATALOGS).write_text(library.catalogs_text(found), encoding="utf-8")
    (folder / library.STAMP).write_text(json.dumps(library.stamp()) + "\n", encoding="utf-8")


def make_measured(folder, library, preview, api, fits):
    """Makes a material of each file, with a picture of it. A material that can't be made is left
    out, and told in the file of refusals."""
    scene, ball = preview.make_scene(preview.SIZE, preview.SAMPLES)
    picture = folder / "preview.jpg"
    materials, refusals = set(), {}
    for entry in json.loads(fits.read_text(encoding="utf-8")):
        found = api.Measured.of_json(entry["path"], entry["told"])
        try:
            material = api.new_measured_material(found, entry["model"], entry["representation"])
        except (ValueError, RuntimeError) as error:
            refusals[entry["path"]] = str(error)
            continue
        material.name = entry["name"]
        preview.render(api, scene, ball, material, picture)
        material.asset_mark()
        data = material.asset_data
        data.description, data.catalog_id = entry["description"], entry["catalog_id"]
        for tag in entry["tags"]:
            data.tags.new(tag, skip_if_exists=True)
        preview.set_preview(material, picture)
        materials.add(material)
        print(f"brdfc: made {entry['name']}", flush=True)
    for item in list(scene.objects):
        bpy.data.objects.remove(item)
    api.see_lamps(scene)  # so that no material holds the lamps of the pictures
    if materials:
        write(folder / library.BLEND, materials)
    (folder / library.REFUSALS).write_text(json.dumps(refusals), encoding="utf-8")


def main(folder, *fits):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.engine = "CYCLES"
    package = load_package()
    parts = [importlib.import_module(f"{package}.{name}") for name in MODULES]
    if fits:
        make_measured(Path(folder), *parts, Path(fits[0]))
    else:
        make_all(Path(folder), *parts)


if __name__ == "__main__":
    try:
        main(*sys.argv[sys.argv.index("--") + 1 :])
    except Exception as error:
        print(f"{type(error).__name__}: {error}", flush=True)
        os._exit(1)
    os._exit(0)  # all is written: skips Blender's shutdown
