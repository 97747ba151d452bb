# SPDX-License-Identifier: GPL-3.0-or-later
"""The shader of a fitted form, executed on NumPy arrays: what its closures add up to. No bpy here.

Of Open Shading Language it knows what such a shader is made of: tables, assignments of expressions,
loops over a ramp, and closures. What those scatter are the generator's own formulas. The text may
come from anybody's file: it can name nothing but its variables and the functions listed here.
"""

import functools
import operator
import re

import numpy as np

from .brdfc import _closures
from .brdfc._formula import rgb


class Unreadable(ValueError):
    """A text that is none of these shaders."""


#: What goes wrong in one.
FAILURES = (
    *(ArithmeticError, AttributeError, LookupError),
    *(RecursionError, TypeError, ValueError),
)

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|(?P<name>[A-Za-z_]\w*)"
    r'|(?P<text>"\w*")|(?P<sign>[-+*/<?:(),\[\]]))'
)
#: Operators of two sides, those that bind least first.
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
#: What is known before the first statement: the shader's own frame about the normal.
_FRAME = ("frame_n", "frame_t", "frame_b", "wo_x", "wo_y", "wo_z")


class _Parser:
    """Of expressions: functions of the variables, by name."""

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
        return lambda v: second(v) if first(v) else third(v)

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
            # Variables and functions have names of their own, as in the shader.
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
    """A function that does what a statement says to the variables."""
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
    """Tables and other arrays by name, and steps up to that which assigns BSDF."""
    body = text[text.find("\nshader ") :].partition("\n{\n")[2]
    body, assigned, sum_of_closures = body.partition("BSDF = ")
    if not assigned:
        raise Unreadable("expected a shader that assigns BSDF")
    body = re.sub(r"//[^\n]*", "", body + assigned + sum_of_closures.partition(";")[0] + ";")
    arrays = {name: np.fromstring(numbers, sep=",") for name, numbers in _TABLE.findall(body)}
    body = _TABLE.sub("", body)
    steps = []
    # Parameters within their ranges stand in a block, which ends behind that.
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
    """brdfc_table1 and its like: linear along each axis, positions run to its size less 1."""
    count = len(sizes_and_positions) // 2
    sizes, positions = sizes_and_positions[:count], sizes_and_positions[count:]
    values = values.reshape([int(n) for n in sizes])
    for size, position in zip(sizes, positions, strict=True):
        i = int(min(position, size - 2))
        values = values[i] + (values[i + 1] - values[i]) * (position - i)
    return values


def _three(x, y=None, z=None):
    return x, x if y is None else y, x if z is None else z


_FUNCTIONS = {
    "atan": np.arctan,
    "backfacing": lambda: False,
    "brdfc_max_component": np.max,
    "brdfc_table1": _table,
    "brdfc_table2": _table,
    "brdfc_table3": _table,
    "clamp": lambda x, low, high: np.minimum(np.maximum(x, low), high),
    "color": lambda *c: rgb(*_three(*c)),
    "cos": np.cos,
    "exp": np.exp,
    "log": np.log,
    "max": np.maximum,
    "min": np.minimum,
    "normalize": lambda v: v / np.linalg.norm(v),
    "sin": np.sin,
    "sqrt": np.sqrt,
    "vector": lambda *c: np.array(_three(*c)),
}


def facets(kind, normal, tangent, along, across, wi, wo):
    """f cos(theta_i) of facets, (N,), for wi (N, 3) and wo (3,); those without a tangent, which is
    0, are round."""
    if not np.any(tangent):
        tangent = np.eye(3)[np.argmin(np.abs(normal))]
    of_kind = {"ggx": _closures.ggx, "beckmann": _closures.beckmann}[kind]
    return of_kind(*wi.T, *wo, *normal, *tangent, along, across)


def matte(normal, wi, wo):
    """The same of a matte surface."""
    return _closures.diffuse(*wi.T, *wo, *normal)


def _closures_of(wi, wo):
    """Closures as functions, of f cos (3, N) or (N,)."""
    both = (*wi.T, *wo)
    return {
        "diffuse_ramp": lambda n, ramp: _closures.diffuse_ramp(*both, *n, *ramp),
        "phong_ramp": lambda n, e, ramp: _closures.phong_ramp(*both, *n, e, *ramp),
        "microfacet": lambda kind, n, t, x, y, *_: facets(kind, n, t, x, y, wi, wo),
        # An ideal mirror is drawn by itself.
        "reflection": lambda n: 0.0,
    }


def scattered(text, values, wi, wo):
    """f cos(theta_i) of a shader, (N, 3), without an ideal mirror's part. `values`: numbers and
    colours of its parameters; wi: (N, 3), wo: (3,), unit vectors above the surface.

    Raises Unreadable.
    """
    try:
        arrays, steps = _program(text)
        v = {name: np.reshape(x, (3, 1)) if np.ndim(x) else x for name, x in values.items()}
        v |= {name: list(x) if isinstance(x, list) else x for name, x in arrays.items()}
        v |= dict(zip(_FRAME, (*np.eye(3)[[2, 0, 1]], *wo), strict=True), I=wo)
        v |= {name + "(": f for name, f in (_FUNCTIONS | _closures_of(wi, wo)).items()}
        for step in steps:
            step(v)
        return np.broadcast_to(v["BSDF"], (3, len(wi))).T
    except FAILURES as error:
        raise Unreadable(str(error)) from error
