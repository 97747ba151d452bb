# SPDX-License-Identifier: GPL-3.0-or-later
"""The device that a scene renders on, and whether Open Shading Language runs there."""

import bpy

from . import pack

#: Devices other than the CPU that can run OSL.
OSL_DEVICES = {"OPTIX"}


def gpu_backend():
    """Compute device type in the preferences: NONE, CUDA, OPTIX, HIP, METAL or ONEAPI."""
    addon = bpy.context.preferences.addons.get("cycles")
    return addon.preferences.compute_device_type if addon else "NONE"


def without_osl(scene):
    """Name of the compute device if the scene renders on one that can't run OSL, else None."""
    backend = gpu_backend()
    if scene.cycles.device != "GPU" or backend == "NONE" or backend in OSL_DEVICES:
        return None
    return backend


def of_elsewhere(scene):
    """Whether a scene that asks for a GPU renders on the CPU only because these preferences have
    none. The preferences are not part of the file: another computer may render it on a GPU."""
    return scene.cycles.device == "GPU" and gpu_backend() == "NONE"


def runs_on_optix(scene):
    """Whether a scene's shaders run on a GPU, where the memory for closures is limited."""
    cycles = scene.cycles
    on_gpu = scene.render.engine == "CYCLES" and cycles.device == "GPU"
    return on_gpu and cycles.shading_system and gpu_backend() in OSL_DEVICES


def lacks_osl(scene):
    """Whether Cycles renders a scene without Open Shading Language. A Blender that was built
    without OSL lacks it under every engine."""
    if not pack.osl_available():
        return True
    if scene is None or scene.render.engine != "CYCLES":
        return False
    return not scene.cycles.shading_system or without_osl(scene) is not None


def is_eevee(scene):
    """Whether a scene renders with EEVEE, whose identifier differs between versions."""
    return scene.render.engine.startswith("BLENDER_EEVEE")
