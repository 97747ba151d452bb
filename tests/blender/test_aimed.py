# SPDX-License-Identifier: GPL-3.0-or-later
"""Aimed forms under lamps: they must match the model there, and know only the lamps in the
slots."""

import itertools
import math

import bpy
import numpy as np
import pytest
import worlds
from goniometer import Goniometer, tilted, unit
from helpers import (
    add_camera,
    add_lamp,
    add_sphere,
    add_world,
    compiled_once,
    constant,
    evaluate,
    render,
)
from mathutils import Vector

#: Directions towards the sun; the camera is above.
SLOW = pytest.mark.slow
SUNS = [
    (0.5, 0.2, 0.8),
    pytest.param((-0.7, 0.6, 0.15), marks=SLOW),
    pytest.param((0.0, 0.1, 1.0), marks=SLOW),
]
FACETS = 150
#: Default values, and extreme ones.
CASES = {
    "ashikhmin_shirley": [{"nu": 100.0, "nv": 1e4, "rs": 0.9, "rd": 0.0}],
    "blinn": [{"e": 2000.0}],
    "cook_torrance": [{"m": 0.03}],
    "glossy_reflector": [{"e": 10.0}],
    "lafortune": [{"cxy": -1.0, "cz": 0.95, "e": 30.0}],
    "max_phong": [{"e": 5.0}],
    "phong": [{"e": 5000.0}, {"e": 3.0}],
    "radziszewski_alda": [{"n": 50.0}],
    "schlick": [{"rough": 0.01, "p": 0.5}],
    "ward": [{"ax": 0.02, "ay": 0.3}],
}


def random_values(schema, rng):
    """Random values over the sliders of numbers and colours; choices keep their defaults."""
    values = {}
    for p in schema:
        low, high = p.get("soft_min", 0), p.get("soft_max", 1)
        if p["kind"] == "number":
            wide = high - low > 50
            values[p["name"]] = (
                low + math.expm1(rng.uniform() * math.log1p(high - low))
                if wide
                else rng.uniform(low, high)
            )
        elif p["kind"] == "color":
            values[p["name"]] = tuple(rng.uniform(0, 1, 3))
    return values


def cases_of(extension, form, few_of):
    """[(model, values)]: the defaults, extreme values and random ones, which do not depend on what
    other models there are. script/test uses one case per model besides the defaults."""
    found = []
    for name, model in extension.api.models().items():
        if form not in model["representations"] or not model["scatter"]:
            continue
        drawn = random_values(model["parameters"], np.random.default_rng(list(name.encode())))
        # Not every combination of heights is valid; most lobes with random axes are black.
        if name in ("lossless", "lafortune"):
            drawn = {}
        others = few_of([*CASES.get(name, []), drawn], 1)
        found += [(name, values) for values in ({}, *others)]
        if form == "nodes":  # its trees contain all choices
            found += [(name, values) for values in few_of(other_choices(extension, name, form), 2)]
    return found


def other_choices(extension, name, form):
    """All combinations of a form's choices except the first, which has the defaults."""
    options = extension.pack.model(name).forms[form].choices
    combinations = itertools.product(*options.values())
    return [dict(zip(options, chosen, strict=True)) for chosen in combinations][1:]


def off_under_a_sun(extension, scene, tool, form, towards, samples, few_of, pictures=1, least=1e-6):
    """Renders a form under a sun without an angle and compares it with the formula.

    Returns [(model, values, relative L1, its noise, largest f cos)]: the error of the mean of
    several pictures, and the error that their variance explains (0 for one picture). `least`: the
    light of a facet below which errors count as parts of that. `scene` is in the state of
    apply_clean_settings()."""
    rng = np.random.default_rng(17)
    cases = cases_of(extension, form, few_of)
    which = np.repeat(np.arange(len(cases)), FACETS)
    normals = tilted(rng.uniform(0.05, 1, len(which)), rng.uniform(0, 2 * math.pi, len(which)))
    # On every other facet, the normal is near the half vector of sun and camera: the highlight.
    half = unit(unit(towards) + (0, 0, 1))
    near = unit(half + 0.1 * rng.normal(size=(len(which), 3)))
    normals = np.where((np.arange(len(which)) % 2 == 0)[:, None], near, normals)
    made = [extension.api.new_material(name, form, **values) for name, values in cases]
    meter = Goniometer(scene, made, normals, samples=samples, which=which)
    wi = meter.local(meter.add_sun(unit(towards)))
    (lamp,) = extension.api.see_lamps(scene)
    assert lamp.slot == 1
    wo, seen = meter.wo(), []
    with compiled_once(scene):
        for scene.cycles.seed in range(pictures):
            seen.append(meter.measure())
    picture = np.mean(seen, 0)
    spread = np.std(seen, 0, ddof=1) / math.sqrt(pictures) if pictures > 1 else 0 * picture
    found = []
    for i, (name, values) in enumerate(cases):
        lit = (which == i) & (wi[:, 2] > 1e-3)
        expected = evaluate(tool, name, values, wi[lit], wo[lit]) * wi[lit, 2:]
        # About once in 1e5 samples, light sampling hits the sampled direction's own lobe, which is
        # much brighter: such dots are noise. One facet in thirty may have one.
        error = np.abs(picture[lit] - expected).sum(1)
        kept = np.argsort(error)[: -(len(error) // 30)]
        by = max(expected.sum(), least * len(expected))
        off, noise = (x[kept].sum() / by for x in (error, spread[lit].sum(1)))
        print(f"{name} {values}: {off:.2g}, noise {noise:.2g}")
        found.append((name, values, off, noise, expected.max()))
    return found


@pytest.mark.long
@pytest.mark.sample(1)
@pytest.mark.parametrize("towards", SUNS, ids=str)
def test_a_sun_without_an_angle(extension, empty, tool, few_of, towards):
    """No random ray hits it, so the picture shows the base and the lamps' lobes: f cos to 1e-3
    (relative L1)."""
    extension.scene_loader.apply_clean_settings(empty, max_bounces=0)
    extension.api.enable_osl(empty)
    for name, values, off, _, brightest in off_under_a_sun(
        extension, empty, tool, "aimed", towards, 16, few_of
    ):
        assert brightest > 1e-4, name
        # A cosine in single precision and OSL's pow() have an error of about 5e-7 times the
        # exponent: 0.7 % at e = 12,000.
        exponent = max([0, *(v for k, v in values.items() if k in ("e", "es"))])
        assert off < max(1e-3, 8e-7 * exponent), f"{name} {values}: relative L1 {off:.3g}"


@pytest.mark.long
@pytest.mark.slow
def test_a_lamp_that_is_not_in_the_list(extension, empty, tool):
    """It costs noise but no light: with and without slots, the picture has the same mean."""
    means = []
    for seen in (True, False):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = bpy.context.scene
        extension.scene_loader.apply_clean_settings(scene, max_bounces=0)
        extension.api.enable_osl(scene)
        made = extension.api.new_material("ashikhmin_shirley", "aimed", nu=20.0, nv=20.0)
        normals = tilted(np.full(900, 0.8), np.random.default_rng(1).uniform(0, 6.28, 900))
        meter = Goniometer(scene, made, normals, samples=256 if seen else 2048, perspective=True)
        data = bpy.data.lights.new("Disk", "AREA")
        data.shape, data.size, data.energy = "DISK", 60.0, 1e6
        disk = bpy.data.objects.new("Disk", data)
        disk.location = (0, 0, 80)
        scene.collection.objects.link(disk)
        bpy.context.view_layer.update()
        if seen:
            extension.api.see_lamps(scene)
        picture = meter.measure()[:, 1]
        means.append((picture.mean(), picture.std(ddof=1) / math.sqrt(len(picture))))
    (aimed, error), (drawn, other) = means
    print(means)
    assert abs(aimed - drawn) < 4.5 * math.hypot(error, other) + 1e-3 * drawn
    assert error < 0.01 * aimed


#: Lamps whose visible part varies over a ball: an area lamp with a narrow spread, and a spot whose
#: cone is hardly wider than its disk appears.
CONES = {
    "spread": ("AREA", {"shape": "SQUARE", "size": 2.0, "spread": 0.7}),
    "spot": ("SPOT", {"shadow_soft_size": 0.8, "spot_size": 0.5, "spot_blend": 0.5}),
}


@pytest.mark.long
@pytest.mark.sample(1)
@pytest.mark.slow
@pytest.mark.parametrize("lamp", CONES)
def test_a_lamp_that_shines_within_a_cone(extension, empty, lamp):
    """f is averaged over the visible part of the lamp, to 2 %; averaged over the whole lamp, a ball
    would be 5 % too dark."""
    kind, settings = CONES[lamp]
    towards = unit((0.5, -0.62, 0.6))
    turn = Vector(-towards).to_track_quat("-Z", "Y").to_euler()
    add_lamp(empty, kind, location=5 * towards, turn=turn, energy=1000.0, **settings)
    extension.scene_loader.apply_clean_settings(empty, max_bounces=0)
    extension.api.enable_osl(empty)
    add_camera(empty)
    empty.render.resolution_x = empty.render.resolution_y = 40
    made = {f: extension.api.new_material("phong", f) for f in ("aimed", "sampled")}
    ball = add_sphere(empty, made["aimed"])
    means = {}
    for form, samples in (("aimed", 512), ("sampled", 4096)):
        ball.data.materials[0] = made[form]
        bpy.context.view_layer.update()
        extension.api.see_lamps(empty)
        empty.cycles.samples = samples
        pictures = []
        with compiled_once(empty):
            for empty.cycles.seed in range(4):
                pictures.append(render(empty)[..., 1].mean())
        means[form] = np.mean(pictures), np.std(pictures, ddof=1) / 2
    (aimed, error), (drawn, other) = means["aimed"], means["sampled"]
    print(f"{lamp}: {aimed / drawn - 1:+.4f} +- {math.hypot(error, other) / drawn:.4f}")
    assert abs(aimed - drawn) < 4.5 * math.hypot(error, other) + 0.02 * drawn
    assert math.hypot(error, other) < 0.008 * drawn


def sheet_and_cube(scene, material):
    """A sheet, and a cube with its top at the same height, side by side."""
    bpy.ops.mesh.primitive_plane_add(size=1, location=(-1, 0, 0))
    bpy.context.object.data.materials.append(material)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(1, 0, -0.5))
    bpy.context.object.data.materials.append(material)
    add_camera(scene, (0, -4, 4), (math.pi / 4, 0, 0), orthographic=3)


@pytest.mark.slow
@pytest.mark.many
@pytest.mark.parametrize("kind", ["SUN", "POINT", "AREA"])
def test_a_lamp_partly_below_the_horizon(extension, empty, kind):
    """Light from below passes through a sheet in Blender 4.5, and not through a solid object. Both
    are equally bright all the same."""
    sheet_and_cube(empty, extension.api.new_material("radziszewski_alda", "aimed", n=1.0))
    if kind == "SUN":
        add_lamp(empty, kind, turn=(math.pi / 2 - 0.04, 0, 0), energy=3, angle=0.4)
    elif kind == "POINT":
        add_lamp(empty, kind, location=(0, -6, 0.3), energy=1000, shadow_soft_size=1.5)
    else:
        add_lamp(
            empty, kind, location=(0, -6, 0.3), turn=(math.pi / 2, 0, 0), energy=1000,
            shape="RECTANGLE", size=4, size_y=2,
        )  # fmt: skip
    extension.scene_loader.apply_clean_settings(empty, samples=2048, max_bounces=0)
    empty.render.film_transparent = True
    empty.render.resolution_x, empty.render.resolution_y = 30, 10
    bpy.context.view_layer.update()
    extension.api.see_lamps(empty)
    picture = render(empty)
    # 10 pixels are one unit; the camera sees tops foreshortened by cos 45 degrees.
    sheet, cube = (picture[3:7, x - 3 : x + 3, 1].mean() for x in (5, 25))
    print(f"{kind}: sheet {sheet:.5f}, cube {cube:.5f}")
    assert sheet > 1e-3
    assert cube == pytest.approx(sheet, rel=0.03)


@pytest.mark.long
@pytest.mark.slow
def test_a_small_lamp_before_a_large_one(extension, empty):
    """The lobe of the large lamp includes the small one's direction. BSDF sampling would subtract
    that light, but hardly ever hits the small lamp. So the small lamp has a later slot and its lobe
    is reduced. The picture with both must be the sum of the pictures with each; in the opposite
    order, a ball would be 62 % too bright."""
    towards = unit((0.5, -0.62, 0.6))
    turn = Vector(-towards).to_track_quat("-Z", "Y").to_euler()
    large = add_lamp(
        empty, "AREA", location=5 * towards, turn=turn, energy=300.0, shape="DISK", size=2.5
    )
    place = 4.5 * towards + np.array((0.1, 0.2, 0.0))
    small = add_lamp(empty, "POINT", location=place, energy=1500.0, shadow_soft_size=0.03)
    extension.scene_loader.apply_clean_settings(empty, max_bounces=0)
    extension.api.enable_osl(empty)
    add_camera(empty)
    empty.render.resolution_x = empty.render.resolution_y = 40
    empty.cycles.samples = 512
    add_sphere(empty, extension.api.new_material("radziszewski_alda", "aimed", n=1.0))
    light = {}
    for shown in ("large", "small", "both"):
        large.hide_render, small.hide_render = shown == "small", shown == "large"
        bpy.context.view_layer.update()
        seen = extension.api.see_lamps(empty)
        pictures = []
        with compiled_once(empty):
            for empty.cycles.seed in range(4):
                pictures.append(render(empty)[..., 1].mean())
        light[shown] = np.mean(pictures), np.std(pictures, ddof=1) / 2
    assert [(lamp.name, lamp.slot) for lamp in seen] == [(small.name, 2), (large.name, 1)]
    alone = light["large"][0] + light["small"][0]
    error = np.linalg.norm([e for _, e in light.values()])
    print(f"{light['both'][0] / alone - 1:+.4f} +- {error / alone:.4f}")
    assert abs(light["both"][0] - alone) < 4.5 * error + 0.002 * alone
    assert error < 0.02 * alone


@pytest.mark.long
@pytest.mark.sample(1)
@pytest.mark.slow
@pytest.mark.parametrize("model", ["phong", "max_phong", "glossy_reflector"])
def test_a_link_takes_the_base_away_and_no_light(extension, empty, model):
    """The exponent varies from 1 to 600 over a ball, so the base of cones is present on a part of
    it only. Each quarter must be as bright as with sampled directions."""
    worlds.gradient(*add_world(empty))
    extension.scene_loader.apply_clean_settings(empty, max_bounces=0)
    extension.api.enable_osl(empty)
    add_camera(empty)
    empty.render.resolution_x = empty.render.resolution_y = 32
    empty.cycles.samples = 1024
    ball = add_sphere(empty, None)
    quarters = {}
    for form in ("aimed", "sampled"):
        material = extension.api.new_material(model, form)
        (node,) = extension.model_nodes.group_nodes(material)
        links = material.node_tree
        place = links.nodes.new("ShaderNodeTexCoord")
        apart = links.nodes.new("ShaderNodeSeparateXYZ")
        power = links.nodes.new("ShaderNodeMath")
        power.operation = "POWER"
        power.inputs[0].default_value = 600.0
        links.links.new(place.outputs["Generated"], apart.inputs[0])
        links.links.new(apart.outputs[0], power.inputs[1])
        links.links.new(power.outputs[0], extension.model_nodes.sockets(node)["e"])
        ball.data.materials[0] = material
        bpy.context.view_layer.update()
        pictures = []
        with compiled_once(empty):
            for empty.cycles.seed in range(4):
                # The ball covers the central half.
                pictures.append(render(empty)[:, 8:24, 1].reshape(32, 4, 4).mean((0, 2)))
        quarters[form] = np.mean(pictures, 0), np.std(pictures, 0, ddof=1) / 2
    (aimed, error), (drawn, other) = quarters["aimed"], quarters["sampled"]
    print(f"{model}: {aimed / drawn - 1} +- {np.hypot(error, other) / drawn}")
    assert (drawn > 1e-4).all() and (error < 0.05 * drawn).all()
    # The variance of four pictures: a t distribution with three degrees of freedom.
    assert (np.abs(aimed - drawn) < 9 * np.hypot(error, other)).all()
    whole, bound = aimed.sum() - drawn.sum(), 4.5 * math.hypot(*error, *other)
    assert abs(whole) < bound < 0.05 * drawn.sum()


#: Sockets whose models break outside their ranges, and a value beyond either end.
BEYOND = [
    ("cook_torrance", "m", -1.0),
    ("cook_torrance", "m", 50.0),
    ("ward", "ax", 50.0),
    ("phong", "e", -3.0),
    ("oren_nayar", "sigma", 100.0),
    ("kelemen", "f0", (-2.0, -0.1, 3.0)),
    ("disney", "base_color", (-2.0, -0.1, -0.1)),
]


@pytest.mark.long
@pytest.mark.parametrize(("model", "name", "value"), BEYOND)
def test_a_link_beyond_the_range_is_its_end(extension, empty, model, name, value):
    """Sliders stop at the ends of a parameter's range, but links do not: a texture may be black."""
    (schema,) = [p for p in extension.api.models()[model]["parameters"] if p["name"] == name]
    extension.scene_loader.apply_clean_settings(empty, max_bounces=0)
    extension.api.enable_osl(empty)
    end = np.clip(value, schema["min"], schema["max"]).tolist()
    made = [extension.api.new_material(model, "aimed", **{name: end}) for _ in range(2)]
    tree = made[1].node_tree
    (node,) = extension.model_nodes.group_nodes(made[1])
    tree.links.new(constant(tree, value), extension.model_nodes.sockets(node)[name])
    pictures = []
    for material in made:
        # Around the half vector of sun and camera.
        towards = unit((0.3, 0.0, 0.9))
        slopes = 0.3 * np.random.default_rng(2).normal(size=(100, 3)) * (1, 1, 0)
        slopes[::2, 0] = 0
        meter = Goniometer(empty, material, unit(unit(towards + (0, 0, 1)) + slopes), samples=16)
        meter.add_sun(towards)
        extension.api.see_lamps(empty)
        pictures.append(meter.measure())
        for item in list(empty.objects):
            bpy.data.objects.remove(item)
    assert np.isfinite(pictures[0]).all() and pictures[0].max() > 0
    np.testing.assert_allclose(pictures[1], pictures[0], rtol=1e-5, atol=1e-6)
