# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the conditions in conditions.py: settings and scenes as users have them.

If a condition biases a form, the panel must say so. With BRDFC_CONDITIONS=all, every condition is
measured, and the rows go to conditions/<version>.json beside the tool, from which
evidence/conditions makes its table; otherwise only a few. BRDFC_CONDITIONS_FORM=aimed measures
only that form; Formula Nodes are measured only if it is `nodes`.
"""

import json
import os
from pathlib import Path

import bpy
import conditions
import pytest

VERSION = ".".join(map(str, bpy.app.version[:2]))
ALL = os.environ.get("BRDFC_CONDITIONS") == "all"
ONLY = os.environ.get("BRDFC_CONDITIONS_FORM") or None

pytestmark = pytest.mark.full


@pytest.fixture(scope="module")
def forms(extension, tool):
    every = conditions.representatives(
        extension, json.loads(tool("list", "--json")), nodes=ONLY == "nodes"
    )
    every = [f for f in every if ONLY in (None, f.form)]
    assert every, f"BRDFC_CONDITIONS_FORM: there is no form {ONLY}"
    return every


@pytest.fixture(scope="module")
def rows(extension, tool, forms):
    names = None if ALL else [c.name for c in conditions.CONDITIONS if c.quick]
    every = [*forms, *([] if ONLY else conditions.NATIVE)]
    found = conditions.measure(extension, every, names, samples=4096 if ALL else 512)
    found += conditions.passes(extension, tool, every)
    found += conditions.normals(extension, tool, forms)
    if ALL:
        folder = Path(os.environ["BRDFC_TOOL"]).resolve().parent / "conditions"
        folder.mkdir(exist_ok=True)
        record = {"blender": bpy.app.version_string, "rows": found}
        (folder / f"{VERSION}.json").write_text(json.dumps(record, indent=1) + "\n")
    for r in found:
        print(
            f"{r['condition']:28} {r['form']:32} {r['bias']:+9.4f} +- {r['error']:.4f} "
            f"{'BIASED' if r['biased'] else '':6} {','.join(r['warned'])}"
        )
    return found


@pytest.mark.evidence
def test_the_panel_warns_where_a_form_is_biased(rows):
    native = {str(form) for form in conditions.NATIVE}
    silent = [
        f"{r['condition']}: {r['form']} is off by {r['bias']:+.1%} and the panel is silent"
        for r in rows
        if r["biased"] and r["form"] not in native and not conditions.is_warned(r)
    ]
    assert not silent, "\n".join(silent)


def test_the_panel_is_silent_under_clean_settings(extension, forms):
    grooves = conditions.Grooves(extension, forms)
    assert conditions.panel_warns(extension, grooves) == [set() for _ in forms]


@pytest.mark.evidence
def test_conditions_can_tell(rows):
    """A sun without a size, which random rays never hit, must appear as a bias of sampled forms:
    significantly for those with little noise elsewhere, and as a loss of light for all."""
    found = [r for r in rows if r["condition"] == "sun without size" and "sampled" in r["form"]]
    if ONLY not in (None, "sampled"):
        pytest.skip("it is of sampled forms, and others are asked for")
    assert any(r["biased"] for r in found)
    assert all(r["bias"] < -3 * r["error"] for r in found)
