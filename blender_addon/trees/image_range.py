# SPDX-License-Identifier: GPL-3.0-or-later
"""Minimum, maximum and means of the images in textures."""

import os
from dataclasses import dataclass

import bpy
import numpy as np

from ..common import color

#: Approximate number of pixels of which a mean is taken.
_SAMPLES = 1 << 16


@dataclass(frozen=True)
class Range:
    """Of red, green and blue, linear in the working space, and of alpha: (4,) each."""

    low: np.ndarray
    high: np.ndarray
    mean: np.ndarray
    #: The means of the darkest and of the brightest tenth of the pixels.
    dark: np.ndarray
    bright: np.ndarray


#: Cached by image: reading a large one takes half a second.
_known = {}


def of(image):
    """Range of an image; None if there is no image, or if it can't be determined: for movies,
    sequences, tiled images, and colour spaces other than sRGB and data."""
    if image is None or image.source not in {"FILE", "GENERATED"}:
        return None
    key = (image.session_uid, image.source, image.alpha_mode, image.colorspace_settings.name)
    key += (_version(image),)
    if image.is_dirty or key not in _known:  # painting raises no event
        _known[key] = _read(image)
    return _known[key]


def _version(image):
    """A key that changes with the file of an image."""
    if image.packed_file is not None:
        return image.packed_file.size
    path = bpy.path.abspath(image.filepath, library=image.library)
    try:
        return path, os.stat(path).st_mtime_ns
    except OSError:
        return path


def _read(image):
    loaded = image.has_data
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    if len(pixels) == 0 or len(pixels) != len(image.pixels):
        return None
    image.pixels.foreach_get(pixels)
    is_float, channels = image.is_float, image.channels
    if not loaded and image.source == "FILE":
        image.buffers_free()
    return _range(image, pixels.reshape(-1, channels), is_float)


def _range(image, pixels, is_float):
    step = max(len(pixels) // _SAMPLES, 1) | 1
    rows = np.concatenate([[pixels.min(0), pixels.max(0)], pixels[::step]]).astype(float)
    if rows.shape[1] < 3:
        rows = np.concatenate([rows[:, :1].repeat(3, 1), rows[:, 1:]], 1)
    rgb, alpha = rows[:, :3], rows[:, 3:]
    if rows.shape[1] < 4 or image.alpha_mode == "NONE":
        alpha = np.ones((len(rows), 1))
    settings = image.colorspace_settings
    if not is_float and not settings.is_data:  # float buffers are already in the working space
        if settings.name != "sRGB":
            return None
        rgb = color.from_rec709(color.from_srgb(rgb))
    rows = np.concatenate([rgb, alpha], 1)
    if not np.isfinite(rows).all():
        return None
    sampled = rows[2:]
    by_light = sampled[np.argsort(color.luminance(sampled[:, :3]), kind="stable")]
    tenth = max(len(by_light) // 10, 1)
    dark, bright = by_light[:tenth].mean(0), by_light[-tenth:].mean(0)
    return Range(rows[0], rows[1], sampled.mean(0), dark, bright)
