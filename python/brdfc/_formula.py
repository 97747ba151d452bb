# SPDX-License-Identifier: GPL-3.0-or-later
"""What the formulas of the models call, beside NumPy.

In a formula a real is an array (N,), a colour (3, N), what is constant (), (1,) or (3, 1).
"""

from __future__ import annotations

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
    below, fraction, offsets, stride = 0, [], [0], values.size
    for size, x in zip(values.shape, coordinates, strict=True):
        stride //= size
        position = np.clip(x, 0.0, 1.0) * (size - 1)
        index = np.minimum(np.asarray(position).astype(np.intp), size - 2)
        below = below + index * stride
        fraction.append(position - index)
        offsets = [at + up for at in offsets for up in (0, stride)]
    flat = values.ravel()
    corners = [flat[below + at] for at in offsets]
    for f in reversed(fraction):
        pairs = zip(corners[::2], corners[1::2], strict=True)
        corners = [(1.0 - f) * low + f * high for low, high in pairs]
    return corners[0]
