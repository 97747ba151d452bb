# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured files for script/demo --measured, made of sums that no single model of brdfc follows.
The Python package of `brdfc python` must be importable."""

import numpy as np
from measured_formats import above, direction, merl, merl_directions, tensor
from published_materials import smooth_surface


def f_of(models, wi, wo):
    """The sum of f of models; `models` has rows (name, parameters)."""
    import brdfc

    return sum(np.asarray(brdfc.model(name).eval(wi, wo, **values)) for name, values in models)


def car_paint():
    """MERL's format, with noise of 2 % in each number."""
    models = [
        ("lambert", {"rho": (0.015, 0.03, 0.12)}),
        ("microfacet", {"f0": (0.05, 0.16, 0.42), "tint": (0.3,) * 3, "ax": 0.38, "ay": 0.38}),
        ("microfacet", {"f0": (0.06, 0.06, 0.06), "ax": 0.07, "ay": 0.07}),
    ]
    wi, wo = merl_directions()
    f = f_of(models, wi, wo)
    return merl(f * np.random.default_rng(1).normal(1, 0.02, f.shape))


def gold_paint():
    """MERL's format: gold-metallic-paint of its database, by the parameters that Low and others
    published."""
    wi, wo = merl_directions()
    matte = np.array([0.0094, 0.0024, 0]) / np.pi
    gloss = np.array([5.34906, 3.69027, 1.31988])
    f = matte + smooth_surface(wi, wo, A=gloss, B=9.81648, C=1.545613, eta=1.91911)
    return merl(np.where(above(wi, wo), f, -1))


def brushed_copper():
    """RGL's format, anisotropic: half of the azimuths, as files of that database have."""
    models = [
        ("microfacet", {"f0": (0.6, 0.36, 0.25), "ax": 0.07, "ay": 0.32}),
        ("microfacet", {"f0": (0.35, 0.2, 0.13), "tint": (0.3,) * 3, "ax": 0.3, "ay": 0.6}),
    ]
    thetas, phis = np.radians(np.linspace(0, 86, 15)), np.linspace(-np.pi, 0, 17)
    view = direction(thetas, phis[:, None])
    # The coordinates of half vectors are sqrt(2 theta / pi) and the azimuth from -pi.
    height, width = 64, 48
    theta = np.linspace(0, 1, width) ** 2 * np.pi / 2
    phi = np.linspace(-np.pi, np.pi, height)
    half = direction(np.clip(theta, 1e-4, np.pi / 2 - 1e-4), phi[:, None])
    # With constant `vndf` and `sigma`, a value is 4 f cos / ndf at the half vector itself. `ndf` is
    # like the highlight, so the quotient is smooth and can be interpolated.
    ndf = f_of(models, half, half).mean(-1) * half[..., 2] ** 2 + 1e-6
    view, half = np.broadcast_arrays(view[:, :, None, None], half)
    light = 2 * (view * half).sum(-1, keepdims=True) * half - view
    above = light[..., 2:] > 1e-3
    light = np.where(above, light, (0, 0, 1))
    value = np.where(above, f_of(models, light, view) * light[..., 2:], 0) * 4 / ndf[..., None]
    ones = np.ones((2, 2), np.float32)
    fields = {
        "description": np.frombuffer(b"Made of two lobes", np.uint8),
        "jacobian": np.array([1], np.uint8),
        "phi_i": phis,
        "theta_i": thetas,
        "ndf": ndf,
        "sigma": ones,
        "vndf": np.broadcast_to(ones, (len(phis), len(thetas), 2, 2)),
        "rgb": np.moveaxis(value, -1, 2),
    }
    return tensor({k: a if a.dtype == np.uint8 else a.astype("f4") for k, a in fields.items()})


def road_marking():
    """A table: paint that sends a part of the light back to the lamp."""
    models = [
        ("lambert", {"rho": (0.3, 0.25, 0.08)}),
        ("lafortune", {"cxy": 1, "cz": 0.9, "e": 12, "ks": (0.3, 0.25, 0.1)}),
        ("cook_torrance", {"m": 0.2, "f0": (0.05, 0.05, 0.05)}),
    ]
    theta, phi = np.arange(0, 90, 3), np.arange(0, 181, 3)
    grid = np.stack(np.meshgrid(theta, [0], theta, phi, indexing="ij"), -1).reshape(-1, 4)
    radians = np.radians(grid)
    f = f_of(models, direction(*radians[:, :2].T), direction(*radians[:, 2:].T))
    rows = "".join(
        ",".join(f"{x:.7g}" for x in row) + "\n" for row in np.concatenate([grid, f], 1).tolist()
    )
    return ("theta_i,phi_i,theta_o,phi_o,r,g,b\n" + rows).encode()


#: The made files: what they are for the page, and what makes them.
MADE = {
    "car-paint.binary": (
        "Blue paint with flakes under a clear coat, in MERL's format, with noise of 2 %",
        car_paint,
    ),
    "gold-paint.binary": (
        "Gold paint of MERL's database, as Low and others describe it",
        gold_paint,
    ),
    "brushed-copper.bsdf": (
        "Brushed copper with a wide glow, anisotropic, in RGL's format",
        brushed_copper,
    ),
    "road-marking.csv": ("Paint that sends light back to the lamp, as a table", road_marking),
}


def make_files(out):
    for name, (_, make) in MADE.items():
        file = out / "files" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        data = make()
        if not file.is_file() or file.read_bytes() != data:
            file.write_bytes(data)
        yield file
