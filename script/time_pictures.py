#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of equal CPU time: one model in every form, and Blender's own node.

    python script/time_pictures.py jobs COSTS.csv OUT     OUT/ball.json, OUT/jobs.json
    python script/time_pictures.py page OUT DOCS          DOCS/time-pictures.png, OUT/pictures.md

Samples are those of the time that the Glossy node takes for SPP, by the costs that script/bench
measured; so noise is what that time is good for on any machine.
"""

import csv
import json
import sys
from pathlib import Path

import OpenImageIO as oiio
from markdown_table import heading, line
from time_page import PICTURES

#: The model: its kept fit gives it every drawn form. Samples of the Glossy node.
MODEL, PARAMETERS, SPP = "cook_torrance", {"m": 0.3, "f0": [0.9, 0.6, 0.3]}, 64
FORMS = ("glossy", "aimed", "fitted", "sampled")
SIZE, GAP, EPSILON = 176, 6, 0.01


def scene():
    return {
        "name": "ball",
        "description": "A ball under a lamp.",
        "settings": {"width": SIZE, "height": SIZE, "spp": SPP, "seed": 1, "max_bounces": 4},
        "camera": {
            "type": "perspective",
            "position": [0, -6, 2.2],
            "look_at": [0, 0, 0.95],
            "fov_y_degrees": 22,
        },
        "materials": {
            "floor": {"model": "lambert", "parameters": {"rho": [0.4, 0.4, 0.4]}},
            "ball": {"model": MODEL, "parameters": PARAMETERS},
        },
        "objects": [
            {"name": "floor", "shape": {"type": "quad", "size": [40, 40]}, "material": "floor"},
            {
                "name": "ball",
                "shape": {"type": "sphere", "radius": 1},
                "transform": {"translate": [0, 0, 1]},
                "material": "ball",
            },
        ],
        "lights": [{"type": "point", "position": [-3, -4, 5], "power": 700, "radius": 0.1}],
        "environment": {"color": [0.12, 0.13, 0.15]},
    }


def jobs(costs, out):
    with open(costs, encoding="utf-8", newline="") as file:
        cost = {r["form"]: float(r["cost"]) for r in csv.DictReader(file) if r["model"] == MODEL}
    if missing := [f for f in FORMS if f not in cost]:
        sys.exit(f"{costs}: expected a row of {MODEL}, {missing[0]}")
    out.mkdir(parents=True, exist_ok=True)
    (out / "ball.json").write_text(json.dumps(scene()), encoding="utf-8")
    listed = [
        {
            "name": form,
            "scene": str((out / "scene.json").resolve()),
            "out": str((out / f"{form}.exr").resolve()),
            "representation": form,
            "spp": max(1, round(SPP / cost[form])),
            "timed": False,
        }
        for form in FORMS
    ]
    (out / "jobs.json").write_text(json.dumps(listed), encoding="utf-8")


def pixels(path):
    """The picture (height, width, 3), linear."""
    picture = oiio.ImageBuf(str(path))
    if picture.has_error:
        sys.exit(f"{path}: {picture.geterror()}")
    return picture.get_pixels(oiio.FLOAT)[..., :3]


def page(out, docs):
    import numpy as np

    records = {r["name"]: r for r in json.loads((out / "records.json").read_text(encoding="utf-8"))}
    reference = pixels(out / "reference.exr")
    shown = [(f"{form}", pixels(out / f"{form}.exr")) for form in FORMS]
    sheet = np.ones((SIZE, (SIZE + GAP) * (len(shown) + 1) - GAP, 3), np.float32)
    table = heading("Form", "samples", "relMSE", "mean")
    for i, (name, picture) in enumerate([*shown, ("reference", reference)]):
        coded = np.where(
            picture <= 0.0031308,
            12.92 * picture,
            1.055 * np.maximum(picture, 0) ** (1 / 2.4) - 0.055,
        )
        sheet[:, i * (SIZE + GAP) : i * (SIZE + GAP) + SIZE] = np.clip(coded, 0, 1)
        if name != "reference":
            error = float(np.mean((picture - reference) ** 2 / (reference**2 + EPSILON)))
            mean = float(picture.mean() / reference.mean())
            spp = records[name]["settings"]["spp"]
            table.append(line(name, spp, f"{error:.2g}", f"{100 * mean:.1f} %"))
    buffer = oiio.ImageBuf(oiio.ImageSpec(sheet.shape[1], SIZE, 3, "uint8"))
    buffer.set_pixels(oiio.ROI(), np.ascontiguousarray(sheet))
    if not buffer.write(str(docs / "time-pictures.png")):
        sys.exit(buffer.geterror())
    text = [
        PICTURES,
        "",
        f"![{', '.join(FORMS)}, reference](time-pictures.png)",
        "",
        f"A ball of `{MODEL}` under a point lamp of radius 0.1, from",
        f"left to right {', '.join(FORMS)} and",
        "the reference. All but the reference have the CPU time of",
        f"{SPP} samples of the Glossy node,",
        f"which is Blender's own with the model's colour. {records[FORMS[0]]['blender']}.",
        "",
        *table,
        "",
        "relMSE and mean of the picture are against the reference with 1,024 samples.",
        "`script/times --pictures` renders them.",
    ]
    (out / "pictures.md").write_text("\n".join(text) + "\n", encoding="utf-8")


def main():
    if len(sys.argv) != 4 or sys.argv[1] not in ("jobs", "page"):
        sys.exit(__doc__)
    {"jobs": jobs, "page": page}[sys.argv[1]](Path(sys.argv[2]), Path(sys.argv[3]))


if __name__ == "__main__":
    main()
