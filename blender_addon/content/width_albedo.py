# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo of models with two widths, as nodes. A twin has that of the default widths, since its
tables follow one parameter at most."""

import numpy as np

from ..packs import energy
from .twin import Picture, place_on_axis

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
    rows = [_rows(table["grids"][term["grid"]], widths) for term in terms]
    picture = Picture(w, rows, cos_theta, place, f"{model.label} (albedo)")
    total = None
    for term, table_of_term in zip(terms, rows, strict=True):
        colour = (1.0, 1.0, 1.0)
        for name in term["colors"]:
            colour = w.vector("MULTIPLY", given(name), colour)
        part = w.vector("SCALE", colour, scale=picture.look_up(table_of_term))
        total = part if total is None else w.vector("ADD", total, part)
    return total


def _rows(grid, widths):
    """Values (widths, views) of a grid of one channel, which has the view and one or both of the
    widths as axes, for both widths alike."""
    axes = grid["axes"]
    values = np.reshape(grid["values"], [len(a["values"]) for a in axes])
    of_widths = [a for a in axes if a["name"] != "cos_theta_o"]
    # The view first, then each width: (views, widths) after one, and the diagonal of two.
    at = [_weights(a, widths) for a in of_widths]
    if len(at) == 2:
        values = np.einsum("cab,wa,wb->wc", values, *at)
    elif at:
        values = np.einsum("ca,wa->wc", values, *at)
    else:
        values = np.broadcast_to(values, (len(widths), len(values)))
    views = np.linspace(0, 1, _VIEWS)
    return [np.interp(views, axes[0]["values"], row) for row in values]


def _weights(axis, places):
    """The matrix (places, knots) of linear interpolation on the axis's scale."""
    scale = _SCALES[axis["scale"]]
    knots = scale(np.array(axis["values"]))
    return np.array([np.interp(scale(places), knots, one) for one in np.eye(len(knots))]).T
