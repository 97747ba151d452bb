# SPDX-License-Identifier: GPL-3.0-or-later
"""Controlled forms in Cycles: a fit and a drawn, signed residual give the light of the model, with
less noise than drawing the model itself, and what is known to spoil that does so as is said."""

import json
import math
from types import SimpleNamespace

import bpy
import conditions
import numpy as np
import pytest
from goniometer import Goniometer, tilted, unit
from helpers import script_material
from test_physics import KINDS, axes, expected_radiance, light_of_lamp
from worlds import half, spot, white

FULL = pytest.mark.full
#: Of conditions.py, what may meet a drawn direction otherwise than closures.
CONDITIONS = [
    "default settings",
    "clamp indirect 1",
    "filter glossy 1",
    "path guiding",
    "caustics off",
    "sun without size",
]
#: The second has a fit that is off by a third at grazing views, and takes long to build.
MATERIALS = [
    ("ward", {}),
    pytest.param(("ashikhmin_shirley", {"nu": 10.0, "nv": 10.0}), marks=FULL),
]
FORMS = ("sampled", "fitted", "controlled")
REPLICAS = 48
#: A small lamp, and one that no drawn direction meets.
LAMP, NO_SIZE = 0.2, 0.0
SUN = unit((0.5, 0.0, 0.8))
#: Facets that all see it.
LIT = tilted((1.0, 0.8, 0.5, 0.25), 0.0)


@pytest.fixture(scope="module", params=MATERIALS, ids=lambda m: m[0])
def material(request, lean_pack):
    """Model, parameters, and by form the OSL and warnings, from a pack of this material alone."""
    model, values = request.param
    listed = {
        form: {"model": model, "parameters": values, "representation": form} for form in FORMS
    }
    pack = lean_pack(listed)
    entries = json.loads((pack / "manifest.json").read_text())["models"][model]["representations"]
    return SimpleNamespace(
        model=model,
        values=values,
        sources={form: (pack / entries[form]["shader"]).read_text() for form in FORMS},
        warnings=entries["controlled"]["warnings"],
    )


def measure(extension, material, forms, samples, light, kinds=KINDS, perspective=True):
    """Radiance of the kinds of facets in each form, (forms, kinds, replicas, 3), and what
    `light(meter)` returned."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=1)
    made = [script_material(extension, form, material.sources[form]) for form in forms]
    normals = np.tile(np.repeat(kinds, REPLICAS, 0), (len(forms), 1))
    which = np.repeat(np.arange(len(forms)), len(kinds) * REPLICAS)
    meter = Goniometer(scene, made, normals, samples, perspective, which)
    lit = light(meter)
    return meter.measure().reshape(len(forms), len(kinds), REPLICAS, 3), lit


def sun(angle):
    def add(meter):
        towards = meter.add_sun(SUN)
        bpy.data.lights["Sun"].angle = angle
        return towards

    return add


@pytest.mark.parametrize("world", [white, half, spot], ids=lambda w: w.__name__)
def test_light_of_a_world(extension, tool, material, world):
    """The means are the quadrature's within 5 standard errors: 15 comparisons a world, 45 a
    version, so one false alarm in some ten thousand runs."""
    found, radiance = measure(
        extension, material, ["controlled"], 512, lambda meter: world(*meter.add_world())
    )
    expected = expected_radiance(tool, material.model, material.values, radiance)
    mean = found[0].mean(1)
    error = np.hypot(found[0].std(1, ddof=1) / math.sqrt(REPLICAS), 1e-4)
    print(f"{material.model} {world.__name__}: {mean[:, 0]} +- {error[:, 0]}, {expected[:, 0]}")
    assert error.max() < 0.03 * max(expected.max(), 0.3), "too noisy to tell"
    z = (mean - expected) / error
    assert np.abs(z).max() < 5, f"z = {np.round(z, 1)}"


def test_noise_under_a_small_lamp(extension, tool, material):
    """relMSE, the squares of errors over those of the truth, at equal samples."""
    found, _ = measure(extension, material, FORMS, 1024, sun(LAMP), LIT)
    wo = np.array([axes(n) @ (0, 0, 1) for n in LIT])
    truth = light_of_lamp(tool, material.model, material.values, LIT, wo, SUN, LAMP)[:, 0]
    errors = ((found[..., 0] - truth[:, None]) ** 2).mean(-1).sum(-1) / (truth**2).sum()
    rel_mse = dict(zip(FORMS, errors, strict=True))
    ratio = rel_mse["sampled"] / rel_mse["controlled"]
    print(f"{material.model}: relMSE {rel_mse}, sampled / controlled {ratio:.3g}")
    assert ratio > 3


def test_a_lamp_of_no_size_sees_the_fit_alone(extension, material):
    found, _ = measure(extension, material, ["fitted", "controlled"], 16, sun(NO_SIZE), LIT, False)
    fitted, controlled = found.mean(-2)
    assert fitted.max() > 0.03
    assert controlled == pytest.approx(fitted, rel=1e-3, abs=1e-4)


@FULL
def test_what_biases_it_is_warned_of(extension, material):
    ours = SimpleNamespace(
        scene_loader=extension.scene_loader,
        api=SimpleNamespace(
            new_material=lambda model, form: script_material(
                extension, form, material.sources[form]
            ),
            warnings=lambda _material, _scene: [
                SimpleNamespace(code=code) for code in material.warnings
            ],
        ),
    )
    forms = [conditions.Form(material.model, "controlled")]
    rows = conditions.measure(ours, forms, CONDITIONS, 256)
    for row in rows:
        print(f"{row['form']}, {row['condition']}: {row['bias']:+.1%} +- {row['error']:.1%}")
    silent = [r["condition"] for r in rows if r["biased"] and not conditions.is_warned(r)]
    assert not silent
