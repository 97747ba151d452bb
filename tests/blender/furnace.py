# SPDX-License-Identifier: GPL-3.0-or-later
"""Furnace test of forms fitted to a model."""

import math

import numpy as np
from goniometer import Goniometer, tilted
from helpers import arguments, read_csv


def check(tool, scene, made, materials, cosines, *options, replicas, samples, slack):
    """Checks that each material reflects the albedo of its model, within the error that `brdfc fit`
    states for that view and the noise.

    `made`: objects in Blender for `materials`, {model: parameters}. `options` are passed to `brdfc
    fit`; `slack` allows for single precision and tables.
    """
    seen = np.repeat(cosines, replicas)
    which = np.repeat(np.arange(len(materials)), len(seen))
    seen = np.tile(seen, len(materials))
    turns = np.random.default_rng(4).uniform(0, 2 * math.pi, len(seen))
    meter = Goniometer(scene, made, tilted(seen, turns), samples=samples, which=which)
    meter.add_world()
    picture = meter.measure()
    for i, (model, parameters) in enumerate(materials.items()):
        values = arguments(parameters)
        stdin = "cos_theta_o\n" + "".join(f"{c}\n" for c in cosines)
        columns, rows = read_csv(tool("albedo", model, *values, stdin=stdin))
        total = [columns.index(f"albedo_{c}") for c in "rgb"]
        errors = read_csv(tool("fit", model, *values, *options))[1]
        for cosine, truth in zip(cosines, rows[:, total], strict=True):
            chosen = picture[(which == i) & (seen == cosine)]
            stated = errors[np.argsort(np.abs(errors[:, 0] - cosine))[:2], 3].max()
            noise = 5 * chosen.std(0, ddof=1).max() / math.sqrt(replicas)
            error = np.abs(chosen.mean(0) - truth).max()
            print(f"{model} at {cosine}: {error:.2g}, stated {stated:.2g}, noise {noise:.2g}")
            assert error <= stated + noise + slack, f"{model} at {cosine}"
            assert noise < 0.03, "too noisy to tell"
