# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks the lamps of a scene for what makes a material of this extension wrong or noisy."""

import bpy

from .. import lamps
from ..common.i18n import say
from ..groups import nodes

#: Lamps below this size (metres; radians for a sun) are too rarely hit by random rays.
SMALL_LIGHT = 0.01
SMALL_SUN = 0.02
#: Up to this size, an ideal mirror shows lamps as dots. A new lamp in Blender is larger (0.1): with
#: its 4,096 samples, blocks of 8 x 8 pixels differ by less than 1 %.
SMALL_IN_MIRROR = 0.05
#: From this angle on (radians), a sun that random rays do not meet is noisy in highlights: its
#: light is that of one closure, with f towards one random point of the sun.
WIDE_SUN = 0.5
#: Sizes are stored in single precision.
_SLACK = 1e-6
#: Fraction of the scene's light below which the noise of a lamp is invisible among the others.
DIM = 0.05
#: Fraction of the scene's light that may be lost without a warning.
UNSEEN = 0.01


def sizes_of(light):
    """Names of the properties that make up a light's size."""
    if light.type == "SUN":
        return ("angle",)
    if light.type == "AREA":
        return ("size", "size_y") if light.shape in {"RECTANGLE", "ELLIPSE"} else ("size",)
    return ("shadow_soft_size",)


def _smallest(light):
    return min(getattr(light, name) for name in sizes_of(light))


def least_size(light):
    """The size from which random rays hit a light often enough."""
    return SMALL_SUN if light.type == "SUN" else SMALL_LIGHT


def is_tiny(light):
    """Whether random rays hit a light too rarely."""
    return _smallest(light) < least_size(light) * (1 - _SLACK)


def _names(found):
    """The names of a few objects or lamps, for a message."""
    names = found[0].name
    for item in found[1:3]:
        names = say("{lamps}, {lamp}", lamps=names, lamp=item.name)
    return (
        say("{lamps} and {count} more", lamps=names, count=len(found) - 3) if found[3:] else names
    )


def sizeless_lamps():
    """Names of the visible lamps of the open file that random rays can't hit."""
    return sorted(
        {
            item.name
            for scene in bpy.data.scenes
            for item in lamps.lamps_of(scene)
            if lamps.is_sizeless(item.data)
        }
    )


def enlarge(scene):
    """Enlarges the lamps of a scene that are too small for random rays to hit often enough; their
    light stays the same. Returns the names of these lamps and of those that belong to another
    file."""
    done, kept = [], []
    for item in lamps.lamps_of(scene):
        light = item.data
        if not is_tiny(light):
            continue
        least = least_size(light)
        if light.is_editable:
            for name in sizes_of(light):
                setattr(light, name, max(getattr(light, name), least))
        (done if light.is_editable else kept).append(item.name)
    return done, kept


def small_lamps(material, scene):
    if found := [item for item in lamps.lamps_of(scene) if is_tiny(item.data)]:
        return (
            "WARNING",
            say(
                "Lamps too small for the render method Sampled ({lamps}): their highlights are "
                "noisy or missing; enlarge the lamps or use another method",
                lamps=_names(found),
            ),
        )


def multiple_importance(material, scene):
    found = [
        item
        for item in lamps.lamps_of(scene)
        if not getattr(item.data.cycles, "use_multiple_importance_sampling", True)
    ]
    if found:
        return (
            "WARNING",
            say(
                "Multiple Importance is off for lamps ({lamps}): this material is too dark under "
                "them",
                lamps=_names(found),
            ),
        )


def _in_mirror(scene):
    found = []
    for item in lamps.lamps_of(scene):
        limit = SMALL_SUN if item.data.type == "SUN" else SMALL_IN_MIRROR
        if 0 < _smallest(item.data) <= limit * (1 + _SLACK):
            found.append(item)
    if found:
        yield (
            "small_in_mirror",
            "WARNING",
            say(
                "Small lamps ({lamps}) are rare, bright dots in this material's mirror: larger "
                "lamps or more samples help; a clamp on indirect light takes dots and light away",
                lamps=_names(found),
            ),
        )


def _ray_visibility(scene):
    found = [
        item for item in lamps.lamps_of(scene) if not (item.visible_diffuse and item.visible_glossy)
    ]
    if found:
        yield (
            "ray_visibility",
            "WARNING",
            say(
                "Ray Visibility of lamps ({lamps}) is off for diffuse or glossy rays: how much of "
                "the model that takes away differs with the render method",
                lamps=_names(found),
            ),
        )


def _others_lamps(node):
    """The shared group that a node of a linked material reads its lamps from; None if it is this
    file's own."""
    tree = node.node_tree
    if tree.library is None:
        return None
    inner = (getattr(n, "node_tree", None) for n in nodes.content_group(tree).nodes)
    return next((group for group in inner if group is not None and lamps.is_group(group)), None)


def _not_aimed(node, count, scene):
    """Yields findings about the lamps that a node with `count` slots does not aim at: lamps whose
    light is lost, and, by reason, lamps that are noisy and bright enough to matter."""
    group = _others_lamps(node)
    elsewhere = lamps.elsewhere(group.library) if group is not None else None
    found = lamps.last_found(scene, group)
    left_out = [lamp for lamp in found if lamp.slot is None or lamp.slot > count]
    lost = [lamp for lamp in left_out if lamp.sizeless]
    missed = [lamp for lamp in left_out if not lamp.met and not lamp.sizeless]
    total = sum(lamp.irradiance for lamp in found)

    def share(some):
        return sum(lamp.irradiance for lamp in some) / max(total, 1e-30)

    if share(lost) > UNSEEN:
        why = lost[0].why or lamps.too_many(count)
        yield (
            "linked_lamps" if why == elsewhere else "lost_lamps",
            "ERROR",
            say(
                "Light of lamps without a size ({lamps}) is lost: {why}",
                lamps=_names(lost),
                why=why,
            ),
        )
    if share(missed) > UNSEEN:
        yield (
            "multiple_importance",
            "ERROR",
            say(
                "Light of lamps without Multiple Importance ({lamps}) is lost: {why}",
                lamps=_names(missed),
                why=missed[0].why or lamps.too_many(count),
            ),
        )
    kinds = {}
    for lamp in left_out:
        why = lamp.why or lamps.too_many(count)
        if lamp not in lost and lamp not in missed and why != lamps.NO_NEED:
            kinds.setdefault(why, []).append(lamp)
    for why, noisy in kinds.items():
        if share(noisy) > DIM:
            yield (
                "linked_lamps" if why == elsewhere else "not_aimed",
                "WARNING",
                say("Noisy under {lamps}: {why}", lamps=_names(noisy), why=why),
            )


def _without_shadow(form, scene):
    """Warns of lamps that cast no shadow. Cycles' random rays stop at objects in front of such a
    lamp and find none of its light there, while light sampling does (docs/cycles.md)."""
    found = [
        item
        for item in lamps.lamps_of(scene)
        if not item.data.use_shadow
        and lamps.has_importance(item.data)
        and not lamps.is_sizeless(item.data)
    ]
    if not found:
        return
    if form.get("lamps"):
        yield (
            "cast_shadow",
            "WARNING",
            say(
                "Cast Shadow is off for lamps ({lamps}): behind other objects part of their light "
                "is missing, as with Blender's own nodes; turn off their Multiple Importance, too",
                more="Up to 7 % of the light of a lamp that looks 15 degrees wide, 13 % of one of "
                "37 degrees; a Glossy node lacks 10 % of the first",
                lamps=_names(found),
            ),
        )
    elif "zero_size_lights" in form.get("warnings", []):
        yield (
            "cast_shadow",
            "WARNING",
            say(
                "Cast Shadow is off for lamps ({lamps}): behind other objects this material gets "
                "none of their light; use another render method",
                lamps=_names(found),
            ),
        )


def _wide_suns(scene):
    """Warns of wide suns without Multiple Importance, for forms that aim at lamps."""
    found = [
        item
        for item in lamps.lamps_of(scene)
        if item.data.type == "SUN"
        and item.data.angle > WIDE_SUN
        and not lamps.has_importance(item.data)
    ]
    if found:
        yield (
            "multiple_importance",
            "WARNING",
            say(
                "Multiple Importance is off for wide suns ({lamps}): light that other surfaces "
                "reflect becomes rare bright dots",
                lamps=_names(found),
            ),
        )


def of_node(node, form, scene):
    """(code, severity, sentence) of what is wrong with a scene's lamps for the form of a group
    node."""
    if not form or scene.render.engine != "CYCLES":
        return
    if form.get("lamps"):
        yield from _not_aimed(node, form["lamps"], scene)
        yield from _wide_suns(scene)
    if "clamp_mirror" in form.get("warnings", []):
        yield from _in_mirror(scene)
    yield from _without_shadow(form, scene)
    if not nodes.runs_anywhere(node):
        yield from _ray_visibility(scene)
