# SPDX-License-Identifier: GPL-3.0-or-later
"""Follows the links of the node trees that shade lights, materials and worlds."""

from . import pack


def shading(owner):
    """The node tree that shades a light, material or world, or None."""
    switch = owner.bl_rna.properties.get("use_nodes")
    if switch is None or getattr(switch, "is_deprecated", False) or owner.use_nodes:
        return owner.node_tree
    return None


def output(tree, kind):
    """The node of a type that Cycles takes a tree's result from, or None."""
    outputs = [n for n in tree.nodes if n.bl_idname == kind]
    fits = [n for n in outputs if getattr(n, "target", "ALL") in {"ALL", "CYCLES"}] or outputs
    return next((n for n in fits if n.is_active_output), fits[0] if fits else None)


def ends(node):
    """Nodes whose inputs the outputs of one hang on: itself, and what ends the group in it."""
    inner = getattr(node, "node_tree", None)
    inside = inner.nodes if inner is not None else ()
    return [node, *(end for end in inside if end.bl_idname == "NodeGroupOutput")]


def upstream(socket, kind=None, seen=None):
    """Every node that a socket hangs on, by links of one type of socket if it is given; groups are
    looked into, but for those of models, which are large and hold neither lamps nor
    other materials."""
    seen = [] if seen is None else seen
    for link in socket.links:
        node = link.from_node
        if node in seen:
            continue
        seen.append(node)
        if pack.TAG in (getattr(node, "node_tree", None) or ()):
            continue
        for end in ends(node):
            for own in end.inputs:
                if (kind is None or own.type == kind) and own.is_linked:
                    upstream(own, kind, seen)
    return seen
