# SPDX-License-Identifier: GPL-3.0-or-later
"""The package of `brdfc python`: its formulas compared with the tool's, its errors, and its page.

The tool evaluates the C++ in double precision: one set of parameters of each model by `brdfc eval`
and `brdfc sample`, all others in one run of `brdfc probe`. Values agree to a relative 1e-12 for
every model, at default, random and extreme parameters (tests/models/cases.csv). The pdf of a sample
agrees to 1e-11: the narrowest lobes, with exponents of 1e8, amplify the rounding of their own
direction by 1e4. NumPy's exp, sin and log differ from the C library's in the last place.
"""

import csv
import doctest
import importlib.util
import io
import json
import os
import subprocess
import sys

import gallery_models
import landmarks
import numpy as np
import pytest
from support import MODELS, ROOT, TOOL

CASES = {
    row["model"]: row["cases"].split("|") + row["stiff"].split("|")
    for row in csv.DictReader((ROOT / "tests/models/cases.csv").open(encoding="utf-8"))
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The output of `brdfc python`."""
    out = tmp_path_factory.mktemp("python")
    done = subprocess.run([TOOL, "python", "--out", out], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def brdfc(folder):
    sys.path.insert(0, str(folder))
    try:
        yield importlib.import_module("brdfc")
    finally:
        sys.path.remove(str(folder))


def tool(command, model, values, rows, header, *options):
    """The tool's results, one row for each."""
    words = [
        f"{k}={v if isinstance(v, str) else ','.join(repr(float(c)) for c in np.atleast_1d(v))}"
        for k, v in values.items()
    ]
    lines = [header, *(",".join(repr(float(x)) for x in row) for row in rows)]
    done = subprocess.run(
        [TOOL, command, model, *words, *options],
        input="\n".join(lines),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return np.loadtxt(io.StringIO(done.stdout), delimiter=",", skiprows=1, ndmin=2)


def values_of(model, text):
    """The parameters of a case in cases.csv: "n=3 tint=0.9:0.5:0.1"."""
    values = {}
    for name, value in (assignment.split("=") for assignment in text.split()):
        is_word = type(model.parameters[name]).__name__ == "Choice"
        numbers = [] if is_word else [float(c) for c in value.split(":")]
        values[name] = value if is_word else numbers[0] if len(numbers) == 1 else numbers
    return values


def random_values(model, random):
    values = {}
    for name, p in model.parameters.items():
        match type(p).__name__:
            case "Choice":
                values[name] = str(random.choice(p.choices))
            case "Color":
                values[name] = random.uniform(size=3).tolist()
            case _:
                values[name] = float(random.uniform(p.soft_min, p.soft_max))
    return values


def all_values(model, random):
    return [values_of(model, text) for text in CASES[model.name]] + [
        random_values(model, random) for _ in range(4)
    ]


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def pairs(random, count):
    """Directions anywhere, including below the surface; light directions at decreasing distances
    from the mirror direction and from the view direction; the normal; grazing directions."""
    wi, wo = unit(random.normal(size=(2, count, 3)))
    lights, views = [wi], [wo]
    above = wo * [1, 1, np.nan] + 0  # z is set in the next line
    above[:, 2] = np.abs(wo[:, 2])
    for spread in (0.3, 0.03, 1e-3, 1e-4):
        for around in (above * [-1, -1, 1], above):
            lights.append(unit(around + spread * random.normal(size=above.shape)))
            views.append(above)
    lights.append(np.array([[0, 0, 1], [0.6, 0, 0.8], [1, 0, 0], [np.sqrt(1 - 1e-12), 0, 1e-6]]))
    views.append(np.array([[0, 0, 1], [0, 0, 1], [-0.6, 0, 0.8], [-np.sqrt(1 - 1e-8), 0, 1e-4]]))
    return np.concatenate(lights), np.concatenate(views)


def off(got, expected):
    """The largest difference relative to the expected value; if that is 0, both must be."""
    same = got == expected
    return np.max(
        np.where(same, 0, np.abs(got - expected) / np.where(expected == 0, 1e-300, expected))
    )


def in_double(model, points):
    """The tool's results at points (values, wi, wo, u), an array for each by row: f, pdf, and the
    sample's direction, weight and pdf. Runs the tool once for each combination of choices, as
    starting it takes most of the time."""
    p = model.parameters
    is_choice = {name: type(p[name]).__name__ == "Choice" for name in p}
    by_choices = {}
    for i, (values, *_) in enumerate(points):
        choices = tuple(f"{k}={v}" for k, v in values.items() if is_choice[k])
        by_choices.setdefault(choices, []).append(i)
    found = [None] * len(points)
    for choices, which in by_choices.items():
        header = ["wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z", "u1", "u2", "u3"]
        for name in p:
            if type(p[name]).__name__ == "Color":
                header += [f"{name}_{c}" for c in "rgb"]
            elif not is_choice[name]:
                header.append(name)
        blocks = []
        for i in which:
            values, wi, wo, u = points[i]
            # probe does not normalize directions.
            vectors = [model._directions("wi", wi), model._directions("wo", wo), u]
            for name in p:
                if is_choice[name]:
                    continue
                value = np.atleast_1d(values.get(name, p[name].default)).astype(np.float64)
                size = 3 if type(p[name]).__name__ == "Color" else 1
                vectors.append(np.broadcast_to(value, (len(wi), size)))
            blocks.append(np.hstack(vectors))
        text = [",".join(map(repr, row)) for row in np.concatenate(blocks).tolist()]
        done = subprocess.run(
            [TOOL, "probe", model.name, *choices, "--run"],
            input="\n".join([",".join(header), *text]),
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith("double_f_r,")
        rows = np.loadtxt(io.StringIO(done.stdout), delimiter=",", skiprows=1, ndmin=2)[:, :11]
        ends = np.cumsum([len(block) for block in blocks])[:-1]
        for i, part in zip(which, np.split(rows, ends), strict=True):
            found[i] = part
    return found


@pytest.mark.parametrize("name", MODELS)
def test_values_are_those_of_the_formulas_in_cpp(brdfc, name):
    model, random = brdfc.model(name), np.random.default_rng(5)
    points = []
    for values in all_values(model, random):
        wi, wo = pairs(random, 24)
        points.append((values, wi, wo, np.full_like(wi, 0.5)))
    values, wi, wo, _ = points[0]
    header = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z"
    all_expected = [tool("eval", name, values, np.hstack([wi, wo]), header)]
    scatters = next(iter(model.formulas.values())).eval is not None
    if scatters:
        all_expected += in_double(model, points[1:])
    else:  # only ideal reflection
        assert not all_expected[0].any()
        all_expected += [np.zeros((len(wi), 4)) for _, wi, _, _ in points[1:]]
    some = 0
    for (values, wi, wo, _), expected in zip(points, all_expected, strict=True):
        assert off(model.eval(wi, wo, **values), expected[:, :3]) <= 1e-12, values
        assert off(model.pdf(wi, wo, **values), expected[:, 3]) <= 1e-12, values
        some += np.count_nonzero(expected[:, 3])
    assert (some > 100) == scatters


@pytest.mark.parametrize("name", MODELS)
def test_samples_below_the_surface_are_lost(brdfc, name):
    """Frames about the mirror direction do not exist along the axis, so formulas may give NaN."""
    model = brdfc.model(name)
    wo, u = np.array([[0, 0, -1], [0.6, 0, -0.8], [1, 0, 0]]), np.full((3, 3), 0.3)
    s = model.sample(wo, u)
    if model.two_sided:
        assert np.isfinite(s.wi).all() and np.isfinite(s.weight).all()
        return
    assert (s.wi == [0, 0, 1]).all() and not s.weight.any() and not s.pdf.any()
    if next(iter(model.formulas.values())).sample is not None:
        found = tool("sample", name, {}, np.hstack([wo, u]), "wo_x,wo_y,wo_z,u1,u2,u3")
        assert (found == [0, 0, 1, 0, 0, 0, 0]).all()


@pytest.mark.many
@pytest.mark.parametrize("name", MODELS)
def test_samples_are_those_of_the_formulas_in_cpp(brdfc, name):
    model, random = brdfc.model(name), np.random.default_rng(6)
    points = []
    for values in all_values(model, random):
        u = random.uniform(size=(60, 3))
        wo = unit(random.normal(size=u.shape))
        if not model.two_sided:
            wo[:, 2] = np.abs(wo[:, 2])
        points.append((values, wo, wo, u))
    if next(iter(model.formulas.values())).sample is None:
        for values, _, wo, u in points:
            s = model.sample(wo, u, **values)
            assert not s.pdf.any() and not s.weight.any()
        return
    values, _, wo, u = points[0]
    all_expected = [tool("sample", name, values, np.hstack([wo, u]), "wo_x,wo_y,wo_z,u1,u2,u3")]
    all_expected += [rows[:, 4:] for rows in in_double(model, points[1:])]
    some = 0
    for (values, _, wo, u), expected in zip(points, all_expected, strict=True):
        s = model.sample(wo, u, **values)
        assert np.abs(s.wi - expected[:, :3]).max() <= 1e-12, values
        of_pdf = off(s.pdf, expected[:, 6])
        assert of_pdf <= 1e-11, values
        # The pdf is a divisor of the weight.
        assert off(s.weight, expected[:, 3:6]) <= max(1e-12, of_pdf), values
        some += np.count_nonzero(s.pdf)
    assert some > 100


@pytest.mark.many
@pytest.mark.parametrize("name", MODELS)
def test_albedo_is_that_of_the_tools_quadrature(brdfc, name):
    """By 4096 samples, as docs/python.md states: to 0.005, or to four standard errors of as many
    independent samples where the weights vary more; the mirror's fraction, which is not an
    integral, to 1e-12."""
    model, random = brdfc.model(name), np.random.default_rng(7)
    cosines = np.array([0.2, 0.7, 1])
    u = np.random.default_rng(8).uniform(size=(4096, 1, 3))
    for values in ({}, random_values(model, random)):
        error = ("--error", "1e-5")  # less takes seconds
        expected = tool("albedo", name, values, cosines[:, None], "cos_theta_o", *error)
        sine = np.sqrt((1 - cosines) * (1 + cosines))
        wo = np.stack([sine, 0 * sine, cosines], axis=-1)
        assert off(model.mirror(wo, **values), expected[:, 4:7]) <= 1e-12, values
        got = model.albedo(cosines, **values)
        standard_error = model.sample(wo, u, **values).weight.std(axis=0) / np.sqrt(len(u))
        allowed = np.maximum(5e-3, 4 * standard_error) + expected[:, 7:8]
        assert (np.abs(got - expected[:, 1:4]) <= allowed).all(), values


def test_a_cosine_of_1_may_be_rounded(brdfc):
    """As lengths of directions may be, also for the tool."""
    model, more = brdfc.model("rough_glass"), np.array([1 + 2.3e-16, 1 + 9e-7])
    for sign in (1, -1):
        assert (model.albedo(sign * more) == model.albedo(sign * 1.0)).all()
    expected = tool("albedo", "ward", {}, np.ones((1, 1)), "cos_theta_o")
    assert (tool("albedo", "ward", {}, more[:, None], "cos_theta_o") == expected).all()
    with pytest.raises(ValueError, match="cos_theta_o"):
        model.albedo(1 + 2e-6)


def test_arrays_broadcast_and_blocks_are_joined(brdfc):
    model, random = brdfc.model("ward"), np.random.default_rng(8)
    wi, wo = unit(np.abs(random.normal(size=(2, 20000, 3))))
    ax, ks = random.uniform(0.02, 0.5, size=20000), random.uniform(size=(20000, 3))
    f = model.eval(wi, wo, ax=ax, ks=ks)
    for i in (0, 8191, 8192, 19999):
        np.testing.assert_array_equal(
            f[i], model.eval(wi[i], wo[i], ax=ax[i], ks=ks[i]), strict=True
        )
    grid = model.eval(wi[:4, None], wo[:5], ax=ax[:5])
    assert grid.shape == (4, 5, 3)
    np.testing.assert_array_equal(grid[2, 3], model.eval(wi[2], wo[3], ax=ax[3]))
    assert model.eval(np.zeros((0, 3)), wo[0]).shape == (0, 3)
    # A texture of albedos adds an inner axis.
    many = model.albedo([0.5, 0.9], ks=ks[:2], ax=ax[:2])
    for i, cosine in enumerate((0.5, 0.9)):
        np.testing.assert_allclose(many[i], model.albedo(cosine, ks=ks[i], ax=ax[i]), rtol=1e-13)


UP = [0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda b: b.model("wart"), ValueError, "'wart': did you mean ward.*ashikhmin_shirley"),
        (
            lambda b: b.model("ward").eval(UP, UP, ax=2),
            ValueError,
            r"ward: ax: .*\[0.0001, 1\].*2.0",
        ),
        (lambda b: b.model("ward").pdf(UP, UP, ay=float("nan")), ValueError, "ward: ay: .*nan"),
        (lambda b: b.model("ward").eval(UP, UP, ks=[0, 0.5, 1.5]), ValueError, "ward: ks: .*1.5"),
        (
            lambda b: b.model("ward").eval(UP, UP, ks=[1, 1]),
            ValueError,
            "ward: ks: .*three numbers",
        ),
        (lambda b: b.model("ward").eval(UP, UP, ax="wide"), TypeError, "ward: ax: .*'wide'"),
        (lambda b: b.model("ward").eval(UP, UP, alpha=1), TypeError, "ward: .*'alpha'.*ks, ax, ay"),
        (
            lambda b: b.model("ward").albedo(1, normalisation="old"),
            ValueError,
            "ward: normalisation: .*bounded, duer, ward.*'old'",
        ),
        (lambda b: b.model("ward").eval([0, 0, 2], UP), ValueError, "ward: wi: .*length.* 2"),
        (lambda b: b.model("ward").eval(UP, [0, 1]), ValueError, r"ward: wo: .*\(\.\.\., 3\)"),
        (lambda b: b.model("ward").sample(UP, [0, 0, 1]), ValueError, r"ward: u: .*\[0, 1\)"),
        (lambda b: b.model("ward").albedo(0), ValueError, r"ward: cos_theta_o: .*\(0, 1\]"),
        (lambda b: b.model("ward").albedo(-0.5), ValueError, r"ward: cos_theta_o: .*\(0, 1\]"),
        (
            lambda b: b.model("ward").eval([UP, UP], UP, ax=[0.1, 0.2, 0.3]),
            ValueError,
            r"ward: shapes do not broadcast: wi \(2, 3\), wo \(3,\), ax \(3,\)$",
        ),
        (
            lambda b: b.model("ward").albedo(0.5, samples=0),
            ValueError,
            "ward: samples: .*from 1.*0",
        ),
        (lambda b: b.model("ward").albedo(0.5, samples=-3), ValueError, "ward: samples: .*-3"),
        (lambda b: b.model("ward").albedo(0.5, samples=0.5), TypeError, "ward: samples: .*whole"),
        (lambda b: b.model("ward").albedo(0.5, samples=True), TypeError, "ward: samples: .*True"),
        (lambda b: b.model("ward").albedo(0.5, np.inf), ValueError, "ward: phi_o: .*finite"),
        (lambda b: b.model("ward").albedo(0.5 + 1j), TypeError, "ward: cos_theta_o: .*0.5.1j"),
        (lambda b: b.model("ward").albedo(0.5, ax=0.1j), TypeError, "ward: ax: .*a number.*0.1j"),
        (
            lambda b: b.model("ward").eval(np.array(UP, complex), UP),
            TypeError,
            "ward: wi: expected numbers.*an array of complex128",
        ),
        (
            lambda b: b.model("ward").eval(UP, np.ma.masked_array(UP, [0, 1, 0])),
            TypeError,
            "ward: wo: .*a masked array",
        ),
        (
            lambda b: b.model("ward").pdf(UP, UP, ks=np.ma.masked_array([1, 1, 1], [0, 1, 0])),
            TypeError,
            "ward: ks: .*a masked array",
        ),
        (lambda b: b.model("ward").eval(UP, UP, ax="0.1"), TypeError, "ward: ax: .*'0.1'"),
        (lambda b: b.model("ward").eval(UP, UP, ks=True), TypeError, "ward: ks: .*True"),
        (lambda b: b.model("ward").eval(UP, UP, ks=None), TypeError, "ward: ks: .*None"),
        (lambda b: b.model("ward").eval([UP, [0, 1]], UP), TypeError, "ward: wi: expected numbers"),
        (
            lambda b: b.model("ward").sample(UP, np.array(["0", "0", "0"])),
            TypeError,
            "ward: u: .*an array of str",
        ),
        (
            lambda b: b.model("ward").eval(np.array([0, 0, 1], "timedelta64[s]"), UP),
            TypeError,
            "ward: wi: .*timedelta64",
        ),
        (lambda b: b.optics.substance("Gold"), ValueError, "did you mean gold.*got 'Gold'"),
        (lambda b: b.optics.substance("gold").xyz(0), ValueError, r"gold: cosine: .*\(0, 1\].*0"),
        (lambda b: b.optics.substance("gold").xyz([1, 1]), TypeError, "gold: cosine: .*an array"),
        (
            lambda b: b.optics.substance("water").transmittance(-1),
            ValueError,
            "water: metres: .*-1",
        ),
    ],
)
def test_errors_name_model_and_parameter(brdfc, call, error, words):
    with pytest.raises(error, match=words):
        call(brdfc)


@pytest.mark.parametrize("name", MODELS)
def test_documentation_has_equation_paper_and_every_parameter(brdfc, name):
    model = brdfc.model(name)
    text = " ".join(model.__doc__.split())
    assert model.paper and model.equations
    for part in (model.label, model.paper, model.equations, *model.parameters):
        assert " ".join(part.split()) in text
    for p in model.parameters.values():
        assert type(p).__name__ == "Choice" or 0 <= p.max - p.min


def test_the_tool_does_not_overwrite_a_folder_of_another_kind(tmp_path):
    (tmp_path / "brdfc" / "models").mkdir(parents=True)
    (tmp_path / "brdfc" / "models" / "mine.py").write_text("mine")
    done = subprocess.run([TOOL, "python", "--out", tmp_path], capture_output=True, text=True)
    assert done.returncode == 2 and str(tmp_path / "brdfc") in done.stderr
    assert (tmp_path / "brdfc" / "models" / "mine.py").read_text() == "mine"


@pytest.mark.slow
def test_the_same_bytes_each_time(folder, tmp_path):
    subprocess.run([TOOL, "python", "--out", tmp_path], check=True, capture_output=True)
    subprocess.run([TOOL, "python", "--out", tmp_path], check=True, capture_output=True)
    files = {p.relative_to(tmp_path) for p in tmp_path.rglob("*") if p.is_file()}
    assert len(files) > len(MODELS)
    for file in files:
        assert (folder / file).read_bytes() == (tmp_path / file).read_bytes()


def test_examples_of_the_page(brdfc):
    page = ROOT / "docs" / "python.md"
    failed, tried = doctest.testfile(str(page), module_relative=False, globs={})
    assert (failed, tried > 10) == (0, True)


def test_the_plots_of_the_page(folder, tmp_path):
    out = tmp_path / "plots.png"
    script = ROOT / "script" / "plot_models.py"
    environment = os.environ | {"PYTHONPATH": str(folder), "MPLCONFIGDIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, script, out], capture_output=True, text=True, env=environment
    )
    assert done.returncode == 0, done.stderr
    image = importlib.import_module("matplotlib.image").imread(out)
    assert image.shape == (450, 1500, 4) and image[..., :3].std() > 0.05
    shown = importlib.import_module("matplotlib.image").imread(ROOT / "docs" / "python.png")
    assert np.abs(image - shown).mean() < 0.01, "script/plot_models.py docs/python.png"


def test_what_papers_say_as_curves(brdfc):
    """The numbers of docs/gallery/landmarks.md."""
    lobe = brdfc.model("radziszewski_alda")
    for n in (4, 100):
        assert landmarks.anisotropy(lobe, 0, n=n) == pytest.approx(1, abs=0.03)
        assert landmarks.anisotropy(lobe, 86, n=n) < 0.6, "drawn out along the plane at grazing"
    assert landmarks.anisotropy(lobe, 45, n=100) > 2
    assert landmarks.anisotropy(brdfc.model("phong"), 45, e=25) == pytest.approx(1, abs=0.03)

    theta, views = np.radians(np.linspace(-80, 80, 33)), np.array([0.0, 40, 80])
    coupled, double = brdfc.model("coupled"), brdfc.model("schlick_double")
    densities = [landmarks.spdf(coupled, theta, v, r0=0.05, rm=0.5) for v in views]
    assert np.ptp(densities, axis=0).max() < 2e-3, "the same at every view"
    white = sum(landmarks.reflectances(coupled, views, r0=0.05, rm=1))
    assert white == pytest.approx(1, abs=2e-3)
    gained = sum(landmarks.reflectances(double, np.array([85.0]), r0=0.05, rd=1))
    assert gained > 1.5


@pytest.mark.parametrize("name", ["schlick", "fresnel_conductor"])
def test_a_model_is_drawn(brdfc, tmp_path, name):
    """The gallery's drawings: lobes with a mirror, and a mirror alone."""
    listed = json.loads(subprocess.run([TOOL, "list", "--json"], capture_output=True).stdout)
    model = next(m for m in listed if m["name"] == name)
    gallery_models.draw(model, brdfc.model(name), tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {f"{name}-lobes.png", f"{name}-albedo.png"}
