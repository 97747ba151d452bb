# SPDX-License-Identifier: GPL-3.0-or-later
"""Updates materials that another version of the extension made, when their file is opened."""

from dataclasses import dataclass

import bpy
from bpy.app.handlers import persistent

from ..common import app_handlers, editable
from ..common.extension import PACKAGE
from ..common.i18n import form_name, of_error, say
from ..content.group_sockets import VECTORS
from ..packs import pack
from . import model_nodes, nodes


@dataclass(frozen=True)
class Update:
    """The result of update(): the number of nodes that now have this version's shaders, and a
    sentence for each node that kept its own or took another form."""

    count: int
    refusals: tuple
    notes: tuple


#: The Update of the file that was opened last, if the preferences ask for updates.
last = None


@persistent
def _after_load(_path):
    global last
    last = None
    addon = bpy.context.preferences.addons.get(PACKAGE)
    if addon is None or not addon.preferences.update_on_load or not others():
        return
    last = update()
    for sentence in (*last.refusals, *last.notes):
        print(f"brdfc: {sentence}")


def register():
    app_handlers.register({"load_post": _after_load})


def unregister():
    app_handlers.unregister({"load_post": _after_load})


def others():
    """[(material, node)]: group nodes of the open file that are of another version."""
    found = []
    for material in bpy.data.materials:
        for node in model_nodes.group_nodes(material):
            # The nodes of a group that several materials share would be found once per material.
            if model_nodes.manifest_entry(node) is None and node not in [n for _, n in found]:
                found.append((material, node))
    return found


def refusal(material, node):
    """Why a node can't take this version's shader with all of its settings; None if it can."""
    model_name, _ = model_nodes.identity(node)
    for block in (material, node.id_data):
        if block.library is not None:
            return say("it is linked from {file}; update it there", file=block.library.filepath)
    if why := editable.refusal(material, node.id_data):
        return why
    if model_nodes.is_newer(node):
        return say(
            "{later} made it, and this is {own}",
            later=model_nodes.made_by(node),
            own=pack.manifest()["generator"],
        )
    if model_name not in pack.model_names():
        return say("this version has no model {model!r}", model=model_name)
    model = pack.model(model_name)
    known = model.parameters
    for name, value in model_nodes.all_values(node).items():
        if name in model.fixed or name in VECTORS:
            continue
        if name not in known:
            return say(
                "this version's {model} has no parameter {parameter!r}",
                model=model_name,
                parameter=name,
            )
        choices = known[name].get("choices")
        if choices and value is not None and value not in choices:
            return say(
                "{parameter} is {value!r} there, and no longer a choice",
                parameter=known[name]["label"],
                value=value,
            )
    return None


def update():
    """Gives every node of another version the shader of this one; values, links and forms stay,
    and so does "auto".

    A form that no longer exists becomes "auto", and a lean node gets the whole model, as only a
    plan can make another lean one. Nothing is lost: a node whose settings can't be
    kept stays as it is, and its old shader continues to render. Returns an Update.
    """
    count, refusals, notes = 0, [], []
    for material, node in others():
        what = f"{material.name}, {node.label or node.name}"
        if why := refusal(material, node):
            refusals.append(say("{node}: {what}", node=what, what=why))
            continue
        before, was_lean = model_nodes.identity(node).form, model_nodes.is_baked(node)
        try:
            try:
                nodes.renew(node)
            except ValueError:
                nodes.switch(node, "auto")
                said = say(
                    "{before} is now {after}",
                    before=form_name(before),
                    after=form_name(model_nodes.identity(node).form),
                )
                notes.append(say("{node}: {what}", node=what, what=said))
        except (ValueError, RuntimeError) as error:  # CompileError and PackError are RuntimeErrors
            refusals.append(say("{node}: {what}", node=what, what=of_error(error)[0]))
            continue
        if was_lean:
            said = say("it was lean and has the whole model now")
            notes.append(say("{node}: {what}", node=what, what=said))
        count += 1
    nodes.remove_unused_groups()
    return Update(count, tuple(refusals), tuple(notes))
