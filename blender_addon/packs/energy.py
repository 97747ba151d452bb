# SPDX-License-Identifier: GPL-3.0-or-later
"""Directional albedo from the generator's tables. Independent of bpy.

Per colour channel the albedo is a sum of terms. Each is interpolated in a table and multiplied by
the colours that it names; the model's choices select which terms apply.
"""

import bisect
import math

from . import pack

#: What a table's axis is linear in.
SCALES = {"linear": float, "log": math.log, "log1p": math.log1p}


def bracket(axis, value):
    """Index of the lower knot and weight of the upper one; values beyond the ends are clamped."""
    knots = axis["values"]
    value = min(max(value, knots[0]), knots[-1])
    upper = min(max(bisect.bisect_right(knots, value), 1), len(knots) - 1)
    scale = SCALES[axis["scale"]]
    low, high = scale(knots[upper - 1]), scale(knots[upper])
    return upper - 1, (scale(value) - low) / (high - low)


def _interpolate(grid, coordinates):
    """Multilinear interpolation in a row-major table, first axis slowest, channel innermost."""
    corners = [(0, 1.0)]
    for axis in grid["axes"]:
        lower, weight = bracket(axis, coordinates[axis["name"]])
        size = len(axis["values"])
        corners = [
            (index * size + lower + step, factor * w)
            for index, factor in corners
            for step, w in ((0, 1 - weight), (1, weight))
            if w
        ]
    channels = grid["channels"]
    value = [sum(f * grid["values"][i * channels + c] for i, f in corners) for c in range(channels)]
    return value * 3 if channels == 1 else value


def combination(table, schema, values):
    """Index of a combination of choices in mixed radix: the last choice varies fastest."""
    index = 0
    for name in table["choices"]:
        choices = schema[name]["choices"]
        index = index * len(choices) + choices.index(values[name])
    return index


def views(model_name):
    """View cosines of the tables; a pack that is cut to a scene has only those that it needs."""
    return tuple(pack.model(model_name).entry.get("view_cosines", (0, 1)))


def albedo(model_name, values, cos_theta_o):
    """Directional albedo (r, g, b) for a view cosine in (0, 1], including ideal reflection.

    `values` has the model's parameters in the form of pack.check_value; missing ones take their
    default. Raises ValueError for an unknown model, for one without a table, and for a view that
    was cut from the table.
    """
    model = pack.model(model_name)
    table, schema = model.entry.get("albedo"), model.parameters
    if table is None:
        raise ValueError(f"{model_name}: its albedo is not tabulated")
    low, high = views(model_name)
    if not low <= cos_theta_o <= high:
        raise ValueError(
            f"cos_theta_o: this pack was built for one scene, where {model_name} is seen at "
            f"{low:.3g} to {high:.3g}; got {cos_theta_o:.3g}"
        )
    complete = {name: p["default"] for name, p in schema.items()} | values
    coordinates = complete | {"cos_theta_o": cos_theta_o}
    total = [0.0, 0.0, 0.0]
    for term in table["terms"][combination(table, schema, complete)]:
        value = _interpolate(table["grids"][term["grid"]], coordinates)
        for name in term["colors"]:
            value = [v * c for v, c in zip(value, complete[name], strict=True)]
        total = [t + v for t, v in zip(total, value, strict=True)]
    return tuple(total)
