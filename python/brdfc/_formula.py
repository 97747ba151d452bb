# SPDX-License-Identifier: GPL-3.0-or-later
"""What the formulas of the models call: their first argument, `np`, has it. That of NumPy is here.

In a formula a real is an array (N,), a colour (3, N), what is constant (), (1,) or (3, 1).
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def table(sizes: tuple[int, ...], text: str) -> Array:
    """An array of numbers separated by spaces."""
    return np.array(text.split(), dtype=np.float64).reshape(sizes)


def multilinear(np, values: Array, coordinates):
    """Multilinear between values on a regular grid over [0, 1]^d; outside, the nearest end. Beside
    NumPy's functions it takes np.index(x), integers, and np.entries(values, index)."""
    below, fraction, offsets, stride = 0, [], [0], values.size
    for size, x in zip(values.shape, coordinates, strict=True):
        stride //= size
        position = np.clip(x, 0.0, 1.0) * (size - 1)
        cell = np.minimum(np.floor(position), size - 2.0)
        below = below + np.index(cell) * stride
        fraction.append(position - cell)
        offsets = [at + up for at in offsets for up in (0, stride)]
    corners = [np.entries(values, below + at) for at in offsets]
    for f in reversed(fraction):
        pairs = zip(corners[::2], corners[1::2], strict=True)
        corners = [(1.0 - f) * low + f * high for low, high in pairs]
    return corners[0]


def _rgb(r, g, b) -> Array:
    return np.stack(np.broadcast_arrays(np.atleast_1d(r), g, b))


#: The functions of NumPy that formulas call, by its names.
FUNCTIONS = ("abs", "arctan", "cbrt", "cos", "exp", "expm1", "log", "log1p", "logical_not", "max")
FUNCTIONS += ("maximum", "minimum", "power", "sin", "sqrt", "where", "clip", "floor")

NUMPY = SimpleNamespace(
    **{name: getattr(np, name) for name in FUNCTIONS},
    index=lambda x: np.asarray(x).astype(np.intp),
    entries=lambda values, index: values.ravel()[index],
    rgb=_rgb,
    lookup=lambda values, *coordinates: multilinear(NUMPY, values, coordinates),
)
