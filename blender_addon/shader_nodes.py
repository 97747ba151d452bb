# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes of a twin, executed on NumPy arrays: what its group scatters for one view.

It knows the nodes that twin.py wires; a file may hold others.
"""

import numpy as np

from . import shader_text
from .shader_text import Unreadable

_MATH = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "MULTIPLY_ADD": lambda x, y, z: x * y + z,
    "LOGARITHM": lambda x, base: np.log(x) / np.log(base),
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
    "LESS_THAN": lambda x, y: float(x < y),
}
_VECTORS = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "SCALE": np.multiply,
    "DOT_PRODUCT": np.dot,
    "CROSS_PRODUCT": np.cross,
    "LENGTH": np.linalg.norm,
    "NORMALIZE": lambda x: x / np.linalg.norm(x),
}
_DISTRIBUTIONS = {"GGX": "ggx", "BECKMANN": "beckmann"}


def _texel(image, at):
    """RGBA of an image at (u, v, ...), linear between the middles of pixels; the edge goes on."""
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    x, y = (np.clip(c * n - 0.5, 0, n - 1) for c, n in zip(at[:2], (width, height), strict=True))
    columns = np.minimum([int(x), int(x) + 1], width - 1)
    rows = np.minimum([int(y), int(y) + 1], height - 1)
    near = pixels.reshape(height, width, 4)[np.ix_(rows, columns)]
    across = near[:, 0] + (near[:, 1] - near[:, 0]) * (x - int(x))
    return across[0] + (across[1] - across[0]) * (y - int(y))


class _Execution:
    """Of a group for one view; sockets are computed once. `given`: values of the group's inputs by
    identifier."""

    def __init__(self, group, given, wi, wo):
        self._given, self._wi, self._wo = given, wi, wo
        # A socket's own list of links is a search through those of the tree.
        self._sources = {link.to_socket.as_pointer(): link.from_socket for link in group.links}
        self._known = {}

    def value(self, socket):
        """Of an input."""
        source = self._sources.get(socket.as_pointer())
        if source is None:
            value = socket.default_value
            return np.array(value)[:3] if hasattr(value, "__len__") else value
        key = source.as_pointer()
        if key not in self._known:
            self._known[key] = self._output(source.node, source)
        return self._known[key]

    def _output(self, node, socket):
        kind = node.bl_idname.removeprefix("ShaderNode")
        compute = getattr(self, f"_{kind.lower()}", None)
        if compute is None:
            raise Unreadable(f"unexpected node {kind}")
        return compute(node, socket)

    def _nodegroupinput(self, node, socket):
        return self._given[socket.identifier]

    def _nodereroute(self, node, socket):
        return self.value(node.inputs[0])

    def _newgeometry(self, node, socket):
        return {"Incoming": self._wo, "Normal": np.array([0.0, 0.0, 1.0])}[socket.name]

    def _math(self, node, socket):
        return _MATH[node.operation](*(self.value(s) for s in node.inputs if s.enabled))

    def _vectormath(self, node, socket):
        return _VECTORS[node.operation](*(self.value(s) for s in node.inputs if s.enabled))

    def _combinexyz(self, node, socket):
        return np.array([self.value(s) for s in node.inputs])

    def _separatecolor(self, node, socket):
        return self.value(node.inputs["Color"])[("Red", "Green", "Blue").index(socket.name)]

    def _floatcurve(self, node, socket):
        mapping = node.mapping
        mapping.initialize()  # of a file that was opened
        return mapping.evaluate(mapping.curves[0], self.value(node.inputs["Value"]))

    def _teximage(self, node, socket):
        return _texel(node.image, self.value(node.inputs["Vector"]))

    def _addshader(self, node, socket):
        return self.value(node.inputs[0]) + self.value(node.inputs[1])

    def _coloured(self, node, scattered):
        return scattered[:, None] * self.value(node.inputs["Color"])

    def _bsdfdiffuse(self, node, socket):
        normal = self.value(node.inputs["Normal"])
        return self._coloured(node, shader_text.matte(normal, self._wi, self._wo))

    def _bsdfanisotropic(self, node, socket):
        width = self.value(node.inputs["Roughness"]) ** 2
        if width == 0:  # an ideal mirror is drawn by itself
            return np.zeros_like(self._wi)
        normal = self.value(node.inputs["Normal"])
        kind = _DISTRIBUTIONS[node.distribution]
        lobe = shader_text.facets(kind, normal, (0, 0, 0), width, width, self._wi, self._wo)
        return self._coloured(node, lobe)


def scattered(group, given, wi, wo):
    """f cos(theta_i) of a group's BSDF, (N, 3), without an ideal mirror's part. `given`: numbers
    and colours by the identifiers of the group's inputs; wi: (N, 3), wo: (3,), unit vectors.

    Raises Unreadable.
    """
    try:
        (end,) = (node for node in group.nodes if node.bl_idname == "NodeGroupOutput")
        return _Execution(group, given, wi, wo).value(end.inputs["BSDF"])
    except shader_text.FAILURES as error:
        raise Unreadable(str(error)) from error
