# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes three plots of reflection models with the Python package `brdfc` (docs/python.md).

    python3 script/plot_models.py plots.png

A furnace test: the albedo over the view angle. A lobe: f cos in the plane of incidence. A
comparison: two models with the same spread of slopes, and their difference.
"""

import sys

import matplotlib

matplotlib.use("Agg")
import brdfc
import matplotlib.pyplot as plt
import numpy as np


def slice_(theta):
    """Directions in the x-z plane, at these angles from the normal."""
    return np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=-1)


def furnace(axes):
    """Draws the albedo of white surfaces: 1 is all of the light."""
    angle = np.linspace(0, 89, 60)
    white = {
        "lossless": {"tint": 1, "n": 25},
        "ward": {"ks": 1, "ax": 0.3, "ay": 0.3},
        "cook_torrance": {"f0": 1, "m": 0.3},
        "ashikhmin_shirley": {"rs": 1, "nu": 20, "nv": 20},
        "oren_nayar": {"rho": 1, "sigma": 0.5},
    }
    for name, values in white.items():
        model = brdfc.model(name)
        albedo = model.albedo(np.cos(np.radians(angle)), **values)
        axes.plot(angle, albedo[:, 0], label=model.label)
    axes.set(xlabel="view angle, degrees", ylabel="albedo", title="White furnace", ylim=(0, 1.1))
    axes.legend(fontsize="small")


def lobes(axes, angle=50):
    """Draws the light that is reflected in each direction, for one light direction."""
    theta = np.radians(np.linspace(-90, 90, 721))
    light = slice_(np.radians(-angle))
    shown = {
        "ward": {"ks": 0.5, "ax": 0.15, "ay": 0.15},
        "phong": {"ks": 0.5, "e": 40},
        "lafortune": {"ks": 0.5},
        "lambert": {"rho": 0.5},
    }
    for name, values in shown.items():
        model = brdfc.model(name)
        f_cos = model.eval(slice_(theta), light, **values)[:, 0] * np.cos(theta)
        axes.plot(theta, f_cos / f_cos.max(), label=model.label)
    axes.set(theta_zero_location="N", theta_direction=-1, thetamin=-90, thetamax=90)
    axes.set(title=f"f cos, light from {angle} degrees, each over its peak", yticklabels=[])
    axes.legend(fontsize="small", loc="lower center", ncols=2)


def comparison(axes):
    """Compares Ward's lobe and Cook and Torrance's, with the same distribution of slopes."""
    ward, cook = brdfc.model("ward"), brdfc.model("cook_torrance")
    theta = np.radians(np.linspace(-89.5, 89.5, 1440))
    for angle, color in ((0, "C0"), (45, "C1"), (75, "C2")):
        wo = slice_(np.radians(-angle))
        a = ward.eval(slice_(theta), wo, ks=1, ax=0.2, ay=0.2)[:, 0] * np.cos(theta)
        b = cook.eval(slice_(theta), wo, f0=1, m=0.2)[:, 0] * np.cos(theta)
        apart = np.abs(a - b).sum() / b.sum()
        axes.plot(np.degrees(theta), a, color)
        axes.plot(np.degrees(theta), b, color + "--", label=f"{angle} degrees: {apart:.0%} apart")
    axes.set(
        xlabel="light angle, degrees", ylabel="f cos", title="Ward (line), Cook-Torrance (dashes)"
    )
    axes.legend(fontsize="small")


def main(path):
    figure = plt.figure(figsize=(15, 4.5), layout="constrained")
    furnace(figure.add_subplot(1, 3, 1))
    lobes(figure.add_subplot(1, 3, 2, projection="polar"))
    comparison(figure.add_subplot(1, 3, 3))
    figure.savefig(path, dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main(sys.argv[1])
