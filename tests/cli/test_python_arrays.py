# SPDX-License-Identifier: GPL-3.0-or-later
"""Models of the Python package on arrays of other libraries: values, gradients, errors.

Libraries that are not installed are skipped. The tools' environment has two small ones: autograd,
which differentiates, and array-api-strict, which has nothing but what the standard has. For JAX and
PyTorch: script/requirements/arrays.txt.
"""

import importlib
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest
from support import LISTED, MODELS, TOOL


class Autograd:
    """HIPS autograd: NumPy's arrays, eagerly."""

    def __init__(self):
        self.xp = importlib.import_module("autograd.numpy")
        self.autograd = importlib.import_module("autograd")

    def gradients(self, function, arguments):
        return self.autograd.grad(lambda a: function(*a))(tuple(arguments))

    def numpy(self, x):
        return np.asarray(x)


class Strict(Autograd):
    """The array API standard, to the letter. It differentiates nothing."""

    gradients = None

    def __init__(self):
        self.xp = importlib.import_module("array_api_strict")


class Jax(Autograd):
    def __init__(self):
        jax = importlib.import_module("jax")
        jax.config.update("jax_enable_x64", True)
        self.xp, self.jax = importlib.import_module("jax.numpy"), jax

    def gradients(self, function, arguments):
        return self.jax.grad(lambda a: function(*a))(tuple(arguments))


class Torch(Autograd):
    def __init__(self):
        self.xp = importlib.import_module("torch")

    def gradients(self, function, arguments):
        arguments = [a.clone().requires_grad_() for a in arguments]
        result = function(*arguments)
        if not result.requires_grad:
            return [self.xp.zeros_like(a) for a in arguments]
        found = self.xp.autograd.grad(result, arguments, allow_unused=True)
        return [
            self.xp.zeros_like(a) if f is None else f for a, f in zip(arguments, found, strict=True)
        ]

    def numpy(self, x):
        return x.detach().numpy()


#: Libraries' exp, sin and log differ in the last place, which narrow lobes amplify.
RELATIVE = 1e-10

# Where formulas do not use a value it may be infinite; autograd says that some have no derivative.
pytestmark = [
    pytest.mark.filterwarnings("ignore::RuntimeWarning"),
    pytest.mark.filterwarnings("ignore:Output seems independent of input"),
]

LIBRARIES = {"autograd": Autograd, "array_api_strict": Strict, "jax": Jax, "torch": Torch}


def library_of(name):
    pytest.importorskip(name, reason=f"{name} is not installed")
    return LIBRARIES[name]()


@pytest.fixture(scope="module", params=LIBRARIES)
def library(request):
    return library_of(request.param)


@pytest.fixture(scope="module", params=[n for n, c in LIBRARIES.items() if c.gradients])
def differentiating(request):
    return library_of(request.param)


@pytest.fixture(scope="module")
def brdfc(tmp_path_factory):
    out = tmp_path_factory.mktemp("python")
    subprocess.run([TOOL, "python", "--out", out], check=True, capture_output=True)
    sys.path.insert(0, str(out))
    try:
        yield importlib.import_module("brdfc")
    finally:
        sys.path.remove(str(out))


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def above(v):
    return v * [1, 1, 0] + np.abs(v) * [0, 0, 1]


def kind(parameter):
    return type(parameter).__name__


def numeric(model):
    return {n: p for n, p in model.parameters.items() if kind(p) != "Choice"}


def all_choices(model):
    names = [n for n, p in model.parameters.items() if kind(p) == "Choice"]
    return [dict(zip(names, words, strict=True)) for words in model.formulas]


def inner_values(model):
    """The defaults, but for those at kinks: at an end of their range, as differences take both
    sides; grey, whose channels are all the largest; and equal ones, of which a curve's knots may
    be chosen by the largest."""
    values = {}
    for i, (name, p) in enumerate(numeric(model).items()):
        low, high = (p.soft_min, p.soft_max) if kind(p) == "Number" else (0.0, 1.0)
        margin = 0.03 * (high - low)
        value = np.asarray(p.default, float)
        at_an_end = (value <= p.min) | (value >= p.max)
        value = np.where(at_an_end, np.clip(value, low + margin, high - margin), value)
        apart = np.array([1, 0.9, 0.8]) * (1 - i / 1000)
        values[name] = value * apart if kind(p) == "Color" else value
    return values


def random_values(model, random):
    values = {}
    for name, p in numeric(model).items():
        low, high = (p.soft_min, p.soft_max) if kind(p) == "Number" else (0.0, 1.0)
        margin = 0.03 * (high - low)
        values[name] = random.uniform(
            low + margin, high - margin, size=3 if kind(p) == "Color" else ()
        )
    return values


@pytest.mark.many
@pytest.mark.parametrize("name", MODELS)
def test_values_are_those_on_numpy(brdfc, library, name):
    model, random = brdfc.model(name), np.random.default_rng(1)
    on = model.on(library.xp)
    wi, wo = unit(random.normal(size=(2, 4, 10, 3)))
    wi[0, :3] = wo[1, 0] = [0, 0, 1]
    wi[0, 3] = wo[0, 4] = [1, 0, 0]
    up, u = above(wo), random.uniform(size=wo.shape)
    if not model.two_sided:
        up[..., 2] = np.maximum(up[..., 2], 1e-3)
        up = unit(up)
        up[1, 1:3] = [[0, 0, -1], [0.6, 0, -0.8]]  # lost
    textured = {}
    for parameter, p in numeric(model).items():
        if kind(p) == "Number":
            textured[parameter] = random.uniform(p.soft_min, p.soft_max, size=10)
        else:
            textured[parameter] = random.uniform(size=(4, 1, 3))
    for choices in all_choices(model):
        for values in ({}, textured):
            given = {n: library.xp.asarray(v) for n, v in values.items()}
            for what, vectors in [
                ("eval", (wi, wo)),
                ("pdf", (wi, wo)),
                ("sample", (up, u)),
                ("mirror", (wo,)),
                ("transmit", (wo,)),
            ]:
                expected = getattr(model, what)(*vectors, **values, **choices)
                arrays = [library.xp.asarray(v) for v in vectors]
                got = getattr(on, what)(*arrays, **given, **choices)
                if what != "sample":
                    expected, got = [expected], [got]
                for e, g in zip(expected, got, strict=True):
                    g = library.numpy(g)
                    assert g.dtype == np.float64
                    assert g.shape == e.shape
                    np.testing.assert_allclose(g, e, rtol=RELATIVE, atol=1e-12, err_msg=what)


def scalars(what, result):
    """A number for each point, of all that a function returns."""
    if what == "eval" or what in ("mirror", "transmit"):
        return result[..., 0] + 2.0 * result[..., 1] + 3.0 * result[..., 2]
    if what == "sample":
        return result.pdf + scalars("eval", result.wi) + scalars("eval", result.weight)
    return result


class Call(NamedTuple):
    """A function of a model, of vectors and then the values of parameters."""

    what: str
    vectors: int
    names: list[str]
    choices: dict[str, str]

    def __call__(self, model, *arguments):
        values = dict(zip(self.names, arguments[self.vectors :], strict=True))
        found = getattr(model, self.what)(*arguments[: self.vectors], **values, **self.choices)
        return scalars(self.what, found)

    def total(self, model):
        return lambda *arguments: self(model, *arguments).sum()


def functions(wi, wo, u):
    """The arrays of vectors that each function of a model takes."""
    both = [wi, wo]
    return {"eval": both, "pdf": both, "sample": [wo, u], "mirror": [wo], "transmit": [wo]}


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_gradients_are_finite_differences(brdfc, differentiating, name):
    """By numbers, colours, and along the sphere of directions, at pairs around the mirror direction
    and far from it."""
    model, random = brdfc.model(name), np.random.default_rng(2)
    on, array = model.on(differentiating.xp), differentiating.xp.asarray
    wo = above(unit(random.normal(size=(8, 3))))
    around = above(unit(wo * [-1, -1, 1] + 0.3 * random.normal(size=wo.shape)))
    wi = np.concatenate([around, above(unit(random.normal(size=wo.shape)))])
    wo = np.concatenate([wo, wo])
    u = random.uniform(0.01, 0.99, size=wi.shape)
    some = 0
    for choices in all_choices(model):
        for values in (inner_values(model), random_values(model, random)):
            wide = [np.broadcast_to(v, (len(wi), *v.shape)) + 0.0 for v in values.values()]
            for what, vectors in functions(wi, wo, u).items():
                call = Call(what, len(vectors), list(values), choices)

                point = [*vectors, *wide]
                gradients = differentiating.gradients(call.total(on), [array(p) for p in point])
                gradients = [differentiating.numpy(g) for g in gradients]
                value = np.abs(call(model, *point))
                moves = []  # which argument, and along what
                for i in range(len(point)):
                    if point[i] is wi or point[i] is wo:
                        across = unit(np.cross(point[i], random.normal(size=wi.shape)))
                        moves += [(i, across), (i, np.cross(point[i], across))]
                    elif point[i].ndim == 1:
                        moves.append((i, 1.0))
                    else:
                        moves += [(i, e) for e in np.eye(3)]
                for i, along in moves:
                    size = np.abs(point[i]).max() if point[i].ndim == 1 else 1.0
                    step = 1e-5 * max(size, 1e-2)

                    def moved(by, i=i, along=along, point=point, call=call):
                        there = list(point)
                        there[i] = point[i] + by * along
                        return call(model, *there)

                    coarse, fine = ((moved(h) - moved(-h)) / (2 * h) for h in (step, step / 2))
                    expected = (4 * fine - coarse) / 3
                    got = gradients[i] * along
                    got = got.sum(-1) if got.ndim > 1 else got
                    # Differences of values lose what those are rounded by; at a kink two differ.
                    # XLA takes numbers below 1e-308 for 0.
                    allowed = 1e-5 * np.abs(expected) + 1e-12 * value / step + 1e-300
                    allowed += 10 * np.abs(fine - coarse)
                    wrong = np.abs(got - expected) > allowed
                    assert not wrong.any(), (i, what, choices, got[wrong], expected[wrong])
                    some += np.count_nonzero(np.abs(expected) > allowed)
    assert some > 20


#: Models with a parameter whose default is an end of its range.
AT_ENDS = [
    (m["name"], p["name"])
    for m in LISTED
    for p in m["parameters"]
    if p["kind"] == "number" and p["default"] in (p["min"], p["max"]) and m["scatter"]
]


@pytest.mark.parametrize(("name", "parameter"), AT_ENDS)
def test_a_default_at_an_end_has_the_slope_inside(brdfc, differentiating, name, parameter):
    """Where a bound equals what it bounds, the slope is not that of the bound."""
    model, random = brdfc.model(name), np.random.default_rng(6)
    at = model.parameters[parameter]
    inside = 1e-5 if at.default == at.min else -1e-5
    wi, wo = above(unit(random.normal(size=(2, 16, 3))))
    for what in ("eval", "pdf"):
        call = Call(what, 2, [parameter], {})
        values = [wi, wo, np.full(len(wi), at.default)]
        array = differentiating.xp.asarray
        on = model.on(differentiating.xp)
        got = differentiating.gradients(call.total(on), [array(v) for v in values])[2]
        f = [call(model, wi, wo, values[2] + k * inside) for k in range(3)]
        expected = (-3 * f[0] + 4 * f[1] - f[2]) / (2 * inside)
        allowed = 1e-4 * np.abs(expected).max() + 1e-9 * np.abs(f[0]).max()  # differences round
        np.testing.assert_allclose(differentiating.numpy(got), expected, 1e-4, allowed)


def ends():
    """Pairs of directions at which something in a formula has no derivative."""
    random = np.random.default_rng(4)
    wi, wo = above(unit(random.normal(size=(2, 6, 3))))
    up = np.broadcast_to([0.0, 0.0, 1.0], wi.shape)
    turned, flat = [1, 1, -1], unit(wi * [1, 1, 0])
    yield from [(wi, wo), (wi * turned, wo), (wi, wo * turned), (wi * turned, wo * turned)]
    yield from [(up, wo), (wi, up), (up, up), (-up, wo), (wi, -up), (-wo, wo), (wo, wo)]
    yield from [(wo * [-1, -1, 1], wo), (flat, wo), (wi, flat), (flat, flat)]


@pytest.mark.many
@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("name", MODELS)
def test_gradients_are_numbers_everywhere(brdfc, differentiating, name, precision):
    """Along the normal, at the horizon, and below the surface, where values are 0: what a selection
    leaves out must not reach the gradient as 0 * inf."""
    model = brdfc.model(name)
    on = model.on(differentiating.xp)
    wi, wo = (np.concatenate(v) for v in zip(*ends(), strict=True))
    u = np.random.default_rng(5).uniform(size=wi.shape)
    u[:3] = 0
    wide = {n: np.asarray(p.default, float) for n, p in numeric(model).items()}
    wide = {n: np.broadcast_to(v, (len(wi), *v.shape)) for n, v in wide.items()}
    for choices in all_choices(model):
        for what, vectors in functions(wi, wo, u).items():
            call = Call(what, len(vectors), list(wide), choices)
            point = [
                differentiating.xp.asarray(a.astype(precision)) for a in (*vectors, *wide.values())
            ]
            for i, g in enumerate(differentiating.gradients(call.total(on), point)):
                g = differentiating.numpy(g)
                assert np.isfinite(g).all(), (what, choices, i)


def test_albedo_is_that_on_numpy(brdfc, library):
    model = brdfc.model("microfacet")
    on, array = model.on(library.xp), library.xp.asarray
    cosine, ax = np.array([[0.3], [1 + 2.3e-16]]), np.array([0.1, 0.2, 0.4])  # rounded
    f0 = np.full((3, 3), 0.5)
    expected = model.albedo(cosine, 0.3, samples=64, ax=ax, f0=f0)
    got = on.albedo(array(cosine), 0.3, samples=64, ax=array(ax), f0=array(f0))
    np.testing.assert_allclose(library.numpy(got), expected, rtol=1e-10)
    assert got.shape == (2, 3, 3)
    if library.gradients:
        (slope,) = library.gradients(
            lambda a: on.albedo(0.7, samples=64, ax=a, ay=0.2).sum(), [array(np.array(0.2))]
        )
        at = [model.albedo(0.7, samples=64, ax=a, ay=0.2).sum() for a in (0.2 - 1e-5, 0.2 + 1e-5)]
        assert float(slope) == pytest.approx((at[1] - at[0]) / 2e-5, rel=1e-5)


def test_lists_and_numbers_take_the_type_of_arrays(brdfc, library):
    on, array = brdfc.model("ward").on(library.xp), library.xp.asarray
    up = array(np.array([0.0, 0.0, 1.0], np.float32))
    for given in ({}, {"ks": 1}, {"ax": 0.2, "ks": [0.1, 0.2, 0.3]}):
        f = library.numpy(on.eval(up, [0.6, 0, 0.8], **given))
        assert f.dtype == np.float32
        np.testing.assert_allclose(
            f, brdfc.model("ward").eval([0, 0, 1], [0.6, 0, 0.8], **given), rtol=1e-5
        )
    whole = array(np.array([0, 0, 1]))
    assert on.eval(whole, up).dtype == up.dtype


def test_errors_name_model_and_parameter(brdfc, library):
    xp = library.xp
    on, up = brdfc.model("ward").on(xp), xp.asarray(np.array([0.0, 0.0, 1.0]))
    assert repr(on).startswith("brdfc.model('ward').on(")
    for error, words, call in [
        (TypeError, "ward: unknown parameter 'a'", lambda: on.eval(up, up, a=up)),
        (ValueError, "ward: normalisation: .*'x'", lambda: on.eval(up, up, normalisation="x")),
        (ValueError, r"ward: wo: .*\(2,\)", lambda: on.eval(up, up[:2])),
        (ValueError, r"ward: ks: .*\(2,\)", lambda: on.eval(up, up, ks=up[:2])),
        (ValueError, "ward: shapes do not", lambda: on.eval(xp.stack([up, up]), up, ax=up)),
        (TypeError, "ward: wi: expected numbers", lambda: on.eval("up", up)),
        (TypeError, "ward: .*expected .*numbers", lambda: on.eval(up > 0, up)),
        (ValueError, "ward: samples", lambda: on.albedo(up, samples=0)),
        (TypeError, "ward: unknown parameter 'a'", lambda: on.albedo(0.5, a=1)),
        (TypeError, "ward: on: expected a namespace", lambda: brdfc.model("ward").on("numpy")),
    ]:
        with pytest.raises(error, match=words):
            call()


def test_jax_compiles_and_maps(brdfc):
    jax = library_of("jax").jax
    on = brdfc.model("ashikhmin_shirley").on(jax.numpy)
    wi, wo = (
        jax.numpy.asarray(above(unit(v))) for v in np.random.default_rng(3).normal(size=(2, 9, 3))
    )

    def loss(nu, i, o):
        return on.eval(i, o, nu=nu).sum()

    expected = [jax.grad(loss)(50.0, i, o) for i, o in zip(wi, wo, strict=True)]
    mapped = jax.jit(jax.vmap(jax.grad(loss), in_axes=(None, 0, 0)))(50.0, wi, wo)
    np.testing.assert_allclose(mapped, expected, rtol=1e-9, atol=1e-14)
    sample = jax.jit(on.sample)(wo, jax.numpy.full_like(wo, 0.4))
    np.testing.assert_allclose(
        sample.wi,
        brdfc.model("ashikhmin_shirley").sample(wo, np.full(wo.shape, 0.4)).wi,
        atol=1e-12,
    )
