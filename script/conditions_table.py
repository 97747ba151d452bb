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

Made by `script/conditions`. Each row changes one thing in a clean scene, a grid of grooves under a
sun and a bright sky, so that light bounces; a cell is what that does to the mean radiance of a
form, with its standard error. Bold is what exceeds 2 % and 5 standard errors; there the panel warns
if that is said. Forms stand for all of their kind: closures with a mirror, alone, with a ramp;
drawn directions with a mirror, of an anisotropic model, alone; fits with facets, of lobes alone;
aimed forms with a base of facets, without one, with a mirror, with a base of ramps, told of the
scene's lamps. `coupled` has r0 = 0.5, the others their defaults. Blender's own Diffuse and Glossy
nodes are there to compare with. `tests/blender/test_every_fit.py` holds fitted forms and twins of
every model to the same.

Of the tilted normals (by the mesh's own, by the Normal input, by that with Bump Map Correction on)
the worst of three views is shown: what is lost of all that the model reflects, of Blender's own
nodes of their colour. It is bold where it is not what the model's own rays lose below the surface.
Passes: mean difference from the model's albedo, median angle from the true normal, largest
difference of the picture and the sum of its light groups. "lamp without shadows" is a sun overhead,
"lamp without multiple importance" one 1 rad wide, each compared with the same sun as it should be;
"lamp linked elsewhere" adds a sun that shines on something else, "nine lamps for one" puts nine
suns of a ninth of the light where one was. "sun without size" compares the median cells of drawn
directions, which meet that lamp as rare, bright dots, and other forms with a sun 0.02 wide; it
leaves out exact forms with a mirror, which by its nature does not show it.
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
