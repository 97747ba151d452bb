# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the noise of forms that sample directions, as rendered by Blender, with that of the
models' own samplers.

In a furnace, a sampled direction contributes its weight f cos / pdf, and a mirror its own: the mean
of the channels is their sum, whichever of the two Cycles follows. So the variance over pixels with
one sample is that of the sampler's weights. Tests of means would not detect a form that wastes
samples.
"""

import math
from statistics import NormalDist

import bpy
import numpy as np
import pytest
from goniometer import Goniometer, tilted
from helpers import arguments, materials_of, read_csv, script_material, with_every_model

CASES = with_every_model(
    "sampled",
    ("ashikhmin_shirley", {"part": "specular", "nu": 10.0, "nv": 10.0, "rs": 1.0}),
    ("ashikhmin_shirley", {"rs": (0.3, 0.6, 0.9), "rd": 0.5, "nu": 20.0, "nv": 200.0}),
    ("ashikhmin_shirley", {}),
    ("coupled", {"r0": 0.1, "rm": (1.0, 0.5, 0.1)}),
    ("coupled", {"r0": 0.1, "fresnel": "dielectric"}),
    # With its default, too few samples are lost to know their variance.
    ("disney", {"metallic": 0.5, "clearcoat": 1.0}),
    # With its default, nearly all weights are 1.
    ("rough_glass", {"alpha": 0.8, "masking": "smith_separable"}),
    ("schlick", {}),
    ("schlick", {"rough": 0.7, "p": 0.4, "r": (0.9, 0.5, 0.1)}),
    ("ward", {}),
    ("ward", {"ax": 0.3, "ay": 0.6, "normalisation": "duer"}),
)
#: View cosines, and the number of pixels for each.
COSINES = (0.9, 0.5, 0.2)
AZIMUTH = 0.4
PIXELS = 4096
#: Number of samples from the model's own sampler.
DRAWN = 40000
#: A correct form fails one run of all tests in a thousand, if the fourth moments of the weights are
#: known.
Z = NormalDist().inv_cdf(1 - 1e-3 / (2 * len(COSINES) * max(len(CASES), 1)))
#: Error allowed for single precision, as a fraction.
SHARE = 0.02
#: A sampled direction is carried by a lobe 1.4e-3 rad wide: its weight varies by this fraction of
#: the mean, and the part of it below the horizon is lost.
OF_LOBE, LOW = 0.01, 3e-3


def measured(extension, materials):
    """Mean of the channels in a furnace with one sample per pixel, (materials, cosines, pixels);
    and the views in the facets' frames."""
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, max_bounces=1)
    kinds = tilted(COSINES, AZIMUTH * np.ones(len(COSINES)))
    shape = len(materials), len(COSINES), PIXELS
    # One view direction for each cosine: random numbers differ by the facets' positions.
    meter = Goniometer(
        scene,
        materials,
        np.tile(np.repeat(kinds, PIXELS, axis=0), (len(materials), 1)),
        samples=1,
        which=np.repeat(np.arange(len(materials)), len(COSINES) * PIXELS),
    )
    meter.add_world()
    views = meter.wo().reshape(*shape, 3)[0, :, 0]
    return meter.measure().mean(-1).reshape(shape), views


def disagreement(pixels, drawn):
    """How the variances of pixels and of the sampler's weights differ significantly; "" if they do
    not. Fails as well if a factor of two would not be detected."""
    weights, heights = drawn
    expected, found = weights.var(ddof=1), pixels.var(ddof=1)
    fourth = ((weights - weights.mean()) ** 4).mean()
    chance = math.sqrt(max(fourth - expected**2, 0) * (1 / len(pixels) + 1 / len(weights)))
    low = (np.abs(heights) < LOW).mean()
    lost = low + Z * math.sqrt(low / len(pixels))
    of_lobe = (OF_LOBE**2 + lost) * weights.mean() ** 2
    allowed = Z * chance + SHARE * expected + of_lobe
    text = f"variance {found:.4g}, of the model's sampler {expected:.4g} +- {allowed:.2g}"
    print(text)
    assert allowed < expected + 2 * of_lobe, f"{text}: too few samples to tell"
    return text if abs(found - expected) > allowed else ""


def draw(tool, model, values, wo):
    """Means of the channels of weights from the model's sampler, and the heights of the sampled
    directions."""
    unit = wo / np.linalg.norm(wo)
    options = ("--count", DRAWN, "--seed", 1, "--wo", ",".join(map(repr, unit.tolist())))
    rows = read_csv(tool("sample", model, *arguments(values), *options))[1]
    # The height of an invalid direction is meaningless.
    return rows[:, 3:6].mean(1), np.where(rows[:, 6] > 0, rows[:, 2], 1)


@pytest.mark.many
@pytest.mark.sample(5)
@pytest.mark.parametrize(("model", "values"), CASES)
def test_drawn_form_is_as_noisy_as_its_sampler(
    extension, empty, tool, batch, request, model, values
):
    def measure(cases):
        made = materials_of(extension, "sampled", cases)
        sound = [m for m in made if not isinstance(m, Exception)]
        pixels, views = measured(extension, sound)
        found = iter(pixels)
        return [m if isinstance(m, Exception) else (next(found), views) for m in made]

    pixels, views = batch.result(request, measure)
    wrong = []
    for cosine, seen, wo in zip(COSINES, pixels, views, strict=True):
        if found := disagreement(seen, draw(tool, model, values, wo)):
            wrong.append(f"seen at {cosine}: {found}")
    assert not wrong, wrong


def test_a_form_of_the_same_mean_that_wastes_samples_is_found(extension, empty, tool):
    """Seven of eight sampled directions have weight 0, the others eight times the weight."""
    model = "ward"
    source = extension.pack.model(model).forms["sampled"].source()[1]
    weight = "BSDF = weight *"
    wasteful = (
        "vector more = brdfc_random(99, path_length); "
        "color kept = (more[0] < 0.125 ? 8.0 : 0.0) * weight; BSDF = kept *"
    )
    assert weight in source
    sources = {"as it is": source, "wasteful": source.replace(weight, wasteful)}
    materials = [script_material(extension, name, text) for name, text in sources.items()]
    (right, wrong), views = measured(extension, materials)
    for i, wo in enumerate(views):
        drawn = draw(tool, model, {}, wo)
        assert wrong[i].mean() == pytest.approx(drawn[0].mean(), rel=0.2)
        assert not disagreement(right[i], drawn)
        assert disagreement(wrong[i], drawn)
