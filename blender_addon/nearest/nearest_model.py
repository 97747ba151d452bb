# SPDX-License-Identifier: GPL-3.0-or-later
"""Which models may stand for a node of Blender's, and how near each comes. No bpy in here.

The width of a candidate is sought so that it misplaces least of the light of a point; how near it
comes is told of lamps that are as wide as a window, under which a lobe's own shape shows as little
as in most pictures. The formulas of the models come as NumPy with the extension.
"""

import functools
import itertools
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
#: Candidates are looked at closely whose error at a rough width is at most this times that of the
#: nearest.
_AS_NEAR = 1.1
#: One of how many directions is enough to tell widths apart that are far from each other.
_FEW = 8
#: Looks by parabolas at most, and how near to one before another tells nothing new of a width, as
#: a logarithm.
_PARABOLAS, _NO_NEWS = 4, 0.02
#: Of the narrowest lobe that directions are drawn for, as Cycles' alpha.
_NARROWEST = 5e-4


@dataclass(frozen=True)
class Width:
    """The parameter that says how wide a lobe is: in proportion to roughness^power."""

    name: str
    low: float
    high: float
    power: float
    #: About what it is over that power for most nodes.
    usual: float = 1.0
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
_EXPONENT = {"low": 1.0, "high": 1e6, "power": -4, "usual": 2.0}
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
        #: Where the rows of each view begin, and where those of the last end.
        self.starts = np.searchsorted(self.which, range(len(self.each) + 1))

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
            near = directions.astype(np.float32) @ lamps.T.astype(np.float32)
            near -= 1
            near /= np.float32(LAMP**2)
            # Less is next to nothing, and much slower.
            np.exp(np.maximum(near, np.float32(-30), out=near), out=near)
            near /= near.sum(1, keepdims=True)
            parts.append(near)
        return parts

    def light_of_lamps(self, f_cos, mirror):
        """The same with a mirror's part (k, 3), by view and lamp, (k, LAMPS, 3)."""
        of_lobe, of_mirror = self._from_lamps
        weighed = (f_cos * self.weight[:, None]).astype(np.float32)
        views = [slice(*ends) for ends in itertools.pairwise(self.starts)]
        # Not by BLAS, whose threads wait for one another where others compute as well.
        lobes = np.stack([np.einsum("nl,nc->cl", of_lobe[v], weighed[v]) for v in views])
        return lobes.swapaxes(1, 2) + of_mirror[:, :, None] * mirror[:, None]


@functools.lru_cache(maxsize=8)
def _directions(roughness, stretch):
    """What several nodes may share, of some four megabytes."""
    return Directions(native_bsdf.Native("glossy", (1.0, 1.0, 1.0), roughness, stretch))


class Target:
    """A node's light at its Directions."""

    def __init__(self, native):
        self.native, self.at = native, _directions(native.roughness, native.stretch)
        self.f_cos = native_bsdf.f_cos(
            native, self.at.wi, self.at.wo, (self.at.each, self.at.which)
        )
        self.mirror = native_bsdf.mirror(native, self.at.each)
        self.total = self.at.light(self.f_cos) + self.mirror

    def _differences(self, model, values):
        """Of the model from the node: f cos, and the mirror's part."""
        from ..brdfc import model as formulas

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

    def roughly_misplaced(self, model, values):
        """The same of few of the directions, in arbitrary units: enough to tell widths apart that
        are far from each other."""
        from ..brdfc import model as formulas

        at, few = self.at, slice(None, None, _FEW)
        f = formulas(model).eval(at.wi[few], at.wo[few], **values) * at.wi[few, 2:]
        return float((np.abs(f - self.f_cos[few]).sum(1) * at.weight[few]).sum())

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


@dataclass(frozen=True)
class Fit:
    """The candidate that is nearest to nodes, and the factor of its width."""

    candidate: Candidate
    factor: float
    #: (light, error) of the nodes at each colour that was asked for.
    found: tuple
    #: Whether a link to the node's colour would be lost.
    lost: bool


@functools.lru_cache(maxsize=256)
def nearest(natives, colors, colored, has):
    """The Fit to nodes that differ in roughness alone, a tuple, among the models and values that
    has(model, values) is true of; with its error at nodes of other colours. `colored`: whether
    something is linked to the colour, which a model without a parameter for it would lose. None
    where no model is near."""
    native, targets, found = natives[0], [Target(n) for n in natives], []
    # With another base the width of a model is about the same: it is sought once.
    roughly, closely = {}, {}
    for candidate in candidates(native):
        if not has(candidate.model, candidate.values(native)):
            continue
        if native.stretch != 1 and not (candidate.width and candidate.width.across):
            continue
        lost = colored and "Color" not in candidate.links.values()
        key = candidate.model, candidate.width
        if key not in roughly:
            roughly[key] = _rough_width(candidate, targets)
        between = roughly[key]
        error = _mean(Target.error, candidate, targets, math.exp(between[1]))
        found.append((lost, error, between, candidate))
    if not found:
        return None
    best, fits = min(f[:2] for f in found), []
    for lost, error, between, candidate in found:
        if lost == best[0] and error <= _AS_NEAR * best[1]:
            key = candidate.model, candidate.width
            if key not in closely:
                closely[key] = _factor(candidate, targets, between)
            error = _mean(Target.error, candidate, targets, closely[key])
            fits.append((error, closely[key], candidate))
    error, factor, candidate = min(fits, key=lambda f: f[0])
    known = {native.color: (_light(targets), error)}
    errors = tuple(known.get(c) or _light_and_error(candidate, targets, factor, c) for c in colors)
    return Fit(candidate, factor, errors, best[0])


def _light(targets):
    """The light of nodes, mean over them."""
    return float(np.mean([t.total.mean() for t in targets]))


def _light_and_error(candidate, targets, factor, color):
    """The light of nodes of another colour than these, and a candidate's error with the factor of
    its width, mean over the nodes."""
    targets = [Target(replace(t.native, color=color)) for t in targets]
    return _light(targets), _mean(Target.error, candidate, targets, factor)


def _mean(measure, candidate, targets, factor):
    """Of a Target's method, over nodes that differ in roughness."""
    values = [with_width(candidate, t.native, factor) for t in targets]
    found = [measure(t, candidate.model, v) for t, v in zip(targets, values, strict=True)]
    return sum(found) / len(found)


def _rough_width(candidate, targets):
    """Three logarithms of the factor of a candidate's width: about where it misplaces least, and
    one on each side; of one without a width thrice 0."""
    width = candidate.width
    if width is None:
        return 0.0, 0.0, 0.0

    def off(x):
        return _mean(Target.roughly_misplaced, candidate, targets, math.exp(x))

    r = np.array([max(t.native.roughness, 1e-3) for t in targets])
    ends = np.log([width.low, width.high])[:, None] - width.power * np.log(r)[None]
    grid, step = np.linspace(ends.min(), ends.max(), 16, retstep=True)
    usual = math.log(width.usual)
    below, best, above = (off(x) for x in (usual - step, usual, usual + step))
    # Where it is not about what it mostly is, all there are.
    best = usual if below > best < above else min(grid, key=off)
    low, high = max(best - step, grid[0]), min(best + step, grid[-1])
    best = _lowest(off, low, best, high)
    return max(best - step / 3, grid[0]), best, min(best + step / 3, grid[-1])


def _factor(candidate, targets, between):
    """The factor of the width that misplaces the least."""
    if candidate.width is None:
        return 1.0
    return math.exp(
        _lowest(lambda x: _mean(Target.misplaced, candidate, targets, math.exp(x)), *between)
    )


def _lowest(off, low, best, high):
    """Where a function is least between two ends, by parabolas through three points."""
    points = {x: off(x) for x in {low, best, high}}
    for _ in range(_PARABOLAS):
        middle = min(points, key=points.get)
        below, above = ([x for x in points if x < middle], [x for x in points if x > middle])
        if not below or not above:
            # At an end: the function may be least beside it.
            other = min(above) if above else max(below)
            x = (middle + other) / 2
        else:
            x = _vertex(points, max(below), middle, min(above))
        if min(abs(x - y) for y in points) < _NO_NEWS:
            break
        points[x] = off(x)
    return min(points, key=points.get)


def _vertex(points, a, b, c):
    """Of the parabola through three points, of which the middle one, b, is the lowest; held away
    from them, so that each look tells something."""
    left, right = (b - a) * (points[b] - points[c]), (b - c) * (points[b] - points[a])
    x = b - 0.5 * ((b - a) * left - (b - c) * right) / min(left - right, -1e-30)
    wide, far = ((a, b), (b, c)), 0.1
    low, high = max(wide, key=lambda ends: ends[1] - ends[0])
    if abs(x - b) < far * min(b - a, c - b):
        return low + 0.25 * (high - low) if low == b else high - 0.25 * (high - low)
    return min(max(x, a + far * (b - a)), c - far * (c - b))
