# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that fitted forms in Cycles are the sums of closures that `brdfc fit` evaluates, and
reflect the model's light."""

import math

import bpy
import furnace
import numpy as np
import pytest
from goniometer import Goniometer, tilted, unit
from helpers import arguments, bend, pairs_csv, read_csv

#: One model for each family of closures, one with three channels, one with terms, one with a
#: mirror.
MATERIALS = {
    "phong": {"e": 40.0, "ks": (0.9, 0.6, 0.2)},
    "oren_nayar": {"sigma": 0.6, "rho": (0.9, 0.5, 0.1)},
    "cook_torrance": {"f0": (0.9, 0.5, 0.05)},
    "schlick_double": {"rd": (0.8, 0.4, 0.1), "r0": 0.1},
}
#: Values of a second material of the same model, which make the parameter a socket: a colour that
#: multiplies everything, and a colour and a number in which f is a polynomial.
SOCKETS = {"phong": {"ks": 0.4}, "oren_nayar": {"rho": 0.4}, "schlick_double": {"r0": 0.02}}
OPEN = {"oren_nayar": ("--any", "rho"), "schlick_double": ("--any", "r0")}
SUNS = [(0, 0, 1), (0.3, -0.2, 0.9), (-0.5, 0.8, 0.3)]
COSINES = (0.1, 0.4, 0.8, 1.0)
FACETS = 96
#: Pixels of a picture of linear colours, and the view cosine at which it tests sampling.
TEXELS = np.array([(0.9, 0.5, 0.1), (0.05, 0.4, 0.8), (1, 1, 1), (0.3, 0.02, 0.6)])
TEXTURED_COSINE = 0.7


@pytest.fixture
def lean(extension, use_pack):
    """The extension with a pack for these materials alone."""
    listed = {
        name: {"model": name, "parameters": values, "representation": "fitted"}
        for name, values in MATERIALS.items()
    }
    grey = {
        f"grey {name}": listed[name] | {"parameters": MATERIALS[name] | other}
        for name, other in SOCKETS.items()
    }
    folder = use_pack(listed | grey)
    shaders = {p.stem for p in (folder / "shaders").iterdir()}
    models = {name for name in shaders if not name.endswith("_albedo")}
    assert models == {f"brdfc_{name}_fitted" for name in MATERIALS}
    return extension


def start(lean):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    lean.scene_loader.apply_clean_settings(bpy.context.scene, max_bounces=0)
    return [lean.api.new_material(name, "fitted", **v) for name, v in MATERIALS.items()]


def fitted(tool, name, wi, wo):
    values = arguments(MATERIALS[name])
    text = tool("fit", name, *values, *OPEN.get(name, ()), "--pairs", stdin=pairs_csv(wi, wo))
    return read_csv(text)[1]


@pytest.mark.long
@pytest.mark.slow
def test_a_sun_on_a_fitted_form(lean, tool):
    """Every pair is within 1e-3 of the largest value of the tool's sum of closures."""
    rng = np.random.default_rng(3)
    which = np.repeat(np.arange(len(MATERIALS)), FACETS)
    lit_pairs = {name: [] for name in MATERIALS}
    for towards in SUNS:
        materials = start(lean)
        normals = tilted(rng.uniform(0.05, 1, len(which)), rng.uniform(0, 2 * math.pi, len(which)))
        # On every other facet, the normal is near the half vector of sun and camera: the highlight.
        half = unit(unit(towards) + (0, 0, 1))
        near = unit(half + 0.1 * rng.normal(size=(len(which), 3)))
        normals = np.where((np.arange(len(which)) % 2 == 0)[:, None], near, normals)
        meter = Goniometer(bpy.context.scene, materials, normals, samples=4, which=which)
        wi = meter.local(meter.add_sun(unit(towards)))
        wo, picture = meter.wo(), meter.measure()
        for i, name in enumerate(MATERIALS):
            lit = (which == i) & (wi[:, 2] > 1e-4)
            dark = (which == i) & (wi[:, 2] < -1e-4)
            assert (picture[dark] == 0).all(), f"{name} is lit from below"
            lit_pairs[name].append(np.hstack([wi[lit], wo[lit], picture[lit]]))
    for name, found in lit_pairs.items():
        wi, wo, measured = np.split(np.concatenate(found), 3, axis=1)
        expected = fitted(tool, name, wi, wo)
        off, largest = np.abs(measured - expected).max(), expected.max()
        print(f"{name}: off by {off:.2g} of {largest:.2g}")
        assert largest > 0.1, name
        assert off <= 1e-3 * largest, name


@pytest.mark.evidence
@pytest.mark.full
def test_furnace_of_a_fitted_form(lean, tool):
    """Sampling agrees with evaluation: the reflected light is the albedo of the model, within the
    error that `brdfc fit` states for that view and the noise."""
    made = start(lean)
    scene = bpy.context.scene
    furnace.check(tool, scene, made, MATERIALS, COSINES, replicas=60, samples=256, slack=1e-3)


@pytest.mark.long
@pytest.mark.slow
def test_interpolated_normals_beyond_the_horizon(extension, use_pack):
    """At the rims of smooth meshes, interpolated normals turn away from the viewer. There, closures
    of opposite signs used to turn black at different angles, which caused pixels of -0.5 in a white
    world. Now the light is that of the lowest view of the fit."""
    materials = {
        "phong": {"e": 20.0},
        "max_phong": {"e": 50.0},
        "ashikhmin_shirley": {"nu": 20.0, "nv": 20.0},
        "ward": {"ax": 0.15, "ay": 0.15},
    }
    listed = {
        name: {"model": name, "parameters": values, "representation": "fitted"}
        for name, values in materials.items()
    }
    use_pack(listed)
    cosines = (2.1e-3, 1.9e-3, 1e-3, 1e-4, -1e-3, -0.1)
    seen = np.repeat(cosines, 40)
    turns = np.random.default_rng(5).uniform(0, 2 * math.pi, len(seen))
    for name, values in materials.items():
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = bpy.context.scene
        extension.scene_loader.apply_clean_settings(scene, max_bounces=0)
        made = extension.api.new_material(name, "fitted", **values)
        meter = Goniometer(scene, made, tilted(np.full(len(seen), 0.3), turns), 256)
        bend(meter.mesh, tilted(seen, turns))
        meter.add_world()
        picture = meter.measure()[:, 0].reshape(len(cosines), -1)
        means, errors = picture.mean(1), picture.std(1, ddof=1) / math.sqrt(picture.shape[1])
        noise = 5 * np.hypot(errors[1:], errors[0]).max()
        print(f"{name}: {means}, {picture.min()} to {picture.max()}, noise {noise}")
        assert means[0] > 0.005
        assert noise < 0.01, "too noisy to tell"
        assert np.abs(means[1:] - means[0]).max() < 5e-3 + noise, name
        assert picture.min() > 0, name


#: Positions along the (logarithmic) slider at which each fitted form of the extension is tested,
#: and the colours used there.
SHARES = {0.2: (1.0, 0.5, 0.1), 0.5: (0.3, 1.0, 0.7)}


def along_sliders(extension):
    """(model, number, values) of every fitted form of the extension, twice: the number and
    everything else that may vary."""
    cases = []
    for model, entry in extension.api.models().items():
        if "fitted" not in entry["representations"]:
            continue
        axis = entry["representations"]["fitted"]["axis"]
        only = extension.pack.model(model).forms["fitted"].only
        free = [p for p in entry["parameters"] if p["name"] not in {*only, axis["name"]}]
        for share, colour in SHARES.items():
            span = (axis["max"] + 1) / (axis["min"] + 1)
            values = {p["name"]: colour if p["kind"] == "color" else 1.0 for p in free}
            values[axis["name"]] = (axis["min"] + 1) * span**share - 1
            cases.append((model, axis["name"], values))
    assert len(cases) >= 2 * 8
    return cases


@pytest.mark.long
@pytest.mark.slow
def test_forms_of_the_extension_along_their_sliders(extension, tool):
    """One shader serves all values of its number and of the parameters in which f is a polynomial.
    They are set by sockets in two materials, and by an attribute in a third. Every pair is within
    1e-3 of the largest value of the tool's result."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=0)
    cases = along_sliders(extension)
    made = [extension.api.new_material(m, "fitted", **values) for m, _, values in cases]
    of_blinn = [case for case in cases if case[0] == "blinn"]
    of_blinn[1][2]["ks"] = of_blinn[0][2]["ks"]  # one material, in which only the number varies
    extension.api.set_parameters(made[cases.index(of_blinn[1])], ks=of_blinn[1][2]["ks"])
    varying = extension.api.new_material("blinn", "fitted", **of_blinn[0][2])
    attribute = varying.node_tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "shininess"
    (node,) = extension.model_nodes.group_nodes(varying)
    varying.node_tree.links.new(attribute.outputs["Fac"], extension.model_nodes.sockets(node)["e"])

    rng = np.random.default_rng(5)
    what = [case for case in cases for _ in range(FACETS)] + of_blinn * (FACETS // 2)
    which = np.minimum(np.arange(len(what)) // FACETS, len(cases))
    towards = unit((0.3, -0.2, 0.9))
    # Some near the highlight, some far from it.
    spread = np.where(np.arange(len(what)) % 2, 0.3, 0.03)[:, None]
    normals = unit(unit(towards + (0, 0, 1)) + spread * rng.normal(size=(len(what), 3)))
    values = np.array([given[name] for _, name, given in what])
    meter = Goniometer(
        scene, [*made, varying], normals, 4, which=which, attributes={"shininess": values}
    )
    wi, wo = meter.local(meter.add_sun(towards)), meter.wo()
    picture = meter.measure()
    for case in cases:
        model, name, given = case
        lit = np.array([w == case for w in what]) & (wi[:, 2] > 1e-4) & (wo[:, 2] > 1e-4)
        assert lit.sum() > FACETS * (1 if model == "blinn" else 0.6), "facets are in the dark"
        pairs = pairs_csv(wi[lit], wo[lit])
        text = tool("fit", model, *arguments(given), "--over", name, "--pairs", stdin=pairs)
        expected = read_csv(text)[1]
        off, largest = np.abs(picture[lit] - expected).max(), expected.max()
        print(f"{model} {name} = {given[name]:g}: off by {off:.2g} of {largest:.2g}")
        assert largest > 0.1, case
        assert off <= 1e-3 * largest, case


def test_a_number_beyond_its_slider_is_warned_of(extension, empty):
    material = extension.api.new_material("blinn", "fitted")
    (node,) = extension.model_nodes.group_nodes(material)
    end = extension.pack.model("blinn").forms["fitted"].entry["axis"]["max"]

    def codes(value):
        extension.model_nodes.set_value(node, "e", value)
        return [f.code for f in extension.checks.warnings(material, empty)]

    assert "out_of_fit" not in codes(end)
    assert "out_of_fit" in codes(1.5 * end)


def test_a_fit_has_defaults_but_for_its_number_and_factors(extension, empty):
    """Other values are refused with the reason, and nothing changes."""
    api, pack = extension.api, extension.pack
    only = pack.model("lafortune").forms["fitted"].only
    assert only == {"cxy": -1, "cz": 0.8}
    material = api.new_material("lafortune", "fitted", e=8.0, ks=(0.5, 0.25, 1.0))
    (node,) = extension.model_nodes.group_nodes(material)
    assert set(extension.model_nodes.sockets(node)) == {"e", "ks", "Normal", "Tangent"}
    values = api.get_parameters(material)
    assert {name: values[name] for name in only} == only
    with pytest.raises(ValueError, match="'fitted' only for cz=0.8, not for 0.5"):
        api.set_parameters(material, cz=0.5)
    with pytest.raises(ValueError, match="'fitted' only for below='mirror', not for 'lose'"):
        api.new_material("glossy_reflector", "fitted", below="lose")

    api.switch_representation(material, "sampled")
    for name, value in api.get_parameters(material).items():
        assert value == pytest.approx(values[name], rel=1e-6)
    api.switch_representation(material, "fitted")  # 0.8 is not exactly representable in a socket
    api.switch_representation(material, "sampled")
    api.set_parameters(material, cz=0.5)
    with pytest.raises(ValueError, match="only for cz=0.8, not for 0.5"):
        api.switch_representation(material, "fitted")
    assert extension.model_nodes.identity(node) == ("lafortune", "sampled")
    api.set_parameters(material, cz=0.8)
    value = material.node_tree.nodes.new("ShaderNodeValue")
    material.node_tree.links.new(value.outputs[0], extension.model_nodes.sockets(node)["cz"])
    with pytest.raises(ValueError, match="only for cz=0.8, not for a linked or animated value"):
        api.switch_representation(material, "fitted")
    assert extension.model_nodes.sockets(node)["cz"].is_linked


@pytest.fixture
def textured(extension, use_pack):
    """A material with a texture as its colour, in the fitted form of a pack made for it as by a
    user; and a white one of the same model."""
    api = extension.api
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    extension.scene_loader.apply_clean_settings(bpy.context.scene, max_bounces=0)
    made = [api.new_material("phong", "sampled", e=40.0, ks=1.0) for _ in range(2)]
    tree = made[0].node_tree
    image = bpy.data.images.new("texels", len(TEXELS), 1, float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.insert(TEXELS, 3, 1, axis=1).astype(np.float32).ravel())
    picture = tree.nodes.new("ShaderNodeTexImage")
    picture.image, picture.interpolation = image, "Closest"
    node = extension.model_nodes.group_nodes(made[0])[0]
    tree.links.new(picture.outputs["Color"], extension.model_nodes.sockets(node)["ks"])
    used = api.used_materials()
    assert [m["parameters"]["ks"] for m in used.values()] == [{"varies": True}, [1, 1, 1]]
    use_pack(used, "--error", "10")
    for material in made:
        api.switch_representation(material, "fitted")
        assert extension.model_nodes.identity(extension.model_nodes.group_nodes(material)[0]) == (
            "phong",
            "fitted",
        )
    assert extension.model_nodes.sockets(extension.model_nodes.group_nodes(made[0])[0])[
        "ks"
    ].is_linked
    return made


def show(meter, texels):
    """Makes every point of a facet show one texel of the picture."""
    u = np.repeat((texels + 0.5) / len(TEXELS), 4)
    uv = np.stack([u, np.full_like(u, 0.5)], -1).astype(np.float32)
    meter.mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", uv.ravel())


@pytest.mark.long
def test_a_textured_colour_under_a_sun(textured, tool):
    """The tool's result for a white material, times the texel, to 1e-3 of its largest value."""
    rng = np.random.default_rng(6)
    count = len(TEXELS) * FACETS
    half = unit(unit(SUNS[1]) + (0, 0, 1))
    normals = unit(half + 0.2 * rng.normal(size=(count, 3)))
    meter = Goniometer(bpy.context.scene, textured[0], normals, samples=4)
    texels = np.arange(count) % len(TEXELS)
    show(meter, texels)
    wi = meter.local(meter.add_sun(unit(SUNS[1])))
    wo, measured = meter.wo(), meter.measure()
    pairs = pairs_csv(wi, wo)
    white = read_csv(tool("fit", "phong", "e=40", "ks=1", "--pairs", stdin=pairs))[1]
    expected = white * TEXELS[texels]
    off, largest = np.abs(measured - expected).max(), expected.max()
    print(f"off by {off:.2g} of {largest:.2g}")
    assert largest > 0.1
    assert off <= 1e-3 * largest
    # A single colour for all texels would differ much more.
    assert np.abs(white * TEXELS.mean(0) - expected).max() > 0.1 * largest


@pytest.mark.long
def test_a_textured_colour_in_a_white_world(textured):
    """Sampled light has the texel's colour: the mean radiance of a white material times the texel,
    within 5 standard errors. With 12 comparisons and a fixed seed, that is one false alarm in about
    a hundred thousand seeds."""
    replicas = 144
    bpy.context.scene.cycles.seed = 5
    texels = np.tile(np.arange(len(TEXELS)), 2 * replicas)
    which = np.repeat((0, 1), len(TEXELS) * replicas)
    turns = np.random.default_rng(7).uniform(0, 2 * math.pi, len(texels))
    normals = tilted(np.full(len(texels), TEXTURED_COSINE), turns)
    meter = Goniometer(bpy.context.scene, textured, normals, samples=256, which=which)
    show(meter, texels)
    meter.add_world()
    measured = meter.measure()
    white = measured[which == 1]
    for texel, colour in enumerate(TEXELS):
        seen = measured[(which == 0) & (texels == texel)]
        spread = [seen.std(0, ddof=1) / math.sqrt(len(seen))]
        spread.append(colour * white.std(0, ddof=1) / math.sqrt(len(white)))
        error = np.hypot(np.hypot(*spread), 1e-5)
        difference = seen.mean(0) - colour * white.mean(0)
        print(f"texel {texel}: {seen.mean(0)}, off by {difference} +- {error}")
        assert (error < 0.02 * white.mean(0)).all(), "too noisy to tell"
        assert (np.abs(difference) < 5 * error).all()
