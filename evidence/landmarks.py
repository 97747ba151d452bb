#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots what the papers state about their models in words, with the Python package `brdfc`.

    python evidence/landmarks.py crescents CHOICE FILE.json a scene, with that choice of `below`
    python evidence/landmarks.py page TOOL PICTURES DOCS    DOCS/gallery/landmarks.md, its pictures

TOOL is the program brdfc. PICTURES contains mirror.png and lose.png, which the reference renderer
made of those scenes.
"""

import io
import json
import subprocess
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from markdown_table import heading, line

#: Reflectance at normal incidence of the polish in the coupled paper.
R0 = 0.05
SHARPNESS = (4, 12, 25, 100)
#: For Suffern's figure 25.6: patterns, views in degrees from the normal, rays of a disk; exponents.
PATTERNS = ("random", "regular", "jittered", "multi_jittered", "hammersley")
TURNED_VIEWS, RAYS = (45, 85), 256
EXPONENTS = (1, 10, 100, 1000, 100000)
SHARE_VIEWS = (45, 80, 85, 89, 89.9)
ROOT = Path(__file__).resolve().parent.parent
#: Pixels of the longer side of the crescents; pixels between the two pictures.
SIZE, GAP = 240, 6


def in_plane(theta):
    """Directions in the x-z plane, at these angles from the normal."""
    return np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=-1)


def reflectances(model, angle, **values):
    """Directional albedo by view: (matte part, mirror part)."""
    wo = in_plane(np.radians(angle))
    mirror = model.mirror(wo, **values)[..., 0]
    return model.albedo(wo[:, 2], **values)[..., 0] - mirror, mirror


def spdf(model, theta, view, **values):
    """Pdf per solid angle of the matte reflection: f cos divided by its albedo."""
    wo = in_plane(np.radians(np.array([view])))
    matte, _ = reflectances(model, np.array([view]), **values)
    f = model.eval(in_plane(theta), wo, **values)[..., 0]
    return f * np.cos(theta) / matte[0]


def anisotropy(model, view, samples=20000, **values):
    """The ratio of a lobe's widths across the plane of incidence and along it. Both are root mean
    squares about the mirror direction, in the tangent plane of the sphere there."""
    wo = in_plane(np.radians(-view))
    u = np.random.default_rng(1).uniform(size=(samples, 3))
    drawn = model.sample(wo, u, **values)
    wi, weight = drawn.wi, drawn.weight[:, 0]
    mirror = np.array([-wo[0], 0, wo[2]])
    along = np.array([mirror[2], 0, -mirror[0]])
    near = wi @ mirror > 0
    spread = [
        np.sqrt(np.average(x[near] ** 2, weights=weight[near])) for x in (wi[:, 1], wi @ along)
    ]
    return spread[0] / spread[1]


def glossy_rays(tool, degrees, below, e=1, pattern="hammersley", count=65536):
    """Directions sampled by the glossy reflector, seen along the mirror direction r with the normal
    upwards: an array (count, 2) in which r is (0, 0); and which of them are below the surface."""
    theta = np.radians(degrees)
    sine, cosine = float(np.sin(theta)), float(np.cos(theta))
    command = [tool, "sample", "glossy_reflector", f"e={e}", f"below={below}"]
    command += ["--pattern", pattern, "--count", str(count), "--wo", f"{sine!r},0,{cosine!r}"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    wi = np.loadtxt(io.StringIO(done.stdout), delimiter=",", skiprows=1, usecols=(0, 1, 2))
    return np.stack([wi[:, 1], wi[:, 0] * cosine + wi[:, 2] * sine], axis=-1), wi[:, 2] <= 0


def share_below(tool, degrees, e):
    """Share of the rays that are below the surface."""
    return glossy_rays(tool, degrees, "lose", e)[1].mean()


def turned_rays(tool, degrees, pattern):
    """Rays before and after they are turned, on the disk, and which ones are turned."""
    drawn, below = glossy_rays(tool, degrees, "lose", pattern=pattern, count=RAYS)
    turned, _ = glossy_rays(tool, degrees, "mirror", pattern=pattern, count=RAYS)
    return drawn, turned, below


def to_nearest(points, which):
    """Distances on the disk from some of these points to the nearest other one."""
    from scipy.spatial import cKDTree

    return cKDTree(points).query(points[which], 2)[0][:, 1]


def draw_turned(tool, out):
    """Draws the disks. Returns, for the last view and by pattern, the number of rays that are
    turned, and the median of their distances to the nearest other ray before and after."""
    size = (9, 3.75)
    figure, rows = plt.subplots(2, len(PATTERNS), figsize=size, dpi=90, layout="constrained")
    x = np.linspace(-1, 1, 401)
    found = {}
    for degrees, axes in zip(TURNED_VIEWS, rows, strict=True):
        horizon = -np.cos(np.radians(degrees)) * np.sqrt(1 - x * x)
        for pattern, a in zip(PATTERNS, axes, strict=True):
            drawn, turned, below = turned_rays(tool, degrees, pattern)
            a.fill_between(x, -np.sqrt(1 - x * x), horizon, color="#cdeef2", lw=0)
            a.add_patch(plt.Circle((0, 0), 1, fill=False, color="0.5", lw=0.7))
            a.scatter(*drawn[~below].T, s=3, color="k", lw=0)
            a.scatter(*drawn[below].T, s=3, color="0.6", lw=0)
            a.scatter(*turned[below].T, s=9, facecolors="none", edgecolors="r", lw=0.6)
            a.plot(0, 0, "+", color="tab:blue", ms=6)
            a.set(xlim=(-1.03, 1.03), ylim=(-1.03, 1.03), aspect="equal")
            a.axis("off")
            if a in rows[0]:
                a.set_title(pattern.replace("_", "-"), fontsize=9)
            found[pattern] = (
                int(below.sum()),
                np.median(to_nearest(drawn, below)),
                np.median(to_nearest(turned, below)),
            )
        axes[0].text(-1.12, 0, f"{degrees}°", fontsize=9, ha="right", va="center")
    save(figure, out)
    return found


def save(figure, out):
    figure.savefig(out, metadata={"Software": None}, pil_kwargs={"optimize": True})
    plt.close(figure)


def draw_coupled(out):
    import brdfc

    coupled = brdfc.model("coupled")
    angle = np.linspace(0, 89, 90)
    theta = np.radians(np.linspace(-90, 90, 361))
    figure, axes = plt.subplots(1, 3, figsize=(9, 2.9), dpi=90, layout="constrained")
    matte, mirror = reflectances(coupled, angle, r0=R0, rm=0.5)
    axes[0].plot(angle, matte, label="matte")
    axes[0].plot(angle, mirror, label="mirror")
    axes[0].plot(angle, matte + mirror, "k", lw=1, label="R, both")
    axes[0].set(title="R, R0 = 0.05, Rm = 0.5", ylim=(0, 1.05))
    for view in (0, 40, 60, 80):
        axes[1].plot(np.degrees(theta), spdf(coupled, theta, view, r0=R0, rm=0.5), label=f"{view}°")
    axes[1].plot(np.degrees(theta), np.cos(theta) / np.pi, "k:", lw=1, label="Lambert")
    axes[1].set(title="SPDF of the matte part, 1/sr")
    others = {
        "coupled": {"rm": 1},
        "shirley_1991": {"rd": 1},
        "schlick_double": {"rd": 1},
        "lambertian_specular": {"rd": 1, "rs": R0},
    }
    for name, values in others.items():
        model = brdfc.model(name)
        polish = {} if "rs" in values else {"r0": R0}
        axes[2].plot(angle, sum(reflectances(model, angle, **polish, **values)), label=model.label)
    axes[2].set(title="R over a white base", ylim=(0.9, 2.05))
    for a in axes:
        a.set_xlabel("degrees from the normal", fontsize=8)
        a.title.set_size(9)
        a.tick_params(labelsize=7)
        a.legend(fontsize=6.5)
    save(figure, out)


def draw_anisotropy(out):
    """Draws the curves. Returns the ratios by sharpness at the views of the table."""
    import brdfc

    model = brdfc.model("radziszewski_alda")
    angle = np.array([0, 15, 30, 45, 55, 65, 70, 75, 80, 83, 86])
    figure, axes = plt.subplots(figsize=(6, 2.9), dpi=90, layout="constrained")
    found = {}
    for n in SHARPNESS:
        ratio = [anisotropy(model, a, n=n) for a in angle]
        found[n] = dict(zip(angle.tolist(), ratio, strict=True))
        axes.plot(angle, ratio, "o-", ms=3, label=f"n={n}")
    phong = [anisotropy(brdfc.model("phong"), a, e=25) for a in angle]
    axes.plot(angle, phong, "k:", lw=1, label="Phong, e=25")
    axes.axhline(1, color="0.6", lw=0.7)
    axes.set_xlabel("view, degrees from the normal", fontsize=8)
    axes.set_ylabel("spread across / along", fontsize=8)
    axes.tick_params(labelsize=7)
    axes.legend(fontsize=7)
    save(figure, out)
    return found


def share_cells(tool, e):
    return [f"{100 * share_below(tool, v, e):.1f} %" for v in SHARE_VIEWS]


def crescents(choice, file):
    """The scene of the crescents at a smaller size, with this choice for light that would go below
    the horizon."""
    scene = json.loads((ROOT / "scenes" / "gl-fig12.json").read_text(encoding="utf-8"))
    settings = scene["settings"]
    factor = SIZE / settings["width"]
    settings |= {"width": SIZE, "height": round(settings["height"] * factor)}
    scene["materials"]["sphere"]["parameters"]["below"] = choice
    del scene["$schema"]
    Path(file).write_text(json.dumps(scene), encoding="utf-8")


def beside(files, out):
    """Puts pictures of one size side by side."""
    from PIL import Image

    pictures = [Image.open(f).convert("RGB") for f in files]
    width, height = pictures[0].size
    sheet = Image.new("RGB", (len(pictures) * (width + GAP) - GAP, height), "white")
    for i, picture in enumerate(pictures):
        sheet.paste(picture, (i * (width + GAP), 0))
    sheet.save(out, quality=90)


def main():
    if len(sys.argv) == 4 and sys.argv[1] == "crescents":
        crescents(*sys.argv[2:])
        return
    if len(sys.argv) != 5 or sys.argv[1] != "page":
        sys.exit(__doc__)
    tool, pictures, folder = sys.argv[2], Path(sys.argv[3]), Path(sys.argv[4]) / "gallery"
    beside((pictures / "mirror.png", pictures / "lose.png"), folder / "landmark-crescents.jpg")
    draw_coupled(folder / "landmark-coupled.png")
    found = draw_anisotropy(folder / "landmark-anisotropy.png")
    turned = draw_turned(tool, folder / "landmark-turned.png")
    views = (0, 45, 70, 80, 86)
    text = [
        "# Statements of papers, as curves",
        "",
        "`evidence/landmarks` made this page from the [Python package](../python.md) and the tool.",
        "",
        "## Shirley, Smits, Hu and Lafortune 1997: R and SPDF",
        "",
        "![R and SPDF of the coupled model, and R of its rivals](landmark-coupled.png)",
        "",
        "Left: the albedo. Towards grazing views the mirror reflects more, and the matte base",
        "correspondingly less. Middle: the distribution of the matte part, which is the same for",
        "every view, and lower than Lambert's at the rim. Right: over a lossless base, the",
        "coupled model and Shirley's of 1991 are lossless as well; constant shares add 5 % of",
        "light, and Schlick's double term nearly doubles the light at the rim. A picture of the",
        "same: [furnace](more.md#furnace).",
        "",
        "## Radziszewski and Alda 2008: anisotropy at grazing light",
        "",
        "![Spread of the lobe across over along, by view](landmark-anisotropy.png)",
        "",
        "The width of the lobe across the plane of incidence divided by its width along the",
        "plane, as root mean squares about the mirror direction. The paper says that the lobe is",
        "anisotropic at grazing angles: there it is stretched along the plane, to twice its width",
        "across. Sharper lobes are also anisotropic at middle angles, in the opposite sense, and",
        "are isotropic only at normal incidence.",
        "",
        *heading("n", *(f"{v}°" for v in views)),
        *(line(n, *(f"{found[n][v]:.2f}" for v in views)) for n in SHARPNESS),
        "",
        "## Suffern 2007: crescents at the horizon",
        "",
        "![A glossy sphere on a chequered plane, twice](landmark-crescents.jpg)",
        "",
        "Figure 25.12 and exercise 25.1: near the horizon of a glossy sphere, plane and sky",
        "appear as crescents. Left: as in the book, where a ray that would go below the surface",
        "is turned to the other side of the mirror direction. Right: without those rays",
        "(`below=lose`). The crescents remain, and the outermost rim is darker: they are caused",
        "by the part of the lobe above the surface, not by turned rays.",
        "",
        "## Suffern 2007: where turned rays go",
        "",
        f"![{RAYS} rays on the disk around r, two views, five patterns](landmark-turned.png)",
        "",
        f"Figure 25.6: {RAYS} rays of the glossy reflector with e = 1, seen along the mirror",
        "direction r (the cross), with the normal upwards, for viewers 45 and 85 degrees from the",
        "normal. Grey dots in the shaded area are below the surface; red circles are the",
        "directions to which they are turned, through r. `build/brdfc sample glossy_reflector e=1",
        "--pattern NAME --count 256 --wo X,Y,Z` draws them. Fractions of 65536 rays that are",
        "below the surface, by exponent:",
        "",
        *heading("e", *(f"{v}°" for v in SHARE_VIEWS)),
        *(line(e, *share_cells(tool, e)) for e in EXPONENTS),
        "",
        "For e = 1 the fraction is (1 - cos) / 2. According to the book it is roughly one half at",
        "grazing incidence for all exponents. That is true at 90 degrees; for sharp lobes it is",
        "true only very near 90 degrees.",
        "",
        "The book also warns that turning destroys the even distribution of a pattern. The effect",
        "depends on the pattern. The table lists, at 85 degrees, the number of rays below the",
        "surface, and the median distance of such a ray from the nearest other ray, before and",
        "after it is turned; the disk has radius 1:",
        "",
        *heading("pattern", "rays below", "before", "after"),
        *(line(p, n, f"{a:.3f}", f"{b:.3f}") for p, (n, a, b) in turned.items()),
        "",
        "Regular points occur in opposite pairs, so each turned ray is traced twice. The same is",
        "nearly true for Hammersley points, where consecutive points are half a turn apart.",
        "Towards the silhouette, these patterns therefore contain only half as much information",
        "as they cost. Turned jittered and multi-jittered rays are hardly more evenly distributed",
        "than random ones.",
    ]
    (folder / "landmarks.md").write_text("\n".join(text) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
