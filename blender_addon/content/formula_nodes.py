# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a model's formulas from Blender's own Math nodes, which Cycles runs on every device.

The tool writes formulas as lists of operations, in the extension's nodes/*.json, of which
part_groups.py makes node groups. Here these are wired to the surface frame and to the closures that
carry the result: one for a random direction, those of lamps (formula_lamps.py), and Blender's own
nodes for ideal reflection and refraction.
"""

import math

from . import formula_lamps, svm_constants
from .closure_nodes import within
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
        self.normal = self.unbent = w.vector("NORMALIZE", w.vector("ADD", normal, own))
        if parts.has("bend"):
            self.normal = _bent(parts, geometry, self.strand, self.unbent)
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
        return self.w.local(vector, self.axes)

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


def wire(tree, data, normal, tangent, parameters, outputs_of_slots, cones, title):
    """Adds a model's nodes as a group. Returns the outputs by name: the BSDF, and the Albedo where
    the model consists of Blender's own closures only.

    `data`: contents of nodes/*.json. `normal` and `tangent`: outputs that are 0 where the surface's
    own are meant. `parameters`: outputs or numbers by name. `outputs_of_slots`: four for each lamp.
    `cones`: how many each lamp may have. `title`: prefix of the names of the new groups.
    """
    kinds = {name: kind for part in data["parts"].values() for name, kind in part["inputs"]}
    values = {"Normal": (normal, "VECTOR"), "Tangent": (tangent, "VECTOR")}
    own = {name: f"parameter {name}" for name in parameters if name in kinds}
    values |= {own[name]: (parameters[name], kinds[name]) for name in own}
    placed = [
        [f"lamp {i} {part}" for part in formula_lamps.SLOT] for i in range(len(outputs_of_slots))
    ]
    for names, slot in zip(placed, outputs_of_slots, strict=True):
        values |= {name: (output, "VECTOR") for name, output in zip(names, slot, strict=True)}

    def fill(w, found):
        of_slots = [[found[name] for name in names] for names in placed]
        given = {name: found[socket] for name, socket in own.items()}
        return _wired(w, data, found["Normal"], found["Tangent"], given, of_slots, cones, title)

    inputs = [[name, kind] for name, (_, kind) in values.items()]
    outputs = [["BSDF", "SHADER"], *([] if "draw" in data["parts"] else [["Albedo", "VECTOR"]])]
    group = make_group(
        f"{title}: formulas", [data, inputs, cones], inputs, outputs, fill, kept=True
    )
    w = Wiring(tree)
    made = add_group(w, group, {name: value for name, (value, _) in values.items()}, "Formulas")
    w.place_nodes()
    return made


def _wired(w, data, normal, tangent, parameters, of_slots, cones, title):
    """Adds the nodes of a model; returns outputs by name, see wire()."""
    geometry = w.node("ShaderNodeNewGeometry")
    constants = svm_constants.add_values(w, geometry.outputs["Backfacing"])
    lists = {name: svm_constants.prepared(name, part) for name, part in data["parts"].items()}
    parts = Parts(w, lists, title, constants)
    bounds = {name: data["bounds"].get(name, (None, None)) for name in parameters}
    parameters = {name: within(w, value, *bounds[name]) for name, value in parameters.items()}
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
    given |= parts.add("once", **given)
    if of_slots:
        given["anywhere"] = surface.anywhere
        frame = zip(("tangent", "bitangent", "normal"), surface.axes, strict=True)
        here = {"at": surface.place, "view": surface.view, "true": surface.true_normal}
        here |= dict(frame)
        given |= here | constants
        lamps = formula_lamps.seen(w, parts, of_slots, cones, here, data["widest"])
    others = [_rest(w, parts, surface, given, lamps, data["narrow"])]
    others += formula_lamps.closures(w, parts, lamps, cones, given)
    if parts.has("whole"):
        others = [w.shown(parts.add("whole", **parameters)["others"], w.sum(others))]
    return {"BSDF": w.sum(shaders + others)}


def _of_base(w, closure, given, surface):
    """A closure of the base."""
    found = {name: given[of] for name, of in closure.items() if name not in ("kind", "along")}
    stands = found.pop("stands", None)
    if "f0" in found:
        # Cycles bends the normal itself.
        metal = w.metal(closure["kind"], **found, normal=surface.unbent, tangent=surface.tangent)
        return w.shown(stands, metal)
    if closure["kind"] == "cone":
        return w.toon(found["weight"], found["size"], surface.normal, found["smooth"], "DIFFUSE")
    tangent = surface.tangent
    if closure.get("along") == "view":
        # Cycles takes the part across the normal, which the view alone does not always have.
        tangent = w.vector("ADD", surface.view, w.scaled(tangent, 1e-3))
    stretched = (found["anisotropy"], tangent) if "anisotropy" in found else None
    roughness = found.get("roughness", 0.0)
    bsdf = w.bsdf(closure["kind"], found["weight"], surface.normal, roughness, stretched)
    return bsdf if stands is None else w.shown(stands, bsdf)


def _rest(w, parts, surface, given, lamps, narrow):
    """The closure of the sampled direction, which carries all light that the lamps' closures do
    not."""
    drawn = parts.add("draw", **given)
    ray, here = surface.world(drawn["drawn"]), given | {"wi": drawn["drawn"]}
    if "weight" not in drawn:
        at = parts.add("value", **here)
    elif lamps:
        at = parts.add("density", **here)
    height = w.vector("DOT_PRODUCT", ray, surface.true_normal, output="Value")
    # Rays can leave hairs in every direction.
    hidden = w.math(
        "MULTIPLY", w.math("LESS_THAN", height, 0.0), w.math("SUBTRACT", 1.0, surface.strand)
    )
    # From the last slot to the first, as formula_lamps decides which are shown.
    met = 0.0
    if lamps:
        here = {"at": surface.place, "ray": ray, "density": at["density"]}
    for lamp in reversed(lamps):
        seen = here | lamp
        inside = parts.add("met", **seen | parts.add("lit", **seen))["met"]
        met = w.math("MAXIMUM", met, w.math("MULTIPLY", inside, lamp["shown"]))
    lost = w.math("MAXIMUM", hidden, met)
    chance = w.math("FRACT", w.math("MULTIPLY", given["u_0"], 4096.0))
    weight = {"value": drawn["weight"], "density": 1.0} if "weight" in drawn else at
    colour = parts.add("rest", **weight, u=chance, lost=lost)["color"]
    size = narrow * 2 / math.pi
    return w.toon(colour, size, w.half(ray, surface.view))


def numbers(constants):
    """The parameter values that formulas take as numbers, that is, all but choices."""
    return {name: value for name, value in constants.items() if not isinstance(value, str)}
