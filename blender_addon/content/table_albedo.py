# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo of a model as nodes, from the generator's tables. A twin has that of the default
choices, over one parameter at most; here it follows all choices and both widths.

Models with two widths reflect as microfacets whose alpha depends on the azimuth phi,

    alpha(phi)^2 = alpha_x^2 cos^2 phi + alpha_y^2 sin^2 phi.

The tables have the mean over the azimuth of the view. It is nearly the mean of the albedos of
isotropic models with the alphas at three azimuths: for alphas from 0.02 to 1 the difference is up
to 0.05, and 0.01 in the root mean square. Equal widths make no difference.
"""

import functools
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..packs import energy
from .twin import Looked, Picture, place_on_axis


@dataclass(frozen=True)
class _Widths:
    """Two parameters that say how wide facets are; alpha^2 of one, as a number and as nodes; and
    one of alpha^2."""

    names: tuple
    alpha2: Callable
    nodes: Callable
    of_alpha2: Callable


_ALPHAS = _Widths(("ax", "ay"), lambda a: a * a, lambda w, a: w.math("MULTIPLY", a, a), np.sqrt)
#: Powers of the half vector's cosine.
_EXPONENTS = _Widths(
    ("nu", "nv"),
    lambda n: 2 / (n + 2),
    lambda w, n: w.math("DIVIDE", 2.0, w.math("ADD", n, 2.0)),
    lambda alpha2: 2 / alpha2 - 2,
)
_WIDTHS = {"microfacet": _ALPHAS, "ward": _ALPHAS, "ashikhmin_shirley": _EXPONENTS}
#: Colours of terms that follow the geometric mean of both widths: that is so in the definition of
#: the interreflection of `microfacet`.
_APART = {"again"}
_VIEWS, _ROWS, _WIDTH_ROWS = 65, 65, 17
_AZIMUTHS = np.pi / 12 * np.array([1, 3, 5])
_INVERSE = {"linear": lambda x: x, "log": np.exp, "log1p": np.expm1}


def is_needed(model):
    """Whether a model's albedo depends on more than its twin follows, and nodes can have it."""
    table = model.entry.get("albedo")
    if table is None or _numbers(model) is None:
        return False
    first = table["terms"][0]
    return model.name in _WIDTHS or any(terms != first for terms in table["terms"])


def _numbers(model):
    """The parameter that the albedo depends on beside colours, factors and choices, or the two
    widths, as a tuple; None if there are others."""
    grids = model.entry["albedo"]["grids"]
    names = dict.fromkeys(a["name"] for g in grids for a in g["axes"] if not _is_factor(a))
    names.pop("cos_theta_o", None)
    widths = _WIDTHS.get(model.name)
    known = len(names) < 2 or (widths and set(names) <= set(widths.names))
    return tuple(names) if known else None


def _is_factor(axis):
    """Whether an albedo is linear in a parameter."""
    return axis["name"] != "cos_theta_o" and axis["scale"] == "linear" and len(axis["values"]) == 2


def wire(w, model, given, cos_theta):
    """The output with the albedo.

    `given`: the parameters' outputs or constants, by name. `cos_theta`: output with the cosine of
    the view.
    """
    table, schema = model.entry["albedo"], model.parameters
    rows = _Rows(w, model, given)
    choices = table["choices"]
    options = [_options(schema[name], given, name) for name in choices]
    channels_of = functools.cache(lambda g: list(_channels(table["grids"][g], rows.places)))
    found = []
    for values in itertools.product(*options):
        index = energy.combination(table, schema, dict(zip(choices, values, strict=True)))
        found.append(_tables(table["terms"][index], channels_of))
    channels = {}
    for tables in found:
        for key, of_term in tables.items():
            channels[key] = max(channels.get(key, 0), len(of_term))
    if not channels:  # constants of a pack can make it black
        return w.combine(0.0, 0.0, 0.0)
    blocks = [_block(tables, channels, (rows.count, _VIEWS)) for tables in found]
    every = [table for block in blocks for table in block]
    picture = Picture(w, every, cos_theta, f"{model.label} (albedo)")
    height = rows.count * len(blocks[0]) // 3
    skipped = _skipped(w, choices, options, given, height)
    first = iter(blocks[0])
    terms = {key: [next(first) for _ in range(count)] for key, count in channels.items()}
    total = None
    for apart, places in rows.found:
        keys = [key for key in channels if apart == (not _APART.isdisjoint(key[0]))]
        if keys:
            means = _Mean(w, [picture.at(place, skipped) for place in places])
            weights = [_weight(w, key, given) for key in keys]
            part = Looked(w, means).colour([terms[key] for key in keys], weights)
            total = part if total is None else w.vector("ADD", total, part)
    return total


def _block(tables, channels, shape):
    """The tables of one combination of choices, whole bands of a picture: black where it lacks a
    term that others have. Of each, its place in the list counts, so none stands twice."""
    block = []
    for key, count in channels.items():
        of_term = tables.get(key) or [np.zeros(shape)]
        block += [np.array(_channel(of_term, i)) for i in range(count)]
    return block + [np.zeros(shape) for _ in range(-len(block) % 3)]


def _options(parameter, given, name):
    """The values that a choice can have here."""
    constant = given.constant(name, parameter["default"])
    return parameter["choices"] if constant is None else [constant]


def _skipped(w, names, options, given, height):
    """The rows of the picture above those of the current choices: an output, or 0."""
    skipped = 0.0
    for name, values in zip(reversed(names), reversed(options), strict=True):
        if len(values) > 1:
            skipped = w.math("MULTIPLY_ADD", given(name), float(height), skipped)
        height *= len(values)
    return skipped


def _tables(terms, channels_of):
    """The tables of a sum of terms, by colours and factors; each is a list of channels with rows
    (places, views). `channels_of`: _channels() of a grid."""
    found = {}
    for term in terms:
        for factors, channels in channels_of(term["grid"]):
            if not any(np.any(rows) for rows in channels):
                continue
            key = tuple(sorted(term["colors"])), factors
            if key in found:
                # Ideal reflection and scattered light of the same colour.
                count = max(len(channels), len(found[key]))
                channels = [_channel(channels, i) + _channel(found[key], i) for i in range(count)]
            found[key] = channels
    return found


def _channel(channels, index):
    """Red, green or blue; a term without colours has one channel for all."""
    return channels[index % len(channels)]


def _weight(w, key, given):
    colours, factors = key
    total = (1.0, 1.0, 1.0)
    for colour in colours:
        total = w.vector("MULTIPLY", given(colour), total)
    for name, low, high, at_high in factors:
        # From 0 to 1 between the ends of the parameter's axis, or from 1 to 0.
        step = 1 / (high - low)
        slope, offset = (step, -low * step) if at_high else (-step, high * step)
        total = w.vector("SCALE", total, scale=w.math("MULTIPLY_ADD", given(name), slope, offset))
    return total


class _Rows:
    """The values of one number, or of both widths alike, that a table's rows are for, as arrays by
    name, and how many; and pairs: whether for terms with the colours _APART, and outputs with
    positions between the first row and the last, from 0 to 1, of which the mean counts."""

    def __init__(self, w, model, given):
        names = _numbers(model)
        axes = {a["name"]: a for g in model.entry["albedo"]["grids"] for a in g["axes"]}
        if not names:
            self.places, self.count, self.found = {}, 2, [(False, [0.0])]
        elif len(names) == 2:
            self._of_widths(w, _WIDTHS[model.name], axes[names[0]]["values"], given)
        else:
            axis = axes[names[0]]
            ends = {"scale": axis["scale"], "low": axis["values"][0], "high": axis["values"][-1]}
            span = (energy.SCALES[axis["scale"]](ends[end]) for end in ("low", "high"))
            self.places = {names[0]: _INVERSE[axis["scale"]](np.linspace(*span, _ROWS))}
            self.count = _ROWS
            self.found = [(False, [place_on_axis(w, ends, given(names[0]))])]

    def _of_widths(self, w, widths, knots, given):
        """Rows at equal steps of the root of alpha, in which albedos are smooth."""
        low, high = sorted(widths.alpha2(knot) ** 0.25 for knot in (knots[0], knots[-1]))
        steps = np.linspace(low, high, _WIDTH_ROWS)
        values = np.clip(widths.of_alpha2(steps**4), min(knots), max(knots))
        self.places, self.count = dict.fromkeys(widths.names, values), _WIDTH_ROWS
        x, y = (widths.nodes(w, given(name)) for name in widths.names)

        def place(alpha2):
            root = w.math("POWER", alpha2, 0.25)
            inside = w.math("MINIMUM", w.math("MAXIMUM", root, low), high)
            step = 1 / (high - low)
            return w.math("MULTIPLY_ADD", inside, step, -low * step)

        at_azimuths = []
        for phi in _AZIMUTHS:
            across = w.math("MULTIPLY", y, math.sin(phi) ** 2)
            at_azimuths.append(place(w.math("MULTIPLY_ADD", x, math.cos(phi) ** 2, across)))
        self.found = [(False, at_azimuths), (True, [place(w.mean(x, y))])]


class _Mean:
    """The mean of several places of a picture."""

    def __init__(self, wiring, places):
        self.wiring, self.places, self.known = wiring, places, {}

    def look_up(self, rows):
        if id(rows) not in self.known:
            w = self.wiring
            total, *others = (place.look_up(rows) for place in self.places)
            for other in others:
                total = w.math("ADD", total, other)
            if others:
                total = w.math("MULTIPLY", total, 1 / len(self.places))
            self.known[id(rows)] = total
        return self.known[id(rows)]


def _channels(grid, places):
    """Pairs of factors and channels of a grid. A channel has rows (places, views); factors are a
    (name, low, high, at_high) for each parameter in which the grid is linear."""
    axes = grid["axes"]
    values = np.reshape(grid["values"], [*(len(a["values"]) for a in axes), grid["channels"]])
    linear = [a for a in axes if _is_factor(a)]
    rest = [a for a in axes if not _is_factor(a)]
    for ends in itertools.product((0, 1), repeat=len(linear)):
        at = dict(zip((a["name"] for a in linear), ends, strict=True))
        cut = values[tuple(at.get(a["name"], slice(None)) for a in axes)]
        factors = tuple((a["name"], a["values"][0], a["values"][-1], at[a["name"]]) for a in linear)
        yield factors, _rows(cut, rest, places)


def _rows(values, axes, places):
    """For each channel the rows (places, views) of a grid (views, numbers, channels), whose axes
    are the view and numbers, or some of these."""
    views, numbers = [0.0], axes
    if axes and axes[0]["name"] == "cos_theta_o":
        views, numbers = axes[0]["values"], axes[1:]
    else:
        values = values[None]
    count = len(next(iter(places.values()))) if places else 2
    at = np.broadcast_to(values, (count, *values.shape))
    for axis in reversed(numbers):
        at = np.einsum("p...nk,pn->p...k", at, _weights(axis, places[axis["name"]]))
    x = np.linspace(0, 1, _VIEWS)
    return [
        np.stack([np.interp(x, views, row) for row in channel]) for channel in np.moveaxis(at, 2, 0)
    ]


def _weights(axis, places):
    """The matrix (places, knots) of linear interpolation on the axis's scale."""
    weights = np.zeros((len(places), len(axis["values"])))
    for row, place in zip(weights, places, strict=True):
        lower, share = energy.bracket(axis, place)
        row[lower : lower + 2] = 1 - share, share
    return weights
