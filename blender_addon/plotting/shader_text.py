# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates the OSL source of a fitted form on NumPy arrays: the sum of its closures. Independent
of bpy.

Only the parts of Open Shading Language that such shaders use are supported: tables, assignments of
expressions, loops over a ramp, and closures. The closures are evaluated by the generator's own
formulas. As the text may come from an untrusted file, it can access nothing but its own variables
and the functions listed here.
"""

import functools
import operator
import re

import numpy as np

from ..brdfc import _closures
from ..brdfc._formula import NUMPY


class Unreadable(ValueError):
    """The text is not one of these shaders."""


#: Exceptions that evaluating an unsuitable text may raise.
FAILURES = (
    *(ArithmeticError, AttributeError, LookupError),
    *(RecursionError, TypeError, ValueError),
)

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|(?P<name>[A-Za-z_]\w*)"
    r'|(?P<text>"\w*")|(?P<sign>[-+*/<?:(),\[\]]))'
)
#: Binary operators in order of precedence, lowest first.
_BINARY = (
    {"<": operator.lt},
    {"+": operator.add, "-": operator.sub},
    {"*": operator.mul, "/": operator.truediv},
)
_ASSIGN = {"=": lambda old, new: new, "*=": operator.mul, "/=": operator.truediv}
_TABLE = re.compile(r"float (\w+)\[\d+\] = \{([^{}]*)\};")
_LOOP = re.compile(r"for \(int (\w+) = 0; \1 < (\d\d?); \1\+\+\)\s*([^;]*);")
_ARRAY = re.compile(r"color (\w+)\[(\d\d?)\]")
_NOTHING = re.compile(r"(float|color|vector) [\w, ]+|brdfc_frame\(.*\)|")
_STATEMENT = re.compile(
    r"(?:(?:float|int|color|vector|normal) )?(\w+)(?:\[(\w+)\])? ([*/]?=) (.*)", re.DOTALL
)
#: Variables that exist before the first statement: the shader's frame about the normal.
_FRAME = ("frame_n", "frame_t", "frame_b", "wo_x", "wo_y", "wo_z")


class _Parser:
    """Parses expressions into functions of the variables (a dictionary by name)."""

    def __init__(self, text):
        self._tokens, at = [], 0
        while text[at:].strip():
            match = _TOKEN.match(text, at)
            if match is None:
                raise Unreadable(f"unexpected {text[at : at + 20]!r}")
            self._tokens.append((match.lastgroup, match[match.lastgroup]))
            at = match.end()
        self._tokens = [("end", ""), *reversed(self._tokens)]

    def all(self):
        found = self._choice()
        self._take("")
        return found

    def _next(self):
        return self._tokens[-1][1]

    def _take(self, expected=None):
        kind, token = self._tokens[-1]
        if expected is not None and token != expected:
            raise Unreadable(f"expected {expected!r}, got {token!r}")
        if kind != "end":
            self._tokens.pop()
        return kind, token

    def _choice(self):
        first = self._binary(0)
        if self._next() != "?":
            return first
        self._take()
        second = self._choice()
        self._take(":")
        third = self._choice()

        def chosen(v):
            condition = first(v)
            if np.size(condition) == 1:
                return second(v) if condition else third(v)
            return np.where(condition, second(v), third(v))

        return chosen

    def _binary(self, level):
        if level == len(_BINARY):
            return self._unary()
        left = self._binary(level + 1)
        while self._next() in _BINARY[level]:
            operation = _BINARY[level][self._take()[1]]
            left = self._joined(operation, left, self._binary(level + 1))
        return left

    @staticmethod
    def _joined(operation, left, right):
        return lambda v: operation(left(v), right(v))

    def _unary(self):
        kind, token = self._take()
        if token == "-":
            value = self._unary()
            return lambda v: -value(v)
        if token == "(":
            value = self._choice()
            self._take(")")
            return value
        if kind == "number":
            number = float(token)
            return lambda v: number
        if kind == "text":
            return lambda v: token[1:-1]
        if kind != "name":
            raise Unreadable(f"unexpected {token!r}")
        if self._next() == "(":
            arguments = self._arguments()
            # As in the shader, variables and functions have separate namespaces.
            return lambda v: v[token + "("](*(argument(v) for argument in arguments))
        if self._next() == "[":
            self._take()
            index = self._choice()
            self._take("]")
            return lambda v: v[token][int(index(v))]
        return lambda v: v[token]

    def _arguments(self):
        self._take("(")
        found = []
        while self._next() != ")":
            found.append(self._choice())
            if self._next() != ")":
                self._take(",")
        self._take(")")
        return found


def _assignment(statement):
    """A function that executes an assignment on the variables."""
    match = _STATEMENT.fullmatch(statement)
    if match is None:
        raise Unreadable(f"unexpected {statement[:60]!r}")
    name, index, sign, value = match.groups()
    operation, value = _ASSIGN[sign], _Parser(value).all()
    index = None if index is None else _Parser(index).all()

    def assign(v):
        place, key = (v, name) if index is None else (v[name], int(index(v)))
        place[key] = operation(place.get(key) if index is None else place[key], value(v))

    return assign if name not in _FRAME else lambda v: None


def _loop(name, count, statement):
    step = _assignment(statement)

    def run(v):
        for v[name] in range(count):
            step(v)

    return run


@functools.lru_cache(maxsize=8)
def _program(text):
    """Tables and other arrays by name, and the steps up to the assignment of BSDF."""
    body = text[text.find("\nshader ") :].partition("\n{\n")[2]
    body, assigned, sum_of_closures = body.partition("BSDF = ")
    if not assigned:
        raise Unreadable("expected a shader that assigns BSDF")
    # The bending of the normal does not matter for a plot, where the shading normal is the
    # surface's.
    body = re.sub(r"vector shading_n = .*?(?=vector frame_t\b)", "", body, flags=re.S)
    body = re.sub(r"//[^\n]*", "", body + assigned + sum_of_closures.partition(";")[0] + ";")
    arrays = {name: np.fromstring(numbers, sep=",") for name, numbers in _TABLE.findall(body)}
    body = _TABLE.sub("", body)
    steps = []
    # Parameters within their range are handled in a block, which is closed after that.
    while body := body.lstrip("{ \n"):
        if loop := _LOOP.match(body):
            steps.append(_loop(loop[1], int(loop[2]), loop[3]))
            body = body[loop.end() :]
            continue
        statement, _, body = body.partition(";")
        if array := _ARRAY.fullmatch(statement):
            arrays[array[1]] = [0.0] * int(array[2])
        elif not _NOTHING.fullmatch(statement):
            steps.append(_assignment(statement))
    return arrays, steps


def _table(values, *sizes_and_positions):
    """brdfc_table1 and the like: linear along each axis, with positions from 0 to the size less 1.
    For arrays of points, at most one position, the view's, may vary."""
    count = len(sizes_and_positions) // 2
    sizes, positions = sizes_and_positions[:count], sizes_and_positions[count:]
    values, of_view = values.reshape([int(n) for n in sizes]), None
    for position in positions:
        if np.size(position) == 1:
            values = _between(values, float(np.ravel(position)[0]))
        elif of_view is None:
            of_view, values = position, np.moveaxis(values, 0, -1)
        else:
            raise Unreadable("expected a table of one position that the view decides")
    return values if of_view is None else _between(values, of_view)


def _between(values, position):
    """Linear interpolation along the first axis."""
    i = np.minimum(np.asarray(position, int), len(values) - 2)
    return values[i] + (values[i + 1] - values[i]) * (position - i)


def vector(*components):
    """Stacks three components, numbers or arrays (a, b): (3, a, b)."""
    return np.stack(np.broadcast_arrays(*(np.atleast_2d(x) for x in components)))


def _unit(v):
    return v / np.sqrt((v * v).sum(0))


_FUNCTIONS = {
    "atan": np.arctan,
    "backfacing": lambda: False,
    # A variable declared as colour may have been assigned a number.
    "brdfc_max_component": lambda color: color.max(axis=0) if np.ndim(color) == 3 else color,
    "brdfc_table1": _table,
    "brdfc_table2": _table,
    "brdfc_table3": _table,
    "clamp": lambda x, low, high: np.minimum(np.maximum(x, low), high),
    "color": lambda *c: vector(*(c * 3)[:3]),
    "cos": np.cos,
    "exp": np.exp,
    "log": np.log,
    "max": np.maximum,
    "min": np.minimum,
    "normalize": _unit,
    "sin": np.sin,
    "sqrt": np.sqrt,
    "vector": lambda *c: vector(*(c * 3)[:3]),
}


def facets(wi, wo, kind, normal, tangent, along, across, *_):
    """Microfacet closure. A zero tangent means isotropic."""
    if not np.any(tangent):
        tangent = np.moveaxis(np.eye(3)[np.argmin(np.abs(normal), axis=0)], -1, 0)
    of_kind = {"ggx": _closures.ggx, "beckmann": _closures.beckmann}[kind]
    return of_kind(NUMPY, *wi, *wo, *normal, *tangent, along, across)


#: Closures: f cos(theta_i) by directions and arguments, each with the components first.
_CLOSURES = {
    "diffuse": lambda wi, wo, n: _closures.diffuse(NUMPY, *wi, *wo, *n),
    "diffuse_ramp": lambda wi, wo, n, ramp: _closures.diffuse_ramp(NUMPY, *wi, *wo, *n, *ramp),
    "phong_ramp": lambda wi, wo, n, e, ramp: _closures.phong_ramp(NUMPY, *wi, *wo, *n, e, *ramp),
    "glossy_toon": lambda wi, wo, n, size, smooth: _closures.glossy_toon(
        NUMPY, *wi, *wo, *n, size, smooth
    ),
    "microfacet": facets,
    # Ideal mirror reflection is evaluated by ideal().
    "reflection": lambda wi, wo, n: 0.0,
}


def _of_views(value, views):
    """Selects some of the views from a closure's argument."""
    if isinstance(value, list | tuple):
        return [_of_views(x, views) for x in value]
    several = isinstance(value, np.ndarray) and value.ndim > 1 and value.shape[-2] > 1
    return value[..., views, :] if several else value


class Lobes:
    """The light scattered to some viewers, as a weighted sum of closures. What depends on the view
    alone is computed once for all light directions."""

    __array_ufunc__ = None  # makes NumPy leave weight * Lobes to this class

    def __init__(self, wo, terms):
        self._wo, self._terms = wo, terms

    @classmethod
    def of(cls, wo, name, *given):
        """Lobes of a single closure, for viewers (3, k, 1)."""
        return cls(wo, [(1.0, name, given)])

    def __add__(self, other):
        return Lobes(self._wo, self._terms + other._terms)

    def __rmul__(self, weight):
        return Lobes(self._wo, [(weight * w, name, given) for w, name, given in self._terms])

    def _sum(self, views, shape, values):
        try:
            weights = (_of_views(weight, views) for weight, *_ in self._terms)
            light = sum(w * x for w, x in zip(weights, values, strict=True))
            light = np.moveaxis(np.broadcast_to(light, (3, *shape)), 0, -1)
        except FAILURES as error:
            raise Unreadable(str(error)) from error
        if not np.isfinite(light).all():
            raise Unreadable("expected numbers, got infinite ones or none")
        return light

    def scattered(self, wi, views=slice(None)):
        """f cos(theta_i), (k, n, 3), without ideal mirror reflection, for light directions (k, n,
        3), unit vectors above the surface, and the selected viewers."""
        wi, wo = np.moveaxis(wi, -1, 0), self._wo[:, views]
        values = (_CLOSURES[n](wi, wo, *_of_views(given, views)) for _, n, given in self._terms)
        return self._sum(views, np.broadcast_shapes(wi.shape, wo.shape)[1:], values)

    def ideal(self, views=slice(None)):
        """Weight of ideal mirror reflection, (k, 3)."""
        values = (float(name == "reflection") for _, name, _ in self._terms)
        return self._sum(views, self._wo[0, views].shape, values)[:, 0]


def lobes(text, values, wo):
    """Lobes of a shader for viewers (k, 3), unit vectors above the surface. `values`: numbers and
    colours of its parameters. This function and the Lobes it returns raise Unreadable."""
    try:
        arrays, steps = _program(text)
        wo = np.transpose(wo)[:, :, None]
        v = {n: np.reshape(x, (3, 1, 1)) if np.ndim(x) else x for n, x in values.items()}
        v |= {name: list(x) if isinstance(x, list) else x for name, x in arrays.items()}
        v |= dict(zip(_FRAME, (*np.eye(3)[[2, 0, 1], :, None, None], *wo), strict=True), I=wo)
        v |= {name + "(": f for name, f in _FUNCTIONS.items()}
        v |= {name + "(": functools.partial(Lobes.of, wo, name) for name in _CLOSURES}
        for step in steps:
            step(v)
    except FAILURES as error:
        raise Unreadable(str(error)) from error
    if not isinstance(v["BSDF"], Lobes):
        raise Unreadable("expected BSDF to be a sum of closures")
    return v["BSDF"]
