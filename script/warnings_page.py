#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes docs/tables/warnings.md from the table of warnings and from what its predicates say."""

import ast
import re
from functools import cache
from pathlib import Path

from markdown_table import heading, line

ROOT = Path(__file__).resolve().parent.parent
ADDON = ROOT / "blender_addon"
PAGE = ROOT / "docs/tables/warnings.md"
#: The parts of the table, and what they are about.
PARTS = {
    "OF_SCENE": "The scene",
    "OF_NODE": "A model in a material",
    "DECLARED": "A model in a material, with some render methods only",
    "OF_MATERIAL": "The material",
}


@cache
def module(name):
    (path,) = ADDON.rglob(f"{name}.py")
    return ast.parse(path.read_text(encoding="utf-8"))


def assigned(name, key):
    """What a module assigns to a name, as a syntax tree."""
    (value,) = (
        s.value for s in module(name).body if isinstance(s, ast.Assign) and s.targets[0].id == key
    )
    return value


def text(node):
    """A literal, or the sentence that an attribute of a module is: the argument of say()."""
    if isinstance(node, ast.Attribute):
        node = assigned(node.value.id, node.attr).args[0]
    return ast.literal_eval(node)


def predicate(node):
    """The function that an attribute of a module names."""
    (found,) = (
        s
        for s in module(node.value.id).body
        if isinstance(s, ast.FunctionDef) and s.name == node.attr
    )
    return found


def row(call):
    names = ("code", "severity", "sentence", "predicate", "button")
    given = dict(zip(names, call.args, strict=False)) | {k.arg: k.value for k in call.keywords}
    button = given.get("button")
    return {
        "code": text(given["code"]),
        "severity": given["severity"].id,
        "sentence": text(given["sentence"]),
        "predicate": (given["predicate"].value.id, given["predicate"].attr),
        "when": " ".join(ast.get_docstring(predicate(given["predicate"])).split()),
        "button": text(assigned("table", button.id).args[1].args[0]) if button else "",
    }


def rows():
    """The rows of the table by part: code, severity, sentence, predicate as (module, function),
    when it appears, and the text of its button."""
    return {part: [row(call) for call in assigned("table", part).elts] for part in PARTS}


def page():
    lines = [
        "# Warnings",
        "",
        "Made by `script/warnings_page.py` from `blender_addon/warnings/table.py` and its",
        "predicates. [The panel](../blender.md#the-panel) shows these sentences, and",
        "[scripts](../blender.md#from-a-script) get them with their codes. An *error* makes the",
        "picture wrong; a *warning* is about noise, time, or light that may be missing.",
    ]
    for part, found in rows().items():
        lines += ["", f"## {PARTS[part]}", ""]
        lines += heading("Code", "Severity", "Sentence", "Appears when", "Button")
        for one in found:
            severity, when = one["severity"].lower(), one["when"].replace("|", "\\|")
            button = f"*{one['button']}*" if one["button"] else ""
            said = re.sub(r"\{(\w+)\}", r"*\1*", one["sentence"])
            lines.append(line(f"`{one['code']}`", severity, said, when, button))
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
