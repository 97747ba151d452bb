#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders scenes in Blender, in every form, and by the reference renderer; leaves a runs.json each.

Runs in a Python that has `bpy`. For scenes/NAME.json it fills OUT/NAME with the resolved scene, the
reference, an EXR for every form and seed, and runs.json (described in generator/report/report.h).
What was rendered before from the same inputs by the same programs is kept.
"""

import argparse
import hashlib
import json
import os
import platform
import shlex
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
#: Samples a pixel, pictures of each, pixels along the longer side.
CONVERGENCE_SPP, CONVERGENCE_SEEDS, CONVERGENCE_SIZE = (16, 256, 1024), 4, 64
RENDER_SCENE = ROOT / "script" / "render_scene.py"


class Form(NamedTuple):
    """What a scene is rendered with."""

    name: str
    representation: str
    pack: str | None = None  #: folder, beside the scene, of a pack cut to it


def digest(*parts):
    """SHA-256 over texts and the contents of files, with their order and lengths."""
    total = hashlib.sha256()
    for part in parts:
        data = part.read_bytes() if isinstance(part, Path) else str(part).encode()
        total.update(f"{len(data)}:".encode() + data)
    return total.hexdigest()


def resolved_files(folder):
    """scene.json of a resolved scene and every file it names, in a stable order."""
    scene = folder / "scene.json"
    found = set()

    def walk(value):
        if isinstance(value, dict):
            for item in value.values():
                walk(item)
        elif isinstance(value, list):
            for item in value:
                walk(item)
        # Not Path.is_file: a description may be too long for a name.
        elif isinstance(value, str) and value and os.path.isfile(folder / value):
            found.add(folder / value)

    walk(read_json(scene))
    return [scene, *sorted(found)]


def run(command, **options):
    """Runs a command; a failure ends this program with the command's status."""
    done = subprocess.run([str(c) for c in command], **options)
    if done.returncode != 0:
        print(f"demo_render: failed: {shown(command)}", file=sys.stderr)
        sys.exit(done.returncode if done.returncode > 0 else 1)
    return done


def shown(command):
    """A command as a person would type it in the root of the repository."""
    short = []
    for word in command:
        path = Path(word)
        inside = path.is_absolute() and path.is_relative_to(ROOT)
        short.append(str(path.relative_to(ROOT)) if inside else str(word))
    return shlex.join(short)


def read_json(path):
    return json.loads(path.read_text(encoding="utf-8"))


def write_json(path, value):
    beside = path.with_name(f".{path.name}.part")
    beside.write_text(json.dumps(value, indent=1) + "\n", encoding="utf-8")
    beside.replace(path)


def forms_of(scene, models, native, wanted="all"):
    """Forms to render: what `auto` makes of the scene, by the name of the one form that it is or,
    where materials differ, as auto; drawn directions where every material has them; what the scene
    itself asks for; Blender's own node as the unit of cost, and others of its nodes where they were
    fitted to every material. Wanted: all of them, that of `auto`, or that and the unit."""
    used = [models[m["model"]] for m in scene["materials"].values()]
    chosen = {u["auto"] for u in used}
    auto = chosen.pop() if len(chosen) == 1 else "auto"
    if wanted != "all":
        return [Form(name, name) for name in (["glossy", auto] if wanted == "unit" else [auto])]
    forms = ["glossy"]
    fitted = [native.get(name, {}) for name in scene["materials"]]
    forms += [node for node in ("principled", "metallic") if all(node in f for f in fitted)]
    forms.append(auto)
    if all("sampled" in u["representations"] for u in used):
        forms.append("sampled")
    if any(m.get("representation", "auto") != "auto" for m in scene["materials"].values()):
        forms.append("scene")
    return [Form(name, name) for name in forms]


def build_plan(tool, folder, percent):
    """A pack cut to the scene, in folder/plan; returns the command."""
    command = [tool, "build", "--scene", folder / "scene.json", "--error", percent]
    command += ["--twin", "--out", folder / "plan"]
    run(command, stdout=subprocess.DEVNULL)
    return {"command": shown(map(str, command))}


def planned_forms(folder, scene):
    """Forms of the pack cut to the scene that the whole extension does not have: what it chooses,
    and those that every material can have."""
    pack = "plan/brdfc_shaders"
    models = read_json(folder / pack / "manifest.json")["models"]
    used = [models[m["model"]]["representations"] for m in scene["materials"].values()]
    forms = []
    if any("fitted" in u for u in used):
        forms.append(Form("planned", "auto", pack))
    if all("twin" in u for u in used):
        forms.append(Form("twin", "twin", pack))
    return forms


def render_reference(tool, folder, spp):
    """Renders folder/reference.exr; returns the command and the wall time."""
    command = [tool, "render", folder / "scene.json", "--out", folder / "reference.exr"]
    command += ["--spp", spp]
    start = time.perf_counter()
    run(command)
    return {"command": shown(map(str, command)), "wall_seconds": time.perf_counter() - start}


def render_jobs(extension, folder, jobs):
    """Renders jobs in one process, in their order; returns command and records. Each is (name,
    scene, picture, form, samples, seed), files in `folder`."""
    listed = [
        {
            "name": f"{folder.name} {name}",
            "scene": str(folder / scene),
            "out": str(folder / picture),
            "representation": form.representation,
            "spp": spp,
            "seed": seed,
            "native": str(folder / "native.json"),
            "pack": form.pack and str(folder / form.pack),
        }
        for name, scene, picture, form, spp, seed in jobs
    ]
    file = folder / f"{Path(jobs[0][1]).stem}-jobs.json"
    write_json(file, listed)
    command = [sys.executable, RENDER_SCENE, "--extension", extension, "--jobs", file]
    records = json.loads(run(command, stdout=subprocess.PIPE).stdout)
    for record, (_, _, _, form, _, _) in zip(records, jobs, strict=True):
        record["form"] = form.name
    return {"command": shown(map(str, command)), "records": records}


def render_blender(extension, folder, forms, spp, seeds):
    """Renders every form with every seed, in turns."""
    jobs = [
        (f"{form.name} {seed}/{seeds}", "scene.json", f"{form.name}-{seed}.exr", form, spp, seed)
        for seed in range(1, seeds + 1)
        for form in forms
    ]
    return render_jobs(extension, folder, jobs)


def smaller(scene, longest, spp=None):
    """The scene with at most so many pixels along its longer side, and so many samples a pixel."""
    settings = scene["settings"]
    factor = min(1, longest / max(settings["width"], settings["height"]))
    fewer = {k: max(1, round(settings[k] * factor)) for k in ("width", "height")}
    fewer["spp"] = min(settings["spp"], spp or settings["spp"])
    return scene | {"settings": settings | fewer}


def render_convergence(extension, folder, scene, forms):
    """A smaller picture in every form with more and more samples."""
    (folder / "convergence").mkdir(exist_ok=True)
    # Beside the scene, so that its meshes and images are found.
    write_json(folder / "convergence.json", smaller(scene, CONVERGENCE_SIZE))
    jobs = [
        (
            f"{form.name}, {spp} samples, {seed}/{CONVERGENCE_SEEDS}",
            "convergence.json",
            f"convergence/{form.name}-{spp}-{seed}.exr",
            form,
            spp,
            seed,
        )
        for spp in CONVERGENCE_SPP
        for seed in range(1, CONVERGENCE_SEEDS + 1)
        for form in forms
    ]
    return render_jobs(extension, folder, jobs)


def convergence_runs(forms, records):
    """The records in the form of runs.json."""
    out = []
    for form in forms:
        for spp in CONVERGENCE_SPP:
            chosen = [r for r in records if r["form"] == form.name and r["settings"]["spp"] == spp]
            out.append(
                {
                    "form": form.name,
                    "spp": spp,
                    "images": [f"convergence/{Path(r['out']).name}" for r in chosen],
                    "cpu_seconds": [r["sampling_cpu_seconds"] for r in chosen],
                }
            )
    return out


def materials_of(record, native):
    """The materials of a record in the form of runs.json; of Blender's own nodes those that were
    fitted."""
    out = []
    node = record["form"]
    for name, nodes in native.items():
        if node in nodes:
            error = {"relative_l1": nodes[node]["relative_l1"], "albedo": None}
            model = f"Blender's {node.capitalize()}"
            closures = 2 if node == "principled" else 1
            out.append(
                {
                    "id": name,
                    "model": model,
                    "representation": "fitted",
                    "closures": closures,
                    "error": error,
                }
            )
    for name, groups in record["materials"].items():
        for group in groups:
            if "model" in group:
                keys = ("model", "representation", "closures", "error")
                out.append({"id": name} | {key: group[key] for key in keys})
    return out


def form_run(form, records, native):
    return {
        "form": form.name,
        "images": [Path(r["out"]).name for r in records],
        "spp": records[0]["settings"]["spp"],
        "cpu_seconds": [r["sampling_cpu_seconds"] for r in records],
        "wall_seconds": [r["wall_seconds"] for r in records],
        "materials": materials_of(records[0], native),
    }


def cpu_model():
    info = Path("/proc/cpuinfo")
    for line in info.read_text().splitlines() if info.exists() else []:
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def cached(state, part, key, outputs, make):
    """state[part] if it was made with this key and its outputs exist, else made now."""
    if state.get(part, {}).get("key") == key and all(o.is_file() for o in outputs):
        return state[part], True
    state.pop(part, None)
    state[part] = make() | {"key": key}
    return state[part], False


def render_scene(source, options, models, versions):
    folder = options.out / source.stem
    folder.mkdir(parents=True, exist_ok=True)
    run([options.tool, "scene", source, "--out", folder])
    if options.size or options.spp:
        whole = read_json(folder / "scene.json")
        write_json(folder / "scene.json", smaller(whole, options.size or 1 << 14, options.spp))
    inputs = digest(*resolved_files(folder))
    scene = read_json(folder / "scene.json")
    settings = scene["settings"]
    blender_spp = max(1, settings["spp"] // options.seeds)
    reference_spp = settings["spp"] * options.reference_factor
    native = options.native.get(source.stem, {}).get("materials", {})
    write_json(folder / "native.json", native)
    forms = forms_of(scene, models, native, options.forms)

    state_file = folder / "state.json"
    state = read_json(state_file) if state_file.exists() else {}
    plan, kept_plan = None, False
    if options.forms == "all":
        plan, kept_plan = cached(
            state,
            "plan",
            digest(versions["tool"], inputs, options.plan),
            [folder / "plan" / "brdfc_shaders" / "manifest.json"],
            lambda: build_plan(options.tool, folder, options.plan),
        )
        forms += planned_forms(folder, scene)
    key = digest(versions["tool"], inputs, reference_spp)
    reference, kept_reference = cached(
        state,
        "reference",
        key,
        [folder / "reference.exr"],
        lambda: render_reference(options.tool, folder, reference_spp),
    )
    write_json(state_file, state)
    key = digest(
        versions["extension"],
        inputs,
        RENDER_SCENE,
        folder / "native.json",
        plan and plan["key"],
        forms,
        blender_spp,
        options.seeds,
    )
    images = [folder / f"{f.name}-{s}.exr" for f in forms for s in range(1, options.seeds + 1)]
    blender, kept_blender = cached(
        state,
        "blender",
        key,
        images,
        lambda: render_blender(options.extension, folder, forms, blender_spp, options.seeds),
    )
    write_json(state_file, state)

    convergence, kept_convergence = None, False
    if options.convergence:
        key = digest(key, CONVERGENCE_SPP, CONVERGENCE_SEEDS, CONVERGENCE_SIZE)
        convergence, kept_convergence = cached(
            state,
            "convergence",
            key,
            [],
            lambda: render_convergence(options.extension, folder, scene, forms),
        )
        write_json(state_file, state)

    records = blender["records"]
    runs = [form_run(f, [r for r in records if r["form"] == f.name], native) for f in forms]
    provenance = {
        "Blender": records[0]["blender"],
        "Extension": f"{options.extension.name}, sha256 {versions['extension']}",
        "Tool": f"{versions['tool_version']}, sha256 {versions['tool']}",
        "Processor": f"{cpu_model()}, {os.cpu_count()} threads",
        "Scene": f"scenes/{source.name}, sha256 when resolved {inputs}",
    }
    warnings = sorted({w for r in records for w in r["warnings"]})
    if warnings:
        provenance["Warnings of the extension"] = "; ".join(warnings)
    write_json(
        folder / "runs.json",
        {
            "format": 1,
            "scene": source.stem,
            "description": scene["description"],
            "settings": {k: settings[k] for k in ("width", "height", "max_bounces")},
            "reference": {
                "image": "reference.exr",
                "spp": reference_spp,
                "wall_seconds": reference["wall_seconds"],
            },
            "runs": runs,
            "convergence": convergence_runs(forms, convergence["records"]) if convergence else [],
            "provenance": provenance,
            "commands": [
                shown([str(options.tool), "scene", str(source), "--out", str(folder)]),
                reference["command"],
                *([plan["command"]] if plan else []),
                blender["command"],
                *([convergence["command"]] if convergence else []),
            ],
        },
    )
    parts = {
        "plan": kept_plan,
        "reference": kept_reference,
        "Blender": kept_blender,
        "convergence": kept_convergence,
    }
    kept = [name for name, was_kept in parts.items() if was_kept]
    note = f" (kept: {', '.join(kept)})" if kept else ""
    print(f"    {source.stem}: {', '.join(f.name for f in forms)}{note}", flush=True)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="+", type=Path, help="scenes/NAME.json")
    parser.add_argument("--tool", required=True, type=Path, help="the program brdfc")
    parser.add_argument("--extension", required=True, type=Path, help="brdfc_shaders-<version>.zip")
    parser.add_argument("--out", required=True, type=Path, help="folder of the results")
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
    if options.seeds < 2:
        parser.error("--seeds: expected at least 2, noise is estimated from their spread")
    if options.reference_factor < 1:
        parser.error("--reference-factor: expected at least 1")
    for name in ("tool", "extension", "out"):
        setattr(options, name, getattr(options, name).resolve())
    for path in (options.tool, options.extension, *options.scenes):
        if not path.is_file():
            parser.error(f"{path}: no such file")

    options.native = read_json(options.native) if options.native else {}
    with zipfile.ZipFile(options.extension) as archive:
        models = json.loads(archive.read("manifest.json"))["models"]
    version = run([options.tool, "--version"], stdout=subprocess.PIPE, text=True)
    versions = {
        "tool": digest(options.tool),
        "tool_version": f"brdfc {version.stdout.strip().removeprefix('brdfc ')}",
        "extension": digest(options.extension),
    }
    for source in options.scenes:
        render_scene(source.resolve(), options, models, versions)
    # A scene that is gone would stay in the report for ever.
    known = {s.stem for s in (ROOT / "scenes").glob("*.json")} | {s.stem for s in options.scenes}
    for folder in options.out.iterdir():
        if folder.is_dir() and (folder / "runs.json").exists() and folder.name not in known:
            print(f"    {folder.name}: no such scene any more, left out of the report")
            (folder / "runs.json").unlink()
            (folder / "scene.json").unlink(missing_ok=True)


if __name__ == "__main__":
    main()
