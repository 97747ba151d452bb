# SPDX-License-Identifier: GPL-3.0-or-later
"""The demonstration of measured materials: the files that it makes, its page, and wrong usage."""

import html
import json
import re
import subprocess
import sys
from types import SimpleNamespace

import demo_measured
import measured_samples
import numpy as np
import OpenImageIO as oiio
import pytest
from measured_formats import direction
from support import ROOT, TOOL, run

DEMO = ROOT / "script" / "demo"
#: In place of Blender: each picture is the one of the data.
NO_BLENDER = """#!{python}
import json, shutil, sys
from pathlib import Path
jobs = json.loads(Path(sys.argv[sys.argv.index("--jobs") + 1]).read_text())
for job in jobs:
    out = Path(job["out"])
    shutil.copyfile(out.with_name("data.exr"), out)
keys = {{"load_wall_seconds": 1, "one_sample_wall_seconds": 0.5, "blender": "4.5"}}
print(json.dumps([job | keys for job in jobs]))
"""


def above(random, count):
    z = random.uniform(0.3, 1, count)
    return direction(np.arccos(z), random.uniform(-np.pi, np.pi, count))


def test_the_made_copper_is_what_it_is_made_of(tmp_path, monkeypatch):
    """Between the directions of the file by interpolation, of light and view anywhere."""
    assert run("python", "--out", tmp_path).returncode == 0
    monkeypatch.syspath_prepend(tmp_path)
    for name in [n for n in sys.modules if n.split(".")[0] == "brdfc"]:
        monkeypatch.delitem(sys.modules, name)
    seen = []
    of_models = measured_samples.f_of
    monkeypatch.setattr(
        measured_samples, "f_of", lambda models, *w: seen.append(models) or of_models(models, *w)
    )
    file = tmp_path / "copper.bsdf"
    file.write_bytes(measured_samples.brushed_copper())
    random = np.random.default_rng(1)
    wi, wo = above(random, 500), above(random, 500)
    rows = "".join(",".join(map(str, [*a, *b])) + "\n" for a, b in zip(wi, wo, strict=True))
    command = [TOOL, "measured", file, "--pairs"]
    pairs = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n" + rows
    said = subprocess.run(command, input=pairs, capture_output=True, text=True, check=True).stdout
    found = np.array([line.split(",")[:3] for line in said.splitlines()[1:]], float)
    expected = of_models(seen[0], wi, wo)
    assert np.abs(found - expected).sum() < 0.05 * expected.sum()
    for name in [n for n in sys.modules if n.split(".")[0] == "brdfc"]:
        monkeypatch.delitem(sys.modules, name)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--measured", "none.csv"], "--measured expects files of measured materials"),
        (["--measured", "--all"], "--measured takes no other option but --size"),
        (["--measured", "--scene", "lamps"], "--measured takes no other option but --size"),
        (["none.csv"], "unknown argument 'none.csv'"),
    ],
)
def test_wrong_usage(arguments, message):
    done = subprocess.run([DEMO, *arguments], capture_output=True, text=True)
    assert done.returncode == 2 and message in done.stderr


@pytest.fixture
def demo(tmp_path):
    """demo(file...): runs the script with a program in place of Blender."""
    python, extension = tmp_path / "python", tmp_path / "extension.zip"
    python.write_text(NO_BLENDER.format(python=sys.executable))
    python.chmod(0o755)
    extension.write_bytes(b"")

    def start(*files):
        command = [sys.executable, demo_measured.__file__, "--tool", TOOL, "--python", python]
        command += ["--extension", extension, "--out", tmp_path / "out", "--size", "8", *files]
        return subprocess.run(command, capture_output=True, text=True)

    return start


def test_files_that_are_not_measured_are_refused(tmp_path, demo):
    bad, other = tmp_path / "bad.csv", tmp_path / "other" / "bad.binary"
    other.parent.mkdir()
    for file in (bad, other):
        file.write_text("1,2,3\n")
    done = demo(bad)
    assert done.returncode == 2 and "bad.csv" in done.stderr
    done = demo(bad, other)
    assert done.returncode == 2 and "expected files of different names, got bad" in done.stderr


def test_a_page_of_a_file_of_any_name(tmp_path):
    """Addresses of pictures lead to them, and texts are shown as they are."""
    options = SimpleNamespace(out=tmp_path)
    demo = demo_measured.Demo.__new__(demo_measured.Demo)
    demo.options, demo.file, demo.folder = options, tmp_path / "a & #1.csv", tmp_path / "a & #1"
    demo.about, demo.kind, demo.processor = "Paint <wet>", "CSV", "x86"
    demo.told = {"notes": ["a < b."], "lacks": []}
    demo.materials = dict.fromkeys(
        demo_measured.FITS, {"model": "lambert", "parameters": {"rho": 0.5}}
    )
    demo.misplaced, demo.seconds = (dict.fromkeys(demo_measured.FITS, x) for x in (0.123, 2))
    record = {"load_wall_seconds": 1, "one_sample_wall_seconds": 0.5, "blender": "4.5"}
    demo.pictures = {(name, osl): record for name in demo_measured.FITS for osl in (True, False)}
    demo_measured.write_page([demo], tmp_path)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert len(set(re.findall(r'src="a%20%26%20%231/[\w.-]+"', page))) == 1 + 4 * 3
    assert page.count("src=") == 2 * (1 + 2 * 3)
    text = html.unescape(re.sub("<[^>]*>", "", page))
    for said in ("a & #1.csv", "Paint <wet>. CSV. A < b.", "12 %", "first pixel after 3.5 s"):
        assert said in text, said


@pytest.mark.long
@pytest.mark.slow
def test_a_page_of_a_file(tmp_path, demo):
    """Two lobes, of which a sum of lobes misplaces less than a model; a second run starts no
    program."""
    theta, phi = np.arange(0, 90, 10), np.arange(0, 181, 20)
    grid = np.stack(np.meshgrid(theta, [0], theta, phi, indexing="ij"), -1).reshape(-1, 4)
    wi = direction(*np.radians(grid[:, :2]).T)
    wo = direction(*np.radians(grid[:, 2:]).T)
    half = wi + wo
    cosine = half[:, 2] / np.linalg.norm(half, axis=-1)
    back = np.clip((wi * wo).sum(-1), 0, 1)
    f = 0.05 + 0.6 * cosine[:, None] ** [40, 40, 20] + 0.3 * back[:, None] ** [9, 9, 9]
    file = tmp_path / "paint.csv"
    rows = np.concatenate([grid, f], 1)
    header = "theta_i,phi_i,theta_o,phi_o,r,g,b"
    np.savetxt(file, rows, "%.7g", ",", header=header, comments="")

    done = demo(file)
    assert done.returncode == 0, done.stderr
    out = tmp_path / "out"
    page = (out / "index.html").read_text()
    named = [part.split('"')[0] for part in page.split('src="')[1:]]
    assert len(set(named)) == 1 + 2 * 2 * len(demo_measured.FITS)
    for name in named:
        assert oiio.ImageBuf(str(out / name)).spec().width == 8, name
    assert oiio.ImageBuf(str(out / "sheet.jpg")).spec().width > 500
    scenes = {n: json.loads((out / "paint" / f"{n}.json").read_text()) for n in demo_measured.FITS}
    assert scenes["curves"]["materials"]["ball"]["model"] == "factors"
    assert len(scenes["lobes"]["materials"]["ball"]["sum"]) > 1
    said = re.findall(r"^ +(\S.*?) +error +([\d.]+) %", done.stdout, re.M)
    off = {fit: float(error) for fit, error in said}
    assert off["sum of lobes"] < off["nearest formula"] and off["sum of lobes"] < off["curves"]
    records = {p: p.read_bytes() for p in (out / "paint" / "tasks").glob("*.json")}
    assert demo(file).returncode == 0
    assert records == {p: p.read_bytes() for p in records}
