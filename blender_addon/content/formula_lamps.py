# SPDX-License-Identifier: GPL-3.0-or-later
"""The lamps of Formula Nodes: how each looks from the shading point, which of them get closures,
and the Toon BSDFs that carry their light (generator/forms/node_cones.h and node_lamps.h have the
formulas)."""

from ..lamps import slots
from . import svm_constants
from .part_groups import PART, add_group, make_group

#: Outputs of the group that computes how a slot's lamp is seen from the shading point.
_SEEN = [
    ["towards", "VECTOR"],
    ["part_across", "FLOAT"],
    ["part_along", "FLOAT"],
    ["drop", "FLOAT"],
    ["of_cones", "FLOAT"],
    ["chord", "FLOAT"],
    ["reach", "FLOAT"],
    ["inner", "FLOAT"],
    ["flat", "FLOAT"],
    ["used", "FLOAT"],
    ["active", "FLOAT"],
    ["above", "FLOAT"],
    ["aim", "VECTOR"],
    ["layout", "FLOAT"],
    ["moved", "FLOAT"],
    ["clear", "FLOAT"],
]
#: Vectors of a slot, and what its shape's first number consists of.
SLOT = ("place", "turn", "scale", "shape")
_CODED = [["kind", "FLOAT"], ["most", "FLOAT"], ["cluster", "FLOAT"]]
_AXES = [
    ["across", "VECTOR"],
    ["along", "VECTOR"],
    ["away", "VECTOR"],
    ["half_across", "FLOAT"],
    ["half_along", "FLOAT"],
]
#: The parts of a lamp, each with a cone: inputs of the parts "flat" and "cone_at".
_PARTS = [
    {"index": float(i), "side_across": 2.0 * (i % 2) - 1, "side_along": 2.0 * (i // 2) - 1}
    for i in range(slots.MOST_CONES)
]
#: Outputs of the part "lit". It is computed again wherever it is needed: the numbers of eight lamps
#: would not fit SVM's stack beside the others.
_LIT = [["lit_place", "VECTOR"], ["lit_across", "FLOAT"], ["lit_along", "FLOAT"]]
#: Larger than the angle between any two directions.
_FAR = 4.0


def _decoded(w, shape, cones):
    """The numbers that lamps/slots.py combines in the first number of a slot's shape. `cones`: how
    many a lamp may have here."""
    whole = w.separate(shape)[0]
    code = w.math("FLOOR", w.math("DIVIDE", whole, slots.CODE))
    cluster = w.math("FLOOR", w.math("DIVIDE", code, slots.CODE))
    most = w.math("MULTIPLY_ADD", cluster, -slots.CODE, w.math("ADD", code, 1.0))
    return {
        "kind": w.math("MULTIPLY_ADD", code, -slots.CODE, whole),
        "most": w.math("MINIMUM", most, float(cones)),
        "cluster": cluster,
    }


def _seen_group(parts, cones):
    """The group that computes the cones of directions towards a slot's lamp."""
    vectors = (*SLOT, "at", "view", "true")
    parts_of_seen = ("axes", "lit", "cone")

    def fill(w, found):
        here = parts.on(w, found)
        known = found | _decoded(w, found["shape"], cones)
        for part in parts_of_seen:
            known |= here.add(part, **known)
        return {name: known[name] for name, _ in outputs}

    outputs = _SEEN + _CODED + _AXES
    content = ["seen", slots.CODE, cones, [parts.data[name] for name in parts_of_seen]]
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


#: Inputs of the groups below, besides those of the model's formula.
_VECTORS = (*SLOT, "towards", "aim", "at", "view", "tangent", "bitangent", "normal", "anywhere")
_NUMBERS = (
    *("kind", "most", "layout", "moved", "part_across", "part_along", "of_cones", "drop"),
    *("chord", "flat", "clear", "room", "u_0", "u_1", "u_2"),
)


def _inputs(parts):
    """Names and kinds of what a lamp's closures need."""
    inputs = [[name, "VECTOR"] for name in _VECTORS] + [[name, "FLOAT"] for name in _NUMBERS]
    inputs += _AXES
    inputs += [[name, kind] for name, kind in parts.inputs("value").items() if name != "wi"]
    known = {name for name, _ in inputs}
    return inputs + [[name, "FLOAT"] for name in svm_constants.VALUES if name not in known]


def _part_group(parts):
    """The group that makes the closure of a part of a lamp: a cone, which carries the model's value
    at a point of the part, or what random directions leave of it."""
    inputs = _inputs(parts) + _LIT + [[name, "FLOAT"] for name in _PARTS[0]]

    def fill(w, found):
        here = parts.on(w, found)
        point = _point_of(w, found["towards"], found["drop"], found["anywhere"], found["u_0"])
        on_flat = here.add("flat", **found)
        point = w.mix(found["flat"], point, on_flat["wi"], True)
        frame = (found["tangent"], found["bitangent"], found["normal"])
        at_point = here.add("value", **(found | {"wi": w.local(point, frame)}))
        placed = here.add("cone_at", **found)
        pick = w.math("FRACT", w.math("MULTIPLY", found["u_2"], 64.0))
        beam = here.add("beam", **(found | placed | {"wi": point}))
        known = found | at_point | placed | on_flat | beam | {"pick": pick}
        lobe = here.add("lobe", **known)
        axis = w.mix(lobe["whole"], placed["axis"], found["aim"], True)
        return {"BSDF": w.toon(lobe["color"], lobe["size"], w.half(axis, found["view"]))}

    used = ("value", "flat", "cone_at", "beam", "lobe")
    content = ["part of lamp", {name: parts.data[name] for name in used}]
    title = f"{parts.title}: part of lamp"
    return make_group(title, content, inputs, [["BSDF", "SHADER"]], fill)


def _lamp_group(parts, cones):
    """The group that makes a lamp's closures, one for each of its parts, of which there may be
    `cones`. Cycles skips the computations of closures whose factor is 0."""
    part, inputs = _part_group(parts), _inputs(parts) + [["lit", "FLOAT"]]

    def fill(w, found):
        here, closures = parts.on(w, found), []
        count = here.add("count", layout=found["layout"])["count"]
        found = found | here.add("lit", **found)
        for i, place in enumerate(_PARTS[:cones]):
            closure = add_group(w, part, found | place, f"part {i}")["BSDF"]
            if i > 0:
                # The first factor is a constant, with which Cycles removes what a lamp never has.
                may_exist = w.math("GREATER_THAN", found["most"], i + 0.5)
                exists = w.math("MULTIPLY", may_exist, w.math("GREATER_THAN", count, i + 0.5))
                closure = w.shown(exists, closure)
            closures.append(closure)
        return {"BSDF": w.shown(found["lit"], w.sum(closures))}

    content = ["lamp", cones, parts.data["count"], parts.data["lit"], part[PART]]
    return make_group(f"{parts.title}: lamp", content, inputs, [["BSDF", "SHADER"]], fill)


def _pair_group():
    """The group that computes the angle between two lamps, as far as they can be in each other's
    way: not if the later one is not in use, or both are of one cluster (lamps/slots.py)."""

    def fill(w, found):
        same = w.math("COMPARE", found["cluster"], found["other_cluster"], 0.5)
        same = w.math("MULTIPLY", same, w.math("GREATER_THAN", found["cluster"], 0.5))
        angle = w.vector("DISTANCE", found["towards"], found["other_towards"], output="Value")
        return {"angle": w.mix(found["used"], _FAR, w.mix(same, angle, _FAR))}

    inputs = [["towards", "VECTOR"], ["other_towards", "VECTOR"]]
    inputs += [[name, "FLOAT"] for name in ("cluster", "other_cluster", "used")]
    return make_group("lamp pair", ["lamp pair"], inputs, [["angle", "FLOAT"]], fill)


#: The later lamps, as seen along a lamp's axis: room, direction and radius of the nearest ball or
#: sun, and the room that all others leave; with the values for no lamps. Flat lamps are not told
#: apart from each other, which would need more numbers than SVM can keep for eight of them.
_LATER = {"room": _FAR, "others": _FAR, "nearest": (0.0, 0.0, 0.0), "radius": 0.0}


def _later_group():
    """The group that adds a lamp to _LATER. In a tree with all lamps, each of its nodes would take
    Blender ten times as long to add."""

    def fill(w, found):
        beside = w.math("SUBTRACT", found["angle"], found["taken"])
        of_flat = w.mix(found["flat"], _FAR, beside)
        beside = w.mix(found["flat"], beside, _FAR)
        closer = w.math("LESS_THAN", beside, found["room"])
        others = w.math("MINIMUM", found["others"], of_flat)
        return {
            "room": w.math("MINIMUM", found["room"], beside),
            "others": w.math("MINIMUM", others, w.math("MAXIMUM", beside, found["room"])),
            "nearest": w.mix(closer, found["nearest"], found["towards"], True),
            "radius": w.mix(closer, found["radius"], found["as_other"]),
        }

    state = [[name, "VECTOR" if name == "nearest" else "FLOAT"] for name in _LATER]
    inputs = [[name, "FLOAT"] for name in ("angle", "taken", "flat", "as_other")]
    inputs += [["towards", "VECTOR"], *state]
    return make_group("lamp later", ["lamp later", _FAR], inputs, state, fill)


#: What changes where a lamp has a cone beside another lamp. Only so many lamps can have that, from
#: the widest, since SVM keeps the numbers of all lamps at a time.
_MOVED = ("layout", "clear", "of_cones", "aim")
_MOST_ASIDE = 4
#: What _keep_apart() needs to know of a lamp besides the inputs of the part "aside".
_BOUNDS = ("towards", "reach", "flat", "used", "active", "above", "cluster", *_MOVED)
#: What it decides.
_DECIDED = ("shown", "lit", "room", *_MOVED)


def _keep_apart(w, parts, lamps, at, widest):
    """Decides which lamps get closures, where, and how wide each may be, in a group that all models
    share; sets _DECIDED of each lamp."""
    kinds = {name: kind for name, kind in [*_SEEN, *_CODED, *_AXES]}
    kinds |= dict.fromkeys(SLOT, "VECTOR")
    of_lamp = [*_BOUNDS, *parts.inputs("lit"), *parts.inputs("aside")]
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

    used = [parts.data[name] for name in ("lit", "aside")]
    content = ["lamps apart", len(lamps), widest, taken, used]
    inputs = [["at", "VECTOR"], *sockets(taken)]
    group = make_group("lamps apart", content, inputs, sockets(_DECIDED), fill)
    given = {f"lamp {i} {name}": lamp[name] for i, lamp in enumerate(lamps) for name in taken}
    made = add_group(w, group, given | {"at": at}, "lamps apart")
    for i, lamp in enumerate(lamps):
        lamp |= {name: made[f"lamp {i} {name}"] for name in _DECIDED}


def _decide(w, parts, lamps, at, widest):
    """If two cones overlap, the lamp with the earlier slot, which is the wider one, gets a cone
    beside the other if it is flat and the other is a much smaller ball or sun; otherwise it is left
    to random directions.

    Goes from the last slot to the first, so that the empty slots, which are constant to Cycles,
    come first.
    """
    for lamp in lamps:
        lamp["taken"] = w.mix(lamp["active"], -_FAR, lamp["reach"])
    pair, step, angles = _pair_group(), _later_group(), {}
    for i, lamp in enumerate(lamps):
        for j, other in enumerate(lamps[i + 1 :], i + 1):
            of_other = {f"other_{name}": other[name] for name in ("towards", "cluster")}
            given = lamp | of_other | {"used": other["used"]}
            angles[i, j] = angles[j, i] = add_group(w, pair, given, "")["angle"]
    for i, lamp in reversed(list(enumerate(lamps))):
        later = _LATER
        for j in range(len(lamps) - 1, i, -1):
            later = add_group(w, step, lamps[j] | later | {"angle": angles[i, j]}, "")
        room = w.math("MINIMUM", later["room"], later["others"])
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
            beside = w.math("SUBTRACT", angles[i, j], lamps[j]["taken"])
            room = w.math("MINIMUM", room, beside)
        lamp["room"] = room


def _move_aside(w, parts, lamp, at, later):
    """Gives a flat lamp a single cone beside the nearest ball or sun, if they overlap; returns 1 if
    it has that, otherwise 0."""
    overlaps = w.math("LESS_THAN", later["room"], lamp["reach"])
    # Constant where no later slot has a ball or a sun, so that Cycles removes what follows.
    has_later = w.math("LESS_THAN", later["room"], _FAR - 0.1)
    alone = w.math("LESS_THAN", lamp["reach"], later["others"])
    other = {"other": later["nearest"], "other_radius": later["radius"]}
    other |= parts.add("lit", at=at, **lamp)
    made = parts.add("aside", at=at, **lamp, **other)
    aside = w.math("MULTIPLY", lamp["flat"], has_later)
    for condition in (overlaps, alone, made["fits"]):
        aside = w.math("MULTIPLY", aside, condition)
    new = {"layout": 1.0, "clear": made["clear"], "of_cones": made["of_cones"]}
    lamp |= {name: w.mix(aside, lamp[name], value) for name, value in new.items()}
    lamp["aim"] = w.mix(aside, lamp["aim"], made["axis"], True)
    return aside


def seen(w, parts, of_slots, cones, here, widest):
    """How the lamps look from the shading point, and which of them get closures: a dictionary of
    outputs for each. `of_slots`: the outputs of each slot, in the order of SLOT. `cones`: how many
    each lamp may have. `here`: the shading point."""
    group, lamps = _seen_group(parts, cones), []
    for slot in of_slots:
        values = dict(zip(SLOT, slot, strict=True))
        lamps.append(values | add_group(w, group, here | values, "lamp seen"))
    _keep_apart(w, parts, lamps, here["at"], widest)
    return lamps


def closures(w, parts, lamps, cones, given):
    """The closures of the lamps that seen() returned for this number of cones. `given`: what the
    model's formula needs."""
    if not lamps:
        return []
    group = _lamp_group(parts, cones)
    return [add_group(w, group, given | lamp, "lamp")["BSDF"] for lamp in lamps]
