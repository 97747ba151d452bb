# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendered pictures as arrays. Needs OpenImageIO."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

REC709 = "lin_rec709_scene"
CONFIG = Path(__file__).resolve().parents[1] / "data" / "color" / "config.ocio"


def read_rgb(path):
    """R, G and B of a picture (height, width, 3), whatever the name of its layer and whether or not
    it also has a variance. The colours are those of the EXR, converted to linear Rec.709 if it
    states another space. Raises OSError naming the file."""
    picture = oiio.ImageBuf(str(path))
    pixels = picture.get_pixels(oiio.FLOAT)
    if picture.has_error or pixels is None:
        raise OSError(f"{path}: {picture.geterror()}")
    names = list(picture.spec().channelnames)
    layer = next((n[:-1] for n in names if n.endswith("R") and not n.startswith("variance")), "")
    pixels = pixels[..., [names.index(f"{layer}{c}") for c in "RGB"]]
    space = picture.spec().get_string_attribute("colorInteropID") or REC709
    if space == REC709:
        return pixels
    colors = oiio.ImageBuf(np.ascontiguousarray(pixels))
    colors = oiio.ImageBufAlgo.colorconvert(colors, space, REC709, colorconfig=str(CONFIG))
    if colors.has_error:
        raise OSError(f"{path}: {colors.geterror()}")
    return colors.get_pixels(oiio.FLOAT)
