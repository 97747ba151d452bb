# SPDX-License-Identifier: GPL-3.0-or-later
"""Operations of the Math node and blends of colours, as Cycles computes them in single precision:
their values, and where those lie if the inputs vary (tests/blender/test_node_values.py compares
both with pictures)."""

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


class Unknown(Exception):
    """The value varies over the surface, is animated, too large for single precision, or comes from
    an unsupported node."""


class Bounds(NamedTuple):
    """The smallest and the largest value: numbers or colours."""

    low: object
    high: object


def stored(value):
    """A value as Cycles stores it, in single precision. Raises Unknown if that is not finite."""
    with np.errstate(over="ignore"):
        value = np.asarray(value, np.float32).astype(float)
    if not np.isfinite(value).all():
        raise Unknown
    return value if value.ndim else float(value)


def hull(values):
    """The bounds of some values."""
    values = np.broadcast_arrays(*values)
    return Bounds(np.minimum.reduce(values), np.maximum.reduce(values))


def at_ends(compute, *inputs):
    """The bounds of a function that is monotonic in each of its inputs, given theirs: extremes are
    at their ends."""
    return hull([compute(*values) for values in itertools.product(*inputs)])


def power(base, exponent):
    """Cycles' safe_powf. A negative base has only whole powers; exponents that do not fit an `int`
    do not count as whole."""
    is_whole = -(2**31) <= exponent < 2**31 and exponent == int(exponent)
    if base < 0 and not is_whole:
        return 0.0
    try:
        return float(base) ** float(exponent)
    except ArithmeticError:  # infinite
        raise Unknown from None


def power_bounds(base, exponent):
    """Bounds of power()."""
    sides = []
    if base[1] >= 0:
        sides.append(_power_of_positive((max(base[0], 0.0), base[1]), exponent))
    if base[0] < 0:
        low, high = _power_of_positive((max(-base[1], 0.0), -base[0]), exponent)
        if exponent[0] != exponent[1]:
            sides.append((-high, high))
        else:
            sign = power(-1.0, exponent[0])  # 0 if it is not whole
            sides.append((sign * low, sign * high))
    return hull(itertools.chain(*sides))


def _power_of_positive(base, exponent):
    if base[0] == 0 and exponent[0] < 0:
        raise Unknown  # it has no limit near 0
    return at_ends(power, base, exponent)


def gamma_bounds(value, exponent):
    """Bounds of a channel of the Gamma node, which leaves what is not positive as it is."""
    found = [(1.0, 1.0)] if exponent[0] <= 0 <= exponent[1] else []
    if value[0] <= 0:
        found.append((value[0], min(value[1], 0.0)))
    if value[1] > 0:
        found.append(_power_of_positive((max(value[0], 0.0), value[1]), exponent))
    return hull(itertools.chain(*found))


def _absolute_bounds(a):
    ends = hull(map(abs, a))
    return Bounds(0.0, ends.high) if a[0] < 0 < a[1] else ends


def _divide(a, b):
    return a / b if b else 0.0


def _divide_bounds(a, b):
    if b[0] <= 0 <= b[1] and b[0] != b[1]:
        raise Unknown
    return at_ends(_divide, a, b)


@dataclass(frozen=True)
class Operation:
    """An operation of the Math node on `count` inputs."""

    count: int
    value: object
    #: Takes the bounds of the inputs; None for operations that are monotonic in each input.
    own_bounds: object = None

    def bounds(self, *inputs):
        """Bounds of the value. Raises Unknown if it has none."""
        return self.own_bounds(*inputs) if self.own_bounds else at_ends(self.value, *inputs)


MATH = {
    "ADD": Operation(2, lambda a, b: a + b),
    "SUBTRACT": Operation(2, lambda a, b: a - b),
    "MULTIPLY": Operation(2, lambda a, b: a * b),
    "DIVIDE": Operation(2, _divide, _divide_bounds),
    "MULTIPLY_ADD": Operation(3, lambda a, b, c: stored(a * b) + c),
    "POWER": Operation(2, power, power_bounds),
    "SQRT": Operation(1, lambda a: max(a, 0.0) ** 0.5),
    "MINIMUM": Operation(2, min),
    "MAXIMUM": Operation(2, max),
    "LESS_THAN": Operation(2, lambda a, b: float(a < b)),
    "GREATER_THAN": Operation(2, lambda a, b: float(a > b)),
    "ABSOLUTE": Operation(1, abs, _absolute_bounds),
}
#: Result of blending a colour b onto a colour a with factor 1.
BLENDS = {
    "MIX": lambda a, b: b,
    "MULTIPLY": lambda a, b: a * b,
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "SCREEN": lambda a, b: 1 - (1 - a) * (1 - b),
}
