#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the panel's plots of five materials side by side, as in docs/plots.png. Prints the time
that the plots of each model take, and of each form with a curve of its own:

.env/blender-4.5/bin/python script/plots.py build/brdfc_shaders-VERSION.zip docs/plots.png
"""

import sys
import tempfile
import time

import numpy as np
import render_scene

#: A rough metal, a lossless kernel, a plastic, a matte surface under a mirror, glass; with forms.
MATERIALS = {
    "cook_torrance": "fitted",
    "lossless": "twin",
    "phong_material": "auto",
    "coupled": "twin",
    "glass": "auto",
}
#: White pixels between two plots.
GAP = 8


def drawing_time(draw):
    """CPU seconds for a plot, once shared data exist: the minimum of fifteen runs."""
    draw()
    taken = []
    for _ in range(15):
        start = time.process_time()
        draw()
        taken.append(time.process_time() - start)
    return min(taken)


def main(extension, out):
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as resources:
        bpy, loader = render_scene.start_blender(extension, resources)
        api, model_nodes, panel = (
            loader.module(name) for name in ("api", "groups.model_nodes", "panels.plot_panel")
        )

        def node_of(model, form):
            (node,) = model_nodes.group_nodes(api.new_material(model, form))
            return node

        pictures = [panel.drawn(node_of(*material))[0] for material in MATERIALS.items()]
        gap = np.ones((pictures[0].shape[0], GAP, 4))
        row = np.concatenate([x for p in pictures for x in (gap, p)][1:], axis=1)
        image = bpy.data.images.new("plots", row.shape[1], row.shape[0])
        image.pixels.foreach_set(row.astype(np.float32).ravel())
        image.filepath_raw, image.file_format = out, "PNG"
        image.save()
        for model, entry in api.models().items():
            for form in ("auto", *entry["representations"]):
                node = node_of(model, form)
                if form == "auto" or model_nodes.is_fitted(node):
                    taken = drawing_time(lambda node=node: panel.drawn(node))
                    print(f"{model} ({form}): {1000 * taken:.1f} ms")


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main(*sys.argv[1:])
