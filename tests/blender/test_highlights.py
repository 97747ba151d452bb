# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests highlights of aimed forms under lamps of every kind, block by block: the mean of a picture
can be right even if one half of a highlight is too bright and the other too dark.

Floors, or balls, of three models and of Blender's own Diffuse node are compared with quadrature of
the models over the lamp (highlights.py), which does not depend on closures or lists of lamps. The
Diffuse node shows that the lamp itself is computed correctly.
"""

import math
from statistics import NormalDist

import bpy
import highlights
import numpy as np
import pytest
from goniometer import unit
from helpers import add_lamp, add_sphere, add_world, node_material, render
from mathutils import Matrix, Vector

#: A wide base and almost no rest; a narrow lobe without a base; and cones.
CASES = [("cook_torrance", {"m": 0.3}), ("radziszewski_alda", {"n": 12.0}), ("phong", {})]
#: Blocks with at least this fraction of the brightest block's light count as the highlight, up to
#: this number of blocks.
LEAST, MOST = 0.2, 6
#: Error allowed for the form itself, which averages f and the lamp separately.
OFF = 0.02
#: A correct picture fails one test in ten thousand. The number of samples is too small if most
#: blocks could be wrong by more than POWER without failing.
LEVEL, POWER = 1e-4, 0.25
SAMPLES, SEEDS = 96, 2
#: Number of blocks across an item's part of the picture.
PART = highlights.SIDE // highlights.BLOCK
#: Direction from the floor to a lamp.
TOWARDS = unit((0.1, 0.7, 0.6))


def turned(towards):
    """Euler angles of a lamp that shines from this direction."""
    return Vector(-np.array(towards)).to_track_quat("-Z", "Y").to_euler()


def lit(scene, kind, at=3.0 * TOWARDS, towards=TOWARDS, **settings):
    settings = {"energy": 5.0 if kind == "SUN" else 1000.0, **settings}
    return add_lamp(scene, kind, location=at, turn=turned(towards), **settings)


def one(kind, **settings):
    """A stage with one lamp."""
    return lambda scene: [lit(scene, kind, **settings)]


def two(first, second):
    """Two lamps, one in front of the other as seen from the floor."""

    def add(scene):
        near = lit(scene, first[0], at=2.6 * TOWARDS + (0.1, 0, 0), **first[1])
        return [near, lit(scene, second[0], at=3.4 * TOWARDS, **second[1])]

    return add


def scaled(kind, mirrored=False, **settings):
    """A lamp under a parent that rotates, scales and mirrors it."""

    def add(scene):
        item = lit(scene, kind, **settings)
        item.scale = (1.3, 0.8, 1.0) if kind == "AREA" else (1, 1, 1)
        bpy.context.view_layer.update()
        wanted = item.matrix_world.copy()
        parent = bpy.data.objects.new("Parent", None)
        scene.collection.objects.link(parent)
        parent.location, parent.rotation_euler = (1, 2, 3), (0.4, 1.1, -0.3)
        parent.scale = (-1.7, -1.7, -1.7) if mirrored else (1.7, 1.7, 1.7)
        bpy.context.view_layer.update()
        item.parent = parent
        if mirrored:
            wanted = wanted @ Matrix.Diagonal((-1, 1, 1, 1))
        item.matrix_world = wanted
        return [item]

    return add


def instance(scene):
    """A lamp without a size in a collection that only an instance shows, and that viewports
    hide."""
    collection = bpy.data.collections.new("Lamps")
    item = lit(scene, "POINT", shadow_soft_size=0.0)
    bpy.context.view_layer.update()
    send = highlights.of_light(item)
    scene.collection.objects.unlink(item)
    collection.objects.link(item)
    shown = bpy.data.objects.new("Instance", None)
    shown.instance_type, shown.instance_collection = "COLLECTION", collection
    shown.location = item.location
    item.location = (0, 0, 0)
    shown.hide_viewport = True
    scene.collection.objects.link(shown)
    return [send]


def hidden(scene):
    """A lamp hidden in viewports and moved after it was hidden."""
    item = lit(scene, "SPOT", at=(0, 0, 9), shadow_soft_size=0.0, spot_size=2.0)
    bpy.context.view_layer.update()
    item.hide_viewport = True
    bpy.context.view_layer.update()
    item.location = 3.0 * TOWARDS
    # Blender does not update the matrix of hidden objects.
    item.matrix_world = Matrix.LocRotScale(item.location, item.rotation_euler, None)
    return [item]


def settings_that_change_nothing(scene):
    """Also adds a wider and brighter lamp around the first, linked to another object only."""
    item = lit(scene, "POINT", shadow_soft_size=0.4)
    item.data.cycles.max_bounces = 0
    item.data.cycles.is_caustics_light = True
    item.visible_camera = item.visible_transmission = item.visible_volume_scatter = False
    scene.view_layers[0].lightgroups.add().name = "Group"
    item.lightgroup = "Group"
    portal = lit(scene, "AREA", at=2.0 * TOWARDS, shape="SQUARE", size=2.0)
    portal.data.cycles.is_portal = True
    add_world(scene, strength=0.0)  # without a world, Blender 5.2 crashes if there is a portal
    other = lit(scene, "POINT", at=3.3 * TOWARDS, energy=5000.0, shadow_soft_size=0.6)
    receivers = bpy.data.collections.new("Receivers")
    receivers.objects.link(bpy.data.objects.new("Nothing", bpy.data.meshes.new("Nothing")))
    other.light_linking.receiver_collection = receivers
    return [item]


def sheet(scene):
    """A flat mesh that lights nothing behind it."""
    mesh = bpy.data.meshes.new("Sheet")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(node_material("ShaderNodeEmission", Strength=50.0))
    item = bpy.data.objects.new("Sheet", mesh)
    item.matrix_world = Matrix.LocRotScale(3.0 * Vector(TOWARDS), turned(TOWARDS), (0.7, 0.4, 1))
    scene.collection.objects.link(item)
    return [highlights.patch(item.matrix_world, (2, 2), 50.0 * 1.4 * 0.8)]


def ball_of_light(scene):
    item = add_sphere(scene, node_material("ShaderNodeEmission", Strength=50.0), segments=128)
    item.location, item.scale = 3.0 * TOWARDS, (0.4, 0.4, 0.4)
    return [highlights.sphere(np.array(item.location), 0.4, 50.0 * math.pi * 0.4**2)]


def bright_spot(scene):
    """An environment image with a soft-edged disk of light."""
    inner, outer, radiance, width = 0.16, 0.2, 30.0, 1024

    def shade(away):
        return radiance * np.clip((outer - away) / (outer - inner), 0, 1)

    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(width // 2) + 0.5) * 2 / width)
    phi, theta = (0.5 - u) * 2 * np.pi, (v - 0.5) * np.pi
    to = [np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)]
    pixels = np.ones((width // 2, width, 4), np.float32)
    away = np.arccos(np.clip(np.stack(to, -1) @ TOWARDS, -1, 1))
    pixels[..., :3] = shade(away)[..., None]
    image = bpy.data.images.new("Sky", width, width // 2, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    tree, background = add_world(scene)
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    tree.links.new(node.outputs["Color"], background.inputs["Color"])
    a, b = highlights.across(TOWARDS)

    def send(p, u):
        at = outer * highlights.disk(u)
        away = np.linalg.norm(at, axis=-1)
        part = np.sinc(away / np.pi)  # sine over angle
        wi = part[..., None] * (at[..., :1] * a + at[..., 1:] * b)
        wi = wi + np.cos(away)[..., None] * TOWARDS
        return wi, shade(away) * part * math.pi * outer**2

    return [send]


def without_importance(scene):
    """A wide lamp that BSDF sampling does not hit."""
    item = lit(scene, "AREA", shape="SQUARE", size=1.5)
    item.data.cycles.use_multiple_importance_sampling = False
    return [item]


def without_shadows(scene):
    """A lamp without shadows: only light sampling shows it behind objects."""
    (item,) = without_importance(scene)
    item.data.use_shadow = False
    mesh = bpy.data.meshes.new("Wall")
    mesh.from_pydata([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(node_material("ShaderNodeBsdfDiffuse"))
    wall = bpy.data.objects.new("Wall", mesh)
    wall.matrix_world = Matrix.LocRotScale(2.5 * Vector(TOWARDS), turned(TOWARDS), None)
    wall.visible_camera = False
    scene.collection.objects.link(wall)
    return [item]


def copied_sheet(scene):
    """A sheet that an object instances."""
    sends = sheet(scene)
    (item,) = (o for o in scene.collection.objects if o.name.startswith("Sheet"))
    collection = bpy.data.collections.new("Sheets")
    scene.collection.objects.unlink(item)
    collection.objects.link(item)
    shown = bpy.data.objects.new("Copy", None)
    shown.instance_type, shown.instance_collection = "COLLECTION", collection
    scene.collection.objects.link(shown)
    return sends


#: Exponent of the cosine in the IES file; angles are measured from straight down.
IES_POWER = 4
#: First version in which Cycles evaluates such a file at all azimuths.
EVEN_IES = (5, 0, 0)
#: W/sr of a lamp of 1 W for each candela in such a file; the factor is from Cycles' util/ies.cpp.
PER_CANDELA = 0.0706650768394 / (4 * math.pi)


def ies_text(candela):
    """A file of photometric type C, symmetric about its axis, with candela(angle in radians)."""
    angles = np.arange(0, 181, 2.5)
    values = [max(candela(math.radians(a)), 0.0) for a in angles]
    rows = [
        "IESNA:LM-63-2002",
        "TILT=NONE",
        f"1 -1 1 {len(angles)} 1 1 2 0 0 0",
        "1 1 0",
        " ".join(f"{a:g}" for a in angles),
        "0",
        " ".join(f"{v:.7g}" for v in values),
    ]
    return "\n".join(rows) + "\n"


def photometric(candela, radius=0.0):
    """A lamp with an IES file."""

    def add(scene):
        item = lit(scene, "POINT", energy=50.0, shadow_soft_size=radius)
        item.data.use_nodes = True
        tree = item.data.node_tree
        (emission,) = (n for n in tree.nodes if n.bl_idname == "ShaderNodeEmission")
        node = tree.nodes.new("ShaderNodeTexIES")
        node.mode, node.ies = "INTERNAL", bpy.data.texts.new("lamp.ies")
        node.ies.write(ies_text(candela))
        tree.links.new(node.outputs["Fac"], emission.inputs["Strength"])
        bpy.context.view_layer.update()
        to_lamp = np.array(item.matrix_world.to_3x3().inverted())

        def beam(wi):
            x, y, z = np.moveaxis(-wi @ to_lamp.T, -1, 0)
            seen = np.vectorize(candela)(np.arccos(np.clip(-z, -1, 1)))
            if bpy.app.version >= EVEN_IES:
                return seen
            # If a file has no azimuths, Cycles treats the range below 0 and above 360 degrees as
            # dark, and interpolates with cubics (docs/cycles.md).
            turn = np.arctan2(x, y) / (2 * np.pi) + 0.5
            return seen * (1 + turn * (1 - turn) / 2)

        place = np.array(item.matrix_world.translation)
        intensity = item.data.energy * PER_CANDELA
        return [highlights.facing_disk(place, radius or 1e-6, intensity, beam)]

    return add


def of_one_candela(angle):
    return 100.0


def of_cosines(angle):
    return 200.0 * max(math.cos(angle), 0.0) ** IES_POWER


KINDS = {
    "point": one("POINT", shadow_soft_size=0.4),
    "square": one("AREA", shape="SQUARE", size=1.0),
    "sun": one("SUN", angle=0.2),
}
SLOW_KINDS = {
    "point without a size": one("POINT", shadow_soft_size=0.0),
    "spot": one("SPOT", shadow_soft_size=0.3, spot_size=2.6, spot_blend=0.8),
    "disk with spread": one("AREA", shape="DISK", size=1.2, spread=1.8),
    "sheet": sheet,
    "ball of light": ball_of_light,
    "bright spot of an image": bright_spot,
    "a small one before a large one": two(
        ("POINT", {"shadow_soft_size": 0.03}), ("AREA", {"shape": "SQUARE", "size": 1.5})
    ),
    "instance": instance,
    "without multiple importance": without_importance,
    "without shadows": without_shadows,
    "copy of a sheet": copied_sheet,
    "IES file of one intensity": photometric(of_one_candela),
    "IES file of cosines": photometric(of_cosines),
}
EVIDENCE_KINDS = {
    "point without soft falloff": one("POINT", shadow_soft_size=0.5, use_soft_falloff=False),
    "wide sun": one("SUN", angle=0.5, normalize=False),
    "rectangle": one("AREA", shape="RECTANGLE", size=0.8, size_y=1.2, normalize=False),
    "scaled ellipse": scaled("AREA", shape="ELLIPSE", size=0.8, size_y=1.2),
    "mirrored rectangle": scaled(
        "AREA", mirrored=True, shape="RECTANGLE", size=0.8, size_y=1.2, spread=2.0
    ),
    "scaled spot": scaled("SPOT", shadow_soft_size=0.3, spot_size=2.6, normalize=False),
    "two suns": two(("SUN", {"angle": 0.1}), ("SUN", {"angle": 0.3})),
    "near point": one("POINT", at=(0.1, 0.9, 0.9), energy=50.0, shadow_soft_size=0.2),
    "hidden": hidden,
    "settings that change nothing": settings_that_change_nothing,
    "edge of a spot": one("SPOT", shadow_soft_size=0.3, spot_size=1.3, spot_blend=0.15),
    "half below the horizon": one("SUN", towards=(0.05, 1.0, 0.02), angle=0.4),
}
#: Three models with little noise under these lamps.
WIDE_CASES = [("cook_torrance", {"m": 0.3}), ("radziszewski_alda", {"n": 1.0}), ("phong", {})]
#: Lamps without a size, whose pictures have almost no noise.
SHARP = {
    *("point without a size", "instance", "hidden"),
    *("IES file of one intensity", "IES file of cosines"),
}
#: Allowed error where a boundary of the light crosses the lamp.
BOUNDED = {"half below the horizon": 0.04}
#: Allowed error where a form has nothing to average.
BOUNDED |= {"IES file of one intensity": 0.005, "IES file of cosines": 0.005}
FULL = pytest.mark.full
WITH_MARKS = [
    *KINDS,
    *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW_KINDS),
    *(
        # Versions differ for lamps below the horizon.
        pytest.param(name, marks=[pytest.mark.evidence, *([] if "horizon" in name else [FULL])])
        for name in EVIDENCE_KINDS
    ),
]
ALL_KINDS = KINDS | SLOW_KINDS | EVIDENCE_KINDS


def measured(scene, stage, samples):
    """Means by block and their variances."""
    scene.cycles.samples = 2 * samples
    # The first sample of a pixel is the same in all pictures (docs/cycles.md).
    scene.cycles.use_sample_subset = True
    scene.cycles.sample_offset, scene.cycles.sample_subset_length = samples, samples
    scene.render.use_persistent_data = True  # compiles shaders once
    pictures = []
    for seed in range(SEEDS):
        scene.cycles.seed = seed
        pictures.append(render(scene)[..., 1])
    mask = stage.whole() >= 0
    means, counts = highlights.blocks(np.mean(pictures, 0), mask)
    variances, _ = highlights.blocks(np.var(pictures, 0, ddof=1), mask)
    return means, variances / counts / SEEDS


def hold(extension, tool, scene, stage, lamps, form="aimed", samples=SAMPLES, off=OFF):
    """Checks that each block in each item's highlight has the expected light."""
    extension.scene_loader.apply_clean_settings(scene, max_bounces=0)
    extension.api.enable_osl(scene)
    made = [extension.api.new_material(model, form, **values) for model, values in stage.cases[1:]]
    stage.set_materials([node_material("ShaderNodeBsdfDiffuse", Color=(1, 1, 1, 1)), *made])
    bpy.context.view_layer.update()
    sends = [lamp if callable(lamp) else highlights.of_light(lamp) for lamp in lamps]
    found, variance = measured(scene, stage, samples)
    halves = [stage.expected(tool, sends, LEAST, MOST, seed) for seed in range(2)]
    wanted = np.mean(halves, 0)
    tests = np.isfinite(wanted).sum() + len(stage.cases)
    z = NormalDist().inv_cdf(1 - LEVEL / 2 / tests)
    # Student's t for the pixels of a block.
    z += (z**3 + z) / (4 * highlights.BLOCK**2 * (SEEDS - 1))
    wrong = []
    for i, case in enumerate(stage.cases):
        columns = slice(i * PART, (i + 1) * PART)
        bright = np.isfinite(wanted[:, columns])
        want, got, spread = (a[:, columns][bright] for a in (wanted, found, variance))
        apart = np.subtract(*(half[:, columns][bright] for half in halves)) / 2
        # As fractions. Dots are rare: a block may have none, and then shows no variance.
        noise, rough = spread / want**2, (apart / want) ** 2
        noise, rough = (np.maximum(a, a.mean()) for a in (noise, rough))
        allowed = z * np.sqrt(noise + rough) + off
        error = got / want - 1
        whole = got.sum() / want.sum() - 1
        of_whole = z * math.sqrt(((noise + rough) * want**2).sum()) / want.sum() + off
        name, worst = case[0] if case else "Diffuse", np.argmax(np.abs(error) / allowed)
        noise, rough = (math.sqrt(np.median(a)) for a in (noise, rough))
        print(
            f"{name}: {whole:+.3f} ({of_whole:.3f} allowed), worst of {len(want)} blocks "
            f"{error[worst]:+.3f} ({allowed[worst]:.3f}); median {np.median(allowed):.3f}, "
            f"noise {noise:.3f}, quadrature {rough:.3f}"
        )
        assert np.median(allowed) - off < POWER, f"{name}: too few samples to tell"
        if (np.abs(error) > allowed).any() or abs(whole) > of_whole:
            wrong.append(f"{name}: {error.round(3)} where {allowed.round(3)} is allowed")
    assert not wrong, wrong


@pytest.mark.long
@pytest.mark.sample(5)
@pytest.mark.parametrize("kind", WITH_MARKS)
def test_highlights(extension, empty, tool, kind):
    stage = highlights.Stage(empty, WIDE_CASES if kind == "half below the horizon" else CASES)
    samples = 16 if kind in SHARP else SAMPLES
    lamps = ALL_KINDS[kind](empty)
    hold(extension, tool, empty, stage, lamps, samples=samples, off=BOUNDED.get(kind, OFF))


@pytest.mark.evidence
@pytest.mark.full
def test_balls(extension, empty, tool):
    """All angles between lamp and surface, and the horizon."""
    stage = highlights.Stage(empty, CASES, ball=True)
    towards = unit((0.5, -0.62, 0.6))
    lamp = lit(empty, "AREA", at=6 * towards, towards=towards, shape="DISK", size=1.0)
    hold(extension, tool, empty, stage, [lamp])


@pytest.mark.evidence
@pytest.mark.full
def test_drawn_directions_show_the_same(extension, empty, tool):
    """Under a wide lamp, with a form that does not know about lamps."""
    stage = highlights.Stage(empty, WIDE_CASES[:2])
    lamp = lit(empty, "AREA", shape="DISK", size=3.0)
    hold(extension, tool, empty, stage, [lamp], form="sampled", samples=192)
