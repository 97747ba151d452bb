# SPDX-License-Identifier: GPL-3.0-or-later
"""A new model needs one file, one row of test cases and one row in the docs; everything else that
lists models is made by a script or the build."""

import json
import re
import subprocess

import pytest
from support import LISTED, MODELS, ROOT

#: Models with only delta terms have no fit, and no noise to measure.
SCATTERING = [m["name"] for m in LISTED if m["scatter"]]
#: Models that let light through with all of their choices have no fit either.
FITTED = [m["name"] for m in LISTED if "twin" in m["representations"]]
#: Files with a row for each model, and how a row begins.
BY_HAND = {"tests/models/cases.csv": "{},", "docs/models.md": "| `{}` |"}
#: Values of arbitrary precision, from a second implementation of the paper's formula: optional for
#: a new model.
A_SECOND_TIME = {"tests/models/make_golden.py", "tests/models/golden.csv"}
#: A picture of the models that existed then, and materials made from models: optional for a new
#: one, which is in the library with its defaults anyway.
PICTURE = {"scenes/as-fig8.json", "blender_addon/library/materials.json"}
#: Made by scripts, which docs/add-a-model.md lists under "To contribute it".
GENERATED = {
    "docs/tables/properties.md": "| `{}` |",
    "docs/tables/forms.md": "| `{}` |",
    "blender_addon/costs.csv": "{},",
    "docs/explain.md": "{}",
}
GENERATED_OF_FITTED = {"docs/tables/fits.md": "| `{}` |", "docs/tables/twins.md": "| `{}` |"}
GENERATED_OF_SCATTERING = {
    "docs/noise.md": "| `{}` |",
    "docs/noise.csv": "{},",
    "docs/noise-cost.csv": "{},",
}
SCRIPTS = "docs/add-a-model.md, 'To contribute it', lists the scripts that make this file"
#: Sentences that say how many models or materials there are.
COUNTS = {
    "README.md": ("adds new ones: {models} published models",),
    "CHANGELOG.md": ("each of {models} reflection models", "A library of {materials} materials"),
    "docs/library.md": ("The extension has {materials} ready-made materials",),
}
#: A file that names at least this fraction of all models counts as a list of models.
MOST = 0.8


def rows_missing(file, start, names):
    lines = (ROOT / file).read_text(encoding="utf-8")
    return [n for n in names if not re.search(f"(?m)^{re.escape(start.format(n))}", lines)]


@pytest.mark.parametrize("file", COUNTS)
def test_counts_are_right(file):
    library = ROOT / "blender_addon" / "library" / "materials.json"
    catalogs = json.loads(library.read_text(encoding="utf-8"))
    materials = sum(len(entries) for entries in catalogs.values())
    text = " ".join((ROOT / file).read_text(encoding="utf-8").split())
    for sentence in COUNTS[file]:
        assert sentence.format(models=len(MODELS), materials=materials) in text


def test_a_model_is_a_file():
    files = [p.stem for p in (ROOT / "generator" / "models").glob("*.cpp")]
    assert sorted(files) == sorted(MODELS)


@pytest.mark.parametrize("room", ["forms", "plan", "pack"])
def test_no_form_is_asked_for_by_name(room):
    """Differences between forms are properties of the forms, so a new form requires no other
    changes."""
    sources = [p for p in (ROOT / "generator" / room).iterdir() if p.suffix in (".cpp", ".h")]
    assert sources
    named = [p.name for p in sources if re.search(r'\bform\("', p.read_text(encoding="utf-8"))]
    assert not named


@pytest.mark.parametrize("file", BY_HAND)
def test_every_model_has_its_row(file):
    assert not rows_missing(file, BY_HAND[file], MODELS)


@pytest.mark.parametrize("file", [f for f in GENERATED if f != "docs/explain.md"])
def test_every_model_is_in_what_scripts_make(file):
    assert not rows_missing(file, GENERATED[file], MODELS), SCRIPTS


@pytest.mark.parametrize("file", GENERATED_OF_SCATTERING)
def test_every_model_that_scatters_is_in_what_scripts_make(file):
    missing = rows_missing(file, GENERATED_OF_SCATTERING[file], SCATTERING)
    assert not missing, SCRIPTS


@pytest.mark.parametrize("file", GENERATED_OF_FITTED)
def test_every_model_with_a_fit_is_in_what_scripts_make(file):
    assert not rows_missing(file, GENERATED_OF_FITTED[file], FITTED), SCRIPTS


def test_every_model_has_its_page():
    folder = ROOT / "docs" / "gallery" / "models"
    pages = {p.stem for p in folder.glob("*.md")} - {"overview"}
    assert pages == set(MODELS), "run script/gallery models"
    pictures = {p.stem.removesuffix("-picture") for p in folder.glob("*-picture.jpg")}
    assert pictures == set(MODELS), "run script/gallery pictures"


def test_no_other_file_is_a_list_of_models():
    known = {
        *BY_HAND,
        *A_SECOND_TIME,
        *PICTURE,
        *GENERATED,
        *GENERATED_OF_FITTED,
        *GENERATED_OF_SCATTERING,
    }
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    found = {}
    for name in listed.stdout.splitlines():
        file = ROOT / name
        if file.suffix in (".exr", ".jpg", ".png") or not file.is_file():
            continue
        if name.startswith("docs/gallery/"):  # generated from what scenes state
            continue
        words = set(re.findall(r"\w+", file.read_text(encoding="utf-8", errors="ignore")))
        if name not in known and len(words & set(MODELS)) >= MOST * len(MODELS):
            found[name] = sorted(words & set(MODELS))
    assert not found, "a new model would have to be added to these files by hand"
