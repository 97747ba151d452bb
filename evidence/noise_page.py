# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the page of the measurements by evidence/noise_table.py."""

import collections
import math
import statistics

from markdown_table import heading, line

UNIT, NODE = "Glossy", "node"
#: The form whose picture is the divisor of noise: of those that a model has, the one with least
#: noise.
LEAST_NOISE = ("exact", "aimed", "fitted", "twin")
#: Forms that are unbiased without an assumption about lamps.
UNBIASED = ("exact", "sampled")
#: Side, in pixels, of the blocks whose means are compared.
BLOCK = 6

INTRODUCTION = """\
# Noise and CPU time by model and lamp

`evidence/noise` makes this page in Blender 4.5. [noise.csv](noise.csv) and
[noise-cost.csv](noise-cost.csv) have the figures with their errors.

**The scene** is a ball with the model on a grey floor, under one kind of light. If the light is a
lamp, the world has the dim grey of a new file. Settings are those of a new file, with three
exceptions: OSL is on, one thread renders, and adaptive sampling and denoising are off, so that all
pictures have the same number of samples. A table names the parameters that differ from the
defaults.

**Noise** is relMSE: the variance of a pixel divided by its squared radiance + 0.01, averaged over
the pixels of the ball.

- Pictures have 64 samples per pixel, unless another number is given.
- The variance is that between pictures with {seeds} seeds (2 for 1,024 samples).
- The radiance is that of the model's form with the least noise. If that is the sampled form, it is
  averaged over squares of 7 x 7 pixels.
- The unit is the noise of Blender's own Glossy node (GGX, colour 0.8, roughness 0.4) in the same
  scene. Visible grain is the square root of the noise.
- *unmet* means that the form shows less than 80 % of the light, because the light would arrive as
  rare, bright dots, and no picture has one. Medians count it as infinite.
- Noise in the hundreds comes from a few dots, and is a rough figure. In a picture of 42 x 42 pixels
  an ideal mirror, as `schlick`, `schlick_double` and `coupled` have one, shows a small lamp in one
  or two pixels, and at the edge of its image in some of the pictures only. In 128 x 128 pixels
  `schlick` under a point lamp has 0.0022 as Formula Nodes and 0.0019 in its aimed form.

**Cost** is CPU time per sample in units of that node, without the time that Cycles needs to compile
shaders. Forms and node take turns in one process. **Noise x cost** is how much longer than with the
Glossy node a picture takes that has the same noise.
"""


#: The noise of a form whose pictures lack light that would appear as rare bright pixels.
MISSES_LIGHT = math.inf
#: If a form shows less than this share of the light, it missed the lamps.
MIN_LIGHT_SHARE = 0.8


def number(x):
    if x == MISSES_LIGHT:
        return "unmet"
    if x >= 100:
        return f"{float(f'{x:.2g}'):.0f}" if x < 1e5 else f"{x:.0e}".replace("e+0", "e")
    return f"{x:.2g}" if x >= 0.01 else f"{x:.1g}"


def percentile_rows(columns):
    """Rows with the median and the maximum of each column of numbers."""
    some = [[x for x in column if x is not None] for column in columns]
    yield line("**median**", *(number(statistics.median(c)) if c else "" for c in some))
    yield line("**worst**", *(number(max(c)) if c else "" for c in some))


class Page:
    def __init__(self, rows, costs, conditions, defaults=None):
        """`defaults`: costs of forms, by model and form, where `costs` has none for a light."""
        self.rows, self.conditions, self.defaults = rows, conditions, defaults or {}
        self.noise = {}
        for row in rows:
            place = row["condition"], int(row["samples"])
            self.noise.setdefault(row["form"], {}).setdefault(case_key(row), {})[place] = row
        self.costs = {
            (r["model"], r["values"], r["form"], r["condition"]): float(r["cost"]) for r in costs
        }
        order = list(conditions)
        places = {(r["condition"], int(r["samples"])) for r in rows if r["condition"] in order}
        self.places = sorted(places, key=lambda p: (order.index(p[0]), p[1]))
        self.by_default = {
            (name, n) for name, entry in conditions.items() for n in entry["samples"]
        }
        self.forms = [f for f in dict.fromkeys((*LEAST_NOISE, "sampled")) if f in self.noise]
        self.forms += [f for f in self.noise if f not in (*self.forms, NODE)]

    def title(self, place):
        name, samples = place
        many = "" if samples == 64 else f", {samples:,} samples"
        return self.conditions[name]["title"] + many

    def unit(self, place):
        row = self.noise.get(NODE, {}).get((UNIT, ""), {}).get(place)
        return float(row["noise"]) if row else None

    def shows_light(self, row):
        """True if the form shows the light that the model's form with least noise shows."""
        place = row["condition"], int(row["samples"])
        divisor = self.noise.get(row["divided_by"], {}).get(case_key(row), {}).get(place, row)
        mean, of = float(row["mean"]), float(divisor["mean"])
        error = math.hypot(float(row["mean_error"]), float(divisor["mean_error"]))
        return mean >= MIN_LIGHT_SHARE * of or mean + 5 * error >= of

    def relative(self, form, case, place):
        row, unit = self.noise[form].get(case, {}).get(place), self.unit(place)
        if not row or not unit:
            return None
        return float(row["noise"]) / unit if self.shows_light(row) else MISSES_LIGHT

    def cost(self, form, case, place):
        """The cost of the form at the model's defaults, with the same number of lamps."""
        timed = self.conditions[place[0]]["timed_as"]
        return self.costs.get((case[0], "", form, timed))

    def common(self):
        """Places for the tables of all models; those measured for a few models have their own
        table."""
        return [
            p for p in self.places if p in self.by_default and not self.conditions[p[0]]["picked"]
        ]

    def table(self, form, value):
        places = self.common()
        lines = heading("Model", *(self.title(p) for p in places))
        columns = [[] for _ in places]
        for case in self.noise[form]:
            cells = [value(form, case, p) for p in places]
            if not any(c is not None for c in cells):
                continue
            for column, cell in zip(columns, cells, strict=True):
                column.append(cell)
            lines.append(line(name_of(case), *("" if c is None else number(c) for c in cells)))
        return [*lines, *percentile_rows(columns), ""]

    def cost_weighted(self, form, case, place, default=None):
        """`default`: the cost where none was measured with that number of lamps."""
        noise, cost = self.relative(form, case, place), self.cost(form, case, place) or default
        return None if noise is None or cost is None else noise * cost

    def summary(self):
        places = self.common()
        lines = ["## Median and worst by form", ""]
        lines += heading("Form", "", *(self.title(p) for p in places))
        for form in self.forms:
            found = [
                [x for c in self.noise[form] if (x := self.relative(form, c, p)) is not None]
                for p in places
            ]
            for what, of in (("median", statistics.median), ("worst", max)):
                cells = (number(of(f)) if f else "" for f in found)
                lines.append(line(f"{form}" if what == "median" else "", what, *cells))
        return [*lines, ""]

    def best(self):
        """In how many cases each form takes the least time for a picture with the same noise."""
        introduction = [
            "## Which form is best under which light",
            "",
            "In how many of the tested materials each form has the least noise x cost. Exact,",
            "aimed, sampled and nodes are right on average; fitted and twin have an error. Without",
            "Open Shading Language only nodes and twin can be rendered. Where the cost was not",
            "measured under a light, it is that under a small lamp and a sky.",
            "",
        ]
        found = [self.best_forms(place) for place in self.common()]
        lines = heading("Form", *(self.title(p) for p in self.common()))
        lines += [line(form, *(column[form] or "" for column in found)) for form in self.forms]
        return [*introduction, *lines, ""] if any(found) else []

    def best_forms(self, place):
        """How often each form has the least noise x cost at a place."""
        counts = collections.Counter()
        for case in dict.fromkeys(case for found in self.noise.values() for case in found):
            known = {}
            for form in self.forms:
                default = self.defaults.get((case[0], form))
                if (time := self.cost_weighted(form, case, place, default)) is not None:
                    known[form] = time
            if len(known) > 1:
                counts[min(known, key=known.get)] += 1
        return counts

    def nodes(self):
        lines = [
            "## Blender's own nodes",
            "",
            "Noise in absolute numbers; the Glossy node is the unit of all other tables.",
        ]
        lines += ["", *heading("Node", *(self.title(p) for p in self.common()))]
        for case, found in self.noise.get(NODE, {}).items():
            cells = (number(float(found[p]["noise"])) if p in found else "" for p in self.common())
            lines.append(line(case[0], *cells))
        return [*lines, ""]

    def cost_table(self):
        timed = [c for c in self.conditions if any(k[3] == c for k in self.costs)]
        if not timed:
            return []
        lines = ["## Cost", "", "CPU time per sample in units of the Glossy node."]
        titles = [self.conditions[c]["title"] for c in timed]
        lines += ["", *heading("Model", "form", *titles)]
        for model, form in dict.fromkeys((k[0], k[2]) for k in self.costs):
            cells = (self.costs.get((model, "", form, c)) for c in timed)
            lines.append(
                line(f"`{model}`", form, *("" if c is None else f"{c:.2f}" for c in cells))
            )
        return [*lines, ""]

    def unbiased(self, case, place):
        """(form, row) of the form that is right on average there, with the most samples."""
        for form in UNBIASED:
            found = self.noise.get(form, {}).get(case, {})
            of = [p for p in found if p[0] == place[0]]
            if of:
                most = max(of, key=lambda p: p[1])
                return form, found[most]
        return None, None

    def mean_difference(self, form, case, place):
        """The relative difference of the means, and its standard error."""
        row = self.noise[form].get(case, {}).get(place)
        name, reference = self.unbiased(case, place)
        if row is None or reference is None or name == form or not self.shows_light(reference):
            return None
        mean, of = float(row["mean"]), float(reference["mean"])
        error = math.hypot(float(row["mean_error"]), float(reference["mean_error"]))
        return ((mean - of) / of, error / of) if of > 0 else None

    def means(self):
        introduction = [
            "## Means",
            "",
            "Difference of the ball's mean radiance from that of the exact form (of the sampled",
            "form if there is no exact one), and its standard error, in percent. That form has",
            "the largest number of samples that was measured. Differences above 1 % and 5",
            "standard errors are bold. The standard error is estimated from a few pictures, and",
            "is too small where light arrives only as rare dots. A cell is empty if the exact or",
            "sampled form has not met the lamp.",
            "",
        ]
        lines = []
        for form in self.forms:
            places = self.common()
            rows = []
            for case in self.noise[form]:
                found = [self.mean_difference(form, case, p) for p in places]
                if any(found):
                    rows.append(line(name_of(case), *(percent(f) for f in found)))
            if rows:
                lines += [f"### {form}", "", *heading("Model", *(self.title(p) for p in places))]
                lines += [*rows, ""]
        return [*introduction, *lines] if lines else []

    def penumbras(self):
        places = [p for p in self.places if self.conditions[p[0]]["picked"]]
        rows = []
        for place in places:
            for form in self.forms:
                for case in self.noise[form]:
                    if not (difference := self.mean_difference(form, case, place)):
                        continue
                    row = self.noise[form][case][place]
                    apart = [f"{100 * float(row[k]):.2f}" if row[k] else "" for k in APART]
                    rows.append(
                        line(name_of(case), form, f"{place[1]:,}", percent(difference), *apart)
                    )
        if not rows:
            return []
        return [
            "## In a penumbra",
            "",
            "The edge of a ball's shadow crosses a floor with the model, under a 1 m area lamp,",
            "seen from the mirror direction. Only pixels that see a part of the lamp count. The",
            "table compares with the exact or sampled form, in percent: the difference of the",
            f"mean, the relative L1 difference of squares of {BLOCK} x {BLOCK} pixels, and the",
            "value of the latter that noise alone would give.",
            "",
            *heading("Model", "form", "samples", "mean", "squares", "by noise"),
            *rows,
            "",
        ]

    def text(self, seeds):
        lines = [INTRODUCTION.format(seeds=seeds)]
        lines += self.summary() + self.best() + self.nodes()
        for form in self.forms:
            lines += [f"## {form}", "", "Noise in units of the Glossy node.", ""]
            lines += self.table(form, self.relative)
            if any(k[2] == form for k in self.costs):
                lines += ["Noise x cost.", "", *self.table(form, self.cost_weighted)]
        lines += self.cost_table() + self.means() + self.penumbras()
        return "\n".join(lines)


APART = ("apart", "apart_error")


def case_key(row):
    return row["model"], row["values"]


def name_of(case):
    return f"`{' '.join(case).strip()}`"


def percent(difference):
    if difference is None:
        return ""
    value, error = (100 * x for x in difference)
    text = f"{value:+.1f} ± {error:.1f}" if error >= 0.05 else f"{value:+.2f} ± {error:.2f}"
    return f"**{text}**" if abs(value) > 1 and abs(value) > 5 * error else text
