#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes pictures of equal CPU time: one model in every form, and Blender's own Glossy node.

    python evidence/time_pictures.py scene - OUT            OUT/ball.json
    python evidence/time_pictures.py jobs COSTS.csv OUT     OUT/jobs.json, with the fits that
                                                          native_nodes.py wrote to OUT/fitted.json
    python evidence/time_pictures.py page OUT DOCS          DOCS/time-pictures.png, OUT/pictures.md

The numbers of samples take as much time as SPP samples of the Glossy node, by the costs that
evidence/bench measured. So the noise is what any machine reaches in that time.
"""

import csv
import json
import sys
from pathlib import Path

import OpenImageIO as oiio
from markdown_table import heading, line
from pictures import read_rgb
from time_page import PICTURES

CONFIG = Path(__file__).resolve().parents[1] / "data" / "color" / "config.ocio"
#: The model: its stored fit gives it every sampled form. Samples of the Glossy node.
MODEL, PARAMETERS, SPP = "cook_torrance", {"m": 0.3, "f0": [0.9, 0.6, 0.3]}, 64
FORMS = ("glossy", "aimed", "fitted", "sampled")
SIZE, GAP, EPSILON = 176, 6, 0.01


def scene():
    return {
        "name": "ball",
        "description": "A ball under a lamp. No floor: it would become a Glossy node too.",
        "settings": {"width": SIZE, "height": SIZE, "spp": SPP, "seed": 1, "max_bounces": 4},
        "camera": {
            "type": "perspective",
            "position": [0, -6, 2.2],
            "look_at": [0, 0, 1],
            "fov_y_degrees": 22,
        },
        "materials": {
            "ball": {"model": MODEL, "parameters": PARAMETERS},
        },
        "objects": [
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
    fitted = json.loads((out / "fitted.json").read_text(encoding="utf-8"))["ball"]["materials"]
    (out / "native.json").write_text(json.dumps(fitted), encoding="utf-8")
    listed = [
        {
            "name": form,
            "scene": str((out / "scene.json").resolve()),
            "out": str((out / f"{form}.exr").resolve()),
            "representation": form,
            "spp": max(1, round(SPP / cost[form])),
            "native": str((out / "native.json").resolve()),
            "timed": False,
        }
        for form in FORMS
    ]
    (out / "jobs.json").write_text(json.dumps(listed), encoding="utf-8")


def pixels(path):
    """The picture (height, width, 3), linear."""
    try:
        return read_rgb(path)
    except OSError as error:
        sys.exit(str(error))


def page(out, docs):
    import numpy as np
    import PyOpenColorIO as ocio

    config = ocio.Config.CreateFromFile(str(CONFIG))
    to_screen = config.getProcessor("scene_linear", "sRGB").getDefaultCPUProcessor()

    records = {r["name"]: r for r in json.loads((out / "records.json").read_text(encoding="utf-8"))}
    reference = pixels(out / "reference.exr")
    shown = [(f"{form}", pixels(out / f"{form}.exr")) for form in FORMS]
    sheet = np.ones((SIZE, (SIZE + GAP) * (len(shown) + 1) - GAP, 3), np.float32)
    table = heading("Form", "samples", "relMSE", "mean")
    for i, (name, picture) in enumerate([*shown, ("reference", reference)]):
        coded = np.array(picture, np.float32, order="C")
        to_screen.applyRGB(coded)
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
        f"A ball of `{MODEL}` under a point lamp of radius 0.1: {', '.join(FORMS)}, the reference.",
        f"All but the reference have the CPU time of {SPP} samples of the Glossy node. That is",
        "Blender's own, with the colour and roughness that come nearest to the model's f cos.",
        f"Blender {records[FORMS[0]]['blender']}.",
        "",
        *table,
        "",
        "relMSE and mean of the picture are against the reference with 256 samples.",
        "`evidence/times --pictures` renders them.",
    ]
    (out / "pictures.md").write_text("\n".join(text) + "\n", encoding="utf-8")


def main():
    if len(sys.argv) != 4 or sys.argv[1] not in ("scene", "jobs", "page"):
        sys.exit(__doc__)
    if sys.argv[1] == "scene":
        out = Path(sys.argv[3])
        out.mkdir(parents=True, exist_ok=True)
        (out / "ball.json").write_text(json.dumps(scene()), encoding="utf-8")
        return
    {"jobs": jobs, "page": page}[sys.argv[1]](Path(sys.argv[2]), Path(sys.argv[3]))


if __name__ == "__main__":
    main()
