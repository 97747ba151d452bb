# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the model nearest to one of Blender's nodes, and its error. Independent of bpy.

The width of a candidate's lobe is chosen to misplace the least light of a point lamp. Its error is
then measured under lamps as wide as a window (misplaced_light.py).
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from . import layer, native_bsdf
from .misplaced_light import NARROWEST, Target

#: A candidate is examined closely if its error at a roughly fitted width is at most this times the
#: smallest one.
_CANDIDATE_MARGIN = 1.1
#: A candidate with the node's own formulas is taken without a look at the others if its error is at
#: most this: as it stands, and as a layer over a base. Of a thousand random nodes none had another
#: candidate nearer by more than 0.002 then.
_OWN_ERROR, _OWN_LAYER_ERROR = 0.001, 0.02
#: Limit of parabola steps, and the distance of log widths below which another step is of no use.
_PARABOLAS, _LOG_WIDTH_TOLERANCE = 4, 0.02


@dataclass(frozen=True)
class Width:
    """The parameter that sets the width of a lobe, in proportion to roughness^power."""

    name: str
    low: float
    high: float
    power: float
    #: Typical factor of roughness^power.
    usual: float = 1.0
    #: The parameter for the width across the tangent, and the effect of stretch on both.
    across: str = ""
    stretched: float = 0.0


@dataclass(frozen=True)
class Candidate:
    model: str
    #: Computes the parameters, in the form of pack.check_value, from the node's values.
    values: Callable
    width: Width | None = None
    #: The parameter that each of the node's sockets corresponds to.
    links: dict = field(default_factory=dict)
    #: The Fit of the matte base beneath this glossy layer, which has the light that the layer's
    #: albedo leaves.
    base: "Fit | None" = None
    #: Whether it reflects the same at all angles: its values are for the node's colour divided by
    #: scale_of(), by which a Mix Shader multiplies its light.
    is_flat: bool = False
    #: Whether its lobe is the node's own, with the usual width.
    is_own: bool = False

    @property
    def is_colored(self):
        """Whether it has a parameter for the node's colour."""
        below = self.base.candidate.links if self.base else {}
        return "Color" in (*self.links.values(), *below.values())


@dataclass(frozen=True)
class Base:
    """A matte base with its values, and the light that it gets: coefficients of layer.rest()."""

    model: str
    values: dict
    rest: tuple


def base_of(candidate, native, follows=False):
    """The Base of a candidate for a node; None if it has none. `follows`: whether the polynomial is
    one for all roughnesses."""
    if candidate.base is None:
        return None
    fit = candidate.base
    values = with_width(fit.candidate, matte_of(native), fit.factor)
    roughness = None if follows else native.roughness
    rest = layer.rest(native.f0, max(native.tint), native.multiscatter, roughness)
    return Base(fit.candidate.model, values, rest)


def matte_of(native):
    """The base of a Principled node."""
    return native_bsdf.Native("diffuse", native.color, native.diffuse_roughness)


def _grey(color):
    return sum(color) / 3


def _mixed(native):
    """Reflectance at normal incidence of the mix of dielectric and metal."""
    m = native.metallic
    both = zip(native.color, native.tint, strict=True)
    return tuple((1 - m) * min(native.f0 * t, 1.0) + m * c for c, t in both)


def _base(native):
    """Colour of the node's base. Its interface leaves 1 - f0 of the light to it; this corrects for
    a model that leaves less."""
    share = (1 - native.metallic) * (1 - native.f0)
    mixed = zip(native.color, _mixed(native), strict=True)
    return tuple(min(share * c / max(1 - m, 1e-6), 1.0) for c, m in mixed)


def _edge_tint(native):
    """The tint of a metal, which Cycles clamps."""
    return tuple(min(t, 1.0) for t in native.tint)


def scale_of(candidate, native):
    """The factor by which the light of a candidate for a node is multiplied."""
    return min(max(*native.color, 1e-6), 1.0) if candidate.is_flat else 1.0


def _flat(native):
    """Values of `microfacet` by which it reflects the same at normal incidence and at 82 degrees,
    and nearly the same between and beyond. Bright colours do so better: the brightest channel is 1.
    """
    brightest = scale_of(_FLAT, native)
    color = tuple(min(c / brightest, 1.0) for c in native.color)
    return {"f0": color, "tint": native_bsdf.flat_tint(color), **_distribution(native)}


def _distribution(native):
    """The distribution of `microfacet` that is the node's own."""
    if native.beckmann:
        return {"distribution": "beckmann"}
    if not native.multiscatter:
        return {}
    return {"distribution": "multiscatter_ggx", "again": native_bsdf.again(native)}


_SLOPE = {"low": 1e-3, "high": 1.0, "power": 2}
_EXPONENT = {"low": 1.0, "high": 1e6, "power": -4, "usual": 2.0}
_FACETS = Width("ax", 1e-4, 1.0, 2, across="ay", stretched=0.5)
_COLORED = (
    Candidate(
        "cook_torrance",
        lambda n: {"f0": n.color},
        Width("m", **(_SLOPE | {"low": 1e-4})),
        {"f0": "Color"},
    ),
    Candidate(
        "microfacet",
        lambda n: {"f0": n.color, "tint": _edge_tint(n), **_distribution(n)},
        _FACETS,
        {"f0": "Color"},
        is_own=True,
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
#: For a Glossy node, which reflects the same at every angle.
_FLAT = Candidate("microfacet", _flat, _FACETS, {"f0": "Color"}, is_flat=True, is_own=True)
_MATTE = (
    Candidate("lambert", lambda n: {"rho": n.color}, None, {"rho": "Color"}, is_own=True),
    Candidate("eon", lambda n: {"rho": n.color}, Width("r", 1e-3, 1.0, 1), {"rho": "Color"}),
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
#: An exponent whose lobe is as narrow as a mirror reflection.
_SHARP = 1e7
_MIRRORS = (
    Candidate("lambertian_specular", lambda n: {"rd": 0.0, "rs": _grey(n.color)}),
    Candidate("max_phong", lambda n: {"ks": n.color, "e": _SHARP}, links={"ks": "Color"}),
)
_METAL_MIRROR = Candidate("schlick", lambda n: {"r": n.color, "rough": 0.0}, links={"r": "Color"})
#: Facets as steep as the narrowest lobe by which directions are sampled.
_TINTED_MIRROR = Candidate(
    "microfacet",
    lambda n: {"f0": n.color, "tint": _edge_tint(n), "ax": NARROWEST, "ay": NARROWEST},
    links={"f0": "Color"},
)
#: Reflectance at normal incidence.
_MOST_SCHLICK = 0.15
_COATED = Candidate("coupled", lambda n: {"r0": n.f0, "rm": n.color}, None, {"rm": "Color"})


def _polished(links, sharp=False):
    """A highlight over a base that receives only the light that the highlight leaves."""
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


def mattes_of(natives):
    """The distinct bases of Principled nodes."""
    return tuple(dict.fromkeys(map(matte_of, natives)))


def _layered(natives, has):
    """A glossy layer of microfacets over the nearest matte base. `natives`: nodes that differ only
    in roughnesses and stretch."""
    native, base = natives[0], nearest(mattes_of(natives), (), False, has)
    if base is None:
        return ()
    f0, tint = zip(*(layer.schlick_like(native.f0, t) for t in native.tint), strict=True)
    values = {"f0": f0, "tint": tint}

    def layer_of(n):
        return values | _distribution(n)

    if native.is_mirror:
        sharp = values | {"ax": NARROWEST, "ay": NARROWEST}
        return (Candidate("microfacet", lambda n: sharp, base=base),)
    return (Candidate("microfacet", layer_of, _FACETS, base=base, is_own=True),)


def candidates(native, has=lambda model, values: True, natives=(), layered=False):
    """The candidates for a node, or for `natives` of which it is the first, among the models and
    values for which has(model, values) is true. A model without a highlight is no candidate for a
    node that has one, however weak. `layered`: a highlight of a dielectric has to have its base as
    another model."""
    found = _candidates(native, has, natives or (native,), layered)
    return tuple(c for c in found if has(c.model, c.values(native)))


def _candidates(native, has, natives, layered):
    if native.is_matte:
        return _MATTE
    if layered and native.metallic == 0:
        return _layered(natives, has)
    if native.is_mirror and native.kind == "glossy":
        return (*_MIRRORS, _METAL_MIRROR)
    if native.is_mirror and native.metallic == 0:
        tinted = native.tint != (1, 1, 1)
        # Above this the Fresnel term is far from Schlick's, which the ideal mirrors have.
        layers = _layered(natives, has) if tinted or native.f0 > _MOST_SCHLICK else ()
        return (_COATED, *(_polished({"rd": "Color"}, sharp=True) if tinted else ()), *layers)
    if native.is_mirror:
        if native.tint != (1, 1, 1):
            return (_METAL_MIRROR, _TINTED_MIRROR)
        return (_METAL_MIRROR,) if native.metallic == 1 else _polished({}, sharp=True)
    if native.kind == "glossy":
        return (*_COLORED, _FLAT)
    if native.metallic == 1:
        return (*_COLORED, *_polished({"rs": "Color"}))
    if native.metallic == 0:
        return (*_polished({"rd": "Color"}), *_layered(natives, has))
    return _polished({})


def with_width(candidate, native, factor):
    """Values of a candidate whose width is `factor` times the power of the roughness. Colours are
    clamped to 1, as models require."""
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
    """The candidate nearest to some nodes, and the factor of its width."""

    candidate: Candidate
    factor: float
    #: For each of the requested node colours, (light, error) of each of the nodes and of `also`.
    found: tuple
    #: Whether the conversion would lose a link to the node's colour.
    lost: bool


@functools.lru_cache(maxsize=256)
def nearest(natives, colors, colored, has, also=(), layered=False):
    """The Fit to a tuple of nodes that differ only in roughnesses and stretch; None if no model
    comes near.

    Considers the models and values for which has(model, values) is true. The Fit includes the
    errors for nodes of other colours, `colors`, and of other roughnesses, `also`. `colored`:
    whether the node's colour is linked; a model without a colour parameter would lose that
    link. `layered`: as for candidates()."""
    native, targets, found = natives[0], [Target(n) for n in natives], []
    follows = len({n.roughness for n in natives}) > 1

    def fit(candidate, factor, error, lost):
        known = {native: (targets[0].light, error)} if len(natives) == 1 else {}

        def found(here):
            return known.get(here) or _light_and_error(candidate, here, factor, follows)

        shades = [[replace(n, color=c) for n in (*natives, *also)] for c in colors]
        errors = (tuple(found(here) for here in of_color) for of_color in shades)
        return Fit(candidate, factor, tuple(errors), lost)

    considered = candidates(native, has, natives, layered)
    for candidate in considered:
        if candidate.is_own and (candidate.is_colored or not colored):
            factor = candidate.width.usual if candidate.width else 1.0
            error = _mean(Target.error, candidate, targets, factor)
            if error <= (_OWN_LAYER_ERROR if candidate.base else _OWN_ERROR):
                return fit(candidate, factor, error, lost=False)
    # The width hardly depends on the base, so it is fitted once for all of them.
    roughly, closely = {}, {}
    for candidate in considered:
        if any(n.stretch != 1 for n in natives) and not (
            candidate.width and candidate.width.across
        ):
            continue
        lost = colored and not candidate.is_colored
        key = candidate.model, candidate.width, candidate.is_flat
        if key not in roughly:
            roughly[key] = _rough_width(candidate, targets)
        between = roughly[key]
        error = _mean(Target.error, candidate, targets, math.exp(between[1]))
        found.append((lost, error, between, candidate))
    if not found:
        return None
    best, fits = min(f[:2] for f in found), []
    for lost, error, between, candidate in found:
        if lost == best[0] and error <= _CANDIDATE_MARGIN * best[1]:
            key = candidate.model, candidate.width, candidate.is_flat
            if key not in closely:
                closely[key] = _factor(candidate, targets, between)
            error = _mean(Target.error, candidate, targets, closely[key])
            fits.append((error, closely[key], candidate))
    error, factor, candidate = min(fits, key=lambda f: f[0])
    return fit(candidate, factor, error, best[0])


def _light_and_error(candidate, native, factor, follows):
    """The light of a node, and a candidate's error for a factor of its width."""
    target = Target(native)
    return target.light, _measured(Target.error, candidate, target, factor, follows)


def _measured(measure, candidate, target, factor, follows):
    """One of Target's methods for a candidate. `follows`: whether the roughness is linked."""
    native = target.native
    values, base = with_width(candidate, native, factor), base_of(candidate, native, follows)
    return measure(target, candidate.model, values, base, scale_of(candidate, native))


def _mean(measure, candidate, targets, factor):
    """The mean of one of Target's methods over nodes; with several roughnesses the roughness is
    linked."""
    follows = len({t.native.roughness for t in targets}) > 1
    return sum(_measured(measure, candidate, t, factor, follows) for t in targets) / len(targets)


def _rough_width(candidate, targets):
    """Three log factors of a candidate's width: near the minimum of the misplaced light, and one on
    each side. All are 0 for a candidate without a width."""
    width = candidate.width
    if width is None:
        return 0.0, 0.0, 0.0

    def error_of_log_width(x):
        return _mean(Target.roughly_misplaced, candidate, targets, math.exp(x))

    r = np.array([max(t.native.roughness, 1e-3) for t in targets])
    ends = np.log([width.low, width.high])[:, None] - width.power * np.log(r)[None]
    grid, step = np.linspace(ends.min(), ends.max(), 16, retstep=True)
    usual = math.log(width.usual)
    below, best, above = (error_of_log_width(x) for x in (usual - step, usual, usual + step))
    # Searches the whole range if the minimum is not near the typical value.
    best = usual if below > best < above else min(grid, key=error_of_log_width)
    low, high = max(best - step, grid[0]), min(best + step, grid[-1])
    best = _lowest(error_of_log_width, low, best, high)
    return max(best - step / 3, grid[0]), best, min(best + step / 3, grid[-1])


def _factor(candidate, targets, between):
    """The width factor that misplaces the least light."""
    if candidate.width is None:
        return 1.0

    def error_of_log_width(x):
        return _mean(Target.misplaced, candidate, targets, math.exp(x))

    # The search stops beside the minimum; a model that is the node itself has the typical width.
    found = _lowest(error_of_log_width, *between), math.log(candidate.width.usual)
    return math.exp(min(found, key=error_of_log_width))


def _lowest(function, low, best, high):
    """Minimizes a function between two ends, by parabolas through three points."""
    points = {x: function(x) for x in {low, best, high}}
    for _ in range(_PARABOLAS):
        middle = min(points, key=points.get)
        below, above = ([x for x in points if x < middle], [x for x in points if x > middle])
        if not below or not above:
            # At an end the minimum may lie right beside it.
            other = min(above) if above else max(below)
            x = (middle + other) / 2
        else:
            x = _vertex(points, max(below), middle, min(above))
        if min(abs(x - y) for y in points) < _LOG_WIDTH_TOLERANCE:
            break
        points[x] = function(x)
    return min(points, key=points.get)


def _vertex(points, a, b, c):
    """Vertex of the parabola through three points of which the middle one, b, is the lowest. It is
    kept away from the points, so that every evaluation adds information."""
    left, right = (b - a) * (points[b] - points[c]), (b - c) * (points[b] - points[a])
    x = b - 0.5 * ((b - a) * left - (b - c) * right) / min(left - right, -1e-30)
    wide, far = ((a, b), (b, c)), 0.1
    low, high = max(wide, key=lambda ends: ends[1] - ends[0])
    if abs(x - b) < far * min(b - a, c - b):
        return low + 0.25 * (high - low) if low == b else high - 0.25 * (high - low)
    return min(max(x, a + far * (b - a)), c - far * (c - b))
