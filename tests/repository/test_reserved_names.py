# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameter names that models may not use, because Python functions that take parameters by name
have arguments with these names: generator/print/reserved.cpp must list them all."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = [
    ROOT / path
    for path in ("python/brdfc/_model.py", "python/brdfc/_arrays.py", "blender_addon/api.py")
]


def test_arguments_beside_parameters_are_reserved():
    listed = re.search(
        r"python_arguments\(\) \{.*?\{(.*?)\}",
        (ROOT / "generator/print/reserved.cpp").read_text(encoding="utf-8"),
        re.S,
    )
    found = set()
    for source in SOURCES:
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.args.kwarg is not None:
                arguments = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
                found |= {a.arg for a in arguments}
    assert found == set(re.findall(r'"(\w+)"', listed[1]))
