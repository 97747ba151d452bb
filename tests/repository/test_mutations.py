# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the tests: each deliberate fault must be caught by a test that is named here.

Faults in generated code are made in a copy of the extension's zip, with which tests in Blender then
run. Faults in formulas are made in copies of some models' sources, which are compiled and linked
with the other objects of the unit tests. Faults that can't affect each other's tests share a copy.
"""

import json
import os
import re
import shlex
import subprocess
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

import pytest
from support import ROOT, TOOL

BLENDER_PYTHON = Path(
    os.environ.get("BRDFC_BLENDER_PYTHON", ROOT / ".env" / "blender-4.5" / "bin" / "python")
)
pytestmark = pytest.mark.evidence


def replaced_once(text, pattern, replacement, where):
    text, count = re.subn(pattern, replacement, text, count=1)
    assert count == 1, f"{where}: nothing looks like {pattern}"
    return text


# ---- generated code ---------------------------------------------------------------------------

GRADIENT = "test_sampled_form_in_a_world and gradient"
WHITE = "test_sampled_form_in_a_world and white"
SUN = "test_exact_form_under_a_sun"
ALBEDO = "test_albedo_output_panel_and_model_agree"

#: Fault: number of the copy, member of the zip, pattern, replacement, and the test that catches it,
#: given by words of its name.
PACK_FAULTS = {
    "a line of generated code": (
        1,
        "shaders/brdfc_coupled_sampled.osl",
        r"float cosTheta_i = (.*);",
        r"float cosTheta_i = 0.9 * (\1);",
        f"{GRADIENT} and coupled",
    ),
    "a distribution": (
        1,
        "shaders/brdfc_lambert_sampled.osl",
        r"u_1 = u_all\[1\],",
        "u_1 = u_all[1] * sqrt(u_all[1]),",
        f"{GRADIENT} and lambert",
    ),
    "a weight of a closure": (
        1,
        "shaders/brdfc_coupled_exact.osl",
        r"\b1\.05\b",
        "1.06",
        f"{SUN} and coupled",
    ),
    "a table of a shader": (
        1,
        "shaders/brdfc_coupled_exact.osl",
        r"(float table_0\[\d+\] = \{\s*(?:[\d.e-]+,\s*){40})[\d.e-]+",
        r"\g<1>0.3",
        f"{ALBEDO} and coupled",
    ),
    "a weight of a drawn direction": (
        2,
        "shaders/brdfc_lambert_sampled.osl",
        r"BSDF = weight \*",
        "BSDF = 0.97 * weight *",
        f"{GRADIENT} and lambert",
    ),
    "a table of the panel": (
        2,
        "manifest.json",
        r'(?s)("coupled".*?"albedo".*?"channels".*?"values": \[(?:[^,\]]*,){40})[^,\]]*',
        r"\g<1>0.3",
        f"{ALBEDO} and coupled",
    ),
}
#: A furnace test depends on weights only, so it misses these: hence the worlds with structure.
BLIND = {"a distribution": f"{WHITE} and lambert"}


def run_in_blender(zip_file, tests):
    """Runs tests, given by words of their names, with that extension. Returns for each test
    "passed", "failed" (an assertion failed in at least one case), or the text of another error."""
    report = zip_file.with_suffix(".xml")
    expression = " or ".join(f"({t})" for t in tests)
    command = [BLENDER_PYTHON, "-m", "pytest", "-q", "--show-capture=no", f"--junitxml={report}"]
    command += ["tests/blender/test_physics.py", "-k", expression]
    environment = os.environ | {
        "BRDFC_TOOL": TOOL,
        "BRDFC_EXTENSION_ZIP": str(zip_file),
        "BRDFC_ANSWERS": str(zip_file.parents[1] / "answers"),
    }
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert report.exists(), f"{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    outcomes = {}
    for case in ElementTree.parse(report).iter("testcase"):
        (test,) = (t for t in tests if all(w in case.get("name") for w in t.split(" and ")))
        failure = next((e for e in case if e.tag in ("failure", "error", "skipped")), None)
        outcome = "passed"
        if failure is not None:
            asserted = failure.tag == "failure" and re.match(
                r"assert|AssertionError", failure.get("message")
            )
            outcome = "failed" if asserted else failure.get("message")
        if outcomes.get(test, "passed") in ("passed", outcome):
            outcomes[test] = outcome
    assert set(outcomes) == set(tests), f"not every test was found: {done.stdout[-2000:]}"
    return outcomes


@pytest.fixture(scope="module")
def extension(tmp_path_factory):
    """Two models suffice, and install faster than all."""
    out = tmp_path_factory.mktemp("extension")
    command = [TOOL, "build", "--model", "coupled", "--model", "lambert", "--out", out]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (zip_file,) = out.glob("brdfc_shaders-*.zip")
    return zip_file


@pytest.fixture(scope="module")
def outcomes(extension, tmp_path_factory):
    """By number of the copy (0: without a fault): the outcome of each test that its faults name."""
    found = {}
    for copy in (0, 1, 2):
        mine = {n: f for n, f in PACK_FAULTS.items() if copy in (0, f[0])}
        tests = {f[4] for f in mine.values()} | {BLIND[n] for n in mine if n in BLIND}
        target = tmp_path_factory.mktemp(f"copy-{copy}") / extension.name
        with zipfile.ZipFile(extension) as source, zipfile.ZipFile(target, "w") as out:
            for name in source.namelist():
                text = source.read(name)
                for _, member, pattern, replacement, _ in mine.values():
                    if copy and member == name:
                        text = replaced_once(text.decode(), pattern, replacement, name).encode()
                out.writestr(name, text)
        found[copy] = run_in_blender(target, sorted(tests))
    return found


@pytest.mark.parametrize("fault", PACK_FAULTS)
def test_fault_in_the_pack_is_caught(outcomes, fault):
    copy, *_, test = PACK_FAULTS[fault]
    assert outcomes[copy][test] == "failed"
    if fault in BLIND:
        assert outcomes[copy][BLIND[fault]] == "passed"


def test_tests_in_blender_pass_without_a_fault(outcomes):
    assert set(outcomes[0].values()) == {"passed"}, outcomes[0]


# ---- formulas ---------------------------------------------------------------------------------

#: Fault: source, pattern, replacement, and unit tests of which at least one must catch it.
MODEL_FAULTS = {
    "a formula": (
        "generator/models/lambertian_specular.cpp",
        r"rd / pi<T>\(\)",
        "rd * T(1.001) / pi<T>()",
        "Models/GoldenModel.HasGoldenValuesOfEveryKindAndMatchesThem/lambertian_specular",
    ),
    "a distribution": (
        "generator/models/lambert.cpp",
        r"sample_cosine\(u\.y, u\.z\)",
        "sample_cosine(u.y * sqrt(u.y), u.z)",
        "Cases/ModelCase.HistogramOfSamplesFollowsThePdf/lambert_*",
    ),
    "a weight of a drawn direction": (
        "generator/models/shirley_1991.cpp",
        r"wi, matte\(wo\), cosine_pdf",
        "wi, matte(wo) * T(1.02), cosine_pdf",
        "Cases/ModelCase.AlbedoConservesAndAgreesWithSampling/shirley_1991_*",
    ),
    "a table": (
        "generator/models/coupled.cpp",
        r"return 6 \* coat\.That",
        "return 6.05 * coat.That",
        "Models/GoldenModel.HasGoldenValuesOfEveryKindAndMatchesThem/coupled",
    ),
}


@pytest.fixture(scope="module")
def faulty_program():
    """The unit tests, linked with faulty models."""
    build = Path(TOOL).parent
    commands = subprocess.run(
        ["ninja", "-C", build, "-t", "commands", "brdfc_tests"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    (link,) = (c for c in commands if re.search(r" -o brdfc_tests\b", c))
    # In the build folder, so that the compiler cache finds the objects in the next run.
    folder = build / "mutations"
    folder.mkdir(exist_ok=True)
    # Only baseline objects: those for further instruction sets contain no formula in double.
    objects = re.findall(r"\S*/brdfc_models\.dir/\S*\.o\b", link)
    compilations = {
        o: next(c for c in commands if f" -o {o} -c " in c).rpartition(" ") for o in objects
    }
    # A source is one model, or includes several.
    texts = {
        o: Path(source).read_text(encoding="utf-8")
        if "/Unity/" in source
        else f'#include "{source}"\n'
        for o, (_, _, source) in compilations.items()
    }
    faulty = dict(texts)
    for path, pattern, replacement, _ in MODEL_FAULTS.values():
        original = ROOT / path
        source = folder / original.name
        text = original.read_text(encoding="utf-8")
        source.write_text(replaced_once(text, pattern, replacement, path), encoding="utf-8")
        (old,) = (o for o in objects if f'#include "{original}"' in texts[o])
        faulty[old] = faulty[old].replace(f'"{original}"', f'"{source}"')
    compilers = []
    for old in objects:
        if faulty[old] == texts[old]:
            continue
        command, _, batch = compilations[old]
        source = folder / f"faulty_{Path(batch).name}"
        source.write_text(faulty[old], encoding="utf-8")
        new = source.with_suffix(".o")
        link = link.replace(old, str(new))
        words = [w.replace(old, str(new)) for w in shlex.split(command)]
        compilers.append(subprocess.Popen([*words, source], cwd=build))
    assert [c.wait() for c in compilers] == [0] * len(compilers)
    program = folder / "brdfc_tests"
    # Only the link command: the rule continues by listing the tests.
    link = link.removeprefix(": && ").split(" && ")[0]
    words = shlex.split(link.replace(" -o brdfc_tests ", f" -o {program} "))
    subprocess.run(words, cwd=build, check=True)
    return program


@pytest.mark.parametrize("fault", MODEL_FAULTS)
def test_fault_in_a_model_is_caught(faulty_program, tmp_path, fault):
    test = MODEL_FAULTS[fault][3]

    def failed(program):
        report = tmp_path / "report.json"
        report.unlink(missing_ok=True)
        command = [program, f"--gtest_filter={test}", f"--gtest_output=json:{report}"]
        done = subprocess.run(command, capture_output=True, text=True)
        result = json.loads(report.read_text(encoding="utf-8"))
        assert result["tests"] > 0, f"there is no {test}"
        assert done.returncode == (1 if result["failures"] else 0), done.stdout[-2000:]
        return result["failures"]

    assert failed(faulty_program) > 0
    assert failed(Path(TOOL).parent / "brdfc_tests") == 0
