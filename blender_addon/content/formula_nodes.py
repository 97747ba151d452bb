# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a model's formulas from Blender's own Math nodes, which Cycles runs on every device.

The tool writes formulas as lists of operations, in the extension's nodes/*.json. Here each list
becomes a node group. The groups are wired to the surface frame, to the lamps and to the closures
that carry the result: a Toon BSDF for each lamp, one for a random direction, and Blender's own
nodes for ideal reflection and refraction.
"""

import hashlib
import json
import math

import bpy

from . import kept_groups, svm_constants
from .wiring import Wiring

#: Custom property of a part's group: hash of its operations. Equal parts share one group.
PART = "brdfc_part"
_SOCKETS = {
    "FLOAT": "NodeSocketFloat",
    "VECTOR": "NodeSocketVector",
    "SHADER": "NodeSocketShader",
}
#: The only vector operation with a scalar result.
_DOT = "V_DOT_PRODUCT"
#: Maximum number of operations in a group.
_STEP = 60


class _Formula:
    """Adds the nodes for a list of operations."""

    def __init__(self, wiring, inputs):
        self.w, self.inputs = wiring, inputs
        self.results, self.parts = [], {}

    def operand(self, value, vector=False):
        if isinstance(value, str):
            return self.results[int(value[1:])] if value[0] == "$" else self.inputs[value]
        return (value,) * 3 if vector and not isinstance(value, list) else value

    def add(self, kind, *operands):
        w = self.w
        if kind in ("X", "Y", "Z"):
            (source,) = operands
            if source not in self.parts:
                node = w.node("ShaderNodeSeparateXYZ")
                w.give(node.inputs[0], self.operand(source))
                self.parts[source] = node.outputs
            return self.parts[source][kind]
        if kind == "COMBINE":
            node = w.node("ShaderNodeCombineXYZ")
            for socket, value in zip(node.inputs, operands, strict=True):
                w.give(socket, self.operand(value))
            return node.outputs[0]
        if kind in ("MIX", "V_MIX"):
            vector = kind == "V_MIX"
            at_0, at_1 = (self.operand(o, vector) for o in operands[1:])
            return w.mix(self.operand(operands[0]), at_0, at_1, vector)
        if kind == "V_SCALE":
            return w.scaled(self.operand(operands[0], True), self.operand(operands[1]))
        if kind == _DOT:
            return w.vector(kind[2:], *(self.operand(o, True) for o in operands), output="Value")
        if kind.startswith("V_"):
            return w.vector(kind[2:], *(self.operand(o, True) for o in operands))
        return w.math(kind, *map(self.operand, operands))

    def wire(self, data):
        for operation in data["operations"]:
            self.results.append(self.add(*operation))
        return {
            name: self.operand(value, kind == "VECTOR") for name, kind, value in data["outputs"]
        }


def _find(digest, among=None):
    for group in bpy.data.node_groups if among is None else among:
        if group.library is None and group.get(PART) == digest:
            return group
    return None


def _appended(digest):
    """The kept group of a part, or None. If the file already has an equal part, that one stays."""
    made = kept_groups.append(digest)
    wanted = _find(digest, made)
    own = [group for group in bpy.data.node_groups if group not in made]
    for group in made:
        if wanted is None:
            bpy.data.node_groups.remove(group)
        elif other := _find(group.get(PART), own):
            group.user_remap(other)
            bpy.data.node_groups.remove(group)
    return wanted


def _group(title, content, inputs, outputs, fill, kept=False):
    """Finds or makes the group with this content. `inputs` and `outputs`: names and kinds;
    fill(wiring, inputs by name) returns the outputs by name. `kept`: see kept_groups."""
    content = [kept_groups.version(), content]
    digest = hashlib.sha256(json.dumps(content).encode()).hexdigest()[:16]
    if group := _find(digest) or (_appended(digest) if kept else None):
        return group
    group = bpy.data.node_groups.new(f"brdfc {title}", "ShaderNodeTree")
    group[PART] = digest
    for in_out, sockets in (("INPUT", inputs), ("OUTPUT", outputs)):
        for name, kind in sockets:
            group.interface.new_socket(name, in_out=in_out, socket_type=_SOCKETS[kind])
    w = Wiring(group)
    start = w.node("NodeGroupInput")
    made = fill(w, {s.name: s for s in start.outputs if s.name})
    end = w.node("NodeGroupOutput")
    for name, value in made.items():
        w.give(end.inputs[name], value)
    w.place_nodes()
    if kept:
        kept_groups.keep(group, digest)
    return group


def _instance(w, group, inputs, label):
    """Adds a group node to a tree; returns its outputs by name."""
    node = w.node("ShaderNodeGroup")
    node.node_tree = group
    node.label = label
    for socket in node.inputs:
        w.give(socket, inputs[socket.name])
    return {socket.name: socket for socket in node.outputs}


def _steps(data):
    """Splits a long list of operations into short ones, each taking the results of those before it:
    Blender's time for each new link grows with the size of the tree."""
    operations = data["operations"]
    kinds = dict(data["inputs"])
    for index, (kind, *_) in enumerate(operations):
        vector = kind == "COMBINE" or (kind.startswith("V_") and kind != _DOT)
        kinds[f"${index}"] = "VECTOR" if vector else "FLOAT"
    wanted = [value for _, _, value in data["outputs"] if isinstance(value, str)]
    for first in range(0, len(operations), _STEP):
        last = min(first + _STEP, len(operations))
        here = operations[first:last]
        own = {f"${i}" for i in range(first, last)}
        taken = list(dict.fromkeys(o for op in here for o in op[1:] if isinstance(o, str)))
        later = {o for op in operations[last:] for o in op[1:] if isinstance(o, str)} | {*wanted}
        given = [name for name in sorted(own, key=lambda n: int(n[1:])) if name in later]
        names = {f"${first + i}": f"${i}" for i in range(len(here))}
        names |= {o: f"before_{o[1:]}" for o in taken if o[0] == "$" and o not in own}
        yield {
            "inputs": [[names.get(o, o), kinds[o], o] for o in taken if o not in own],
            "operations": [
                [kind, *(names.get(o, o) if isinstance(o, str) else o for o in operands)]
                for kind, *operands in here
            ],
            "outputs": [[f"result_{o[1:]}", kinds[o], names[o], o] for o in given],
        }


def _part_group(title, data):
    """The node group of a part."""
    inputs = data["inputs"]
    outputs = [output[:2] for output in data["outputs"]]
    if len(data["operations"]) <= _STEP:
        return _group(title, data, inputs, outputs, lambda w, given: _Formula(w, given).wire(data))

    def fill(w, given):
        known = dict(given)
        for step in _steps(data):
            short = {
                "inputs": [entry[:2] for entry in step["inputs"]],
                "operations": step["operations"],
                "outputs": [entry[:3] for entry in step["outputs"]],
            }
            group = _part_group(title, short)
            made = _instance(w, group, {e[0]: known[e[2]] for e in step["inputs"]}, "")
            known |= {e[3]: made[e[0]] for e in step["outputs"]}
        return {
            name: known[value] if isinstance(value, str) else value
            for name, _, value in data["outputs"]
        }

    return _group(title, data, inputs, outputs, fill)


class _Parts:
    """The parts of a model, which add themselves as nodes to its group."""

    def __init__(self, wiring, parts, title, constants):
        """`constants`: the outputs of svm_constants.add_values()."""
        self.w, self.data, self.title, self.constants = wiring, parts, title, constants

    def has(self, name):
        return name in self.data

    def add(self, name, **inputs):
        """Adds a part; returns its outputs by name. `inputs`: numbers and outputs by name."""
        group = _part_group(f"{self.title}: {name}", self.data[name])
        return _instance(self.w, group, self.constants | inputs, name)

    def inputs(self, name):
        """Names and kinds of a part's inputs."""
        return {name: kind for name, kind in self.data[name]["inputs"]}

    def on(self, wiring, found):
        """The same parts in another tree, whose group inputs are `found`."""
        constants = {name: found[name] for name in svm_constants.VALUES if name in found}
        return _Parts(wiring, self.data, self.title, constants)


class _Surface:
    """The shading point: its frame, the view direction and the random numbers."""

    def __init__(self, w, parts, geometry, normal, tangent):
        """`tangent`: an output that is 0 where the object's own tangent is meant; None if any
        tangent will do (isotropic)."""
        self.w = w
        self.place, self.view = geometry.outputs["Position"], geometry.outputs["Incoming"]
        self.true_normal = geometry.outputs["True Normal"]
        self.backfacing = geometry.outputs["Backfacing"]
        self.interpolated = geometry.outputs["Normal"]
        self.strand = w.node("ShaderNodeHairInfo").outputs["Is Strand"]
        path = w.node("ShaderNodeLightPath")
        self.path_length, self.camera = path.outputs["Ray Length"], path.outputs["Is Camera Ray"]
        missing = w.math("LESS_THAN", w.vector("LENGTH", normal, output="Value"), 0.5)
        own = w.scaled(geometry.outputs["Normal"], missing)
        self.normal = w.vector("NORMALIZE", w.vector("ADD", normal, own))
        if parts.has("bend"):
            vectors = {"true": self.true_normal, "view": self.view, "normal": self.normal}
            self.normal = parts.add("bend", strand=self.strand, **vectors)["normal"]
        self.drawn = _random(w, self, 0.0)
        self.anywhere = _direction(w, *_random(w, self, 1.0)[:2])
        if tangent is None:
            across = w.vector("CROSS_PRODUCT", self.anywhere, self.normal)
            self.tangent = w.vector("NORMALIZE", across)
            self.bitangent = w.vector("CROSS_PRODUCT", self.normal, self.tangent)
        else:
            self._frame(tangent)
        self.wo = parts.add("raise", wo=self.local(self.view))

    def _frame(self, tangent):
        """As brdfc_frame() in OSL: a tangent of length 0 stands for the object's z axis."""
        w = self.w

        def axis(direction):
            node = w.node("ShaderNodeVectorTransform", vector_type="VECTOR")
            node.convert_from, node.convert_to = "OBJECT", "WORLD"
            node.inputs[0].default_value = direction
            return node.outputs[0]

        def across(direction):
            along = w.vector("DOT_PRODUCT", direction, self.normal, output="Value")
            lying = w.scaled(self.normal, along)
            return w.vector("SUBTRACT", direction, lying)

        missing = w.math("LESS_THAN", w.vector("LENGTH", tangent, output="Value"), 1e-20)
        given = across(w.mix(missing, tangent, axis((0, 0, 1)), True))
        short = w.math("LESS_THAN", w.vector("LENGTH", given, output="Value"), 1e-4)
        self.tangent = w.vector("NORMALIZE", w.mix(short, given, across(axis((1, 0, 0))), True))
        self.bitangent = w.vector("CROSS_PRODUCT", self.normal, self.tangent)

    @property
    def axes(self):
        return self.tangent, self.bitangent, self.normal

    def local(self, vector):
        return _local(self.w, vector, self.axes)

    def world(self, vector):
        """Transforms a vector from the surface frame to world space."""
        w = self.w
        total = None
        for part, axis in zip(w.separate(vector), self.axes, strict=True):
            scaled = w.scaled(axis, part)
            total = scaled if total is None else w.vector("ADD", total, scaled)
        return total


def _local(w, vector, axes):
    """Transforms a vector into a frame."""
    return w.combine(*(w.vector("DOT_PRODUCT", vector, axis, output="Value") for axis in axes))


def _random(w, surface, index):
    """Three random numbers in [0, 1), as brdfc_random() in OSL."""

    def noise(vector, number):
        node = w.node("ShaderNodeTexWhiteNoise", noise_dimensions="4D")
        w.give(node.inputs["Vector"], vector)
        w.give(node.inputs["W"], number)
        return node.outputs["Color"]

    far = w.math("ADD", surface.path_length, 17.0 * index)
    total = w.vector("ADD", noise(surface.place, index), noise(surface.view, far))
    return w.separate(w.vector("FRACTION", total))


def _direction(w, u, v):
    """A uniformly distributed direction on the sphere."""
    height = w.math("MULTIPLY_ADD", u, 2.0, -1.0)
    turn = w.math("MULTIPLY", v, 2 * math.pi)
    across = w.math("SQRT", w.math("SUBTRACT", 1.0, w.math("MULTIPLY", height, height)))
    x, y = (w.math("MULTIPLY", across, w.math(part, turn)) for part in ("COSINE", "SINE"))
    return w.combine(x, y, height)


#: Outputs of the group that computes how a slot's lamp is seen from the shading point.
_SEEN = [
    ["towards", "VECTOR"],
    ["drop", "FLOAT"],
    ["solid_angle", "FLOAT"],
    ["chord", "FLOAT"],
    ["reach", "FLOAT"],
    ["flat", "FLOAT"],
    ["used", "FLOAT"],
    ["active", "FLOAT"],
    ["above", "FLOAT"],
    ["whole", "FLOAT"],
]
_SLOT = ("place", "turn", "scale", "shape")
_AXES = [
    ["across", "VECTOR"],
    ["along", "VECTOR"],
    ["away", "VECTOR"],
    ["half_across", "FLOAT"],
    ["half_along", "FLOAT"],
]
#: Larger than the angle between any two directions.
_FAR = 4.0


def _seen_group(parts):
    """The group that computes the cone of directions towards a slot's lamp."""
    vectors = (*_SLOT, "at", "view", "normal")

    def fill(w, found):
        here = parts.on(w, found)
        axes = here.add("axes", **found)
        return axes | here.add("cone", **found, **axes)

    content = ["seen", parts.data["axes"], parts.data["cone"]]
    inputs = [[name, "VECTOR"] for name in vectors]
    return _group("lamp seen", content, inputs, _SEEN + _AXES, fill)


def _point_of(w, towards, drop, anywhere, u):
    """A uniformly distributed direction within the cone. `anywhere`: a random direction that
    decides the azimuth."""
    beside = w.vector("NORMALIZE", w.vector("CROSS_PRODUCT", towards, anywhere))
    fallen = w.math("MULTIPLY", u, drop)
    cosine = w.math("SUBTRACT", 1.0, fallen)
    sine = w.math("SQRT", w.math("MULTIPLY", fallen, w.math("ADD", 1.0, cosine)))
    return w.vector("ADD", w.scaled(towards, cosine), w.scaled(beside, sine))


def _lamp_group(parts):
    """The group that makes a lamp's closure, which carries the model's value in its cone, or the
    part of it that random directions leave. Cycles skips its computations where the factor `lit`
    is 0."""
    vectors = (*_SLOT, "towards", "at", "view", "tangent", "bitangent", "normal", "anywhere")
    of_cone = ("chord", "flat", "room", "solid_angle", "whole")
    numbers = (*of_cone, "drop", "lit", "u_0", "u_1", "u_2")
    inputs = [[name, "VECTOR"] for name in vectors] + [[name, "FLOAT"] for name in numbers]
    inputs += _AXES
    inputs += [[name, kind] for name, kind in parts.inputs("value").items() if name != "wi"]
    known = {name for name, _ in inputs}
    inputs += [[name, "FLOAT"] for name in svm_constants.VALUES if name not in known]

    def fill(w, found):
        here = parts.on(w, found)
        point = _point_of(w, found["towards"], found["drop"], found["anywhere"], found["u_0"])
        on_flat = here.add("flat", **found)
        point = w.mix(found["flat"], point, on_flat["wi"], True)
        frame = (found["tangent"], found["bitangent"], found["normal"])
        at_point = here.add("value", **(found | {"wi": _local(w, point, frame)}))
        cone = {name: found[name] for name in of_cone}
        cone |= {"emphasis": on_flat["emphasis"], "u_2": found["u_2"]}
        lobe = here.add("lobe", **at_point, **cone)
        toon = w.toon(lobe["color"], lobe["size"], w.half(found["towards"], found["view"]))
        return {"BSDF": w.shown(found["lit"], toon)}

    content = ["lamp", {name: parts.data[name] for name in ("value", "flat", "lobe")}]
    return _group(f"{parts.title}: lamp", content, inputs, [["BSDF", "SHADER"]], fill)


def _keep_apart(w, lamps, widest):
    """Decides which lamps get a closure, and how wide each may be. If two cones overlap, the lamp
    with the earlier slot, which is the wider one, is left to random directions.

    Goes from the last slot to the first, so that the empty slots, which are constant to Cycles,
    come first.
    """
    for lamp in lamps:
        lamp["taken"] = w.mix(lamp["active"], -_FAR, lamp["reach"])
    apart = {}
    for i, lamp in enumerate(lamps):
        for j, other in enumerate(lamps[i + 1 :], i + 1):
            distance = w.vector("DISTANCE", lamp["towards"], other["towards"], output="Value")
            apart[i, j] = apart[j, i] = w.mix(other["used"], _FAR, distance)
    for i, lamp in enumerate(lamps):

        def nearest(others, room, i=i):
            for j in others:
                beside = w.math("SUBTRACT", apart[i, j], lamps[j]["taken"])
                room = w.math("MINIMUM", room, beside)
            return room

        later = nearest(range(len(lamps) - 1, i, -1), _FAR)
        free = w.math("LESS_THAN", lamp["reach"], later)
        lamp["shown"] = w.math("MULTIPLY", lamp["active"], free)
        lamp["lit"] = w.math("MULTIPLY", lamp["shown"], lamp["above"])
        lamp["room"] = nearest(range(i - 1, -1, -1), w.math("MINIMUM", later, widest))


def wire(tree, data, normal, tangent, parameters, slots, title):
    """Adds a model's nodes as a group. Returns the outputs by name: the BSDF, and the Albedo where
    the model consists of Blender's own closures only.

    `data`: contents of nodes/*.json. `normal` and `tangent`: outputs that are 0 where the surface's
    own are meant. `parameters`: outputs or numbers by name. `slots`: four outputs for each lamp.
    `title`: prefix of the names of the new groups.
    """
    kinds = {name: kind for part in data["parts"].values() for name, kind in part["inputs"]}
    kinds |= dict.fromkeys(data["bounds"], "FLOAT")
    values = {"Normal": (normal, "VECTOR"), "Tangent": (tangent, "VECTOR")}
    own = {name: f"parameter {name}" for name in parameters if name in kinds}
    values |= {own[name]: (parameters[name], kinds[name]) for name in own}
    placed = [[f"lamp {i} {part}" for part in _SLOT] for i in range(len(slots))]
    for names, slot in zip(placed, slots, strict=True):
        values |= {name: (output, "VECTOR") for name, output in zip(names, slot, strict=True)}

    def fill(w, found):
        of_slots = [[found[name] for name in names] for names in placed]
        given = {name: found[socket] for name, socket in own.items()}
        return _wired(w, data, found["Normal"], found["Tangent"], given, of_slots, title)

    inputs = [[name, kind] for name, (_, kind) in values.items()]
    outputs = [["BSDF", "SHADER"], *([] if "draw" in data["parts"] else [["Albedo", "VECTOR"]])]
    group = _group(f"{title}: formulas", [data, inputs], inputs, outputs, fill, kept=True)
    w = Wiring(tree)
    made = _instance(w, group, {name: value for name, (value, _) in values.items()}, "Formulas")
    w.place_nodes()
    return made


def _wired(w, data, normal, tangent, parameters, slots, title):
    """Adds the nodes of a model; returns outputs by name, see wire()."""
    geometry = w.node("ShaderNodeNewGeometry")
    constants = svm_constants.add_values(w, geometry.outputs["Backfacing"])
    lists = {name: svm_constants.prepared(name, part) for name, part in data["parts"].items()}
    parts = _Parts(w, lists, title, constants)
    parameters = dict(parameters)
    for name, (low, high) in data["bounds"].items():
        inside = w.math("MAXIMUM", parameters[name], low)
        parameters[name] = w.math("MINIMUM", inside, high)
    surface = _Surface(w, parts, geometry, normal, None if data["isotropic"] else tangent)
    side = w.math("MULTIPLY_ADD", surface.backfacing, -2.0, 1.0)
    given = {**parameters, **surface.wo, "side": side, "path_length": surface.path_length}
    shaders = []
    if parts.has("closures"):
        colours = parts.add("closures", **given)
        for closure in data["closures"]:
            colour = colours[closure["weight"]]
            if closure["kind"] != "refraction":
                shaders.append(w.bsdf(closure["kind"], colour, surface.normal))
                continue
            # On the inside, the node takes the reciprocal.
            ior = colours[closure["ior"]]
            inverse = w.math("DIVIDE", 1.0, ior)
            ior = w.mix(surface.backfacing, ior, inverse)
            shaders.append(w.refraction(colour, ior, surface.normal))
    if not parts.has("draw"):
        total = None
        for closure in data["closures"]:
            colour = colours[closure["weight"]]
            total = colour if total is None else w.vector("ADD", total, colour)
        return {"BSDF": w.sum(shaders), "Albedo": total}
    if parts.has("base"):
        # Cycles darkens closures about normals of their own, by Bump Map Correction or, from
        # Blender 5.0 on, below the interpolated normal.
        bent = w.vector("DISTANCE", surface.normal, surface.interpolated, output="Value")
        given |= {"stands": w.math("LESS_THAN", bent, 1e-4), "camera": surface.camera}
        given |= parts.add("base", **given)
        shaders += [_of_base(w, closure, given, surface.normal) for closure in data["base"]]
    lamps = []
    # All closures of a shading point are sampled with the same numbers: they are added up, so they
    # need not be independent.
    given |= {f"u_{i}": number for i, number in enumerate(surface.drawn)}
    if slots:
        given |= parts.add("once", **given)
        given["anywhere"] = surface.anywhere
        frame = zip(("tangent", "bitangent", "normal"), surface.axes, strict=True)
        here = {"at": surface.place, "view": surface.view, **dict(frame)}
        given |= here | constants
        seen, lit = _seen_group(parts), _lamp_group(parts)
        for slot in slots:
            values = dict(zip(_SLOT, slot, strict=True))
            lamps.append(values | _instance(w, seen, here | values, "lamp seen"))
        _keep_apart(w, lamps, data["widest"])
    shaders.append(_rest(w, parts, surface, given, lamps, data["narrow"]))
    for lamp in lamps:
        shaders.append(_instance(w, lit, given | lamp, "lamp")["BSDF"])
    return {"BSDF": w.sum(shaders)}


def _of_base(w, closure, given, normal):
    """A closure of the base."""
    found = {name: given[of] for name, of in closure.items() if name != "kind"}
    if closure["kind"] == "cone":
        return w.toon(found["weight"], found["size"], normal, found["smooth"], "DIFFUSE")
    return w.bsdf(closure["kind"], found["weight"], normal, found.get("roughness", 0.0))


def _rest(w, parts, surface, given, lamps, narrow):
    """The closure of the sampled direction, which carries all light that the lamps' closures do
    not."""
    drawn = parts.add("draw", **given)
    ray = surface.world(drawn["wi"])
    height = w.vector("DOT_PRODUCT", ray, surface.true_normal, output="Value")
    # Rays can leave hairs in every direction.
    hidden = w.math(
        "MULTIPLY", w.math("LESS_THAN", height, 0.0), w.math("SUBTRACT", 1.0, surface.strand)
    )
    # From the last slot to the first, as in _keep_apart().
    met = 0.0
    if lamps:
        here = {"at": surface.place, "ray": ray}
        here |= parts.add("density", **given | {"wi": drawn["wi"]})
    for lamp in reversed(lamps):
        inside = parts.add("met", **here | lamp)["met"]
        met = w.math("MAXIMUM", met, w.math("MULTIPLY", inside, lamp["shown"]))
    lost = w.math("MAXIMUM", hidden, met)
    chance = w.math("FRACT", w.math("MULTIPLY", given["u_0"], 4096.0))
    colour = parts.add("rest", weight=drawn["weight"], u=chance, lost=lost)["color"]
    size = narrow * 2 / math.pi
    return w.toon(colour, size, w.half(ray, surface.view))


def numbers(constants):
    """The parameter values that formulas take as numbers, that is, all but choices."""
    return {name: value for name, value in constants.items() if not isinstance(value, str)}


def _unused():
    for group in bpy.data.node_groups:
        if group.library is None and PART in group and group.users == 0:
            return group
    return None


def remove_unused_parts():
    """Removes the part groups that no model uses from the file."""
    while group := _unused():
        bpy.data.node_groups.remove(group)
