# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts another group of the same model into a group node."""

from ..trees import animation
from . import model_nodes


def has_linked_outputs(node, group):
    """Whether a group has all outputs of a node that are linked."""
    items = group.interface.items_tree
    names = {i.name for i in items if i.item_type == "SOCKET" and i.in_out == "OUTPUT"}
    return names >= {output.name for output in node.outputs if output.is_linked}


#: Types of sockets whose values every group of a model can hold: numbers and colours.
_PLAIN = ("VALUE", "RGBA")


def _copied(value):
    return value if isinstance(value, float) else tuple(value)


def replace_group(node, group):
    """Puts another group of the same model into a group node; values, links, animation and which
    sockets are hidden stay. Animation of inputs that the new group lacks is muted. If it raises,
    the node is as it was."""
    before = node.node_tree
    if group == before:
        return
    tree, sockets = node.id_data, model_nodes.sockets(node)
    names = {s.identifier: name for name, s in sockets.items()}
    animated = [(*moves, names.get(identifier)) for *moves, identifier in animation.capture(node)]
    values = model_nodes.all_values(node)
    # A link hides the value of its socket, which shows again without the link.
    under_links = {
        name: _copied(s.default_value)
        for name, s in sockets.items()
        if s.is_linked and s.type in _PLAIN
    }
    incoming = [
        (link.from_socket, name, link.is_muted) for name, s in sockets.items() for link in s.links
    ]
    outgoing = [(s.name, link.to_socket, link.is_muted) for s in node.outputs for link in s.links]
    hidden = {name for name, s in sockets.items() if s.hide}
    hidden_outputs = {s.name for s in node.outputs if s.hide}
    for link in [link for s in (*node.inputs, *node.outputs) for link in s.links]:
        tree.links.remove(link)

    def put(group):
        node.node_tree = group
        present = model_nodes.sockets(node)
        for name, value in under_links.items():
            if name in present and present[name].type in _PLAIN:
                present[name].default_value = value
        for name, value in values.items():
            if name in present and value is not None:
                model_nodes.set_value(node, name, value)
        for source, name, muted in incoming:
            if name in present:
                tree.links.new(source, present[name]).is_muted = muted
        for name, target, muted in outgoing:
            tree.links.new(node.outputs[name], target).is_muted = muted
        for name, socket in present.items():
            socket.hide = name in hidden
        for socket in node.outputs:
            socket.hide = socket.name in hidden_outputs
        return present

    try:
        present = put(group)
    except BaseException:
        put(before)
        raise
    for curve, owner, name in animated:  # curves address sockets by index
        if name in present:
            animation.retarget(curve, owner, present[name])
        else:
            curve.mute = True
