# SPDX-License-Identifier: GPL-3.0-or-later
"""What the formulas of the models call, beside NumPy.

In a formula a real is an array (N,), a colour (3, N), what is constant (), (1,) or (3, 1).
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray


def rgb(r, g, b) -> NDArray[np.float64]:
    """The colour of three reals."""
    return np.stack(np.broadcast_arrays(np.atleast_1d(r), g, b))


def table(sizes: tuple[int, ...], text: str) -> NDArray[np.float64]:
    """An array of numbers separated by spaces."""
    return np.array(text.split(), dtype=np.float64).reshape(sizes)


def lookup(values: NDArray[np.float64], *coordinates) -> NDArray[np.float64]:
    """Multilinear between values on a regular grid over [0, 1]^d; outside, the nearest end."""
    index, fraction = [], []
    for size, x in zip(values.shape, coordinates, strict=True):
        position = np.clip(x, 0.0, 1.0) * (size - 1)
        index.append(np.minimum(np.asarray(position).astype(np.intp), size - 2))
        fraction.append(position - index[-1])
    total = 0.0
    for corner in itertools.product((0, 1), repeat=len(index)):
        weight = 1.0
        for up, f in zip(corner, fraction, strict=True):
            weight = weight * (f if up else 1.0 - f)
        total = total + weight * values[tuple(i + up for i, up in zip(index, corner, strict=True))]
    return total
