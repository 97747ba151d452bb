# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces nodes by models, and restores them."""

from dataclasses import replace

import bpy

from ..common import editable
from ..groups import bump_correction, model_nodes, nodes
from ..packs import pack
from ..trees import animation
from .instances import Instances
from .node_values import KINDS
from .references import HELPS, find, helpers, unmark
from .replacement import BEFORE, CORRECTED, INPUT, MOVED, PreparedPart, Replacement


def apply(plans):
    """Puts the models into the materials; returns the number of converted nodes.

    Links stay, and so do the original nodes, unlinked, for restore(). All groups are made before
    anything is changed. Raises ValueError, also if a node has changed since the plan was made, and
    CompileError.
    """
    instances = Instances()
    wanted = [replace(p, node=p.seen.now(instances)) for p in plans if not p.refusal]
    editable.check(*(block for p in wanted for block in (p.material, p.node.id_data)))
    # A linked parameter may take any value.
    prepared = [[PreparedPart(part, _values(part)) for part in p.parts] for p in wanted]
    known = set(bpy.data.node_groups)
    try:
        for one in (one for each in prepared for one in each):
            nodes.ensure_group(one.part.model, values=one.known)
    except BaseException:
        nodes.remove_unused_groups(known)
        raise
    readers = animation.Readers()
    for p, parts in zip(wanted, prepared, strict=True):
        Replacement(p, parts, readers)
    return len(wanted)


def _values(part):
    return {k: pack.model(part.model).check_value(k, v) for k, v in part.values.items()}


def is_converted(node):
    """Whether a node replaces one of Blender's own."""
    return model_nodes.is_ours(node) and BEFORE in node


def is_of_conversion(node):
    """Whether a model's node replaces one of Blender's own, alone or beside others."""
    return is_converted(node) or HELPS in node


def _before(group):
    before = find(group, BEFORE, group[BEFORE])
    return before if before is not None and before.bl_idname in KINDS else None


def _outgoing(group, added):
    """The outgoing links of a group and of the nodes added along with it."""
    every = [group, *added]
    shaders = [s for node in every for s in node.outputs if s.type == "SHADER"]
    return [link for s in shaders for link in s.links if link.to_node not in every]


def restore(material):
    """Restores the original nodes and settings, also in the node groups of a material, and thus for
    all materials that use these. Where the nodes were deleted, uses the twin, which also consists
    of Blender's own nodes. Returns the number of nodes. Raises ValueError if there is neither."""
    editable.check(material)
    pairs = [(n, _before(n)) for n in model_nodes.all_nodes(material) if is_converted(n)]
    for block in dict.fromkeys(group.id_data for group, _ in pairs):
        editable.check(block)
    for group, before in pairs:
        if before is None:  # refuses before anything is changed
            for model in (group, *filter(model_nodes.is_ours, helpers(group))):
                pack.model(model_nodes.identity(model).model).resolve(
                    "twin", model_nodes.all_values(model)
                )
    own = [group for group, _ in pairs if group.id_data == material.node_tree]
    corrected = [bool(group.get(CORRECTED, True)) for group in own]
    shared = dict.fromkeys(group.id_data for group, _ in pairs if group not in own)
    readers = animation.Readers()
    for group, before in pairs:
        _restore_node(group, before, readers)
    if own:
        bump_correction.restore(material, all(corrected))
    for user in dict.fromkeys(user for tree in shared for user in model_nodes.users_of(tree)):
        bump_correction.prepare(user)
    nodes.remove_unused_groups()
    return len(pairs)


def _moved_back(node, before):
    """The sockets to which animation was moved, and those of the restored node."""
    if model_nodes.is_ours(node):
        sockets = model_nodes.sockets(node)
    else:
        sockets = dict(node.outputs.items())
        sockets |= {INPUT + socket.identifier: socket for socket in node.inputs}
    inputs = {socket.identifier: socket for socket in before.inputs}
    marks = node[MOVED].to_dict() if MOVED in node else {}
    return [(sockets[name], inputs[i]) for name, i in marks.items() if name in sockets]


def _restore_node(group, before, readers):
    tree, added = group.id_data, helpers(group)
    if before is None:
        for model in [group, *filter(model_nodes.is_ours, added)]:
            nodes.switch(model, "twin")
        for key in (BEFORE, CORRECTED, MOVED):
            group.pop(key, None)
        return
    moved = [pair for node in (group, *added) for pair in _moved_back(node, before)]
    animation.move(moved, readers)
    for link in _outgoing(group, added):
        target = link.to_socket
        tree.links.remove(link)
        tree.links.new(before.outputs[0], target)
    before.location = group.location
    unmark(before)
    for helper in added:
        tree.nodes.remove(helper)
    tree.nodes.remove(group)
