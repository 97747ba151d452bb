# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests how Cycles evaluates and samples the closures that forms use or may use.

Evaluation is measured under suns and compared with our definition in double precision (`brdfc
closure`). Sampling is compared with evaluation: the same emissive squares are rendered once as
meshes that only BSDF sampling finds, and once as lamps that only light sampling finds. Both must
give the same picture; if they don't, the closure samples something other than it evaluates.
"""

import dataclasses
import functools
import math

import bpy
import numpy as np
from goniometer import Goniometer, frame, tilted, unit
from helpers import node_material, pairs_csv, read_csv, script_material
from worlds import gradient, spot, white

#: With colours. diffuse_ramp is sampled with a cosine pdf, though it contains no cosine: if its
#: first colour is not 0, its variance is infinite. Forms must avoid this, as does this test.
RAMP = [
    (0.0, 0.0, 0.0),
    (0.7, 0.4, 0.1),
    (0.2, 0.1, 0.3),
    (0.5, 0.0, 0.2),
    (0.9, 0.6, 0.4),
    (0.6, 1.0, 0.3),
    (0.8, 0.5, 0.9),
    (1.0, 1.0, 0.2),
]
WEIGHT = (0.9, 0.5, 0.1)
TILT = unit((0.3, -0.2, 0.93))


@dataclasses.dataclass(frozen=True)
class Case:
    """A closure: its OSL text, in which n, t and m (a tilted normal) are vectors and `ramp` is an
    array of colours; and the arguments for our definition. `delta`: for closures that can't be
    evaluated, maps wo to the one direction into which they scatter."""

    name: str
    osl: str
    definition: tuple = ()
    delta: object = None


def _vector(v):
    return ",".join(repr(float(x)) for x in v)


RAMP_VALUES = tuple(f"ramp_{i}={_vector(c)}" for i, c in enumerate(RAMP))
TILTED = f"normal={_vector(TILT)}"


def _reflected(normal):
    return lambda wo: 2 * (wo @ normal)[..., None] * normal - wo


def _refracted(wo, ior=1.5):
    cos_t = np.sqrt(1 - (1 - wo[..., 2] ** 2) / ior**2)
    return np.stack([-wo[..., 0] / ior, -wo[..., 1] / ior, -cos_t], -1)


def _microfacet(kind, alpha_x, alpha_y, normal="n", tangent="t"):
    return f'microfacet("{kind}", {normal}, {tangent}, {alpha_x}, {alpha_y}, 1.0, 0)'


def _microfacets():
    cases = []
    for kind in ("ggx", "beckmann", "ashikhmin_shirley"):
        for x, y in ((0.05, 0.05), (0.4, 0.4), (0.9, 0.9), (0.2, 0.6)):
            cases.append(
                Case(
                    f"{kind} {x} {y}",
                    _microfacet(kind, x, y),
                    (kind, f"alpha_x={x}", f"alpha_y={y}"),
                )
            )
        cases.append(
            Case(
                f"{kind} 0.4 0.4 tilted",
                _microfacet(kind, 0.4, 0.4, normal="m"),
                (kind, "alpha_x=0.4", "alpha_y=0.4", TILTED),
            )
        )
        # This tangent is not perpendicular to the tilted normal.
        cases.append(
            Case(
                f"{kind} 0.3 0.5 tilted",
                _microfacet(kind, 0.3, 0.5, normal="m"),
                (kind, "alpha_x=0.3", "alpha_y=0.5", TILTED),
            )
        )
    return cases


def _phong(exponent, tilted_=False):
    return Case(
        f"phong_ramp {exponent:g}" + (" tilted" if tilted_ else ""),
        f"phong_ramp({'m' if tilted_ else 'n'}, {exponent!r}, ramp)",
        ("phong_ramp", f"exponent={exponent!r}", *RAMP_VALUES, *([TILTED] if tilted_ else [])),
    )


def _rough_matte(albedo, roughness, normal="n"):
    return Case(
        f"oren_nayar_diffuse_bsdf {albedo[0]} {roughness}" + ("" if normal == "n" else " tilted"),
        f"oren_nayar_diffuse_bsdf({normal}, color{albedo}, {roughness})",
        (
            "oren_nayar",
            f"albedo={_vector(albedo)}",
            f"roughness={roughness}",
            *([] if normal == "n" else [TILTED]),
        ),
    )


def _velvet(sigma, normal="n"):
    return Case(
        f"ashikhmin_velvet {sigma}" + ("" if normal == "n" else " tilted"),
        f"ashikhmin_velvet({normal}, {sigma})",
        ("velvet", f"roughness={sigma}", *([] if normal == "n" else [TILTED])),
    )


def _toon(kind, size, smooth):
    return Case(
        f"{kind} {size} {smooth}",
        f"{kind}(n, {size}, {smooth})",
        (kind, f"size={size}", f"smooth={smooth}"),
    )


CASES = [
    Case("diffuse", "diffuse(n)", ("diffuse",)),
    Case("diffuse tilted", "diffuse(m)", ("diffuse", TILTED)),
    Case("burley", "burley_diffuse_bsdf(n, color(1), 0.0)", ("burley",)),
    Case("burley 0.7", "burley_diffuse_bsdf(n, color(1), 0.7)", ("burley", "roughness=0.7")),
    Case(
        "burley 0.7 tilted",
        "burley_diffuse_bsdf(m, color(1), 0.7)",
        ("burley", "roughness=0.7", TILTED),
    ),
    _rough_matte((0.8, 0.5, 0.2), 0.0),
    _rough_matte((0.8, 0.5, 0.2), 0.7),
    _rough_matte((1.0, 0.9, 0.1), 1.0),
    _rough_matte((0.8, 0.5, 0.2), 0.7, normal="m"),
    # The base of oren_nayar: rough facets with a low albedo.
    _rough_matte((0.01, 0.01, 0.01), 0.3),
    *(_velvet(sigma) for sigma in (0.2, 0.6, 1.0)),
    _velvet(0.6, normal="m"),
    Case("diffuse_ramp", "diffuse_ramp(n, ramp)", ("diffuse_ramp", *RAMP_VALUES)),
    Case("diffuse_ramp tilted", "diffuse_ramp(m, ramp)", ("diffuse_ramp", *RAMP_VALUES, TILTED)),
    *(_phong(e) for e in (1.0, 20.0, 300.0)),
    _phong(20.0, tilted_=True),
    *_microfacets(),
    *(_toon("diffuse_toon", *p) for p in ((0.5, 0.0), (0.3, 0.4), (0.9, 0.5))),
    *(_toon("glossy_toon", *p) for p in ((0.3, 0.0), (0.1, 0.3), (0.001, 0.05), (0.6, 0.4))),
    # Without a definition of ours: only sampling and evaluation are compared.
    Case("oren_nayar 0.5", "oren_nayar(n, 0.5)"),
    Case("sheen 0.4", "sheen(n, 0.4)"),
    Case(
        "generalized_schlick_bsdf 0.3",
        "generalized_schlick_bsdf(n, t, color(1), color(0), 0.3, 0.3, color(0.04, 0.2, 0.6), "
        'color(1), 5.0, "ggx")',
    ),
    Case(
        "conductor_bsdf 0.3",
        'conductor_bsdf(n, t, 0.3, 0.3, color(0.2, 0.4, 1.4), color(3.9, 2.4, 1.6), "beckmann")',
    ),
    Case(
        "dielectric_bsdf 0.4",
        'dielectric_bsdf(n, t, color(1), color(1), 0.4, 0.4, 1.5, "ggx")',
    ),
    Case("microfacet refraction 0.4", 'microfacet("ggx", n, t, 0.4, 0.4, 1.5, 1)'),
    Case("reflection", "reflection(n)", delta=_reflected(np.array([0.0, 0.0, 1.0]))),
    Case("reflection tilted", "reflection(m)", delta=_reflected(TILT)),
    Case("refraction 1.5", "refraction(n, 1.5)", delta=_refracted),
]

_HALF = "half vectors that face away are mirrored after the ray was computed: wide lobes gain light"
_TILT = "rays below the horizon of a tilted normal are kept, and evaluated as 0"
_ROUGH = "light is evaluated in directions into which no facet refracts"
#: Known faults, with the last version in which they were found: Cycles samples these closures
#: differently than it evaluates them, so forms must not use them. Their other rows prove nothing.
FAULTS = {
    "ashikhmin_shirley 0.4 0.4": (_HALF, (5, 2)),
    "ashikhmin_shirley 0.9 0.9": (_HALF, (5, 2)),
    "ashikhmin_shirley 0.2 0.6": (_HALF, (5, 2)),
    "ggx 0.4 0.4 tilted": (_TILT, (4, 5)),
    "ggx 0.3 0.5 tilted": (_TILT, (4, 5)),
    "beckmann 0.4 0.4 tilted": (_TILT, (4, 5)),
    "beckmann 0.3 0.5 tilted": (_TILT, (4, 5)),
    "dielectric_bsdf 0.4": (_ROUGH, (5, 2)),
    "microfacet refraction 0.4": (_ROUGH, (5, 2)),
}
#: The last version in which the faults were checked.
LOOKED_AT = (5, 2)


SHADER = """
shader conformance(output closure color BSDF = 0)
{{
    vector n = normalize(N);
    vector axis = vector(0, 0, 1) - n * n[2];
    if (dot(axis, axis) < 1e-8)
        axis = vector(1, 0, 0) - n * n[0];
    vector t = normalize(axis);
    vector b = cross(n, t);
    vector m = {x!r} * t + {y!r} * b + {z!r} * n;
    color ramp[8] = {{ {ramp} }};
    BSDF = color{weight} * {osl};
}}
"""


def shader(case):
    ramp = ", ".join(f"color{c}" for c in RAMP)
    x, y, z = map(float, TILT)
    return SHADER.format(x=x, y=y, z=z, ramp=ramp, weight=WEIGHT, osl=case.osl)


def start(extension, cases, max_bounces):
    """A clean scene, and the materials of the cases."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=max_bounces)
    return scene, [script_material(extension, case.name, shader(case)) for case in cases]


# ---- evaluation -------------------------------------------------------------------------------

SUNS = [(0, 0, 1), (0.3, -0.2, 0.9), (0.8, 0.1, 0.6), (-0.5, 0.8, 0.3)]
#: Number of facets for each case and sun.
FACETS = 96


def defined(tool, case, wi, wo):
    """f cos by our definition, without the weight, (n, 3)."""
    return read_csv(tool("closure", *case.definition, stdin=pairs_csv(wi, wo)))[1]


def evaluation(extension, tool, cases=None):
    """For each case with a definition: the relative L1 error, and the largest error relative to the
    largest value."""
    cases = [c for c in cases or CASES if c.definition]
    rng = np.random.default_rng(1)
    which = np.repeat(np.arange(len(cases)), FACETS)
    found = {c.name: ([], []) for c in cases}
    for towards in SUNS:
        scene, materials = start(extension, cases, max_bounces=0)
        normals = tilted(rng.uniform(0.02, 1, len(which)), rng.uniform(0, 2 * math.pi, len(which)))
        meter = Goniometer(scene, materials, normals, samples=4, which=which)
        wi = meter.local(meter.add_sun(unit(towards)))
        wo, picture = meter.wo(), meter.measure()
        for i, case in enumerate(cases):
            # A tilted normal adds a terminator, where rounding decides between light and dark as
            # well.
            lit = (which == i) & (wi[:, 2] > 1e-4) & (np.abs(wi @ TILT) > 1e-3)
            dark = (which == i) & (wi[:, 2] < -1e-4)
            expected = defined(tool, case, wi[lit], wo[lit]) * WEIGHT
            found[case.name][0].append(np.concatenate([picture[lit], picture[dark]]))
            found[case.name][1].append(np.concatenate([expected, np.zeros((dark.sum(), 3))]))
    result = {}
    for name, (measured, expected) in found.items():
        measured, expected = np.concatenate(measured), np.concatenate(expected)
        off = np.abs(measured - expected)
        result[name] = (off.sum() / np.abs(expected).sum(), off.max() / np.abs(expected).max())
    return result


# ---- sampling ---------------------------------------------------------------------------------

#: View cosines; grazing views reveal errors that others hide.
COSINES = (0.06, 0.15, 0.4, 0.8, 1.0)
#: Half the side of a box of lamps around everything: so large that all facets see them in the same
#: directions.
FAR = 2e4
#: Squares of radiance 1 that face the origin, as (centre, half the side) in units of FAR. All six
#: form a furnace.
SIX = [(sign * axis, 1.0) for axis in np.eye(3) for sign in (1, -1)]
SQUARES = {
    "white": SIX,
    "side": [(np.array([1.0, 0.0, 0.0]), 1.0)],
    "cap": [(np.array([0.35, -0.5, 0.79]), 0.25)],
}


def _square(meter, centre, half, sampled):
    """A square that emits towards the origin. `sampled`: an area lamp, which only light sampling
    finds; otherwise a mesh, which only BSDF sampling finds."""
    from mathutils import Vector

    if sampled:
        data = bpy.data.lights.new("lamp", "AREA")
        data.shape, data.size = "SQUARE", 2 * half * FAR
        data.energy = math.pi * data.size**2
        data.cycles.use_multiple_importance_sampling = False
    else:
        data = bpy.data.meshes.new("lamp")
        corners = [
            (x * half * FAR, y * half * FAR, 0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        data.from_pydata(corners, [], [(0, 1, 2, 3)])
        data.materials.append(_emitter())
    lamp = bpy.data.objects.new("lamp", data)
    lamp.location = centre * FAR
    lamp.rotation_mode = "QUATERNION"
    # Its -z axis points to the origin.
    lamp.rotation_quaternion = Vector(centre).to_track_quat("Z", "Y")
    lamp.visible_camera = lamp.visible_shadow = False
    meter.scene.collection.objects.link(lamp)


def _emitter():
    if found := bpy.data.materials.get("emitter"):
        return found
    material = node_material("ShaderNodeEmission", Color=(1, 1, 1, 1))
    material.name = "emitter"
    material.cycles.emission_sampling = "NONE"
    return material


def _hits(directions, world):
    """Radiance from these directions at the origin, (n,); NaN near an edge."""
    radiance = np.zeros(len(directions))
    for centre, half in SQUARES[world]:
        distance = np.linalg.norm(centre)
        normal = centre / distance
        t = distance / np.maximum(directions @ normal, 1e-9)
        z = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
        side = unit(np.cross(z, normal))
        up = np.cross(normal, side)
        across = np.stack([(directions * t[:, None]) @ side, (directions * t[:, None]) @ up], -1)
        reach = np.abs(across).max(-1) / half
        inside = (directions @ normal > 0) & (reach < 1)
        radiance += inside
        if world != "white":
            near = (directions @ normal > 0) & (np.abs(reach - 1) < 0.05)
            radiance[near] = np.nan
    return radiance


@functools.cache
def kinds():
    return tilted(COSINES, 0.4 + 2.1 * np.arange(len(COSINES)))


def _meter(extension, cases, replicas, samples):
    scene, materials = start(extension, cases, max_bounces=1)
    normals = np.tile(np.repeat(kinds(), replicas, 0), (len(cases), 1))
    which = np.repeat(np.arange(len(cases)), len(COSINES) * replicas)
    return Goniometer(scene, materials, normals, samples, which=which)


def _radiance(meter, cases, replicas):
    """Radiance for each case and kind of facet, (cases, kinds, 3), and its standard error."""
    found = meter.measure().reshape(len(cases), len(COSINES), replicas, 3)
    return found.mean(2), found.std(2, ddof=1) / math.sqrt(replicas)


def by_squares(extension, cases, world, sampled, replicas, samples):
    meter = _meter(extension, cases, replicas, samples)
    for centre, half in SQUARES[world]:
        _square(meter, centre, half, sampled)
    return _radiance(meter, cases, replicas)


def by_world(extension, cases, world, replicas, samples):
    """The same, lit by a smooth world that only BSDF sampling finds; and the world's radiance as a
    function."""
    meter = _meter(extension, cases, replicas, samples)
    radiance = world(*meter.add_world())
    return (*_radiance(meter, cases, replicas), radiance)


def kind_axes():
    """Frames of the kinds of facets, (kinds, 3, 3): rows t, b, n in world space."""
    return np.stack([*frame(kinds()), kinds()], 1)


def _polar_grid(axis):
    """Nodes and solid angles of a quadrature rule over the sphere that is dense about an axis."""
    edges = (0, 0.05, 0.15, 0.4, 0.9, 1.8, math.pi)
    x, w = np.polynomial.legendre.leggauss(12)
    pairs = list(zip(edges[:-1], edges[1:], strict=True))
    theta = np.concatenate([a + (b - a) * (x + 1) / 2 for a, b in pairs])
    weight = np.concatenate([(b - a) / 2 * w for a, b in pairs]) * np.sin(theta)
    count = 128
    phi = (np.arange(count) + 0.5) * 2 * math.pi / count
    side = unit(np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0)))
    up = np.cross(axis, side)
    sin_theta = np.sin(theta)[:, None, None]
    d = np.cos(theta)[:, None, None] * axis + sin_theta * (
        np.cos(phi)[:, None] * side + np.sin(phi)[:, None] * up
    )
    return d.reshape(-1, 3), np.repeat(weight * 2 * math.pi / count, count)


def expected_in_worlds(tool, cases, radiances):
    """Integrates our definitions by quadrature: {world: (cases, kinds, 3)}."""
    axes = kind_axes()
    wo = axes @ np.array([0.0, 0.0, 1.0])
    result = {name: np.zeros((len(cases), len(COSINES), 3)) for name in radiances}
    for normal in (np.array([0.0, 0.0, 1.0]), TILT):
        grids = [_polar_grid(2 * (o @ normal) * normal - o) for o in wo]
        kept = [d[:, 2] > 0 for d, _ in grids]
        sizes = [int(k.sum()) for k in kept]
        wi = np.concatenate([d[k] for (d, _), k in zip(grids, kept, strict=True)])
        weight = np.concatenate([w[k] for (_, w), k in zip(grids, kept, strict=True)])
        kind = np.repeat(np.arange(len(COSINES)), sizes)
        towards = np.einsum("ni,nij->nj", wi, axes[kind])
        stdin = pairs_csv(wi, wo[kind])
        for i, case in enumerate(cases):
            if (TILTED in case.definition) != (normal is TILT):
                continue
            f = read_csv(tool("closure", *case.definition, stdin=stdin))[1] * weight[:, None]
            for name, radiance in radiances.items():
                light = np.reshape(radiance(towards), (len(wi), -1))
                for k in range(len(COSINES)):
                    result[name][i, k] = (f * light)[kind == k].sum(0) * WEIGHT
    return result


def delta_radiance(case, world):
    """Radiance of a closure that scatters into one direction, (kinds, 3)."""
    up = np.array([0.0, 0.0, 1.0])
    axes = kind_axes()
    wi = case.delta(axes @ up)
    # Reflection below the surface is lost.
    kept = (wi[:, 2] > 0) | ("refraction" in case.name)
    towards = np.einsum("ki,kij->kj", wi, axes)
    return (_hits(towards, world) * kept)[:, None] * np.array(WEIGHT)


@dataclasses.dataclass(frozen=True)
class Deviation:
    """Largest difference between sampling and evaluation, relative to the evaluation, and by how
    many standard errors it exceeds the tolerance. `resolution`: the difference that half of the
    comparisons would have detected."""

    share: float
    z: float
    cosine: float
    world: str
    evaluated: float
    sampled: float
    resolution: float


#: Smaller differences, relative to the expected radiance, do not count.
TOLERANCE = 5e-3
#: Differences must also exceed the noise by this many standard errors: there are about 2,000
#: comparisons, and with 16 replicas Student's t distribution has long tails.
SIGNIFICANT = 8.0
#: Relative L1 difference allowed between a closure's evaluation and our definition. Powers with
#: large exponents need most of it, as Cycles computes in single precision.
EVALUATION = 1e-4


def _worst(cases, world, drawn, noise, expected, drawn_rays, found):
    """Keeps the most significant Deviation of each case."""
    for i, case in enumerate(cases):
        # A few replicas estimate their own noise poorly, so it is at least a fraction of the
        # radiance.
        error = np.maximum(noise[i], 1e-3 * np.abs(expected[i]) + 1e-6)
        # If few rays hit light, replicas underestimate the noise; a single ray contributes about 1.
        few = np.sqrt(np.abs(expected[i]) / drawn_rays) + 2 / drawn_rays
        error = np.where(np.abs(expected[i]) * drawn_rays < 100, np.maximum(error, few), error)
        beyond = np.maximum(np.abs(drawn[i] - expected[i]) - TOLERANCE * np.abs(expected[i]), 0)
        z = np.nan_to_num(beyond / error)
        k, c = np.unravel_index(z.argmax(), z.shape)
        value = float(expected[i][k, c])
        this = Deviation(
            share=float(drawn[i][k, c]) / max(value, 1e-9) - 1,
            z=float(z[k, c]),
            cosine=COSINES[k],
            world=world,
            evaluated=value,
            sampled=float(drawn[i][k, c]),
            resolution=float(
                np.nanmedian(SIGNIFICANT * error / np.maximum(np.abs(expected[i]), 1e-9))
                + TOLERANCE
            ),
        )
        best = found.setdefault(case.name, this)
        resolution = min(best.resolution, this.resolution)
        worst = max(best, this, key=lambda d: d.z)
        found[case.name] = dataclasses.replace(worst, resolution=resolution)


def sampling(extension, tool, cases=None, replicas=16, samples=512):
    """For each case the most significant Deviation of BSDF sampling, compared with quadrature of
    our definition or, if there is none, with light sampling."""
    cases = cases or CASES
    found = {}
    smooth = [c for c in cases if c.definition and "toon" not in c.name]
    radiances, measured = {}, {}
    for world in (white, gradient, spot) if smooth else ():
        mean, noise, radiances[world.__name__] = by_world(
            extension, smooth, world, replicas, samples
        )
        measured[world.__name__] = mean, noise
    for name, expected in expected_in_worlds(tool, smooth, radiances).items():
        _worst(smooth, name, *measured[name], expected, replicas * samples, found)

    others = [c for c in cases if c not in smooth]
    for world in SQUARES if others else ():
        drawn, noise = by_squares(extension, others, world, False, replicas, samples)
        truth, other = by_squares(extension, others, world, True, replicas, samples)
        for i, case in enumerate(others):
            if case.delta:
                truth[i], other[i] = delta_radiance(case, world), 0
        _worst(others, world, drawn, np.hypot(noise, other), truth, replicas * samples, found)
    return found


# ---- weights and clamps -----------------------------------------------------------------------


def _balanced(terms):
    if len(terms) == 1:
        return terms[0]
    middle = len(terms) // 2
    return f"({_balanced(terms[:middle])} + {_balanced(terms[middle:])})"


def _chain(terms):
    """Nested as statements `BSDF += ...` nest them: the first term is the innermost."""
    text = terms[0]
    for term in terms[1:]:
        text = f"({text} + {term})"
    return text


def _deep_right(terms):
    return terms[0] if len(terms) == 1 else f"({terms[0]} + {_deep_right(terms[1:])})"


def _equal(count, closure="diffuse(n)"):
    return [f"{1 / count!r} * {closure}"] * count


_GREY_RAMP = "diffuse_ramp(n, ones)"
#: (name, OSL text, expected result of a sun at the normal, in units of a white diffuse surface).
#: Lost closures are not desired, but the generator must know where the limit is.
LIMITS = [
    ("a weight below 0 is 0", "diffuse(n) + color(-0.5) * diffuse(n)", 1.0),
    ("a tiny weight is kept", "2e-5 * diffuse(n)", 2e-5),
    ("a tinier one is dropped", "5e-6 * diffuse(n)", 0.0),
    ("colours of a ramp may be negative", "diffuse(n) + 0.1 * diffuse_ramp(n, minus)", 0.7),
    ("a large weight is kept", "1000.0 * diffuse(n)", 1000.0),
    ("a chain of 16", _chain(_equal(16)), 1.0),
    ("a chain of 24 keeps 16", _chain(_equal(24)), 16 / 24),
    ("24 deep on the right", _deep_right(_equal(24)), 1.0),
    ("24 balanced", _balanced(_equal(24)), 1.0),
    ("64 balanced", _balanced(_equal(64)), 1.0),
    ("80 keep 64", _balanced(_equal(80)), 64 / 80),
    ("21 ramps", _balanced(_equal(21, _GREY_RAMP)), 1.0),
    ("22 ramps keep 21", _balanced(_equal(22, _GREY_RAMP)), 21 / 22),
]

LIMIT_SHADER = """
shader limit(output closure color BSDF = 0)
{{
    vector n = normalize(N);
    color ones[8], minus[8];
    for (int i = 0; i < 8; i++) {{
        ones[i] = color(1);
        minus[i] = color(-3);
    }}
    BSDF = {osl};
}}
"""


def limits(extension):
    """The results of LIMITS."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=0)
    materials = [
        script_material(extension, f"limit {i}", LIMIT_SHADER.format(osl=osl))
        for i, (_, osl, _) in enumerate(LIMITS)
    ]
    up = np.tile([0.0, 0.0, 1.0], (len(LIMITS), 1))
    meter = Goniometer(scene, materials, up, samples=1, which=np.arange(len(LIMITS)))
    meter.add_sun((0.0, 0.0, 1.0))
    return meter.measure()[:, 0] * math.pi


# ---- the table --------------------------------------------------------------------------------


def table(evaluated, deviations):
    """Rows for readers and for the report: the measurements, and the resulting verdict."""
    rows = []
    for case in (c for c in CASES if c.name in deviations):
        d = deviations[case.name]
        row = {"closure": case.name, "osl": case.osl}
        bad = []
        if case.name in evaluated:
            row["evaluation_l1"], row["evaluation_max"] = evaluated[case.name]
            if row["evaluation_l1"] > EVALUATION:
                bad.append("evaluation differs from our definition")
        if d.z > SIGNIFICANT:
            bad.append(
                f"sampling differs from evaluation by {d.share:+.1%} at cos {d.cosine} ({d.world})"
            )
        row |= {
            "sampling_share": d.share if d.z > SIGNIFICANT else 0.0,
            "sampling_z": d.z,
            "sampling_resolution": d.resolution,
            "fault": "; ".join(bad),
            "known_fault": FAULTS.get(case.name, ("",))[0],
        }
        row["verdict"] = "fault" if bad else "mended" if case.name in FAULTS else "ok"
        rows.append(row)
    return rows
