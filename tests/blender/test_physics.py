# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares what Cycles computes with the models, by the virtual gonioreflectometer."""

import functools
import math

import bpy
import numpy as np
import pytest
from goniometer import Goniometer, frame, tilted, unit
from helpers import (
    WITHOUT_ALBEDO,
    albedo,
    albedo_and_mirror,
    draw,
    evaluate,
    materials_of,
    show_albedo,
    with_every_model,
)
from worlds import coloured, gradient, half, spot, white

SUNS = [(0, 0, 1), (0.3, -0.2, 0.9), (0.8, 0.1, 0.6), (-0.5, 0.8, 0.3), (0.2, 0.95, 0.1)]

EXACT = with_every_model(
    "exact",
    ("lambert", {"rho": (0.9, 0.5, 0.1)}),
    ("disney_diffuse", {"rho": (1.0, 0.5, 0.02), "r": 1.0}),
    ("eon", {"rho": (1.0, 0.5, 0.02), "r": 1.0}),
    ("coupled", {"r0": 0.05, "rm": (1.0, 0.5, 0.1)}),
    ("coupled", {"r0": 0.0, "rm": (1.0, 1.0, 1.0)}),
    ("coupled", {"r0": 0.7, "rm": (0.2, 0.4, 0.8)}),
)


def start(extension, model, form, values, max_bounces):
    """A clean scene, and a material in it."""
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=max_bounces)
    return scene, extension.api.new_material(model, form, **values)


def measure_each(
    extension, form, cases, normals, samples, max_bounces, light=None, **meter_options
):
    """Renders the normals for each case at once. Returns by case an exception, or radiance (n, 3),
    coverage and first facet; and the goniometer. `light(meter)` adds the lights."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=max_bounces)
    made = materials_of(extension, form, cases)
    sound = [m for m in made if not isinstance(m, Exception)]
    if not sound:
        return made, None
    count = len(normals)
    meter = Goniometer(
        scene,
        sound,
        np.tile(normals, (len(sound), 1)),
        samples,
        which=np.repeat(np.arange(len(sound)), count),
        **meter_options,
    )
    light(meter)
    radiance = meter.measure().reshape(len(sound), count, 3)
    coverage = meter.coverage.reshape(len(sound), count)
    found = iter(zip(radiance, coverage, range(0, len(radiance) * count, count), strict=True))
    return [m if isinstance(m, Exception) else next(found) for m in made], meter


def random_normals(rng, count):
    """Facets seen at cosines from 0.02 to 1, uniform in solid angle."""
    return tilted(rng.uniform(0.02, 1, count), rng.uniform(0, 2 * math.pi, count))


@pytest.mark.parametrize(("model", "values"), EXACT)
def test_exact_form_under_a_sun(extension, empty, tool, batch, request, model, values):
    """Under a lamp without a size, closures are evaluated and not sampled: no noise, float
    accuracy."""

    def measure(cases):
        rng = np.random.default_rng(1)
        results = [([], [], []) for _ in cases]
        for towards in SUNS:
            suns = []
            found, meter = measure_each(
                extension,
                "exact",
                cases,
                random_normals(rng, 200),
                4,
                0,
                lambda m, t=towards, s=suns: s.append(m.add_sun(unit(t))),
            )
            wi, wo = (meter.local(suns[0]), meter.wo()) if meter else (None, None)
            for i, case in enumerate(found):
                if isinstance(case, Exception):
                    results[i] = case
                    continue
                radiance, _, first = case
                part = slice(first, first + len(radiance))
                for part_of, what in zip(results[i], (radiance, wi[part], wo[part]), strict=True):
                    part_of.append(what)
        return results

    found = batch.result(request, measure)
    measured, wi, wo = (np.concatenate(part) for part in found)
    # Near the terminator, rounding to float decides on which side the sun is.
    clear = np.abs(wi[:, 2]) > 1e-4
    lit = clear & (wi[:, 2] > 0)
    expected = np.zeros_like(wi)
    expected[lit] = evaluate(tool, model, values, wi[lit], wo[lit]) * wi[lit, 2:]
    measured, expected = measured[clear], expected[clear]
    if not extension.pack.model(model).entry["scatter"]:
        assert measured.max() == 0, "a delta term can't meet a lamp without size"
        return
    assert (expected > 0).mean() > 0.3
    error = np.abs(measured - expected).sum() / np.abs(expected).sum()
    print(f"relative L1 of {model}: {error:.3g}")
    assert error <= 2e-5


#: Models whose exact forms are mirrors, or closures that Cycles samples with hardly any noise: 4096
#: samples show their albedo to 1e-4, where others need as many for 1e-3.
QUIET = {
    "fresnel_conductor",
    "fresnel_dielectric",
    "glass",
    "glossy_specular",
    "lambert",
    "lambertian_specular",
    "modified_phong",
    "shirley_1991",
}


@pytest.mark.many
@pytest.mark.parametrize(("model", "values"), EXACT)
def test_furnace_of_exact_form(extension, empty, tool, batch, request, model, values):
    cosines = np.linspace(0.01, 1, 64)
    # At grazing views, Cycles rarely selects the closure with the remaining light, and few cosine
    # samples carry that of rough matte facets: more pixels there.
    replicas = np.select([cosines < 0.02, cosines < 0.06, cosines < 0.15], [512, 64, 8], 2)
    normals = tilted(np.repeat(cosines, replicas), 0.3)

    def measured_with(samples, cases):
        found, meter = measure_each(
            extension, "exact", cases, normals, samples, 1, lambda m: m.add_world()
        )
        wo = meter.wo()[: len(normals), 2] if meter else None
        return [c if isinstance(c, Exception) else (c[0], wo) for c in found]

    def measure(cases):
        quiet, noisy = [c for c in cases if c[0] in QUIET], [c for c in cases if c[0] not in QUIET]
        of_quiet, of_noisy = iter(measured_with(512, quiet)), iter(measured_with(4096, noisy))
        return [next(of_quiet if model in QUIET else of_noisy) for model, _ in cases]

    radiance, wo = batch.result(request, measure)
    first = np.cumsum(replicas) - replicas
    expected = albedo(tool, model, values, wo[first])
    measured = np.add.reduceat(radiance, first, axis=0) / replicas[:, None]
    error = np.abs(measured - expected).max()
    print(f"largest furnace error of {model}: {error:.3g}")
    assert error <= 1e-3


# Sampled forms. A furnace test can't verify one: its weights are f cos / pdf, and any wrong
# distribution with consistent weights passes. So each form is also tested in worlds that vary with
# direction.

SAMPLED = with_every_model(
    "sampled",
    ("lambert", {"rho": (0.9, 0.5, 0.1)}),
    ("coupled", {"r0": 0.1, "rm": (1.0, 0.5, 0.1)}),
    ("coupled", {"r0": 0.1, "rm": (1.0, 0.5, 0.1), "fresnel": "dielectric"}),
    ("ashikhmin_shirley", {"nu": 20.0, "nv": 20.0, "rs": (0.3, 0.6, 0.9), "rd": (0.5, 0.5, 0.2)}),
    ("ashikhmin_shirley", {"nu": 5.0, "nv": 100.0, "rotation": 0.5, "part": "specular"}),
    ("ashikhmin_shirley", {"part": "diffuse", "rd": 1.0}),
    ("radziszewski_alda", {"n": 2.0}),
    ("radziszewski_alda", {"n": 12.0, "tint": (1.0, 0.6, 0.2)}),
    ("radziszewski_alda", {"n": 4.0, "part": "latitudinal"}),
    ("radziszewski_alda", {"n": 4.0, "part": "longitudinal"}),
    ("glossy_reflector", {"e": 5.0, "cr": (1.0, 0.6, 0.2)}),
    ("glossy_reflector", {"e": 3.0, "below": "lose"}),
    ("glossy_specular", {"e": 8.0, "normalisation": "conserving"}),
    ("ward", {"ax": 0.3, "ay": 0.6, "ks": (1.0, 0.5, 0.2)}),
    ("schlick", {}),
    ("schlick", {"rough": 0.7, "p": 0.4, "r": (0.9, 0.5, 0.1)}),
)
#: Facets: view cosines and azimuths, each seen by enough pixels to measure its noise.
COSINES = (1.0, 0.8, 0.5, 0.25, 0.1)
KINDS = tilted(COSINES, 0.4 + 2.1 * np.arange(len(COSINES)))
REPLICAS = 48
SAMPLES = 512


def hemisphere(cosines=96, azimuths=192):
    """Nodes and solid-angle weights: Gauss-Legendre in the polar angle, equal steps in azimuth."""
    x, w = np.polynomial.legendre.leggauss(cosines)
    theta = (x + 1) * math.pi / 4
    phi = np.arange(azimuths) * 2 * math.pi / azimuths
    sin_theta, cos_theta = np.sin(theta), np.cos(theta)
    wi = np.stack(
        [
            np.outer(sin_theta, np.cos(phi)),
            np.outer(sin_theta, np.sin(phi)),
            np.outer(cos_theta, np.ones_like(phi)),
        ],
        -1,
    ).reshape(-1, 3)
    weights = np.repeat(w * math.pi / 4 * sin_theta * 2 * math.pi / azimuths, azimuths)
    return wi, weights


@functools.cache
def kernel(tool, model, values):
    """Directions and f cos dw of the model in the frames of the kinds of facets, one pair for each
    kind, and its mirror weight, (kinds, 3).

    Uses fixed nodes if they resolve the lobe, as its albedo shows; otherwise the model's own
    samples in double precision, whose pdf the unit tests verify.
    """
    values = dict(values)
    wi, weights = hemisphere()
    views = [local(normal, np.array([0.0, 0.0, 1.0])) for normal in KINDS]
    # Asks once: the tool takes longer to start than to answer.
    everywhere = np.tile(wi, (len(views), 1)), np.repeat(views, len(wi), 0)
    values_of_f = evaluate(tool, model, values, *everywhere).reshape(len(views), len(wi), 3)
    lobes, mirrors = [], []
    for wo, f in zip(views, values_of_f, strict=True):
        azimuth = math.atan2(wo[1], wo[0])
        everything, (mirror,) = albedo_and_mirror(tool, model, values, [wo[2]], azimuth)
        total = everything[0] - mirror
        nodes, f = wi, f * (wi[:, 2] * weights)[:, None]
        if np.abs(f.sum(0) - total).max() > 3e-4:
            nodes, f = draw(tool, model, values, wo, 1 << 15)
            assert np.abs(f.sum(0) - total).max() < 3e-3, f"{model}: samples miss the albedo"
        lobes.append((nodes, f))
        mirrors.append(mirror)
    return lobes, np.array(mirrors)


def axes(normal):
    """The frame of a facet as rows, in world space."""
    return np.stack([*frame(normal), normal])


def local(normal, direction):
    return axes(normal) @ direction


def expected_radiance(tool, model, values, radiance):
    """Integral of f cos L over the hemisphere of each kind of facet, including the mirror; (kinds,
    3)."""
    lobes, mirrors = kernel(tool, model, tuple(values.items()))
    result = []
    for normal, (wi, f), weight in zip(KINDS, lobes, mirrors, strict=True):
        wo = local(normal, np.array([0.0, 0.0, 1.0]))
        mirrored = np.array([-wo[0], -wo[1], wo[2]]) @ axes(normal)
        light = radiance(wi @ axes(normal)).reshape(len(wi), -1)
        result.append((f * light).sum(0) + weight * radiance(mirrored[None])[0])
    return np.array(result)


def light_of_lamp(tool, model, values, normals, wo, towards, angle):
    """Radiance of facets with these normals, seen from `wo`, (n, 3) in their frames, under a sun of
    irradiance 1 and the full angle `angle`; (n, 3)."""
    i = np.arange(64) + 0.5
    radius, turn = math.tan(angle / 2) * np.sqrt(i / 64), i * math.pi * (3 - math.sqrt(5))
    t, b = frame(towards[None])
    points = unit(
        towards + radius[:, None] * (np.cos(turn)[:, None] * t + np.sin(turn)[:, None] * b)
    )
    result = []
    for normal, view in zip(normals, wo, strict=True):
        wi = points @ axes(normal).T
        f = evaluate(tool, model, values, wi, np.broadcast_to(view, wi.shape))
        result.append((f * wi[:, 2:]).mean(0))
    return np.array(result)


# The gradient alone finds most errors; quick runs use only that.
WORLDS = [
    pytest.param(white, marks=pytest.mark.full),
    gradient,
    pytest.param(half, marks=pytest.mark.full),
    pytest.param(spot, marks=pytest.mark.full),
    pytest.param(coloured, marks=pytest.mark.full),
]


@pytest.mark.long
@pytest.mark.sample(16)
@pytest.mark.parametrize("world", WORLDS, ids=lambda w: w.__name__)
@pytest.mark.parametrize(("model", "values"), SAMPLED)
def test_sampled_form_in_a_world(extension, empty, tool, batch, request, model, values, world):
    check_in_a_world(extension, "sampled", tool, batch, request, model, values, world)


def check_in_a_world(extension, form, tool, batch, request, model, values, world):
    """A z-test for each kind of facet: the mean over replicas against quadrature, in standard
    errors."""

    def measure(cases):
        lights = []
        found, _ = measure_each(
            extension,
            form,
            cases,
            np.repeat(KINDS, REPLICAS, 0),
            SAMPLES,
            1,
            lambda m: lights.append(world(*m.add_world())),
            perspective=True,
        )
        return [c if isinstance(c, Exception) else (*c[:2], *lights) for c in found]

    measured, coverage, radiance = batch.result(request, measure)
    measured = measured.reshape(len(KINDS), REPLICAS, 3)
    expected = expected_radiance(tool, model, values, radiance)
    mean = measured.mean(1)
    error = measured.std(1, ddof=1) / math.sqrt(REPLICAS)
    # If only a few samples hit light, replicas underestimate the error; samples are at most 1.
    total = SAMPLES * coverage.reshape(len(KINDS), REPLICAS).sum(1)[:, None]
    rare = expected * total < 100
    error = np.where(rare, np.sqrt(expected / total) + 1 / total, error)
    # Allows for the quadrature, the spread of view directions and single precision.
    error = np.hypot(error, 1e-4)
    z = (mean - expected) / error
    print(f"{model} {world.__name__}: {np.round(mean[:, 0], 4)} {np.round(expected[:, 0], 4)}")
    # Thousands of comparisons, with new random numbers whenever a model is added.
    assert np.abs(z).max() < 5.5, f"z = {np.round(z, 1)}"


# Aimed forms: base and rest in worlds without a lamp; test_aimed.py tests them with lamps.

AIMED = with_every_model(
    "aimed",
    ("ashikhmin_shirley", {"nu": 20.0, "nv": 20.0, "rs": (0.3, 0.6, 0.9), "rd": (0.5, 0.5, 0.2)}),
    ("ashikhmin_shirley", {"nu": 5.0, "nv": 100.0, "rotation": 0.5, "part": "specular"}),
    ("ashikhmin_shirley", {"diffuse": "tabulated", "rd": 1.0}),
    ("ward", {"ax": 0.3, "ay": 0.6, "ks": (1.0, 0.5, 0.2)}),
    ("schlick", {"rough": 0.7, "p": 0.4, "r": (0.9, 0.5, 0.1)}),
    ("oren_nayar", {"form": "qualitative"}),
    ("lafortune", {"cxy": 1.0, "e": 4.0}),
)


@pytest.mark.long
@pytest.mark.sample(8)
@pytest.mark.parametrize("world", WORLDS, ids=lambda w: w.__name__)
@pytest.mark.parametrize(("model", "values"), AIMED)
def test_aimed_form_in_a_world(extension, empty, tool, batch, request, model, values, world):
    check_in_a_world(extension, "aimed", tool, batch, request, model, values, world)


@pytest.mark.long
@pytest.mark.sample(6)
@pytest.mark.full
@pytest.mark.parametrize(("model", "values"), SAMPLED)
def test_furnace_of_sampled_form_by_angle(extension, empty, tool, batch, request, model, values):
    """The albedo at 64 view angles, each tested separately: no average hides a wrong angle."""
    cosines = np.linspace(0.01, 1, 64)
    # A facet seen at a grazing angle covers little of its pixel.
    replicas = np.where(cosines < 0.1, 48, 12)
    first = np.cumsum(replicas) - replicas
    normals = tilted(np.repeat(cosines, replicas), 0.3)

    def measure(cases):
        found, meter = measure_each(
            extension, "sampled", cases, normals, 256, 1, lambda m: m.add_world(), perspective=True
        )
        own = meter.own_wo() if meter else None
        return [
            c if isinstance(c, Exception) else (*c[:2], own[c[2] : c[2] + len(normals)])
            for c in found
        ]

    radiance, coverage, own = batch.result(request, measure)
    # Views vary by half a degree, which matters near the horizon: the expected albedo of each facet
    # is interpolated between angles that are dense there.
    knots = np.unique(np.concatenate([cosines, np.linspace(0.003, 0.1, 24)]))
    # Views lie along the default tangent: the azimuth is 0 except for the perspective, which
    # matters only near the normal, where the azimuth does not.
    azimuth = np.median(np.arctan2(own[:, 1], own[:, 0]))
    table = albedo(tool, model, values, knots, azimuth)
    truth = np.stack([np.interp(own[:, 2], knots, channel) for channel in table.T], -1)

    def mean(x):
        return np.add.reduceat(x, first, axis=0) / replicas[:, None]

    expected, measured = mean(truth), mean(radiance)
    error = np.sqrt(mean((radiance - truth - mean(radiance - truth).repeat(replicas, 0)) ** 2))
    error /= np.sqrt(replicas - 1)[:, None]
    # Neighbouring angles have similar noise: the median of five is more stable than a few replicas.
    # If only about a hundred rays hit the facets, even that underestimates it.
    padded = np.pad(error, ((2, 2), (0, 0)), mode="edge")
    steady = np.median([padded[i : i + len(cosines)] for i in range(5)], 0)
    rays = 256 * np.add.reduceat(coverage, first)[:, None]
    error = np.maximum(error, steady)
    error = np.maximum(error, np.where(rays < 1000, 0.5 / np.sqrt(rays), 2e-4))
    # Rays that are lost occasionally: if fewer than a hundred are, replicas underestimate the
    # noise.
    full = table.max(0)
    lost = np.maximum(1 - expected / np.maximum(full, 1e-9), 0)
    error = np.maximum(error, np.where(lost * rays < 100, full * np.sqrt(lost / rays), 0))
    z = (measured - expected) / error
    worst = np.unravel_index(np.abs(z).argmax(), z.shape)
    print(f"{model}: mean error {(measured - expected).mean():.2e}, worst z {z[worst]:.1f}")
    assert np.abs(z).max() < 6, f"at cos {cosines[worst[0]]:.3f}: z = {z[worst]:.1f}"
    # All angles together: detects a small bias common to all.
    mean_z = (measured - expected).mean(0) / (np.sqrt((error**2).sum(0)) / len(cosines))
    assert np.abs(mean_z).max() < 5, f"mean z = {mean_z}"


# As in fig. 2 of Ashikhmin and Shirley: a mirror-like sphere, n_u = n_v = 10, in a white room.

RIM = 0.09


def test_as_fig2_centre_and_rim(extension, empty, tool):
    values = {"nu": 10.0, "nv": 10.0, "rs": 1.0, "part": "specular"}
    replicas = 128
    normals = np.repeat(tilted((1.0, RIM), np.array([0.0, 0.7])), replicas, 0)

    def measure(material):
        meter = Goniometer(scene, material, normals, samples=4096, perspective=True)
        meter.add_world()
        found = meter.measure()[:, 0].reshape(2, replicas)
        return found.mean(1), found.std(1, ddof=1) / math.sqrt(replicas)

    quadrature = albedo(tool, "ashikhmin_shirley", values, (1.0, RIM))[:, 0]
    assert quadrature[0] == pytest.approx(0.6957, abs=1e-4)
    assert quadrature[1] == pytest.approx(0.52, abs=0.01)

    scene, material = start(extension, "ashikhmin_shirley", "sampled", values, max_bounces=1)
    (centre, rim), (centre_error, rim_error) = measure(material)
    print(f"sampled: {centre:.4f} +- {centre_error:.4f}, {rim:.4f} +- {rim_error:.4f}")
    print(f"quadrature: {quadrature[0]:.4f}, {quadrature[1]:.4f}")
    assert centre == pytest.approx(0.6957, abs=1e-3)
    assert rim == pytest.approx(quadrature[1], abs=max(4 * rim_error, 2e-3))

    # Blender's own node with that distribution adds the lost energy back.
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=1)
    glossy = extension.scene_loader.glossy_material(
        "glossy", {"rs": (1.0,) * 3, "nu": 10, "nv": 10}
    )
    (centre, rim), _ = measure(glossy)
    print(f"Blender's Glossy node: {centre:.4f}, {rim:.4f}")
    assert centre == pytest.approx(0.6957, abs=2e-3)
    assert rim == pytest.approx(0.83, abs=0.03)


def test_ashikhmin_shirley_loses_nothing_by_eq_12(extension, empty):
    cosines = (1.0, 0.5, 0.17)
    replicas = 64
    normals = np.repeat(tilted(cosines, np.array([0.0, 0.7, 1.4])), replicas, 0)
    reflected, noise = {}, {}
    for diffuse in ("paper", "tabulated"):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        values = {"nu": 10.0, "nv": 10.0, "rd": 1.0, "diffuse": diffuse}
        scene, material = start(extension, "ashikhmin_shirley", "sampled", values, max_bounces=1)
        meter = Goniometer(scene, material, normals, samples=1024, perspective=True)
        meter.add_world()
        facets = meter.measure()[:, 0].reshape(len(cosines), replicas)
        reflected[diffuse] = facets.mean(1)
        noise[diffuse] = facets.std(1, ddof=1) / math.sqrt(replicas)
    print(reflected, noise)
    # The error that the model declares for its tables, plus three standard errors.
    assert noise["tabulated"].max() < 0.015
    assert (np.abs(reflected["tabulated"] - 1) < 0.02 + 3 * noise["tabulated"]).all()
    # Eq. 14 loses more than half.
    assert reflected["paper"][2] < 0.47


def test_lobes_that_are_not_drawn_cost_no_path(extension, empty):
    """A lossless model in a white world is white whatever is sampled, even with a single sample."""
    values = {"n": 4.0, "tint": 1.0}
    scene, material = start(extension, "radziszewski_alda", "sampled", values, max_bounces=1)
    normals = tilted(np.full(64, 0.6), np.linspace(0, 6, 64))
    meter = Goniometer(scene, material, normals, samples=1, perspective=True)
    meter.add_world()
    assert meter.measure() == pytest.approx(1, abs=0.05)


# The Albedo output of the shaders, the panel's numbers and the model must agree.

TABLES = with_every_model(
    None,
    ("lambert", {"rho": (0.9, 0.5, 0.1)}),
    ("coupled", {"r0": 0.13, "rm": (1.0, 0.5, 0.1)}),
    ("ashikhmin_shirley", {"nu": 37.0, "nv": 37.0, "rs": (0.3, 0.6, 0.9), "rd": (0.5, 0.4, 0.2)}),
    ("ashikhmin_shirley", {"nu": 3.0, "nv": 900.0, "part": "specular", "rs": 1.0}),
    ("ashikhmin_shirley", {"part": "diffuse", "rd": (0.9, 0.5, 0.1)}),
    ("radziszewski_alda", {"n": 7.0, "tint": (0.9, 0.5, 0.1)}),
)


@pytest.mark.many
@pytest.mark.sample(6)
@pytest.mark.parametrize(
    ("model", "values"), [case for case in TABLES if case[0] not in WITHOUT_ALBEDO]
)
def test_albedo_output_panel_and_model_agree(extension, empty, tool, model, values):
    cosines = np.linspace(0.02, 1, 50)
    entry = extension.pack.model(model).entry
    quadrature = albedo(tool, model, values, cosines, error=1e-7)
    if entry.get("albedo"):
        expected = np.array([extension.api.albedo(model, c, **values) for c in cosines])
        complete = {p["name"]: p["default"] for p in entry["parameters"]} | values
        # The table contains the mean over azimuths, which quadrature at one azimuth equals only for
        # isotropic lobes.
        if entry["isotropic"] or ("nu" in complete and complete["nu"] == complete["nv"]):
            error = entry["albedo"]["error"]
            off = (np.abs(expected - quadrature) / np.maximum(quadrature, 1)).max()
            print(f"{model}: {off:.3g}, table says {error:.3g}")
            # The stated error is the largest at random points, and not a strict bound.
            assert off <= 2 * error + 1e-6
    else:
        expected = quadrature  # only delta terms, with more parameters than a table has axes

    for form in extension.pack.model(model).forms:
        # A twin has its own albedo, which test_every_fit.py measures.
        unavailable = extension.pack.model(model).forms[form].refusal(values)
        if unavailable or extension.pack.model(model).forms[form].is_native:
            continue
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene, material = start(extension, model, form, values, max_bounces=0)
        extension.api.add_albedo(material)
        show_albedo(material, extension.model_nodes.group_nodes(material)[0])
        meter = Goniometer(scene, material, tilted(cosines, 0.7), samples=4)
        shader = meter.measure()
        assert np.abs(shader - expected).max() < 2e-5


#: Widths other than the defaults, even and uneven.
WIDTHS = {
    "microfacet": [{"ax": 0.7, "ay": 0.7}, {"ax": 0.05, "ay": 0.6}],
    "ward": [{"ax": 0.5, "ay": 0.5}, {"ax": 0.05, "ay": 0.6}],
    "ashikhmin_shirley": [{"nu": 3.0, "nv": 3.0}, {"nu": 5.0, "nv": 1000.0}],
}


@pytest.mark.many
@pytest.mark.parametrize(
    "model",
    [*WIDTHS, "charlie", "coupled", "glossy_reflector", "glossy_specular", "oren_nayar"],
)
def test_the_albedo_output_without_osl_follows_choices_and_widths(extension, empty, model):
    cosines = np.linspace(0.1, 1, 10)
    parameters = extension.pack.model(model).parameters
    choices = [
        {name: choice}
        for name, parameter in parameters.items()
        for choice in parameter.get("choices", ())
    ]
    form = extension.pack.model(model).native_form
    choices = [choice for choice in choices if form.refusal(choice) is None]
    cases = [{**widths, **choice} for widths in WIDTHS.get(model, [{}]) for choice in choices]
    assert cases
    scene, first = start(extension, model, "nodes", cases[0], max_bounces=0)
    scene.cycles.shading_system = False
    made = [first, *(extension.api.new_material(model, "nodes", **v) for v in cases[1:])]
    for material in made:
        (node,) = extension.model_nodes.group_nodes(material)
        show_albedo(material, node)
    which = np.repeat(np.arange(len(made)), len(cosines))
    normals = np.tile(tilted(cosines, 0.7), (len(made), 1))
    picture = Goniometer(scene, made, normals, samples=4, which=which).measure()
    for values, shown in zip(cases, np.split(picture, len(made)), strict=True):
        expected = [extension.api.albedo(model, c, **values) for c in cosines]
        off = np.abs(shown - expected).max()
        print(f"{model} {values}: {off:.2g}")
        # The mean of three isotropic albedos stands for uneven widths.
        uneven = len({values[name] for name in WIDTHS.get(model, [{}])[0]}) > 1
        assert off < (0.035 if uneven else 0.01)
