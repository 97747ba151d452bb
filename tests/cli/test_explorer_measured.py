# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured files on the page of `brdfc explorer`: dropped on it, or chosen, in a headless Chromium.
What the page draws of them is what `brdfc measured` reads; what it can't read, it says."""

import io
import json
import shlex
import struct
import subprocess

import numpy as np
import pytest
from browser import Browser
from measured_files import rgl_fields, utia, utia_directions
from measured_formats import MERL, direction, merl, merl_directions, tensor
from measured_formats import unit as unit_vectors
from support import BROWSERS, CHROMIUM, TOOL

pytestmark = pytest.mark.slow

#: Relative to the largest value.
TOLERANCE = 1e-4
COLUMNS = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z"
HEADER = struct.pack("<3i", *MERL)


def shiny():
    """A lobe over a matte base, with noise; entries and whole rows that were not measured."""
    wi, wo = merl_directions()
    lobe = np.clip(unit_vectors(wi + wo)[:, 2:], 0, 1) ** 40
    f = np.array([0.1, 0.05, 0.02]) + lobe * np.array([0.5, 0.6, 0.7])
    random = np.random.default_rng(5)
    f *= random.normal(1, 0.02, f.shape)
    f = f.reshape(*MERL, 3)
    f[random.random(MERL) < 0.02] = -1
    f[30:33, :, 20:40] = -1
    f[40, 10] = -1
    f[random.random(f.shape) < 0.001] = -1e-4
    f[(wi[:, 2] < 0).reshape(MERL) | (wo[:, 2] < 0).reshape(MERL)] = -1
    return f.reshape(-1, 3)


def brushed(wi, wo):
    """Anisotropic, and not reciprocal; with a channel below 0."""
    h = unit_vectors(wi + wo)
    lobe = np.exp(-6 * h[:, 0] ** 2 - 2 * h[:, 1] ** 2) * (1 + 0.3 * wi[:, 0])
    return 0.05 + lobe[:, None] * np.array([0.2, 0.15, -0.1])


def table(theta_i, phi_i, theta_o, phi_o, unit=""):
    """A table of text over a grid of degrees, of a lobe that is not reciprocal."""
    grid = np.stack(np.meshgrid(theta_i, phi_i, theta_o, phi_o, indexing="ij"), -1).reshape(-1, 4)
    radians = np.radians(grid)
    wi, wo = direction(*radians[:, :2].T), direction(*radians[:, 2:].T)
    h = unit_vectors(wi + wo)
    lobe = np.exp(-6 * h[:, 0] ** 2 - 2 * h[:, 1] ** 2) * (1 + 0.3 * wi[:, 2])
    if len(np.atleast_1d(phi_i)) == 1:
        lobe = np.exp(-9 * (1 - h[:, 2]))
    f = 0.05 + lobe[:, None] * np.array([0.2, 0.15, 0.1])
    names = [name + unit for name in ("theta_i", "phi_i", "theta_o", "phi_o")]
    given, digits = radians if unit == "_rad" else grid, 9
    if unit == "vectors":
        names, given, digits = COLUMNS.split(","), np.hstack([wi, wo]), 7
    rows = np.hstack([given, f]).tolist()
    text = "\r\n".join(",".join(f"{x:.{digits}g}" for x in row) for row in rows)
    return (",".join([*names, "r", "g", "B"]) + "\r\n\r\n" + text).encode()


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder of files by name."""
    folder = tmp_path_factory.mktemp("files")
    made = {
        "shiny.binary": merl(shiny()),
        "it's grey.binary": merl(np.full((np.prod(MERL), 3), 0.5 / np.pi)),
        "short.binary": merl(np.ones((np.prod(MERL), 3)))[:-8],
        "size.binary": struct.pack("<3i", 90, 90, 360) + bytes(1000),
        "turned.binary": struct.pack(">3i", *MERL),
        "empty.binary": b"",
        "single.binary": HEADER + bytes(4 * 3 * np.prod(MERL)),
        "nan.binary": merl(np.where(np.arange(np.prod(MERL))[:, None] == 7, np.nan, [1, 1, 1])),
        "holes.binary": merl(np.full((np.prod(MERL), 3), -1)),
        "black.binary": merl(np.zeros((np.prod(MERL), 3))),
        "isotropic.csv": table(range(0, 90, 5), 0, range(0, 86, 5), range(0, 181, 10)),
        "circle.csv": table([10, 30, 60, 80], 0, [0, 20, 50, 70], range(0, 360, 30)),
        "anisotropic.csv": table(
            range(0, 81, 20), range(0, 360, 30), range(0, 91, 15), range(15, 360, 30), "_rad"
        ),
        "vectors.csv": table(
            range(0, 81, 20), range(0, 360, 30), range(0, 81, 16), range(0, 360, 45), "vectors"
        ),
        "long.csv": f"{COLUMNS},r,g,b\n0,0,1,0,0,1.1,1,1,1\n".encode(),
        "below.csv": f"{COLUMNS},r,g,b\n0,0,1,0,0,-1,1,1,1\n".encode(),
        "gap.csv": table([0, 40], 0, [0, 40], [0, 90, 180]).rsplit(b"\r\n", 1)[0],
        "empty.csv": b"",
        "text.csv": b"theta_i,phi_i,theta_o,phi_o,r,g,b\n0,0,0,0,1,1,red\n",
        "angle.csv": b"theta_i,phi_i,theta_o,phi_o,r,g,b\n95,0,0,0,1,1,1\n",
        "columns.csv": b"theta_i,phi_i,theta_o,r,g,b\n95,0,0,0,1,1,1\n",
        "twice.csv": b"theta_i,phi_i,theta_o,phi_o,r,g,b\n9,0,9,0,1,1,1\n9,0,9,360,1,1,2\n",
        "radians.csv": table([0, 0.5, 1], 0, [0, 0.5, 1], [0, 1, 2, 3]),
        "semicolons.csv": b"theta_i;phi_i;theta_o;phi_o;r;g;b\n10;0;10;0;1;1;1\n",
        "dark.csv": b"theta_i,phi_i,theta_o,phi_o,r,g,b\n10,0,10,0,0,0,0\n",
        "utia.bin": utia(brushed(*utia_directions())),
        "short.bin": bytes(1000),
        "nan.bin": utia(np.full((288 * 288, 3), np.nan)),
        "isotropic.bsdf": tensor(rgl_fields("isotropic")),
        "anisotropic.bsdf": tensor(rgl_fields("anisotropic")),
        "quarter.bsdf": tensor(rgl_fields("quarter")),
        "spectral.bsdf": tensor(rgl_fields("spectral")),
        "infrared.bsdf": tensor(
            rgl_fields("spectral") | {"wavelengths": np.linspace(800, 900, 13, dtype=np.float32)}
        ),
        "not.bsdf": bytes(1000),
        "short.bsdf": tensor(rgl_fields("isotropic"))[:-1],
        "head.bsdf": tensor(rgl_fields("isotropic"))[:40],
        "empty.bsdf": b"",
        "fields.bsdf": tensor({k: a for k, a in rgl_fields("isotropic").items() if k != "vndf"}),
        "picture.png": b"\x89PNG\r\n\x1a\n",
        "panel.xml": b"<WindowElement/>",
    }
    for name, data in made.items():
        (folder / name).write_bytes(data)
    (folder / "folder.binary").mkdir()
    return folder


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The page's address."""
    out = tmp_path_factory.mktemp("explorer") / "page"
    done = subprocess.run([TOOL, "explorer", "--out", out], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return (out / "index.html").as_uri()


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    if CHROMIUM is None:
        pytest.skip(f"none of {', '.join(BROWSERS)} is installed: the explorer was not tested")
    browser = Browser(CHROMIUM, tmp_path_factory.mktemp("profile"))
    yield browser
    browser.close()


@pytest.fixture
def browser(chromium, page):
    """The page as it opens, which reports nothing to the console during a test."""
    chromium.console.clear()
    chromium.open("about:blank")
    chromium.resize(1280, 900)
    chromium.open(page)
    chromium.run("quality = 0.2")
    yield chromium
    assert chromium.console == []


def dropped(browser, *files):
    browser.drop(*files)
    browser.wait_for("!byId('status').textContent.startsWith('Reading') && fileOf(state.slots[0])")


def said(browser, *files):
    """The sentences about files that can't be shown."""
    browser.run("byId('error').hidden = true")
    browser.drop(*files)
    browser.wait_for("!byId('error').hidden")
    return browser.run("byId('error').textContent").splitlines()


def directions(turn=0):
    """Pairs of unit vectors in single precision: on a grid, and about the mirror direction."""
    pairs = []
    for view in (0, 20, 45, 70, 86):
        grid = [(t, p) for t in range(0, 90, 6) for p in range(0, 360, 25)]
        about = [(abs(view + d), 180 + a) for d in (-5, -1, -0.3, 0, 0.5, 3) for a in (0, 1, 7)]
        for theta, phi in [*grid, *about]:
            angles = np.radians([[min(theta, 89.5), phi + 10 + turn], [view, 10]])
            s, c = np.sin(angles), np.cos(angles)
            pairs.append(np.stack([s[:, 0] * c[:, 1], s[:, 0] * s[:, 1], c[:, 0]], -1))
    # A direction along the normal, as that of atan2(0, -0), would have the azimuth 180.
    return np.float32(pairs) + np.float32(0)


def of_the_tool(file, pairs):
    rows = pairs.astype(float).reshape(-1, 6).tolist()
    text = "\n".join([COLUMNS, *(",".join(map(repr, row)) for row in rows)])
    command = [TOOL, "measured", file, "--pairs"]
    done = subprocess.run(command, input=text, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return np.loadtxt(io.StringIO(done.stdout), delimiter=",", skiprows=1)[:, :3]


def of_the_page(browser, pairs):
    wi, wo = json.dumps(pairs[:, 0].tolist()), json.dumps(pairs[:, 1].tolist())
    found = browser.run(f"Array.from(renderer.evaluate(state.slots[0], {wi}, {wo}))")
    return np.array(found).reshape(-1, 4)


def albedo_of_the_tool(file, degrees):
    command = [TOOL, "measured", file, "--models", "none", "--json", "--at", degrees]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [view["rgb"] for view in json.loads(done.stdout)["albedo"]]


FILES = (
    "shiny.binary",
    "isotropic.csv",
    "circle.csv",
    "anisotropic.csv",
    "vectors.csv",
    "isotropic.bsdf",
    "anisotropic.bsdf",
    "quarter.bsdf",
    "spectral.bsdf",
    "utia.bin",
)


@pytest.mark.parametrize("name", FILES)
def test_values_and_albedos_are_those_of_the_tool(browser, files, name):
    dropped(browser, files / name)
    # Slices of these files have ends that differ, where the light is in the plane of the view.
    pairs = directions(0.1 if name.endswith(".bsdf") else 0)
    truth, found = of_the_tool(files / name, pairs), of_the_page(browser, pairs)
    assert np.abs(found[:, :3] - truth).max() < TOLERANCE * truth.max()
    assert (found[:, 3] > 0).all()
    # The tool's are means over eight azimuths.
    azimuths = (np.arange(8) * np.pi / 4).tolist() if name[0] in "aquv" else [0]
    got = browser.run(f"{azimuths}.map((a) => Array.from(renderer.albedo(state.slots[0], 46, a)))")
    got = np.reshape(got, (len(azimuths), -1, 4)).mean(0)[[1, 15, 30, 40], :3]
    assert got == pytest.approx(np.array(albedo_of_the_tool(files / name, "2,30,60,80")), abs=0.01)


def test_what_was_not_measured_is_said_as_by_the_tool(browser, files):
    dropped(browser, files / "shiny.binary")
    shown = browser.run("document.querySelector('#slots .about').textContent")
    command = [TOOL, "measured", files / "shiny.binary", "--models", "none", "--json"]
    notes = json.loads(subprocess.run(command, capture_output=True).stdout)["notes"]
    assert len(notes) == 2
    for note in notes:
        assert note.split(":")[0] in shown


def test_a_grey_file_looks_like_the_grey_model(browser, files):
    """In both kinds of light, with the model's albedo, and without a difference."""
    browser.run("readAddress('#m=lambert,rho=0.5'); rebuild()")
    dropped(browser, files / "it's grey.binary")
    found = browser.run("""["lamp", "sky"].map((light) => state.slots.map((slot, k) => {
      const picture = {};
      for (let i = 0; i < 16; ++i)
        renderer.addSample(picture, `${light} ${k}`, slot, light, 64, lampDirection([-0.4, 0.3]));
      return Array.from(renderer.read(picture.sum));
    }))""")
    lamp, sky = np.array(found).reshape(2, 2, -1)
    assert lamp.max() > 1 and lamp[0] == pytest.approx(lamp[1], abs=1e-4)
    assert sky[0].sum() == pytest.approx(sky[1].sum(), rel=0.01)
    there = browser.run("renderer.difference(state.slots, 0.5, 0)")
    assert there["here"] < 1e-4 and there["everywhere"] < 1e-4
    browser.wait_for("stale.size === 0")
    assert " %of the light, over all views" in browser.run("byId('difference-text').textContent")
    assert browser.run("document.querySelectorAll('#slice .curve, #albedo .curve').length") == 4


def test_a_file_has_a_lobe_that_a_mouse_turns(browser, files):
    browser.run("readAddress('#m=lambert,rho=0.5&view=lobe'); rebuild()")
    dropped(browser, files / "it's grey.binary")
    browser.wait_for("stale.size === 0 && pictures.every((p) => p.top > 0)")
    assert browser.run("pictures.map((p) => p.top)") == pytest.approx(2 * [0.5 / np.pi], rel=1e-4)
    browser.run("scrollTo(0, 0)")
    box = browser.run("""(() => {
      const {left, top, width} = document.querySelector("#pictures canvas").getBoundingClientRect();
      return [left, top, width];
    })()""")
    x, y, width = box
    for kind, dx in [("mousePressed", 0.5), ("mouseMoved", 0.6), ("mouseReleased", 0.6)]:
        where = {"x": x + dx * width, "y": y + 0.5 * width}
        browser.call("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1, **where)
    assert browser.run("state.turned") == pytest.approx([-25 - 18, 20], abs=0.2)
    assert browser.console == []


BAD = {
    "short.binary": "expected 34992012 bytes, 3 planes of 1458000 doubles after a header of 12 "
    "bytes, got 34992004: truncated?",
    "size.binary": "header: expected 90 x 90 x 180 values of theta_h, theta_d and phi_d, as MERL's "
    "files have, found 90 x 90 x 360.",
    "turned.binary": "the byte order is reversed",
    "empty.binary": "expected a header of three numbers, as MERL's files have, found 0 bytes.",
    "single.binary": "got 17496012: are these numbers in single precision?",
    "nan.binary": "red: found NaN at entry 7: expected finite numbers.",
    "holes.binary": "expected values above the horizon, found none.",
    "black.binary": "expected a number above 0, found none: the data are black.",
    "gap.csv": "expected a row for every combination of angles: 2 theta_i, 1 phi_i, 2 theta_o, "
    "3 phi_o, found 7 rows; none of theta_i 40, phi_i 0, theta_o 40, phi_o 180.",
    "empty.csv": "expected a header with the columns theta_i,phi_i,theta_o,phi_o,r,g,b.",
    "text.csv": "line 2: b: expected a finite number, got 'red'.",
    "angle.csv": "line 2: theta_i: expected degrees from 0 to 90, got 95.",
    "columns.csv": "expected a header with the columns theta_i,phi_i,theta_o,phi_o,r,g,b; phi_o is "
    "missing.",
    "twice.csv": "line 3: expected each combination of angles once, or the same values: theta_i 9, "
    "phi_i 0, theta_o 9, phi_o 0 is in line 2, too.",
    "radians.csv": "expected degrees, and all are small",
    "long.csv": "line 2: expected a unit vector, its length is 1.1.",
    "below.csv": "line 2: expected directions above the surface.",
    "semicolons.csv": "expected fields separated by commas, got semicolons.",
    "dark.csv": "expected a number above 0, found none: the data are black.",
    "infrared.bsdf": "wavelengths: expected 430 to 650 nm at least, got 800 to 900.",
    "short.bin": "expected 1990656 bytes, 3 planes of 288 x 288 doubles, as UTIA's files have, got "
    "1000: truncated?",
    "nan.bin": "red: found NaN in row 0, column 0: expected finite numbers",
    "not.bsdf": 'expected a tensor file, which starts with "tensor_file".',
    "short.bsdf": "expected its data inside the file, which has",
    "head.bsdf": "truncated?",
    "empty.bsdf": "expected a tensor file",
    "fields.bsdf": "vndf: expected this field, found none of the name.",
    "picture.png": "expected a file whose name ends with one of .binary, .bsdf, .bin, .csv.",
    "panel.xml": "; brdfc measured reads this one, too.",
    "folder.binary": "expected a file that can be read; this one can't.",
}


def test_what_is_wrong_with_a_file_is_said_in_one_sentence(browser, files):
    before = browser.run("addressOf()")
    found = said(browser, *(files / name for name in BAD))
    assert len(found) == len(BAD)
    for sentence, (name, expected) in zip(found, BAD.items(), strict=True):
        assert sentence.startswith(f"{name}: ") and expected in sentence
    # The page goes on.
    assert browser.run("addressOf()") == before and browser.run("files.size") == 0
    browser.wait_for("stale.size === 0 && pictures.every((p) => p.samples > 0)")
    dropped(browser, files / "short.binary", files / "shiny.binary")
    assert "short.binary" in browser.run("byId('error').textContent")
    assert browser.run("state.slots.map((s) => s.model)") == ["file1", "microfacet", "ward"]


def test_files_are_chosen_without_a_mouse(browser, files):
    """The button is in the order of the keyboard, and what it did is said."""
    browser.call("Page.setInterceptFileChooserDialog", enabled=True)
    browser.run("byId('add-file').focus()")
    browser.press_enter()
    browser.wait_for("document.activeElement.id === 'add-file'")
    assert "Page.fileChooserOpened" in browser.events
    browser.choose("#file", files / "shiny.binary")
    browser.wait_for("state.slots.length === 3")
    assert browser.run("byId('status').textContent") == "Shown first: shiny.binary."
    named = browser.run("document.querySelector('#slots .slot').getAttribute('aria-label')")
    assert named == "Model 1: shiny.binary"
    # Once more, and removed: the menus still offer it.
    browser.choose("#file", files / "shiny.binary")
    browser.wait_for("byId('status').textContent === ''")
    browser.run("document.querySelector('[aria-label=\"Remove model 1\"]').click()")
    assert browser.run("state.slots.length") == 2
    browser.run("""(() => {
      const menu = document.querySelectorAll("#slots .head select")[1];
      menu.value = "file1";
      menu.dispatchEvent(new Event("change"));
    })()""")
    assert browser.run("state.slots.map((s) => s.model)") == ["microfacet", "file1"]


def test_a_fifth_column_is_declined(browser, files):
    browser.run("readAddress('#m=ward&m=lambert&m=phong&m=blinn'); rebuild()")
    (sentence,) = said(browser, files / "shiny.binary")
    assert "choose the file in the menu of one of them" in sentence
    assert browser.run("state.slots.length") == 4
    assert browser.run("document.querySelectorAll('#slots option[value=file1]').length") == 4


def test_files_stay_in_order_and_their_names_are_text(browser, files):
    name = "<img src=x onerror=alert(1)>.csv"
    (files / name).write_bytes((files / "isotropic.csv").read_bytes())
    dropped(browser, files / name, files / "utia.bin")
    shown = "[...document.querySelectorAll('#pictures figcaption')].map((e) => e.textContent)"
    assert browser.run(shown) == [name, "utia.bin", "Microfacet", "Ward"]
    assert browser.run("document.querySelectorAll('img').length") == 0
    browser.wait_for("stale.size === 0")


def test_a_device_without_memory_is_told(browser, files):
    browser.run("""(() => {
      let asked = 0;
      renderer.gl.getError = () => (++asked === 2 ? renderer.gl.OUT_OF_MEMORY : 0);
    })()""")
    (sentence,) = said(browser, files / "isotropic.csv")
    assert sentence.startswith("isotropic.csv: expected less data: this device has no memory")
    assert browser.run("Object.keys(BRDFC.models).filter((m) => BRDFC.models[m].file)") == []


def test_a_link_does_not_carry_a_file_and_says_so(browser, files):
    dropped(browser, files / "shiny.binary")
    assert browser.run("addressOf()") == "#m=microfacet&m=ward"
    card = browser.run("document.querySelector('#slots .slot').textContent")
    assert "can't carry the file" in card and "stay in this browser" in card
    assert browser.run("readAddress('#m=file1&m=ward')") == ["m=file1"]


def test_what_is_copied_of_a_file_runs(browser, files):
    name = "it's grey.binary"
    dropped(browser, files / name)
    texts = dict(browser.run("recipes(state.slots[0])"))
    assert texts["Fits"] == "brdfc measured './it'\\''s grey.binary'"
    assert f'brdfc.measured("{name}").eval(wi, wo)' in texts["Python"]
    assert f'api.new_measured_material("{name}")' in texts["Blender"]
    command = texts["Command"].replace("brdfc measured", f"{shlex.quote(TOOL)} measured")
    done = subprocess.run(["sh", "-c", command], cwd=files, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    row = [float(x) for x in done.stdout.split()[1].split(",")]
    assert row[:3] == pytest.approx([0.5 / np.pi] * 3)


@pytest.mark.parametrize("width", [400, 1280])
def test_the_page_fits_its_window(browser, files, width, tmp_path):
    browser.resize(width, 900)
    dropped(browser, files / "shiny.binary")
    assert said(browser, files / "short.binary")
    browser.wait_for("stale.size === 0 && pictures.every((p) => p.samples === SAMPLES.lamp)")
    root = "document.documentElement"
    assert browser.run(f"{root}.scrollWidth <= {root}.clientWidth")
    browser.screenshot(tmp_path / f"{width}.png")
