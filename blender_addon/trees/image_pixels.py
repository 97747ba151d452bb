# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of images, and what is computed of them once, until an image changes."""

import os
import zlib

import bpy
import numpy as np


class OfImages:
    """Results of compute(image, pixels, is_float), by image: a large one takes half a second.
    `pixels`: (height, width, channels), as read() returns them."""

    def __init__(self, compute):
        self._compute, self._known = compute, {}

    def of(self, image):
        """The result for an image as it is now; None if it has no pixels."""
        key, pixels = _key(image), None
        if image.is_dirty:  # painting raises no event
            pixels = _read(image)
            key += (None if pixels is None else zlib.adler32(pixels[0]),)
        if key not in self._known:
            pixels = pixels or _read(image)
            self._known[key] = None if pixels is None else self._compute(image, *pixels)
        return self._known[key]

    def forget(self):
        """Clears the results, so that images are read anew."""
        self._known.clear()


def _key(image):
    """Changes with the file of an image and with the settings that its pixels depend on. Asks for
    nothing that loads the pixels, as `size` does."""
    settings = image.source, image.alpha_mode, image.colorspace_settings.name
    return image.session_uid, *settings, _version(image)


def _version(image):
    if image.source == "GENERATED":
        size = image.generated_width, image.generated_height
        return *size, image.generated_type, tuple(image.generated_color), image.use_generated_float
    if image.packed_file is not None:
        return image.packed_file.size
    return _path(image), _saved_at(image)


def _path(image):
    return bpy.path.abspath(image.filepath, library=image.library)


def _saved_at(image):
    """When the file of an image was changed; None if there is none."""
    try:
        return os.stat(_path(image)).st_mtime_ns
    except OSError:
        return None


def _read(image):
    """The pixels, and whether Blender stores them as floats, in the working space; None if there
    are none, or if they are not those of one image. Leaves no pixels in memory that weren't."""
    loaded, is_file = image.has_data, image.source == "FILE"
    if loaded and is_file and not image.is_dirty and image.packed_file is None:
        if _saved_at(image) is not None:
            image.buffers_free()  # Cycles reads the file, which may be newer
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    if len(pixels) == 0 or len(pixels) != len(image.pixels):
        return None
    image.pixels.foreach_get(pixels)
    found = pixels.reshape(height, width, image.channels), image.is_float
    if not loaded and is_file:
        image.buffers_free()
    return found
