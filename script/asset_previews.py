#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the previews of the library's materials for the Asset Browser.

Installs the extension as a user would. Runs in a Python that has the `bpy` module; see
script/assets. Previews whose material and scene match made.csv are not rendered again.
"""

import argparse
import hashlib
import importlib
import json
import sys
import tempfile
from pathlib import Path

import render_scene

#: Version of the scene, which the extension makes; raising it renders all pictures again.
SCENE = 1


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
    parser.add_argument("--size", type=int, help="pixels; that of the library")
    parser.add_argument("--samples", type=int, help="that of the library")
    options = parser.parse_args()
    made_file = options.out / "made.csv"
    rows = made_file.read_text(encoding="utf-8").split() if made_file.is_file() else []
    made = dict(row.split(",") for row in rows)
    with tempfile.TemporaryDirectory() as resources:
        bpy, loader = render_scene.start_blender(options.extension, Path(resources))
        package = loader.package
        library = importlib.import_module(f"{package}.library")
        preview = importlib.import_module(f"{package}.library.preview")
        api = importlib.import_module(f"{package}.api")
        entries = library.entries()
        unknown = set(options.only or ()) - {entry.name for entry in entries}
        if unknown:
            parser.error(f"--only: the library has no {', '.join(sorted(unknown))}")
        size, samples = options.size or preview.SIZE, options.samples or preview.SAMPLES
        scene, ball = preview.make_scene(size, samples)
        api.enable_osl(scene)
        for entry in entries:
            picture = options.out / entry.preview.name
            now = fingerprint(entry, size, samples)
            wanted = entry.name in options.only if options.only else made.get(picture.stem) != now
            if not wanted:
                continue
            material = library.make(api, entry)
            with render_scene.quiet():
                preview.render(api, scene, ball, material, picture)
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
