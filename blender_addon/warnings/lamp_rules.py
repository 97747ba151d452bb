# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicates of warnings about a scene's lamps: what makes a material wrong or noisy under them."""

from .. import lamps
from ..common.i18n import counted, say
from ..groups import model_nodes

#: Fraction of the scene's light below which the noise of a lamp is invisible among the others.
DIM = 0.05
#: Fraction of the scene's light that may be lost without a warning.
UNSEEN = 0.01


def _names(found):
    """The names of a few objects or lamps, for a message."""
    every = [item.name for item in found]
    names, *others = counted(every)[:3]
    for other in others:
        names = say("{lamps}, {lamp}", lamps=names, lamp=other)
    said = [*dict.fromkeys(every)][:3]
    more = sum(name not in said for name in every)
    return say("{lamps} and {count} more", lamps=names, count=more) if more else names


def _any(found):
    """The names of these lamps, as the values of a sentence, if there are any."""
    return [{"lamps": _names(found)}] if found else []


# ---- lamps that a form aims at, or not -----------------------------------------------------------


def _by_reason(at, left_out, least):
    """The values of a sentence about lamps that a node does not aim at, if their share of the light
    exceeds `least`."""
    total = sum(lamp.irradiance for lamp in at.found_lamps)
    found = [lamp for lamp, _ in left_out]
    if sum(lamp.irradiance for lamp in found) / max(total, 1e-30) > least:
        yield {"lamps": _names(found), "why": left_out[0][1]}


def _lost(at, linked):
    for values in _by_reason(at, [(x, why) for x, why in at.not_aimed if x.sizeless], UNSEEN):
        if (values["why"] == at.elsewhere) == linked:
            yield values


def lost_lamps(at):
    """A form that aims at lamps has no slot for a lamp without a size, which holds more than 1 % of
    the light. Random rays can't hit it."""
    return _lost(at, linked=False)


def linked_lost_lamps(at):
    """The same for a linked material, which knows the lamps of its own file."""
    return _lost(at, linked=True)


def missed_lamps(at):
    """A form that aims at lamps has no slot for a lamp without Multiple Importance, which holds
    more than 1 % of the light. Cycles hides it from random rays."""
    missed = [(x, why) for x, why in at.not_aimed if not x.met and not x.sizeless]
    return _by_reason(at, missed, UNSEEN)


def _noisy(at, linked):
    kinds = {}
    for lamp, why in at.not_aimed:
        if lamp.met and not lamp.sizeless and why != lamps.NO_NEED:
            kinds.setdefault(why, []).append((lamp, why))
    for why, noisy in kinds.items():
        if (why == at.elsewhere) == linked:
            yield from _by_reason(at, noisy, DIM)


def noisy_lamps(at):
    """A form that aims at lamps has no slot for lamps that hold more than 5 % of the light: only
    random rays bring theirs."""
    return _noisy(at, linked=False)


def linked_noisy_lamps(at):
    """The same for a linked material, which knows the lamps of its own file."""
    return _noisy(at, linked=True)


def wide_suns(at):
    """A form that aims at lamps is under a sun wider than 0.5 rad without Multiple Importance."""
    return _any(
        [
            item
            for item in (at.lamps if at.aims else ())
            if lamps.kind_of(item.data).is_wide(item.data) and not lamps.has_importance(item.data)
        ]
    )


# ---- settings of lamps ---------------------------------------------------------------------------


def small_in_mirror(at):
    """A material with an ideal mirror is under lamps of at most 5 cm, or suns of at most 0.02 rad.
    Those without a size do not appear in mirrors."""
    if "clamp_mirror" not in at.cycles_form.get("warnings", []) or not at.may_mirror:
        return []
    return _any([x for x in at.lamps if lamps.kind_of(x.data).is_dot_in_mirror(x.data)])


def _without_shadow(at):
    """Lamps that cast no shadow. Cycles' random rays stop at objects in front of such a lamp and
    find none of its light there, while light sampling does (docs/cycles.md)."""
    return [
        item
        for item in at.lamps
        if not item.data.use_shadow
        and lamps.has_importance(item.data)
        and not lamps.kind_of(item.data).is_sizeless(item.data)
    ]


def partly_without_shadow(at):
    """A form that aims at lamps is under lamps that cast no shadow, but have Multiple
    Importance."""
    return _any(_without_shadow(at)) if at.aims else []


def without_shadow(at):
    """The same for a form that only random rays light, such as Sampled."""
    sampled = "zero_size_lights" in at.cycles_form.get("warnings", [])
    return _any(_without_shadow(at)) if sampled and not at.aims else []


def hidden_from_rays(at):
    """Ray Visibility of lamps is off for diffuse or glossy rays."""
    if not at.cycles_form or model_nodes.runs_anywhere(at.node):
        return []
    return _any([x for x in at.lamps if not (x.visible_diffuse and x.visible_glossy)])


def sheared_lamps(at):
    """Area lamps are sheared. In Cycles, random rays bring another amount of their light than light
    sampling does, so Formula Nodes and sampled forms differ from Blender's own nodes."""
    drawn = "zero_size_lights" in at.cycles_form.get("warnings", []) if at.cycles_form else False
    if not drawn and not (at.aims and model_nodes.runs_anywhere(at.node)):
        return []
    found = [x for x in at.lamps if lamps.kind_of(x.data).is_distorted(x.matrix_world)]
    objects = {x.name for x in at.lamps}
    # Of instances, only a survey knows.
    return _any(found + [x for x in at.found_lamps if x.distorted and x.name not in objects])


def small_lamps(at):
    """Lamps are below 1 cm, or suns below 0.02 rad: random rays hit them too rarely."""
    return _any([item for item in at.lamps if lamps.kind_of(item.data).is_tiny(item.data)])


def without_importance(at):
    """Multiple Importance is off for lamps: Cycles hides them from random rays."""
    return _any([item for item in at.lamps if not lamps.has_importance(item.data)])
