# SPDX-License-Identifier: GPL-3.0-or-later
"""Describes how the open file uses the models, and detects changes since an earlier description."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..common.i18n import form_name, say
from ..packs import pack
from ..packs.parameter_values import value_text
from . import model_nodes

VARIES = {"varies": True}


@dataclass(frozen=True)
class Use:
    """The use of a model by a node of a material."""

    material: object
    node: object
    #: As in `materials` of a scene file.
    entry: dict
    #: The form it has now; the entry leaves it open if it follows the scene.
    form: str
    #: Identifies the shader of its group; changes when that does.
    shader: tuple


def _as_typed(value):
    """Undoes the rounding of single precision, as 0.9 for the nearest float, so that the value is
    again the one that was entered."""
    if isinstance(value, tuple):
        return [_as_typed(channel) for channel in value]
    return float(str(np.float32(value))) if isinstance(value, float) else value


def _use(material, node):
    model_name, representation = model_nodes.identity(node)
    model, varying = pack.model(model_name), model_nodes.varying(node)
    parameters = dict(model.fixed)
    for name in model.parameters:
        value = None if name in varying else model_nodes.get_value(node, name)
        parameters[name] = VARIES if value is None else _as_typed(value)
    asked = model_nodes.asked_form(node)
    entry = {"model": model_name, "representation": asked, "parameters": parameters}
    return Use(
        material,
        node,
        entry,
        representation,
        (node.node_tree[model_nodes.TAG]["digest"], model_nodes.is_baked(node)),
    )


def _names(material, node, alone):
    """Unique names for the models of a material: groups in it may contain nodes of the same name,
    and two files materials of the same name."""
    if alone:
        yield material.name
    yield f"{material.name}/{node.name}"
    yield f"{material.name}/{node.id_data.name}/{node.name}"
    count = 2
    while True:
        yield f"{material.name}/{node.id_data.name}/{node.name}/{count}"
        count += 1


def uses():
    """{MATERIAL: Use} of the open file; MATERIAL/NODE for a material with several model nodes."""
    found = {}
    for material in sorted(bpy.data.materials, key=lambda m: m.library is not None):
        ours = model_nodes.group_nodes(material)
        for node in ours:
            names = _names(material, node, len(ours) == 1)
            found[next(name for name in names if name not in found)] = _use(material, node)
    return found


def _shown(value):
    if value == VARIES:
        return say("linked or animated")
    return value_text(tuple(value) if isinstance(value, list) else value)


def _change(before, after):
    """How a Use has changed, in words; None if it has not."""
    if after is None:
        return say("there is no such model any more")
    old, new = before.entry, after.entry
    if old["model"] != new["model"]:
        return say("it has another model")
    if before.form != after.form:
        return say(
            "its render method was {before} and is {after}",
            before=form_name(before.form),
            after=form_name(after.form),
        )
    for name, value in old["parameters"].items():
        if value != new["parameters"][name]:
            return say(
                "{parameter} was {before} and is {after}",
                parameter=name,
                before=_shown(value),
                after=_shown(new["parameters"][name]),
            )
    return say("it has another shader") if before.shader != after.shader else None


def stale_error(material, what):
    """The exception for a plan that no longer matches the material."""
    return ValueError(
        say(
            "{material!r} has changed since the plan was made: {what}. Make a new plan",
            material=material,
            what=what,
        )
    )


def check(before):
    """The current {name: Use}, if nothing in `before` has changed. Raises ValueError otherwise."""
    now = uses()
    for name, use in before.items():
        if what := _change(use, now.get(name)):
            raise stale_error(name, what)
    return {name: now[name] for name in before}
