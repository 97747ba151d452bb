# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin of a model: Blender's own nodes, steered by curves over the view angle.

Runs where Open Shading Language does not: EEVEE, any GPU, render farms. What the nodes take is in
the extension's twins/*.json, which the tool fits; how they are wired is here.
"""

_DISTRIBUTIONS = {"ggx": "GGX", "beckmann": "BECKMANN"}


class _Wiring:
    """Adds nodes to a group, column by column, and links what they are given."""

    def __init__(self, tree):
        self.tree, self.count = tree, 0

    def node(self, kind, **settings):
        node = self.tree.nodes.new(kind)
        node.hide = True
        node.location = (200 * (self.count // 20), -60 * (self.count % 20))
        self.count += 1
        for key, value in settings.items():
            setattr(node, key, value)
        return node

    def give(self, socket, value):
        """A constant, or the output of another node."""
        if hasattr(value, "is_output"):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def math(self, operation, *values):
        node = self.node("ShaderNodeMath", operation=operation)
        for socket, value in zip(node.inputs, values, strict=False):
            self.give(socket, value)
        return node.outputs["Value"]

    def vector(self, operation, *values, scale=None, output="Vector"):
        node = self.node("ShaderNodeVectorMath", operation=operation)
        for socket, value in zip(node.inputs, values, strict=False):
            self.give(socket, value)
        if scale is not None:
            self.give(node.inputs["Scale"], scale)
        return node.outputs[output]

    def curve(self, x, heights):
        """The table of heights, evenly spaced over [0, 1] and linear between, at x."""
        node = self.node("ShaderNodeFloatCurve")
        mapping, curve = node.mapping, node.mapping.curves[0]
        mapping.use_clip = False
        last = len(heights) - 1
        curve.points[0].location, curve.points[1].location = (0, heights[0]), (1, heights[last])
        for i in range(1, last):
            curve.points.new(i / last, heights[i])
        for point in curve.points:
            point.handle_type = "VECTOR"
        mapping.update()
        self.give(node.inputs["Value"], x)
        return node.outputs["Value"]

    def colour(self, x, channels, factor):
        """One curve that multiplies a colour, or one for each of its channels."""
        if len(channels) == 1:
            return self.vector("SCALE", factor, scale=self.curve(x, channels[0]))
        combined = self.node("ShaderNodeCombineXYZ")
        for socket, heights in zip(combined.inputs, channels, strict=True):
            self.give(socket, self.curve(x, heights))
        return self.vector("MULTIPLY", combined.outputs["Vector"], factor)

    def bsdf(self, kind, color, normal, roughness=0.0):
        if kind == "diffuse":
            node = self.node("ShaderNodeBsdfDiffuse")
        else:
            node = self.node(
                "ShaderNodeBsdfAnisotropic", distribution=_DISTRIBUTIONS.get(kind, "GGX")
            )
        self.give(node.inputs["Color"], color)
        self.give(node.inputs["Roughness"], roughness)
        self.give(node.inputs["Normal"], normal)
        return node.outputs["BSDF"]

    def sum(self, shaders):
        while len(shaders) > 1:
            node = self.node("ShaderNodeAddShader")
            self.give(node.inputs[0], shaders[0])
            self.give(node.inputs[1], shaders[1])
            shaders = [*shaders[2:], node.outputs["Shader"]]
        return shaders[0]


def wire(tree, data, normal, factors=()):
    """Builds the nodes of a twin; returns the outputs that are its BSDF and its albedo.

    `data` is what twins/*.json has; `normal` an output that is 0 where the surface's own is meant.
    `factors`: outputs, colours of all but the mirror.
    """
    w = _Wiring(tree)
    geometry = w.node("ShaderNodeNewGeometry")
    viewer = geometry.outputs["Incoming"]
    missing = w.math("LESS_THAN", w.vector("LENGTH", normal, output="Value"), 0.5)
    own = w.vector("SCALE", geometry.outputs["Normal"], scale=missing)
    normal = w.vector("NORMALIZE", w.vector("ADD", normal, own))
    cos_theta = w.vector("DOT_PRODUCT", normal, viewer, output="Value")
    across = w.vector("CROSS_PRODUCT", normal, viewer)
    tint, half_tint = data["tint"], [t / 2 for t in data["tint"]]
    for factor in factors:
        tint = w.vector("MULTIPLY", factor, tint)
        half_tint = w.vector("MULTIPLY", factor, half_tint)
    albedo = w.colour(cos_theta, data["albedo"], tint)
    shaders = []
    for closure in data["closures"]:
        kind = closure["kind"]
        if kind == "mirror":
            colour = w.colour(cos_theta, closure["weight"], (1, 1, 1))
            albedo = w.vector("ADD", albedo, colour)
            shaders.append(w.bsdf(kind, colour, normal))
            continue
        if kind not in _DISTRIBUTIONS:
            shaders.append(w.bsdf(kind, w.colour(cos_theta, closure["weight"], tint), normal))
            continue
        half = w.colour(cos_theta, closure["weight"], half_tint)
        lean = w.curve(cos_theta, closure["lean"])
        roughness = w.curve(cos_theta, closure["roughness"])
        upright = w.vector("SCALE", normal, scale=w.math("SUBTRACT", 1.0, lean))
        middle = w.vector("ADD", upright, w.vector("SCALE", viewer, scale=lean))
        aside = w.vector("SCALE", across, scale=w.curve(cos_theta, closure["spread"]))
        for operation in ("ADD", "SUBTRACT"):
            facet_normal = w.vector("NORMALIZE", w.vector(operation, middle, aside))
            shaders.append(w.bsdf(kind, half, facet_normal, roughness))
    return w.sum(shaders), albedo
