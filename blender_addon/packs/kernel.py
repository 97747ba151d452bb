# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the kernel of the model `lossless` from a curve."""

from ..common.i18n import Sentence, say
from . import pack

#: The model with an editable kernel, and its heights at equidistant u, the last at u = 3.
MODEL = "lossless"
_HEIGHTS = ("h0", "h1", "h2", "h3")


def heights(curve):
    """The parameters of MODEL from a Float Curve: its heights, relative to the largest.

    Raises ValueError for another node, and where a height is not positive or too small beside the
    largest.
    """
    if curve.bl_idname != "ShaderNodeFloatCurve":
        raise ValueError(
            say(
                "Node {node!r}: expected a Float Curve, got {kind}",
                node=curve.name,
                kind=Sentence(curve.bl_label),
            )
        )
    mapping = curve.mapping
    mapping.initialize()  # a new curve can't be evaluated before this
    places = [i / (len(_HEIGHTS) - 1) for i in range(len(_HEIGHTS))]
    found = [mapping.evaluate(mapping.curves[0], x) for x in places]
    lowest = pack.model(MODEL).parameters.get("h0", {"min": 0})["min"]
    for x, height in zip(places, found, strict=True):
        where = {"curve": curve.name, "x": f"{x:.3g}"}
        if not height > 0:
            raise ValueError(
                say(
                    "Curve {curve!r} at x = {x}: expected a height above 0, got {height}",
                    **where,
                    height=f"{height:.3g}",
                )
            )
        if height < lowest * max(found):
            raise ValueError(
                say(
                    "Curve {curve!r} at x = {x}: expected at least {lowest} of the largest "
                    "height, got {height} of it",
                    **where,
                    lowest=f"{lowest:g}",
                    height=f"{height / max(found):.3g}",
                )
            )
    relative = (height / max(found) for height in found)
    return dict(zip(_HEIGHTS, relative, strict=True))
