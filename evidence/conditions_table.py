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

`evidence/conditions` makes this page. The scene is a grid of grooves, between which light is
reflected several times, under a sun and a bright sky. Each row changes one thing in it.

- A cell is the change in a form's mean radiance, with its standard error.
- A change is bold if it exceeds 2 % and 5 standard errors. "panel warns" means that the panel
  shows a warning.
- The forms stand for all others of their kind. `coupled` has r0 = 0.5, the others their defaults.
  Aimed forms know the scene's lamps. Blender's Diffuse and Glossy nodes are there for comparison.
- `tests/blender/test_every_fit.py` measures the same for fitted forms and twins of every model, and
  `evidence/conditions --form nodes` for Formula Nodes, whose results are [on their
  page](nodes.md#settings-and-passes).

Some rows are measured in another way:

- **smooth normals, Normal input, bump correction**: a cell is the fraction of the reflected light
  that is lost, in the worst of three views, where normals are tilted. The normals are those of the
  mesh, those of the input *Normal*, and the same with Bump Map Correction on. In these rows bold
  means that a form loses more or less than the model's own rays do below the surface, by 2 % and,
  for a fit, by more than the error that it states.
- **denoising albedo, colour passes**: the mean difference from the model's albedo. **denoising
  normal**: the median angle from the true normal, bold if it also differs from pixel to pixel,
  which misleads denoisers. **light group**: the largest difference between the picture and the sum
  of its light groups.
- **lamp without shadows** has a sun overhead, and **lamp without multiple importance** a sun 1 rad
  wide. Each is compared with the same sun with the setting on.
- **lamp linked elsewhere** adds a sun that is linked to another object only. **nine lamps for one**
  replaces the sun by nine suns with a ninth of its light each.
- **sun without size** is compared with a sun 0.02 rad wide. Forms that sample directions show it as
  rare, bright dots, so for them medians are compared. A mirror can't show a lamp without a size, so
  exact forms with a mirror have no such row.
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
