# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates the nodes of a twin on NumPy arrays, to find what its group scatters.

Only nodes that twin.py and closure_nodes.py use are supported; a file may contain others.
"""

import numpy as np

from ..trees import shader_trees
from . import shader_text
from .shader_text import Lobes, Unreadable

_MATH = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "DIVIDE": np.divide,
    "MULTIPLY_ADD": lambda x, y, z: x * y + z,
    "EXPONENT": np.exp,
    "SQRT": np.sqrt,
    "LOGARITHM": lambda x, base: np.log(x) / np.log(base),
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
    "LESS_THAN": lambda x, y: np.where(x < y, 1.0, 0.0),
}
_VECTORS = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "DIVIDE": np.divide,
    "MULTIPLY_ADD": lambda x, y, z: x * y + z,
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
    "SCALE": np.multiply,
    "DOT_PRODUCT": lambda x, y: (x * y).sum(0),
    "CROSS_PRODUCT": lambda x, y: np.cross(x, y, axis=0),
    "LENGTH": lambda x: np.sqrt((x * x).sum(0)),
    "NORMALIZE": lambda x: x / np.sqrt((x * x).sum(0)),
}
_DISTRIBUTIONS = {"GGX": "ggx", "BECKMANN": "beckmann"}


#: Resolution of the table by which Blender evaluates a curve.
_CURVE_STEPS = 256


def _pixels(image):
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4)


def _between(rows, at):
    """Interpolates rows linearly. `at`, from 0 to 1, spans all rows; samples lie at the rows'
    centres, and the ends are extended."""
    last = len(rows) - 1
    at = np.clip(at * len(rows) - 0.5, 0, last)
    below = np.asarray(at, int)
    low, high = rows[below], rows[np.minimum(below + 1, last)]
    return low + (high - low) * (at - below).reshape(at.shape + (1,) * (low.ndim - at.ndim))


class _Execution:
    """Evaluates a group for viewers (3, k, 1), each socket once. `given`: values of the group's
    inputs by identifier. Vectors have their components first; the value of a shader is Lobes."""

    def __init__(self, group, given, wo):
        self._nodes, self._given, self._wo = group.nodes, given, wo
        self._pictures, self._groups = {}, {}
        # NodeSocket.links searches all links of the tree, so a dictionary is built once.
        self._sources = {
            link.to_socket.as_pointer(): link.from_socket
            for link in group.links
            if shader_trees.counts(link)
        }
        self._known = {}

    def value(self, socket):
        """The value of an input socket."""
        source = self._sources.get(socket.as_pointer())
        if source is None:
            return _constant(socket.default_value)
        key = source.as_pointer()
        if key not in self._known:
            self._known[key] = self._output(source.node, source)
        return self._known[key]

    def _output(self, node, socket):
        kind = node.bl_idname.removeprefix("ShaderNode")
        compute = getattr(self, f"_{kind.lower()}", None)
        if compute is None or node.mute:
            raise Unreadable(f"unexpected {'muted ' if node.mute else ''}node {kind}")
        return compute(node, socket)

    def _nodegroupinput(self, node, socket):
        return self._given[socket.identifier]

    def _group(self, node, socket):
        key = node.as_pointer()
        if key not in self._groups:
            given = {s.identifier: self.value(s) for s in node.inputs}
            self._groups[key] = _Execution(node.node_tree, given, self._wo)
        return self._groups[key].output(socket.name)

    def output(self, name):
        """The value of an output of the group."""
        (end,) = (node for node in self._nodes if node.bl_idname == "NodeGroupOutput")
        return self.value(end.inputs[name])

    def _nodereroute(self, node, socket):
        return self.value(node.inputs[0])

    def _newgeometry(self, node, socket):
        return {"Incoming": self._wo, "Normal": _constant((0.0, 0.0, 1.0))}[socket.name]

    def _math(self, node, socket):
        return _MATH[node.operation](*(self.value(s) for s in node.inputs if s.enabled))

    def _vectormath(self, node, socket):
        return _VECTORS[node.operation](*(self.value(s) for s in node.inputs if s.enabled))

    def _combinexyz(self, node, socket):
        return shader_text.vector(*(self.value(s) for s in node.inputs))

    def _separatexyz(self, node, socket):
        return self.value(node.inputs[0])["XYZ".index(socket.name)]

    def _mix(self, node, socket):
        factor, at_0, at_1 = (self.value(s) for s in node.inputs if s.enabled)
        return at_0 * (1 - factor) + at_1 * factor

    def _separatecolor(self, node, socket):
        return self.value(node.inputs["Color"])[("Red", "Green", "Blue").index(socket.name)]

    def _floatcurve(self, node, socket):
        mapping = node.mapping
        mapping.initialize()  # needed for a file that was just opened
        places = np.linspace(0, 1, _CURVE_STEPS + 1)
        heights = [mapping.evaluate(mapping.curves[0], float(x)) for x in places]
        return np.interp(self.value(node.inputs["Value"]), places, heights)

    def _teximage(self, node, socket):
        u, v, _ = self.value(node.inputs["Vector"])
        name = node.image.name_full
        if name not in self._pictures:
            self._pictures[name] = _pixels(node.image)
        if np.ptp(v) > 0:
            raise Unreadable("expected one row of an image")
        return np.moveaxis(_between(_between(self._pictures[name], v[0, :1])[0], u), -1, 0)

    def _addshader(self, node, socket):
        return self.value(node.inputs[0]) + self.value(node.inputs[1])

    def _coloured(self, node, name, *given):
        return self.value(node.inputs["Color"]) * Lobes.of(self._wo, name, *given)

    def _bsdfdiffuse(self, node, socket):
        return self._coloured(node, "diffuse", self.value(node.inputs["Normal"]))

    def _bsdfanisotropic(self, node, socket):
        normal = self.value(node.inputs["Normal"])
        width = self.value(node.inputs["Roughness"]) ** 2
        if not np.any(width):
            return self._coloured(node, "reflection", normal)
        kind = _DISTRIBUTIONS[node.distribution]
        return self._coloured(node, "microfacet", kind, normal, (0, 0, 0), width, width)


def _constant(value):
    """Converts a number, a vector or a colour."""
    return np.reshape(value[:3], (3, 1, 1)) if hasattr(value, "__len__") else value


def lobes(group, given, wo):
    """Lobes of a group's BSDF for viewers (k, 3), unit vectors above the surface. `given`: numbers
    and colours by the identifiers of the group's inputs. This function and the Lobes it returns
    raise Unreadable."""
    try:
        given = {identifier: _constant(value) for identifier, value in given.items()}
        found = _Execution(group, given, np.transpose(wo)[:, :, None]).output("BSDF")
    except shader_text.FAILURES as error:
        raise Unreadable(str(error)) from error
    if not isinstance(found, Lobes):
        raise Unreadable("expected a group whose BSDF is a sum of closures")
    return found
