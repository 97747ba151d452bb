# SPDX-License-Identifier: GPL-3.0-or-later
"""Every catalogue contains exactly the texts of the extension; and every text that is shown to
users can be translated."""

import itertools
import json
import re
import subprocess

import pytest
import texts
from support import TOOL

FOLDER = texts.ADDON / "translations"
LOCALES = sorted(path.stem for path in FOLDER.glob("*.json"))
#: The form made of Blender's own nodes that packs contain only on request.
ASKED_FOR = {"twin"}


@pytest.fixture(scope="module")
def english():
    models = json.loads(subprocess.run([TOOL, "list", "--json"], capture_output=True).stdout)
    return texts.texts({f for m in models for f in m["representations"]} | ASKED_FOR)


def catalogue(locale):
    return json.loads((FOLDER / f"{locale}.json").read_text(encoding="utf-8"))


def test_the_first_languages_are_there():
    assert {"de_DE", "ja_JP"} <= set(LOCALES)


def test_texts_are_found_where_they_stand(english):
    for text in ("Turn On OSL", "{engine} can't run these shaders", "Fitted", "Use Cycles"):
        assert text in english


@pytest.mark.parametrize("locale", LOCALES)
def test_nothing_is_missing_or_stale(locale, english):
    known = catalogue(locale)
    missing = {text: english[text] for text in english.keys() - known.keys()}
    assert not missing, f"{locale}.json lacks these texts"
    assert not known.keys() - english.keys(), f"{locale}.json has texts that nothing says"


@pytest.mark.parametrize("locale", LOCALES)
def test_a_translation_fits_its_text(locale):
    for text, translation in catalogue(locale).items():
        assert translation.strip(), text
        assert texts.placeholders(text) == texts.placeholders(translation), text
        indent = len(text) - len(text.lstrip())
        assert len(translation) - len(translation.lstrip()) == indent, text


@pytest.mark.parametrize("locale", LOCALES)
def test_a_catalogue_is_sorted(locale):
    texts_in_order = list(catalogue(locale))
    misplaced = [b for a, b in itertools.pairwise(texts_in_order) if b < a]
    assert not misplaced, f"{locale}.json is sorted by the English text; move {misplaced}"


def test_nothing_is_shown_that_is_not_looked_up():
    assert not texts.unsaid()


def test_no_text_has_the_terms_of_the_code(english):
    for text, place in english.items():
        assert "representation" not in text.lower() and "L1" not in text, place


def test_no_text_has_words_of_this_project_alone(english):
    """Users who have not read the documentation would not understand them; names of render methods
    are explained in tooltips."""
    known = re.compile(r"\{\w+(!r)?\}|\b(Aimed|Sampled|Fitted|Exact)\b")
    unknown = re.compile(r"\b(forms?|twins?|aim(s|ed|ing)?|drawn|misplac\w*)\b|% off|off by", re.I)
    found = {text: place for text, place in english.items() if unknown.search(known.sub("", text))}
    assert not found


@pytest.mark.parametrize(
    ("source", "finding"),
    [
        ('report({"INFO"}, f"{n} nodes")', "report"),
        ('report({"ERROR"}, str(error))', "report"),
        ('layout.label(text=f"{n} nodes")', "label"),
        ('Finding("code", "ERROR", "bare")', "Finding"),
        ("say(text)", "expected a literal"),
        ('Row("code", "ERROR", text, predicate)', "expected a literal"),
        ('class A(Operator):\n    """Text"""\n    bl_label = "A"', "bl_description"),
    ],
)
def test_what_is_not_looked_up_is_found(tmp_path, monkeypatch, source, finding):
    (tmp_path / "module.py").write_text(source, encoding="utf-8")
    monkeypatch.setattr(texts, "ADDON", tmp_path)
    monkeypatch.setattr(texts, "ROOT", tmp_path)
    (found,) = texts.unsaid()
    assert finding in found
