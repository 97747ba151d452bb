# SPDX-License-Identifier: GPL-3.0-or-later
"""The device that a scene renders on, and whether Open Shading Language runs there."""

import bpy

from . import pack

#: The devices other than the CPU on which Blender can run OSL. Shaders of this extension are
#: untested there, so materials use Formula Nodes as on other GPUs.
OSL_DEVICES = {"OPTIX"}


def gpu_backend():
    """Compute device type in the preferences: NONE, CUDA, OPTIX, HIP, METAL or ONEAPI."""
    addon = bpy.context.preferences.addons.get("cycles")
    return addon.preferences.compute_device_type if addon else "NONE"


def gpu(scene):
    """The compute device type if Cycles renders a scene on a GPU, else None."""
    backend = gpu_backend()
    return backend if scene.cycles.device == "GPU" and backend != "NONE" else None


def of_elsewhere(scene):
    """Whether a scene that asks for a GPU renders on the CPU only because these preferences have
    none. The preferences are not part of the file: another computer may render it on a GPU."""
    return scene.cycles.device == "GPU" and gpu_backend() == "NONE"


def lacks_osl(scene):
    """Whether Cycles would render a scene without Open Shading Language, or on a GPU, also if
    another engine is selected, as in a new file: a material may be linked into a file that selects
    Cycles. A Blender that was built without OSL lacks it in every scene."""
    if not pack.osl_available():
        return True
    return scene is not None and (not scene.cycles.shading_system or gpu(scene) is not None)


def is_eevee(scene):
    """Whether a scene renders with EEVEE, whose identifier differs between versions."""
    return scene.render.engine.startswith("BLENDER_EEVEE")
