# SPDX-License-Identifier: GPL-3.0-or-later
"""Combines records of tasks in runs.json, the input of the report; see
generator/report/report.h."""

import shutil
from pathlib import Path

from demo_matrix import CONVERGENCE_SPP
from demo_tasks import write_json


def materials_of(record, native):
    """The materials of a record; for Blender's own nodes, those to which they were fitted."""
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


def convergence_run(form, spp, records):
    return {
        "form": form.name,
        "spp": spp,
        "images": [f"convergence/{Path(r['out']).name}" for r in records],
        "cpu_seconds": [r["sampling_cpu_seconds"] for r in records],
    }


def pictures(scene, tasks):
    """Records of the pictures of tasks in Blender, with their forms."""
    out = []
    for task in tasks:
        of_task = scene.records[task.name]["records"]
        for record in of_task:
            # A picture is named FORM-..., and no form has a hyphen in its name.
            record["form"] = Path(record["out"]).name.split("-")[0]
        out += of_task
    return out


def write_runs(scene, version, tasks, about):
    """Writes runs.json of a scene in one version of Blender. `tasks` are all tasks of the scene, in
    their order; `about` is the provenance that scenes share."""
    folder, settings = scene.folder_of(version), scene.settings
    here = [t for t in tasks if t.folder.parent == folder and t.prints_records]
    rendered = pictures(scene, [t for t in here if t.kind == "blender"])
    smaller = pictures(scene, [t for t in here if t.kind == "convergence"])
    reference = scene.records[f"{scene.name}/reference"]
    if folder != scene.folder:
        shutil.copyfile(scene.folder / "reference.exr", folder / "reference.exr")

    # Unfinished files of attempts that were stopped.
    for begun in (*folder.glob(".*.exr"), *folder.glob("*/.*")):
        begun.unlink(missing_ok=True)

    provenance = {"Blender": rendered[0]["blender"]} | about
    processors = sorted({scene.records[t.name]["processor"] for t in here})
    provenance["Processor"] = "; ".join(processors)
    provenance["Scene"] = f"scenes/{scene.source.name}, sha256 when resolved {scene.inputs}"
    if warnings := sorted({w for r in rendered for w in r["warnings"]}):
        provenance["Warnings of the extension"] = "; ".join(warnings)
    shared = [t for t in tasks if not t.prints_records]
    write_json(
        folder / "runs.json",
        {
            "format": 1,
            "scene": scene.name,
            "description": scene.scene["description"],
            "settings": {k: settings[k] for k in ("width", "height", "max_bounces")},
            "reference": {
                "image": "reference.exr",
                "spp": scene.reference_spp,
                "wall_seconds": reference["wall_seconds"],
            },
            "runs": [
                form_run(f, [r for r in rendered if r["form"] == f.name], scene.native)
                for f in scene.forms
            ],
            "convergence": [
                convergence_run(
                    f,
                    spp,
                    [r for r in smaller if (r["form"], r["settings"]["spp"]) == (f.name, spp)],
                )
                for f in scene.forms
                for spp in (CONVERGENCE_SPP if smaller else ())
            ],
            "provenance": provenance,
            "commands": [
                scene.command,
                *(scene.records[t.name]["command"] for t in (*shared, *here)),
            ],
        },
    )
