# SPDX-License-Identifier: GPL-3.0-or-later
"""Type checks of the arguments of api: a wrong type raises a ValueError with a sentence."""

from numbers import Real

import bpy

from .i18n import say


def _of(kind, given, sentence):
    if not isinstance(given, kind):
        raise ValueError(sentence)
    return given


def material(given):
    return _of(bpy.types.Material, given, say("Expected a material, got {given!r}", given=given))


def scene(given):
    return _of(bpy.types.Scene, given, say("Expected a scene, got {given!r}", given=given))


def node(given):
    return _of(bpy.types.Node, given, say("Expected a node, got {given!r}", given=given))


def text(given):
    return _of(str, given, say("Expected a text, got {given!r}", given=given))


def number(given):
    return _of(Real, given, say("Expected a number, got {given!r}", given=given))


def not_negative(given):
    """A number from 0; NaN is none."""
    if not number(given) >= 0:
        raise ValueError(say("Expected a number from 0, got {given!r}", given=given))
    return given


def plan(kind, given):
    """A plan of the given class: there are two classes of that name."""
    return _of(kind, given, say("Expected a plan, got {given!r}", given=given))


def each(check, given):
    """Checks each element of an iterable and returns them as a list."""
    try:
        found = list(given)
    except TypeError:
        raise ValueError(say("Expected a list, got {given!r}", given=given)) from None
    return [check(item) for item in found]
