# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads group nodes of models, finds them in materials, and sets their values. The tag of a group
says of which model and form it is; groups of other versions of the extension have one, too."""

import json
from typing import NamedTuple

import bpy

from .. import lamps
from ..common import editable
from ..common.i18n import say
from ..content import stand_in
from ..content.group_content import ALBEDO, is_native
from ..packs import pack
from ..packs.parameter_values import canonical, choice_label, equal_in_float32
from ..trees import animation, shader_trees

TAG = pack.TAG
#: Key in the tag of a group that adapts to the scene: the form it takes where OSL runs. If that is
#: Formula Nodes, only their room for lamps adapts.
AUTO = "auto"
#: Name of the form of Blender's own nodes.
FORMULA_NODES = "nodes"


def is_ours(node):
    """Whether a node is a group of this extension, of whichever version."""
    tree = getattr(node, "node_tree", None)
    return node.bl_idname == "ShaderNodeGroup" and tree is not None and TAG in tree


def is_fitted(node):
    """Whether a group node's form approximates the model by fitted closures or nodes. Other forms
    reproduce the model on average."""
    return identity(node).form in ("twin", "fitted")


def form_in_script(node):
    """The form that decides which values a node's sockets can have: of an automatic group, the form
    for OSL."""
    tag = node.node_tree[TAG]
    return tag.get(AUTO, tag["representation"])


def form_of(group):
    """The current form of a group; None if the installed version lacks it or its model."""
    tag = group[TAG]
    if tag["model"] not in pack.model_names():
        return None
    return pack.model(tag["model"]).forms.get(tag["representation"])


def is_current(group):
    """Whether the installed version would make the same group."""
    form = form_of(group)
    return form is not None and group[TAG]["digest"] == form.digest


class Identity(NamedTuple):
    """Names of a group node's model and form, which the installed version may lack."""

    model: str
    form: str


def identity(node):
    """The Identity of a group node; of an automatic one with the current form, which may depend on
    its choices."""
    tag = node.node_tree[TAG]
    return Identity(tag["model"], tag[AUTO] if _lacks_choice(node) else tag["representation"])


def is_automatic(node):
    """Whether a node adapts its form to the scene."""
    tag = node.node_tree[TAG]
    return AUTO in tag and not keeps_form(tag)


def asked_form(node):
    """The form that was asked for: "auto" of a node that adapts it to the scene."""
    return "auto" if is_automatic(node) else identity(node).form


def keeps_form(tag):
    """Whether a group of Formula Nodes that adapts to the scene was asked for by name, by its
    tag."""
    return tag[AUTO] == FORMULA_NODES


def _lacks_choice(node):
    """Whether an automatic node, where OSL does not run, has a choice that its form lacks there, so
    that its twin is shown."""
    tag = node.node_tree[TAG]
    if tag.get(AUTO, tag["representation"]) == tag["representation"]:
        return False
    only = canonical(json.loads(tag["native_only"]))
    return any(not equal_in_float32(get_value(node, n), value) for n, value in only.items())


def runs_anywhere(node):
    """Whether the current form of a node needs no OSL."""
    return is_native(node.node_tree) and not _lacks_choice(node)


def has_stand_in(node):
    """Whether Blender's own nodes replace a node where its form does not run."""
    inner = [n.node_tree[TAG]["representation"] for n in node.node_tree.nodes if is_ours(n)]
    has_twin = "twin" in inner
    return stand_in.is_in(node.node_tree) or (has_twin and _lacks_choice(node))


def content_group(group):
    """The group that has the nodes of the form: a group that adapts to the scene may contain
    another group."""
    form = group[TAG]["representation"]
    if AUTO in group[TAG] and (group[TAG][AUTO] != form or keeps_form(group[TAG])):
        inner = (n.node_tree for n in group.nodes if is_ours(n))
        return next((g for g in inner if g[TAG]["representation"] == form), group)
    return group


def lamps_of_library(node):
    """The shared group that a node of a linked material reads its lamps from; None if it is this
    file's own."""
    tree = node.node_tree
    if tree.library is None:
        return None
    inner = (getattr(n, "node_tree", None) for n in content_group(tree).nodes)
    return next((g for g in inner if g is not None and lamps.is_group(g)), None)


def lamps_of_other_file(material):
    """The first shared group of another file that the nodes of a material read; None if there is
    none."""
    return next(filter(None, map(lamps_of_library, group_nodes(material))), None)


def is_baked(node):
    """Whether the group was made for the open file alone; see lean.py."""
    return "baked" in node.node_tree[TAG]


def made_by(node):
    """The version that made a node's group, as "brdfc 1.2.3"; the first versions did not record
    it."""
    return node.node_tree[TAG].get("made_by", "brdfc 0")


def is_newer(node):
    """Whether a version later than the installed one made a node's group."""
    return pack.version(made_by(node)) > pack.version(pack.manifest()["generator"])


class Entry(NamedTuple):
    """What the manifest says of a group node."""

    form: dict
    #: By name.
    parameters: dict


def manifest_entry(node):
    """The Entry of a group node; None if another version of the extension made the group."""
    tag = node.node_tree[TAG]
    if is_baked(node):
        entry = json.loads(tag["baked"])
        same = entry["of"] == pack.manifest()["hash"]
        return Entry(entry["form"], entry["parameters"]) if same else None
    if not is_current(node.node_tree):
        return None
    model_name, form = identity(node)
    model = pack.model(model_name)
    return Entry(model.forms[form].entry, model.parameters)


def sockets(node):
    """Input sockets of a group node by parameter name, and Normal and Tangent."""
    by_identifier = {s.identifier: s for s in node.inputs}
    return {
        name: by_identifier[identifier]
        for name, identifier in node.node_tree[TAG]["sockets"].items()
        if identifier in by_identifier
    }


def _choices(node, name):
    return json.loads(node.node_tree[TAG]["choices"])[name]


def _only(node):
    """Parameters for which the form has a single value; groups of older versions do not list
    them."""
    return canonical(json.loads(node.node_tree[TAG].get("only", "{}")))


def set_value(node, name, value):
    """Sets a socket to a value in the canonical form of pack.check_value."""
    socket = sockets(node).get(name)
    if socket is None:  # the form has a single value
        return
    if socket.type == "RGBA":
        value = (*value, 1.0)
    elif socket.type == "MENU":
        value = choice_label(value)
    elif socket.type == "INT" and isinstance(value, str):
        value = _choices(node, name).index(value)
    socket.default_value = value


def get_value(node, name):
    """Value of a socket in the same form; None for vectors, and if a node's output reaches the
    socket. Links that Cycles ignores do not count."""
    socket = sockets(node).get(name)
    if socket is None:
        only = _only(node)
        return only[name] if name in only else _choices(node, name)[0]
    reached = shader_trees.reach(socket)
    if reached.output is not None or socket.type == "VECTOR":
        return None
    if socket.type == "RGBA":
        return tuple(socket.default_value)[:3] if reached.holder else (0.0, 0.0, 0.0)
    if socket.type == "MENU":
        labels = {choice_label(c): c for c in _choices(node, name)}
        return labels.get(socket.default_value)
    if socket.type == "INT":
        choices, index = _choices(node, name), socket.default_value if reached.holder else 0
        return choices[min(max(index, 0), len(choices) - 1)]
    return socket.default_value if reached.holder else 0.0


def varying(node):
    """Parameters of a group node that are not constant: linked, animated or driven. Links that
    Cycles ignores do not count."""
    animated = animation.animated_inputs(node)
    return {
        name
        for name, s in sockets(node).items()
        if s.identifier in animated or shader_trees.is_driven(s)
    }


def all_values(node):
    """The value of each parameter by name, as get_value() returns it."""
    choices = json.loads(node.node_tree[TAG]["choices"])
    names = dict.fromkeys((*choices, *_only(node), *sockets(node)))
    return {name: get_value(node, name) for name in names}


def constants(node):
    """The same, with None for parameters that are varying()."""
    return all_values(node) | dict.fromkeys(varying(node))


#: Forms that are one of Cycles' closures where that equals the model.
_WITH_CLOSURES = ("aimed", "nodes")


def is_closure(node):
    """Whether a group node of this version is one of Cycles' closures at its values."""
    name, form = identity(node)
    if form not in _WITH_CLOSURES:
        return False
    model = pack.model(name)
    return model.may_be_closure and model.is_closure(constants(node))


def uses_albedo(node):
    """Whether a group node's Albedo output is linked."""
    return ALBEDO in node.outputs and node.outputs[ALBEDO].is_linked


def has_asked_albedo(node):
    """Whether a group was made with an Albedo output that its form has only if asked to."""
    tag = node.node_tree[TAG]
    return bool(tag.get("with_albedo")) if AUTO in tag else "albedo_inputs" in tag


def _trees(tree, seen):
    if tree is None or tree in seen:
        return
    seen.append(tree)
    for node in tree.nodes:
        if hasattr(node, "node_tree") and not is_ours(node):
            _trees(node.node_tree, seen)


def all_trees(owner):
    """The node tree of a material or world, and those of the groups in it, nested groups included;
    none of this extension."""
    trees = []
    _trees(owner.node_tree, trees)
    return trees


def users_of(tree):
    """The materials that contain a node tree, as their own or in a group."""
    if tree.is_embedded_data:
        return [editable.named(tree)]
    return [material for material in bpy.data.materials if tree in all_trees(material)]


def all_nodes(owner):
    """Every node of a material or world, including those in nested groups, but not what groups of
    this extension contain."""
    return [node for tree in all_trees(owner) for node in tree.nodes]


def group_nodes(material):
    """Every group node of this extension in a material, including those in nested groups."""
    return [node for node in all_nodes(material) if is_ours(node)]


def key(node):
    """The name by which operators and api address a model node of a material: NODE, or GROUP/NODE
    for a node in a node group, as names are unique in a tree only."""
    tree = node.id_data
    return node.name if tree.is_embedded_data else f"{tree.name}/{node.name}"


def named(material, name):
    """The model node of a material that has this key(), or is the only one of this name. Raises
    ValueError."""
    ours = group_nodes(material)
    found = [node for node in ours if key(node) == name]
    found = found or [node for node in ours if node.name == name]
    if len(found) == 1:
        return found[0]
    of = {"material": material.name, "node": name}
    if not ours:
        raise ValueError(say("Material {material!r} has no model node {node!r}", **of))
    names = ", ".join(map(key, ours))
    raise ValueError(
        say("Material {material!r} has no model node {node!r}, only {names}", **of, names=names)
    )


def shown_nodes(material):
    """The same as group_nodes(), but only nodes that Cycles shows: not those that are muted, lie
    behind muted links or reach no active output."""
    found = (shown.node for shown in shader_trees.shown(material))
    return list(dict.fromkeys(node for node in found if is_ours(node)))
