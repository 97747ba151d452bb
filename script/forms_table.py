#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures, error and cost of every form of every model with its default parameters, as a table in
Markdown."""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

FORMS = ("exact", "sampled", "fitted", "controlled", "twin")


def run(command):
    return subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, text=True, check=True)


def built(tool, folder):
    """The manifest of a pack with every form that each model has with its default parameters."""
    file = folder / "materials.json"
    materials = {
        f"{model['name']} {form}": {"model": model["name"], "representation": form}
        for model in json.loads(run([tool, "list", "--json"]).stdout)
        for form in model["representations"]
        if form in ("exact", "sampled")
    }
    file.write_text(json.dumps({"materials": materials}), encoding="utf-8")
    # Any error will do: the fit comes beside the sampled form.
    command = [tool, "build", "--materials", file, "--error", "100", "--controlled", "--twin"]
    run([*command, "--out", folder])
    text = (folder / "brdfc_shaders" / "manifest.json").read_text(encoding="utf-8")
    return json.loads(text)["models"]


def error(form):
    """Relative L1 in percent; 0 where only rounding is left or the mean is right."""
    off = form["error"]["relative_l1"]
    return "0" if off is None or off < 1e-5 else f"{100 * off:.2g} %"


def cell(entry, name):
    form = entry["representations"].get(name)
    if form is None:
        return "-"
    cost = "?" if form["cost"] is None else f"{form['cost']:.2f}"
    return f"{form['closures']}, {error(form)}, {cost}"


def table(models):
    lines = [f"| Model | {' | '.join(FORMS)} |", "|---" * (len(FORMS) + 1) + "|"]
    for name, entry in models.items():
        lines.append(f"| `{name}` | {' | '.join(cell(entry, form) for form in FORMS)} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tool", required=True, type=Path, help="the program brdfc")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="brdfc-forms-") as folder:
        print(table(built(options.tool.resolve(), Path(folder))))


if __name__ == "__main__":
    main()
