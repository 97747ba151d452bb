# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares shader_values and value_bounds with pictures: of each node that they know, an emissive
surface must show the constant, and nothing outside the bounds. Operands are awkward: zero,
negative, huge, whole or not."""

import itertools
from dataclasses import dataclass
from importlib import import_module

import bpy
import helpers
import numpy as np
import pytest

SINCE_5 = bpy.app.version >= (5, 0, 0)
AWKWARD = (0.0, 1.0, -1.0, -2.0, 0.5, -0.5, 3.0, 2.5, -3.0, 1e10, 40.0, 1e-30, -1e30)
SINGLE = {"SQRT", "ABSOLUTE"}
MATH = (
    *("ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "POWER", "MINIMUM", "MAXIMUM"),
    *("LESS_THAN", "GREATER_THAN", *SINGLE),
)
BLENDS = ("MIX", "MULTIPLY", "ADD", "SUBTRACT", "SCREEN")
RAMPS = ("LINEAR", "EASE", "CARDINAL", "B_SPLINE", "CONSTANT")
FACTORS = (-2.0, -0.5, 0.0, 0.5, 1.0, 3.0)
COLOR, OTHER = (0.2, 0.5, 1.8), (0.6, 1.5, 0.1)
BELOW_0 = (0.2, -0.5, 1.8)


@pytest.fixture
def values(extension):
    return import_module(f"{extension.package}.trees.shader_values")


@pytest.fixture
def bounds(extension):
    return import_module(f"{extension.package}.trees.value_bounds").bounds


@pytest.fixture
def see(empty):
    """see(fills): renders a strip of emissive surfaces, and returns the colours that they show and
    their sockets, which fill(tree, socket) fills. Infinite light shows as 0."""
    helpers.add_camera(empty)
    camera = empty.camera.data
    camera.type = "ORTHO"
    empty.cycles.shading_system, empty.cycles.use_denoising = False, False
    empty.cycles.samples, empty.cycles.max_bounces = 1, 0
    empty.cycles.pixel_filter_type, empty.cycles.filter_width = "BOX", 0.01

    def see(fills):
        camera.ortho_scale = empty.render.resolution_x = max(len(fills), 4)
        empty.render.resolution_y = 4
        made, sockets = [], []
        for index, fill in enumerate(fills):
            left = index - empty.render.resolution_x / 2
            mesh = bpy.data.meshes.new("Surface")
            corners = [(left, -9), (left + 1, -9), (left + 1, 9), (left, 9)]
            mesh.from_pydata([(x, 0, z) for x, z in corners], [], [(0, 1, 2, 3)])
            material = bpy.data.materials.new("Surface")
            material.cycles.emission_sampling = "NONE"
            mesh.materials.append(material)
            tree = helpers.empty_tree(material)
            emission = tree.nodes.new("ShaderNodeEmission")
            output = tree.nodes.new("ShaderNodeOutputMaterial")
            tree.links.new(emission.outputs[0], output.inputs["Surface"])
            fill(tree, emission.inputs["Color"])
            made.append(bpy.data.objects.new("Surface", mesh))
            empty.collection.objects.link(made[-1])
            sockets.append(emission.inputs["Color"])
        seen = helpers.render(empty)[1, : len(fills), :3]
        bpy.data.batch_remove(made)
        return seen, sockets

    return see


def first(sockets, name=None):
    """The first available socket, or the first one with a name or index."""
    if isinstance(name, int):
        return sockets[name]
    # Some names differ in Blender 5.
    return next(s for s in sockets if s.enabled and (name is None or s.name.startswith(name)))


def color_node(tree, channels):
    """A node with this colour; colour sockets hold none below 0."""
    node = tree.nodes.new("ShaderNodeCombineColor")
    for socket, value in zip(node.inputs, channels, strict=True):
        socket.default_value = value
    return node.outputs[0]


@dataclass
class Made:
    """Makes a node with these settings and inputs, which link(tree, value) may link."""

    kind: str
    settings: dict
    inputs: dict
    output: object = None

    def __str__(self):
        return f"{self.kind} {self.settings} {self.inputs}"

    def __call__(self, tree, socket):
        tree.links.new(self.node(tree), socket)

    def node(self, tree, link=lambda tree, value: None):
        node = tree.nodes.new(f"ShaderNode{self.kind}")
        for name, value in self.settings.items():
            if name == "ramp":
                node.color_ramp.interpolation = value
                for place, color in ((0.33, (0.9, 0.1, 0.2, 1)), (0.37, (0, 0.8, 0.2, 1))):
                    node.color_ramp.elements.new(place).color = color
            else:
                setattr(node, name, value)
        for name, value in self.inputs.items():
            socket = first(node.inputs, name)
            source = link(tree, value)
            if source is None and isinstance(value, tuple):
                source = color_node(tree, value)
            if source is not None:
                tree.links.new(source, socket)
            else:
                socket.default_value = value
        return first(node.outputs, self.output)


# ---- constants -----------------------------------------------------------------------------------


def assert_told(values, see, cases, known=True, rel=1e-5):
    seen, sockets = see(cases)
    wrong = []
    for case, color, socket in zip(cases, seen, sockets, strict=True):
        told = values.constant(socket)
        if told is None and not known:
            continue
        expected = (0, 0, 0) if told is None else told
        if color != pytest.approx(np.array(expected), rel=rel, abs=1e-7):
            wrong.append(f"{case}: seen {color}, said {told}")
    assert not wrong, "\n".join([f"{len(wrong)} of {len(cases)} differ", *wrong[:20]])


@pytest.mark.parametrize("operation", MATH)
def test_an_operation_has_the_value_that_cycles_shows(values, see, operation):
    cases = []
    for operands in itertools.product(AWKWARD, repeat=1 if operation in SINGLE else 2):
        inputs = dict(enumerate(operands))
        if operation == "MULTIPLY_ADD":
            inputs[2] = 0.75
        cases.append(Made("Math", {"operation": operation}, inputs))
    assert_told(values, see, cases)


def test_numbers_are_as_precise_as_those_of_cycles(values, see):
    def fill(tree, socket):
        large = Made("Math", {"operation": "ADD"}, {0: 1e8, 1: 1.0}).node(tree)
        less = Made("Math", {"operation": "SUBTRACT"}, {0: 0.0, 1: 1e8}).node(tree)
        tree.links.new(large, less.node.inputs[0])
        tree.links.new(less, socket)

    assert_told(values, see, [fill])


def mixes():
    for blend, clamps, factor in itertools.product(BLENDS, ((0, 0), (0, 1), (1, 0)), FACTORS):
        settings = dict(zip(("clamp_factor", "clamp_result"), map(bool, clamps), strict=True))
        settings |= {"data_type": "RGBA", "blend_type": blend}
        yield Made("Mix", settings, {"Factor": factor, "A": BELOW_0, "B": OTHER})
        yield Made(
            "MixRGB",
            {"blend_type": blend, "use_clamp": bool(clamps[1])},
            {0: factor, 1: BELOW_0, 2: OTHER},
        )
    # What was set for colours does not count for numbers.
    for clamp, factor in itertools.product((False, True), FACTORS):
        settings = {"data_type": "RGBA", "blend_type": "MULTIPLY", "clamp_result": True}
        settings |= {"clamp_factor": clamp, "data_type": "FLOAT"}
        yield Made("Mix", settings, {"Factor": factor, "A": 3.0, "B": -1.0})


def others():
    for kind, *numbers in itertools.product(
        ("MINMAX", "RANGE"), (-2.0, 0.0, 0.5, 3.0), (-1.0, 0.0, 1.0), (-1.0, 0.25, 1.0)
    ):
        yield Made("Clamp", {"clamp_type": kind}, dict(enumerate(numbers)))
    for factor in FACTORS:
        yield Made("Invert", {}, {0: factor, 1: BELOW_0})
    for kind, place in itertools.product(RAMPS, (-1.0, 0.0, 0.123, 0.3301, 0.35, 0.6, 1.0, 2.0)):
        yield Made("ValToRGB", {"ramp": kind}, {0: place})
    yield Made("RGBToBW", {}, {0: BELOW_0})
    for name, index in itertools.product(("Color", "XYZ"), range(3)):
        yield Made(f"Separate{name}", {}, {0: BELOW_0}, index)


@pytest.mark.parametrize("cases", [mixes, others])
def test_a_node_has_the_value_that_cycles_shows(values, see, cases):
    assert_told(values, see, list(cases()))


@dataclass
class Passing:
    """Links a node to a socket through a group, whose sockets have other types."""

    kind: str
    types: tuple
    mute: bool = False

    def __call__(self, tree, socket):
        source = tree.nodes.new(f"ShaderNode{self.kind}")
        if self.kind == "Value":
            source.outputs[0].default_value = -2.75
        else:
            for own, value in zip(source.inputs, (2.2, -0.5, 1.8), strict=True):
                own.default_value = value
        group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        for name, way, kind in zip(("In", "Out"), ("INPUT", "OUTPUT"), self.types, strict=True):
            group.interface.new_socket(name, in_out=way, socket_type=f"NodeSocket{kind}")
        start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        group.links.new(start.outputs[0], end.inputs[0])
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree, node.mute = group, self.mute
        tree.links.new(source.outputs[0], node.inputs[0])
        tree.links.new(node.outputs[0], socket)


def test_each_socket_on_the_way_converts_a_value(values, see):
    types = list(itertools.product(("Color", "Vector", "Float", "Int"), repeat=2))
    cases = [
        Passing(kind, pair, mute)
        for kind, pair, mute in itertools.product(
            ("CombineColor", "CombineXYZ", "Value"), types, (False, True)
        )
    ]
    # Since 5.0 only values that Blender computes itself are converted, with fewer digits.
    assert_told(values, see, cases, known=not SINCE_5, rel=5e-4 if SINCE_5 else 1e-5)


def test_own_values_of_groups_are_converted(values, see):
    """A value may stop at any of the sockets on the way."""

    def fill(tree, socket, kind, own):
        Passing("Value", (kind, "Float"))(tree, socket)
        (node,) = (n for n in tree.nodes if n.bl_idname == "ShaderNodeGroup")
        tree.links.remove(node.inputs[0].links[0])
        node.inputs[0].default_value = own

    cases = [
        lambda tree, socket: fill(tree, socket, "Color", (*COLOR, 1)),
        lambda tree, socket: fill(tree, socket, "Vector", BELOW_0),
        lambda tree, socket: fill(tree, socket, "Float", 0.7),
    ]
    assert_told(values, see, cases, rel=5e-4 if SINCE_5 else 1e-5)


def test_an_infinite_light_is_no_error(extension, empty):
    """Lamps are surveyed in handlers, from which no exception may escape."""
    emission = import_module(f"{extension.package}.lamps.emission")
    material = helpers.node_material("ShaderNodeEmission", Strength=5.0)
    tree = material.node_tree
    for base, exponent in ((1e10, 40.0), (0.0, -1.0)):
        power = Made("Math", {"operation": "POWER"}, {0: base, 1: exponent}).node(tree)
        tree.links.new(power, tree.nodes["Emission"].inputs["Strength"])
        assert emission.of_material(material) == pytest.approx(
            1.0, rel=1e-4
        )  # like what is unknown


# ---- bounds --------------------------------------------------------------------------------------

RANGES = ((-1.0, 1.0), (0.0, 1.0), (-2.0, 0.5), (0.25, 2.0), (-2.0, -0.5), (0.0, 0.0))
EXPONENTS = tuple((e, e) for e in (2.0, 3.0, 0.5, -1.0, -2.0, -0.5, 0.0))
COLORS = (
    ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    ((-1.0, -0.5, 0.2), (0.5, -0.25, 2.0)),
    ((-2.0, -1.0, -0.5), (-1.0, -0.5, -0.1)),
)
#: Random operands of each case.
SAMPLES = 16


def varied(tree, ends):
    """A number that varies between two, or a colour; None for a constant number."""
    low, high = ends
    if isinstance(low, tuple):
        node = tree.nodes.new("ShaderNodeCombineColor")
        for socket, own in zip(node.inputs, zip(low, high, strict=True), strict=True):
            tree.links.new(varied(tree, own), socket)
        return node.outputs[0]
    noise = tree.nodes.new("ShaderNodeTexNoise")
    scaled = Made("Math", {"operation": "MULTIPLY_ADD"}, {1: high - low, 2: low}).node(tree)
    tree.links.new(noise.outputs[0], scaled.node.inputs[0])
    return scaled


def drawn(random, ends, index):
    """A random value between two; of every other index one near 0, such as a whole number."""
    low, high = np.array(ends)
    value = np.asarray(random.uniform(low, high))
    if index % 2:
        value = np.clip(np.round(random.uniform(-1.5, 2.5, low.shape) * 2) / 2, low, high)
    return tuple(value.tolist()) if value.ndim else float(value)


def assert_within(bounds, see, cases, unbounded=lambda case: False):
    random = np.random.default_rng(7)
    drawings = [
        Made(c.kind, c.settings, {k: drawn(random, v, i) for k, v in c.inputs.items()}, c.output)
        for c in cases
        for i in range(SAMPLES)
    ]
    parts = [drawings[i : i + 1000] for i in range(0, len(drawings), 1000)]
    seen = np.concatenate([see(part)[0] for part in parts]).reshape(len(cases), SAMPLES, 3)
    tree, wrong = helpers.empty_tree(bpy.data.materials.new("Varied")), []
    for case, shown in zip(cases, seen, strict=True):
        tree.nodes.clear()
        socket = tree.nodes.new("ShaderNodeEmission").inputs["Color"]
        tree.links.new(case.node(tree, varied), socket)
        said = bounds(socket)
        assert (said is None) == unbounded(case), f"{case}: said {said}"
        if said is not None:
            low, high = said
            room = 1e-5 * np.maximum(np.abs(low), np.abs(high)) + 1e-6
            if (shown.min(0) < low - room).any() or (shown.max(0) > high + room).any():
                wrong.append(f"{case}: seen {shown.min(0)} to {shown.max(0)}, said {low}, {high}")
    assert not wrong, "\n".join([f"{len(wrong)} of {len(cases)} are too narrow", *wrong[:20]])


def reaches_0(ends):
    return ends[0] <= 0 <= ends[1]


def is_unbounded(case):
    """Of the operations that are tested, a quotient or a power of a number near 0."""
    if case.kind == "Gamma":
        return case.inputs[1][0] < 0 and any(
            a <= 0 < b for a, b in zip(*case.inputs[0], strict=True)
        )
    if case.kind != "Math" or case.settings["use_clamp"]:
        return False
    a, b = case.inputs[0], case.inputs.get(1)
    if case.settings["operation"] == "DIVIDE":
        return b[0] != b[1] and reaches_0(b)
    return case.settings["operation"] == "POWER" and b[0] < 0 and reaches_0(a)


@pytest.mark.slow
@pytest.mark.parametrize("clamp", [False, True])
@pytest.mark.parametrize("operation", MATH)
def test_no_operation_leaves_its_bounds(bounds, see, operation, clamp):
    settings = {"operation": operation, "use_clamp": clamp}
    second = RANGES + (EXPONENTS if operation == "POWER" else ())
    cases = [
        Made("Math", settings, {0: a} if operation in SINGLE else {0: a, 1: b})
        for a, b in itertools.product(RANGES, second[:1] if operation in SINGLE else second)
    ]
    if operation == "MULTIPLY_ADD":
        for case in cases:
            case.inputs[2] = (-0.5, 0.75)
    assert_within(bounds, see, cases, is_unbounded)


def bounded_mixes():
    for blend, a, b, factor in itertools.product(
        BLENDS, COLORS, COLORS[:2], ((0.0, 1.0), (-1.0, 2.0))
    ):
        settings = {"data_type": "RGBA", "blend_type": blend, "clamp_factor": factor[0] >= 0}
        yield Made("Mix", settings, {"Factor": factor, "A": a, "B": b})


def bounded_colors():
    for color, other in itertools.product(COLORS, ((0.0, 1.0), (-1.0, 2.0))):
        yield Made("Invert", {}, {0: other, 1: color})
        for value, factor in itertools.product(
            ((1.0, 1.0), (-1.0, 3.0), (-2.0, -1.0)), ((1.0, 1.0), (-1.0, 2.0))
        ):
            inputs = {"Hue": (0.0, 1.0), "Saturation": (-1.0, 3.0), "Value": value}
            yield Made("HueSaturation", {}, inputs | {"Fac": factor, "Color": color})
    for color, gamma in itertools.product(COLORS, (*RANGES, *EXPONENTS)):
        yield Made("Gamma", {}, {0: color, 1: gamma})
    for color in COLORS:
        yield Made("RGBToBW", {}, {0: color})
        yield Made("SeparateColor", {}, {0: color})


def bounded_ranges():
    for kind, ends in itertools.product(("MINMAX", "RANGE"), RANGES):
        yield Made("Clamp", {"clamp_type": kind}, {0: ends, 1: (-1.0, 0.5), 2: (-0.5, 1.0)})
    kinds = "LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"
    sources = ((0.0, 0.0), (1.0, 1.0)), ((0.0, 1.0), (0.0, 1.0)), ((0.5, 0.5), (0.5, 0.5))
    targets = ((0.0, 1.0), (0.0, 1.0)), ((1.0, 2.0), (3.0, 3.0)), ((-2.0, -1.0), (-3.0, -2.0))
    for kind, source, target in itertools.product(kinds, sources, targets):
        inputs = {"Value": (-1.0, 2.0), "From Min": source[0], "From Max": source[1]}
        inputs |= {"To Min": target[0], "To Max": target[1]}
        yield Made("MapRange", {"interpolation_type": kind}, inputs)
    for kind, ends in itertools.product(
        RAMPS,
        # Since 5.0, a ramp is exact for constants such as those drawn, but not for what varies.
        ((0.0, 1.0), (-1e5, 1e5), *([] if SINCE_5 else [(0.31, 0.4)])),
    ):
        yield Made("ValToRGB", {"ramp": kind}, {0: ends})


@pytest.mark.slow
@pytest.mark.parametrize("cases", [bounded_mixes, bounded_colors, bounded_ranges])
def test_no_node_leaves_its_bounds(bounds, see, cases):
    assert_within(bounds, see, list(cases()), is_unbounded)
