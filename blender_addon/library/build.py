# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the library's files; run by a separate Blender, whose open file is discarded:

    blender --background --factory-startup --python build.py -- FOLDER

The extension need not be enabled there. Exit status: 0, or 1 with the reason in the last line.
"""

import importlib.util
import json
import os
import sys
from pathlib import Path

import bpy
import numpy as np

AUTHOR = "brdfc contributors"
LICENSE = "GPL-3.0-or-later"


def load_package():
    """Imports the extension that contains this file, under a name of its own."""
    root = Path(__file__).resolve().parent.parent
    spec = importlib.util.spec_from_file_location(
        "brdfc_at_work", root / "__init__.py", submodule_search_locations=[str(root)]
    )
    package = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = package
    spec.loader.exec_module(package)
    return spec.name


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


def make(library, api, entry):
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
        set_preview(material, entry.preview)
    print(f"brdfc: made {entry.name}", flush=True)
    return material


def main(folder):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.engine = "CYCLES"
    package = load_package()
    library = importlib.import_module(f"{package}.library")
    api = importlib.import_module(f"{package}.api")
    found = library.entries()
    materials = {make(library, api, entry) for entry in found}
    folder = Path(folder)
    bpy.data.libraries.write(str(folder / library.BLEND), materials, compress=True)
    (folder / library.CATALOGS).write_text(library.catalogs_text(found), encoding="utf-8")
    (folder / library.STAMP).write_text(json.dumps(library.stamp()) + "\n", encoding="utf-8")


if __name__ == "__main__":
    try:
        main(sys.argv[sys.argv.index("--") + 1])
    except Exception as error:
        print(f"{type(error).__name__}: {error}", flush=True)
        os._exit(1)
    os._exit(0)  # all is written: skips Blender's shutdown
