# SPDX-License-Identifier: GPL-3.0-or-later
"""How the open file uses the models, and what has changed of that since."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..common.i18n import form_name, say
from ..packs import pack
from . import nodes

VARIES = {"varies": True}


@dataclass(frozen=True)
class Use:
    """Of a model, by a node of a material."""

    material: object
    node: object
    #: As `materials` of a scene file has it.
    entry: dict
    #: The form that it has now, which the entry leaves open where it follows the scene.
    form: str
    #: Of its group: another one whenever the shader is.
    shader: tuple


def _as_typed(value):
    """0.9 for the float that is next to it, so that a value is again the one that was given."""
    if isinstance(value, tuple):
        return [_as_typed(channel) for channel in value]
    return float(str(np.float32(value))) if isinstance(value, float) else value


def _use(material, node):
    model_name, representation = nodes.identity(node)
    varying = nodes.varying(node)
    parameters = dict(pack.fixed(model_name))
    for name in pack.parameters(model_name):
        value = None if name in varying else nodes.get_value(node, name)
        parameters[name] = VARIES if value is None else _as_typed(value)
    asked = "auto" if nodes.is_automatic(node) else representation
    entry = {"model": model_name, "representation": asked, "parameters": parameters}
    return Use(
        material,
        node,
        entry,
        representation,
        (node.node_tree[nodes.TAG]["digest"], nodes.is_baked(node)),
    )


def _names(material, node, alone):
    """What a model of a material is called: groups inside it may have nodes of one name, and
    materials of two files one name."""
    if alone:
        yield material.name
    yield f"{material.name}/{node.name}"
    yield f"{material.name}/{node.id_data.name}/{node.name}"
    count = 2
    while True:
        yield f"{material.name}/{node.id_data.name}/{node.name}/{count}"
        count += 1


def uses():
    """{MATERIAL: Use} of the open file; of a material with several model nodes MATERIAL/NODE."""
    found = {}
    for material in sorted(bpy.data.materials, key=lambda m: m.library is not None):
        ours = nodes.group_nodes(material)
        for node in ours:
            names = _names(material, node, len(ours) == 1)
            found[next(name for name in names if name not in found)] = _use(material, node)
    return found


def _shown(value):
    if value == VARIES:
        return say("linked or animated")
    return pack.value_text(tuple(value) if isinstance(value, list) else value)


def _change(before, after):
    """How a Use differs from what it was, in words; None where it does not."""
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


def stale(material, what):
    """What is raised where a plan is to be applied that was made of something else."""
    return ValueError(
        say(
            "{material!r} has changed since the plan was made: {what}. Make a new plan",
            material=material,
            what=what,
        )
    )


def check(before):
    """{name: Use} as it is now, where nothing of `before` has changed. Raises ValueError."""
    now = uses()
    for name, use in before.items():
        if what := _change(use, now.get(name)):
            raise stale(name, what)
    return {name: now[name] for name in before}
