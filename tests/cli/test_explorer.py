# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of `brdfc explorer` in a headless Chromium, which draws without a GPU.

One start of the browser opens the page with a script at its end, which has the page draw every
model, evaluates formulas at given directions, and leaves what it found in the page as JSON.
"""

import csv
import io
import itertools
import json
import re
import shlex
import subprocess
from types import SimpleNamespace

import numpy as np
import pytest
from browser import found_by_page
from support import BROWSERS, CHROMIUM, LISTED, MODELS, ROOT, TOOL

pytestmark = pytest.mark.slow

#: A clear base of thin_film.
CLEAR = "n_r={0} n_g={0} n_b={0} k_r=0 k_g=0 k_b=0"
#: Relative errors of f and pdf in single precision; and larger ones, of extreme parameters.
TOLERANCE = 1e-4
STIFF = {
    ("coupled", "fresnel=dielectric r0=0.9999999"): 0.3,
    ("lossless", "kernel=exponential n=10000"): 1e-3,
    # What films hardly reflect is a difference from 1: of some, of antireflective ones, of none.
    (
        "thin_film",
        f"thickness=268 film_ior=2.3 {CLEAR.format('1.33')} ax=0.3 ay=0.3",
    ): 1e-3,
    ("thin_film", f"thickness=100 film_ior=1.2247 {CLEAR.format('1.5')} ax=0.0001 ay=1"): 1e-3,
    ("thin_film", f"film_ior=1 {CLEAR.format('1')}"): 0.5,
    # Narrower than single precision resolves: only that no value is invalid or too large.
    ("radziszewski_alda", "proportion=custom n_theta=100000000 n_phi=0"): 1,
}
CHECK = """
const found = {errors: [], values: [], pages: {}};
window.addEventListener("error", (e) => found.errors.push(e.message));
const attempt = (what, run) => {
  try {
    return run();
  } catch (error) {
    found.errors.push(`${what}: ${error.message}`);
  }
};
quality = 0.2;  // small pictures
/** A lobe as it is drawn, and distances of its surface from the origin. */
const lobeOf = (address) => {
  const unread = readAddress(address), fill = renderer.fillLobe;
  let mesh;
  renderer.fillLobe = (key, made) => fill.call(renderer, key, mesh = made);
  rebuild();
  drawPictures(true);
  renderer.fillLobe = fill;
  const canvas = document.querySelector("#pictures canvas"), {width} = canvas;
  const {data} = canvas.getContext("2d").getImageData(0, 0, width, width);
  const {directions} = lobeDirections(radians(state.theta), radians(state.azimuth),
    formulasOf(state.slots[0]).through);
  const count = pictures[0].top > 0 ? directions.length : 0;
  const radii = directions.slice(0, count).map((d, i) => {
    const p = mesh.vertices.slice(LOBE_NUMBERS * i, LOBE_NUMBERS * i + 3);
    return Math.hypot(...p);
  });
  // How far each radius is from the cosine.
  const off = radii.reduce((a, r, i) => Math.max(a, Math.abs(r - Math.abs(directions[i][2]))), 0);
  const shown = mesh.vertices.filter((_, i) => i >= LOBE_NUMBERS * count && i % LOBE_NUMBERS === 0);
  return {
    unread, off, top: pictures[0].top, label: canvas.getAttribute("aria-label"),
    radius: radii.reduce((a, x) => Math.max(a, x), 0),
    finite: mesh.vertices.every(Number.isFinite), rods: shown.length,
    error: renderer.gl.getError(),
    // Pixels of each row that are no background, and how bright the picture is.
    rows: Array.from({length: width}, (_, y) => {
      let n = 0;
      for (let x = 0; x < width; ++x) n += data[4 * (y * width + x) + 3] > 200;
      return n;
    }),
    light: data.reduce((a, x, i) => a + (i % 4 < 3 ? x : 0), 0),
  };
};
for (const {model, values} of CASES)
  found.values.push(attempt(model, () => {
    const slot = {model, values: {...defaultsOf(model), ...values}};
    return Array.from(renderer.evaluate(slot, LIGHTS, VIEWS));
  }));
for (const model of MODELS)
  found.pages[model] = attempt(model, () => {
    readAddress(`#m=${model}`);
    rebuild();
    const lit = {};
    for (const view of ["lamp", "sky"]) {
      state.view = view;
      pictures = state.slots.map(() => ({}));
      drawPictures(true);
      const pixels = renderer.read(pictures[0].sum);
      lit[view] = [pixels.reduce((a, x) => a + x, 0), pixels.reduce((a, x) => Math.min(a, x), 0)];
    }
    const lobe = lobeOf(`#m=${model}&view=lobe&theta=40`);
    drawSlice();
    drawAlbedo();
    const albedo = Array.from(renderer.albedo(state.slots[0], ALBEDO_ANGLES, 0));
    const curves = document.querySelectorAll("#slice .curve, #albedo .curve").length;
    const error = byId("error").hidden ? "" : byId("error").textContent;
    return {lit, lobe, albedo, curves, error};
  });
found.differences = PAIRS.map((address) => attempt(address, () => {
  readAddress(address);
  rebuild();
  drawPictures(true);
  drawDifference();
  return {...renderer.difference(state.slots, 0.5, 0), text: byId("difference-text").textContent};
}));
/** The mean colour of a picture in another light, and how much of the picture the object covers. */
const brightness = (address, light, samples, at = "-0.4:0.3") => {
  readAddress(`${address}&lamp=${at}`);
  SAMPLES[light] = samples;
  const picture = {}, sums = [0, 0, 0, 0], [slot] = state.slots, lamp = lampDirection(state.lamp);
  for (let i = 0; i < samples; ++i)
    renderer.addSample(picture, light, slot, light, 64, lamp, state.shape);
  renderer.read(picture.sum).forEach((x, i) => { sums[i % 4] += x; });
  return [...sums.slice(0, 3).map((x) => x / sums[3]), sums[3] / samples / 64 ** 2];
};
// The same integral with directions from the cosine alone; and white light from everywhere.
BRDFC.glsl.plain = BRDFC.glsl.sky
  .replace("int k = 0; k < 4", "int k = 1; k < 2")
  .replace("pdf_0(wi, wo) + cosine_pdf + sun_pdf(d) + box_pdf(d)", "cosine_pdf");
BRDFC.glsl.furnace = BRDFC.glsl.sky
  .replace("vec3 radiance(vec3 d)\\n{", "$&\\n    return vec3(1.0);");
found.sky = attempt("sky", () => ["sky", "plain"].map((l) => brightness("#m=microfacet", l, 200)));
found.furnace = attempt("furnace", () => FURNACE.map((m) => brightness(m, "furnace", 50)));
found.knot = attempt("knot", () =>
  FURNACE.map((m) => brightness(`${m}&shape=knot`, "furnace", 50)));
// A white matte surface lit from the viewer shows the cosine of its normal.
found.facing = attempt("facing", () => ["sphere", "knot"].map((shape) =>
  brightness(`#m=lambert,rho=1&shape=${shape}`, "lamp", 16, "0:0")));
found.shapes = attempt("shapes", () => ["sphere", "knot"].map((shape) =>
  brightness(`#m=microfacet&shape=${shape}`, "sky", 50)));
attempt("lobe", () => {
  quality = 1;
  found.lambert = lobeOf("#m=lambert,rho=0.8:0.4:0.2&view=lobe&theta=0&turned=0:0");
  found.tilted = lobeOf("#m=lambert&view=lobe&theta=75&azimuth=20");
  found.logarithmic = lobeOf("#m=lambert&view=lobe&theta=20&scale=log");
  const address = "#m=lambert&view=lobe&theta=20&turned=30:-10";
  found.lobe_unread = readAddress(address);
  rebuild();
  found.lobe_address = [address, addressOf()];
  const canvas = document.querySelector("#pictures canvas");
  for (const key of ["ArrowLeft", "ArrowUp", "ArrowUp"])
    canvas.dispatchEvent(new KeyboardEvent("keydown", {key, cancelable: true}));
  found.turned = addressOf();
  found.hidden = ["exposure-label", "difference-picture"].map((id) => byId(id).hidden);
  found.lobe_wrong = ["turned=0", "turned=:", "turned=0:91"].map((text) => readAddress(`#${text}`));
  quality = 0.2;
});
attempt("address", () => {
  const ward = "m=ward,ax=0.3,ks=0.1:0.2:0.3,normalisation=duer";
  const address = `#${ward}&m=lambert,rho=0.5&theta=30&view=sky&shape=knot&lamp=0.100:0.200`;
  found.unread = readAddress(address);
  found.address = [address, addressOf()];
  rebuild();
  const slider = byId("p0-ax");
  slider.value = 1;
  slider.dispatchEvent(new Event("input"));
  const canvas = document.querySelector("#pictures canvas");
  canvas.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowUp", cancelable: true}));
  byId("add").click();
  document.querySelector('[aria-label="Remove model 2"]').click();
  found.moved = addressOf();
  const named = (e) => e.getAttribute("aria-label") || e.getAttribute("aria-labelledby") ||
    [...(e.labels || [])].map((label) => label.textContent).join("") || e.textContent;
  const controls = [...document.querySelectorAll("input, select, button, canvas, svg")];
  found.unnamed = controls.filter((e) => !named(e).trim()).map((e) => e.outerHTML);
  found.controls = controls.length;
  readAddress(address);
  found.recipes = recipes(state.slots[0]).map(([, text]) => text);
  readAddress("#m=ward&m=lambert&theta=30");
  rebuild();
  for (const [name, value] of [["theta", 60], ["azimuth", 90]]) {
    byId(name).value = value;
    byId(name).dispatchEvent(new Event("input"));
  }
  const shown = (e) => e.querySelector("pre").textContent;
  found.copies = [...document.querySelectorAll(".copies")].map(shown);
  const [ax, ks] = ["ax", "ks"].map((name) => byId(`p0-${name}`).parentElement);
  const type = (row, text) => {
    const field = row.querySelector("input[type=text]");
    field.value = text;
    field.dispatchEvent(new Event("change"));
    const said = row.querySelector(".wrong").textContent;
    return [field.value, said, field.getAttribute("aria-invalid")];
  };
  found.typed = ["7", "", "0,5"].map((text) => type(ax, text));
  found.typed.push(type(ks, "0.1 0.2"), type(ks, "0.1 0.2, 0.3"));
  found.held = addressOf();
  found.mailed = readAddress(`#${encodeURIComponent("m=ward,ax=0.3,ks=0.1:0.2:0.3&theta=30")}`);
  found.read = addressOf();
  const parts = ["theta=", "theta", "lamp=:", "theta=0x20", "theta=%"];
  const models = ["m=ward,ks=:0.5:0.2", "m=ward,ks=0.1::0.3", "m=ward,ax"];
  found.half = [...models, ...parts].map((text) => readAddress(`#${text}`));
  found.wrong = readAddress("#m=nothing&m=ward,ax=7&theta=95&other=1");
  HTMLCanvasElement.prototype.getContext = () => null;
  try {
    new Renderer();
  } catch (error) {
    found.missing = error.message;
  }
});
const result = document.createElement("pre");
result.id = "found";
result.textContent = JSON.stringify(found);
document.body.append(result);
"""


def directions():
    """Pairs of unit vectors: views, and lights on a grid and about the mirror direction."""
    lights, views = [], []
    for view in (0, 20, 44, 70, 84):  # at 45, a model is discontinuous at the normal
        polar = [(t, p) for t in (0, 15, 40, 65, 84) for p in (0, 50, 110, 180, 260)]
        about = [(abs(view + d), 180 + a) for d in (-5, -1, 0, 1, 5) for a in (0, 2)]
        for theta, phi in [*polar, *about]:
            for out, (t, p) in ((lights, (theta, phi)), (views, (view, 0))):
                t, p = np.radians(t), np.radians(p)
                out.append([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    return np.array(lights), np.array(views)


def cases():
    """Models with parameters as text: every combination of choices, and those of tests/models."""
    for model in LISTED:
        names = {p["name"]: p["choices"] for p in model["parameters"] if p["kind"] == "choice"}
        for chosen in itertools.product(*names.values()):
            yield model["name"], " ".join(map("=".join, zip(names, chosen, strict=True)))
    for row in csv.DictReader((ROOT / "tests/models/cases.csv").open(encoding="utf-8")):
        for text in [*row["cases"].split("|"), *row["stiff"].split("|")]:
            yield row["model"], text


def values_of(model, text):
    """The parameters of a case as the page has them."""
    kinds = {p["name"]: p["kind"] for m in LISTED if m["name"] == model for p in m["parameters"]}
    out = {}
    for name, value in (assignment.split("=") for assignment in text.split()):
        numbers = [] if kinds[name] == "choice" else [float(c) for c in value.split(":")]
        match kinds[name]:
            case "choice":
                out[name] = value
            case "number":
                out[name] = numbers[0]
            case _:
                out[name] = numbers if len(numbers) == 3 else 3 * numbers
    return out


#: Two models, and the difference that they have by their formulas.
PAIRS = {
    "#m=lambert&m=lambert": 0,
    "#m=lambert,rho=0.8&m=lambert,rho=0.2": 0.75,
    "#m=lambert,rho=0.2&m=lambert,rho=0.8": 3,
    "#m=max_phong,e=20,ks=0.5&m=max_phong,e=20,ks=0.25": 0.5,
    # All light is reflected in one, and refracted in the other.
    "#m=fresnel_conductor,n_r=0.001,n_g=0.001,n_b=0.001,k_r=100,k_g=100,k_b=100&m=glass,ior=1": 2,
}
#: Models that reflect, or let through, all light.
FURNACE = [
    "#m=coupled,rm=1",
    "#m=glass,density=0",
    "#m=fresnel_dielectric,dispersion=1",
    "#m=radziszewski_alda,tint=1,around=refraction",
]
LIGHTS, VIEWS = directions()
CASES = list(dict.fromkeys(cases()))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The output of `brdfc explorer`."""
    out = tmp_path_factory.mktemp("explorer") / "page"
    done = subprocess.run([TOOL, "explorer", "--out", out], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def tried(request):
    """Models that this run tries, of tests marked `long`: drawn, and cases with their formulas."""
    items = [i for i in request.session.items if i.path == request.path and hasattr(i, "callspec")]
    drawn, asked = (
        {i.callspec.params["model"] for i in items if i.originalname == test.__name__}
        for test in (test_every_model_is_drawn, test_values_are_those_of_the_tool)
    )
    cases = [case for case in CASES if case[0] in asked]
    return SimpleNamespace(drawn=[m for m in MODELS if m in drawn], cases=cases)


@pytest.fixture(scope="module")
def found(folder, tried, tmp_path_factory):
    """What the script at the page's end found."""
    if CHROMIUM is None:
        pytest.skip(f"none of {', '.join(BROWSERS)} is installed: the explorer was not tested")
    given = {
        "CASES": [{"model": m, "values": values_of(m, text)} for m, text in tried.cases],
        "MODELS": tried.drawn,
        "PAIRS": list(PAIRS),
        "FURNACE": FURNACE,
        "LIGHTS": LIGHTS.tolist(),
        "VIEWS": VIEWS.tolist(),
    }
    data = "".join(f"const {name} = {json.dumps(value)};\n" for name, value in given.items())
    (folder / "check.js").write_text(data + CHECK, encoding="utf-8")
    page = (folder / "index.html").read_text(encoding="utf-8")
    last = '<script src="page.js"></script>'
    assert last in page
    page = page.replace(last, last + '<script src="check.js"></script>')
    (folder / "check.html").write_text(page, encoding="utf-8")
    profile = tmp_path_factory.mktemp("profile")
    address = (folder / "check.html").as_uri()
    out, said = found_by_page(CHROMIUM, profile, address)
    out["values"] = dict(zip(tried.cases, out["values"], strict=True))
    out["console"] = [line for line in said if "CONSOLE" in line]
    return out


def test_nothing_is_reported(found):
    assert found["errors"] == [] and found["console"] == []


def in_double_precision(cases):
    """f and pdf of each case, an array (directions, 4); one run of the tool for all cases of a
    model that have the same choices."""
    groups, found = {}, {}
    for model, text in cases:
        schema = next(m for m in LISTED if m["name"] == model)
        values = {p["name"]: p["default"] for p in schema["parameters"]} | values_of(model, text)
        choices = tuple(f"{k}={v}" for k, v in values.items() if isinstance(v, str))
        numbers = {k: np.atleast_1d(v) for k, v in values.items() if not isinstance(v, str)}
        if schema["scatter"]:
            groups.setdefault((model, choices), []).append((text, numbers))
        else:
            found[model, text] = np.zeros((len(LIGHTS), 4))
    for (model, choices), members in groups.items():
        header = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z,u1,u2,u3".split(",")
        for name, value in members[0][1].items():
            header += [name] if len(value) == 1 else [f"{name}_{c}" for c in "rgb"]
        rows = []
        for _, numbers in members:
            same = np.concatenate([[0.5, 0.5, 0.5], *numbers.values()])
            rows.append(np.hstack([LIGHTS, VIEWS, np.broadcast_to(same, (len(LIGHTS), len(same)))]))
        lines = [",".join(header), *(",".join(map(repr, r)) for r in np.vstack(rows).tolist())]
        command = [TOOL, "probe", model, *choices, "--run"]
        done = subprocess.run(command, input="\n".join(lines), capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        table = np.loadtxt(io.StringIO(done.stdout), delimiter=",", skiprows=1, usecols=range(4))
        parts = np.split(table, len(members))
        found |= {(model, text): part for (text, _), part in zip(members, parts, strict=True)}
    return found


@pytest.mark.long
@pytest.mark.parametrize("model", MODELS)
def test_values_are_those_of_the_tool(found, model):
    wrong, truths = [], in_double_precision([case for case in CASES if case[0] == model])
    assert truths
    for (_, text), truth in truths.items():
        got = np.array(found["values"][model, text], dtype=float).reshape(-1, 4)
        error = np.abs(got - truth) / np.maximum(np.abs(truth), 1e-6 * np.abs(truth).max() + 1e-30)
        at = np.unravel_index(np.argmax(np.nan_to_num(error, nan=np.inf)), error.shape)
        if not error[at] <= STIFF.get((model, text), TOLERANCE):
            wrong.append((model, text, LIGHTS[at[0]], VIEWS[at[0]], got[at[0]], truth[at[0]]))
    assert not wrong


def test_stiff_cases_are_among_those_of_the_models():
    assert set(STIFF) <= set(CASES)


@pytest.mark.long
@pytest.mark.parametrize("model", MODELS)
def test_every_model_is_drawn(found, model):
    """With the albedo of the tool."""
    page = found["pages"][model]
    assert page["error"] == "" and page["curves"] == 2
    for view in ("lamp", "sky"):
        total, least = page["lit"][view]
        assert np.isfinite(total) and total > 0 and least >= 0, view
    lobe = page["lobe"]
    assert lobe["finite"] and lobe["error"] == 0 and lobe["light"] > 0
    # The largest value is 1; ideal reflection and refraction are arrows beside the lines.
    if lobe["top"] > 0:
        assert lobe["radius"] == pytest.approx(1)
    else:
        assert lobe["rods"] > found["lambert"]["rods"]
    got = np.array(page["albedo"]).reshape(-1, 4)[:, :3]
    angles = np.minimum(np.arange(len(got)) / (len(got) - 1) * np.pi / 2, 1.569)
    chosen = [15, 40]
    lines = ["cos_theta_o", *(repr(float(np.cos(angles[i]))) for i in chosen)]
    done = subprocess.run(
        [TOOL, "albedo", model], input="\n".join(lines), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    truth = np.loadtxt(io.StringIO(done.stdout), delimiter=",", skiprows=1, ndmin=2)
    assert got[chosen] == pytest.approx(truth[:, 1:4], abs=0.01)


def test_the_difference_of_two_is_that_of_their_formulas(found):
    for (address, truth), got in zip(PAIRS.items(), found["differences"], strict=True):
        for where in ("here", "everywhere"):
            assert got[where] == pytest.approx(truth, rel=1e-4, abs=1e-6), address
        assert f"{100 * truth:g} %" in got["text"]


def test_the_sky_is_as_bright_by_any_strategy(found):
    sky, plain = found["sky"]
    assert sky != plain and sky == pytest.approx(plain, rel=0.02)


def test_no_light_is_lost_in_pictures(found):
    for address, (*color, _) in zip(FURNACE, found["furnace"], strict=True):
        assert color == pytest.approx([1, 1, 1], abs=0.01), address


def test_no_light_is_lost_on_the_knot(found):
    """Nor gained: it does not shadow itself."""
    for address, (*color, _) in zip(FURNACE, found["knot"], strict=True):
        assert color == pytest.approx([1, 1, 1], abs=0.01), address


def knot():
    """How much of a picture the knot covers, and the mean cosine of what is seen of it: from
    points of its surface, by two angles, of which the nearest in each pixel is kept."""
    a, b = np.meshgrid(np.linspace(0, 2 * np.pi, 2400), np.linspace(0, 2 * np.pi, 500))
    pixels = 320
    depth, cosine = np.full((2, pixels * pixels), -np.inf)
    axes = np.array([[0.9689, 0.2474, 0], [-0.2037, 0.7979, 0.5673], [0.1404, -0.5497, 0.8235]])
    for strand in (-0.22, 0.22):
        x, y = strand + 0.19 * np.cos(b), 0.19 * np.sin(b)
        c, s = np.cos(1.5 * a), np.sin(1.5 * a)
        radius, height = 0.58 + c * x - s * y, s * x + c * y
        points = np.stack([radius * np.cos(a), radius * np.sin(a), height], -1) @ axes
        normals = np.cross(*(np.gradient(points, axis=i) for i in (1, 0)))
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        at = ((points[..., :2] / 1.04 + 1) / 2 * pixels).astype(int)
        where = (at[..., 1] * pixels + at[..., 0]).ravel()
        order = np.argsort(points[..., 2].ravel())
        order = order[points[..., 2].ravel()[order] > depth[where[order]]]
        # The last one of a pixel stays: the nearest.
        depth[where[order]] = points[..., 2].ravel()[order]
        cosine[where[order]] = abs(normals[..., 2].ravel()[order])
    seen = np.isfinite(depth)
    return seen.mean(), cosine[seen].mean()


def test_the_knot_has_the_normals_of_its_surface(found):
    """And the sphere, whose mean cosine is 2/3."""
    (*sphere, disk), (*shown, covered) = found["facing"]
    assert sphere == pytest.approx([2 / 3] * 3, abs=0.005)
    assert disk == pytest.approx(np.pi / 4 / 1.04**2, abs=0.005)
    cover, cosine = knot()
    assert covered == pytest.approx(cover, abs=0.012)
    assert shown == pytest.approx([cosine] * 3, abs=0.006)
    sphere, shown = (np.array(x[:3]) for x in found["shapes"])
    assert (shown > 0).all() and (abs(shown / sphere - 1) > 0.02).all()


def test_the_lobe_of_lambert_is_a_sphere_on_the_surface(found):
    """As f cos is the cosine: the point at height z is sqrt(z (1 - z)) from the normal."""
    for name in ("lambert", "tilted"):
        assert found[name]["off"] < 1e-4, name
    luminance = 0.2126 * 0.8 + 0.7152 * 0.4 + 0.0722 * 0.2
    assert found["lambert"]["top"] == pytest.approx(luminance / np.pi, rel=1e-5)
    # The largest of 1 + log10(c) / 4 - c.
    assert found["logarithmic"]["off"] == pytest.approx(0.6503, abs=0.005)
    rows = np.array(found["lambert"]["rows"])
    pixel = 2 * 1.25 / len(rows)
    z = 0.4 + (len(rows) / 2 - np.arange(len(rows)) - 0.5) * pixel
    for low, high, width in [
        (0.04, 0.96, 2 * np.sqrt(np.clip(z * (1 - z), 0, None))),
        (1.2, 2, 0 * z),
        (-2, -0.04, 0 * z),
    ]:
        inside = (z > low) & (z < high)
        assert inside.sum() > 5
        assert np.abs(rows * pixel - width)[inside].max() < 2.5 * pixel
    assert found["lambert"]["label"] == "Lobe of f cos θ, Lambert. Arrow keys turn the lobes."


def test_a_link_carries_the_lobe_and_whence_it_is_seen(found):
    given, written = found["lobe_address"]
    assert found["lobe_unread"] == [] and written == given
    assert "turned=35:-20" in found["turned"] and found["hidden"] == [True, True]
    assert [len(wrong) for wrong in found["lobe_wrong"]] == [1, 1, 1]


def test_a_link_carries_the_settings(found):
    given, written = found["address"]
    assert found["unread"] == []
    assert sorted(re.split("[&,]", given[1:])) == sorted(re.split("[&,]", written[1:]))
    assert len(found["wrong"]) == 4
    command, python, blender = found["recipes"]
    assert command.endswith(" | brdfc eval ward ks=0.1,0.2,0.3 ax=0.3 normalisation=duer")
    for text in (python.removesuffix(")"), blender):
        assert text.endswith('ks=(0.1, 0.2, 0.3), ax=0.3, normalisation="duer")')


def test_what_is_copied_follows_the_slice(found):
    for text in found["copies"]:
        wi, wo = np.array(text.split("\\n")[1].split(","), float).reshape(2, 3)
        assert wi == pytest.approx([0, -(0.75**0.5), 0.5]), text
        assert wo == pytest.approx([0, 0.75**0.5, 0.5]), text
    assert len(found["copies"]) == 2


def test_a_field_says_what_it_expects(found):
    out, empty, comma, two, three = found["typed"]
    assert out == ["7", "expected a number from 0.0001 to 1; still 0.15", "true"]
    assert empty[1:] == out[1:]
    assert comma == ["0.5", "", "false"]
    assert "or three as in 0.5:0.1:0.2" in two[1] and two[2] == "true"
    assert three == ["0.1, 0.2, 0.3", "", "false"]
    assert "ks=0.1:0.2:0.3" in found["held"] and "ax=0.5" in found["held"]


def test_a_link_that_was_mailed_is_read(found):
    assert found["mailed"] == []
    assert found["read"] == "#m=ward,ks=0.1:0.2:0.3,ax=0.3&theta=30"


def test_a_part_of_a_link_that_is_left_out_is_said(found):
    assert [len(wrong) for wrong in found["half"]] == [1] * len(found["half"])
    assert found["half"][0] == [
        "ward: ks=:0.5:0.2, expected a number from 0 to 1, or three as in 0.5:0.1:0.2"
    ]
    assert found["half"][3] == ["theta=, expected a number from 0 to 89"]


def test_a_copied_command_runs(found):
    command = found["recipes"][0].replace("brdfc eval", f"{shlex.quote(str(TOOL))} eval")
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (row,) = csv.reader(io.StringIO(done.stdout.split("\n", 1)[1]))
    assert all(float(x) > 0 for x in row[:3])


def test_a_folder_of_others_stays(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    done = subprocess.run([TOOL, "explorer", "--out", tmp_path], capture_output=True, text=True)
    assert done.returncode == 2 and "models.js" in done.stderr
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_controls_change_the_link_and_have_names(found):
    assert found["controls"] > 20 and found["unnamed"] == []
    assert "m=ward,ks=0.1:0.2:0.3,ax=0.5,normalisation=duer" in found["moved"]
    assert "m=lambert" not in found["moved"] and "lamp=0.100:0.250" in found["moved"]


def test_a_browser_without_webgl_is_told(found):
    assert "WebGL 2" in found["missing"]
