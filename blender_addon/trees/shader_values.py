# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the values of sockets where they are constant or their mean is known.

Supports the nodes that importers and artists usually place before a material's sockets; outputs of
all other nodes are unknown.
"""

import itertools
import math

import bpy
import numpy as np

from ..common import color
from . import animation, image_range, shader_trees
from .math_operations import BLENDS, MATH, Unknown, stored

#: Since 5.0, Blender itself computes nodes of constant inputs.
_FOLDED = bpy.app.version >= (5, 0, 0)
_WIDTH = {"RGBA": 3, "VECTOR": 3}


def constant(socket, within=()):
    """The value of an input socket wherever its node is shown: a number or (r, g, b). None if it
    varies over the surface, is animated, infinite or unknown, as for images. `within`: as for
    shader_trees.reach()."""
    return Constants().told(socket, within)


def current(socket, within=()):
    """The same at the current frame: animated values are the present ones."""
    return Current().told(socket, within)


def mean(socket, within=(), part="mean"):
    """The same, with images replaced by a mean of theirs: a field of image_range.Range."""
    return _Mean(part).told(socket, within)


def _plain(value):
    return tuple(float(v) for v in value) if np.ndim(value) else float(value)


def _converted(value, source, target):
    """A value as a link between sockets of these types converts it. Raises Unknown."""
    if target in _WIDTH:
        return value if np.ndim(value) else np.full(3, value, float)
    if source == target:
        return value
    if np.ndim(value):
        value = float(color.luminance(value) if source == "RGBA" else np.mean(value))
    if target == "INT":
        return float(int(value))
    if target != "VALUE":
        raise Unknown
    return value


def _along(value, types):
    """A value that passes sockets of these types. Raises Unknown."""
    for source, target in itertools.pairwise(types):
        value = _converted(value, source, target)
    return value


def arriving(value, reached, socket):
    """What arrives at a socket if what it has `reached` is this value. Raises Unknown."""
    own = (reached.output or reached.holder).type
    found = _along(value, (own, *reached.types, socket.type))
    if _FOLDED and reached.output and reached.types:
        # Which nodes Blender computes depends on its version.
        if not np.array_equal(found, _along(value, (own, socket.type))):
            raise Unknown
    return found


def _own(socket):
    """The value that an input or output holds."""
    value = getattr(socket, "default_value", None)
    if value is None or isinstance(value, str):
        raise Unknown
    return stored(value[:3] if hasattr(value, "__len__") else value)


def _named(sockets, *names):
    return next(s for s in sockets if s.enabled and s.name in names)


def _clip(value):
    return np.clip(value, 0, 1)


#: Cycles interpolates between this many colours of a ramp, at equal distances.
RAMP_SIZE = 257


def ramp_entries(ramp, low, high):
    """Those of the colours that Cycles interpolates between these places, counted in colours."""
    places = np.arange(math.floor(low), math.ceil(high) + 1) / (RAMP_SIZE - 1)
    return np.array([ramp.evaluate(place) for place in places])


class Constants:
    """constant() for several sockets; looks up a node's animation only once. `images`: whether
    images of a single colour count as constants, which requires reading them."""

    def __init__(self, images=False):
        self._animated, self._images = {}, images

    def told(self, socket, within=()):
        try:
            return _plain(self.of(socket, within))
        except Unknown:
            return None

    def of(self, socket, within):
        """The value of an input: an array (3,) or a number. Raises Unknown."""
        reached = shader_trees.reach(socket, within)
        if reached.output is not None:
            found = self.output(reached, lambda socket: self.of(socket, reached.within))
        elif reached.holder is None:
            return np.zeros(3) if socket.type in _WIDTH else 0.0
        else:
            found = self._own(reached.holder)
        return arriving(found, reached, socket)

    def _own(self, socket):
        if self._is_animated(socket.node, animation.value_key(socket)):
            raise Unknown
        return _own(socket)

    def _animated_properties(self, node):
        if node not in self._animated:
            self._animated[node] = animation.animated_properties(node)
        return self._animated[node]

    def _is_animated(self, node, what):
        return what in self._animated_properties(node)

    def output(self, reached, of):
        """The value of the output of a node that is `reached`, given those of the node's inputs:
        of(socket). Raises Unknown."""
        node, output = reached.node, reached.output
        kind = node.bl_idname.removeprefix("ShaderNode")
        compute = getattr(self, f"_{kind.lower()}", None)
        if compute is None:
            raise Unknown
        if self.has_animated_settings(node):
            raise Unknown
        return stored(compute(node, output, of))

    def has_animated_settings(self, node):
        return any(pointer == node.as_pointer() for pointer, _ in self._animated_properties(node))

    def _rgb(self, node, output, of):
        return self._own(output)

    _value = _rgb

    def _math(self, node, output, of):
        operation = MATH.get(node.operation)
        if operation is None:
            raise Unknown
        inputs = node.inputs[: operation.count]
        if node.operation == "MULTIPLY" and self._one_is_zero(inputs, of):
            return 0.0
        value = operation.value(*map(of, inputs))
        return _clip(value) if node.use_clamp else value

    @staticmethod
    def _one_is_zero(inputs, of):
        for socket in inputs:
            try:
                if of(socket) == 0:
                    return True
            except Unknown:
                continue
        return False

    def _mix(self, node, output, of):
        if node.data_type not in {"FLOAT", "RGBA"}:
            raise Unknown
        factor, a, b = (_named(node.inputs, name) for name in ("Factor", "A", "B"))
        if node.data_type == "FLOAT":  # the other settings are those of colours
            return self._mixed("MIX", factor, a, b, node.clamp_factor, False, of)
        blend, clamps = node.blend_type, (node.clamp_factor, node.clamp_result)
        return self._mixed(blend, factor, a, b, *clamps, of)

    def _mixrgb(self, node, output, of):
        factor, a, b = node.inputs
        return self._mixed(node.blend_type, factor, a, b, True, node.use_clamp, of)

    @staticmethod
    def _mixed(blend, factor, a, b, clamp_factor, clamp_result, of):
        if blend not in BLENDS:
            raise Unknown
        t = of(factor)
        t = _clip(t) if clamp_factor else t
        if t == 0:
            value = of(a)
        elif t == 1 and blend == "MIX":
            value = of(b)
        else:
            first = of(a)
            value = first + t * (BLENDS[blend](first, of(b)) - first)
        return _clip(value) if clamp_result else value

    def _clamp(self, node, output, of):
        value, low, high = (of(s) for s in node.inputs)
        if node.clamp_type == "RANGE" and low > high:
            low, high = high, low
        return min(max(value, low), high)

    def _invert(self, node, output, of):
        factor, value = (of(s) for s in node.inputs)
        return value + factor * (1 - 2 * value)

    def _rgbtobw(self, node, output, of):
        return float(color.luminance(of(node.inputs[0])))

    def _separatecolor(self, node, output, of):
        if node.mode != "RGB":
            raise Unknown
        return of(node.inputs[0])[list(node.outputs).index(output)]

    def _combinecolor(self, node, output, of):
        if node.mode != "RGB":
            raise Unknown
        return np.array([of(s) for s in node.inputs])

    def _separatexyz(self, node, output, of):
        return of(node.inputs[0])[list(node.outputs).index(output)]

    def _combinexyz(self, node, output, of):
        return np.array([of(s) for s in node.inputs])

    # Nodes of files before 5.0.
    _separatergb, _combinergb = _separatexyz, _combinexyz

    def _valtorgb(self, node, output, of):
        place = of(node.inputs[0])
        if _FOLDED:
            found = np.array(node.color_ramp.evaluate(place))
        else:
            place = _clip(place) * (RAMP_SIZE - 1)
            entries, step = ramp_entries(node.color_ramp, place, place), place - int(place)
            if node.color_ramp.interpolation == "CONSTANT":
                step = 0.0
            found = entries[0] + step * (entries[-1] - entries[0])
        return found[3] if output.name == "Alpha" else found[:3]

    def _teximage(self, node, output, of):
        found = image_range.of(node.image) if self._images else None
        if found is None:
            raise Unknown
        return self._of_image(node, found, slice(3) if output.name == "Color" else 3)

    def _of_image(self, node, found, channels):
        # Outside its borders, a clipped image is black.
        same = np.array_equal(found.low[channels], found.high[channels])
        if not same or node.extension == "CLIP":
            raise Unknown
        return found.low[channels]


class Current(Constants):
    """current() for several sockets."""

    def _is_animated(self, node, what):
        return False

    def has_animated_settings(self, node):
        return False


class _Mean(Constants):
    """Assumes that nodes treat a mean as they treat each pixel."""

    def __init__(self, part):
        super().__init__(images=True)
        self._part = part

    def _of_image(self, node, found, channels):
        return getattr(found, self._part)[channels]
