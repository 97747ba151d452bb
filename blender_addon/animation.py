# SPDX-License-Identifier: GPL-3.0-or-later
"""What animates the sockets of a node: F-curves of actions and of NLA strips, and drivers."""

from . import editable

_VALUE = "default_value"


def _owners(tree):
    """Data-blocks whose animation can reach a tree: a material's own reaches its nodes too."""
    return dict.fromkeys((tree, editable.named(tree)))


def _holders(data):
    """What of a block's animation has an action: itself, and its NLA strips."""
    holders, strips = [data], [strip for track in data.nla_tracks for strip in track.strips]
    while strips:
        holders.append(strip := strips.pop())
        strips += strip.strips
    return [holder for holder in holders if holder.action is not None]


def _of_holder(holder):
    return [
        curve
        for layer in holder.action.layers
        for strip in layer.strips
        for bag in strip.channelbags
        if bag.slot == holder.action_slot
        for curve in bag.fcurves
    ]


def _curves(owner):
    """Each curve and driver of a block once."""
    data = owner.animation_data
    if data is None:
        return []
    curves = [*data.drivers, *(c for holder in _holders(data) for c in _of_holder(holder))]
    return {curve.as_pointer(): curve for curve in curves}.values()


def _moves(node):
    """(curve, what it moves a property of, that property) of a node and what else lies there."""
    for owner in _owners(node.id_data):
        for curve in _curves(owner):
            # Paths may name nodes and sockets or count them.
            place, _, name = curve.data_path.rpartition(".")
            try:
                found = owner.path_resolve(place) if place else None
            except ValueError:  # of what is no more
                continue
            if hasattr(found, "as_pointer"):
                yield curve, found, name


def moved(node):
    """{(pointer of the node or a socket, name of a property)} of what is animated or driven."""
    own = {item.as_pointer() for item in (node, *node.inputs)}
    moves = ((found.as_pointer(), name) for curve, found, name in _moves(node) if not curve.mute)
    return {(pointer, name) for pointer, name in moves if pointer in own}


def paths(node):
    """{path: input socket} of a node's inputs that are animated or driven. Muted curves count: to
    unmute one later must not be without effect."""
    inputs = {socket.as_pointer(): socket for socket in node.inputs}
    return {
        curve.data_path: inputs[found.as_pointer()]
        for curve, found, name in _moves(node)
        if name == _VALUE and found.as_pointer() in inputs
    }


def _make_own(owner, holder):
    """Copies of a material share its action, and are to keep their paths."""
    action, slot = holder.action, holder.action_slot
    if action.library is None and all(user == owner for user in slot.users()):
        return
    holder.action = action.copy()
    holder.action_slot = holder.action.slots[slot.identifier]


def move(tree, sockets):
    """Has curves and drivers follow sockets that have other numbers now. `sockets`: {path of
    before: socket}; what animates one that is no more, None, is muted."""
    for owner in _owners(tree):
        data = owner.animation_data
        for holder in _holders(data) if data else ():
            if any(curve.data_path in sockets for curve in _of_holder(holder)):
                _make_own(owner, holder)
        prefix = "" if owner == tree else "node_tree."
        for curve in _curves(owner):
            if curve.data_path not in sockets:
                continue
            if socket := sockets[curve.data_path]:
                curve.data_path = prefix + socket.path_from_id(_VALUE)
            else:
                curve.mute = True
