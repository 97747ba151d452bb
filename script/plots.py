#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's plots of four models side by side, as docs/plots.png has them, and how long those of
each model take:

.env/blender-4.5/bin/python script/plots.py build/brdfc_shaders-VERSION.zip docs/plots.png
"""

import sys
import tempfile
import time
from importlib import import_module

import numpy as np
import render_scene

#: A rough metal, a lossless kernel, a plastic, a mirror of gold.
MODELS = ("cook_torrance", "lossless", "phong_material", "fresnel_conductor")
#: White pixels between two.
GAP = 8


def drawing_times(plots, models):
    """Wall seconds of a plot by model, once what all share is there: the least of seven."""
    times = {}
    for model in models:
        plots.draw(model, {})
        taken = []
        for _ in range(7):
            start = time.perf_counter()
            plots.draw(model, {})
            taken.append(time.perf_counter() - start)
        times[model] = min(taken)
    return times


def main(extension, out):
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as resources:
        bpy, loader = render_scene.start_blender(extension, resources)
        plots = import_module(loader.__name__.replace("scene_loader", "plots"))
        pictures = [plots.draw(model, {})[0] for model in MODELS]
        gap = np.ones((plots.SIZE, GAP, 4))
        row = np.concatenate([x for p in pictures for x in (gap, p)][1:], axis=1)
        image = bpy.data.images.new("plots", row.shape[1], row.shape[0])
        image.pixels.foreach_set(row.astype(np.float32).ravel())
        image.filepath_raw, image.file_format = out, "PNG"
        image.save()
        for model, seconds in drawing_times(plots, loader.pack.model_names()).items():
            print(f"{model}: {1000 * seconds:.1f} ms")


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main(*sys.argv[1:])
