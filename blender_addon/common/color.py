# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour spaces of the open file, by Blender's own conversions.

The working space is the role scene_linear of Blender's OpenColorIO configuration; from Blender 5 on
a file can choose another. As Blender converts one colour at a time, matrices and the sRGB curve are
sampled from it and then applied to whole arrays.
"""

import functools

import bpy
import numpy as np
from mathutils import Color

#: Names of sRGB in Blender and in the configurations of ACES 1.3, 2.0 and earlier.
_SRGB = (
    "sRGB",
    "sRGB - Texture",
    "sRGB Encoded Rec.709 (sRGB)",
    "Utility - sRGB - Texture",
)

#: sRGB values at which the curve is sampled: all 8-bit values, and three between each two.
_ENCODED = np.linspace(0, 1, 4 * 255 + 1)


#: Matrices from the working spaces that scene files may name to linear Rec.709; white maps to
#: white.
_TO_REC709 = {
    "Linear Rec.709": np.eye(3),
    "Linear Rec.2020": np.array(
        [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]]
    ),
    "ACEScg": np.array(
        [[1.7051, -0.6218, -0.0833], [-0.1303, 1.1408, -0.0105], [-0.0240, -0.1290, 1.1530]]
    ),
}


def working_space():
    """The name of the working space."""
    if hasattr(bpy.data, "colorspace"):
        return bpy.data.colorspace.working_space
    # Before 5.0 the space has no name: it is recognized by its matrix.
    own = _matrix("from_scene_linear_to_rec709_linear", None)
    for name, known in _TO_REC709.items():
        if np.allclose(own, known, atol=2e-3):
            return name
    return "scene_linear of the OpenColorIO configuration"


def set_srgb(image):
    """Marks an image as sRGB, by the name that the OpenColorIO configuration uses.

    Raises ValueError with the list of its spaces if it has none."""
    settings = image.colorspace_settings
    known = settings.bl_rna.properties["name"].enum_items.keys()
    for name in _SRGB:
        if name in known:
            settings.name = name
            return
    raise ValueError(f"the OpenColorIO configuration has no sRGB under a known name: {known}")


def set_view(settings, name):
    """Selects a view transform by name; the default stays if the display has no such view."""
    try:
        settings.view_transform = name
    except TypeError:  # the views depend on the display, not on the class
        pass


def set_working_space(name):
    """Makes a space the working space of the open file; existing content keeps its look.

    Raises ValueError with the list of names, or with the Blender version that offers a choice."""
    if working_space() in (name, f"{name} (sRGB)"):
        return
    if not hasattr(bpy.data, "colorspace"):
        raise ValueError(
            f"expected {working_space()!r}, the working space of Blender {bpy.app.version_string}: "
            f"{name!r} needs Blender 5.0 or later"
        )
    known = bpy.data.colorspace.bl_rna.properties["working_space"].enum_items.keys()
    if f"{name} (sRGB)" in known:  # the name of Rec.709 in ACES configurations
        name = f"{name} (sRGB)"
    if name not in known:
        raise ValueError(f"expected one of {', '.join(known)}, got {name!r}")
    bpy.ops.wm.set_working_color_space(working_space=name, convert_colors=True)


@functools.lru_cache(maxsize=8)
def _matrix(conversion, _space):
    """Matrix (3, 3) of one of Blender's linear conversions, on colours of the working space."""
    return np.array([getattr(Color(axis), conversion)() for axis in np.eye(3)]).T


def _converted(colors, conversion):
    colors = np.asarray(colors)
    kind = colors.dtype if colors.dtype.kind == "f" else float
    return colors.astype(kind) @ _matrix(conversion, working_space()).T.astype(kind)


@functools.cache
def _decoded():
    """_ENCODED in linear light. It is sampled with greys, which are equal in all working spaces."""
    return np.array([Color((v, v, v)).from_srgb_to_scene_linear()[1] for v in _ENCODED])


def to_xyz(rgb):
    """CIE XYZ with white D65, from linear colours (..., 3) of the working space."""
    return _converted(np.asarray(rgb, float), "from_scene_linear_to_xyz_d65")


def from_xyz(xyz):
    """Linear colours of the working space from X, Y, Z (..., 3), relative to a perfect reflector,
    which is 1, 1, 1."""
    absolute = np.asarray(xyz, float) * to_xyz([1, 1, 1])
    return absolute @ np.linalg.inv(_matrix("from_scene_linear_to_xyz_d65", working_space())).T


def luminance(rgb):
    """Luminance Y (white is 1) of linear colours (..., 3) of the working space, in their
    precision."""
    return _converted(rgb, "from_scene_linear_to_xyz_d65")[..., 1]


def from_srgb(colors):
    """Linearizes sRGB colours (..., 3) in [0, 1]; the primaries stay those of sRGB."""
    return np.interp(colors, _ENCODED, _decoded())


def from_rec709(rgb):
    """Converts linear colours with the primaries of sRGB to the working space, (..., 3)."""
    return _converted(rgb, "from_rec709_linear_to_scene_linear")


def to_screen(rgb):
    """Converts linear colours (..., 3) of the working space to sRGB, clamped to [0, 1]."""
    return np.interp(_converted(rgb, "from_scene_linear_to_rec709_linear"), _decoded(), _ENCODED)
