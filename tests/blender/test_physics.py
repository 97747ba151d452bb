# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles computes against what the models say, by the virtual gonioreflectometer."""

import functools
import math

import bpy
import numpy as np
import pytest
from goniometer import Goniometer, frame, tilted, unit
from helpers import albedo, evaluate, with_every_model

SUNS = [(0, 0, 1), (0.3, -0.2, 0.9), (0.8, 0.1, 0.6), (-0.5, 0.8, 0.3), (0.2, 0.95, 0.1)]

EXACT = with_every_model(
    "exact",
    ("lambert", {"rho": (0.9, 0.5, 0.1)}),
    ("coupled", {"r0": 0.05, "rm": (1.0, 0.5, 0.1)}),
    ("coupled", {"r0": 0.0, "rm": (1.0, 1.0, 1.0)}),
    ("coupled", {"r0": 0.7, "rm": (0.2, 0.4, 0.8)}),
)


def start(extension, model, form, values, max_bounces):
    """A clean scene and a material in it."""
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=max_bounces)
    return scene, extension.api.new_material(model, form, **values)


def random_normals(rng, count):
    """Facets seen at cosines from 0.02 to 1, evenly in solid angle."""
    return tilted(rng.uniform(0.02, 1, count), rng.uniform(0, 2 * math.pi, count))


@pytest.mark.parametrize(("model", "values"), EXACT)
def test_exact_form_under_a_sun(extension, empty, tool, model, values):
    """Closures are evaluated, not sampled, under a lamp without size: no noise, float accuracy."""
    rng = np.random.default_rng(1)
    measured, expected = [], []
    for towards in SUNS:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene, material = start(extension, model, "exact", values, max_bounces=0)
        meter = Goniometer(scene, material, random_normals(rng, 400), samples=4)
        wi = meter.local(meter.add_sun(unit(towards)))
        # Beside the terminator alone float rounding decides which side the sun is on.
        clear = np.abs(wi[:, 2]) > 1e-4
        lit = clear & (wi[:, 2] > 0)
        f_cos = np.zeros_like(wi)
        f_cos[lit] = evaluate(tool, model, values, wi[lit], meter.wo()[lit]) * wi[lit, 2:]
        measured.append(meter.measure()[clear])
        expected.append(f_cos[clear])
    measured, expected = np.concatenate(measured), np.concatenate(expected)
    if not extension.pack.model(model)["scatter"]:
        assert measured.max() == 0, "a delta term can't meet a lamp without size"
        return
    assert (expected > 0).mean() > 0.3
    error = np.abs(measured - expected).sum() / np.abs(expected).sum()
    print(f"relative L1 of {model}: {error:.3g}")
    assert error <= 2e-5


@pytest.mark.parametrize(("model", "values"), EXACT)
def test_furnace_of_exact_form(extension, empty, tool, model, values):
    cosines = np.linspace(0.01, 1, 64)
    # At grazing views Cycles rarely picks the closure that carries the rest: more pixels there.
    replicas = np.where(cosines < 0.02, 128, np.where(cosines < 0.06, 16, 2))
    scene, material = start(extension, model, "exact", values, max_bounces=1)
    meter = Goniometer(scene, material, tilted(np.repeat(cosines, replicas), 0.3), samples=8192)
    meter.add_world()
    first = np.cumsum(replicas) - replicas
    expected = albedo(tool, model, values, meter.wo()[first, 2])
    measured = np.add.reduceat(meter.measure(), first, axis=0) / replicas[:, None]
    error = np.abs(measured - expected).max()
    print(f"largest furnace error of {model}: {error:.3g}")
    assert error <= 1e-3


# Sampled forms. A furnace can't verify one: its weights are f cos / pdf, and any wrong distribution
# whose weights fit passes. So each also sees worlds that vary with direction.

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
#: Facets: view cosines times azimuths, each seen by so many pixels that its noise can be measured.
COSINES = (1.0, 0.8, 0.5, 0.25, 0.1)
KINDS = tilted(COSINES, 0.4 + 2.1 * np.arange(len(COSINES)))
REPLICAS = 48
SAMPLES = 512


def white(_tree, _background):
    return lambda d: np.ones(len(d))


def gradient(tree, background):
    """From black to white along an oblique axis."""
    axis = unit((0.6, -0.5, 0.3))
    _along(tree, background, axis, lambda dot: _math(tree, "MULTIPLY_ADD", dot, 0.5, 0.5))
    return lambda d: 0.5 + 0.5 * d @ axis


def spot(tree, background):
    """A smooth spot, about 10 degrees wide, low over the horizon."""
    axis = unit((0.5, 0.6, 0.5))

    def shape(dot):
        return _math(tree, "POWER", _math(tree, "MAXIMUM", dot, 0.0), 60.0)

    _along(tree, background, axis, shape)
    return lambda d: np.maximum(d @ axis, 0) ** 60


def _math(tree, operation, *inputs):
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    for socket, value in zip(node.inputs, inputs, strict=False):
        if isinstance(value, float):
            socket.default_value = value
        else:
            tree.links.new(value, socket)
    return node.outputs[0]


def _along(tree, background, axis, shape):
    direction = tree.nodes.new("ShaderNodeTexCoord")
    dot = tree.nodes.new("ShaderNodeVectorMath")
    dot.operation = "DOT_PRODUCT"
    tree.links.new(direction.outputs["Generated"], dot.inputs[0])
    dot.inputs[1].default_value = axis
    tree.links.new(shape(dot.outputs["Value"]), background.inputs["Strength"])


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
    """f cos dw of the model towards the nodes of the hemisphere, and its mirror weight, for the
    kinds of facets: (kinds, nodes, 3) and (kinds, 3)."""
    wi, weights = hemisphere()
    values = dict(values)
    local_wo = [local(normal, np.array([0.0, 0.0, 1.0])) for normal in KINDS]
    f = [evaluate(tool, model, values, wi, np.broadcast_to(wo, wi.shape)) for wo in local_wo]
    mirror = np.array([mirror_weight(tool, model, values, wo[2]) for wo in local_wo])
    scattered = np.array(f) * (wi[:, 2] * weights)[:, None]
    for wo, found in zip(local_wo, scattered.sum(1) + mirror, strict=True):
        phi = math.atan2(wo[1], wo[0])
        assert found == pytest.approx(albedo(tool, model, values, [wo[2]], phi)[0], abs=1e-3), (
            f"{model}: too glossy for this quadrature; give it milder values in SAMPLED"
        )
    return scattered, mirror


def axes(normal):
    """Rows: the frame of a facet, in world coordinates."""
    return np.stack([*frame(normal), normal])


def local(normal, direction):
    return axes(normal) @ direction


def expected_radiance(tool, model, values, radiance):
    """Integral of f cos L over the hemisphere of each kind of facet, with mirror; (kinds, 3)."""
    wi, _ = hemisphere()
    scattered, mirror = kernel(tool, model, tuple(values.items()))
    result = []
    for normal, f, weight in zip(KINDS, scattered, mirror, strict=True):
        wo = local(normal, np.array([0.0, 0.0, 1.0]))
        mirrored = np.array([-wo[0], -wo[1], wo[2]]) @ axes(normal)
        result.append(
            (f * radiance(wi @ axes(normal))[:, None]).sum(0) + weight * radiance(mirrored[None])[0]
        )
    return np.array(result)


def mirror_weight(tool, model, values, cos_theta):
    from helpers import arguments, read_csv, to_csv

    stdin = to_csv(("cos_theta_o",), [[cos_theta]])
    names, rows = read_csv(tool("albedo", model, *arguments(values), stdin=stdin))
    return np.array([rows[0, names.index(f"mirror_{c}")] for c in "rgb"])


# The gradient alone would find most errors; it is the one of the developer's loop.
WORLDS = [
    pytest.param(white, marks=pytest.mark.full),
    gradient,
    pytest.param(spot, marks=pytest.mark.full),
]


@pytest.mark.parametrize("world", WORLDS, ids=lambda w: w.__name__)
@pytest.mark.parametrize(("model", "values"), SAMPLED)
def test_sampled_form_in_a_world(extension, empty, tool, model, values, world):
    """Per kind of facet a z-test: the mean over replicas against quadrature, in standard errors."""
    scene, material = start(extension, model, "sampled", values, max_bounces=1)
    normals = np.repeat(KINDS, REPLICAS, 0)
    meter = Goniometer(scene, material, normals, samples=SAMPLES, perspective=True)
    radiance = world(*meter.add_world())
    measured = meter.measure().reshape(len(KINDS), REPLICAS, 3)
    expected = expected_radiance(tool, model, values, radiance)
    mean = measured.mean(1)
    error = measured.std(1, ddof=1) / math.sqrt(REPLICAS)
    # Where only a few samples meet light, replicas do not show the error; samples are at most 1.
    total = SAMPLES * meter.coverage.reshape(len(KINDS), REPLICAS).sum(1)[:, None]
    rare = expected * total < 100
    error = np.where(rare, np.sqrt(expected / total) + 1 / total, error)
    # What the quadrature, the spread of view directions and single precision may add.
    error = np.hypot(error, 1e-4)
    z = (mean - expected) / error
    print(f"{model} {world.__name__}: {np.round(mean[:, 0], 4)} {np.round(expected[:, 0], 4)}")
    assert np.abs(z).max() < 4.5, f"z = {np.round(z, 1)}"


# As fig. 2 of Ashikhmin and Shirley: a mirror-like sphere, n_u = n_v = 10, in a white room.

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

    # Blender's own node with that distribution gives back energy that is lost.
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


@pytest.mark.parametrize(("model", "values"), TABLES)
def test_albedo_output_panel_and_model_agree(extension, empty, tool, model, values):
    cosines = np.linspace(0.02, 1, 50)
    if not extension.pack.model(model).get("albedo"):
        pytest.skip("delta terms alone, with more parameters than a table has axes")
    panel = np.array([extension.api.albedo(model, c, **values) for c in cosines])
    entry = extension.pack.model(model)
    complete = {p["name"]: p["default"] for p in entry["parameters"]} | values
    # The table holds the mean over azimuth: quadrature at one azimuth is that only without stretch.
    if entry["isotropic"] or ("nu" in complete and complete["nu"] == complete["nv"]):
        error = entry["albedo"]["error"]
        off = np.abs(panel - albedo(tool, model, values, cosines)).max()
        print(f"{model}: {off:.3g}, table says {error:.3g}")
        # The table's error is the largest at random points of its own, so it is no strict bound.
        assert off <= 2 * error + 1e-6

    for form in extension.pack.model(model)["representations"]:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene, material = start(extension, model, form, values, max_bounces=0)
        tree = material.node_tree
        node = extension.nodes.group_nodes(material)[0]
        output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
        emission = tree.nodes.new("ShaderNodeEmission")
        tree.links.new(node.outputs["Albedo"], emission.inputs["Color"])
        tree.links.new(emission.outputs[0], output.inputs["Surface"])
        meter = Goniometer(scene, material, tilted(cosines, 0.7), samples=4)
        shader = meter.measure()
        assert np.abs(shader - panel).max() < 2e-5
