# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that the closures of this Blender behave as the forms require; see conformance.py.

With BRDFC_EVIDENCE=all, every closure is measured, and the table goes to conformance/<version>.json
and .csv beside the tool, for the report; otherwise only a few closures are.
"""

import csv
import json
import os
import re
from pathlib import Path

import bpy
import conformance
import pytest

VERSION = ".".join(map(str, bpy.app.version[:2]))
ALL = os.environ.get("BRDFC_EVIDENCE") == "all"
CASES = conformance.CASES if ALL else conformance.CASES[::8]


@pytest.fixture(scope="module")
def rows(extension, tool):
    """The table of the closures, measured once."""
    evaluated = conformance.evaluation(extension, tool, CASES)
    found = conformance.table(evaluated, conformance.sampling(extension, tool, CASES))
    if ALL:
        keep(found)
    for row in found:
        print(
            f"{row['closure']:30} {row['verdict']:6} "
            f"evaluation {row.get('evaluation_l1', -1):8.1e} "
            f"resolution {row['sampling_resolution']:.1%} {row['fault']}"
        )
    return {row["closure"]: row for row in found}


def keep(found):
    folder = Path(os.environ["BRDFC_TOOL"]).resolve().parent / "conformance"
    folder.mkdir(exist_ok=True)
    text = json.dumps({"blender": bpy.app.version_string, "closures": found}, indent=1)
    (folder / f"{VERSION}.json").write_text(text + "\n")
    with (folder / f"{VERSION}.csv").open("w", newline="") as file:
        names = list(dict.fromkeys(name for row in found for name in row))
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(found)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda c: c.name)
def test_closure_samples_what_it_evaluates_and_evaluates_what_we_define(rows, case):
    row = rows[case.name]
    why, last = conformance.FAULTS.get(case.name, (None, (0, 0)))
    version = bpy.app.version[:2]
    if version > conformance.LOOKED_AT and why and row["verdict"] == "mended":
        pytest.xfail(f"mended in Blender {VERSION}: forms may use it from there on ({why})")
    if version > last:
        assert row["verdict"] in ("ok", "mended"), row["fault"]
        return
    assert row["verdict"] == "fault", f"a known fault was not found: {why}"
    assert "sampling" in row["fault"]


@pytest.mark.evidence
def test_the_fault_of_ashikhmin_shirley_is_large(rows):
    """The reason why no form uses the closure that would fit the model best."""
    assert rows["ashikhmin_shirley 0.4 0.4"]["sampling_share"] > 0.3


def calls(source):
    """What distinguishes closures in OSL: the function, its first argument if that is a string, and
    whether microfacets refract."""
    found = re.findall(r"\b(\w+)\((?=(\"\w+\")?((?:[^()]|\([^()]*\))*))", source)
    return [
        (function, first, function == "microfacet" and rest.rstrip().endswith("1"))
        for function, first, rest in found
    ]


@pytest.mark.evidence
def test_forms_use_only_closures_that_conform(rows, extension):
    """Every closure that the pack's shaders call has a row in the table without a fault."""
    sound = {}
    for case in conformance.CASES:
        key = calls(case.osl)[0]
        if "tilted" not in case.name:
            sound[key] = sound.get(key, True) and rows[case.name]["verdict"] != "fault"
    called = set()
    for model, entry in extension.api.models().items():
        for form in entry["representations"]:
            _, source = extension.pack.model(model).forms[form].source()
            for key in calls(source):
                if key[0] in {f for f, *_ in sound} or key[0].endswith("_bsdf"):
                    called.add((model, form, key))
    assert called
    # A portal only redirects a ray, and transparency does not even that.
    called = {c for c in called if c[2][0] not in ("ray_portal_bsdf", "transparent")}
    bad = [c for c in called if not sound.get(c[2])]
    assert not bad, f"no sound row in the conformance table: {bad}"


def test_weights_and_limits(extension, empty, subtests):
    shown = conformance.limits(extension)
    for (name, _, expected), value in zip(conformance.LIMITS, shown, strict=True):
        with subtests.test(name):
            print(f"{name}: {value:.6g}")
            assert value == pytest.approx(expected, rel=1e-5, abs=1e-9)
