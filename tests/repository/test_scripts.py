# SPDX-License-Identifier: GPL-3.0-or-later
"""Decisions of the scripts for the report and for the page of conditions that need no Blender."""

from importlib import import_module as script

import pytest

MODELS = {
    "plain": {"auto": "exact", "representations": {"exact": {}, "sampled": {}}},
    "rich": {"auto": "aimed", "representations": {"aimed": {}, "sampled": {}}},
    "clear": {"auto": "exact", "representations": {"exact": {}}},
}


@pytest.mark.parametrize(
    ("used", "expected"),
    [
        (["plain"], ["glossy", "exact", "sampled"]),
        (["rich"], ["glossy", "aimed", "sampled"]),
        (["plain", "rich"], ["glossy", "auto", "sampled"]),
        (["clear", "plain"], ["glossy", "exact"]),
    ],
)
def test_a_scene_is_rendered_in_the_forms_that_people_get(used, expected):
    scene = {"materials": {name: {"model": name} for name in used}}
    made = script("demo_matrix").forms_of(scene, MODELS, {})
    assert [form.name for form in made] == [form.representation for form in made] == expected


def row(form, condition, bias, biased=False, warned=()):
    return {
        "form": form,
        "condition": condition,
        "bias": bias,
        "error": 0.001,
        "biased": biased,
        "code": "clamp",
        "warned": list(warned),
    }


def test_the_page_keeps_what_was_not_measured():
    table = script("conditions_table")
    first = {"4.5": [row("a (exact)", "clamp", 0.0), row("Glossy (node)", "clamp", -0.1, True)]}
    page = table.markdown(first)
    second = {"5.0": [row("b (aimed)", "clamp", -0.2, True, ["clamp_indirect"])]}
    merged = table.markdown(second, page)
    assert [line for line in merged.splitlines() if line.startswith("## ")] == [
        "## a (exact)",
        "## b (aimed)",
        "## Glossy (node)",
    ]
    assert "| clamp | **-20.0% ± 0.1%** (panel warns) |" in merged
    kept = table.sections_of(page)
    assert kept == {k: v for k, v in table.sections_of(merged).items() if k in kept}
    # When a form is measured again, its rows are replaced.
    again = table.markdown({"4.5": [row("a (exact)", "clamp", 0.5, True)]}, merged)
    assert table.sections_of(again)["a (exact)"].endswith("| clamp | **+50.0% ± 0.1%** |")
    assert "b (aimed)" in table.sections_of(again)
