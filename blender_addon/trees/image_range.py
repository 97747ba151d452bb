# SPDX-License-Identifier: GPL-3.0-or-later
"""Minimum, maximum and means of the images in textures."""

from dataclasses import dataclass

import numpy as np

from ..common import color
from .image_pixels import OfImages

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


def of(image):
    """Range of an image; None if there is no image, or if it can't be determined: for movies,
    sequences, tiled images, and colour spaces other than sRGB and data."""
    if image is None or image.source not in {"FILE", "GENERATED"}:
        return None
    return _known.of(image)


def _range(image, pixels, is_float):
    pixels = pixels.reshape(-1, pixels.shape[-1])
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


_known = OfImages(_range)
