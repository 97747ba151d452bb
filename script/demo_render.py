#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders scenes in Blender, in every form, and with the reference renderer; writes their
runs.json.

For scenes/NAME.json, the folder OUT/NAME (OUT-VERSION/NAME for Blender versions other than 4.5)
gets the resolved scene, the reference picture, an EXR for each form and seed, and runs.json
(described in generator/report/report.h). Tasks run one after the other or, with --scheduler, on the
workers of a farm. Results of earlier runs with the same inputs and programs are kept, task by task.

demo_matrix.py lists the tasks, demo_tasks.py defines a task, demo_farm.py runs tasks, and
demo_records.py combines their records.
"""

import argparse
import json
import subprocess
import sys
import zipfile
from pathlib import Path

from demo_farm import Farm, LocalRunner, Progress
from demo_matrix import RENDER_SCENE, USUAL_BLENDER, Scene, folder_of, python_of
from demo_records import write_runs
from demo_tasks import ROOT, TaskError, digest, kept, read_json, write_json


def say(text):
    print(f"    {text}", flush=True)


def parse():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="+", type=Path, help="scenes/NAME.json")
    parser.add_argument("--tool", required=True, type=Path, help="the program brdfc")
    parser.add_argument("--extension", required=True, type=Path, help="brdfc_shaders-<version>.zip")
    parser.add_argument("--out", required=True, type=Path, help="folder of the results")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="of Dask, which `script/farm scheduler` starts"
    )
    parser.add_argument(
        "--blender",
        action="append",
        metavar="VERSION",
        help=f"an environment of script/lib.sh; may be repeated ({USUAL_BLENDER})",
    )
    parser.add_argument(
        "--seeds", type=int, default=4, help="pictures a form; share the scene's samples (4)"
    )
    parser.add_argument(
        "--convergence",
        action="store_true",
        help="also smaller pictures with 16, 256 and 1024 samples a pixel, for cost at equal error",
    )
    parser.add_argument(
        "--native", type=Path, help="output of native_nodes.py: also render Blender's own nodes"
    )
    parser.add_argument(
        "--plan",
        type=float,
        default=10,
        help="percent of the light that forms of a pack cut to the scene may be off (10)",
    )
    parser.add_argument(
        "--forms",
        choices=("all", "unit", "auto"),
        default="all",
        help="auto: what `auto` makes of the scene; unit: beside Blender's Glossy node (all)",
    )
    parser.add_argument("--spp", type=int, help="at most so many samples a pixel")
    parser.add_argument("--size", type=int, help="at most so many pixels along the longer side")
    parser.add_argument(
        "--reference-factor", type=int, default=4, help="times the scene's samples (4)"
    )
    options = parser.parse_args()
    options.blender = list(dict.fromkeys(options.blender or [USUAL_BLENDER]))
    if options.seeds < 2:
        parser.error("--seeds: expected at least 2, noise is estimated from their spread")
    if options.reference_factor < 1:
        parser.error("--reference-factor: expected at least 1")
    for name in ("tool", "extension", "out"):
        setattr(options, name, getattr(options, name).resolve())
    for path in (options.tool, options.extension, *options.scenes):
        if not path.is_file():
            parser.error(f"{path}: no such file")
    for version in options.blender:
        if not python_of(version).is_file():
            parser.error(f"--blender {version}: {python_of(version)}: no such file")
    options.native = read_json(options.native) if options.native else {}
    options.sums = {p: digest(p) for p in (options.tool, options.extension, RENDER_SCENE)}
    return options


def render(options, pool):
    """Runs the tasks that have no results yet, and writes runs.json of each scene as soon as it is
    complete."""
    with zipfile.ZipFile(options.extension) as archive:
        models = json.loads(archive.read("manifest.json"))["models"]
    version = subprocess.run([options.tool, "--version"], stdout=subprocess.PIPE, text=True)
    name = version.stdout.strip().removeprefix("brdfc ")
    about = {
        "Extension": f"{options.extension.name}, sha256 {options.sums[options.extension]}",
        "Tool": f"brdfc {name}, sha256 {options.sums[options.tool]}",
    }
    progress = Progress(say)
    tasks, missing = {}, {}  # all tasks that are known, and how many are not done, by scene

    def add(scene, new):
        tasks[scene.name] += new
        for task in new:
            if record := kept(task):
                finish(scene, task, record)
            else:
                progress.expect(task.kind, 1, task.work)
                pool.add([task])

    def finish(scene, task, record):
        scene.records[task.name] = record
        missing[scene.name] -= 1
        if task.kind == "plan":
            for kind, (count, work) in scene.expected().items():
                progress.expect(kind, -count, work)
            add(scene, scene.blender_tasks())
        if missing[scene.name] == 0:
            for version in options.blender:
                write_runs(scene, version, tasks[scene.name], about)
            say(f"{scene.name}: {', '.join(f.name for f in scene.forms)}")

    scenes = {}
    for index, source in enumerate(options.scenes):
        scene = Scene(source.resolve(), options, index, models)
        scenes[scene.name], tasks[scene.name] = scene, []
        new = scene.first_tasks()
        missing[scene.name] = len(new)
        if options.forms == "all":
            for kind, (count, work) in scene.expected().items():
                progress.expect(kind, count, work)
                missing[scene.name] += count
        add(scene, new)
    for task, record in pool:
        progress.finish(task, record, pool.workers)
        finish(scenes[task.name.split("/")[0]], task, record)


def leave_out_what_is_gone(out, sources):
    """Removes scenes that no longer exist, which would otherwise stay in the report."""
    known = {s.stem for s in (ROOT / "scenes").glob("*.json")} | {s.stem for s in sources}
    for folder in out.iterdir():
        if folder.is_dir() and (folder / "runs.json").exists() and folder.name not in known:
            say(f"{folder.name}: no such scene any more, left out of the report")
            (folder / "runs.json").unlink()
            (folder / "scene.json").unlink(missing_ok=True)


def link_versions(out):
    """Writes links.json for every version's report: links to the pages of the others."""
    folders = {USUAL_BLENDER: out} | {
        p.name.removeprefix(f"{out.name}-"): p for p in sorted(out.parent.glob(f"{out.name}-*.*"))
    }
    made = {v: p for v, p in folders.items() if any(p.glob("*/runs.json"))}
    for version, folder in made.items():
        links = {
            f"Blender {other}": f"../{made[other].name}/index.html"
            for other in made
            if other != version
        }
        if links or (folder / "links.json").exists():
            write_json(folder / "links.json", links)


def main():
    options = parse()
    try:
        render(options, Farm(options.scheduler, say) if options.scheduler else LocalRunner())
    except TaskError as error:
        print(f"demo_render: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(
            "demo_render: stopped; what is done is kept, and the same command goes on from there"
        )
    for version in options.blender:
        leave_out_what_is_gone(folder_of(options.out, version), options.scenes)
    link_versions(options.out)


if __name__ == "__main__":
    main()
