# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions by which others described the 100 materials of MERL's database. They are functions of
wi, wo (N, 3), with values f (N, 3) in 1/sr."""

import ast
import math
from pathlib import Path

import numpy as np


def published(file):
    """Names and functions of a file of lines NAME = Aggregate(MODEL(P = V, ...), ...)."""
    for line in Path(file).read_text().splitlines():
        if not line or line.startswith("#"):
            continue
        name, text = line.split(" = ", 1)
        parts = [
            (
                PUBLISHED[part.func.id],
                {p.arg: np.array(ast.literal_eval(p.value)) for p in part.keywords},
            )
            for part in ast.parse(text, mode="eval").body.args
        ]
        yield name, lambda wi, wo, parts=parts: sum(f(wi, wo, **values) for f, values in parts)


def lambertian(wi, wo, albedo):
    return albedo / math.pi


def shifted_gamma(wi, wo, albedo, alpha, p, eta, K, Lambda, c, k, theta0):
    """M. M. Bagher, C. Soler, N. Holzschuch: Accurate Fitting of Measured Reflectances Using a
    Shifted Gamma Micro-facet Distribution, Computer Graphics Forum 31(4), 2012."""
    h = (wi + wo) / np.linalg.norm(wi + wo, axis=-1, keepdims=True)
    x = alpha + (1 / h[:, 2:] ** 2 - 1) / alpha
    distribution = K * np.exp(-x) / (x**p * math.pi * h[:, 2:] ** 4)
    cos_d = (wi * h).sum(-1, keepdims=True)
    fresnel = eta[0] - eta[1] * cos_d + (1 - eta[0]) * (1 - cos_d) ** 5

    def seen(w):
        beyond = np.maximum(np.arccos(np.minimum(w[:, 2:], 1)) - theta0, 0)
        return 1 + Lambda * (1 - np.exp(c * beyond**k))

    heights = wi[:, 2:] * wo[:, 2:]
    return albedo / math.pi * fresnel * distribution * seen(wi) * seen(wo) / heights


def smooth_surface(wi, wo, A, B, C, eta):
    """J. Low, J. Kronander, A. Ynnerman, J. Unger: BRDF Models for Accurate and Efficient Rendering
    of Glossy Surfaces, ACM TOG 31(1), 2012, equations 10 to 14."""
    d2 = ((wi + wo)[:, :2] ** 2).sum(-1, keepdims=True)
    cos_d = np.sqrt(np.maximum(1 - ((wi - wo)[:, :2] ** 2).sum(-1, keepdims=True) / 4, 0))
    g = np.sqrt(eta**2 + cos_d**2 - 1)
    other = (cos_d * (g + cos_d) - 1) / (cos_d * (g - cos_d) + 1)
    fresnel = ((g - cos_d) / (g + cos_d)) ** 2 / 2 * (1 + other**2)
    return A * (1 + B * d2) ** -C * fresnel


#: The functions of models by the names that files of parameters use.
PUBLISHED = {"Lambertian": lambertian, "Bagher": shifted_gamma, "LowSmooth": smooth_surface}
