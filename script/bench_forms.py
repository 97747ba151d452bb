#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""CPU time of every form of every model, in units of Blender's own Glossy node.

Runs in a Python that has `bpy`. A sphere under a sky is rendered with each model's default
parameters, all forms in turns in one process; the cost of a form is the median over the
repetitions of its sampling time divided by that of the Glossy node. Forms made of a fit come from
a pack of these very materials. Prints CSV.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

RENDER_SCENE = Path(__file__).resolve().parent / "render_scene.py"


def scene(model, options):
    return {
        "name": model,
        "description": "A sphere under a sky",
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
        "environment": {"procedural": "sky"},
    }


def fits(tool, models, folder):
    """A pack with every form made of a fit that the models have with their default parameters: its
    folder, and the forms by model."""
    materials = {
        name: {"model": name, "representation": "sampled" if "sampled" in forms else "auto"}
        for name, forms in models.items()
    }
    file = folder / "materials.json"
    file.write_text(json.dumps({"materials": materials}), encoding="utf-8")
    # Any error will do: the fit comes beside the sampled form.
    options = ("--error", "100", "--controlled", "--twin", "--out", folder)
    subprocess.run(
        [tool, "build", "--materials", file, *options], stdout=subprocess.DEVNULL, check=True
    )
    pack = folder / "brdfc_shaders"
    made = json.loads((pack / "manifest.json").read_text(encoding="utf-8"))["models"]
    return pack, {
        name: [f for f in made[name]["representations"] if f not in forms]
        for name, forms in models.items()
    }


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tool", required=True, type=Path, help="the program brdfc")
    parser.add_argument("--extension", required=True, type=Path, help="brdfc_shaders-<version>.zip")
    parser.add_argument("--size", type=int, default=128, help="pixels along each side (128)")
    parser.add_argument("--spp", type=int, default=64, help="samples a pixel (64)")
    parser.add_argument("--repeat", type=int, default=3, help="renders a form (3)")
    options = parser.parse_args()
    if min(options.size, options.spp - 1, options.repeat) < 1:
        parser.error("expected --size and --repeat of at least 1 and --spp of at least 2")
    for path in (options.tool, options.extension):
        if not path.is_file():
            parser.error(f"{path}: no such file")
    with zipfile.ZipFile(options.extension) as archive:
        entries = json.loads(archive.read("manifest.json"))["models"]
    models = {name: list(entry["representations"]) for name, entry in entries.items()}
    options.tool = options.tool.resolve()

    with tempfile.TemporaryDirectory(prefix="brdfc-bench-") as scratch:
        pack, fitted = fits(options.tool, models, Path(scratch))
        jobs = []
        for model, forms in models.items():
            folder = Path(scratch) / model
            folder.mkdir()
            source = folder / "source.json"
            source.write_text(json.dumps(scene(model, options)), encoding="utf-8")
            subprocess.run([options.tool, "scene", source, "--out", folder], check=True)
            for form in ("glossy", *forms, *fitted[model]):
                jobs.append(
                    {
                        "name": f"{model} {form}",
                        "scene": str(folder / "scene.json"),
                        "out": str(folder / f"{form}.exr"),
                        "representation": form,
                        "repeat": options.repeat,
                        "pack": str(pack) if form in fitted[model] else None,
                    }
                )
        job_file = Path(scratch) / "jobs.json"
        job_file.write_text(json.dumps(jobs), encoding="utf-8")
        command = [sys.executable, RENDER_SCENE, "--extension", options.extension.resolve()]
        done = subprocess.run([*command, "--jobs", job_file], stdout=subprocess.PIPE, check=True)

    times = {
        record["name"]: [r["sampling_cpu_seconds"] for r in record["repeats"]]
        for record in json.loads(done.stdout)
    }
    print("model,form,cost,cost_min,cost_max,cpu_ns_per_sample")
    samples = options.size**2 * options.spp
    for model, forms in models.items():
        unit = times[f"{model} glossy"]
        for form in ("glossy", *forms, *fitted[model]):
            taken = times[f"{model} {form}"]
            costs = [t / u for t, u in zip(taken, unit, strict=True)]
            print(
                f"{model},{form},{statistics.median(costs):.3f},{min(costs):.3f},{max(costs):.3f},"
                f"{statistics.median(taken) / samples * 1e9:.1f}"
            )


if __name__ == "__main__":
    main()
