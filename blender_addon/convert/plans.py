# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the model that replaces a node, with its values and links, and estimates the error."""

import functools
import itertools
import math
from dataclasses import replace

import numpy as np

from .. import lamps
from ..common import editable
from ..common.i18n import Sentence, in_percent, say
from ..groups import model_nodes
from ..nearest import layer, native_bsdf, specular
from ..nearest.native_bsdf import Native
from ..nearest.nearest_model import (
    base_of,
    candidates,
    matte_of,
    mattes_of,
    nearest,
    scale_of,
    with_width,
)
from ..packs import device, pack
from ..packs.parameter_values import canonical
from ..trees import animation, shader_trees
from .errors import all_found, beside, errors_below, errors_of, of_mixture, taken_by
from .filter_glossy import is_filtered
from .instances import Instances
from .kept_effects import TRANSMISSION, effective_sockets, subsurface_of, transmits, uppers_of
from .node_values import (
    ANISOTROPY,
    KINDS,
    KNOWN_SOCKETS,
    STAYING,
    Inputs,
    Refused,
    both_linked,
    check_off,
    color_of,
    given_of,
    glows,
    is_transparent,
    varying_of,
)
from .planned_node import Part, Plan
from .references import HELPS
from .seen_node import SeenNode

#: The model of smooth glass.
_CLEAR = "fresnel_dielectric"


def _plan_glass(material, node, inputs):
    inputs.setting("mute")
    inputs.check_unknown(KNOWN_SOCKETS["glass"])
    if inputs.value("Roughness") > 1e-3:
        raise Refused(say("the model of rough glass is darker under lamps"))
    if inputs.value("Thin Film Thickness") != 0:
        raise Refused(say("it has {what}", what=Sentence("Thin Film")))
    # Blender's glass tints both reflected and transmitted light.
    tints = ("refracted", "reflected")
    if inputs.follows("Color"):
        return _glass_of(material, node, inputs, {}, dict.fromkeys(tints, "Color"))
    color = tuple(max(c, 0.0) for c in inputs.constant("Color"))
    return _glass_of(material, node, inputs, dict.fromkeys(tints, color), {})


def _is_clear(inputs):
    """Whether a Principled node transmits all light that enters it, as glass does."""
    known = inputs.constant(TRANSMISSION) if TRANSMISSION in inputs else None
    return known is not None and known >= 1 and inputs.constant("Metallic") == 0


def _plan_clear(material, node, inputs):
    """The Plan for a Principled node that is smooth glass."""
    inputs.setting("mute")
    inputs.check_unknown(KNOWN_SOCKETS["principled"])
    check_off(inputs)
    if inputs.value("Roughness") > 1e-3:
        raise Refused(say("the model of rough glass is darker under lamps"))
    if inputs.value("Specular IOR Level") != 0.5:
        raise Refused(say("it has {what}", what=Sentence("Specular IOR Level")))
    if inputs.value("Specular Tint", (1.0, 1.0, 1.0)) != (1, 1, 1):
        raise Refused(say("it has {what}", what=Sentence("Specular Tint")))
    # Such a node tints the transmitted light alone, at each surface by the root of its colour.
    more = {"glows": glows(inputs), "transparent": is_transparent(inputs)}
    more["uppers"] = uppers_of(inputs)
    if inputs.follows("Base Color"):
        more["root"] = ("refracted", "Base Color")
        return _glass_of(material, node, inputs, {}, {}, **more)
    tint = tuple(min(max(c, 0.0), 1.0) ** 0.5 for c in inputs.constant("Base Color"))
    return _glass_of(material, node, inputs, {"refracted": tint}, {}, **more)


def _glass_of(material, node, inputs, tints, links, **more):
    """The Plan for smooth glass. `tints`: values of the model's tints; `links`: those that a socket
    of the node controls."""
    if _CLEAR not in pack.model_names():
        raise Refused(say("this extension lacks the models that are near: {models}", models=_CLEAR))
    values = tints | ({} if inputs.follows("IOR") else {"ior": inputs.constant("IOR")})
    part = Part(_CLEAR, values, {"ior": "IOR", **links})
    found = {"material": material, "node": node, "error": 0.0, "least_error": 0.0}
    return Plan(**vars(part) | more, **found)


def _check_ranges(parts):
    """Raises Refused if a parameter would have a value that its model does not take."""
    for part in parts:
        for name, value in part.values.items():
            parameter = pack.model(part.model).parameters.get(name, {})
            low, high = parameter.get("min"), parameter.get("max")
            if low is None or all(low <= c <= high for c in np.atleast_1d(value)):
                continue
            said = say(
                "{parameter} of {model} would be {value}, and may be {low} to {high}",
                parameter=parameter["label"],
                model=part.label,
                value=f"{np.max(value):g}",
                low=f"{low:g}",
                high=f"{high:g}",
            )
            raise Refused(said)


@functools.cache
def _shown(without_osl):
    """Whether a scene with or without OSL can show a model with some values, as a function of both:
    a pack cut to a scene may lack the model, and without OSL some choices are shown by a twin. The
    same function each time, as nearest() keeps what it found by it."""

    def has(model, values):
        if model not in pack.model_names():
            return False
        form = pack.model(model).native_form
        return form is None or not without_osl or form.refusal(canonical(values)) is None

    return has


def _widths(inputs, native, width, factor):
    """Part.widths of a fit; `native`: the first Native of the fit."""
    rough = _follows_roughness(inputs, native)
    stretched = native.kind == "principled" and inputs.follows(ANISOTROPY[inputs.kind][0])
    if not rough and not stretched:
        return
    if not rough:
        factor *= max(native.roughness, 1e-3) ** width.power
    for name, sign in ((width.name, 1), (width.across, -1)):
        if name:
            power = sign * width.stretched if width.across else 0
            own = factor if stretched else factor * native.stretch**power
            law = (width.power if rough else 0, width.low, width.high)
            yield name, own, *law, -power if stretched else 0


def _follows_roughness(inputs, native):
    """Whether a link or an animation controls the roughness of a node that is taken for
    `native`."""
    return inputs.reaches(_roughness_of(inputs, native))


def _roughness_of(inputs, native):
    """The socket of that roughness: the base of a Principled node has another one."""
    is_base = native.kind == "diffuse" and "Base Color" in inputs
    return "Diffuse Roughness" if is_base else "Roughness"


def _base_part(inputs, native, fit, values, color):
    """The Part for the base beneath a layer, given the Fit to the base."""
    width = fit.candidate.width
    widths = tuple(_widths(inputs, matte_of(native), width, fit.factor)) if width else ()
    links = dict.fromkeys(fit.candidate.links, color)
    return Part(fit.candidate.model, values, links, widths, rough="Diffuse Roughness")


def _varying_part(inputs, varying, natives, colors, has, color):
    """The Part for a plastic one of whose specular inputs is linked, and its VaryingFit."""
    native, others = natives[0], ("Roughness", "Diffuse Roughness", ANISOTROPY["principled"][0])
    if len(natives) > 1:
        raise both_linked(varying.socket, next(name for name in others if inputs.follows(name)))
    candidate = next((c for c in candidates(native, has) if c.base), None)
    fit = specular.fit(native, varying, candidate, colors, has) if candidate else None
    if fit is None:
        inputs.value(varying.socket)  # says that it is linked
    values = with_width(fit.base.candidate, matte_of(native), fit.base.factor)
    base = _base_part(inputs, native, fit.base, values, color)
    laws = {"laws": fit.laws, "varying": varying}
    return Part(specular.MODEL, fit.values, {}, (), base, fit.rest, **laws), fit


def _part(inputs, native, fit, color):
    """The Part for a Fit to a node; `native`: the first Native of the fit; `color`: the socket of
    its colour."""
    candidate, factor, width = fit.candidate, fit.factor, fit.candidate.width
    links = {name: color if s == "Color" else s for name, s in candidate.links.items()}
    values = with_width(candidate, native, factor)
    widths = tuple(_widths(inputs, native, width, factor)) if width else ()
    rough = _follows_roughness(inputs, native)
    base, below = None, base_of(candidate, native, rough)
    if below:
        base = _base_part(inputs, native, candidate.base, below.values, color)
    again = ()
    if "again" in values and (rough or inputs.reaches(color)):
        slope, offset = (tuple(law.tolist()) for law in native_bsdf.facet_law(native))
        mean = layer.mean_albedo()
        if not rough:
            mean = (float(native_bsdf.mean_facet_albedo(native.alpha)),)
        again = slope, offset, mean, color
    rest = below.rest if below else ()
    scale, flat = scale_of(candidate, native), ""
    if candidate.is_flat and inputs.reaches(color):
        links, flat = {}, color
    rough_socket = _roughness_of(inputs, native)
    return Part(
        candidate.model, values, links, widths, base, rest, again, scale, flat, rough_socket
    )


def _is_closure(part):
    """Whether closures of Cycles equal the part's model, whatever is linked to it. Roughnesses
    follow one socket, which does not change their ratio. Interreflection that follows the colour
    (`again`) is never so much that no closures equal it, which black stands for."""
    values = part.values | dict.fromkeys(part.links)
    if part.again:
        values |= {"again": (0.0, 0.0, 0.0)}
    return pack.model(part.model).is_closure(values)


def _lacking(natives, colors):
    """Why no model is near: a sentence."""
    if fit := nearest(natives, colors, False, _shown(False)):
        return say(
            "its nearest model, {model}, which sends {percent} % of the light in other directions "
            "than the node, needs Open Shading Language for its values",
            model=pack.model(fit.candidate.model).label,
            percent=in_percent(min(max(errors_of(all_found(fit))), 1.0)),
        )
    models = dict.fromkeys(c.model for c in candidates(natives[0]))
    return say("this extension lacks the models that are near: {models}", models=", ".join(models))


#: Values to which those of a node are changed, one after the other, to find what makes an error
#: large: as in a new node, but for the colour; and the socket with this value.
_PLAIN = {
    "color": ((0.5, 0.5, 0.5), ""),
    "tint": ((1.0, 1.0, 1.0), "Specular Tint"),
    "diffuse_roughness": (0.0, "Diffuse Roughness"),
    "stretch": (1.0, ""),
    "f0": (0.04, "IOR"),
    "metallic": (0.0, "Metallic"),
    "roughness": (0.5, "Roughness"),
}


def _cause(kind, given, looks, error, error_without):
    """The name of the socket that makes an error large: as in a new node, it would at least halve
    the error. "" if there is none. `kind`: that of the node."""
    new = _PLAIN | ({"roughness": (0.0, "Roughness")} if given["kind"] == "diffuse" else {})
    for name, (value, socket) in new.items():
        had = {given.get(name, value), *(look.get(name, value) for look in looks)}
        if had != {value} and error_without(**{name: value}) < 0.5 * error:
            if name == "stretch":
                return ANISOTROPY[kind][0]
            is_edge = name == "tint" and kind == "metallic"
            return "Edge Tint" if is_edge else socket or color_of(kind)
    return ""


def _plan_node(material, node, inputs):
    if inputs.kind == "glass":
        return _plan_glass(material, node, inputs)
    if inputs.kind == "principled" and _is_clear(inputs):
        return _plan_clear(material, node, inputs)
    given, looks, ends = given_of(node, inputs)
    color = color_of(inputs.kind)
    _, colors = inputs.colors(color)

    has = _shown(device.lacks_osl(lamps.current_scene()))
    is_principled = inputs.kind == "principled"
    varying = varying_of(inputs) if is_principled else None
    subsurface = subsurface_of(inputs) if is_principled else 0.0

    def looked(looks=looks, **other):
        """The Natives of the node with these values changed."""
        found = tuple(Native(**given | look | other) for look in looks)
        if not found:
            return ()
        # Without a highlight, roughness and anisotropy of a Principled node have no effect.
        if found[0].is_matte and found[0].kind == "principled":
            return mattes_of(found)
        if found[0].metallic == 1:
            found = tuple(replace(native, diffuse_roughness=0.0) for native in found)
        return tuple(dict.fromkeys(found))

    def near(**other):
        """The Part for the node with these values changed, and its Fit."""
        natives = looked(**other)
        if varying and natives[0].kind == "principled" and natives[0].metallic == 0:
            return _varying_part(inputs, varying, natives, colors, has, color)
        if varying and varying.socket == specular.TINT.socket and natives[0].metallic > 0:
            inputs.value(varying.socket)  # says that it is linked
        also = tuple(n for n in looked(ends, **other) if n not in natives)
        fit = nearest(natives, colors, inputs.reaches(color), has, also, subsurface > 0)
        if fit is None:
            raise Refused(_lacking(natives, colors))
        part = _part(inputs, natives[0], fit, color)
        follows = part.base and part.base.widths or not any(natives[0].color)
        if len({native.diffuse_roughness for native in natives}) > 1 and not follows:
            inputs.value("Diffuse Roughness")  # says that it is linked
        return part, fit

    def error_without(**other):
        """The error of one model for the node with these values changed."""
        shades = (other["color"],) if "color" in other else colors
        fit = nearest(looked(**other), shades, False, has, (), subsurface > 0)
        return math.inf if fit is None else max(errors_of(all_found(fit)))

    def plan(part, fits, errors, **more):
        if inputs.follows(color) and any(fit.lost for fit in fits):
            raise Refused(
                say(
                    "{socket} is linked, and its nearest model has more than one colour",
                    socket=Sentence(color),
                )
            )
        more |= {"material": material, "node": node}
        more |= {"error": max(errors), "least_error": min(errors)}
        more |= {"anisotropic": any(look["stretch"] != 1 for look in looks)}
        blurred = any(is_filtered(Native(**given, **look)) for look in looks)
        models = (one for one in (part, more.get("metal")) if one)
        more |= {"filtered": blurred and not all(map(_is_closure, models))}
        cause = functools.cache(
            functools.partial(_cause, inputs.kind, given, looks, max(errors), error_without)
        )
        return Plan(**vars(part), **more, cause=cause)

    if not is_principled:
        part, fit = near()
        return plan(part, [fit], errors_of(all_found(fit)))
    more = {"glows": glows(inputs), "transparent": is_transparent(inputs)}
    more["uppers"] = uppers_of(inputs)
    more |= {"subsurface": subsurface, "transmits": transmits(inputs)}
    taken = taken_by(more["uppers"], inputs)
    through = (0.0,)
    if more["transmits"]:
        through = tuple(np.clip(inputs.ends(TRANSMISSION), 0, 1))
    single = None
    if not inputs.follows("Metallic"):
        part, fit = near()
        is_pure = given["metallic"] in (0, 1)
        found = beside(fit.found, through)
        alone = not (varying or subsurface or more["transmits"])
        if is_pure or alone and not (fit.lost and inputs.follows(color)):
            errors = errors_below(itertools.chain(*found), taken)
            single = plan(part, [fit], errors, **more)
        if is_pure:
            return single
    (part, plain), (metal, fit) = near(metallic=0.0), near(metallic=1.0)
    plastics = beside(plain.found, through)
    if (share := inputs.mean("Metallic")) is None:
        errors = errors_below(itertools.chain(*plastics, *fit.found), taken)
    else:
        share = min(max(share, 0.0), 1.0)
        of_colors = zip(plastics, fit.found, strict=True)
        pairs = (pair for both in of_colors for pair in itertools.product(*both))
        errors = errors_below([of_mixture(share, *pair) for pair in pairs], taken)
    mixed = plan(part, [plain, fit], errors, metal=metal, **more)
    return mixed if single is None or mixed.error < single.error else single


def plan(materials):
    """A Plan for each visible Diffuse, Glossy, Metallic, Principled or Glass node of these
    materials, also of those in node groups, once each. Refused are other reflecting nodes, and
    group nodes with one of the five inside if their groups are linked from another file."""
    plans, instances, readers = {}, Instances(), animation.Readers()
    for material in materials:
        for node in _convertible(material):
            place = node.as_pointer()
            if place in plans and not plans[place].refusal:
                continue
            try:
                if why := editable.refusal(material, node.id_data):
                    raise Refused(why)
                if shader_trees.shading(material) is None:
                    raise Refused(shader_trees.NODES_OFF)
                if getattr(node, "node_tree", None) is not None:
                    raise Refused(editable.refusal(node.node_tree))
                if node.bl_idname not in KINDS:
                    raise Refused(
                        say("only Principled, Glossy, Metallic, Diffuse and Glass nodes convert")
                    )
                withins = [instance.within for instance in instances.of(node)]
                inputs = Inputs(node, withins)
                made = _plan_node(material, node, inputs)
                _check_ranges(made.parts)
                made = _with_readers(made, inputs, readers)
            except Refused as why:
                made = Plan(material=material, node=node, refusal=why.args[0])
            else:
                made = _of_group(made)
            plans[place] = replace(made, seen=SeenNode(material, node, instances))
    return list(plans.values())


def _with_readers(made, inputs, readers):
    """The Plan with what its row says of drivers that read the node's values, and that apply()
    can't redirect."""
    direct, read, names = made.direct, [], {}
    for socket in made.node.inputs:
        if shader_trees.is_driven(socket):
            continue  # its own value has no effect
        moves = socket.name in made.kept and inputs.moves(socket.name)
        found = readers.stuck if moves or socket.name in direct else readers.of
        if blocks := found(socket):
            read.append(socket.name)
            names |= dict.fromkeys(block.name for block in blocks)
    return replace(made, read=tuple(read), readers=tuple(names))


def _of_group(made):
    """The Plan with what its row says of the group that the node is in."""
    tree = made.node.id_data
    if tree.is_embedded_data:
        return made
    others = tuple(m for m in model_nodes.users_of(tree) if m != made.material)
    effective = effective_sockets(made.node, made.effects)
    kept = {name for socket in made.kept for name in _group_inputs(made.node.inputs[socket])}
    lost = [name for socket in effective for name in _group_inputs(socket) if name not in kept]
    return replace(made, others=others, unused=tuple(dict.fromkeys(lost)))


def _group_inputs(socket):
    """The names of the inputs of its node group on which a socket depends."""
    found, seen, waiting = [], set(), [shader_trees.reach(socket)]
    while waiting:
        reached = waiting.pop()
        if reached.output is None or reached in seen:
            continue
        seen.add(reached)
        if reached.node.bl_idname == "NodeGroupInput":
            found.append(reached.output.name)
        else:
            waiting += [shader_trees.reach(s, reached.within) for s in reached.node.inputs]
    return found


def _stays(node):
    """Whether a node is a model, or what can stay beside models."""
    return node.bl_idname in STAYING or HELPS in node or model_nodes.is_ours(node)


def _convertible(material):
    """The nodes of a material for which there is a Plan, in the order of its trees. In place of
    nodes in a group that is linked from another file, the group node."""
    if material.node_tree is None:
        return []
    found = set()
    for shown in shader_trees.shown_by(material.node_tree):
        locked = (group for group in shown.within if not editable.keeps_changes(group.node_tree))
        if (group := next(locked, None)) is not None:
            found |= {group} if shown.node.bl_idname in KINDS else set()
        elif not _stays(shown.node):
            found.add(shown.node)
    return [node for node in model_nodes.all_nodes(material) if node in found]
