# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds, in the sources, every text of the extension that is translated, and every place that would
show a text that is not."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ADDON = ROOT / "blender_addon"
#: Functions one of whose arguments is a text, and its position; and keywords that are texts.
SAYING = {"say": 0, "button": 0, "Row": 2}
SHOWN = {"label": {"text"}, "operator": {"text"}, "menu": {"text"}}
OF_PROPERTIES = {"name", "description"}
OF_CLASSES = {"bl_label", "bl_description"}
#: Calls that show the argument at this position to users: it must come from one of the above.
MUST_BE_SAID = {"Finding": 2, "Refused": 0, "report": 1} | dict.fromkeys(
    ("CompileError", "MeasuredError", "PlanError", "failure"), 0
)
#: Names, which are the same in all languages.
NAMES = {"brdfc", "Text", ""}


def _name(call):
    function = call.func
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def _literal(node):
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def _of_call(call):
    name, keywords = _name(call), {k.arg: k.value for k in call.keywords}
    if name in SAYING and call.args:
        yield call.args[SAYING[name]]
    for key in SHOWN.get(name, ()):
        if key in keywords:
            yield keywords[key]
    hidden = "options" in keywords and "HIDDEN" in ast.dump(keywords["options"])
    if name.endswith("Property") and not hidden:
        yield from (keywords[key] for key in OF_PROPERTIES & keywords.keys())


def sources():
    """[(file, tree)] of the extension's modules."""
    files = sorted(ADDON.rglob("*.py"))
    return [(p.relative_to(ROOT), ast.parse(p.read_text(encoding="utf-8"))) for p in files]


def texts(forms):
    """{text: place} of everything that is translated; `forms`: names of the models' forms, of which
    those of Blender's own nodes are displayed differently."""
    found = {form.capitalize(): "a form" for form in forms if form not in ("nodes", "twin")}
    for file, tree in sources():
        for node in ast.walk(tree):
            given = list(_of_call(node)) if isinstance(node, ast.Call) else []
            if isinstance(node, ast.ClassDef):
                given = [
                    s.value
                    for s in node.body
                    if isinstance(s, ast.Assign) and getattr(s.targets[0], "id", "") in OF_CLASSES
                ]
            for text in map(_literal, given):
                if text is not None and text not in NAMES:
                    found[text] = f"{file}:{node.lineno}"
    return found


def _is_bare(node):
    """Whether a text is one that no catalogue can contain, or that is not looked up."""
    if isinstance(node, ast.JoinedStr) or _literal(node) is not None:
        return True
    return isinstance(node, ast.Call) and _name(node) == "str"


def unsaid():
    """Places that show a text without looking it up."""
    found = []
    for file, tree in sources():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                found += [f"{file}:{node.lineno} {node.name}: {w}" for w in _of_class(node)]
            if not isinstance(node, ast.Call):
                continue
            place = MUST_BE_SAID.get(_name(node))
            shown = [node.args[place]] if place is not None and len(node.args) > place else []
            shown += [k.value for k in node.keywords if k.arg in SHOWN.get(_name(node), ())]
            if any(isinstance(n, ast.JoinedStr) or _is_bare(n) for n in shown if not _looked_up(n)):
                if _name(node) in SHOWN and not any(isinstance(n, ast.JoinedStr) for n in shown):
                    continue  # a literal that Blender looks up
                found.append(f"{file}:{node.lineno} {_name(node)}")
            said = node.args[SAYING[_name(node)]] if _name(node) in SAYING else None
            # A row of warnings may have a sentence that also stands elsewhere.
            shared = _name(node) == "Row" and isinstance(said, ast.Attribute)
            if said is not None and _literal(said) is None and not shared:
                found.append(f"{file}:{node.lineno} {_name(node)}: expected a literal")
    return found


def _looked_up(node):
    return isinstance(node, ast.Call) and _name(node) in {"rpt", "iface", "say"}


def _of_class(node):
    """A docstring used as a tooltip would contain its line breaks and indentation."""
    bases = {getattr(b, "id", getattr(b, "attr", "")) for b in node.bases}
    has = {getattr(s.targets[0], "id", "") for s in node.body if isinstance(s, ast.Assign)}
    if "Operator" not in bases:
        return
    if "bl_description" not in has and not any("ModelOperator" in b for b in bases):
        yield "expected a bl_description"


def placeholders(text):
    """The names in braces, with conversions, sorted."""
    return sorted(re.findall(r"\{([^{}]*)\}", text))
