# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene renders with: whether Open Shading Language runs there."""

import bpy

from . import pack

#: Devices other than the CPU whose kernels can run OSL.
OSL_DEVICES = {"OPTIX"}


def gpu_backend():
    """Compute device type of the preferences: NONE, CUDA, OPTIX, HIP, METAL, ONEAPI."""
    addon = bpy.context.preferences.addons.get("cycles")
    return addon.preferences.compute_device_type if addon else "NONE"


def without_osl(scene):
    """Name of the compute device if the scene renders on one that can't run OSL, or None."""
    backend = gpu_backend()
    if scene.cycles.device != "GPU" or backend == "NONE" or backend in OSL_DEVICES:
        return None
    return backend


def of_elsewhere(scene):
    """Whether a scene renders on the CPU for want of a GPU in the preferences, which its file does
    not hold: a computer that has one would take that."""
    return scene.cycles.device == "GPU" and gpu_backend() == "NONE"


def runs_on_optix(scene):
    """Whether a scene's shaders run on a GPU, where closures have a pool of limited size."""
    cycles = scene.cycles
    on_gpu = scene.render.engine == "CYCLES" and cycles.device == "GPU"
    return on_gpu and cycles.shading_system and gpu_backend() in OSL_DEVICES


def lacks_osl(scene):
    """Whether Cycles renders a scene without Open Shading Language; in a Blender that was built
    without it, whether any engine does."""
    if not pack.osl_available():
        return True
    if scene is None or scene.render.engine != "CYCLES":
        return False
    return not scene.cycles.shading_system or without_osl(scene) is not None


def is_eevee(scene):
    """Whether a scene renders with EEVEE, which has another name in each version."""
    return scene.render.engine.startswith("BLENDER_EEVEE")
