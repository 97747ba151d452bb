#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes pages with tables about the forms of models: closures, error and cost of every form with
the model's default parameters, and the errors of fits and twins by view."""

import argparse
import csv
import io
import json
import math
import subprocess
import tempfile
from pathlib import Path

from markdown_table import heading, line, percent

FORMS = ("exact", "aimed", "sampled", "fitted", "twin")

#: The parameters in which f is a polynomial, or nearly so, for models that have such parameters.
ANY = {
    "ashikhmin_shirley": ("rs", "rd"),
    "cook_torrance": ("f0",),
    "coupled": ("r0",),
    "eon": ("rho",),
    "oren_nayar": ("rho",),
    "phong_material": ("kd", "cd", "ks", "cs", "kr", "cr"),
    "schlick": ("r",),
    "schlick_double": ("r0",),
}
#: Parameter values that are measured in addition to the defaults.
ELSEWHERE = {"ashikhmin_shirley": [("nu=10", "nv=10")]}


def run(command):
    return subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, text=True, check=True)


def listed(tool):
    return json.loads(run([tool, "list", "--json"]).stdout)


def built(tool, folder):
    """The manifest of a pack with every form that each model has with its default parameters."""
    file = folder / "materials.json"
    materials = {
        f"{model['name']} {form}": {"model": model["name"], "representation": form}
        for model in listed(tool)
        for form in model["representations"]
        if form in ("exact", "aimed", "sampled")
    }
    file.write_text(json.dumps({"materials": materials}), encoding="utf-8")
    # Any error limit will do: the fit is built beside the sampled form. Any time limit will do,
    # too; with one, aimed forms keep the bases that models declare.
    command = [tool, "build", "--materials", file, "--error", "100", "--time", "100", "--twin"]
    run([*command, "--out", folder])
    text = (folder / "brdfc_shaders" / "manifest.json").read_text(encoding="utf-8")
    return json.loads(text)["models"]


def error(form):
    """Relative L1; 0 for a form that is right in the mean."""
    return percent(form["error"]["relative_l1"] or 0)


def cell(entry, name):
    form = entry["representations"].get(name)
    if form is None:
        return "-"
    cost = "?" if form["cost"] is None else f"{form['cost']:.2f}"
    return f"{form['closures']}, {error(form)}, {cost}"


def forms(tool):
    with tempfile.TemporaryDirectory(prefix="brdfc-forms-") as folder:
        models = built(tool, Path(folder))
    lines = heading("Model", *FORMS)
    for name, entry in models.items():
        lines.append(line(f"`{name}`", *(cell(entry, form) for form in FORMS)))
    return "\n".join(lines)


def errors_by_view(tool, *arguments):
    """Relative error, one number per view; None if the tool reports that the model has no fit."""
    command = [str(tool), "fit", *arguments]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode == 2 and "has no fitted form" in done.stderr:
        return None
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: {done.stderr}")
    return [float(row["relative_l1"]) for row in csv.DictReader(io.StringIO(done.stdout))]


def spread(view_errors):
    """Median, 95th percentile and maximum over views."""
    view_errors = sorted(view_errors)
    parts = (view_errors[math.ceil(q * len(view_errors)) - 1] for q in (0.5, 0.95, 1))
    return [percent(part) for part in parts]


def errors(columns, found):
    """A table of errors. `found` has the first cells of a row, and the errors of its views."""
    lines = heading(*columns, "half of the views below", "95 % of the views below", "worst view")
    for first, view_errors in sorted(found, key=lambda row: sorted(row[1])[len(row[1]) // 2]):
        lines.append(line(*first, *spread(view_errors)))
    return lines


def at_defaults(tool, *options):
    """For each model that is not just a mirror: its entry in `brdfc list`, the cell that names the
    parameters, and the error of each view."""
    for model in listed(tool):
        for values in [(), *ELSEWHERE.get(model["name"], [])]:
            named = (model["name"], *values)
            if view_errors := errors_by_view(tool, *named, *options):
                yield model, (f"`{' '.join(named)}`",), view_errors


def fits(tool):
    found = list(at_defaults(tool))
    lines = errors(("Model",), [row[1:] for row in found])
    # A fit is for models that have no other form with light sampling.
    needed = [
        e
        for model, _, view_errors in found
        if "exact" not in model["representations"]
        for e in view_errors
    ]
    lines.append(line("all that have no exact form", *spread(needed)))
    return "\n".join(lines)


def twins(tool):
    return "\n".join(errors(("Model",), [row[1:] for row in at_defaults(tool, "--twin")]))


def fits_any(tool):
    found = []
    for name, parameters in ANY.items():
        first = (f"`{name}`", " ".join(f"`{p}`" for p in parameters))
        found.append((first, errors_by_view(tool, name, "--any", *parameters)))
    return "\n".join(errors(("Model", "parameters"), found))


def fits_over(tool):
    """The fits that the extension contains."""
    found = []
    for model in listed(tool):
        if over := model["properties"]["fit_axis"]:
            first = (f"`{model['name']}`", f"`{over}`")
            found.append((first, errors_by_view(tool, model["name"], "--over", over)))
    return "\n".join(errors(("Model", "number"), found))


VIEWS = """\
A row lists the share of the light that goes in other directions than in the model: the integral
of the absolute difference of f cos, divided by the integral of f cos. It depends on the view. Half
of all views are below the first figure, 95 % below the second, and all are at or below the third.
Most models have their worst view within two degrees of the surface, where lobes are flat and wide
and reflect little light."""

#: How each table is made, the title of its page, and the text above it.
PAGES = {
    "forms": (
        forms,
        "What each form takes",
        """\
Closures, error and cost with default parameters. The error is the part of the reflected light that
goes in other directions than in the model, averaged over all views; it is 0 if a form is right,
or right on average. The cost is CPU time at equal samples in units of Blender's Glossy node,
measured by `evidence/bench --forms`. `-` means that there is none.

Fitted forms are made for the default parameters here, as `brdfc build --error` makes them for the
parameters of a scene. Those that the extension contains cover all values of a number and have a
larger error: see [errors along a number](fits-over.md).""",
    ),
    "fits": (
        fits,
        "Errors of fitted forms at default parameters",
        f"Each row is the output of one `build/brdfc fit MODEL [name=value ...]`.\n\n{VIEWS}",
    ),
    "fits-any": (
        fits_any,
        "Errors of fitted forms, any shares and colours",
        f"""\
Each row is the output of one `build/brdfc fit MODEL --any NAME...`. f is a polynomial of the named
parameters, or nearly so; they may have any value. The error is that of the worst mixture.

{VIEWS}""",
    ),
    "fits-over": (
        fits_over,
        "Errors of fitted forms along a number",
        f"""\
Each row is the output of one `build/brdfc fit MODEL --over NAME`: the errors over the whole slider
of the number, in the middle between the knots of the tables, for any value of factors and mixed
parameters. The extension contains these fits.

{VIEWS}""",
    ),
    "twins": (
        twins,
        "Errors of twins at default parameters",
        f"""\
Each row is the output of one `build/brdfc fit MODEL --twin [name=value ...]`.

{VIEWS}""",
    ),
}


def page(tool, name):
    table, title, text = PAGES[name]
    return f"# {title}\n\nMade by `evidence/forms {name}`.\n\n{text}\n\n{table(tool)}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tool", required=True, type=Path, help="the program brdfc")
    parser.add_argument("table", choices=PAGES)
    options = parser.parse_args()
    print(page(options.tool.resolve(), options.table))


if __name__ == "__main__":
    main()
