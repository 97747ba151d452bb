# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds and moves the animation of node sockets: F-curves of actions and NLA strips, and
drivers."""

import bpy

from ..common import editable

_VALUE = "default_value"


def _owners(tree):
    """Data-blocks whose animation can reach a node tree: the tree and the material that owns it."""
    return dict.fromkeys((tree, editable.named(tree)))


def _holders(data):
    """The parts of a block's animation data that have an action: the data itself and its NLA
    strips."""
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
    """Each F-curve and driver of a block, once."""
    data = owner.animation_data
    if data is None:
        return []
    curves = [*data.drivers, *(c for holder in _holders(data) for c in _of_holder(holder))]
    return {curve.as_pointer(): curve for curve in curves}.values()


def animates(owner, path):
    """Whether an F-curve or a driver animates this property of a data-block."""
    return any(curve.data_path == path for curve in _curves(owner))


def _targets(tree):
    """Yields (curve, its data-block, the object it animates, the property's name), for everything
    in a tree."""
    for owner in _owners(tree):
        for curve in _curves(owner):
            # A path may address nodes and sockets by name or by index.
            place, _, name = curve.data_path.rpartition(".")
            try:
                found = owner.path_resolve(place) if place else None
            except ValueError:  # the node or socket no longer exists
                continue
            if hasattr(found, "as_pointer"):
                yield curve, owner, found, name


def value_key(socket):
    """The key of a socket's value in the set that animated_properties() returns."""
    return socket.as_pointer(), _VALUE


def has_driver(socket):
    """Whether a driver controls the value of an input."""
    return any(
        curve.driver is not None and (found.as_pointer(), name) == value_key(socket)
        for curve, _, found, name in _targets(socket.id_data)
    )


def animated_properties(node):
    """The animated or driven properties of a node: {(pointer of the node or socket, property
    name)}."""
    own = {item.as_pointer() for item in (node, *node.inputs, *node.outputs)}
    found = {(item.as_pointer(), name) for c, _, item, name in _targets(node.id_data) if not c.mute}
    return {(pointer, name) for pointer, name in found if pointer in own}


def _of_inputs(node):
    inputs = {socket.as_pointer(): socket for socket in node.inputs}
    for curve, owner, found, name in _targets(node.id_data):
        if name == _VALUE and found.as_pointer() in inputs:
            yield curve, owner, inputs[found.as_pointer()].identifier


def animated_inputs(node):
    """Identifiers of the input sockets of a node that are animated or driven.

    Muted curves count, so that unmuting one later still has an effect."""
    return {identifier for _, _, identifier in _of_inputs(node)}


def capture(node):
    """Records what animates a node's inputs before its sockets are renumbered.

    Returns [(curve, its data-block, socket identifier)]. Blender 5.2 rewrites the paths by itself,
    and gets them wrong."""
    if animated_inputs(node):
        _make_all_own(node.id_data)
    return list(_of_inputs(node))


def move(pairs, readers=None):
    """Moves what animates the values of sockets, curves and drivers, also muted ones, to other
    sockets of the same tree, and has all drivers of the file read the values there. `pairs`:
    [(from, to)]; `readers`: the Readers of the file, if they are known."""
    if not pairs:
        return
    tree, wanted = pairs[0][0].id_data, {a.as_pointer(): b for a, b in pairs}

    def found():
        return [
            (curve, owner, wanted[item.as_pointer()])
            for curve, owner, item, name in _targets(tree)
            if name == _VALUE and item.as_pointer() in wanted
        ]

    if found():
        _make_all_own(tree)
    for target in found():
        retarget(*target)
    (readers or Readers()).redirect(pairs)


def _blocks():
    """Yields (data-block, its owner if it is embedded, else itself) for all of the file that may
    have drivers."""
    for kind in bpy.data.bl_rna.properties:
        if kind.type != "COLLECTION":
            continue
        for block in getattr(bpy.data, kind.identifier):
            yield block, block
            for name in ("node_tree", "compositing_node_group"):
                if (tree := getattr(block, name, None)) is not None and tree.is_embedded_data:
                    yield tree, block


class Readers:
    """The drivers of the file that read values of sockets. The file is searched once."""

    def __init__(self):
        #: [(target of a driver's variable, the owner of the driver)] by pointer of the socket.
        self._found = {}
        for block, owner in _blocks():
            data = getattr(block, "animation_data", None)
            for curve in data.drivers if data else ():
                for target in (t for v in curve.driver.variables for t in v.targets):
                    self._add(target, owner)

    def _add(self, target, owner):
        place, _, name = target.data_path.rpartition(".")
        if target.id is None or not place or name.partition("[")[0] != _VALUE:
            return
        try:
            socket = target.id.path_resolve(place)
        except ValueError:  # the node or socket no longer exists
            return
        if isinstance(socket, bpy.types.NodeSocket):
            self._found.setdefault(socket.as_pointer(), []).append((target, owner))

    def of(self, socket):
        """The data-blocks whose drivers read the value of a socket: materials, not their trees."""
        found = self._found.get(socket.as_pointer(), [])
        return list(dict.fromkeys(owner for _, owner in found))

    def stuck(self, socket):
        """Those of them that keep no change, as they are linked from another file."""
        return [block for block in self.of(socket) if not editable.keeps_changes(block)]

    def redirect(self, pairs):
        """Has drivers read the values of sockets elsewhere: [(from, to)]."""
        for old, new in pairs:
            for target, owner in self._found.pop(old.as_pointer(), []):
                at = new
                if not editable.keeps_changes(owner):
                    at = old
                else:
                    # The path may lead to the tree through a material, or through an object's.
                    tree, _, place = target.data_path.rpartition("nodes[")
                    _, bracket, index = place.rpartition(".")[2].partition("[")
                    target.data_path = tree + new.path_from_id(_VALUE) + bracket + index
                self._found.setdefault(at.as_pointer(), []).append((target, owner))


def _path(owner, socket):
    """The path from a data-block, a tree or its material, to the value of a socket."""
    return ("" if owner == socket.id_data else "node_tree.") + socket.path_from_id(_VALUE)


def retarget(curve, owner, socket):
    """Redirects a curve or driver to a socket of a tree."""
    curve.data_path = _path(owner, socket)


def _make_all_own(tree):
    for owner in _owners(tree):
        data = owner.animation_data
        for holder in _holders(data) if data else ():
            _make_own(owner, holder)


def _make_own(owner, holder):
    """Gives the owner an action of its own: copies of a material share one, whose paths must
    stay."""
    action, slot = holder.action, holder.action_slot
    if slot is None or (action.library is None and all(user == owner for user in slot.users())):
        return
    holder.action = action.copy()
    holder.action_slot = holder.action.slots[slot.identifier]
