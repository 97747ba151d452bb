# SPDX-License-Identifier: GPL-3.0-or-later
"""Which models may stand for a node of Blender's, and how near each comes. No bpy in here.

The width of a candidate is sought so that it misplaces least of the light of a point; how near it
comes is told of lamps that are as wide as a window, under which a lobe's own shape shows as little
as in most pictures. The formulas of the models come as NumPy with the extension.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from . import native_bsdf

#: Views at which models are compared, as cosines, and directions of light for each.
VIEWS = (0.95, 0.75, 0.5, 0.25)
DIRECTIONS = 256
#: Standard deviation of the light of such a lamp, in radians, and how many there are about.
LAMP, LAMPS = 0.1, 512
#: Of the narrowest lobe that directions are drawn for, as Cycles' alpha.
_NARROWEST = 5e-4


@dataclass(frozen=True)
class Width:
    """The parameter that says how wide a lobe is: in proportion to roughness^power."""

    name: str
    low: float
    high: float
    power: float
    #: Parameters of the same meaning across the tangent, and what stretch does to both.
    across: str = ""
    stretched: float = 0.0


@dataclass(frozen=True)
class Candidate:
    model: str
    #: From the node's values: parameters, as pack.check_value takes them.
    values: Callable
    width: Width | None = None
    #: Which of the node's sockets is which parameter.
    links: dict = field(default_factory=dict)


def _grey(color):
    return sum(color) / 3


def _mixed(native):
    """Reflectance along the normal."""
    m = native.metallic
    return tuple((1 - m) * native.f0 + m * c for c in native.color)


def _base(native):
    """Of the node's base, whose highlight leaves 1 - f0 to it, for a model that leaves less."""
    share = (1 - native.metallic) * (1 - native.f0)
    mixed = zip(native.color, _mixed(native), strict=True)
    return tuple(min(share * c / max(1 - m, 1e-6), 1.0) for c, m in mixed)


_SLOPE = {"low": 1e-3, "high": 1.0, "power": 2}
_EXPONENT = {"low": 1.0, "high": 1e6, "power": -4}
_COLORED = (
    Candidate(
        "cook_torrance",
        lambda n: {"f0": n.color},
        Width("m", **(_SLOPE | {"low": 1e-4})),
        {"f0": "Color"},
    ),
    Candidate(
        "ward",
        lambda n: {"ks": n.color},
        Width("ax", **_SLOPE, across="ay", stretched=0.5),
        {"ks": "Color"},
    ),
    Candidate("blinn", lambda n: {"ks": n.color}, Width("e", **_EXPONENT), {"ks": "Color"}),
    Candidate("max_phong", lambda n: {"ks": n.color}, Width("e", **_EXPONENT), {"ks": "Color"}),
    Candidate(
        "modified_phong", lambda n: {"ks": n.color}, Width("e", **_EXPONENT), {"ks": "Color"}
    ),
)
_MATTE = (
    Candidate("lambert", lambda n: {"rho": n.color}, None, {"rho": "Color"}),
    *(
        Candidate(
            "oren_nayar",
            lambda n, form=form: {"rho": n.color, "form": form},
            Width("sigma", 1e-3, 0.66, 1),
            {"rho": "Color"},
        )
        for form in ("full", "qualitative")
    ),
)
#: An exponent at which a lobe shows what a mirror does.
_SHARP = 1e7
_MIRRORS = (
    Candidate("lambertian_specular", lambda n: {"rd": 0.0, "rs": _grey(n.color)}),
    Candidate("max_phong", lambda n: {"ks": n.color, "e": _SHARP}, links={"ks": "Color"}),
)
_METAL_MIRROR = Candidate("schlick", lambda n: {"r": n.color, "rough": 0.0}, links={"r": "Color"})
_COATED = Candidate("coupled", lambda n: {"r0": n.f0, "rm": n.color}, None, {"rm": "Color"})


def _polished(links, sharp=False):
    """A highlight over a base that gives way to it."""
    width = None if sharp else Width("nu", **_EXPONENT, across="nv", stretched=-1.0)
    narrow = {"nu": _SHARP, "nv": _SHARP} if sharp else {}
    return tuple(
        Candidate(
            "ashikhmin_shirley",
            lambda n, diffuse=diffuse: {
                "rs": _mixed(n),
                "rd": _base(n),
                "diffuse": diffuse,
                **narrow,
            },
            width,
            links,
        )
        for diffuse in ("paper", "tabulated")
    )


def candidates(native):
    """What may stand for a node. A model without a highlight is none for a node that has one,
    however little of the light that is."""
    if native.kind == "diffuse" or (native.kind == "principled" and _mixed(native) == (0, 0, 0)):
        return _MATTE
    if native.is_mirror and native.kind == "glossy":
        return (*_MIRRORS, _METAL_MIRROR)
    if native.is_mirror and native.metallic == 0:
        return (_COATED,)
    if native.is_mirror:
        return (_METAL_MIRROR,) if native.metallic == 1 else _polished({}, sharp=True)
    if native.kind == "glossy":
        return _COLORED
    if native.metallic == 1:
        return (*_COLORED, *_polished({"rs": "Color"}))
    return _polished({"rd": "Color"} if native.metallic == 0 else {})


# ---- how near ------------------------------------------------------------------------------------


class Directions:
    """Views and directions of light that see a node's lobe, with weights of an integral over wi."""

    def __init__(self, native):
        azimuths = (0.3,) if native.stretch == 1 else (0.2, 1.3)
        self.each = np.array(
            [
                (math.sqrt(1 - c * c) * math.cos(a), math.sqrt(1 - c * c) * math.sin(a), c)
                for c in VIEWS
                for a in azimuths
            ]
        )
        i = np.arange(DIRECTIONS)
        u = (0.5 + np.outer(i, (0.8191725134, 0.6710436067))) % 1
        r, phi = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
        flat = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - u[:, 0])], -1)
        alpha = tuple(max(a, _NARROWEST) for a in native.alpha)
        h = native_bsdf.draw_facets(u, alpha)
        wi, wo, weight, which = [], [], [], []
        for k, w in enumerate(self.each):
            drawn = 2 * (h @ w)[:, None] * h - w
            # A sample below the surface stands for none: it must not count as one either.
            both = np.concatenate([flat, drawn])
            up = both[:, 2] > 1e-4
            both = both[up]
            here = np.broadcast_to(w, both.shape)
            half = native_bsdf.half(both, here)
            of_lobe = native_bsdf.distribution(half, alpha, False) * half[:, 2]
            of_lobe /= 4 * np.maximum((half * here).sum(-1), 1e-6)
            density = (both[:, 2] / np.pi + of_lobe) / 2
            wi.append(both)
            wo.append(here)
            weight.append(1 / (density * 2 * DIRECTIONS))
            which.append(np.full(len(both), k))
        self.wi, self.wo = np.concatenate(wi), np.concatenate(wo)
        self.weight, self.which = np.concatenate(weight), np.concatenate(which)

    def light(self, f_cos):
        """Integral over the directions of light by view, (k, 3)."""
        weighed = f_cos * self.weight[:, None]
        return np.stack([np.bincount(self.which, weighed[:, c]) for c in range(3)], -1)

    @functools.cached_property
    def _from_lamps(self):
        """What part of the light of each direction, and of each view's mirror, is of which lamp:
        (n, LAMPS) and (k, LAMPS)."""
        i = np.arange(LAMPS) + 0.5
        z, phi = i / LAMPS, i * math.pi * (1 + math.sqrt(5))
        r = np.sqrt(1 - z * z)
        lamps = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)
        mirrored = self.each * (-1, -1, 1)
        parts = []
        for directions in (self.wi, mirrored):
            near = np.exp((directions @ lamps.T - 1) / LAMP**2)
            parts.append(near / near.sum(1, keepdims=True))
        return parts

    def light_of_lamps(self, f_cos, mirror):
        """The same with a mirror's part (k, 3), by view and lamp, (k, LAMPS, 3)."""
        of_lobe, of_mirror = self._from_lamps
        weighed = f_cos * self.weight[:, None]
        views = [self.which == k for k in range(len(self.each))]
        lobes = np.stack([of_lobe[here].T @ weighed[here] for here in views])
        return lobes + of_mirror[:, :, None] * mirror[:, None]


class Target:
    """A node's light at these directions."""

    def __init__(self, native):
        self.native, self.at = native, Directions(native)
        self.f_cos = native_bsdf.f_cos(
            native, self.at.wi, self.at.wo, (self.at.each, self.at.which)
        )
        self.mirror = native_bsdf.mirror(native, self.at.each)
        self.total = self.at.light(self.f_cos) + self.mirror

    def _differences(self, model, values):
        """Of the model from the node: f cos, and the mirror's part."""
        from .brdfc import model as formulas

        formula, at = formulas(model), self.at
        f = formula.eval(at.wi, at.wo, **values) * at.wi[:, 2:]
        return f - self.f_cos, formula.mirror(at.each, **values) - self.mirror

    def _mean(self, off):
        return float((off.sum(1) / np.maximum(self.total.sum(1), 1e-9)).mean())

    def misplaced(self, model, values):
        """Part of the light of points that the model sends elsewhere, mean over views and
        channels."""
        f_cos, mirror = self._differences(model, values)
        return self._mean(self.at.light(np.abs(f_cos)) + np.abs(mirror))

    def error(self, model, values):
        """The same of lamps as wide as windows, all around: what a picture of these shows."""
        return self._mean(np.abs(self.at.light_of_lamps(*self._differences(model, values))).sum(1))


def with_width(candidate, native, factor):
    """Values of a candidate whose width is `factor` times the power of the roughness. No model's
    colour is above 1."""
    held = replace(native, color=tuple(min(c, 1.0) for c in native.color))
    values, width = dict(candidate.values(held)), candidate.width
    if width is None:
        return values
    size = factor * max(native.roughness, 1e-3) ** width.power
    stretch = native.stretch**width.stretched if width.across else 1.0
    for name, share in ((width.name, stretch), (width.across, 1 / stretch)):
        if name:
            values[name] = float(min(max(size * share, width.low), width.high))
    return values


def nearest_factor(candidate, targets):
    """The factor of the width that misplaces the least, mean over the targets, and the mean error
    with it."""

    def mean(measure, factor):
        values = [with_width(candidate, t.native, factor) for t in targets]
        found = [measure(t, candidate.model, v) for t, v in zip(targets, values, strict=True)]
        return sum(found) / len(found)

    if candidate.width is None:
        return 1.0, mean(Target.error, 1.0)

    def off(factor):
        return mean(Target.misplaced, factor)

    width, r = candidate.width, np.array([max(t.native.roughness, 1e-3) for t in targets])
    ends = np.log([width.low, width.high])[:, None] - width.power * np.log(r)[None]
    low, high = ends.min(), ends.max()
    grid = np.linspace(low, high, 16)
    best = int(np.argmin([off(math.exp(x)) for x in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    golden = (math.sqrt(5) - 1) / 2
    for _ in range(10):
        a, b = high - golden * (high - low), low + golden * (high - low)
        low, high = (low, b) if off(math.exp(a)) < off(math.exp(b)) else (a, high)
    factor = math.exp((low + high) / 2)
    factor = min((factor, math.exp(grid[best])), key=off)
    return factor, mean(Target.error, factor)
