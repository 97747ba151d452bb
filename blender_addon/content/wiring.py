# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers that add and link Blender's own nodes."""

#: Distribution of glossy nodes by kind of closure.
DISTRIBUTIONS = {"ggx": "GGX", "beckmann": "BECKMANN"}


class Wiring:
    """Adds nodes to a group and links their inputs.

    Blender examines the whole tree at every change. So nothing is set that already has the right
    value, and locations are set together: call place_nodes() when all nodes exist.
    """

    def __init__(self, tree):
        self.tree, self.made = tree, []

    def node(self, kind, **settings):
        self.made.append(len(self.tree.nodes))
        node = self.tree.nodes.new(kind)
        node.hide = True
        for key, value in settings.items():
            if getattr(node, key) != value:
                setattr(node, key, value)
        return node

    def place_nodes(self):
        """Arranges the new nodes in columns."""
        places = [0.0] * (2 * len(self.tree.nodes))
        self.tree.nodes.foreach_get("location", places)
        for count, index in enumerate(self.made):
            places[2 * index : 2 * index + 2] = 200 * (count // 20), -60 * (count % 20)
        # Setting locations, too, makes Blender examine the tree, but this way only once.
        self.tree.nodes.foreach_set("location", places)

    def give(self, socket, value):
        """Sets a socket to a constant, or links the output of another node to it."""
        if hasattr(value, "is_output"):
            self.tree.links.new(value, socket)
            return
        found = socket.default_value
        same = tuple(found) == tuple(value) if hasattr(found, "__len__") else found == value
        if not same:
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
        """Looks x up in a table of heights, evenly spaced over [0, 1] and linearly interpolated."""
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

    def bsdf(self, kind, color, normal, roughness=0.0, stretched=None):
        """`stretched`: the anisotropy of a glossy node and its tangent."""
        if kind == "diffuse":
            node = self.node("ShaderNodeBsdfDiffuse")
        else:
            node = self.node(
                "ShaderNodeBsdfAnisotropic", distribution=DISTRIBUTIONS.get(kind, "GGX")
            )
        self.give(node.inputs["Color"], color)
        self.give(node.inputs["Roughness"], roughness)
        self.give(node.inputs["Normal"], normal)
        if stretched:
            self.give(node.inputs["Anisotropy"], stretched[0])
            self.give(node.inputs["Tangent"], stretched[1])
        return node.outputs["BSDF"]

    def metal(self, kind, f0, edge, roughness, anisotropy, rotation, normal, tangent):
        node = self.node(
            "ShaderNodeBsdfMetallic", fresnel_type="F82", distribution=DISTRIBUTIONS[kind]
        )
        self.give(node.inputs["Base Color"], f0)
        self.give(node.inputs["Edge Tint"], edge)
        self.give(node.inputs["Roughness"], roughness)
        self.give(node.inputs["Anisotropy"], anisotropy)
        self.give(node.inputs["Rotation"], rotation)
        self.give(node.inputs["Normal"], normal)
        self.give(node.inputs["Tangent"], tangent)
        return node.outputs["BSDF"]

    def sum(self, shaders):
        while len(shaders) > 1:
            node = self.node("ShaderNodeAddShader")
            self.give(node.inputs[0], shaders[0])
            self.give(node.inputs[1], shaders[1])
            shaders = [*shaders[2:], node.outputs["Shader"]]
        return shaders[0]

    def mix(self, factor, at_0, at_1, vector=False):
        """Interpolates numbers or vectors: at_0 (1 - factor) + at_1 factor."""
        kind = "Vector" if vector else "Float"
        node = self.node("ShaderNodeMix", data_type=kind.upper(), clamp_factor=False)
        by_identifier = {socket.identifier: socket for socket in (*node.inputs, *node.outputs)}
        self.give(by_identifier["Factor_Float"], factor)
        self.give(by_identifier[f"A_{kind}"], at_0)
        self.give(by_identifier[f"B_{kind}"], at_1)
        return by_identifier[f"Result_{kind}"]

    def scaled(self, vector, factor):
        """A vector times a number. SVM runs this in half the time of Vector Math's Scale."""
        return self.mix(factor, (0.0, 0.0, 0.0), vector, True)

    def combine(self, x, y, z):
        node = self.node("ShaderNodeCombineXYZ")
        for socket, value in zip(node.inputs, (x, y, z), strict=True):
            self.give(socket, value)
        return node.outputs[0]

    def separate(self, vector):
        node = self.node("ShaderNodeSeparateXYZ")
        self.give(node.inputs[0], vector)
        return list(node.outputs)

    def local(self, vector, axes):
        """Transforms a vector into a frame."""
        return self.combine(
            *(self.vector("DOT_PRODUCT", vector, axis, output="Value") for axis in axes)
        )

    def half(self, a, b):
        """The normalized half vector of two directions."""
        return self.vector("NORMALIZE", self.mix(0.5, a, b, True))

    def toon(self, color, size, normal, smooth=0.0, component="GLOSSY"):
        """A closure that is constant within a cone, and falls to 0 beside it: about the mirror
        direction, or, if `component` is "DIFFUSE", the normal."""
        node = self.node("ShaderNodeBsdfToon", component=component)
        self.give(node.inputs["Color"], color)
        self.give(node.inputs["Size"], size)
        self.give(node.inputs["Smooth"], smooth)
        self.give(node.inputs["Normal"], normal)
        return node.outputs[0]

    def refraction(self, color, ior, normal):
        node = self.node("ShaderNodeBsdfRefraction")
        self.give(node.inputs["Color"], color)
        self.give(node.inputs["Roughness"], 0.0)
        self.give(node.inputs["IOR"], ior)
        self.give(node.inputs["Normal"], normal)
        return node.outputs[0]

    def shown(self, factor, shader):
        """A shader times a factor; where the factor is 0, Cycles skips the shader's inputs."""
        node = self.node("ShaderNodeMixShader")
        self.give(node.inputs[0], factor)
        self.give(node.inputs[2], shader)
        return node.outputs[0]
