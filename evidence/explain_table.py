#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the output of `brdfc build --explain` for three scenes as Markdown. Run it in the root."""

import argparse
import itertools
import json
import subprocess
import tempfile
from pathlib import Path

from markdown_table import heading, line

# Options that show most: many materials of one model, a form that is too expensive, forms that
# change.
SCENES = {
    "as-fig2": [],
    "room-radziszewski_alda": ["--error", "5", "--time", "1.3x"],
    "small-lamp": ["--error", "5"],
}

INTRODUCTION = """\
# What a build leaves out, and why: three scenes

`evidence/explain` makes this page from the JSON that the commands below print.

In the tables, an arrow stands between two values. The first is that of the whole extension, the
second that of the extension for this scene; without an arrow both are the same. For materials, they
are the form that `auto` means without a budget, and the form that was chosen. For models, they are
the sizes of the whole shader, which has all parameters, and of the shader for the scene.

- **Costs** are those in [what each form takes](tables/forms.md). They were measured for each model
  and form with default parameters, so they do not show what constants save. **Errors** are measured
  with the scene's parameters.
- **Bytes and statements** are counted in a shader's text, which has all combinations of its
  choices. Statements of the library are not counted. **Operations** are the largest number that
  one combination executes. **Floats** are those of the tables of albedo and fit that the shader
  reads.
- A fit is made for the scene's parameters, so a fitted form has no other shader to compare with.
- If a constant colour becomes part of a table, the table becomes three, one for each channel. Bytes
  or floats may then increase.
"""

SIZES = {
    "bytes": "bytes",
    "operations": "operations",
    "statements": "statements",
    "closures": "closures",
    "table_floats": "floats of tables",
}


def explained(tool, scene, options):
    with tempfile.TemporaryDirectory(prefix="brdfc-explain-") as folder:
        command = [tool, *arguments(scene, options), "--out", folder]
        done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout)


def arguments(scene, options):
    return ["build", "--scene", f"scenes/{scene}.json", *options, "--explain"]


def change(before, after):
    return before if before == after else f"{before} → {after}"


def cost(value):
    return "?" if value is None else f"{value:.2f}"


def error(value):
    """Relative L1 in percent; 0 if only rounding errors are left."""
    if value is None:
        return "-"
    if value == "expectation":
        return "0 on average"
    return "0" if value < 1e-5 else f"{100 * value:.2g} %"


def material_rows(model):
    """Combines materials that have the same row."""
    errors = {choice["form"]: choice["error"] for choice in model["choices"]}

    def cells(material):
        before, after = material["before"], material["after"]
        return (
            f"`{model['model']}`",
            change(before["form"], after["form"]),
            error(errors[after["form"]]),
            change(cost(before["cost"]), cost(after["cost"])),
        )

    for alike, materials in itertools.groupby(model["material_forms"], cells):
        yield line(", ".join(m["material"] for m in materials), *alike)


def size_rows(model):
    for form in model["forms"]:
        sizes = (change(f"{form['before'][key]:,}", f"{form['after'][key]:,}") for key in SIZES)
        yield line(f"`{model['model']}`", form["form"], *sizes)


def reasons(model):
    lines = [f"### {model['model']}", "", *heading("Form", "Cost", "Error", "Taken", "Why")]
    for c in model["choices"]:
        taken = "**yes**" if c["taken"] else "no"
        lines.append(line(c["form"], cost(c["cost"]), error(c["error"]), taken, c["why"]))
    lines.append("")
    if model["left_out"]:
        lines += ["Left out:", "", *(f"- {reason}" for reason in model["left_out"]), ""]
    if model["free"]:
        lines += [f"Parameters of the shader: {', '.join(model['free'])}", ""]
    return lines


def section(tool, scene, options):
    said = explained(tool, scene, options)
    models = said["models"]
    lines = [
        f"## {scene}",
        "",
        f"    build/brdfc {' '.join(arguments(scene, options))} --out DIR",
        "",
    ]
    lines += heading("Material", "Model", "Form", "Error", "Cost")
    lines += itertools.chain.from_iterable(map(material_rows, models))
    lines += ["", *heading("Model", "Form", *SIZES.values())]
    lines += itertools.chain.from_iterable(map(size_rows, models))
    lines.append("")
    for model in models:
        lines += reasons(model)
    return [*lines, f"Models that no material uses: {', '.join(said['unused_models'])}", ""]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tool", required=True, type=Path, help="the program brdfc")
    options = parser.parse_args()
    lines = [INTRODUCTION]
    for scene, budget in SCENES.items():
        lines += section(options.tool.resolve(), scene, budget)
    print("\n".join(lines))


if __name__ == "__main__":
    main()
