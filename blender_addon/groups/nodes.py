# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds, makes and exchanges the node groups of models, around OSL script nodes or Blender's own.

A group is made once for each model, representation and shader version, and then reused. The .blend
holds both source and bytecode, so a saved file renders where the extension is not installed.
"""

import contextlib
import json

import bpy

from .. import lamps
from ..common import editable, enabling
from ..common.i18n import say
from ..content import group_content, part_groups, stand_in
from ..content.compiler import CompileError
from ..content.group_content import ALBEDO, script_problem
from ..content.group_sockets import has_own_choices
from ..packs import device, pack
from . import exchange, model_nodes
from .model_nodes import AUTO, TAG

#: Entry of a group's tag: the lamps.Room of its nodes, if less than the form's.
ROOM = "room"


def empty_tree(owner):
    """The node tree of a new material or world, emptied."""
    if owner.node_tree is None:  # before 5.0 there is none at first
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def source_text(group):
    """Source text of a group's shader, which the file holds; "" if it was deleted."""
    script, _ = group_content.scripts(group)
    return script.script.as_string() if script is not None and script.script else ""


def _room_of(tag):
    return lamps.Room(*tag[ROOM]) if ROOM in tag else lamps.WHOLE


def find_group(form, albedo=False, with_osl=None, room=lamps.WHOLE):
    """The group of the current version of a form, if the file has an intact one; `albedo` as in
    ensure_group. `with_osl`: the form to take where OSL runs, of a group that adapts to the
    scene. `room`: that of a group inside of that."""
    albedo = albedo and (with_osl or form).has_albedo_script
    automatic = with_osl and with_osl.name
    for group in bpy.data.node_groups:
        tag = group.get(TAG)
        if group.library is None and tag is not None and tag.get("digest") == form.digest:
            same = (tag["model"], tag["representation"]) == (form.model.name, form.name)
            has_albedo = tag["with_albedo"] if AUTO in tag else "albedo_inputs" in tag
            same = same and (automatic or _room_of(tag) == room)
            if same and tag.get(AUTO) == automatic and has_albedo == albedo and is_sound(group):
                return group
    return None


def is_sound(group):
    """Whether nothing that a group was made with is missing, and this Blender would make it."""
    return bool(group.nodes) and script_problem(group) is None and has_own_choices(group)


def with_parts(groups):
    """These groups, and the groups of this extension inside them."""
    found, new = set(), set(groups)
    while new:
        found |= new
        new = {n.node_tree for group in new for n in group.nodes if model_nodes.is_ours(n)} - found
    return found


def merge_duplicates(groups):
    """Replaces groups that came from another file by equal ones of the open file."""
    stand_in.keep_one_text()

    # Inner groups first: twins are inside other forms, and forms inside automatic groups.
    def depth(group):
        return 2 if AUTO in group[TAG] else int(group[TAG]["representation"] != "twin")

    for group in sorted(groups, key=depth):
        _replace_by_local_equal(group)


def _replace_by_local_equal(group):
    """Replaces a group by the equal one of the open file, if there is one."""

    def description(group):
        tag = group[TAG].to_dict()
        # An automatic group gets room for the scene's lamps.
        return {k: v for k, v in tag.items() if k != ROOM or AUTO not in tag}

    wanted = description(group)
    for other in bpy.data.node_groups:
        same = other != group and other.library is None and TAG in other
        same = same and has_own_choices(other) == has_own_choices(group)
        if same and description(other) == wanted and script_problem(other) is None:
            group.user_remap(other)
            remove_group(group)
            return


def _clear_fake_users(group):
    """Removes the fake users of a group's texts, which older versions set, so that they are deleted
    with their last user."""
    for text in (n.script for n in group.nodes if n.bl_idname == "ShaderNodeScript" and n.script):
        text.use_fake_user = False


def ensure_group(model_name, representation="auto", baked=None, albedo=False, values=None):
    """Finds or makes the node group of a model, and enables the extension, whose handlers fill in
    the lamps. Raises ValueError, CompileError.

    Leaves nothing in the file on failure. A group of "auto" adapts to the scene if the model has a
    form for that; see adapt_to_scene(). `values` of the parameters decide which forms are
    available. `baked`: hash of the extension in whose place the pack of the open file is in use
    (see pack.use). `albedo`: adds the Albedo output even if that takes a script with large tables.
    """
    enabling.enable()
    model = pack.model(model_name)
    if representation == "auto" and not baked:
        with_osl = model.automatic(values)
        if model.native_form and not with_osl.is_native:
            return _ensure_automatic(with_osl, albedo)
        if not with_osl.is_native and not pack.osl_available():
            raise CompileError(
                say(
                    "{model} needs Open Shading Language, which this Blender was built without: it "
                    "can't be made here. In files from elsewhere Blender's own nodes stand in for "
                    "it",
                    model=model.label,
                )
            )
    form = model.resolve(representation, values)
    if form.is_native and form.lamps and not baked:
        return _ensure_automatic(form, albedo)
    if group := find_group(form, albedo):
        _clear_fake_users(group)
        return group
    with _new_group(form.name, form, albedo) as group:
        if baked:
            # The pack of the file is gone when the group is examined later.
            entry = {"of": baked, "form": form.entry, "parameters": model.parameters}
            group[TAG]["baked"] = json.dumps(entry)
        _fill(group, form, albedo)
    return group


def _ensure_automatic(with_osl, albedo):
    """The group that adapts to the scene; `with_osl`: its form where OSL runs, or that of Blender's
    own nodes, so that only its room for lamps adapts."""
    native = with_osl if with_osl.is_native else with_osl.model.native_form
    lacks_osl = device.lacks_osl(lamps.current_scene())
    for form in (with_osl, native):
        if group := find_group(form, albedo, with_osl):
            _clear_fake_users(group)
            adapt_to_scene(group, lacks_osl)
            return group
    name = with_osl.name if with_osl.is_native else AUTO
    with _new_group(name, with_osl, albedo) as group:
        tag = group[TAG]
        tag[AUTO], tag["with_albedo"] = with_osl.name, albedo and with_osl.has_albedo_script
        tag["native_only"] = json.dumps(native.only)
        _change_form(group, native if lacks_osl else with_osl, lamps.room_needed)
    return group


#: Groups under construction: making them updates the lamps, which makes Blender call handlers.
_unfinished = []


def is_at_work():
    """Whether a group is under construction."""
    return bool(_unfinished)


def _title(model_name, parts):
    """Begins with a dot: Blender leaves such groups out of menus and searches."""
    return f".{pack.model(model_name).label} ({', '.join(parts)})"


@contextlib.contextmanager
def _new_group(name, form, albedo):
    """A new group with the sockets of a form, which the body of the with statement fills. If the
    body raises, the group and its parts are removed from the file."""
    known = set(bpy.data.node_groups)
    parts = [name, *([ALBEDO] if albedo and form.has_albedo_script else [])]
    title = _title(form.model.name, parts)
    group = bpy.data.node_groups.new(title, "ShaderNodeTree")
    _unfinished.append(group)
    try:
        group.color_tag = "SHADER"
        group.description = form.model.doc
        group[TAG] = {
            "model": form.model.name,
            "representation": form.name,
            "digest": form.digest,
            "made_by": pack.manifest()["generator"],
            "choices": json.dumps(form.choices),
            "only": json.dumps(form.constants),
        }
        yield group
    except BaseException:
        remove_group(group)
        remove_unused_groups(known)  # its twin, if one was made
        raise
    finally:
        _unfinished.pop()


def _group_of(form, room=lamps.WHOLE):
    """The group of a form of Blender's own nodes inside another group; `room` as in
    find_group()."""
    if group := find_group(form, room=room):
        return group
    with _new_group(form.name, form, False) as group:
        _set_room(group, room)
        _fill(group, form, False)
    return group


def _set_room(group, room):
    if room != lamps.WHOLE:
        group[TAG][ROOM] = [*room]


def _fill(group, form, albedo):
    """Makes the nodes of a form in a group. If it raises CompileError, it has removed its texts."""
    stem, source = form.source()
    sources = {stem: source}
    if albedo and (of_albedo := form.albedo_source()):
        sources |= dict([of_albedo])
    # Lean groups hold only what a render needs.
    twin = form.model.forms.get("twin")
    stands_in = twin is not None and twin != form and "baked" not in group[TAG]
    twin_group = _group_of(twin) if stands_in else None
    if form.is_native:
        group_content.fill_with_nodes(group, form, source, twin_group, _room_of(group[TAG]))
        return
    before = list(group.nodes)
    texts = [stand_in.new_text(f"{stem}.osl", source) for stem, source in sources.items()]
    names = [text.name for text in texts]
    try:
        group_content.fill_with_scripts(group, form, texts, twin_group)
    except BaseException:
        _remove_others(group, before)
        for name in set(names) & set(bpy.data.texts.keys()):
            bpy.data.texts.remove(bpy.data.texts[name])
        raise


def _remove_others(group, kept):
    for node in [node for node in group.nodes if node not in kept]:
        group.nodes.remove(node)


def automatic_groups():
    """The groups of this file that adapt to the scene."""
    return [g for g in bpy.data.node_groups if g.library is None and AUTO in g.get(TAG, ())]


def adapt_to_scene(group, lacks_osl, room_needed=lamps.room_needed):
    """Changes an automatic group to the form that a scene with or without OSL can render, with room
    for the scene's lamps, if the installed version made the group; sockets stay. Returns whether
    the group has changed. If it raises CompileError, the group is as it was.

    A group that has room for more lamps keeps it: lamps are often hidden and shown again.
    """
    tag = group[TAG]
    keeps_form = model_nodes.keeps_form(tag)
    is_native = keeps_form or tag["representation"] != tag[AUTO]
    # Handlers call this at each change of the scene, and computing the version takes a hash.
    if group.nodes and is_native == (lacks_osl or keeps_form):
        if not is_native or ROOM not in tag:
            return False
        if room_needed().joined(_room_of(tag)) == _room_of(tag):
            return False
    # A socket of another Blender would lose its choice.
    if not model_nodes.is_current(group) or not has_own_choices(group):
        return False
    model = pack.model(tag["model"])
    wanted = model.forms[tag[AUTO]] if keeps_form or not lacks_osl else model.native_form
    if wanted is None:
        return False
    _change_form(group, wanted, room_needed)
    return True


def _change_form(group, form, room_needed):
    tag, before = group[TAG].to_dict(), list(group.nodes)
    # Blender brings a dragged asset again if what it brought before is gone.
    inner = {
        n.node_tree.session_uid
        for n in before
        if model_nodes.is_ours(n) and n.node_tree.library_weak_reference is None
    }
    texts = {n.script for n in before if n.bl_idname == "ShaderNodeScript" and n.script}
    with_osl = form.model.forms[tag[AUTO]]
    try:
        group[TAG].pop(ROOM, None)
        if not form.is_native:
            _fill(group, form, tag["with_albedo"])
        else:
            room = room_needed() if form.lamps else lamps.WHOLE
            if before and ROOM in tag:
                room = room.joined(_room_of(tag))
            _set_room(group, room)

            def group_of(inner):
                return _group_of(inner, room if inner == form else lamps.WHOLE)

            group_content.fill_with_form(group, form, with_osl, group_of)
    except BaseException:
        _remove_others(group, before)
        group[TAG] = tag
        raise
    for node in before:
        group.nodes.remove(node)
    group[TAG]["representation"] = form.name
    group[TAG]["digest"] = form.digest
    _clear_away(inner, texts)
    # An inner group that was made while an equal one was there has a number behind its name.
    for made in (n.node_tree for n in group.nodes if model_nodes.is_ours(n)):
        made.name = _title(made[TAG]["model"], [made[TAG]["representation"]])


def empty(group):
    """Removes all nodes of an automatic group; adapt_to_scene() makes them again."""
    group.nodes.clear()


def add_group_node(tree, model_name, representation="auto", values=None):
    """Adds a group node to a shader tree and returns it; `values` as in ensure_group()."""
    group = ensure_group(model_name, representation, values=values)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.width = 200
    node.label = pack.model(model_name).label
    return node


def make_local(tree):
    """Makes local the groups, scripts and images that a local tree uses."""
    for node in tree.nodes:
        for name in ("node_tree", "script", "image"):
            inner = getattr(node, name, None)
            if inner is not None and (own := editable.local(inner)) != inner:
                setattr(node, name, own)
        if getattr(node, "node_tree", None) is not None:
            make_local(node.node_tree)


def make_anew(group):
    """Makes the content of a group of the installed version anew: fills a group that adapts to the
    scene again, and puts another one in the place of others. Returns whether the group was filled.
    Raises CompileError."""
    tag = group[TAG]
    form = pack.model(tag["model"]).forms[tag["representation"]]
    if AUTO in tag:
        # Scripts can't be made beside those that a group has.
        for step in dict.fromkeys([form.model.native_form, form]):
            _change_form(group, step, lamps.room_needed)
        return True
    tag["digest"] = ""  # so that another one is made
    if group_content.is_native(group):
        made = _group_of(form, _room_of(tag))
    else:
        made = ensure_group(form.model.name, form.name, albedo="albedo_inputs" in tag)
    group.user_remap(made)
    remove_group(group)
    return False


def remove_group(group):
    """Removes a group from the file, and its texts, images and twin if nothing else uses them."""
    texts = {n.script for n in group.nodes if n.bl_idname == "ShaderNodeScript" and n.script}
    images = {n.image for n in group.nodes if n.bl_idname == "ShaderNodeTexImage" and n.image}
    inner = {n.node_tree.session_uid for n in group.nodes if model_nodes.is_ours(n)}
    bpy.data.node_groups.remove(group)
    for image in images:
        if image.users == 0:
            bpy.data.images.remove(image)
    _clear_away(inner, texts)


def _clear_away(uids, texts):
    """Removes the parts of a group from the file if nothing else uses them: the groups with these
    session_uids, and the texts."""
    if candidates := {*texts, *stand_in.texts()}:
        trees = [*bpy.data.node_groups, *(m.node_tree for m in bpy.data.materials if m.node_tree)]
        used = {getattr(node, "script", None) for tree in trees for node in tree.nodes}
        for text in candidates - used:
            bpy.data.texts.remove(text)
    # Removing a group may leave further ones without a user.
    while unused := [g for g in bpy.data.node_groups if g.session_uid in uids and g.users == 0]:
        remove_group(unused[0])
    part_groups.remove_unused_parts()
    lamps.remove_unused_group()


def remove_unused_groups(kept=()):
    """Removes every group of this extension that no node uses, except those in `kept`."""

    def unused(group):
        ours = TAG in group and group.library is None
        return ours and group.users == 0 and group not in kept

    while group := next(filter(unused, bpy.data.node_groups), None):
        remove_group(group)


def switch(node, representation, known=None):
    """Changes a group node to another form of the same model; values and links stay. `known`:
    values of choices that its sockets do not tell.

    Raises ValueError, also if the file would not keep the change, and CompileError; the node is
    then as it was.
    """
    _switch(node, representation, known or {}, model_nodes.uses_albedo(node))


def renew(node, known=None):
    """Gives a group node the group that the installed version and this Blender make for it: what
    adapts to the scene continues to, and an Albedo output that was asked for stays without a
    link. `known` and errors as for switch()."""
    albedo = model_nodes.uses_albedo(node) or model_nodes.has_asked_albedo(node)
    _switch(node, model_nodes.asked_form(node), known or {}, albedo)


def _switch(node, representation, known, albedo):
    editable.check(node.id_data)
    model_name, _ = model_nodes.identity(node)
    values = model_nodes.constants(node) | known
    if representation != "auto":
        pack.model(model_name).resolve(representation, values)
    group = ensure_group(model_name, representation, albedo=albedo, values=values)
    _exchange(node, group)
    for name, value in known.items():
        model_nodes.set_value(node, name, value)


def _exchange(node, group):
    """Puts another group into a node; the old one is removed if nothing else uses it."""
    before = node.node_tree
    exchange.replace_group(node, group)
    if before.users == 0 and before.library is None:
        remove_group(before)


def add_albedo(node):
    """Adds the Albedo output to a group node if it lacks it; values and links stay.

    Raises ValueError if another version of the extension made the group, the model has none, or
    the file would not keep the change, and CompileError.
    """
    editable.check(node.id_data)
    if ALBEDO in node.outputs:
        return
    if model_nodes.is_baked(node) or model_nodes.manifest_entry(node) is None:
        name = node.label or node.name
        if model_nodes.is_baked(node):
            raise ValueError(
                say(
                    "{node} is lean: choose a render method first, which restores the whole model",
                    node=name,
                )
            )
        raise ValueError(
            say("{node} is of another version of the extension: update it first", node=name)
        )
    tag = node.node_tree[TAG]
    model = pack.model(tag["model"])
    if not model.has_albedo:
        raise ValueError(
            say(
                "{model} has no Albedo output: no table can hold its albedo",
                model=model.label,
            )
        )
    if model_nodes.is_automatic(node):
        _exchange(node, _ensure_automatic(model.forms[tag[AUTO]], albedo=True))
        return
    _exchange(node, ensure_group(*model_nodes.identity(node), albedo=True))
