# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of the open file, by the OpenColorIO that Blender brings, with Blender's configuration.

The working space is its role scene_linear, which Blender 5 sets to the space that the file chose.
"""

import functools
import importlib

import bpy
import numpy as np

_INTERCHANGE = "aces_interchange"
_XYZ = "UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD"
_SCREEN = "DISPLAY - CIE-XYZ-D65_to_sRGB"


@functools.cache
def _open_color_io():
    try:
        return importlib.import_module("PyOpenColorIO")
    except ImportError:
        pass
    # Blender as a Python module does not look into its own folder of modules.
    import sys
    from importlib import machinery, util
    from pathlib import Path

    root = Path(bpy.utils.resource_path("LOCAL"))
    folders = [str(p) for p in root.glob("python/lib/python3.*/site-packages")]
    spec = machinery.PathFinder.find_spec("PyOpenColorIO", folders)
    if spec is None:
        raise ValueError("this Blender is built without OpenColorIO, which colours need")
    module = util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def _converted(colors, *steps):
    """Colours (..., 3) through conversions of the configuration: pairs of spaces or roles, or a
    builtin transform and whether it is inverted."""
    ocio = _open_color_io()
    config = ocio.GetCurrentConfig()
    pixels = np.array(colors, np.float32, order="C")
    flat = pixels.reshape(-1, 3)
    for first, second in steps:
        if isinstance(second, str):
            for name in (first, second):
                if config.getColorSpace(name) is None:
                    raise ValueError(
                        f"Blender's OpenColorIO configuration has no colour space or role {name!r}"
                    )
            processor = config.getProcessor(first, second)
        else:
            transform = ocio.BuiltinTransform(first)
            if second:
                transform.setDirection(ocio.TransformDirection.TRANSFORM_DIR_INVERSE)
            processor = config.getProcessor(transform)
        # The default takes powers to 1e-4 only.
        processor.getOptimizedCPUProcessor(ocio.OptimizationFlags.OPTIMIZATION_LOSSLESS).applyRGB(
            flat
        )
    return pixels


def working_space():
    """The name of the working space."""
    return _open_color_io().GetCurrentConfig().getColorSpace("scene_linear").getName()


def set_working_space(name):
    """Makes a space of that name the working space of the open file. What is in it keeps its look.
    ValueError that lists the names, or says which Blender has a choice."""
    if name == working_space():
        return
    if not hasattr(bpy.data, "colorspace"):
        raise ValueError(
            f"expected {working_space()!r}, the working space of Blender {bpy.app.version_string}: "
            f"{name!r} needs Blender 5.0 or later"
        )
    known = bpy.data.colorspace.bl_rna.properties["working_space"].enum_items.keys()
    if name not in known:
        raise ValueError(f"expected one of {', '.join(known)}, got {name!r}")
    bpy.ops.wm.set_working_color_space(working_space=name, convert_colors=True)


def to_xyz(rgb):
    """CIE XYZ, white D65, of linear colours (..., 3) of the working space."""
    return _converted(rgb, ("scene_linear", _INTERCHANGE), (_XYZ, False))


def from_xyz(xyz):
    """Linear colours of the working space, of X, Y, Z (..., 3) over those of a perfect reflector,
    which becomes 1, 1, 1. ValueError where Blender's configuration has no role that relates its
    spaces to what can be measured."""
    absolute = np.asarray(xyz) * to_xyz([1.0, 1.0, 1.0])
    return _converted(absolute, (_XYZ, True), (_INTERCHANGE, "scene_linear"))


@functools.lru_cache(maxsize=4)
def _luminance_weights(space):
    return to_xyz(np.eye(3))[:, 1]


def luminance(rgb):
    """Y of linear colours (..., 3) of the working space, 1 of white, in the precision of theirs."""
    rgb = np.asarray(rgb)
    return rgb @ _luminance_weights(working_space()).astype(rgb.dtype)


def to_scene_linear(colors, space):
    """Colours (..., 3) of a space of Blender's as the working space has them."""
    return _converted(colors, (space, "scene_linear"))


def to_screen(rgb):
    """Linear colours (..., 3) of the working space as sRGB has them, in [0, 1]."""
    steps = ("scene_linear", _INTERCHANGE), (_XYZ, False), (_SCREEN, False)
    return np.clip(_converted(rgb, *steps), 0, 1)
