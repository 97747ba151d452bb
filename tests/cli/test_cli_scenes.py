# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool's help, and its messages about scenes, files and wrong usage.

test_cli.py tests list, eval, sample, albedo and check.
"""

import csv
import io
import json
import resource
import subprocess
import time

import pytest
from support import LISTED, MODELS, ROOT, TOOL, scene

#: The labels of models whose albedo no table holds.
UNTABULATED = {
    m["name"]: m["label"]
    for m in LISTED
    if ".albedo_table = false" in (ROOT / f"generator/models/{m['name']}.cpp").read_text("utf-8")
}
DIRECTIONS = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n0,0,1,0,0.6,0.8\n0.6,0,0.8,0,0,1\n"


def brdfc(*arguments, text="", cwd=None):
    return subprocess.run(
        [TOOL, *map(str, arguments)], input=text, capture_output=True, text=True, cwd=cwd
    )


def table(*arguments, text=""):
    done = brdfc(*arguments, text=text)
    assert done.returncode == 0, done.stderr
    return list(csv.DictReader(io.StringIO(done.stdout)))


@pytest.mark.parametrize("model", MODELS)
def test_defaults_are_what_list_says(model):
    entry = next(m for m in LISTED if m["name"] == model)
    given = []
    for p in entry["parameters"]:
        value = p["default"]
        text = ",".join(map(repr, value)) if isinstance(value, list) else str(value)
        given.append(f"{p['name']}={text}")
    assert table("eval", model, text=DIRECTIONS) == table("eval", model, *given, text=DIRECTIONS)


def test_help_goes_to_stdout():
    done = brdfc("--help")
    assert done.returncode == 0 and done.stderr == ""
    for command in "list eval sample albedo check build render scene compare report".split():
        assert command in done.stdout
        explained = brdfc(command, "--help")
        assert explained.returncode == 0 and explained.stdout and explained.stderr == ""


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "subcommand"),
        (["list", "--frobnicate"], "--frobnicate"),
        (["build", "--all"], "--out"),
        (["build", "--out", "x"], "--all"),
        (["render", "absent.json", "--out", "a.exr"], "absent.json"),
        (["compare", "absent-a.exr", "absent-b.exr"], "absent-a.exr"),
        (["compare", "alone.exr"], "got alone.exr alone"),
        (["report", "absent"], "absent"),
        (["list", "warrd"], "did you mean ward? "),
        (["list", "fresnel"], "did you mean fresnel_conductor or fresnel_dielectric? "),
    ],
)
def test_wrong_use_exits_2_with_one_line(arguments, says, tmp_path):
    done = brdfc(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("brdfc: ") and done.stderr.count("\n") == 1
    assert says in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("{ not json", "JSON"),
        (scene(camera=None), "camera"),
        (scene(materials={"m": {"model": "unknown"}}), "unknown"),
        (scene(materials={"m": {"model": "warrd"}}), "model: did you mean ward? "),
        (scene(materials={"m": {"model": "lambert", "parameters": {"gloss": 1}}}), "gloss"),
        (scene(materials={"m": {"model": "lambert", "parameters": {"rho": 2}}}), "rho"),
        (
            scene(
                materials={
                    "m": {"model": "lambert", "parameters": {"rho": {"texture": "absent.png"}}}
                }
            ),
            "absent.png",
        ),
        (scene(environment={"image": "absent.exr"}), "absent.exr"),
        (scene(objects=[{"name": "o", "shape": {"type": "blob"}, "material": "m"}]), "blob"),
        (scene(lamps=[]), "lamps"),
    ],
)
def test_a_bad_scene_names_file_and_key(content, says, tmp_path):
    file = tmp_path / "bad.json"
    file.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    for arguments in (
        ["scene", file, "--out", tmp_path / "out"],
        ["render", file, "--out", "a.exr"],
    ):
        done = brdfc(*arguments, cwd=tmp_path)
        assert done.returncode == 2
        assert done.stderr.count("\n") == 1
        assert "bad.json" in done.stderr or "absent" in done.stderr
        assert says in done.stderr
        assert [p.name for p in tmp_path.iterdir()] == ["bad.json"]


def test_render_and_compare(tmp_path):
    file = tmp_path / "s.json"
    file.write_text(json.dumps(scene()), encoding="utf-8")
    for name, seed in (("a.exr", 1), ("b.exr", 1), ("c.exr", 2)):
        done = brdfc("render", file, "--out", tmp_path / name, "--seed", seed)
        assert done.returncode == 0, done.stderr
        assert done.stdout == ""
    same = json.loads(brdfc("compare", tmp_path / "a.exr", tmp_path / "b.exr", "--json").stdout)
    assert same["max"] == 0
    other = json.loads(brdfc("compare", tmp_path / "a.exr", tmp_path / "c.exr", "--json").stdout)
    assert 0 < other["relmse"] < 0.1


def test_running_out_of_memory_is_said(tmp_path):
    (tmp_path / "s.json").write_text(json.dumps(scene()))
    out = tmp_path / "a.exr"
    command = [
        TOOL,
        "render",
        tmp_path / "s.json",
        "--out",
        out,
        "--width",
        16384,
        "--height",
        16384,
    ]
    limit = 4 << 30
    done = subprocess.run(
        [str(c) for c in command],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
    )
    assert done.returncode == 1
    assert done.stderr.startswith("brdfc: out of memory") and done.stderr.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize("model", sorted(UNTABULATED))
def test_an_upper_layer_needs_an_albedo_in_blender(model, tmp_path):
    """As Blender's node of such a model says; twins have one. Below others, and in a sum, it
    needs none."""
    file = tmp_path / "s.json"
    pair = [{"model": model}, {"model": "lambert"}]
    for material, code in (
        ({"layers": pair}, 2),
        ({"layers": pair, "representation": "twin"}, 0),
        ({"layers": pair[::-1]}, 0),
        ({"sum": pair}, 0),
    ):
        file.write_text(json.dumps(scene(materials={"m": material})), encoding="utf-8")
        done = brdfc("scene", file, "--out", tmp_path / "out")
        assert done.returncode == code, done.stderr
        said = f"material m: layer 1: {UNTABULATED[model]} has no Albedo output"
        assert (said in done.stderr) == (code == 2)


@pytest.mark.slow
def test_a_resolved_scene_is_the_same_bytes_again(tmp_path):
    file = tmp_path / "s.json"
    file.write_text(json.dumps(scene(environment={"procedural": "sky"})), encoding="utf-8")
    out = [tmp_path / "one", tmp_path / "two"]
    for folder in out:
        time.sleep(1.1)  # the resolution of time stamps, if the files had any, is a second
        assert brdfc("scene", file, "--out", folder).returncode == 0
    names = sorted(p.name for p in out[0].iterdir())
    assert "scene.json" in names and any(n.endswith(".exr") for n in names)
    assert names == sorted(p.name for p in out[1].iterdir())
    for name in names:
        assert (out[0] / name).read_bytes() == (out[1] / name).read_bytes()
