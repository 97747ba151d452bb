# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that following docs/add-a-model.md adds a model: the page's example, added to a copy of the
sources, builds, equals its formula, and renders in Blender as in the reference renderer. Likewise,
in the same copy, docs/add-a-form.md adds a form."""

import csv
import json
import math
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BLENDER_PYTHON = Path(
    os.environ.get("BRDFC_BLENDER_PYTHON", ROOT / ".env" / "blender-4.5" / "bin" / "python")
)
L, RHO = 0.7, (0.8, 0.6, 0.4)

pytestmark = pytest.mark.evidence


def run(*command, text=None):
    done = subprocess.run([str(c) for c in command], input=text, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


def page_of(page):
    return (ROOT / "docs" / page).read_text(encoding="utf-8")


def examples_of(page):
    """[(path, text)] of the sources on a page."""
    return re.findall(
        r"<!-- example: (\S+) -->\n```cpp\n(.*?)```\n<!-- end of example", page_of(page), re.S
    )


def example_of(page):
    """The first of them."""
    return examples_of(page)[0]


def with_base(text):
    """The example with the base() that its page adds to the class."""
    (base,) = re.findall(
        r"<!-- base of generator/models/lunar_lambert.cpp -->\n```cpp\n(.*?)```",
        page_of("add-a-model.md"),
        re.S,
    )
    end = "\n};\n\nBRDFC_MODEL"
    assert text.count(end) == 1
    return text.replace(end, f"\n\n{base}{end[1:]}")


@pytest.fixture(scope="module")
def tool(tmp_path_factory):
    """The tool, built from a copy of the sources with the documented examples as a new model and a
    new form."""
    source = tmp_path_factory.mktemp("example") / "source"
    skip = shutil.ignore_patterns("build", ".env", ".git", "__pycache__", ".*_cache")
    shutil.copytree(ROOT, source, ignore=skip)
    sources = dict(examples_of("add-a-model.md") + examples_of("add-a-form.md"))
    model = "generator/models/lunar_lambert.cpp"
    sources[model] = with_base(sources[model])
    for path, text in sources.items():
        assert not (source / path).exists()
        (source / path).write_text(text, encoding="utf-8")
    # The page says to declare the form and to list it.
    registry = source / "generator" / "forms" / "registry.cpp"
    page = (ROOT / "docs" / "add-a-form.md").read_text(encoding="utf-8")
    declared, listed = re.findall(
        r"\n```cpp\n(const Form& \w+\(\);|  static const .*?;)\n```", page
    )
    before = registry.read_text(encoding="utf-8")
    after = re.sub(r"  static const std::vector<const Form\*> all = .*?;", listed, before)
    after = after.replace("\nconst std::vector", f"{declared}\n\nconst std::vector", 1)
    assert after.count("flat()") == 2
    registry.write_text(after, encoding="utf-8")
    build = source / "build"
    # Built as by script/test, so that the compiler cache contains all but the new files.
    run("cmake", "-S", source, "--preset", "release", "-DBUILD_TESTING=OFF")
    run("cmake", "--build", build, "--target", "brdfc")
    return build / "brdfc"


@pytest.fixture(scope="module")
def extension(tool, tmp_path_factory):
    out = tmp_path_factory.mktemp("extension")
    run(tool, "build", "--model", "lunar_lambert", "--out", out)
    (zip_file,) = out.glob("brdfc_shaders-*.zip")
    return zip_file


def scene(environment, camera, shape):
    return {
        "name": "example",
        "description": "The model of docs/add-a-model.md",
        "settings": {"width": 48, "height": 48, "spp": 256, "seed": 1, "max_bounces": 1},
        "camera": camera,
        "materials": {"m": {"model": "lunar_lambert", "parameters": {"l": L, "rho": list(RHO)}}},
        "objects": [{"name": "thing", "shape": shape, "material": "m"}],
        "lights": [],
        "environment": environment,
    }


@pytest.fixture
def renderers(tool, extension, tmp_path):
    """(reference, blender, compare) for the scene that was passed to reference()."""

    def reference(content, spp):
        source = tmp_path / "example.json"
        source.write_text(json.dumps(content), encoding="utf-8")
        run(tool, "scene", source, "--out", tmp_path)
        out = tmp_path / "reference.exr"
        run(tool, "render", tmp_path / "scene.json", "--out", out, "--spp", spp)
        return out

    def blender(seed):
        out = tmp_path / f"blender-{seed}.exr"
        script = ROOT / "script" / "render_scene.py"
        command = [BLENDER_PYTHON, script, "--extension", extension, "--seed", seed]
        (record,) = json.loads(run(*command, "--scene", tmp_path / "scene.json", "--out", out))
        assert record["materials"]["m"][0]["model"] == "lunar_lambert"
        return out

    def compare(a, b):
        return json.loads(run(tool, "compare", a, b, "--json"))

    return reference, blender, compare


def test_parameters_are_listed(tool):
    models = {m["name"]: m for m in json.loads(run(tool, "list", "--json"))}
    parameters = {p["name"]: p for p in models["lunar_lambert"]["parameters"]}
    assert parameters["l"]["default"] == 0.5
    assert parameters["rho"]["default"] == [0.8, 0.8, 0.8]


def test_values_equal_the_formula(tool):
    lines = ["wi_x,wi_y,wi_z,wo_x,wo_y,wo_z"]
    pairs = [(0.1, 0.9), (0.7, 0.7), (1.2, 0.3), (1.5, 1.4)]
    for theta_i, theta_o in pairs:
        wi = (math.sin(theta_i), 0.0, math.cos(theta_i))
        wo = (0.0, math.sin(theta_o), math.cos(theta_o))
        lines.append(",".join(repr(v) for v in (*wi, *wo)))
    rho = ",".join(map(str, RHO))
    out = run(tool, "eval", "lunar_lambert", f"l={L}", f"rho={rho}", text="\n".join(lines) + "\n")
    rows = list(csv.DictReader(out.splitlines()))
    assert len(rows) == len(pairs)
    for (theta_i, theta_o), row in zip(pairs, rows, strict=True):
        cos_i, cos_o = math.cos(theta_i), math.cos(theta_o)
        f = (L / 2 / (cos_i + cos_o) + 1 - L) / math.pi
        assert [float(row[c]) for c in ("f_r", "f_g", "f_b")] == pytest.approx(
            [r * f for r in RHO], rel=1e-12
        )
        pdf = (1 + 2 * cos_i) / (4 * math.pi)
        assert float(row["pdf"]) == pytest.approx(pdf, rel=1e-12)


@pytest.mark.parametrize("model", ["lunar_lambert", "paper"])
def test_checks_find_no_fault(tool, model):
    run(tool, "check", model)


def test_the_base_carries_the_model(tool):
    """As the page says: everything except what lies between the colours of a ramp."""
    rows = list(csv.DictReader(run(tool, "base", "lunar_lambert").splitlines()))
    assert rows
    for row in rows:
        assert float(row["relative_l1"]) < 0.02
        assert float(row["share"]) == pytest.approx(1, abs=0.02)


def test_four_lines_make_a_picture(tool, tmp_path):
    """The page's own lines, except the compiler, with the folders of this test."""
    page = page_of("add-a-model.md")
    ((name, content),) = re.findall(
        r"<!-- scene: (\S+) -->\n```json\n(.*?)```\n<!-- end of scene", page, re.S
    )
    (tmp_path / name).write_text(content, encoding="utf-8")
    (lines,) = re.findall(r"<!-- commands -->\n((?:    .*\n)+)", page)
    lines = [line.strip() for line in lines.splitlines()]
    full = tmp_path / "build/brdfc_shaders-0.zip"  # the extension of all models
    full.parent.mkdir()
    full.write_bytes(b"")
    assert len(lines) == 4 and lines[0] == "ninja -C build brdfc && build/brdfc check lunar_lambert"
    for line in lines[1:]:
        words = [
            {"build/brdfc": tool, "script/render_scene.py": ROOT / "script/render_scene.py"}.get(
                word, word
            )
            for word in shlex.split(line)
        ]
        if words[0] == ".env/blender-4.5/bin/python":
            words[0] = BLENDER_PYTHON
            at = words.index("--extension") + 1
            (words[at],) = tmp_path.glob(words[at].replace("VERSION", "*"))
            words += ["--spp", 4]
        done = subprocess.run(
            [str(word) for word in words], cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, f"{line}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    assert (tmp_path / "lunar_lambert.png").stat().st_size > 10_000
    assert list(full.parent.glob("*.zip")) == [full]


def test_uniform_light_gives_the_albedo(renderers):
    """A plane seen at 60 degrees under light of radiance 1 reflects its albedo, which has a closed
    form."""
    reference, blender, compare = renderers
    camera = {
        "type": "orthographic",
        "position": [0, -10 * math.sin(math.pi / 3), 5],
        "look_at": [0, 0, 0],
        "up": [0, 0, 1],
        "height": 0.5,
    }
    shape = {"type": "quad", "size": [4, 4]}
    truth = reference(scene({"color": [1, 1, 1]}, camera, shape), spp=1024)
    result = compare(blender(seed=1), truth)
    expected = sum(RHO) / 3 * (L * (1 - 0.5 * math.log(3)) + 1 - L)
    assert result["mean_b"] == pytest.approx(expected, rel=1e-3)
    assert result["mean_a"] == pytest.approx(expected, rel=1e-3)


def test_structured_light_agrees_with_the_reference(renderers):
    """Under light with structure, a wrong distribution of directions would be visible."""
    reference, blender, compare = renderers
    camera = {
        "type": "perspective",
        "position": [0, -4, 1],
        "look_at": [0, 0, 0],
        "up": [0, 0, 1],
        "fov_y_degrees": 25,
    }
    shape = {"type": "sphere", "radius": 1}
    truth = reference(scene({"procedural": "checker"}, camera, shape), spp=2048)
    one, two = blender(seed=1), blender(seed=2)
    against_truth = compare(one, truth)
    assert against_truth["bias"] / against_truth["mean_b"] == pytest.approx(0, abs=0.01)
    # The difference of two pictures with independent noise has twice the variance of a single one.
    assert against_truth["relmse"] < 0.75 * compare(one, two)["relmse"]


def test_a_new_form_is_listed_built_and_measured(tool, tmp_path):
    models = {m["name"]: m for m in json.loads(run(tool, "list", "--json"))}
    assert "flat" in models["lambert"]["representations"]
    assert "flat" not in models["glass"]["representations"]
    content = scene(
        {"color": [1, 1, 1]},
        {"type": "perspective", "position": [0, -4, 1], "look_at": [0, 0, 0], "fov_y_degrees": 25},
        {"type": "sphere", "radius": 1},
    )
    content["materials"] = {
        "a": {"model": "lambert", "representation": "flat"},
        "b": {"model": "phong", "representation": "flat"},
    }
    content["objects"] = [
        {**content["objects"][0], "name": name, "material": name} for name in ("a", "b")
    ]
    source = tmp_path / "flat.json"
    source.write_text(json.dumps(content), encoding="utf-8")
    run(tool, "build", "--scene", source, "--out", tmp_path)
    pack = tmp_path / "brdfc_shaders"
    manifest = json.loads((pack / "manifest.json").read_text(encoding="utf-8"))
    forms = {name: m["representations"]["flat"] for name, m in manifest["models"].items()}
    assert set(forms) == {"lambert", "phong"}
    # A Diffuse BSDF equals Lambert's model, and is far from a highlight.
    assert forms["lambert"]["error"]["relative_l1"] < 1e-6
    assert forms["phong"]["error"]["relative_l1"] > 0.1
    assert forms["phong"]["warnings"] == []
    shader = (pack / forms["phong"]["shader"]).read_text(encoding="utf-8")
    assert "weight_0 * brdfc_diffuse(shading_n)" in shader


@pytest.fixture
def compiled(tool, tmp_path):
    """Compiles a text as the build compiles models: returns the object and the compiler's
    messages."""
    build = tool.parent
    commands = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    entry = next(
        c for c in commands if "/brdfc_models.dir/" in c["command"] and "cmake_pch" not in c["file"]
    )
    # Precompiled headers do not serve -O0, which compiles in half the time.
    words = [word for word in shlex.split(entry["command"]) if word != "-Winvalid-pch"]
    words[words.index("-c") + 1] = source = str(tmp_path / "draft.cpp")

    def compile_text(text, name):
        Path(source).write_text(text, encoding="utf-8")
        words[words.index("-o") + 1] = str(tmp_path / name)
        done = subprocess.run(
            [*words, "-O0"], cwd=entry["directory"], capture_output=True, text=True
        )
        return tmp_path / name, done.stderr

    return compile_text


def test_two_classes_of_one_name_do_not_link(compiled):
    """They would be merged, and one of the two models lost."""
    _, text = example_of("add-a-model.md")
    one, _ = compiled(text, "one.o")
    two, _ = compiled(text.replace('"lunar_lambert"', '"other"'), "two.o")
    three, _ = compiled(text.replace("LunarLambert", "Other"), "three.o")

    def link(*objects):
        return subprocess.run(
            ["ld", "-r", "-o", "/dev/null", *objects], capture_output=True, text=True
        )

    assert link(one, three).returncode == 0
    done = link(one, two)
    assert done.returncode != 0
    assert "multiple definition" in done.stderr
    assert "only_one_model_has_the_class_LunarLambert" in done.stderr
    page = (ROOT / "docs" / "add-a-model.md").read_text(encoding="utf-8")
    assert "only_one_model_has_the_class_LunarLambert" in page


def test_a_first_draft_compiles(compiled):
    """With nothing in info() but the necessary, and with a direction that eval() does not use."""
    _, text = example_of("add-a-model.md")
    for left_out in (".label", ".paper", ".equations", ".doc", ".properties"):
        text = re.sub(rf"^ *\{left_out} = .*,(?: *//.*)?\n", "", text, flags=re.M)
        assert left_out not in text
    text = re.sub(r",\n *\.params = {}", "", text).replace("{.name", "{.name")
    text = text.replace("return select(above(wi, wo), rho", "return select(wi.z > T(0), rho")
    text = text.replace("maximum(wi.z + wo.z,", "maximum(wi.z,")
    path, said = compiled(text, "draft.o")
    assert path.exists() and said == ""


def test_an_if_on_data_says_what_to_write(compiled):
    _, text = example_of("add-a-model.md")
    place = "    return select(above(wi, wo), rho"
    assert place in text
    path, said = compiled(
        text.replace(place, f"    if (sum < T(0)) return Rgb<T>(T(0));\n{place}"), "if.o"
    )
    assert not path.exists()
    assert "select(condition, a, b)" in said


def test_a_name_taken_twice_is_an_error_of_every_command(tool):
    """Reported by main(), which has not started when models register."""
    _, text = example_of("add-a-model.md")
    twice = tool.parents[1] / "generator" / "models" / "twice.cpp"
    twice.write_text(text.replace("LunarLambert", "Twice"), encoding="utf-8")
    try:
        run("cmake", "--build", tool.parent, "--target", "brdfc")
        for command in (["list"], ["check", "ward"]):
            done = subprocess.run([tool, *command], capture_output=True, text=True)
            assert done.returncode == 2
            (line,) = done.stderr.splitlines()
            assert line.startswith("brdfc: ") and "two models are named lunar_lambert" in line
            assert "lunar_lambert.cpp" in line and "twice.cpp" in line
    finally:
        twice.unlink()
        run("cmake", "--build", tool.parent, "--target", "brdfc")
