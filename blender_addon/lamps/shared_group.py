# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group shared by all shaders: creates and finds it, reads and writes its numbers."""

import math

import bpy

from . import slots

#: Name of the shared group, which a dot keeps out of menus, and the custom property that
#: identifies it.
GROUP = ".brdfc Lamps"
TAG = "brdfc_lamps"
_NAMES = slots.part_names(slots.SLOTS)


def make():
    """An empty shared group."""
    group = bpy.data.node_groups.new(GROUP, "ShaderNodeTree")
    group[TAG] = 1
    group.description = "The lamps that materials of brdfc use. Updated by brdfc"
    for name in _NAMES:
        group.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketVector")
    _add_nodes(group)
    return group


def _add_nodes(group):
    end = group.nodes.new("NodeGroupOutput")
    end.location = (300, 0)
    for index, name in enumerate(_NAMES):
        node = group.nodes.new("ShaderNodeCombineXYZ")
        node.name = node.label = name
        node.hide = True
        node.location = (0, -40 * index)
        group.links.new(node.outputs[0], end.inputs[name])


def is_whole(group):
    """Whether a shared group has all nodes that it was made with."""
    nodes = {node.name: node.bl_idname for node in group.nodes}
    return nodes.keys() >= {*_NAMES} and "NodeGroupOutput" in nodes.values()


def mend(group):
    """Makes the nodes of a shared group anew if somebody has deleted some of them. Drivers find
    theirs by name."""
    if not is_whole(group):
        group.nodes.clear()
        _add_nodes(group)


def is_shared(group):
    """Whether a node group is a shared group, of the open file or of another."""
    return TAG in group


def _own():
    return [g for g in bpy.data.node_groups if g.library is None and is_shared(g)]


def find():
    """The shared group of the open file, or None."""
    group = bpy.data.node_groups.get((GROUP, None))
    if group is not None and TAG in group:
        return group
    return next(iter(_own()), None)


def remove_unused():
    """Removes the shared group from the file when no shader uses it."""
    for group in _own():
        if group.users == 0:
            bpy.data.node_groups.remove(group)


def deduplicate():
    """The shared group. Copies, which appended materials bring, are replaced by it.

    If one of them was appended, that one is kept: Blender recognizes it, and appends neither it nor
    its dependencies again.
    """
    group = next((g for g in _own() if g.library_weak_reference is not None), find())
    copies = [other for other in _own() if other != group]
    for other in copies:
        other.user_remap(group)
        bpy.data.node_groups.remove(other)
    if copies:
        group.name = GROUP
    return group


def sockets(group):
    """[(socket, data path)] of the numbers of all slots, twelve per slot."""
    found = []
    for name in _NAMES:
        for index, socket in enumerate(group.nodes[name].inputs):
            found.append((socket, _path(name, index)))
    return found


def _path(name, index):
    return f'nodes["{name}"].inputs[{index}].default_value'


def _curves(group):
    """Drivers by data path."""
    if group.animation_data is None:
        return {}
    return {curve.data_path: curve for curve in group.animation_data.drivers}


def room(group):
    """The slots.Room that its lamps need, which have the first slots."""
    curves, shapes, count = _curves(group), [], 0
    for slot in range(1, slots.SLOTS + 1):
        name = f"{slots.PARTS[-1]}{slot}"
        curve = curves.get(_path(name, 0))
        shapes.append(_read(curve) if curve else group.nodes[name].inputs[0].default_value)
        if shapes[-1] != slots.EMPTY:
            count = slot
    return slots.room_for(shapes[:count])


def written(group):
    """The current numbers of the group: floats and slots.Driven; None for a driver that the
    extension did not make."""
    curves, values = _curves(group), []
    for socket, path in sockets(group):
        curve = curves.get(path)
        values.append(socket.default_value if curve is None else _read(curve))
    return values


def _read(curve):
    driver = curve.driver
    if len(driver.variables) != 1 or not curve.is_valid:
        return None
    variable = driver.variables[0]
    target = variable.targets[0]
    if target.id is None:
        return None
    channel = variable.type == "TRANSFORMS"
    path = target.transform_type if channel else target.data_path
    added, factor = curve.modifiers[0].coefficients if curve.modifiers else (0.0, 1.0)
    return slots.Driven(target.id, path, factor, added)


def _add_driver(socket):
    """Adds a driver to a socket's value: the average of a single variable, which needs no Python,
    so that files work where scripts are not allowed to run. Returns its curve and the variable."""
    curve = socket.driver_add("default_value")
    curve.driver.type = "AVERAGE"
    return curve, curve.driver.variables.new()


def write(socket, value):
    """Sets a socket to a float, or gives it the driver for a slots.Driven."""
    socket.driver_remove("default_value")
    if not isinstance(value, slots.Driven):
        socket.default_value = value
        return
    curve, variable = _add_driver(socket)
    if value.is_channel:
        variable.type = "TRANSFORMS"
        target = variable.targets[0]
        target.id = value.of
        target.transform_type = value.path
        target.transform_space = "WORLD_SPACE"
        target.rotation_mode = "QUATERNION"
    else:
        target = variable.targets[0]
        target.id_type, target.id = value.of.id_type, value.of
        target.data_path = value.path
    if (value.factor, value.added) != (1.0, 0.0):
        # 4.5 gives a driver's curve this modifier; later versions give it two keys on the diagonal.
        modifier = curve.modifiers[0] if curve.modifiers else curve.modifiers.new("GENERATOR")
        modifier.coefficients = (value.added, value.factor)


def same(a, b):
    """Whether a socket can't tell two numbers apart; see written()."""
    if isinstance(a, slots.Driven) or isinstance(b, slots.Driven):
        return (
            isinstance(a, slots.Driven)
            and isinstance(b, slots.Driven)
            and (a.of, a.path) == (b.of, b.path)
            and math.isclose(a.factor, b.factor, rel_tol=1e-5)
            and math.isclose(a.added, b.added, rel_tol=1e-5, abs_tol=1e-6)
        )
    # Sockets hold single precision.
    return a is not None and b is not None and math.isclose(a, b, rel_tol=1e-5, abs_tol=1e-6)


def all_same(a, b):
    """The same for two sequences of equal length."""
    return all(map(same, a, b))
