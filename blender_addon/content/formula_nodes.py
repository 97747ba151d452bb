# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a model's formulas from Blender's own Math nodes, which Cycles runs on every device.

The tool writes formulas as lists of operations, in the extension's nodes/*.json, of which
part_groups.py makes node groups. Here these are wired to the surface frame, to the lamps and to the
closures that carry the result: a Toon BSDF for each lamp, one for a random direction, and Blender's
own nodes for ideal reflection and refraction.
"""

import math

from ..lamps import slots
from . import svm_constants
from .part_groups import Parts, add_group, make_group
from .wiring import Wiring


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
        self.path_length = path.outputs["Ray Length"]
        missing = w.math("LESS_THAN", w.vector("LENGTH", normal, output="Value"), 0.5)
        own = w.scaled(geometry.outputs["Normal"], missing)
        self.normal = w.vector("NORMALIZE", w.vector("ADD", normal, own))
        if parts.has("bend"):
            self.normal = _bent(parts, geometry, self.strand, self.normal)
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


def _bent(parts, geometry, strand, normal):
    """A normal, bent as Cycles' glossy nodes bend theirs."""
    true, view = geometry.outputs["True Normal"], geometry.outputs["Incoming"]
    return parts.add("bend", strand=strand, true=true, view=view, normal=normal)["normal"]


def bent_normal_group(data):
    """The group that bends a normal as Cycles' glossy nodes bend theirs. `data`: contents of
    nodes/*.json."""
    part, sockets = data["parts"]["bend"], [["Normal", "VECTOR"]]

    def fill(w, found):
        parts = Parts(w, {"bend": part}, "bent normal", {})
        geometry = w.node("ShaderNodeNewGeometry")
        strand = w.node("ShaderNodeHairInfo").outputs["Is Strand"]
        return {"Normal": _bent(parts, geometry, strand, found["Normal"])}

    return make_group("bent normal", ["bent normal", part], sockets, sockets, fill)


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
    ["of_cones", "FLOAT"],
    ["solid_angle", "FLOAT"],
    ["chord", "FLOAT"],
    ["reach", "FLOAT"],
    ["inner", "FLOAT"],
    ["flat", "FLOAT"],
    ["used", "FLOAT"],
    ["active", "FLOAT"],
    ["above", "FLOAT"],
    ["count", "FLOAT"],
    ["clear", "FLOAT"],
]
#: Vectors of a slot, and what its shape's first number consists of.
_SLOT = ("place", "turn", "scale", "shape")
_CODED = [["kind", "FLOAT"], ["most", "FLOAT"], ["plane", "FLOAT"]]
_AXES = [
    ["across", "VECTOR"],
    ["along", "VECTOR"],
    ["away", "VECTOR"],
    ["half_across", "FLOAT"],
    ["half_along", "FLOAT"],
]
#: Axes of the cones of a lamp.
_CONES = [[f"axis {i}", "VECTOR"] for i in range(slots.MOST_CONES)]
#: Larger than the angle between any two directions.
_FAR = 4.0


def _decoded(w, shape):
    """The numbers that lamps/slots.py combines in the first number of a slot's shape."""
    whole = w.separate(shape)[0]
    code = w.math("FLOOR", w.math("DIVIDE", whole, slots.CODE))
    plane = w.math("FLOOR", w.math("DIVIDE", code, slots.CODE))
    return {
        "kind": w.math("MULTIPLY_ADD", code, -slots.CODE, whole),
        "most": w.math("MULTIPLY_ADD", plane, -slots.CODE, w.math("ADD", code, 1.0)),
        "plane": plane,
    }


def _seen_group(parts):
    """The group that computes the cones of directions towards a slot's lamp."""
    vectors = (*_SLOT, "at", "view", "normal", "true")

    def fill(w, found):
        here = parts.on(w, found)
        known = found | _decoded(w, found["shape"])
        known |= here.add("axes", **known)
        known |= here.add("cone", **known)
        clear = 0.0
        for i, (name, _) in enumerate(_CONES):
            cone = here.add("cone_at", **known, index=float(i))
            known[name] = cone["axis"]
            clear = w.math("ADD", clear, cone["clear"])
        return {name: (known | {"clear": clear})[name] for name, _ in outputs}

    outputs = _SEEN + _CODED + _AXES + _CONES
    content = [
        "seen",
        slots.CODE,
        slots.MOST_CONES,
        [parts.data[name] for name in ("axes", "cone", "cone_at")],
    ]
    inputs = [[name, "VECTOR"] for name in vectors]
    return make_group("lamp seen", content, inputs, outputs, fill)


def _point_of(w, towards, drop, anywhere, u):
    """A uniformly distributed direction within the cone. `anywhere`: a random direction that
    decides the azimuth."""
    beside = w.vector("NORMALIZE", w.vector("CROSS_PRODUCT", towards, anywhere))
    fallen = w.math("MULTIPLY", u, drop)
    cosine = w.math("SUBTRACT", 1.0, fallen)
    sine = w.math("SQRT", w.math("MULTIPLY", fallen, w.math("ADD", 1.0, cosine)))
    return w.vector("ADD", w.scaled(towards, cosine), w.scaled(beside, sine))


def _lamp_group(parts):
    """The group that makes a lamp's closures, one for each of its cones, which carry the model's
    value at one of its points, or the part of it that random directions leave. Cycles skips its
    computations where the factor `lit` is 0."""
    vectors = (*_SLOT, "towards", "at", "view", "tangent", "bitangent", "normal", "anywhere")
    of_cone = ("chord", "flat", "room", "solid_angle", "clear", "count", "of_cones")
    numbers = (*of_cone, "most", "drop", "lit", "u_0", "u_1", "u_2")
    inputs = [[name, "VECTOR"] for name in vectors] + [[name, "FLOAT"] for name in numbers]
    inputs += [["kind", "FLOAT"], *_AXES, *_CONES]
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
        cones = []
        for i, (name, _) in enumerate(_CONES):
            half = w.half(found[name], found["view"])
            toon = w.toon(lobe["color"], lobe["size"], half)
            # The first factor is a constant, with which Cycles removes what a lamp never has.
            may_exist = w.math("GREATER_THAN", found["most"], i + 0.5)
            exists = w.math("MULTIPLY", may_exist, w.math("GREATER_THAN", found["count"], i + 0.5))
            cones.append(w.shown(exists, toon) if i > 0 else toon)
        return {"BSDF": w.shown(found["lit"], w.sum(cones))}

    used = ("value", "flat", "lobe")
    content = ["lamp", len(_CONES), {name: parts.data[name] for name in used}]
    return make_group(f"{parts.title}: lamp", content, inputs, [["BSDF", "SHADER"]], fill)


def _same_plane(w, lamp, other):
    """1 for two flat lamps that lie beside each other in one plane, so that neither can hide the
    other, otherwise 0."""
    same = w.math("COMPARE", lamp["plane"], other["plane"], 0.5)
    return w.math("MULTIPLY", same, w.math("GREATER_THAN", lamp["plane"], 0.5))


class _Later:
    """The later lamps, as seen along a lamp's axis: direction, radius and room of the nearest ball
    or sun, and the room that all others leave. Flat lamps are not told apart from each other, which
    would need more numbers than SVM can keep for eight of them."""

    def __init__(self, w):
        self.w, self.room, self.others = w, _FAR, _FAR
        self.towards, self.radius = (0.0, 0.0, 0.0), 0.0

    def add(self, beside, lamp):
        w = self.w
        of_flat = w.mix(lamp["flat"], _FAR, beside)
        beside = w.mix(lamp["flat"], beside, _FAR)
        closer = w.math("LESS_THAN", beside, self.room)
        second = w.math("MAXIMUM", beside, self.room)
        for room in (of_flat, second):
            self.others = w.math("MINIMUM", self.others, room)
        self.towards = w.mix(closer, self.towards, lamp["towards"], True)
        self.radius = w.mix(closer, self.radius, lamp["as_other"])
        self.room = w.math("MINIMUM", self.room, beside)


#: What changes where a lamp has a cone beside another lamp. Only so many lamps can have that, from
#: the widest, since SVM keeps the numbers of all lamps at a time.
_OF_CONE = ("count", "clear", "chord", "axis 0")
_MOST_ASIDE = 4
#: What _keep_apart() needs to know of a lamp besides the inputs of the part "aside".
_BOUNDS = ("towards", "reach", "flat", "used", "active", "above", "plane", *_OF_CONE)
#: What it decides.
_DECIDED = ("shown", "lit", "room", *_OF_CONE)


def _keep_apart(w, parts, lamps, at, widest):
    """Decides which lamps get closures, where, and how wide each may be, in a group that all models
    share; sets _DECIDED of each lamp."""
    kinds = {name: kind for name, kind in [*_SEEN, *_CODED, *_AXES, *_CONES]}
    kinds |= dict.fromkeys(_SLOT, "VECTOR")
    of_lamp = [*_BOUNDS, *parts.inputs("aside")]
    taken = [name for name in dict.fromkeys(of_lamp) if name in kinds]

    def sockets(names):
        return [
            [f"lamp {i} {name}", kinds.get(name, "FLOAT")]
            for i in range(len(lamps))
            for name in names
        ]

    def fill(inside, found):
        of_lamps = [{name: found[f"lamp {i} {name}"] for name in taken} for i in range(len(lamps))]
        _decide(inside, parts.on(inside, found), of_lamps, found["at"], widest)
        return {
            f"lamp {i} {name}": lamp[name] for i, lamp in enumerate(of_lamps) for name in _DECIDED
        }

    content = ["lamps apart", len(lamps), widest, taken, parts.data["aside"]]
    inputs = [["at", "VECTOR"], *sockets(taken)]
    group = make_group("lamps apart", content, inputs, sockets(_DECIDED), fill)
    given = {f"lamp {i} {name}": lamp[name] for i, lamp in enumerate(lamps) for name in taken}
    made = add_group(w, group, given | {"at": at}, "lamps apart")
    for i, lamp in enumerate(lamps):
        lamp |= {name: made[f"lamp {i} {name}"] for name in _DECIDED}


def _decide(w, parts, lamps, at, widest):
    """If two cones overlap, the lamp with the earlier slot, which is the wider one, gets a cone
    beside the other if it is flat and the other is much smaller; otherwise it is left to random
    directions.

    Goes from the last slot to the first, so that the empty slots, which are constant to Cycles,
    come first.
    """
    for lamp in lamps:
        lamp["taken"] = w.mix(lamp["active"], -_FAR, lamp["reach"])
    apart = {}
    for i, lamp in enumerate(lamps):
        for j, other in enumerate(lamps[i + 1 :], i + 1):
            distance = w.vector("DISTANCE", lamp["towards"], other["towards"], output="Value")
            distance = w.mix(_same_plane(w, lamp, other), distance, _FAR)
            apart[i, j] = apart[j, i] = w.mix(other["used"], _FAR, distance)
    for i, lamp in reversed(list(enumerate(lamps))):
        later = _Later(w)
        for j in range(len(lamps) - 1, i, -1):
            beside = w.math("SUBTRACT", apart[i, j], lamps[j]["taken"])
            later.add(beside, lamps[j])
        room = w.math("MINIMUM", later.room, later.others)
        free = w.math("LESS_THAN", lamp["reach"], room)
        if i < _MOST_ASIDE:
            free = w.math("MAXIMUM", free, _move_aside(w, parts, lamp, at, later))
        shown = w.math("MULTIPLY", lamp["active"], free)
        lamp["shown"] = shown
        lamp["lit"] = w.math("MULTIPLY", shown, lamp["above"])
        # No cone can be beside a lamp that has no closure.
        lamp["as_other"] = w.mix(shown, _FAR, lamp["reach"])
        room = w.math("MINIMUM", room, widest)
        for j in range(i - 1, -1, -1):
            beside = w.math("SUBTRACT", apart[i, j], lamps[j]["taken"])
            room = w.math("MINIMUM", room, beside)
        lamp["room"] = room


def _move_aside(w, parts, lamp, at, later):
    """Gives a flat lamp a single cone beside the nearest ball or sun, if they overlap; returns 1 if
    it has that, otherwise 0."""
    overlaps = w.math("LESS_THAN", later.room, lamp["reach"])
    # Constant where no later slot has a ball or a sun, so that Cycles removes what follows.
    has_later = w.math("LESS_THAN", later.room, _FAR - 0.1)
    # Part of a lamp that the horizon cuts may be hidden: that is left to random directions.
    whole = w.math("GREATER_THAN", lamp["clear"], w.math("SUBTRACT", lamp["count"], 0.01))
    alone = w.math("LESS_THAN", lamp["reach"], later.others)
    other = {"other": later.towards, "other_radius": later.radius}
    made = parts.add("aside", at=at, **lamp, **other)
    aside = w.math("MULTIPLY", lamp["flat"], has_later)
    for condition in (overlaps, whole, alone, made["fits"]):
        aside = w.math("MULTIPLY", aside, condition)
    new = {"count": 1.0, "clear": made["clear"], "chord": made["chord"]}
    lamp |= {name: w.mix(aside, lamp[name], value) for name, value in new.items()}
    lamp[_CONES[0][0]] = w.mix(aside, lamp[_CONES[0][0]], made["axis"], True)
    return aside


def wire(tree, data, normal, tangent, parameters, outputs_of_slots, title):
    """Adds a model's nodes as a group. Returns the outputs by name: the BSDF, and the Albedo where
    the model consists of Blender's own closures only.

    `data`: contents of nodes/*.json. `normal` and `tangent`: outputs that are 0 where the surface's
    own are meant. `parameters`: outputs or numbers by name. `outputs_of_slots`: four for each lamp.
    `title`: prefix of the names of the new groups.
    """
    kinds = {name: kind for part in data["parts"].values() for name, kind in part["inputs"]}
    kinds |= dict.fromkeys(data["bounds"], "FLOAT")
    values = {"Normal": (normal, "VECTOR"), "Tangent": (tangent, "VECTOR")}
    own = {name: f"parameter {name}" for name in parameters if name in kinds}
    values |= {own[name]: (parameters[name], kinds[name]) for name in own}
    placed = [[f"lamp {i} {part}" for part in _SLOT] for i in range(len(outputs_of_slots))]
    for names, slot in zip(placed, outputs_of_slots, strict=True):
        values |= {name: (output, "VECTOR") for name, output in zip(names, slot, strict=True)}

    def fill(w, found):
        of_slots = [[found[name] for name in names] for names in placed]
        given = {name: found[socket] for name, socket in own.items()}
        return _wired(w, data, found["Normal"], found["Tangent"], given, of_slots, title)

    inputs = [[name, kind] for name, (_, kind) in values.items()]
    outputs = [["BSDF", "SHADER"], *([] if "draw" in data["parts"] else [["Albedo", "VECTOR"]])]
    group = make_group(f"{title}: formulas", [data, inputs], inputs, outputs, fill, kept=True)
    w = Wiring(tree)
    made = add_group(w, group, {name: value for name, (value, _) in values.items()}, "Formulas")
    w.place_nodes()
    return made


def _wired(w, data, normal, tangent, parameters, of_slots, title):
    """Adds the nodes of a model; returns outputs by name, see wire()."""
    geometry = w.node("ShaderNodeNewGeometry")
    constants = svm_constants.add_values(w, geometry.outputs["Backfacing"])
    lists = {name: svm_constants.prepared(name, part) for name, part in data["parts"].items()}
    parts = Parts(w, lists, title, constants)
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
        given |= {"stands": w.math("LESS_THAN", bent, 1e-4)}
        given |= parts.add("base", **given)
        shaders += [_of_base(w, closure, given, surface) for closure in data["base"]]
    lamps = []
    # All closures of a shading point are sampled with the same numbers: they are added up, so they
    # need not be independent.
    given |= {f"u_{i}": number for i, number in enumerate(surface.drawn)}
    if of_slots:
        given |= parts.add("once", **given)
        given["anywhere"] = surface.anywhere
        frame = zip(("tangent", "bitangent", "normal"), surface.axes, strict=True)
        here = {"at": surface.place, "view": surface.view, "true": surface.true_normal}
        here |= dict(frame)
        given |= here | constants
        seen, lit = _seen_group(parts), _lamp_group(parts)
        for slot in of_slots:
            values = dict(zip(_SLOT, slot, strict=True))
            lamps.append(values | add_group(w, seen, here | values, "lamp seen"))
        _keep_apart(w, parts, lamps, surface.place, data["widest"])
    shaders.append(_rest(w, parts, surface, given, lamps, data["narrow"]))
    for lamp in lamps:
        shaders.append(add_group(w, lit, given | lamp, "lamp")["BSDF"])
    return {"BSDF": w.sum(shaders)}


def _of_base(w, closure, given, surface):
    """A closure of the base."""
    found = {name: given[of] for name, of in closure.items() if name != "kind"}
    if closure["kind"] == "cone":
        return w.toon(found["weight"], found["size"], surface.normal, found["smooth"], "DIFFUSE")
    stretched = (found["anisotropy"], surface.tangent) if "anisotropy" in found else None
    roughness = found.get("roughness", 0.0)
    return w.bsdf(closure["kind"], found["weight"], surface.normal, roughness, stretched)


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
