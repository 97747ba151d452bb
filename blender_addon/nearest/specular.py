# SPDX-License-Identifier: GPL-3.0-or-later
"""A rough dielectric Principled node whose Specular IOR Level or Specular Tint varies: one glossy
layer over one base, whose values follow its share of the highest value as polynomials. Independent
of bpy."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from . import layer, native_bsdf
from .misplaced_light import Target
from .nearest_model import Base, matte_of, nearest, with_width

#: The model of the layer.
MODEL = "microfacet"
#: Limits of Varying.top and of Varying.dimmed, so that polynomials have a range.
_LEAST_TOP, _MOST_DIMMED = 0.01, 0.8
#: Degree in the share of the model's values.
_DEGREE = 3
#: Shares at which the error is measured, as far as the input has them. A layer with less reflects
#: hardly anything.
_SHARES = (0.05, 0.1, 0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True)
class Varying:
    """An input that varies. `at`: a node with a share of it, given the node at share 1."""

    socket: str
    at: Callable
    #: Below this share the layer is dimmed in proportion to it. The model's Fresnel term, which is
    #: 1 at the horizon, would be too bright there.
    dimmed: float
    #: The input's lowest value, as a share, and the value at share 1, its highest.
    low: float = 0.0
    top: float = 1.0

    def between(self, low, high):
        """The same for an input with values from `low` to `high`."""
        top = max(high, _LEAST_TOP)
        low = min(max(low / top, 0.0), 1.0)
        return replace(self, low=low, top=top, dimmed=min(self.dimmed / top, _MOST_DIMMED))

    @property
    def shares(self):
        """Those of which the error is computed."""
        return tuple(dict.fromkeys(max(share, self.low) for share in _SHARES))


def _with_tint(native, share):
    return replace(native, tint=tuple(share * t for t in native.tint))


LEVEL = Varying("Specular IOR Level", lambda n, share: replace(n, f0=n.f0 * share), 0.1)
TINT = Varying("Specular Tint", _with_tint, 0.0)


@dataclass(frozen=True)
class VaryingFit:
    """`laws`: coefficients (r, g, b) of share^j of the parameters that follow it, from `dimmed` on.
    `rest`: those of layer.rest_of_share(). `found`: for each of the colours, (light, error) of each
    of Varying.shares."""

    values: dict
    laws: dict
    base: object
    rest: tuple
    found: tuple
    #: As that of a Fit.
    lost: bool = False


def _law(shares, values):
    """The polynomial through values (n, 3)."""
    found = np.polyfit(shares, np.array(values), _DEGREE)[::-1]
    return tuple(tuple(float(x) for x in c) for c in found)


def _laws(native, varying):
    shares = np.linspace(varying.dimmed, 1, 19)
    nodes = [varying.at(native, share) for share in shares]
    pairs = np.array([[layer.schlick_like(n.f0, t) for t in n.tint] for n in nodes])
    laws = {"f0": _law(shares, pairs[..., 0]), "tint": _law(shares, pairs[..., 1])}
    if native.multiscatter:
        laws["again"] = _law(shares, [native_bsdf.again(n) for n in nodes])
    return laws


def _at(laws, share):
    """The values of laws at a share."""
    found = {n: sum(np.array(c) * share**j for j, c in enumerate(law)) for n, law in laws.items()}
    return {name: tuple(np.clip(value, 0, 1).tolist()) for name, value in found.items()}


def fit(native, varying, candidate, colors, has):
    """The VaryingFit for a node, given as it is at share 1; None if there is no base for it.
    `candidate`: that of the layer; `has`: as for nearest()."""
    base = nearest((matte_of(native),), (), False, has)
    if base is None:
        return None
    laws = _laws(native, varying)
    values = with_width(candidate, native, 1.0) | _at(laws, 1.0)
    rest = layer.rest_of_share(native, varying.at, varying.dimmed)

    def error(color, share):
        here = replace(varying.at(native, share), color=color)
        of_base = with_width(base.candidate, matte_of(here), base.factor)
        left = tuple((sum(c * share**j for j, c in enumerate(row)),) for row in rest)
        target, below = Target(here), Base(base.candidate.model, of_base, left)
        if not target.total.any():
            return 0.0, 0.0
        given = values | _at(laws, max(share, varying.dimmed))
        scale = min(share / varying.dimmed, 1.0) if varying.dimmed else 1.0
        return float(target.total.mean()), target.error(MODEL, given, below, scale)

    found = tuple(tuple(error(color, share) for share in varying.shares) for color in colors)
    return VaryingFit(values, laws, base, rest, found)
