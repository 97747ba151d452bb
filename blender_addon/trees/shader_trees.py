# SPDX-License-Identifier: GPL-3.0-or-later
"""What reaches a socket: node trees as Cycles reads them.

Everything that reads the links of a material, a light or a world asks this module. Links that are
muted or invalid do not count; reroutes and muted nodes pass on what they are given; groups are
looked into, from their active output. Which value counts where nothing arrives was rendered in
Blender 4.5, 5.0 and 5.2: tests/blender/test_trees.py holds this module to the pictures.
"""

from dataclasses import dataclass

import bpy

from ..common.i18n import say
from ..packs import pack

#: Before 5.0, 0 is what reaches a socket whose reroute or muted node is given nothing; since then
#: the socket has its own value.
_ZERO = bpy.app.version < (5, 0, 0)


@dataclass(frozen=True)
class Shown:
    """A node, and the group nodes that it lies in, the outermost first."""

    node: object
    within: tuple = ()

    def reach(self, socket):
        """What reaches an input socket of the node."""
        return reach(socket, self.within)


@dataclass(frozen=True)
class Reached:
    """What reaches an input socket: an `output` of a node, or else a value."""

    output: object = None
    #: The group nodes that the node of the output lies in, the outermost first.
    within: tuple = ()
    #: Where there is no output: the input socket whose value counts; without one the value is 0.
    holder: object = None

    @property
    def node(self):
        return self.output.node if self.output is not None else None

    @property
    def shown(self):
        return Shown(self.node, self.within)


def shading(owner):
    """The node tree that shades a light, material or world, or None."""
    switch = owner.bl_rna.properties.get("use_nodes")
    if switch is None or getattr(switch, "is_deprecated", False) or owner.use_nodes:
        return owner.node_tree
    return None


def nodes_off():
    """What is said of a material that has nodes and does not use them."""
    return say("Use Nodes is off in this material's settings: Blender shows none of its nodes")


def _surface(tree):
    """The socket that Cycles takes a tree's shader from, or None."""
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
    # A socket's links are a search through those of the tree.
    return next(filter(counts, socket.links), None) if socket.is_linked else None


def _group_end(group):
    """The node that ends a group, or None."""
    ends = [n for n in group.nodes if n.bl_idname == "NodeGroupOutput"]
    end = next((n for n in ends if n.is_active_output), ends[0] if ends else None)
    return None if end is not None and _ZERO and end.mute else end


def _by_identifier(sockets, identifier):
    return next((s for s in sockets if s.identifier == identifier), None)


def _passes(node):
    """The input of each output of a reroute or of a muted node; None of nodes that compute."""
    if node.bl_idname == "NodeReroute":
        return {node.outputs[0]: node.inputs[0]}
    # Blender 5 does not mute the ends of a group.
    if node.mute and (_ZERO or node.bl_idname not in {"NodeGroupInput", "NodeGroupOutput"}):
        return {link.to_socket: link.from_socket for link in node.internal_links}
    return None


def reach(socket, within=()):
    """What reaches an input socket of a node that lies in the group nodes `within`: Reached.

    Groups of models are not looked into, and an input of a group that is looked at by itself,
    without the node that shows it, is an output of its Group Input node.
    """
    holder, seen = socket, set()
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
        elif node.bl_idname == "NodeGroupInput" and within:
            holder = socket = _by_identifier(within[-1].inputs, output.identifier)
            within = within[:-1]
        elif _is_looked_into(node):
            end = _group_end(node.node_tree)
            within = (*within, node)
            holder = socket = end and _by_identifier(end.inputs, output.identifier)
        else:
            return Reached(output, within)
        if socket is None:
            return Reached(within=within)
    return Reached(within=within, holder=holder if socket == holder or not _ZERO else None)


def _is_looked_into(node):
    """Whether a node is a group, but for those of models, which are large and hold neither lamps
    nor other materials."""
    tree = getattr(node, "node_tree", None)
    return isinstance(tree, bpy.types.NodeTree) and pack.TAG not in tree


def is_driven(socket):
    """Whether the output of a node reaches an input socket."""
    return reach(socket).output is not None


def upstream(socket, kind=None, within=()):
    """[Shown] of every node that a socket hangs on, by sockets of one type if it is given. Nodes
    that pass on what they are given are not among them, nor groups that are looked into."""
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
    """The same of a light, material or world; none where it does not use its nodes."""
    tree = shading(owner)
    return shown_by(tree) if tree is not None else []
