# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of the open file, by Blender's own conversions.

The working space is the scene_linear of Blender's OpenColorIO configuration, or from Blender 5 on
what the file chose. Blender converts one colour at a time; matrices and the curve of sRGB are made
of that for many.
"""

import functools

import bpy
import numpy as np
from mathutils import Color

#: What sRGB is called by Blender, and by the configurations of ACES 1.3, 2.0 and before.
_SRGB = (
    "sRGB",
    "sRGB - Texture",
    "sRGB Encoded Rec.709 (sRGB)",
    "Utility - sRGB - Texture",
)

#: Values of sRGB at which its curve is taken: those of eight bits, and three between any two.
_ENCODED = np.linspace(0, 1, 4 * 255 + 1)


#: Linear Rec.709 of the linear colours of each working space that scene files may name; white stays
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
    # Before 5.0 there is no name, but the matrices that Blender makes of the configuration.
    own = _matrix("from_scene_linear_to_rec709_linear", None)
    for name, known in _TO_REC709.items():
        if np.allclose(own, known, atol=2e-3):
            return name
    return "scene_linear of the OpenColorIO configuration"


def set_srgb(image):
    """Has an image read as sRGB, by the name that the OpenColorIO configuration has for it.
    ValueError that lists its spaces if it has none."""
    settings = image.colorspace_settings
    known = settings.bl_rna.properties["name"].enum_items.keys()
    for name in _SRGB:
        if name in known:
            settings.name = name
            return
    raise ValueError(
        f"the OpenColorIO configuration has no sRGB under a name that is known here: {known}"
    )


def set_view(settings, name):
    """The view transform of that name; where the display has none, its default stays."""
    try:
        settings.view_transform = name
    except TypeError:  # names of views are not those of the class, but of the display
        pass


def set_working_space(name):
    """Makes a space of that name the working space of the open file. What is in it keeps its look.
    ValueError that lists the names, or says which Blender has a choice."""
    if working_space() in (name, f"{name} (sRGB)"):
        return
    if not hasattr(bpy.data, "colorspace"):
        raise ValueError(
            f"expected {working_space()!r}, the working space of Blender {bpy.app.version_string}: "
            f"{name!r} needs Blender 5.0 or later"
        )
    known = bpy.data.colorspace.bl_rna.properties["working_space"].enum_items.keys()
    if f"{name} (sRGB)" in known:  # as configurations of ACES call Rec.709
        name = f"{name} (sRGB)"
    if name not in known:
        raise ValueError(f"expected one of {', '.join(known)}, got {name!r}")
    bpy.ops.wm.set_working_color_space(working_space=name, convert_colors=True)


@functools.lru_cache(maxsize=8)
def _matrix(conversion, _space):
    """What a linear conversion of Blender's makes of the colours of the working space: (3, 3)."""
    return np.array([getattr(Color(axis), conversion)() for axis in np.eye(3)]).T


def _converted(colors, conversion):
    colors = np.asarray(colors)
    kind = colors.dtype if colors.dtype.kind == "f" else float
    return colors.astype(kind) @ _matrix(conversion, working_space()).T.astype(kind)


@functools.cache
def _decoded():
    """_ENCODED in linear light: of grey, which is the same in every working space."""
    return np.array([Color((v, v, v)).from_srgb_to_scene_linear()[1] for v in _ENCODED])


def to_xyz(rgb):
    """CIE XYZ, white D65, of linear colours (..., 3) of the working space."""
    return _converted(np.asarray(rgb, float), "from_scene_linear_to_xyz_d65")


def from_xyz(xyz):
    """Linear colours of the working space, of X, Y, Z (..., 3) over those of a perfect reflector,
    which becomes 1, 1, 1."""
    absolute = np.asarray(xyz, float) * to_xyz([1, 1, 1])
    return absolute @ np.linalg.inv(_matrix("from_scene_linear_to_xyz_d65", working_space())).T


def luminance(rgb):
    """Y of linear colours (..., 3) of the working space, 1 of white, in the precision of theirs."""
    return _converted(rgb, "from_scene_linear_to_xyz_d65")[..., 1]


def from_srgb(colors):
    """Colours (..., 3) of sRGB in [0, 1] in linear light, with the primaries of sRGB."""
    return np.interp(colors, _ENCODED, _decoded())


def from_rec709(rgb):
    """Linear colours (..., 3) of the working space, of linear ones with the primaries of sRGB."""
    return _converted(rgb, "from_rec709_linear_to_scene_linear")


def to_screen(rgb):
    """Linear colours (..., 3) of the working space as sRGB has them, in [0, 1]."""
    return np.interp(_converted(rgb, "from_scene_linear_to_rec709_linear"), _decoded(), _ENCODED)
