# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool's commands for models: list, eval, sample, albedo, kernel, check, stability.

Tests their output, exit status and messages.

The environment variable BRDFC_TOOL names the tool; the default is build/brdfc.
"""

import csv
import functools
import io
import json
import math
import os
import re
import shutil
import struct
import subprocess
import sys

import pytest
from support import LISTED, MODELS, ROOT, TOOL, scene

EVAL_HEADER = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z"
SAMPLE_HEADER = "wo_x,wo_y,wo_z,u1,u2,u3"


def run(*args, stdin=""):
    return subprocess.run([TOOL, *args], input=stdin, capture_output=True, text=True, timeout=300)


def rows(result):
    assert result.returncode == 0, result.stderr
    return [
        {k: float(v) for k, v in row.items()} for row in csv.DictReader(io.StringIO(result.stdout))
    ]


def refused(result, *words, status=2):
    """Expects one line on stderr that contains every word, no table on stdout, and the exit
    status."""
    assert result.returncode == status, (result.returncode, result.stderr)
    assert len(result.stderr.strip().splitlines()) == 1, result.stderr
    assert result.stderr.startswith("brdfc: ")
    for word in words:
        assert word in result.stderr, result.stderr
    return result.stderr


def test_models_as_osl_that_stands_alone(tmp_path):
    for out in ("a", "b"):
        assert run("build", "--osl", tmp_path / out, "--model", "phong").returncode == 0
        made = {p.name: p.read_text() for p in (tmp_path / out).rglob("*.*")}
        assert set(made) == {"phong.osl", "brdfc_phong.h", "brdfc_library.h"}
    assert made == {p.name: p.read_text() for p in (tmp_path / "a").rglob("*.*")}
    for argument in ("color ks", "float e"):
        assert argument in made["phong.osl"]
        assert argument in made["brdfc_phong.h"]
    assert "Lamp" not in made["phong.osl"], "a node of Blender's has no list of lamps"
    assert (
        "color brdfc_phong_eval(vector wi, vector wo, color ks, float e)" in made["brdfc_phong.h"]
    )


# ---- list ---------------------------------------------------------------------------------------


def test_list_names_models_parameters_and_representations():
    out = run("list").stdout
    for name in [*MODELS, "rotation", "both|specular|diffuse", "exact, sampled"]:
        assert name in out


def test_the_extension_holds_fits_along_a_number_and_auto_does_not_take_them(tmp_path):
    assert run("build", "--model", "lafortune", "--out", tmp_path).returncode == 0
    manifest = json.loads((tmp_path / "brdfc_shaders" / "manifest.json").read_text())
    entry = manifest["models"]["lafortune"]
    assert entry["auto"] == "aimed"
    forms = entry["representations"]
    assert list(forms) == ["aimed", "sampled", "fitted", "nodes", "twin"]
    assert forms["sampled"]["only"] == {}
    assert forms["fitted"]["only"] == {"cxy": -1, "cz": 0.8}
    assert forms["fitted"]["axis"] == {"name": "e", "min": 1, "max": 100}
    shader = (tmp_path / "brdfc_shaders" / forms["fitted"]["shader"]).read_text()
    assert "float e = 10.0" in shader and "cxy" not in shader


def test_list_of_one_model():
    assert re.findall(r"(?m)^\w+", run("list", "ward").stdout) == ["ward"]
    assert [m["name"] for m in json.loads(run("list", "ward", "--json").stdout)] == ["ward"]


def test_list_json_is_the_schema():
    models = {m["name"]: m for m in json.loads(run("list", "--json").stdout)}
    assert set(MODELS) <= set(models)
    assert models["lambert"]["representations"] == ["exact", "sampled", "nodes", "twin"]
    assert models["coupled"]["representations"] == ["exact", "aimed", "sampled", "nodes", "twin"]
    assert models["ashikhmin_shirley"]["representations"] == ["aimed", "sampled", "nodes", "twin"]
    assert models["coupled"]["mirror"] is True
    parameters = {p["name"]: p for p in models["ashikhmin_shirley"]["parameters"]}
    assert parameters["rs"]["kind"] == "color" and parameters["rs"]["default"] == [0.05] * 3
    assert parameters["nu"]["kind"] == "number" and parameters["nu"]["min"] == 0
    assert parameters["part"]["choices"] == ["both", "specular", "diffuse"]
    for m in models.values():
        for p in m["parameters"]:
            assert p["label"] and p["doc"], (m["name"], p["name"])


# ---- eval ---------------------------------------------------------------------------------------


def test_eval_lambert_to_the_last_digit():
    line = "0,0,1,0.6,0,0.8"
    (row,) = rows(run("eval", "lambert", "rho=0.25,0.5,1", stdin=f"{EVAL_HEADER}\n{line}\n"))
    assert row == {
        "f_r": 0.25 / math.pi,
        "f_g": 0.5 / math.pi,
        "f_b": 1 / math.pi,
        "pdf": 1 / math.pi,
    }


def test_eval_takes_columns_in_any_order_blank_lines_and_windows_line_ends():
    text = "wo_z,wo_y,wo_x,note,wi_x,wi_y,wi_z\r\n0.8,0,0.6,7,0,0,1\r\n\r\n"
    (row,) = rows(run("eval", "lambert", "rho=1", stdin=text))
    assert row["f_r"] == 1 / math.pi


def test_eval_is_zero_below_the_surface():
    (row,) = rows(run("eval", "lambert", stdin=f"{EVAL_HEADER}\n0,0,-1,0,0,1\n"))
    assert row["f_r"] == 0 and row["pdf"] == 0


def test_eval_normalises_what_is_nearly_a_unit_vector():
    text = f"{EVAL_HEADER}\n0,0,1.0000005,0.6,0,0.8\n"
    (row,) = rows(run("eval", "coupled", "rm=1", "r0=0", stdin=text))
    exact = 21 / (20 * math.pi) * (1 - 0.2**5)
    assert row["f_g"] == pytest.approx(exact, rel=1e-14)


def test_closure_is_f_cos_with_its_weight():
    text = f"{EVAL_HEADER}\n0.6,0,0.8,0,0,1\n"
    (row,) = rows(run("closure", "diffuse", "weight=1,0.5,0.25", stdin=text))
    assert row["f_cos_g"] == pytest.approx(0.4 / math.pi, rel=1e-15)
    # Ashikhmin and Shirley's lobe with n = 0: (n + 1) / (8 pi) divided by (h.k) max(cos).
    (row,) = rows(run("closure", "ashikhmin_shirley", "alpha_x=1", "alpha_y=1", stdin=text))
    assert row["f_cos_r"] == pytest.approx(0.8 / (8 * math.pi * math.sqrt(0.9)), rel=1e-14)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["blinn"], ["'blinn'", "diffuse", "glossy_toon"]),
        (["ggx", "alpha=1"], ["closure ggx", "'alpha'", "alpha_x"]),
        (["ggx", "alpha_x=2"], ["closure ggx", "alpha_x", "[0.0001, 1]", "2"]),
        (["diffuse", "normal=0"], ["closure diffuse", "normal", "not 0"]),
    ],
)
def test_closure_says_what_is_wrong_with_its_arguments(arguments, words):
    refused(run("closure", *arguments, stdin=f"{EVAL_HEADER}\n0,0,1,0,0,1\n"), *words)


@pytest.mark.parametrize(
    ("stdin", "words"),
    [
        ("", ["stdin", "header", "wi_x"]),
        ("a,b,c\n1,2,3\n", ["stdin line 1", "'wi_x' is missing"]),
        (f"{EVAL_HEADER}\n0,0,1,0,0\n", ["stdin line 2", "expected 6 values", "got 5"]),
        (f"{EVAL_HEADER}\n0,0,1,0,0,1\n0,0,1,0,x,1\n", ["stdin line 3", "wo_y", "'x'"]),
        (f"{EVAL_HEADER}\n0,0,nan,0,0,1\n", ["stdin line 2", "wi_z", "finite", "'nan'"]),
        (f"{EVAL_HEADER}\n0,0,1,inf,0,1\n", ["stdin line 2", "wo_x", "finite", "'inf'"]),
        (f"{EVAL_HEADER}\n0,0,1,0,1,1\n", ["stdin line 2", "wo_x, wo_y, wo_z", "unit vector"]),
        (f"{EVAL_HEADER}\n0,0,1,0,0,1e0x\n", ["stdin line 2", "wo_z"]),
    ],
)
def test_eval_says_what_is_wrong_with_its_input(stdin, words):
    refused(run("eval", "lambert", stdin=stdin), *words)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["eval", "phng"], ["'phng'", "did you mean phong?", "`brdfc list`"]),
        (["eval", "phong", "kz=1"], ["'kz'", "did you mean ks?"]),
        (["eval", "lambert", "rh=1"], ["lambert", "'rh'", "rho"]),
        (["eval", "lambert", "rho=2"], ["lambert", "rho", "[0, 1]", "2"]),
        (["eval", "lambert", "rho=nan"], ["lambert", "rho"]),
        (["eval", "lambert", "rho=red"], ["lambert", "rho", "'red'"]),
        (["eval", "lambert", "rho=0.1,0.2"], ["lambert", "rho", "r,g,b"]),
        (["eval", "lambert", "rho"], ["lambert", "name=value", "'rho'"]),
        (["eval", "lambert", "rho=1", "rho=1"], ["lambert", "rho", "twice"]),
        (["eval", "ashikhmin_shirley", "part=all"], ["part", "both, specular, diffuse", "'all'"]),
        (["eval"], ["model"]),
        (["evil"], ["unknown command", "'evil'"]),
        ([], ["A subcommand is required", "see brdfc --help"]),
        (["eval", "lambert", "--frob"], ["--frob"]),
        (["sample", "lambert", "--count", "0", "--wo", "0,0,1"], ["--count"]),
        (
            ["sample", "lambert", "--count", "-1", "--wo", "0,0,1"],
            ["--count", "whole number from 1"],
        ),
        (
            ["sample", "lambert", "--count", "99999999999", "--wo", "0,0,1"],
            ["--count", "at most 2147483647"],
        ),
        (["sample", "lambert", "--count", "3"], ["--wo"]),
        (["sample", "lambert", "--count", "3", "--wo", "0,0,2"], ["--wo", "unit vector"]),
        (["sample", "lambert", "--pattern", "regular"], ["--count"]),
        (
            ["sample", "lambert", "--count", "3", "--wo", "0,0,1", "--pattern", "blue"],
            ["--pattern", "blue", "multi_jittered", "hammersley"],
        ),
        (["sample", "lambert", "--seed", "3"], ["--count"]),
        (["albedo", "lambert", "--count", "1"], ["--count"]),
        (["check", "lambert", "--all"], ["--all"]),
        (["check", "phng"], ["'phng'", "did you mean phong?", "`brdfc list`"]),
    ],
)
def test_wrong_usage_is_one_line_and_status_2(args, words):
    refused(run(*args, stdin=f"{EVAL_HEADER}\n0,0,1,0,0,1\n"), *words)


@functools.cache
def commands():
    listed = run("--help").stdout.split("Subcommands:")[1]
    return re.findall(r"^  (\w+)", listed, re.M)


@functools.cache
def help_of(command):
    return run(command, "--help").stdout


def numbers_of(command):
    """{option: INTEGER or NUMBER, and how many if it takes several}, from the command's help."""
    found = re.findall(
        r"^  (?:-\w,)?(--[\w-]+) ((?:INTEGER|NUMBER)\S*(?: x \d+)?)", help_of(command), re.M
    )
    return dict(found)


def test_every_option_that_is_a_number_is_checked_as_one():
    """By app/numbers.h: CLI11's own types accept NaN as a number in any range."""
    for command in commands():
        assert not re.findall(r"^  --.*\b(?:FLOAT|INT|UINT|DOUBLE)\b.*$", help_of(command), re.M), (
            command
        )
    found = {(c, o) for c in commands() for o in numbers_of(c)}
    assert found >= {
        ("albedo", "--error"),
        ("albedo", "--phi"),
        ("base", "--angles"),
        ("build", "--error"),
        ("check", "--effort"),
        ("check", "--seed"),
        ("compare", "--diff-scale"),
        ("compare", "--inject"),
        ("kernel", "--n"),
        ("optical", "--thickness"),
        ("render", "--exposure"),
        ("render", "--max-seconds"),
        ("render", "--scale"),
        ("render", "--spp"),
        ("sample", "--wo"),
        ("stability", "--limit"),
    }


@pytest.mark.parametrize("command", commands())
def test_a_number_that_is_none_is_named(command):
    for index, (option, kind) in enumerate(numbers_of(command).items()):
        many = int(kind.split(" x ")[1]) if " x " in kind else 1
        wrong = ["nan", "-inf", "1e999", "0x10", ""]
        wrong += ["1.5", "1" + "0" * 30] if kind.startswith("INTEGER") else []
        # One type reads all of them, so each option is tried with some of what that refuses.
        wrong = wrong[index % 3 :: 3]
        for value in wrong:
            done = run(command, f"{option}={','.join([value] * many)}")
            if value == "":  # CLI11 reports that itself
                assert done.returncode == 2 and option in done.stderr, (command, option)
                continue
            refused(done, f"{option}: expected ", f"got '{value}'")


# ---- sample -------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", MODELS)
def test_sample_agrees_with_eval(model):
    wo = (0.36, -0.48, 0.8)
    args = ["--count", "200", "--seed", "7", "--wo", ",".join(map(str, wo))]
    if not next(m for m in LISTED if m["name"] == model)["scatter"]:
        refused(run("sample", model, *args), model, "expected a model that scatters")
        return
    samples = rows(run("sample", model, *args))
    assert len(samples) == 200
    kept = [s for s in samples if s["pdf"] > 0]
    assert len(kept) > 100
    for s in samples:
        if s["pdf"] == 0:
            assert s["weight_r"] == s["weight_g"] == s["weight_b"] == 0
    lines = "\n".join(
        ",".join(repr(s[k]) for k in ("wi_x", "wi_y", "wi_z")) + "," + ",".join(map(str, wo))
        for s in kept
    )
    values = rows(run("eval", model, stdin=f"{EVAL_HEADER}\n{lines}\n"))
    for s, v in zip(kept, values, strict=True):
        assert v["pdf"] == pytest.approx(s["pdf"], rel=1e-9)
        for c in "rgb":
            f_cos = v[f"f_{c}"] * abs(s["wi_z"])  # below the surface, light is transmitted
            assert s[f"weight_{c}"] * s["pdf"] == pytest.approx(f_cos, rel=1e-9)


def test_sample_is_reproducible_and_its_seed_matters():
    args = ["sample", "radziszewski_alda", "--count", "20", "--wo", "0,0.6,0.8", "--seed"]
    first, again, other = (run(*args, seed).stdout for seed in ("1", "1", "2"))
    assert first == again != other


def test_sample_takes_a_pattern():
    """Regular points are the centres of cells, whatever the seed; random ones equal those without a
    pattern; jittered ones are stratified in the heights of lambert's samples."""
    args = ["sample", "lambert", "--count", "16", "--wo", "0,0.6,0.8"]
    cells = [((i + 0.5) / 4, (j + 0.5) / 4) for i in range(4) for j in range(4)]
    text = "\n".join([SAMPLE_HEADER, *(f"0,0.6,0.8,0.5,{x},{y}" for x, y in cells)])
    expected = sorted(run("sample", "lambert", stdin=text + "\n").stdout.split())
    regular = run(*args, "--seed", "7", "--pattern", "regular").stdout
    assert sorted(regular.split()) == expected
    assert run(*args, "--pattern", "random").stdout == run(*args).stdout
    one, other = (rows(run(*args, "--pattern", "jittered", "--seed", s)) for s in ("1", "2"))
    assert one != other
    # One in each cell; there are four cells for each height.
    for found in (one, other):
        assert sorted(int(4 * r["wi_z"] ** 2) for r in found) == sorted([0, 1, 2, 3] * 4)


def test_sample_takes_random_numbers_from_stdin():
    text = f"{SAMPLE_HEADER}\n0,0,1,0.5,0,0.3\n0,0,1,0.5,0.75,0\n"
    a, b = rows(run("sample", "lambert", "rho=0.5", stdin=text))
    assert a["wi_z"] == 1 and a["weight_r"] == 0.5
    assert b["wi_z"] == pytest.approx(0.5, rel=1e-15)
    assert b["pdf"] == pytest.approx(0.5 / math.pi, rel=1e-15)


def test_sample_refuses_random_numbers_outside_the_unit_interval():
    text = f"{SAMPLE_HEADER}\n0,0,1,0.5,1,0.3\n"
    refused(run("sample", "lambert", stdin=text), "stdin line 2", "u2", "[0, 1)", "1")


# ---- albedo -------------------------------------------------------------------------------------


def test_albedo_without_input_covers_64_cosines():
    for stdin in ("", "\n"):
        table = rows(run("albedo", "coupled", "rm=1", stdin=stdin))
        assert len(table) == 64
        assert table[0]["cos_theta_o"] == 0.01 and table[-1]["cos_theta_o"] == 1
        for row in table:
            assert row["albedo_g"] == pytest.approx(1, abs=1e-7)
            schlick = 0.05 + 0.95 * (1 - row["cos_theta_o"]) ** 5
            assert row["mirror_g"] == pytest.approx(schlick, abs=1e-12)
            assert 0 <= row["error_estimate"] < 1e-6


def test_albedo_landmarks_of_the_anisotropic_phong_furnace():
    args = ["albedo", "ashikhmin_shirley", "part=specular", "rs=1", "nu=10", "nv=10"]
    stdin = f"cos_theta_o\n1\n0.5\n{math.cos(math.radians(80))!r}\n"
    normal, at60, at80 = (row["albedo_r"] for row in rows(run(*args, stdin=stdin)))
    assert normal == pytest.approx(0.6957, abs=1e-4)
    assert at60 == pytest.approx(0.613, abs=1e-3)
    assert at80 == pytest.approx(0.539, abs=1e-3)


def test_albedo_turns_with_the_azimuth_of_an_anisotropic_model():
    args = ["albedo", "ashikhmin_shirley", "part=specular", "rs=1", "nu=3", "nv=300"]
    stdin = "cos_theta_o\n0.3\n"
    (along,) = rows(run(*args, "--phi", "0", stdin=stdin))
    (across,) = rows(run(*args, "--phi", str(math.pi / 2), stdin=stdin))
    (turned,) = rows(run(*args, f"rotation={math.pi / 2}", "--phi", str(math.pi / 2), stdin=stdin))
    assert abs(along["albedo_r"] - across["albedo_r"]) > 0.01
    assert turned["albedo_r"] == pytest.approx(along["albedo_r"], abs=1e-5)


def test_albedo_is_as_good_as_it_is_asked_to_be():
    stdin = "cos_theta_o\n0.3\n0.8\n"
    best = rows(run("albedo", "ward", "--error", "1e-9", stdin=stdin))
    for error in (1e-3, 1e-5):
        for row, truth in zip(
            rows(run("albedo", "ward", "--error", str(error), stdin=stdin)), best, strict=True
        ):
            assert 0.01 * error < row["error_estimate"] <= error
            assert row["albedo_g"] == pytest.approx(truth["albedo_g"], abs=2 * error)


@pytest.mark.parametrize("cosine", ["0", "-0.5", "1.0001", "nan", "abc"])
def test_albedo_refuses_a_cosine_out_of_range(cosine):
    refused(
        run("albedo", "lambert", stdin=f"cos_theta_o\n0.5\n{cosine}\n"),
        "stdin line 3",
        "cos_theta_o",
    )


# ---- kernel -------------------------------------------------------------------------------------


def drawn(path, points):
    path.write_text("u,k\n" + "".join(f"{u!r},{k!r}\n" for u, k in points))
    return str(path)


def kernel(*args):
    """The parameters in the notation of other commands, and the three stated errors."""
    result = run("kernel", *args)
    assert result.returncode == 0, result.stderr
    errors = [
        float(word.strip(";,")) for word in result.stderr.split() if "e" in word and "." in word
    ]
    assert len(errors) == 3, result.stderr
    return result.stdout.split(), errors


def test_kernel_of_four_heights_comes_back(tmp_path):
    file = drawn(tmp_path / "k.csv", [(0, 2), (0.5, 1.8), (1, 0.4), (1.5, 0.6)])
    parameters, errors = kernel(file, "--n", "5")
    assert parameters == ["n=10", "kernel=table", "h0=1", "h1=0.9", "h2=0.2", "h3=0.3"]
    assert max(errors) < 1e-12


def test_kernel_of_sech2_differs_from_it_by_the_stated_error(tmp_path):
    places = [5 * i / 49 for i in range(50)]
    file = drawn(tmp_path / "k.csv", [(u, 1 / math.cosh(u) ** 2) for u in places])
    parameters, (_, l1, l1_view) = kernel(file)  # n = 4 is the model's default
    steps, views, lines = 1000, 8, []
    for view in range(views):
        y = (view + 0.5) / views
        wo = f"{math.sqrt(1 - y)!r},0,{math.sqrt(y)!r}"
        xs = [(i + 0.5) / steps for i in range(steps)]
        lines += [f"{-math.sqrt(1 - x)!r},0,{math.sqrt(x)!r},{wo}" for x in xs]
    stdin = "\n".join([EVAL_HEADER, *lines, ""])
    f, g = (
        [row["f_r"] for row in rows(run("eval", "lossless", *p, stdin=stdin))]
        for p in (["n=4"], parameters)
    )
    apart = [math.pi / steps * abs(a - b) for a, b in zip(f, g, strict=True)]
    sums = [sum(apart[i * steps : (i + 1) * steps]) for i in range(views)]
    # The curve's own chords differ from sech^2 by up to 2e-3.
    assert l1 == pytest.approx(sum(sums) / views, abs=2e-3)
    assert l1_view == pytest.approx(max(sums), abs=2e-3)
    assert 0.01 < l1 < 0.06


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["header u,k"]),
        ("u,h\n0,1\n1,1\n", ["line 1", "'k' is missing"]),
        ("u,k\n0,1\n1\n", ["line 3", "expected 2 values", "got 1"]),
        ("u,k\n0,1\n1,high\n", ["line 3", "k", "finite number", "'high'"]),
        ("u,k\n0,1\nnan,1\n", ["line 3", "u", "finite number", "'nan'"]),
        ("u,k\n0,1\n2,1\n1,1\n", ["line 4", "u", "more than 2", "got 1"]),
        ("u,k\n0,1\n0,0.5\n", ["line 3", "u", "more than 0", "got 0"]),
        ("u,k\n-1,1\n2,1\n", ["line 2", "u", "at least 0", "got -1"]),
        ("u,k\n0,1\n2,-0.5\n", ["line 3", "k", "above 0", "got -0.5"]),
        ("u,k\n0,1\n2,0\n", ["line 3", "k", "above 0", "got 0"]),
        ("u,k\n0,1\n", ["at least two points", "got 1"]),
        ("u,k\n", ["at least two points", "got 0"]),
    ],
)
def test_kernel_says_what_is_wrong_with_a_curve(text, words, tmp_path):
    file = tmp_path / "curve.csv"
    file.write_text(text)
    refused(run("kernel", str(file)), "curve.csv", *words)


def test_kernel_refuses_a_glossiness_out_of_range_and_a_file_that_is_none(tmp_path):
    file = drawn(tmp_path / "k.csv", [(0, 1), (1, 0.5)])
    for n in ("0", "-1", "1e5", "nan"):
        refused(run("kernel", file, "--n", n), "--n", "(0, 10000]")
    refused(run("kernel", str(tmp_path / "none.csv")), "none.csv", "header u,k", "read")
    refused(run("kernel", str(tmp_path)), str(tmp_path), "header u,k")


# ---- check --------------------------------------------------------------------------------------


def test_check_passes_and_prints_a_table():
    result = run("check", "lambert")
    assert result.returncode == 0, result.stdout + result.stderr
    for name in ("reciprocal", "chi-square", "pdf integral", "exact closures", "float rounding"):
        assert name in result.stdout
    assert "FAILED" not in result.stdout


def test_check_json():
    result = run("check", "coupled", "--json")
    assert result.returncode == 0, result.stderr
    table = json.loads(result.stdout)
    assert {row["model"] for row in table} == {"coupled"}
    assert all(row["passed"] and row["cases"] > 0 and not row["reason"] for row in table)


def test_check_says_what_it_skips_and_why():
    # A mirror has no lobe to check, and a check that was skipped has not passed.
    quick = ("check", "fresnel_dielectric", "--effort", "0.1")
    table = {row["check"]: row for row in json.loads(run(*quick, "--json").stdout)}
    row = table["chi-square"]
    assert (row["passed"], row["cases"]) == (None, 0)
    assert row["reason"] == "the model has delta terms alone"
    assert table["exact closures"]["passed"] is True
    (line,) = (ln for ln in run(*quick).stdout.splitlines() if ln.startswith("  chi-square"))
    assert line.split()[5] == "skipped" and line.endswith(row["reason"])


def page_of_table(name):
    return (ROOT / "docs" / "tables" / f"{name}.md").read_text(encoding="utf-8")


def test_check_markdown_is_the_table_of_its_page():
    result = run("check", "--markdown")
    assert result.returncode == 0, result.stderr
    text = page_of_table("properties")
    table = text[text.index("| Model |") :]
    assert result.stdout == table, "run evidence/properties"
    for name in MODELS:
        assert f"| `{name}` |" in table


def test_check_scales_with_the_effort_asked_for():
    def cases(effort):
        table = json.loads(run("check", "lambert", "--json", "--effort", effort).stdout)
        return {row["check"]: row["cases"] for row in table}

    few, many = cases("0.1"), cases("1")
    assert few.keys() == many.keys()
    assert few["values"] < many["values"] / 4


@pytest.mark.long
def test_errors_of_stored_fits_are_the_table_of_their_page():
    script = ROOT / "evidence" / "forms_table.py"
    command = [sys.executable, script, "--tool", TOOL, "fits-over"]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "script")}
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, done.stderr
    assert done.stdout == page_of_table("fits-over"), "run evidence/forms fits-over"


# ---- stability --------------------------------------------------------------------------------


def test_stability_reports_the_worst_place_and_fails_beyond_the_limit():
    few = ("stability", "blinn", "--points", "500", "--calls", "5000")
    result = run(*few)
    assert result.returncode == 0, result.stdout + result.stderr
    for words in ("units at blinn ks=", "no bad value", "numbers from 1e"):
        assert words in result.stdout
    strict = run(*few, "--limit", "0.1")
    assert strict.returncode == 1
    assert "FAILED: expected at most 0.1 units" in strict.stdout


def test_stability_draws_maps(tmp_path):
    few = ("stability", "lambert", "--points", "100", "--calls", "100")
    assert run(*few, "--maps", str(tmp_path / "maps")).returncode == 0
    maps = json.loads((tmp_path / "maps" / "maps.json").read_text(encoding="utf-8"))
    assert maps["format"] == 1 and maps["printed"] == []
    (only,) = maps["models"]
    assert only["title"] == "Lambert" and only["picture"] == "lambert.png"
    assert only["x"] == "cos theta_o from 1e-6 to 1, logarithmic" and only["y"]
    assert [color["exponent"] for color in maps["colors"]] == list(range(-16, 1, 2))
    start = (tmp_path / "maps" / "lambert.png").read_bytes()[:24]
    assert struct.unpack(">II", start[16:]) == (maps["width"], maps["height"])


def test_stability_maps_refuse_a_folder_that_cannot_be(tmp_path):
    (tmp_path / "file").write_text("")
    few = ("stability", "lambert", "--points", "100", "--calls", "100")
    result = run(*few, "--maps", str(tmp_path / "file" / "maps"))
    assert result.returncode == 2
    assert f"{tmp_path}/file/maps: expected a folder that can be written" in result.stderr


# ---- fit ----------------------------------------------------------------------------------------


def test_base_prints_what_it_carries_and_leaves():
    table = rows(run("base", "ward", "normalisation=duer", "--angles", "20,70", "--points", "4096"))
    assert [row["theta_o"] for row in table] == [20, 70]
    assert table[0]["relative_l1"] < 0.02 < table[1]["relative_l1"] + 0.02 < 0.1
    for row in table:
        assert row["share"] == pytest.approx(1, abs=0.05) == row["best_scale"]
        assert row["sky_rest"] < 0.05 * row["sky_drawn"]
        assert row["white_rest"] < row["white_drawn"]
    assert run("base", "lambert").returncode == 2
    assert "lambert: has no base" in run("base", "lambert").stderr


@pytest.mark.slow
@pytest.mark.usefixtures("fits_made_once")
def test_fit_prints_its_error_by_view_and_its_closures():
    result = run("fit", "phong", "e=20")
    table = rows(result)
    assert len(table) == 64 and table[0]["cos_theta_o"] > table[-1]["cos_theta_o"]
    l1 = sorted(row["relative_l1"] for row in table)
    assert f"median {100 * l1[31]:.2g} %" in result.stderr
    assert l1[31] < 0.01 < l1[-1] < 0.2

    header = EVAL_HEADER + "\n"
    pair = "-0.6,0,0.8,0.6,0,0.8\n"
    fitted = rows(run("fit", "phong", "e=20", "--pairs", stdin=header + pair))[0]["f_cos_r"]
    truth = rows(run("eval", "phong", "e=20", stdin=header + pair))[0]["f_r"] * 0.8
    assert fitted == pytest.approx(truth, rel=0.02)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["fit", "ashikhmin_shirley", "nu=10"], ["ashikhmin_shirley", "anisotropic"]),
        (["fit", "radziszewski_alda", "around=refraction"], ["lets light through"]),
        (["fit", "ward", "ax=0.5", "--twin"], ["ward", "anisotropic"]),
        (["fit", "schlick", "--any", "q"], ["--any q", "no such parameter"]),
        (["fit", "schlick", "--any", "p"], ["--any p", "a polynomial of"]),
        (["fit", "schlick", "--over", "p", "--twin"], ["schlick", "anisotropic"]),
        (["fit", "phong", "e=4", "--twin", "--store"], ["--twin --store", "neither values"]),
        (["fit", "factors", "--twin", "--over", "rim"], ["factors", "neither --over nor --any"]),
        (["fit", "glass", "--twin", "--store"], ["glass", "no twin", "only reflects"]),
        (["fit", "phong", "--store"], ["--store", "--over or --twin"]),
        (["fit", "phong_material", "--over", "kd"], ["--over kd", "take --any kd"]),
        (["fit", "phong", "--over", "e", "e=4"], ["--over e", "e="]),
        (["fit", "schlick", "--any", "r", "r=0.5"], ["--any r", "r="]),
        (["build", "--model", "phong", "--model", "phong", "--out", "x"], ["phong", "twice"]),
        (["build", "--model", "phong", "--error", "2", "--out", "x"], ["--error", "--scene"]),
        (["build", "--model", "phong", "--twin", "--out", "x"], ["--twin", "--scene"]),
        (["build", "--model", "phong", "--time", "1x", "--out", "x"], ["--time", "--scene"]),
        (["build", "--model", "phong", "--fit", "--out", "x"], ["--fit", "--scene"]),
        (["build", "--all"], ["--out DIR", "--osl DIR"]),
        (["build", "--all", "--osl", "x", "--out", "x"], ["--osl", "--model"]),
        (["build", "--osl", "x", "--error", "5"], ["--osl", "--model"]),
        (["build", "--osl", "x", "--model", "pong"], ["pong"]),
        (["build", "--osl", "/dev/null", "--model", "phong"], ["/dev/null", "cannot be written"]),
    ],
)
def test_what_can_not_be_fitted(args, words, tmp_path):
    refused(run(*args), *words)


# ---- build within a budget ----------------------------------------------------------------------


@pytest.mark.parametrize(("radius", "said"), [(0, True), (0.3, False)])
def test_a_lamp_without_a_size_is_named_beside_the_form(tmp_path, radius, said):
    lamp = {"type": "point", "position": [0, -3, 3], "power": 10, "radius": radius}
    material = {"model": "phong", "parameters": {"e": 20}}
    file = tmp_path / "s.json"
    file.write_text(json.dumps(scene(materials={"m": material}, lights=[lamp])))
    done = run("build", "--scene", file, "--explain", "--out", tmp_path / "out")
    models = json.loads(done.stdout)["models"]
    reasons = [c["why"] for m in models for c in m["choices"] if c["form"] == "aimed"]
    drawn = [r for r in reasons if "the form is left open" in r]
    assert drawn
    for reason in drawn:
        assert ("lights[0] without a size" in reason) == said


@pytest.mark.slow
@pytest.mark.usefixtures("fits_made_once")
def test_a_scene_of_camera_rays_alone_has_tables_of_the_views_that_occur(tmp_path):
    content = scene(
        camera={
            "type": "perspective",
            "position": [0, -4, 2],
            "look_at": [0, 0, 0],
            "fov_y_degrees": 10,
        },
        materials={"m": {"model": "phong", "parameters": {"e": 20}, "representation": "fitted"}},
        objects=[{"name": "floor", "shape": {"type": "quad", "size": [2, 2]}, "material": "m"}],
    )
    # Light scattered by a single quad hits nothing; a second quad is hit by it.
    (floor,) = content["objects"]
    below = floor | {"name": "below", "transform": {"translate": [0, 0, -1]}}
    file = tmp_path / "s.json"
    floats = []
    for objects, cut in (([floor], True), ([floor, below], False)):
        file.write_text(json.dumps(content | {"objects": objects}))
        done = run("build", "--scene", file, "--explain", "--out", tmp_path / "out")
        assert done.returncode == 0, done.stderr
        (model,) = json.loads(done.stdout)["models"]
        low, high = model["view_cosines"]
        (form,) = model["forms"]
        before, after = form["before"], form["after"]
        floats.append(after["table_floats"])
        assert (after["bytes"] < before["bytes"]) == cut
        assert after["operations"] == before["operations"]
        assert ("degrees: never seen" in " ".join(model["left_out"])) == cut
        manifest = json.loads((tmp_path / "out" / "brdfc_shaders" / "manifest.json").read_text())
        entry = manifest["models"]["phong"]
        if cut:
            assert 0.25 < low < 5**-0.5 < high < 0.6
            assert entry["view_cosines"] == [low, high]
        else:
            assert (low, high) == (0, 1) and "view_cosines" not in entry
    assert floats[0] < floats[1] / 3


@pytest.fixture
def phong(tmp_path):
    """build(*options): the extension for a `phong` material, whose forms have made-up costs."""
    addon = tmp_path / "addon"
    shutil.copytree(ROOT / "blender_addon", addon)
    rows = ("phong,aimed,1.1", "phong,sampled,1.2", "phong,fitted,0.9", "phong,twin,0.7")
    table = "\n".join(["model,form,cost", *rows, ""])
    (addon / "costs.csv").write_text(table)
    file = tmp_path / "m.json"
    file.write_text(json.dumps({"materials": {"a": {"model": "phong", "parameters": {"e": 20}}}}))

    def build(*options):
        out = tmp_path / "out"
        return run("build", "--materials", file, "--addon", addon, "--out", out, *options)

    build.addon, build.file, build.out = addon, file, tmp_path / "out"
    return build


@pytest.fixture(scope="module")
def kept_fits(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def fits_made_once(kept_fits, monkeypatch):
    """For tests that look at what is chosen among fits, and not at what is said when they are
    made."""
    monkeypatch.setenv("BRDFC_CACHE", str(kept_fits))


@pytest.mark.slow
@pytest.mark.usefixtures("fits_made_once")
@pytest.mark.parametrize(
    ("options", "form"),
    [
        (["--time", "1.15x"], "aimed"),
        (["--time", "1"], "fitted"),
        (["--time", "0.5x"], "fitted"),
        (["--time", "1x", "--error", "0.1"], "aimed"),
        (["--time", "1.15", "--error", "5%"], "fitted"),
    ],
)
def test_build_takes_a_form_that_keeps_the_time(phong, options, form):
    result = phong("--explain", "--osl-only", *options)
    assert result.returncode == 0, result.stderr
    (model,) = json.loads(result.stdout)["models"]
    choices = {c["form"]: c for c in model["choices"]}
    assert list(choices) == ["aimed", "sampled", "fitted", "twin"]
    assert [f for f, c in choices.items() if c["taken"]] == [form]
    assert all(c["why"] for c in choices.values())
    assert {f: c["cost"] for f, c in choices.items()} == {
        "aimed": 1.1,
        "sampled": 1.2,
        "fitted": 0.9,
        "twin": 0.7,
    }
    assert choices["sampled"]["error"] == "expectation"
    assert 0.005 < choices["fitted"]["error"] < 0.03
    assert model["material_forms"] == [
        {
            "material": "a",
            "before": {"form": "aimed", "cost": 1.1},
            "after": {"form": form, "cost": choices[form]["cost"]},
        }
    ]
    manifest = json.loads((phong.out / "brdfc_shaders" / "manifest.json").read_text())
    assert manifest["models"]["phong"]["auto"] == form
    entry = manifest["models"]["phong"]["representations"][form]
    assert entry["cost"] == choices[form]["cost"]
    (sizes,) = model["forms"]
    assert entry["operations"] == sizes["after"]["operations"]
    text = (phong.out / "brdfc_shaders" / entry["shader"]).read_text()
    assert sizes["after"]["bytes"] == len(text.encode())
    body = text[text.index("\n{\n", text.index("\nshader ")) :]
    assert sizes["after"]["statements"] == body.count(";\n")


def test_build_prints_every_form_with_cost_and_error(phong):
    lines = phong("--time", "1x").stdout.splitlines()
    assert "  aimed       1.10x expectation  not taken: costs 1.1x, and 1x is allowed" in lines
    (fitted,) = [line.split() for line in lines if line.startswith("  fitted ")]
    assert fitted[:2] == ["fitted", "0.90x"] and 0.005 < float(fitted[2]) < 0.03
    assert " ".join(fitted[3:]) == "taken: a: the form is left open"
    without = phong().stdout
    assert "not taken: nothing is fitted unasked" in without


def test_what_renders_without_osl_is_beside_the_form(phong):
    for options, forms in (([], {"aimed", "nodes"}), (["--osl-only"], {"aimed"})):
        (model,) = json.loads(phong("--explain", *options).stdout)["models"]
        assert {c["form"] for c in model["choices"] if c["taken"]} == forms
        manifest = json.loads((phong.out / "brdfc_shaders" / "manifest.json").read_text())
        assert set(manifest["models"]["phong"]["representations"]) == forms


def test_lamps_of_a_blend(phong):
    """Lamps without a size are reported with the chosen form; the number of lamps determines the
    slots."""
    content = json.loads(phong.file.read_text())
    lamps = {"sizeless_lamps": ["Sun.001"], "lamps": 2}
    phong.file.write_text(json.dumps(content | lamps))
    (model,) = json.loads(phong("--explain", "--osl-only").stdout)["models"]
    (taken,) = [c for c in model["choices"] if c["taken"]]
    assert taken["form"] == "aimed" and "Sun.001 without a size" in taken["why"]
    assert "slots for more than 2 lamps: the scene has no more" in model["left_out"]
    manifest = json.loads((phong.out / "brdfc_shaders" / "manifest.json").read_text())
    assert manifest["models"]["phong"]["representations"]["aimed"]["lamps"] == 2


@pytest.mark.parametrize("time", ["x", "fast", "0x", "-1", "1.2xx", "1,2", "inf", "nan", "1.2 x"])
def test_a_time_that_is_none(phong, time):
    refused(phong(f"--time={time}"), "--time: expected a positive number, as 1.2 or 1.2x", time)
    assert not phong.out.exists()


@pytest.mark.parametrize("error", ["abc", "-1", "100.5", "nan", "inf", "5%%", "5 %", "%", "1,5"])
def test_an_error_that_is_none(phong, error):
    refused(phong(f"--error={error}"), "--error: expected percent from 0 to 100, as 5 or 5%", error)
    assert not phong.out.exists()


def test_costs_that_are_missing_or_wrong(phong):
    table = phong.addon / "costs.csv"
    table.write_text("model,form,cost\nphong,sampled,quick\n")
    refused(phong(), "costs.csv: line 2: cost: expected a positive number, got 'quick'")
    table.unlink()
    refused(phong("--time", "1x"), "costs.csv: no such file, and --time needs what forms cost")
    assert phong().returncode == 0, "the panel can do without"
