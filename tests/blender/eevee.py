# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders with EEVEE, in a separate process: without a graphics driver, such as Mesa's, Blender
exits.

python eevee.py FILE.blend      prints `STARTED`, then renders as the file specifies
"""

import subprocess
import sys
from pathlib import Path

STARTED = "EEVEE runs"


def picture_of(file, out):
    """Renders a .blend file that writes the file `out`. Returns the reason if EEVEE can't start."""
    command = [sys.executable, __file__, str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    if STARTED not in done.stdout:
        return (
            f"EEVEE does not start here: {' '.join(done.stderr.split())[-300:] or done.returncode}"
        )
    assert done.returncode == 0 and Path(out).is_file(), done.stdout + done.stderr
    return None


def engine():
    """EEVEE's identifier in this version of Blender."""
    import bpy

    return "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"


def render(scene, folder, samples=16):
    """The picture of the open file's scene by EEVEE; skips the test where that can't start."""
    import bpy
    import pytest
    from helpers import read_picture

    before, out = scene.render.engine, folder / "eevee.exr"
    scene.render.engine = engine()
    scene.eevee.taa_render_samples = samples
    scene.render.filepath = str(out)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "eevee.blend"))
    scene.render.engine = before
    if missing := picture_of(folder / "eevee.blend", out):
        pytest.skip(missing)
    return read_picture(out)[..., :3]


def main():
    import bpy
    import numpy as np
    from helpers import add_camera, add_world
    from helpers import render as by_engine

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = engine()
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.eevee.taa_render_samples = 1
    add_camera(scene)
    add_world(scene)
    picture = by_engine(scene)
    if not np.allclose(picture[..., :3], 1, atol=0.01):
        raise SystemExit(f"a white world is {picture.reshape(-1, 4).mean(0)}")
    print(STARTED, flush=True)
    bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
