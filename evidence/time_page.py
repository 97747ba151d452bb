#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the page of error against run time, from measurements by evidence/noise, evidence/bench and
evidence/forms.

    python evidence/time_page.py DOCS COSTS.csv [PICTURES.md]

Reads DOCS/noise.csv and DOCS/tables/forms.md and writes DOCS/time.md, time-noise.png and
time-error.png. PICTURES.md is the part that evidence/time_pictures.py wrote; without it, the page
keeps its current one.
"""

import csv
import re
import statistics
import subprocess
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import noise_page
from markdown_table import heading, line

#: Marks of forms, in the order of the tables.
COLORS = {
    "exact": "tab:green",
    "aimed": "tab:blue",
    "fitted": "tab:orange",
    "twin": "tab:purple",
    "sampled": "tab:red",
    "nodes": "tab:brown",
}
#: Blender's own nodes: the unit, and others that were measured.
UNIT = noise_page.UNIT
DIFFUSE = "Diffuse"
#: Title of the part with pictures.
PICTURES = "## The same time, in pictures"


def read(path):
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def measured_on(path):
    """The date of the last change of a table; None outside a git checkout."""
    command = ["git", "log", "-1", "--format=%cs", "--", path.name]
    done = subprocess.run(command, cwd=path.parent, capture_output=True, text=True)
    return done.stdout.strip() or None


def times(rows, costs):
    """{form: {condition: [CPU time to reach the noise of the Glossy node, one per case]}}, for 64
    samples; infinite if a form missed the lamp. Costs are those of a model's defaults."""
    node = {r["condition"] for r in rows if (r["model"], r["form"]) == (UNIT, noise_page.NODE)}
    rows = [r for r in rows if int(r["samples"]) == 64 and r["condition"] in node]
    names = list(dict.fromkeys(r["condition"] for r in rows))
    conditions = {n: {"title": n, "timed_as": n, "samples": [64], "picked": False} for n in names}
    page = noise_page.Page(rows, [], conditions)
    cost = {(r["model"], r["form"]): float(r["cost"]) for r in costs}
    found = {}
    for form in page.forms:
        for case in page.noise[form]:
            if (case[0], form) not in cost:
                continue
            for name in names:
                noise = page.relative(form, case, (name, 64))
                if noise is not None:
                    by = found.setdefault(form, {}).setdefault(name, [])
                    by.append(noise * cost[case[0], form])
    diffuse = {n: page.relative(noise_page.NODE, (DIFFUSE, ""), (n, 64)) for n in names}
    return names, found, diffuse


def forms_table(text):
    """[(model, form, error as a share of the light, cost)] from docs/tables/forms.md."""
    rows = [re.split(r"\s*\|\s*", r.strip("| \n")) for r in text.splitlines() if r.startswith("|")]
    names = rows[0][1:]
    found = []
    for row in rows[2:]:
        for form, cell in zip(names, row[1:], strict=True):
            match = re.fullmatch(r"(\d+), ([\d.]+)( %)?, ([\d.]+)", cell)
            if match:
                error = float(match[2]) / (100 if match[3] else 1)
                found.append((row[0].strip("`"), form, error, float(match[4])))
    return found


def title(name):
    return name.replace("_", " ")


def draw_times(names, found, diffuse, out):
    figure, axes = plt.subplots(figsize=(9, 3.8), dpi=90, layout="constrained")
    top = 3e6
    forms = list(found)
    apart = 0.8 / len(forms)
    for k, form in enumerate(forms):
        for i, name in enumerate(names):
            values = sorted(found[form].get(name, []))
            x = [i + (k - (len(forms) - 1) / 2) * apart] * len(values)
            color = COLORS.get(form, "0.4")
            label = form if i == 0 else None
            drawn = [min(v, top) for v in values]
            axes.scatter(x, drawn, s=9, color=color, alpha=0.55, lw=0, label=label)
            if values:
                middle = min(statistics.median(values), top)
                axes.plot([x[0] - 0.4 * apart, x[0] + 0.4 * apart], [middle] * 2, color=color, lw=2)
    axes.axhline(1, color="0.3", lw=0.8)
    nodes = [(i, diffuse[n]) for i, n in enumerate(names) if diffuse.get(n)]
    axes.scatter(*zip(*nodes, strict=True), marker="D", s=16, color="0.3", label="Diffuse node")
    axes.set(yscale="log", ylim=(0.003, top * 2), xlim=(-0.6, len(names) - 0.4))
    axes.set_xticks(range(len(names)), [title(n).replace(" ", "\n") for n in names], fontsize=7)
    axes.set_ylabel("CPU time, Glossy node = 1", fontsize=8)
    axes.tick_params(axis="y", labelsize=7)
    axes.legend(fontsize=7, ncols=len(forms) + 1, loc="lower right")
    figure.savefig(out, metadata={"Software": None})
    plt.close(figure)


def draw_errors(rows, out):
    figure, axes = plt.subplots(figsize=(9, 3.2), dpi=90, layout="constrained")
    for form in dict.fromkeys(r[1] for r in rows):
        of = [r for r in rows if r[1] == form]
        axes.scatter(
            [r[3] for r in of],
            [100 * r[2] for r in of],
            s=18,
            color=COLORS.get(form, "0.4"),
            alpha=0.7,
            lw=0,
            label=form,
        )
    axes.axvline(1, color="0.3", lw=0.8)
    axes.set_yscale("symlog", linthresh=0.1)
    axes.set_ylim(-0.02, 40)
    axes.set_yticks([0, 0.1, 1, 10], ["0", "0.1", "1", "10"], fontsize=7)
    axes.set_xlabel("CPU time a sample, Glossy node = 1", fontsize=8)
    axes.set_ylabel("error, % of the light", fontsize=8)
    axes.tick_params(labelsize=7)
    axes.legend(fontsize=7, ncols=5, loc="upper right")
    figure.savefig(out, metadata={"Software": None})
    plt.close(figure)


def text(names, found, diffuse, rows, days):
    def cell(values):
        if not values:
            return ""
        low, high = statistics.median(values), max(values)
        show = noise_page.number
        return f"{show(low)} ({show(high)})"

    lines = [
        "# Error against run time",
        "",
        "`evidence/times` makes this page from measurements in Blender 4.5, on one thread of an",
        f"x86-64 server: noise of `evidence/noise` ([noise.csv](noise.csv), {days[0]}), costs of",
        f"`evidence/bench --forms` (`blender_addon/costs.csv`, {days[1]}), and errors of",
        f"`evidence/forms` ([what each form takes](tables/forms.md), {days[2]}). Times are CPU",
        "times, in units of that of Blender's own Glossy node in the same scene. Both take turns",
        "in one process, so the ratios differ little between machines.",
        "",
        "A picture can be wrong for two reasons: noise, which more samples reduce, and an error of",
        "the form itself, which they do not.",
        "",
        "## Time until the noise is that of the Glossy node",
        "",
        "![CPU time to equal noise, by light and form](time-noise.png)",
        "",
        "Each dot is a model at one set of parameters, each bar the median of a form, and the line",
        "the Glossy node. Forms below the line are quicker than Blender's own shader. Dots at the",
        "top never reach that noise: their light appears as rare, bright dots, or in none of the",
        "pictures.",
        "",
        "The table lists the median, and in parentheses the worst; *unmet* means never. For",
        "Blender's Diffuse node it lists the noise alone. Formula Nodes have figures of four",
        "digits where an ideal mirror shows a lamp in [one or two pixels](noise.md).",
        "",
        *heading("Light", *found, f"{DIFFUSE} node"),
    ]
    for name in names:
        cells = [cell(found[form].get(name)) for form in found]
        node = diffuse.get(name)
        lines.append(line(title(name), *cells, noise_page.number(node) if node else ""))
    lines += [
        "",
        "## Error that remains",
        "",
        "![Form's own error over its cost](time-error.png)",
        "",
        "The part of the light that a form reflects in other directions than the model, at default",
        "parameters, over CPU time per sample. Formula Nodes are not in this table: they have the",
        "model's formulas, with [small errors where polynomials replace tables](nodes.md).",
        "",
        *heading("Form", "models", "error, median", "worst", "cost, median", "worst"),
    ]
    for form in dict.fromkeys(r[1] for r in rows):
        of = [r for r in rows if r[1] == form]
        errors, costs = [100 * r[2] for r in of], [r[3] for r in of]
        lines.append(
            line(
                form,
                len(of),
                f"{statistics.median(errors):.2g} %",
                f"{max(errors):.2g} %",
                f"{statistics.median(costs):.2f}",
                f"{max(costs):.2f}",
            )
        )
    return lines


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    docs, costs = map(Path, sys.argv[1:3])
    files = (docs / "noise.csv", costs, docs / "tables" / "forms.md")
    names, found, diffuse = times(read(files[0]), read(costs))
    rows = forms_table(files[2].read_text(encoding="utf-8"))
    if not rows or not found:
        sys.exit(f"time_page: {files[0]}, {files[2]}: expected rows of forms, found none")
    draw_times(names, found, diffuse, docs / "time-noise.png")
    draw_errors(rows, docs / "time-error.png")
    days = [measured_on(f.resolve()) or "day unknown" for f in files]
    lines = text(names, found, diffuse, rows, days)
    page = docs / "time.md"
    pictures = Path(sys.argv[3]) if len(sys.argv) == 4 else page
    if pictures.is_file():
        _, title, kept = pictures.read_text(encoding="utf-8").partition(PICTURES)
        lines += ["", title + kept.rstrip()] if title else []
    page.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
