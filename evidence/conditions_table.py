#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Combines the results of the conditions' tests, measured in each Blender version, in one table."""

import argparse
import csv
import json
from pathlib import Path

from markdown_table import heading, line

INTRODUCTION = """\
# What settings and scenes do to the forms

Made by `evidence/conditions`. Each row changes one thing in a clean scene: a grid of grooves, in
which light bounces, under a sun and a bright sky. A cell is the resulting change in the mean
radiance of a form, with its standard error. It is bold if it exceeds 2 % and 5 standard errors;
"panel warns" follows if the panel warns of it. The forms represent all others of their kind: exact
forms with a mirror, without one, and with a ramp; sampled forms with a mirror, of an anisotropic
model, and without either; fits with microfacets, and with other lobes only; aimed forms with a base
of microfacets, without a base, with a mirror, and with a base of ramps, which have the scene's
lamps in their slots. `coupled` has r0 = 0.5, the others their defaults. Blender's own Diffuse and
Glossy nodes are included for comparison. `tests/blender/test_every_fit.py` measures the same for
fitted forms and twins of every model. Formula Nodes are not among the tables: `evidence/conditions
--form nodes` measures them, and [their page](nodes.md#settings-and-passes) says what it found.

Tilted normals are those of the mesh, those of the input Normal, and the latter with Bump Map
Correction on. The cell is the worst of three views: the fraction lost of all the light that the
model reflects, or that Blender's own nodes of this colour reflect. It is bold if it differs from
what the model's own rays lose below the surface.
Passes: mean difference from the model's albedo, median angle from the true normal, and largest
difference between the picture and the sum of its light groups. "lamp without shadows" is a sun
overhead, and "lamp without multiple importance" a sun 1 rad wide; each is compared with the same
sun with the setting on. "lamp linked elsewhere" adds a sun that is linked to another object only.
"nine lamps for one" replaces the sun by nine suns, each with a ninth of its light. "sun without
size": forms that sample directions show such a lamp as rare bright dots, so their median cells are
compared; other forms are compared with a sun 0.02 wide. Exact forms with a mirror are omitted
there, as a mirror can't show a lamp without a size.
"""


def cell(row):
    """The bias with its error, and the panel's reaction."""
    if "degrees" in row["condition"]:
        text = f"{row['bias']:.0f}°"
    elif row["error"]:
        text = f"{row['bias']:+.1%} ± {row['error']:.1%}"
    else:
        text = f"{row['bias']:+.3f}"
    if not row["biased"]:
        return text
    codes = row["code"] if isinstance(row["code"], list) else [row["code"]]
    warned = any(w.startswith(c) for w in row["warned"] for c in codes if c)
    return f"**{text}**" + (" (panel warns)" if warned else "")


def sections_of(page):
    """The text below each heading of an older page, by heading."""
    found = {}
    for part in page.split("\n## ")[1:]:
        form, text = part.split("\n", 1)
        found[form] = text.strip("\n")
    return found


def in_order(forms):
    """Puts Blender's own nodes, which are there for comparison, last."""
    return sorted(forms, key=lambda form: form.endswith("(node)"))


def markdown(versions, page=""):
    """The page. Sections that were not measured are taken from `page`."""
    kept = sections_of(page)
    measured = forms_of(versions)
    lines = [INTRODUCTION]
    for form in in_order([*kept, *(f for f in measured if f not in kept)]):
        if form not in measured:
            lines += [f"## {form}", "", kept[form], ""]
            continue
        lines += [f"## {form}", ""]
        lines += heading("condition", *(f"Blender {v}" for v in versions))
        for condition in conditions_of(versions):
            found = [
                next((r for r in rows if r["form"] == form and r["condition"] == condition), None)
                for rows in versions.values()
            ]
            if any(found):
                cells = [cell(r) if r else "" for r in found]
                lines.append(line(condition, *cells))
        lines.append("")
    return "\n".join(lines)


def forms_of(versions):
    return list(dict.fromkeys(r["form"] for rows in versions.values() for r in rows))


def conditions_of(versions):
    return list(dict.fromkeys(r["condition"] for rows in versions.values() for r in rows))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where <version>.json lie")
    parser.add_argument("--page", type=Path, help="an older page, whose other rows are kept")
    options = parser.parse_args()
    folder = options.folder
    versions = {}
    for path in sorted(folder.glob("[0-9]*.json")):
        versions[path.stem] = json.loads(path.read_text(encoding="utf-8"))["rows"]
    if not versions:
        parser.error(f"{folder}: expected files such as 4.5.json, found none")
    every = [{"blender": v} | row for v, rows in versions.items() for row in rows]
    (folder / "conditions.json").write_text(json.dumps(every, indent=1) + "\n", encoding="utf-8")
    with (folder / "conditions.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(every[0]))
        writer.writeheader()
        writer.writerows(r | {"warned": " ".join(r["warned"])} for r in every)
    page = options.page.read_text(encoding="utf-8") if options.page else ""
    (folder / "conditions.md").write_text(markdown(versions, page) + "\n", encoding="utf-8")
    print(folder / "conditions.md")


if __name__ == "__main__":
    main()
