# SPDX-License-Identifier: GPL-3.0-or-later
"""The smallest and the largest value that may reach a socket.

Inputs of a node are taken to vary independently, so that bounds may be too wide, but are never too
narrow."""

import itertools

import numpy as np

from . import image_range, shader_trees
from .shader_values import Constants, Unknown, as_type

#: Outputs that lie between 0 and 1, by node; None: all of its outputs.
_FROM_0_TO_1 = {
    "AmbientOcclusion": {"AO"},
    "Fresnel": None,
    "LayerWeight": None,
    "NewGeometry": {"Backfacing", "Pointiness", "Random Per Island"},
    "ObjectInfo": {"Random"},
    "TexBrick": {"Fac", "Factor"},
    "TexChecker": {"Fac", "Factor"},
    "TexGradient": None,
    "TexNoise": None,
    "TexVoronoi": {"Color"},
    "TexWave": None,
    "TexWhiteNoise": None,
}
#: A colour ramp is evaluated at this many places.
_RAMP = 257


def bounds(socket, within=()):
    """(low, high) of an input socket: numbers or (r, g, b), then of each channel. None if they are
    unknown, as those of an attribute, or if the value is animated. `within`: as for
    shader_trees.reach()."""
    try:
        low, high = _Bounds().of(socket, within)
    except Unknown:
        return None
    if not np.isfinite([low, high]).all():
        return None
    return tuple(
        tuple(float(v) for v in end) if np.ndim(end) else float(end) for end in (low, high)
    )


def _union(pairs):
    lows, highs = (np.broadcast_arrays(*ends) for ends in zip(*pairs, strict=True))
    return np.minimum.reduce(lows), np.maximum.reduce(highs)


class _Bounds:
    """Values are pairs of the smallest and the largest."""

    def __init__(self):
        self._constants = Constants(images=True)

    def of(self, socket, within):
        reached = shader_trees.reach(socket, within)
        if reached.output is None:
            value = self._constants.of(socket, within)
            return value, value
        return tuple(as_type(end, socket) for end in self._output(reached))

    def _output(self, reached):
        node, output = reached.node, reached.output
        kind = node.bl_idname.removeprefix("ShaderNode")
        if self._constants.has_animated_settings(node):
            raise Unknown
        if kind in _FROM_0_TO_1 and output.name in (_FROM_0_TO_1[kind] or {output.name}):
            # Noise of other types, or without Normalize, has no bounds.
            if not getattr(node, "normalize", True) or getattr(node, "noise_type", "FBM") != "FBM":
                raise Unknown
            return 0.0, 1.0
        known = {}

        def of(socket):
            if socket not in known:
                known[socket] = self.of(socket, reached.within)
            return known[socket]

        compute = getattr(self, f"_{kind.lower()}", None) or self._at_ends
        return compute(reached, of)

    def _at_ends(self, reached, of):
        """The bounds of a node that is monotonic in each of its inputs: extremes are at ends of
        theirs."""
        ends = {}
        for socket in reached.node.inputs:
            try:
                ends[socket] = of(socket)
            except Unknown:
                continue
        varying = [s for s, (low, high) in ends.items() if not np.array_equal(low, high)]
        found = []
        for which in itertools.product((0, 1), repeat=len(varying)):
            here = {s: pair[0] for s, pair in ends.items()}
            here |= {s: ends[s][i] for s, i in zip(varying, which, strict=True)}

            def value(socket, here=here):
                if socket not in here:
                    raise Unknown
                return here[socket]

            found.append(self._constants.output(reached, value))
        return _union((value, value) for value in found)

    def _math(self, reached, of):
        node, within = reached.node, (0.0, 1.0)
        try:
            if node.operation == "DIVIDE":
                low, high = of(node.inputs[1])
                if low != high and low <= 0 <= high:
                    raise Unknown
            within = self._at_ends(reached, of)
        except Unknown:
            if not node.use_clamp:
                raise
        if node.operation == "ABSOLUTE" and np.prod(of(node.inputs[0])) < 0:
            within = 0.0, within[1]  # the smallest is between the ends
        return within

    def _maprange(self, reached, of):
        node = reached.node
        if node.data_type != "FLOAT" or not node.clamp:
            raise Unknown
        return _union(of(node.inputs[name]) for name in ("To Min", "To Max"))

    def _huesaturation(self, reached, of):
        strength, given = (of(reached.node.inputs[name]) for name in ("Value", "Color"))
        brightest = np.max(given[1])
        return 0.0, max(brightest, brightest * strength[1], 0.0)

    def _gamma(self, reached, of):
        given, power = (of(s) for s in reached.node.inputs)
        ends = itertools.product(given, power)
        return _union((v, v) for v in (np.maximum(a, 0.0) ** b for a, b in ends))

    def _texchecker(self, reached, of):
        return _union(of(reached.node.inputs[name]) for name in ("Color1", "Color2"))

    def _texbrick(self, reached, of):
        return _union(of(reached.node.inputs[name]) for name in ("Color1", "Color2", "Mortar"))

    def _valtorgb(self, reached, of):
        ramp, (low, high) = reached.node.color_ramp, of(reached.node.inputs[0])
        places = {float(p) for p in np.linspace(low, high, _RAMP)}
        places |= {e.position for e in ramp.elements if low <= e.position <= high}
        colors = np.array([ramp.evaluate(p) for p in places])
        channels = 3 if reached.output.name == "Alpha" else slice(3)
        return colors[:, channels].min(0), colors[:, channels].max(0)

    def _teximage(self, reached, of):
        found = image_range.of(reached.node.image)
        if found is None:
            raise Unknown
        channels = slice(3) if reached.output.name == "Color" else 3
        low = found.low[channels]
        if reached.node.extension == "CLIP":  # black beside the image
            low = np.minimum(low, 0.0)
        return low, found.high[channels]
