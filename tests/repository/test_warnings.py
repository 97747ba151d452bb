# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings are rows of one table: each has a predicate of its own, a test in Blender, a translation
and its line in the documentation."""

import ast
import json
import re

import pytest
import warnings_page
from support import ROOT

WARNINGS = ROOT / "blender_addon" / "warnings"
ROWS = [row for part in warnings_page.rows().values() for row in part]
CODES = sorted({row["code"] for row in ROWS})
RULES = sorted(WARNINGS.glob("*_rules.py"))
LOCALES = sorted((ROOT / "blender_addon" / "translations").glob("*.json"))


def functions(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [s for s in tree.body if isinstance(s, ast.FunctionDef)]


def test_the_page_is_that_of_now():
    assert warnings_page.PAGE.read_text(encoding="utf-8") == warnings_page.page(), (
        "script/warnings_page.py"
    )


def test_every_predicate_belongs_to_one_row():
    """A predicate that no row names would never be asked."""
    predicates = {
        (path.stem, f.name) for path in RULES for f in functions(path) if f.args.args[0].arg == "at"
    }
    named = [row["predicate"] for row in ROWS]
    assert len(set(named)) == len(named)
    assert set(named) == {(m, name) for m, name in predicates if not name.startswith("_")}


def test_only_the_table_makes_findings():
    """A warning that is made elsewhere would have neither documentation nor a row."""
    made = {
        path.name
        for path in (ROOT / "blender_addon").rglob("*.py")
        if re.search(r"\bFinding\(", path.read_text(encoding="utf-8"))
    }
    assert made == {"rows.py", "checks.py"}, "rows.py, and checks.py for what twins replace"


@pytest.mark.parametrize("code", CODES)
def test_every_code_is_tested_in_blender(code):
    tests = (ROOT / "tests" / "blender").glob("test_*.py")
    assert any(f'"{code}"' in path.read_text(encoding="utf-8") for path in tests)


@pytest.mark.parametrize("code", CODES)
def test_rows_of_a_code_have_the_same_button(code):
    """The panel offers the button of a code, whichever row found it."""
    assert len({row["button"] for row in ROWS if row["code"] == code}) == 1


@pytest.mark.parametrize("locale", LOCALES, ids=lambda path: path.stem)
def test_every_sentence_and_button_is_translated(locale):
    known = json.loads(locale.read_text(encoding="utf-8"))
    shown = {row["sentence"] for row in ROWS} | {row["button"] for row in ROWS if row["button"]}
    assert not shown - known.keys()


def test_codes_of_forms_are_declared_rows():
    """The generator's codes are rows; a form may declare no other."""
    declared = {row["code"] for row in warnings_page.rows()["DECLARED"]}
    found = set()
    for path in (ROOT / "generator" / "forms").glob("*.cpp"):
        text = path.read_text(encoding="utf-8")
        for body in re.findall(r" warnings\w*\(const Model.*?\n  ?}", text, re.S):
            found |= set(re.findall(r'"(\w+)"', body))
    assert found and found <= declared
