# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendered pictures as arrays. Needs OpenImageIO."""

import OpenImageIO as oiio


def read_rgb(path):
    """R, G and B of a picture (height, width, 3), linear as an EXR has them, whatever the name of
    its layer and whether or not there is one of the variance. Raises OSError naming the file."""
    picture = oiio.ImageBuf(str(path))
    pixels = picture.get_pixels(oiio.FLOAT)
    if picture.has_error or pixels is None:
        raise OSError(f"{path}: {picture.geterror()}")
    names = list(picture.spec().channelnames)
    layer = next((n[:-1] for n in names if n.endswith("R") and not n.startswith("variance")), "")
    return pixels[..., [names.index(f"{layer}{c}") for c in "RGB"]]
