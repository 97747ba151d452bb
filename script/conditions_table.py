#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes one table of the rows that the conditions' tests measured in each version of Blender."""

import argparse
import csv
import json
from pathlib import Path

INTRODUCTION = """\
# What settings and scenes do to the forms

Made by `script/conditions`. Each row changes one thing in a clean scene; a cell is what that does
to the mean radiance of a form, with its standard error. Bold is what stands out of the noise by 5
standard errors and exceeds 2 %. Forms stand for all of their kind: those of closures with a mirror
and without, and those that draw rays with a mirror, with an anisotropic lobe, with a single lobe.
Blender's own Diffuse and Glossy nodes are there to compare with. Passes: mean difference from the
model's albedo, median angle from the true normal, largest difference of picture and light group.
"""


def cell(row):
    """Bias with its error, and what the panel does about it."""
    if "degrees" in row["condition"]:
        text = f"{row['bias']:.0f}°"
    elif row["error"]:
        text = f"{row['bias']:+.1%} ± {row['error']:.1%}"
    else:
        text = f"{row['bias']:+.3f}"
    if not row["biased"]:
        return text
    warned = row["code"] and any(w.startswith(row["code"]) for w in row["warned"])
    return f"**{text}**" + (" (panel warns)" if warned else "")


def markdown(versions):
    lines = [INTRODUCTION]
    for form in forms_of(versions):
        lines += [
            f"## {form}",
            "",
            "| condition | " + " | ".join(f"Blender {v}" for v in versions) + " |",
            "|---" * (len(versions) + 1) + "|",
        ]
        for condition in conditions_of(versions):
            found = [
                next((r for r in rows if r["form"] == form and r["condition"] == condition), None)
                for rows in versions.values()
            ]
            if any(found):
                cells = [cell(r) if r else "" for r in found]
                lines.append(f"| {condition} | " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines)


def forms_of(versions):
    return list(dict.fromkeys(r["form"] for rows in versions.values() for r in rows))


def conditions_of(versions):
    return list(dict.fromkeys(r["condition"] for rows in versions.values() for r in rows))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where <version>.json lie")
    folder = parser.parse_args().folder
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
    (folder / "conditions.md").write_text(markdown(versions) + "\n", encoding="utf-8")
    print(folder / "conditions.md")


if __name__ == "__main__":
    main()
