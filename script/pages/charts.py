# SPDX-License-Identifier: GPL-3.0-or-later
"""Charts of error over run time, drawn by Matplotlib as SVG that stands in a page.

The page's style sheet gives them their colours, so that they follow its dark mode, and its font. A
dot is a link or has a tooltip, for which Matplotlib has no name: they are added to its SVG.
"""

import io
import math
import re
from xml.etree import ElementTree

import matplotlib
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

#: Colours of the style sheet by the ones that are drawn in their place: 0x0000 and a number.
FORM_COLORS, NATIVE_COLORS = 6, 3
VARIABLES = ["ink", "soft", "line", "accent", "card"]
VARIABLES += [f"form-{i}" for i in range(FORM_COLORS)]
VARIABLES += [f"native-{i}" for i in range(NATIVE_COLORS)]
COLOR = {name: f"#0000{i + 1:02x}" for i, name in enumerate(VARIABLES)}
#: Markers of forms: the next one when all colours are used.
MARKERS = "os^D"
#: Distances in pixels: a dot's radius, a name from its dot, half a dashed line.
DOT, BESIDE, HALF_LINE = 5, 14, 12
COSTS = (0.125, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 2, 3, 4, 8, 16, 32, 64)
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Chart:
    """Axes of relMSE over CPU time, of a size in pixels."""

    def __init__(self, name, title, size, margins):
        self.name, self.title, self.size = name, title, size
        self.points = []
        left, right, top, bottom = margins
        width, height = size
        self.figure = Figure(figsize=(width / 72, height / 72), dpi=72, facecolor="none")
        box = (left, bottom, width - left - right, height - top - bottom)
        self.axes = self.figure.add_axes(
            [a / b for a, b in zip(box, 2 * size, strict=True)], facecolor="none"
        )

    def set_axes(self, errors, costs, ticks, scale):
        axes = self.axes
        axes.set_xscale(scale)
        axes.set_yscale("log")
        axes.set(xlim=costs, ylim=decades(errors))
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_locator(LogLocator(numticks=9))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_formatter(FuncFormatter(power_of_ten))
        axes.grid(axis="y", color=COLOR["line"], linewidth=1)
        axes.set_axisbelow(True)
        axes.tick_params(length=0, pad=8, labelsize=12, labelcolor=COLOR["soft"])
        axes.spines[:].set_visible(False)
        axes.set_xlabel("CPU time / Glossy node", color=COLOR["soft"], fontsize=12)
        axes.set_ylabel(
            "relMSE", color=COLOR["soft"], fontsize=12, rotation_mode="anchor", labelpad=12
        )

    def add_point(self, form, color, marker="o", fill=None, link=None, models=None):
        """A dot with a tooltip."""
        name = f"point-{len(self.points)}"
        self.axes.plot(
            form["cost"],
            form["rel_mse"],
            marker,
            markersize=2 * DOT,
            markerfacecolor=fill or color,
            markeredgecolor=color,
            clip_on=False,
            gid=name,
        )
        text = f"relMSE {form['rel_mse']:.2g}, of which noise {form['noise_floor']:.2g}; "
        text += f"{form['cost']:.2f} times the CPU time of the Glossy node"
        attributes = {"class": "point"}
        if link is not None:
            attributes |= {"href": f"#{link}", "data-models": " ".join(models)}
            text = f"{link}, {form['label']}: {text}"
        self.points.append((name, text, attributes))

    def at(self, form):
        """The place of a form's dot in pixels, from the lower left corner."""
        return self.axes.transData.transform((form["cost"], form["rel_mse"]))

    def svg(self):
        out = io.BytesIO()
        # Texts stay texts. The salt makes ids that no other chart has, the same in every run.
        settings = {"svg.fonttype": "none", "svg.hashsalt": self.name}
        with matplotlib.rc_context(settings):
            self.figure.savefig(out, format="svg", metadata={"Date": None})
        root = ElementTree.fromstring(out.getvalue())
        tidy(root)
        for name, text, attributes in self.points:
            (point,) = root.findall(f".//g[@id='{name}']")
            point.tag = "a" if "href" in attributes else "g"
            point.attrib = attributes
            title = ElementTree.Element("title")
            title.text = text
            point.insert(0, title)
        for text in root.findall(".//g[@id='name']"):
            text.attrib = {"class": "name"}
        drop_names(root)
        width, height = self.size
        root.attrib = {
            "id": self.name,
            "class": "chart",
            "role": "img",
            "aria-label": self.title,
            "viewBox": f"0 0 {width} {height}",
            "width": str(width),
        }
        return Markup(ElementTree.tostring(root, encoding="unicode"))


# ---- Matplotlib's SVG as a part of a page ------------------------------------------------------


def tidy(root):
    """Takes from an SVG what a page does not need, and brings in the page's colours."""
    for element in root.iter():
        element.tag = local(element.tag)
        element.attrib = {local(key): value for key, value in element.attrib.items()}
        if style := element.get("style"):
            style = re.sub(r"font-family: [^;]*;? ?", "", style)
            style = re.sub(r"#0000([0-9a-f]{2})", variable, style)
            element.set("style", style.strip())
    for parent in list(root.iter()):
        for child in list(parent):
            # The style sheet would apply to the whole page.
            if child.tag in ("metadata", "style"):
                parent.remove(child)


def local(name):
    """A name without its namespace, which SVG within HTML does not have."""
    return name.rpartition("}")[2]


def variable(match):
    return f"var(--{VARIABLES[int(match[1], 16) - 1]})"


def drop_names(root):
    """Drops ids that nothing refers to: they would be in every chart."""
    text = " ".join(v for e in root.iter() for k, v in e.items() if k != "id")
    used = set(re.findall(r"#([\w-]+)", text))
    for element in root.iter():
        if element.get("id") not in used:
            element.attrib.pop("id", None)


# ---- axes --------------------------------------------------------------------------------------


def decades(values):
    """Powers of ten that enclose values, which are positive."""
    bottom, top = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    return 10.0**bottom, 10.0 ** max(top, bottom + 1)


def power_of_ten(value, _):
    return "10" + str(round(math.log10(value))).translate(SUPERSCRIPTS)


def shown(forms):
    """Forms with a cost and an error, which logarithmic axes can show."""
    return [f for f in forms if f["cost"] and f["rel_mse"] > 0]


# ---- charts ------------------------------------------------------------------------------------


def scenes(forms, scenes):
    """All scenes, with a colour for each form; empty if there are less than two dots. A dot links
    to its scene."""
    found = [f for scene in scenes for f in shown(scene["forms"])]
    if len(found) < 2:
        return ""
    costs = [1, *(f["cost"] for f in found)]
    span = min(costs) / 1.15, max(costs) * 1.15
    chart = Chart("overview", "relMSE over CPU time, all scenes", (860, 340), (70, 20, 70, 48))
    ticks = [tick for tick in COSTS if span[0] < tick < span[1]]
    chart.set_axes([f["rel_mse"] for f in found], span, ticks, "log")
    used = {"native": 0, "form": 0}
    for named in forms:
        kind, most = ("native", NATIVE_COLORS) if named["native"] else ("form", FORM_COLORS)
        index = used[kind]
        used[kind] += 1
        color, marker = COLOR[f"{kind}-{index % most}"], MARKERS[index // most % len(MARKERS)]
        chart.axes.plot([], [], marker, color=color, markersize=8, label=named["label"])
        for scene in scenes:
            for form in shown(scene["forms"]):
                if form["form"] == named["form"]:
                    of = {"link": scene["scene"], "models": scene["models"]}
                    chart.add_point(form, color, marker, **of)
    chart.figure.legend(
        loc="upper left",
        ncols=4,
        frameon=False,
        labelcolor=COLOR["soft"],
        fontsize=12,
        handletextpad=0.2,
    )
    return chart.svg()


def scene(scene):
    """One scene: a named dot for each form, hollow if another form is better in error and time, and
    a dashed line at the noise that its error contains. Empty if there are less than two dots."""
    forms = shown(scene["forms"])
    if len(forms) < 2:
        return ""
    most = max(1, *(f["cost"] for f in forms))
    errors = [f[key] for f in forms for key in ("rel_mse", "noise_floor") if f[key] > 0]
    chart = Chart(f"chart-{scene['scene']}", "relMSE over CPU time", (560, 250), (70, 40, 16, 48))
    end = math.ceil(2.1 * most) / 2
    step = 0.5 if end <= 4 else max(1, round(end / 10))
    ticks = [i * step for i in range(int(end / step) + 1)]
    chart.set_axes(errors, (0, end), ticks, "linear")
    lines = []
    for form in forms:
        fill = None if form["pareto"] else COLOR["card"]
        chart.add_point(form, COLOR["accent"], fill=fill)
        if form["noise_floor"] > 0:
            x, y = chart.axes.transData.transform((form["cost"], form["noise_floor"]))
            lines.append((x - HALF_LINE, x + HALF_LINE, y - 1, y + 1))
            chart.axes.plot(
                [x - HALF_LINE, x + HALF_LINE],
                [y, y],
                transform=None,
                clip_on=False,
                color=COLOR["soft"],
                linewidth=1,
                linestyle=(0, (4, 4)),
            )
    place_names(chart, forms, lines)
    return chart.svg()


def place_names(chart, forms, lines):
    """Writes the name of each form beside its dot, so that it covers no other name, dot or line."""
    width, height = chart.size
    places = [chart.at(form) for form in forms]
    taken = lines + [(x - DOT, x + DOT, y - DOT, y + DOT) for x, y in places]
    for form, (x, y) in sorted(zip(forms, places, strict=True), key=lambda item: item[1][1]):
        text = chart.axes.text(
            x,
            y,
            form["label"],
            transform=None,
            va="center_baseline",
            fontsize=12,
            color=COLOR["ink"],
            gid="name",
        )
        box = text.get_window_extent()
        to_left = x + BESIDE + box.width > width
        for line in range(2 * len(forms) + 2):
            # Beside the dot, else a line above or below it, and so on.
            gap = BESIDE if line == 0 else -DOT
            left = x - gap - box.width if to_left else x + gap
            shift = (line + 1) // 2 * (1 if line % 2 else -1) * box.height
            bottom = box.y0 + shift
            spot = (left, left + box.width, bottom, bottom + box.height)
            inside = bottom >= 0 and bottom + box.height <= height
            if inside and not any(overlap(spot, other) for other in taken):
                break
        taken.append(spot)
        text.set(x=left, y=y + shift)


def overlap(a, b):
    return a[0] < b[1] and b[0] < a[1] and a[2] < b[3] and b[2] < a[3]
