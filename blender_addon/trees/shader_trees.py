# SPDX-License-Identifier: GPL-3.0-or-later
"""Follows links in node trees as Cycles does, to find what reaches a socket.

Every module that reads the links of a material, light or world uses this one. Muted and invalid
links are ignored; reroutes and muted nodes pass their input on; groups are entered through their
active output. The value that applies where no link arrives was determined by rendering with Blender
4.5, 5.0 and 5.2; tests/blender/test_trees.py compares this module with such pictures.
"""

from dataclasses import dataclass

import bpy

from ..common.i18n import say
from ..packs import pack

#: The message for a material that has nodes but does not use them.
NODES_OFF = say("Use Nodes is off in this material's settings: Blender shows none of its nodes")
#: Before 5.0, a socket linked to a reroute or muted node without input gets 0; since then it has
#: its own value.
_ZERO = bpy.app.version < (5, 0, 0)


@dataclass(frozen=True)
class Shown:
    """A node, and the group nodes around it, outermost first."""

    node: object
    within: tuple = ()

    def reach(self, socket):
        """What reaches an input socket of the node."""
        return reach(socket, self.within)


@dataclass(frozen=True)
class Reached:
    """What reaches an input socket: either an `output` of a node or a value."""

    output: object = None
    #: The group nodes around the output's node, outermost first.
    within: tuple = ()
    #: If there is no output: the input socket whose value applies; if None, the value is 0.
    holder: object = None
    #: Types of the sockets of groups, reroutes and muted nodes that the value passes on its way, in
    #: this order. Each converts it; since 5.0 only if Blender computes it itself.
    types: tuple = ()

    @property
    def node(self):
        return self.output.node if self.output is not None else None

    @property
    def shown(self):
        return Shown(self.node, self.within)


def shading(owner):
    """The node tree that shades a light, material or world; None if nodes are off."""
    switch = owner.bl_rna.properties.get("use_nodes")
    if switch is None or getattr(switch, "is_deprecated", False) or owner.use_nodes:
        return owner.node_tree
    return None


def _surface(tree):
    """The socket that Cycles takes a tree's surface shader from, or None."""
    output = tree.get_output_node("CYCLES")
    if output is None or (_ZERO and output.mute):
        return None
    return output.inputs["Surface"]


def counts(link):
    """Whether Cycles follows a link."""
    available = link.from_socket.enabled and link.to_socket.enabled
    return link.is_valid and not link.is_muted and available


def _link(socket):
    """The link that gives an input socket its value, or None."""
    # NodeSocket.links searches all links of the tree, so is_linked is tested first.
    return next(filter(counts, socket.links), None) if socket.is_linked else None


def surface_link(tree):
    """The link to the surface that Cycles shows, or None."""
    socket = _surface(tree)
    return None if socket is None else _link(socket)


def _group_end(group):
    """The active output node of a group, or None."""
    ends = [n for n in group.nodes if n.bl_idname == "NodeGroupOutput"]
    end = next((n for n in ends if n.is_active_output), ends[0] if ends else None)
    return None if end is not None and _ZERO and end.mute else end


def _by_identifier(sockets, identifier):
    return next((s for s in sockets if s.identifier == identifier), None)


def _passes(node):
    """The input that each output passes on, for reroutes and muted nodes; None for other nodes."""
    if node.bl_idname == "NodeReroute":
        return {node.outputs[0]: node.inputs[0]}
    # Blender 5 does not mute the input and output nodes of a group.
    if node.mute and (_ZERO or node.bl_idname not in {"NodeGroupInput", "NodeGroupOutput"}):
        return {link.to_socket: link.from_socket for link in node.internal_links}
    return None


def reach(socket, within=()):
    """What reaches an input socket of a node inside the group nodes `within`: Reached.

    The groups of models are not entered. If a group is examined by itself, without the node that
    uses it, its inputs are outputs of its Group Input node.
    """
    holder, seen = socket, set()
    types = after_holder = ()
    while True:
        link = _link(socket)
        if link is None:
            break
        output, node = link.from_socket, link.from_node
        if (output.as_pointer(), within) in seen:
            return Reached(within=within)  # a loop of reroutes
        seen.add((output.as_pointer(), within))
        passes = _passes(node)
        if passes is not None:
            if output not in passes:
                break
            socket = passes[output]
            types = (output.type, *types) if _ZERO else (socket.type, output.type, *types)
        elif node.bl_idname == "NodeGroupInput" and within:
            holder = socket = _by_identifier(within[-1].inputs, output.identifier)
            within = within[:-1]
            types = after_holder = (output.type, *types)
        elif _is_looked_into(node):
            end = _group_end(node.node_tree)
            within = (*within, node)
            holder = socket = end and _by_identifier(end.inputs, output.identifier)
            types = after_holder = (output.type, *types)
        else:
            return Reached(output, within, types=types)
        if socket is None:
            return Reached(within=within)
    if socket != holder and _ZERO:
        return Reached(within=within)
    return Reached(within=within, holder=holder, types=after_holder)


def _is_looked_into(node):
    """Whether a node is a group to be entered. Groups of models are not: they are large and contain
    neither lamps nor other materials."""
    tree = getattr(node, "node_tree", None)
    return isinstance(tree, bpy.types.NodeTree) and pack.TAG not in tree


def is_driven(socket):
    """Whether the output of a node reaches an input socket."""
    return reach(socket).output is not None


def upstream(socket, kind=None, within=()):
    """[Shown] of every node that a socket depends on, optionally only through sockets of one type.
    Reroutes, muted nodes and entered groups are not included."""
    found, waiting = {}, [reach(socket, within)]
    while waiting:
        reached = waiting.pop()
        if reached.output is None or reached.shown in found:
            continue
        found[reached.shown] = None
        inputs = [s for s in reached.node.inputs if kind is None or s.type == kind]
        waiting += [reach(s, reached.within) for s in reversed(inputs)]
    return list(found)


def shown_by(tree):
    """[Shown] of the nodes of a material, light or world whose shaders Cycles shows."""
    socket = _surface(tree)
    return upstream(socket, "SHADER") if socket is not None else []


def shown(owner):
    """The same for a light, material or world; empty if it does not use its nodes."""
    tree = shading(owner)
    return shown_by(tree) if tree is not None else []
