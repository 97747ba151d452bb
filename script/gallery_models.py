#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a page for each model: three balls in Blender and the reference renderer, lobes, albedo.

    python script/gallery_models.py scenes MODELS.json OUT-FOLDER     writes OUT/ball-MODEL.json
    python script/gallery_models.py pictures MODELS.json OUT-FOLDER   writes OUT/picture-MODEL.json
    python script/gallery_models.py pages MODELS.json REPORT-FOLDER PAGES-FOLDER

MODELS.json is the output of `brdfc list --json`. The pages use the pictures and measurements that
`script/demo_render.py` and `brdfc report` made of those scenes; models that were not rendered keep
their pages. Plots use the Python package `brdfc`, which must be importable. No model is named here:
the parameter values to show come from the schema.
"""

import json
import math
import sys
from pathlib import Path

from gallery_pages import measured, page_of, strip

ROOT = Path(__file__).resolve().parent.parent
#: Prefix of the names of models' scenes.
PREFIX, PICTURE = "ball-", "picture-"
#: Ready-made materials by catalogue.
LIBRARY = ROOT / "blender_addon" / "library" / "materials.json"
#: The scene whose floor, lamps and room the pictures have; centres of their balls, in units of the
#: radius.
STUDIO, PICTURE_SPP = "as-fig8", 16
#: Two of Blender's own nodes, with which pictures take a third of the time.
FLOOR = {"model": "lambertian_specular", "parameters": {"rd": [0.1, 0.105, 0.115], "rs": 0.08}}
PLACES = ((-4.1, 0.4), (-2.3, -1.6), (0.0, -2.6), (2.3, -1.6), (4.1, 0.4))
#: Pixels and samples of the picture; radius of a ball, and distance between two.
SIZE, SPP, RADIUS, STEP = (231, 84), 48, 0.5, 1.12
#: Views in degrees from the normal: for lobes in the plane of incidence, and for lobes over the
#: hemisphere.
VIEWS, DISKS = (0, 30, 60, 80), (10, 45, 75)
#: Number of panels for the albedo, each for one value of a parameter.
PANELS = 3


def scaled(number, t):
    """The value at t on the slider, in [0, 1]. The scale is logarithmic if the schema declares
    `by_factors`, as in generator/core/axis_scale.h."""
    low, high = number["soft_min"], number["soft_max"]
    if not number["by_factors"]:
        return low + t * (high - low)
    if low > 0:
        return low * (high / low) ** t
    return math.expm1(t * math.log1p(high))


def place(number, value):
    """The position of a value on the slider: the inverse of scaled()."""
    low, high = number["soft_min"], number["soft_max"]
    if not number["by_factors"]:
        return (value - low) / (high - low)
    if low > 0:
        return math.log(value / low) / math.log(high / low)
    return math.log1p(value) / math.log1p(high)


def values_of(parameter):
    """A few values of a parameter: the default of a number and one on each side of it; three
    greys; all choices."""
    if parameter["kind"] == "choice":
        return parameter["choices"]
    if parameter["kind"] == "color":
        return [0.2, 0.5, 0.8]
    middle = place(parameter, parameter["default"])
    places = (middle / 2, middle, (1 + middle) / 2)
    if not 0.02 < middle < 0.98:
        places = (0, 0.5, 1)
    return [float(f"{scaled(parameter, t):.2g}") for t in places]


def axis_of(model):
    """The parameter that varies between pictures: that of the stored fit; else a choice that comes
    before all numbers; else the first with a logarithmic slider; else the first that is not a
    colour."""
    parameters = model["parameters"]
    fit = model["properties"]["fit_axis"]
    numbers = [p for p in parameters if p["kind"] != "color"]
    return next(
        p
        for p in (
            *(p for p in parameters if p["name"] == fit),
            *(p for p in numbers[:1] if p["kind"] == "choice"),
            *(p for p in numbers if p.get("by_factors")),
            *numbers,
            *parameters,
        )
    )


def shown(model):
    """The parameter values of the three balls, by name."""
    axis = axis_of(model)
    return [{axis["name"]: value} for value in values_of(axis)[:3]]


def assigned(values):
    return ", ".join(f"{k}={v if isinstance(v, str) else f'{v:g}'}" for k, v in values.items())


def ball_scene(model):
    """Three balls on a floor under one small lamp, in a dim room, which mirrors reflect."""
    balls = shown(model)
    kinds = {p["name"]: p["kind"] for p in model["parameters"]}

    def parameters(values):
        return {k: [v] * 3 if kinds[k] == "color" else v for k, v in values.items()}

    return {
        "name": PREFIX + model["name"],
        "description": f"Three balls of {model['label']} under a small lamp in a dim room.",
        "settings": {
            "width": SIZE[0],
            "height": SIZE[1],
            "spp": SPP,
            "seed": 1,
            "max_bounces": 6,
        },
        "camera": {
            "type": "perspective",
            "position": [0, -7, 2.1],
            "look_at": [0, 0, 0.49],
            "fov_y_degrees": 9.6,
        },
        "materials": {
            "floor": {"model": "lambert", "parameters": {"rho": [0.35, 0.34, 0.33]}},
            **{
                f"ball_{i}": {"model": model["name"], "parameters": parameters(values)}
                for i, values in enumerate(balls)
            },
        },
        "objects": [
            {
                "name": "floor",
                "shape": {"type": "quad", "size": [40, 40]},
                "material": "floor",
            },
            *(
                {
                    "name": f"ball_{i}",
                    "shape": {"type": "sphere", "radius": RADIUS},
                    "transform": {
                        "translate": [STEP * (i - (len(balls) - 1) / 2), 0, RADIUS + 0.001]
                    },
                    "material": f"ball_{i}",
                }
                for i in range(len(balls))
            ),
        ],
        "lights": [{"type": "point", "position": [-2.6, -3.2, 4], "power": 330, "radius": 0.1}],
        "environment": {"procedural": "interior", "width": 512, "strength": 0.25},
    }


def claims(model):
    """The claims of the schema about the model, as a sentence."""
    q = model["properties"]
    parts = [
        "it is reciprocal" if q["reciprocal"] else "it is not reciprocal",
        "it loses no light"
        if q["lossless"]
        else "it gains no light"
        if q["conserving"]
        else "it gains light for some parameters and views",
    ]
    if not q["isotropic"]:
        parts.append("its highlights may be stretched along the tangent")
    text = ", ".join(parts[:-1]) + (", and " if len(parts) > 2 else " and ") + parts[-1]
    return text[0].upper() + text[1:] + "."


def in_plane(np, theta):
    """Directions in the plane of incidence, at these angles from the normal."""
    return np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=-1)


def draw_weights(np, figure, grid, formulas, model):
    """Draws the weights of ideal reflection and refraction by view, for models that have only
    these."""
    angle = np.linspace(0, 90, 181)[:-1]
    wo = in_plane(np, np.radians(-angle))
    for i, values in enumerate(shown(model)):
        axes = figure.add_subplot(grid[0, i])
        for channel, color in enumerate(("tab:red", "tab:green", "tab:blue")):
            axes.plot(angle, formulas.mirror(wo, **values)[:, channel], color)
            axes.plot(angle, formulas.transmit(wo, **values)[:, channel], color, ls="--")
        axes.set_title(assigned(values), fontsize=9)
        axes.set_xlabel("view, degrees from the normal", fontsize=8)
        axes.set(xlim=(0, 90), ylim=(0, 1.05))
        axes.tick_params(labelsize=7)
        if i == 0:
            axes.set_ylabel("weight", fontsize=8)


def draw_slices(np, figure, grid, model, formulas):
    """Draws f cos in the plane of incidence, with one panel per value."""
    theta = np.radians(np.linspace(-90, 90, 1441))
    for i, values in enumerate(shown(model)):
        axes = figure.add_subplot(grid[0, i], projection="polar")
        axes.set(theta_zero_location="N", theta_direction=-1, thetamin=-90, thetamax=90)
        most = 0.1
        for k, view in enumerate(VIEWS):
            wo = in_plane(np, np.radians(-view))
            f_cos = formulas.eval(in_plane(np, theta), wo, **values)
            f_cos = f_cos.mean(axis=-1) * np.cos(theta)
            most = max(most, f_cos.max())
            axes.plot(theta, np.sqrt(f_cos), f"C{k}", lw=1.2, label=f"{view}°")
        ticks = [t for t in 10.0 ** np.arange(-2, 8) if most / 200 < t <= most * 1.05]
        top = math.sqrt(most) * 1.04
        axes.set_rmax(top)
        if model["mirror"]:
            # Delta terms have their own scale: the rim is a weight of 1.
            for k, view in enumerate(VIEWS):
                wo = in_plane(np, np.radians(-view))
                length = math.sqrt(float(formulas.mirror(wo, **values).mean())) * top
                angle = np.radians(view)
                axes.plot([angle, angle], [0, length], f"C{k}:", lw=1.6)
                axes.plot([angle], [length], f"C{k}o", ms=3)
        axes.set_rgrids([math.sqrt(t) for t in ticks[-2:]], [f"{t:g}" for t in ticks[-2:]])
        axes.tick_params(axis="y", labelsize=6, pad=1)
        axes.tick_params(axis="x", pad=-2)
        axes.set_thetagrids([-90, -60, -30, 0, 30, 60, 90], fontsize=6)
        axes.set_title(assigned(values), fontsize=9, y=0.86)
        if i == 1:
            handles, labels = axes.get_legend_handles_labels()
            figure.legend(
                handles, labels, fontsize=7, ncols=4, loc="outside upper center", frameon=False
            )


def draw_disks(np, figure, grid, model, formulas):
    """Draws f cos over the hemisphere seen from above; equal areas are equal solid angles."""
    from matplotlib.colors import LogNorm

    values = shown(model)[1 if len(shown(model)) > 2 else 0]
    side = np.linspace(-1, 1, 181)
    x, y = np.meshgrid(side, side)
    square = x * x + y * y
    inside = square < 1
    # Lambert's azimuthal equal-area projection: 1 - z is the squared radius.
    z = np.where(inside, 1 - square, 1.0)
    spread = np.where(inside, np.sqrt(np.maximum(2 - square, 0)), 0)
    wi = np.stack([x * spread, y * spread, z], axis=-1)
    f_cos = []
    for view in DISKS:
        f = formulas.eval(wi, in_plane(np, np.radians(-view)), **values).mean(axis=-1) * z
        f_cos.append(np.where(inside, f, np.nan))
    most = max(np.nanmax(f) for f in f_cos)
    norm = LogNorm(most / 1e4, most)
    axes_all = []
    for i, (view, f) in enumerate(zip(DISKS, f_cos, strict=True)):
        axes = figure.add_subplot(grid[1, i])
        axes.set_facecolor("none")
        drawn = axes.imshow(
            np.maximum(f, most / 1e4),
            norm=norm,
            origin="lower",
            cmap="magma",
            extent=(-1, 1, -1, 1),
        )
        s = math.sqrt(1 - math.cos(math.radians(view)))
        axes.plot([-s], [0], "wx", ms=5)
        axes.plot([s], [0], "w+", ms=6)
        axes.set_title(f"seen from {view}°, {assigned(values)}", fontsize=8)
        axes.set_axis_off()
        axes_all.append(axes)
    bar = figure.colorbar(drawn, ax=axes_all, shrink=0.8, pad=0.01)
    bar.ax.tick_params(labelsize=6)
    bar.set_label("f cos, 1/sr", fontsize=7)


def draw_albedo(np, plt, model, formulas, out):
    angle = np.linspace(0, 89, 46)
    cosines = np.cos(np.radians(angle))
    axis = axis_of(model)
    others = [p for p in model["parameters"] if p is not axis and p["kind"] != "color"]
    panels = []
    for parameter in (axis, *others):
        curves = [
            (v, formulas.albedo(cosines, samples=2048, **{parameter["name"]: v}).mean(axis=-1))
            for v in values_of(parameter)
        ]
        spread = max(abs(c - curves[0][1]).max() for _, c in curves)
        if parameter is axis or spread > 0.03:  # no panel for a parameter with little effect
            panels.append((parameter, curves))
        if len(panels) == PANELS:
            break
    figure, all_axes = plt.subplots(
        1, PANELS, figsize=(9, 2.7), dpi=90, layout="constrained", squeeze=False, sharey=True
    )
    top = 1.05
    for axes, (parameter, curves) in zip(all_axes[0], panels, strict=False):
        for value, curve in curves:
            axes.plot(angle, curve, lw=1.3, label=assigned({parameter["name"]: value}))
            top = max(top, min(curve.max() * 1.05, 3))
        axes.axhline(1, color="0.6", lw=0.7)
        axes.set(xlabel="view, degrees from the normal", xlim=(0, 90))
        axes.set_title(parameter["label"], fontsize=9)
        axes.tick_params(labelsize=7)
        axes.xaxis.label.set_size(8)
        axes.legend(fontsize=7)
    all_axes[0][0].set_ylim(0, top)
    all_axes[0][0].set_ylabel("albedo", fontsize=8)
    for axes in all_axes[0][len(panels) :]:
        axes.remove()
    save(figure, plt, out)


def save(figure, plt, out):
    figure.savefig(out, metadata={"Software": None}, pil_kwargs={"optimize": True})
    plt.close(figure)


def draw(model, formulas, pages):
    """Makes both drawings of a model. Returns what the first one shows."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np

    heights = (1.9, 2.5) if model["scatter"] else (2.5,)
    figure = plt.figure(figsize=(9, sum(heights) + 0.3), dpi=90, layout="constrained")
    grid = figure.add_gridspec(len(heights), 3, height_ratios=heights)
    if model["scatter"]:
        draw_slices(np, figure, grid, model, formulas)
        draw_disks(np, figure, grid, model, formulas)
    else:
        draw_weights(np, figure, grid, formulas, model)
    save(figure, plt, pages / f"{model['name']}-lobes.png")
    draw_albedo(np, plt, model, formulas, pages / f"{model['name']}-albedo.png")


def materials_of(model, count):
    """Materials of a model, in the form of a scene file: those of the library, without those that
    have another choice than the default, which Formula Nodes may lack; then the first one with
    other values of the parameter that varies between pictures."""
    library = json.loads(LIBRARY.read_text(encoding="utf-8")).values()
    entries = [e for catalog in library for e in catalog if e["model"] == model["name"]]
    choices = {p["name"]: p["default"] for p in model["parameters"] if p["kind"] == "choice"}
    plain = [e for e in entries if all(e["values"].get(k, v) == v for k, v in choices.items())]
    made = [
        {"model": model["name"], "parameters": dict(e["values"])}
        | ({"optical": e["substance"]} if "substance" in e else {})
        for e in plain or entries
    ] or [{"model": model["name"], "parameters": {}}]
    axis, first = axis_of(model), made[0]
    for value in values_of(axis):
        value = [value] * 3 if axis["kind"] == "color" else value
        made.append(first | {"parameters": first["parameters"] | {axis["name"]: value}})
    for material in made:
        for p in model["parameters"]:
            value = material["parameters"].get(p["name"])
            if p["kind"] == "color" and isinstance(value, int | float):
                material["parameters"][p["name"]] = [value] * 3
    return [made[i % len(made)] for i in range(count)]


def picture_scene(model):
    """A knot and five balls of a model in the studio of the picture of all models."""
    studio = json.loads((ROOT / "scenes" / f"{STUDIO}.json").read_text(encoding="utf-8"))
    radius, names = 0.55, ["knot", *(f"ball_{i}" for i in range(len(PLACES)))]
    floor, knot = studio["objects"][:2]
    assert (floor["name"], knot["shape"]["type"]) == ("floor", "knot")
    balls = [
        {
            "name": name,
            "shape": {"type": "sphere", "radius": radius},
            "transform": {"translate": [x * radius, y * radius, radius + 0.001]},
            "material": name,
        }
        for name, (x, y) in zip(names[1:], PLACES, strict=True)
    ]
    made = zip(names, materials_of(model, len(names)), strict=True)
    return studio | {
        "name": PICTURE + model["name"],
        "description": f"A knot and balls of {model['label']}.",
        "camera": studio["camera"] | {"look_at": [0, 0.5, 0.87], "fov_y_degrees": 16.2},
        "settings": studio["settings"] | {"width": 800, "height": 400, "spp": PICTURE_SPP},
        "materials": {"floor": FLOOR, **dict(made)},
        "objects": [floor, knot | {"name": "knot", "material": "knot"}, *balls],
    }


def scenes_with(name):
    """Links to the sections of gallery pages whose scenes use the model."""
    links = []
    for file in sorted((ROOT / "scenes").glob("*.json")):
        materials = json.loads(file.read_text(encoding="utf-8")).get("materials", {})
        if any(m["model"] == name for m in materials.values()):
            links.append(f"[{file.stem}](../{page_of(file.stem)}.md#{file.stem})")
    return links


def page(model, scene, folder, pages):
    """The page of a model, and its pictures. `scene` is its part of report.json."""
    name = model["name"]
    strip(folder, scene, pages / f"{name}.jpg")
    osl = "" if "nodes" in model["representations"] else "Open Shading Language on, "
    axis = axis_of(model)
    balls = [assigned(v) for v in shown(model)]
    values = next(iter(shown(model)[-1].items()))
    lines = [
        f"# {model['label']}",
        "",
        f"`{name}`: {model['paper']}.",
        "",
        f"{model['doc']} {claims(model)}",
        "",
        f"![{model['label']}]({name}-picture.jpg)",
        "",
        "Materials of the [library](../../library.md) and others, in Cycles at Blender's default",
        f"settings with {PICTURE_SPP} samples, {osl}denoised: `script/gallery pictures {name}`.",
        "",
        "## Three balls under a lamp",
        "",
        f"![{model['label']}: Blender, reference, difference]({name}.jpg)",
        "",
        f"From left to right {'; '.join(f'`{b}`' for b in balls)}. {axis['label']}: {axis['doc']}.",
        "",
        *measured(scene),
        "",
        "## Lobes",
        "",
        f"![Lobes of {model['label']}]({name}-lobes.png)",
        "",
    ]
    if model["scatter"]:
        lines += [
            "Top: the plane of incidence, for four view angles; the radius is the square root of",
            "f cos, in 1/sr. Bottom: the hemisphere seen from above, where equal areas are equal",
            "solid angles; × is the view, + the mirror direction.",
        ]
        if model["mirror"]:
            lines += [
                "Dotted lines: ideal reflection, as the square root of its weight; 1 at the rim."
            ]
    else:
        lines += [
            "All of it is ideal reflection (lines) and refraction (dashes), in red, green and blue."
        ]
    lines += [
        "",
        "## Albedo",
        "",
        f"![Albedo of {model['label']}]({name}-albedo.png)",
        "",
        "The fraction of light that a surface reflects under uniform illumination, averaged over",
        "the three colours; transmitted light is included.",
        "",
        "## The same by hand",
        "",
        "```sh",
        f"build/brdfc albedo {name} {values[0]}={values[1]}",
        f"script/gallery models {name}   # this page",
        "```",
        "",
    ]
    if links := scenes_with(name):
        lines += [f"Scenes with it: {', '.join(links)}.", ""]
    made = scene["provenance"]
    lines += [
        f"*Blender {made['Blender']}; {made['Processor']}. [How to read it](../overview.md).*"
    ]
    (pages / f"{name}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def overview(models, pages):
    lines = [
        "# A page for each model",
        "",
        "For each model: a picture; three balls under one lamp, in Blender and by the reference",
        "renderer, and the difference; its lobes; and its albedo. `script/gallery pictures` and",
        "`script/gallery models` make these pages from the models' schemas.",
        "",
    ]
    for model in models:
        name = model["name"]
        if (pages / f"{name}.md").is_file():
            lines += [f"[![{model['label']}]({name}-picture.jpg)]({name}.md)", ""]
            lines += [f"**[{model['label']}]({name}.md)** {model['doc']}", ""]
    (pages / "overview.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def main():
    makers = {"scenes": ball_scene, "pictures": picture_scene}
    if len(sys.argv) == 4 and sys.argv[1] in makers:
        models = json.loads(Path(sys.argv[2]).read_text(encoding="utf-8"))
        folder = Path(sys.argv[3])
        folder.mkdir(parents=True, exist_ok=True)
        for model in models:
            scene = makers[sys.argv[1]](model)
            file = folder / f"{scene['name']}.json"
            file.write_text(json.dumps(scene, indent=1), encoding="utf-8")
        return
    if len(sys.argv) != 5 or sys.argv[1] != "pages":
        sys.exit(__doc__)
    import brdfc

    models = json.loads(Path(sys.argv[2]).read_text(encoding="utf-8"))
    folder, pages = map(Path, sys.argv[3:5])
    pages.mkdir(parents=True, exist_ok=True)
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    rendered = {s["scene"]: s for s in report["scenes"]}
    for model in models:
        if scene := rendered.get(PREFIX + model["name"]):
            draw(model, brdfc.model(model["name"]), pages)
            page(model, scene, folder, pages)
    overview(models, pages)
    print(f"{len(rendered)} models in {pages / 'overview.md'}")


if __name__ == "__main__":
    main()
