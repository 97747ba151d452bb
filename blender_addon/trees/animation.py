# SPDX-License-Identifier: GPL-3.0-or-later
"""What animates the sockets of a node: F-curves of actions and of NLA strips, and drivers."""

from ..common import editable

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
    """(curve, its block, what it moves a property of, that property), also of other nodes."""
    for owner in _owners(node.id_data):
        for curve in _curves(owner):
            # Paths may name nodes and sockets or count them.
            place, _, name = curve.data_path.rpartition(".")
            try:
                found = owner.path_resolve(place) if place else None
            except ValueError:  # of what is no more
                continue
            if hasattr(found, "as_pointer"):
                yield curve, owner, found, name


def value_of(socket):
    """A socket's value, as moved() has it."""
    return socket.as_pointer(), _VALUE


def moved(node):
    """{(pointer of the node or a socket, name of a property)} of what is animated or driven."""
    own = {item.as_pointer() for item in (node, *node.inputs, *node.outputs)}
    found = {(item.as_pointer(), name) for c, _, item, name in _moves(node) if not c.mute}
    return {(pointer, name) for pointer, name in found if pointer in own}


def _of_inputs(node):
    inputs = {socket.as_pointer(): socket for socket in node.inputs}
    for curve, owner, found, name in _moves(node):
        if name == _VALUE and found.as_pointer() in inputs:
            yield curve, owner, inputs[found.as_pointer()].identifier


def inputs(node):
    """Identifiers of a node's input sockets that are animated or driven. Muted curves count: to
    unmute one later must not be without effect."""
    return {identifier for _, _, identifier in _of_inputs(node)}


def hold(node):
    """[(curve, its block, identifier)] of what animates or drives inputs of a node whose sockets
    are about to have other numbers: Blender 5.2 changes paths by itself, and to wrong ones."""
    for owner in _owners(node.id_data) if inputs(node) else ():
        data = owner.animation_data
        for holder in _holders(data) if data else ():
            _make_own(owner, holder)
    return list(_of_inputs(node))


def follow(curve, owner, socket):
    """Has a curve or driver animate a socket of a tree."""
    prefix = "" if owner == socket.id_data else "node_tree."
    curve.data_path = prefix + socket.path_from_id(_VALUE)


def _make_own(owner, holder):
    """Copies of a material share its action, and are to keep their paths."""
    action, slot = holder.action, holder.action_slot
    if slot is None or (action.library is None and all(user == owner for user in slot.users())):
        return
    holder.action = action.copy()
    holder.action_slot = holder.action.slots[slot.identifier]
