# SPDX-License-Identifier: GPL-3.0-or-later
"""The lists in docs/add-a-model.md agree with the sources: functions that formulas may call,
replacements for others, headers that models share, and closures for bases."""

import math
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
GENERATOR = ROOT / "generator"
PAGE = (ROOT / "docs" / "add-a-model.md").read_text(encoding="utf-8")
#: Functions for tests and tables in double precision, which formulas don't need.
NOT_FOR_FORMULAS = {"direction"}


def part(name):
    """The text between the comments with this name."""
    (found,) = re.findall(rf"<!-- {name} -->\n(.*?)<!-- end of {name} -->", PAGE, re.S)
    return found


def rows(name):
    """The cells of a table's rows."""
    lines = part(name).replace(r"\|", "¦").splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def source(path):
    return (GENERATOR / path).read_text(encoding="utf-8")


def functions_of(*paths):
    """Names of the functions that headers define for all scalar types."""
    found = set()
    for path in paths:
        text = source(path)
        found |= set(re.findall(r"^using std::(\w+);", text, re.M))
        # A template at the start of a line; its parameter list may end on another line.
        found |= set(re.findall(r"^template <[^\n]*?>[\s]+[\w:<>, &]*?[ &](\w+)\(", text, re.M))
    return {name for name in found if not name.startswith("operator")}


def test_the_functions_are_those_of_the_sources():
    listed = {
        name
        for _, cell in rows("functions")
        for name in re.findall(r"`(\w+)(?:<T>)?(?:\([^`]*\))?`", cell)
    }
    there = functions_of("core/scalar.h", "core/vec.h") - NOT_FOR_FORMULAS
    assert {"abs", "atan", "select", "clamp01", "dot", "luminance", "iterate"} <= there
    assert listed == there


def python(expression):
    """Converts a formula's expression to Python."""
    plain = expression.replace("tiny<T>()", "1e-30")
    return re.sub(r"\bT\(([^()]*)\)", r"(\1)", plain)


def stable_sinh(x):
    half = math.expm1(x) / 2
    return half + half / (2 * half + 1)


WORDS = {
    **{name: getattr(math, name) for name in ("sqrt", "exp", "expm1", "log", "pow", "sin", "cos")},
    "atan": math.atan,
    "maximum": max,
    "minimum": min,
    "stable_sinh": stable_sinh,
    "select": lambda condition, a, b: a if condition else b,
}
MEANT = {
    **{n: getattr(math, n) for n in ("acos", "asin", "atan2", "tan", "sinh", "cosh", "tanh")},
    "exp2": lambda x: 2**x,
    "log10": math.log10,
    "hypot": math.hypot,
    "sign": lambda x: math.copysign(1, x),
    "clamp": lambda x, a, b: min(max(x, a), b),
    "mix": lambda a, b, t: a * (1 - t) + b * t,
}
POINTS = {
    "acos": [(-1.0,), (-0.3,), (0.0,), (0.9,), (1.0,)],
    "asin": [(-1.0,), (-0.3,), (0.0,), (0.9,), (1.0,)],
    "atan2": [(0.0, 2.0), (0.5, -0.7), (-0.5, -0.7), (-3.0, 0.1)],
    "log10": [(0.01,), (5.0,)],
    "hypot": [(3.0, -4.0)],
    "clamp": [(-1.0, 0.0, 2.0), (1.0, 0.0, 2.0), (3.0, 0.0, 2.0)],
    "mix": [(1.0, 3.0, 0.25)],
}


@pytest.mark.parametrize("row", rows("instead"), ids=lambda row: row[0])
def test_what_to_write_instead_is_the_same(row):
    name, arguments = re.fullmatch(r"`(\w+)\((.*)\)`", row[0]).groups()
    names = arguments.split(", ")
    text = row[1].strip("`")
    called = set(re.findall(r"\b([a-z]\w*)\(", text))
    known = functions_of("core/scalar.h", "core/vec.h", "model/sampling.h")
    assert called <= known, "an expression of what is there"
    for point in POINTS.get(name, [(-0.8,), (0.3,), (1.2,)]):
        values = dict(zip(names, point, strict=True))
        got = eval(python(text), {"__builtins__": {}}, WORDS | values)
        assert got == pytest.approx(MEANT[name](*point), rel=1e-12, abs=1e-12), point


def test_every_header_that_models_share_is_listed():
    listed = {row[0].strip("`"): row[1] for row in rows("shared")}
    included = {
        header
        for path in sorted((GENERATOR / "models").glob("*.cpp"))
        for header in re.findall(r'#include "((?:model|tables)/\w+\.h)"', path.read_text("utf-8"))
    }
    assert included - {"model/model.h"} == listed.keys()
    for header, said in listed.items():
        text = source(header)
        for name in re.findall(r"`(\w+)`", said):
            assert re.search(rf"\b{name}\b", text), f"{header} has no {name}"


def test_the_closures_of_bases_are_those_of_the_sources():
    (kinds,) = re.findall(
        r"enum class ClosureKind \{(.*?)\n\};", source("closures/closure.h"), re.S
    )
    there = set(re.findall(r"^  (\w+),", kinds, re.M)) - {"Reflection", "Refraction"}
    listed = {name for row in rows("closures") for name in re.findall(r"`(\w+)`", row[0])}
    assert listed == there
    fields = source("closures/closure.h").split("struct Closure {")[1].split("};")[0]
    for row in rows("closures"):
        for name in re.findall(r"`(\w+)`", row[2]):
            assert re.search(rf"\b{name}\b", fields), f"{row[0]} takes no {name}"
