# SPDX-License-Identifier: GPL-3.0-or-later
"""The smallest and the largest value that may reach a socket.

Inputs of a node are taken to vary independently, so that bounds may be too wide, but are never too
narrow."""

import itertools

import numpy as np

from . import image_range, shader_trees
from .math_operations import MATH, Bounds, Unknown, at_ends, gamma_bounds, hull, stored
from .shader_values import RAMP_SIZE, Constants, arriving, ramp_entries

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


def bounds(socket, within=()):
    """(low, high) of an input socket: numbers or (r, g, b), then of each channel. None if they are
    unknown, as those of an attribute, or if the value is animated. `within`: as for
    shader_trees.reach()."""
    try:
        low, high = _Finder().of(socket, within)
    except Unknown:
        return None
    if not np.isfinite([low, high]).all():
        return None
    return tuple(
        tuple(float(v) for v in end) if np.ndim(end) else float(end) for end in (low, high)
    )


def _joined(bounds):
    """The bounds of what lies within any of these."""
    return hull([end for pair in bounds for end in pair])


class _Finder:
    """Values are Bounds."""

    def __init__(self):
        self._constants = Constants(images=True)

    def of(self, socket, within):
        reached = shader_trees.reach(socket, within)
        if reached.output is None:
            value = self._constants.of(socket, within)
            return Bounds(value, value)
        ends = (stored(end) for end in self._output(reached))
        return Bounds(*(arriving(end, reached, socket) for end in ends))

    def _output(self, reached):
        node, output = reached.node, reached.output
        kind = node.bl_idname.removeprefix("ShaderNode")
        if self._constants.has_animated_settings(node):
            raise Unknown
        if kind in _FROM_0_TO_1 and output.name in (_FROM_0_TO_1[kind] or {output.name}):
            # Noise of other types, or without Normalize, has no bounds.
            if not getattr(node, "normalize", True) or getattr(node, "noise_type", "FBM") != "FBM":
                raise Unknown
            return Bounds(0.0, 1.0)
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
        return hull(found)

    def _math(self, reached, of):
        node, operation = reached.node, MATH.get(reached.node.operation)
        try:
            if operation is None or operation.own_bounds is None:
                return self._at_ends(reached, of)
            found = operation.bounds(*map(of, node.inputs[: operation.count]))
            return Bounds(*np.clip(found, 0.0, 1.0)) if node.use_clamp else found
        except Unknown:
            if not node.use_clamp:
                raise
            return Bounds(0.0, 1.0)

    def _maprange(self, reached, of):
        node = reached.node
        if node.data_type != "FLOAT" or not node.clamp:
            raise Unknown
        return _joined(of(node.inputs[name]) for name in ("To Min", "To Max"))

    def _huesaturation(self, reached, of):
        inputs = {"Factor" if s.name == "Fac" else s.name: s for s in reached.node.inputs}
        strength, factor, given = (of(inputs[name]) for name in ("Value", "Factor", "Color"))
        brightest = np.max(given.low), np.max(given.high)
        # Channels of the new colour lie between 0 and its brightest.
        turned = hull([0.0, *at_ends(lambda a, b: a * b, brightest, strength)])
        found = at_ends(lambda t, a, b: a + t * (b - a), factor, given, turned)
        return Bounds(*(np.maximum(end, 0.0) for end in found))

    def _gamma(self, reached, of):
        given, exponent = (of(s) for s in reached.node.inputs)
        channels = [gamma_bounds(ends, exponent) for ends in zip(*given, strict=True)]
        return Bounds(*np.transpose(channels))

    def _texchecker(self, reached, of):
        return _joined(of(reached.node.inputs[name]) for name in ("Color1", "Color2"))

    def _texbrick(self, reached, of):
        return _joined(of(reached.node.inputs[name]) for name in ("Color1", "Color2", "Mortar"))

    def _valtorgb(self, reached, of):
        ends = np.clip(of(reached.node.inputs[0]), 0.0, 1.0)
        if ends[0] == ends[1]:
            return self._at_ends(reached, of)
        colors = ramp_entries(reached.node.color_ramp, *(ends * (RAMP_SIZE - 1)))
        channels = 3 if reached.output.name == "Alpha" else slice(3)
        return hull(colors[:, channels])

    def _teximage(self, reached, of):
        found = image_range.of(reached.node.image)
        if found is None:
            raise Unknown
        channels = slice(3) if reached.output.name == "Color" else 3
        low = found.low[channels]
        if reached.node.extension == "CLIP":  # black beside the image
            low = np.minimum(low, 0.0)
        return Bounds(low, found.high[channels])
