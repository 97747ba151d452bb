# SPDX-License-Identifier: GPL-3.0-or-later
"""A new kind of lamp needs one file and an entry in a list, as docs/add-a-lamp.md says."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ADDON = ROOT / "blender_addon"
KINDS = ADDON / "lamps" / "kinds"
PAGE = (ROOT / "docs" / "add-a-lamp.md").read_text(encoding="utf-8")


def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def assigned(node):
    """The names that the statements of a class or module assign, with their values."""
    found = [s for s in node.body if isinstance(s, ast.Assign)]
    return {target.id: s.value for s in found for target in s.targets}


def strings(tree):
    found = [n.value for n in ast.walk(tree) if isinstance(n, ast.Constant)]
    return {value for value in found if isinstance(value, str)}


CLASSES = {
    node.name: node
    for path in KINDS.glob("*.py")
    for node in parsed(path).body
    if isinstance(node, ast.ClassDef)
}
#: The classes that read something, and the strings that say what.
READ = {
    name: set().union(*(strings(v) for k, v in assigned(node).items() if k in ("objects", "nodes")))
    for name, node in CLASSES.items()
    if node.bases and {"objects", "nodes"} & set(assigned(node))
}


def test_every_kind_is_listed_once():
    listed = [entry.func.id for entry in assigned(parsed(KINDS / "__init__.py"))["KINDS"].elts]
    assert sorted(listed) == sorted(READ) and len(listed) >= 7


def test_no_kind_is_asked_for_by_name():
    """Differences between kinds are methods of the kinds, so a new one requires no other
    changes."""
    read = set().union(*READ.values())
    assert {"SUN", "ShaderNodeTexSky"} <= read
    others = [path for room in ("lamps", "warnings") for path in (ADDON / room).glob("*.py")]
    named = {path.name: found for path in others if (found := read & strings(parsed(path)))}
    assert len(others) > 15 and not named


def test_the_page_shows_a_kind_as_it_is():
    ((path, text),) = re.findall(r"<!-- example: (\S+) -->\n```python\n(.*?)```\n", PAGE, re.S)
    assert text == (ROOT / path).read_text(encoding="utf-8")


def test_the_page_names_all_that_a_kind_answers():
    base, light = CLASSES["Kind"], CLASSES["Light"]
    text = (KINDS / "light.py").read_text(encoding="utf-8").splitlines()
    (end,) = (i for i, line in enumerate(text) if "# ---- what follows" in line)
    members = {name for node in (base, light) for name in assigned(node)}
    functions = base.body + [s for s in light.body if s.lineno < end]
    members |= {s.name for s in functions if isinstance(s, ast.FunctionDef)}
    assert members == set(re.findall(r"`(\w+)`", "".join(re.findall(r"(?m)^\|.*", PAGE))))
