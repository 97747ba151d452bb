# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo of models with two widths, as nodes. A twin has that of the default widths, since its
tables follow one parameter at most."""

import numpy as np

from ..packs import energy
from .twin import Looked, Picture, place_on_axis

#: The widths by model.
WIDTHS = {"microfacet": ("ax", "ay"), "ward": ("ax", "ay"), "ashikhmin_shirley": ("nu", "nv")}
_VIEWS, _ROWS = 65, 33
_SCALES = {"linear": lambda x: x, "log": np.log, "log1p": np.log1p}
_INVERSE = {"linear": lambda x: x, "log": np.exp, "log1p": np.expm1}


def wire(w, model, given, cos_theta):
    """The output with the albedo, of which the generator's tables have one for each choice and
    width: here for the default choices, and for both widths at their geometric mean.

    `given`: the parameters' outputs or constants, by name. `cos_theta`: output with the cosine of
    the view.
    """
    table = model.entry["albedo"]
    axes = {a["name"]: a for grid in table["grids"] for a in grid["axes"]}
    # A pack that is cut to a scene lacks the axes of what is constant there.
    varying = [name for name in WIDTHS[model.name] if name in axes]
    widths, place = np.zeros(2), 0.0
    if varying:
        axis = axes[varying[0]]
        axis = {"scale": axis["scale"], "low": axis["values"][0], "high": axis["values"][-1]}
        ends = (_SCALES[axis["scale"]](axis[end]) for end in ("low", "high"))
        widths = _INVERSE[axis["scale"]](np.linspace(*ends, _ROWS))
        place = place_on_axis(w, axis, w.mean(*map(given, varying)))
    defaults = {name: p["default"] for name, p in model.parameters.items()}
    terms = table["terms"][energy.combination(table, model.parameters, defaults)]
    found = [_channels(table["grids"][term["grid"]], widths) for term in terms]
    every = [rows for channels in found for rows in channels]
    picture = Picture(w, every, cos_theta, place, f"{model.label} (albedo)")
    weights = [_product(w, [given(name) for name in term["colors"]]) for term in terms]
    return Looked(w, picture).colour(found, weights)


def _product(w, colours):
    total = (1.0, 1.0, 1.0)
    for colour in colours:
        total = w.vector("MULTIPLY", colour, total)
    return total


def _channels(grid, widths):
    """For each channel of a grid its values (widths, views), for both widths alike. Its axes are
    the view, and one or both of the widths, or none."""
    axes = {a["name"]: a for a in grid["axes"]}
    views = axes.pop("cos_theta_o", {"values": [0.0]})  # a grid need not depend on the view
    at = [_weights(a, widths) for a in axes.values()]
    shape = [len(views["values"]), *(len(a["values"]) for a in axes.values()), grid["channels"]]
    values = np.reshape(grid["values"], shape)
    if len(at) == 2:
        values = np.einsum("cabk,wa,wb->kwc", values, *at)
    elif at:
        values = np.einsum("cak,wa->kwc", values, *at)
    else:
        values = np.broadcast_to(values.T[:, None], (grid["channels"], len(widths), shape[0]))
    x = np.linspace(0, 1, _VIEWS)
    return [[np.interp(x, views["values"], row) for row in channel] for channel in values]


def _weights(axis, places):
    """The matrix (places, knots) of linear interpolation on the axis's scale."""
    scale = _SCALES[axis["scale"]]
    knots = scale(np.array(axis["values"]))
    return np.array([np.interp(scale(places), knots, one) for one in np.eye(len(knots))]).T
