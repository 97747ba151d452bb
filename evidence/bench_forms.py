#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the CPU time of every form of every model, in units of Blender's own Glossy node.

Runs in a Python that has `bpy`. Renders a sphere under a sky with each model's default parameters.
All forms of a model take turns in one process, so that other load on the machine affects them
equally. Several processes are used, because times vary more between processes than within one. The
cost of a form is the median over all repetitions of its sampling time divided by that of the Glossy
node. Forms that need a fit come from a pack for these very materials. For aimed forms and Formula
Nodes, and for the Glossy node they are compared with, a point lamp is added to the sky: without
lamps they would have less to compute. Formula Nodes and their Glossy node are rendered with Open
Shading Language off, as in files at default settings. Prints CSV; the rows of a model appear as
soon as they are measured.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

RENDER_SCENE = Path(__file__).resolve().parents[1] / "script" / "render_scene.py"


#: Forms that aim at lamps: their scene has one.
LIT = ("aimed", "nodes")
#: Forms that are measured with Open Shading Language off.
WITHOUT_OSL = ("nodes",)


def surroundings(form):
    """Whether a form's scene has a lamp, and whether Open Shading Language is on."""
    return form in LIT, form not in WITHOUT_OSL


def scene(model, options, lit):
    lamp = {"type": "point", "position": [2, -3, 3], "radius": 0.1, "power": 300}
    return {
        "name": model,
        "description": "A sphere under a sky" + (", with a lamp" if lit else ""),
        "settings": {
            "width": options.size,
            "height": options.size,
            "spp": options.spp,
            "seed": 1,
            "max_bounces": 1,
        },
        "camera": {
            "type": "perspective",
            "position": [0, -4, 1],
            "look_at": [0, 0, 0],
            "up": [0, 0, 1],
            "fov_y_degrees": 28,
        },
        "materials": {"m": {"model": model}},
        "objects": [{"name": "ball", "shape": {"type": "sphere"}, "material": "m"}],
        "lights": [lamp] if lit else [],
        "environment": {"procedural": "sky"},
    }


def fits(options, model, forms, folder):
    """Builds a pack with every form made of a fit that the model has with its default parameters.
    Returns its folder and these forms."""
    material = {"model": model, "representation": "sampled" if "sampled" in forms else "auto"}
    file = folder / "materials.json"
    file.write_text(json.dumps({"materials": {"m": material}}), encoding="utf-8")
    # Any error limit will do: the fit is built beside the sampled form.
    command = [options.tool, "build", "--materials", file, "--error", "100", "--twin"]
    command += ["--out", folder]
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    pack = folder / "brdfc_shaders"
    manifest = json.loads((pack / "manifest.json").read_text(encoding="utf-8"))
    made = manifest["models"][model]["representations"]
    return pack, [form for form in made if form not in forms]


def measure(options, model, forms, folder):
    """Sampling times of each form, and of the Glossy node in its scene, by the form's name. The
    node itself comes first."""
    pack, fitted = None, []
    if not options.form or set(options.form) - set(forms):
        pack, fitted = fits(options, model, forms, folder)
    names = [n for n in (*forms, *fitted) if not options.form or n in options.form]
    if not names:
        return {}
    scenes = {lit: folder / ("lit" if lit else "sky") / "scene.json" for lit in (False, True)}
    for lit, file in scenes.items():
        file.parent.mkdir()
        source = file.with_name("source.json")
        source.write_text(json.dumps(scene(model, options, lit)), encoding="utf-8")
        subprocess.run([options.tool, "scene", source, "--out", file.parent], check=True)
    of_forms = [surroundings(name) for name in names]
    rendered = [("glossy", around) for around in dict.fromkeys(sorted(of_forms))]
    rendered += zip(names, of_forms, strict=True)
    jobs = [
        {
            "name": f"{model} {form}",
            "scene": str(scenes[lit]),
            "out": str(folder / f"{form}.exr"),
            "representation": form,
            "osl": osl,
            "repeat": options.repeat,
            "pack": str(pack) if form in fitted else None,
        }
        for form, (lit, osl) in rendered
    ]
    file = folder / "jobs.json"
    file.write_text(json.dumps(jobs), encoding="utf-8")
    command = [sys.executable, RENDER_SCENE, "--extension", options.extension, "--jobs", file]
    times = {key: [] for key in rendered}
    for _ in range(options.processes):
        done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
        for key, record in zip(rendered, json.loads(done.stdout), strict=True):
            times[key] += [r["sampling_cpu_seconds"] for r in record["repeats"]]
    # The node's own row shows its time under the sky alone, if that was rendered.
    shown = [rendered[0], *(key for key in rendered if key[0] != "glossy")]
    return {form: (times[form, around], times["glossy", around]) for form, around in shown}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tool", required=True, type=Path, help="the program brdfc")
    parser.add_argument("--extension", required=True, type=Path, help="brdfc_shaders-<version>.zip")
    parser.add_argument("--model", action="append", help="only this model; may be repeated")
    parser.add_argument("--form", action="append", help="only this form; may be repeated")
    parser.add_argument("--size", type=int, default=128, help="pixels along each side (128)")
    parser.add_argument("--spp", type=int, default=32, help="samples a pixel (32)")
    parser.add_argument("--repeat", type=int, default=3, help="renders a form and process (3)")
    parser.add_argument("--processes", type=int, default=3, help="processes a model (3)")
    options = parser.parse_args()
    if min(options.size, options.spp - 1, options.repeat, options.processes) < 1:
        parser.error(
            "expected --size, --repeat and --processes of at least 1 and --spp of at least 2"
        )
    for path in (options.tool, options.extension):
        if not path.is_file():
            parser.error(f"{path}: no such file")
    options.tool, options.extension = options.tool.resolve(), options.extension.resolve()
    with zipfile.ZipFile(options.extension) as archive:
        entries = json.loads(archive.read("manifest.json"))["models"]
    for name in options.model or []:
        if name not in entries:
            parser.error(f"--model: expected one of {', '.join(entries)}, got {name!r}")

    print("model,form,cost,cost_min,cost_max,cpu_ns_per_sample", flush=True)
    samples = options.size**2 * options.spp
    for model in options.model or entries:
        with tempfile.TemporaryDirectory(prefix="brdfc-bench-") as scratch:
            forms = list(entries[model]["representations"])
            times = measure(options, model, forms, Path(scratch))
        for form, (taken, unit) in times.items():
            costs = [t / u for t, u in zip(taken, unit, strict=True)]
            print(
                f"{model},{form},{statistics.median(costs):.3f},{min(costs):.3f},{max(costs):.3f},"
                f"{statistics.median(taken) / samples * 1e9:.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
