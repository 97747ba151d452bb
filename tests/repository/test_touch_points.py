# SPDX-License-Identifier: GPL-3.0-or-later
"""A new model is one file, one row of cases and one row of docs; all else that names every model is
made by a script or a build."""

import re
import subprocess

import pytest
from support import LISTED, MODELS, ROOT

#: Models that are delta terms alone have no fit and no noise to measure.
SCATTERING = [m["name"] for m in LISTED if m["scatter"]]
#: Files with a row for each, and how a row begins.
BY_HAND = {"tests/models/cases.csv": "{},", "docs/models.md": "| `{}` |"}
#: Values of arbitrary precision, of the paper's formula typed a second time: who adds a model may.
A_SECOND_TIME = {"tests/models/make_golden.py", "tests/models/golden.csv"}
#: A picture of the models that there were, and materials made of them: a new one is welcome there,
#: and in the library it is anyway, with its defaults.
PICTURE = {"scenes/as-fig8.json", "blender_addon/library/materials.json"}
#: Made by scripts.
GENERATED = {
    "docs/tables/properties.md": "| `{}` |",
    "docs/tables/forms.md": "| `{}` |",
    "blender_addon/costs.csv": "{},",
    "docs/explain.md": "{}",
}
GENERATED_OF_SCATTERING = {
    "docs/tables/fits.md": "| `{}` |",
    "docs/tables/twins.md": "| `{}` |",
    "docs/noise.md": "| `{}` |",
    "docs/noise.csv": "{},",
    "docs/noise-cost.csv": "{},",
}
#: A file that names as large a part of all models is a list of them.
MOST = 0.8


def rows_missing(file, start, names):
    lines = (ROOT / file).read_text(encoding="utf-8")
    return [n for n in names if not re.search(f"(?m)^{re.escape(start.format(n))}", lines)]


def test_a_model_is_a_file():
    files = [p.stem for p in (ROOT / "generator" / "models").glob("*.cpp")]
    assert sorted(files) == sorted(MODELS)


@pytest.mark.parametrize("room", ["forms", "plan", "pack"])
def test_no_form_is_asked_for_by_name(room):
    """What differs between forms is asked of them: a new one has nothing else to change."""
    sources = [p for p in (ROOT / "generator" / room).iterdir() if p.suffix in (".cpp", ".h")]
    assert sources
    named = [p.name for p in sources if re.search(r'\bform\("', p.read_text(encoding="utf-8"))]
    assert not named


@pytest.mark.parametrize("file", BY_HAND)
def test_every_model_has_its_row(file):
    assert not rows_missing(file, BY_HAND[file], MODELS)


@pytest.mark.parametrize("file", [f for f in GENERATED if f != "docs/explain.md"])
def test_every_model_is_in_what_scripts_make(file):
    assert not rows_missing(file, GENERATED[file], MODELS), "run the script that the page names"


@pytest.mark.parametrize("file", GENERATED_OF_SCATTERING)
def test_every_model_that_scatters_is_in_what_scripts_make(file):
    missing = rows_missing(file, GENERATED_OF_SCATTERING[file], SCATTERING)
    assert not missing, "run the script that the page names"


def test_every_model_has_its_page():
    pages = {p.stem for p in (ROOT / "docs" / "gallery" / "models").glob("*.md")} - {"overview"}
    assert pages == set(MODELS), "run script/gallery models"


def test_no_other_file_is_a_list_of_models():
    known = {*BY_HAND, *A_SECOND_TIME, *PICTURE, *GENERATED, *GENERATED_OF_SCATTERING}
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    found = {}
    for name in listed.stdout.splitlines():
        file = ROOT / name
        if file.suffix in (".exr", ".jpg", ".png") or not file.is_file():
            continue
        if name.startswith("docs/gallery/"):  # made of what scenes say of themselves
            continue
        words = set(re.findall(r"\w+", file.read_text(encoding="utf-8", errors="ignore")))
        if name not in known and len(words & set(MODELS)) >= MOST * len(MODELS):
            found[name] = sorted(words & set(MODELS))
    assert not found, "a new model would have to be added to these files by hand"
