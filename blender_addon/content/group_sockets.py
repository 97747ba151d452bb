# SPDX-License-Identifier: GPL-3.0-or-later
"""Input sockets of node groups: one for each parameter of the model, with range and tooltip."""

import json

import bpy

from ..packs import pack
from ..packs.parameter_values import choice_label


def _output(group_input, socket):
    """The output of a group's input node for one of the group's sockets."""
    return next(s for s in group_input.outputs if s.identifier == socket.identifier)


def _socket(group, name, kind, description, **settings):
    socket = group.interface.new_socket(
        name, in_out="INPUT", socket_type=kind, description=description
    )
    for key, value in settings.items():
        setattr(socket, key, value)
    return socket


def _range_text(parameter):
    unit = f" {parameter['unit']}" if parameter.get("unit") else ""
    return f"{parameter['min']:g} to {parameter['max']:g}{unit}"


def tooltip(parameter):
    """Tooltip of a parameter's socket: its description and the accepted values."""
    doc = parameter["doc"].rstrip()
    doc += "" if doc.endswith((".", "!", "?")) or not doc else "."
    if parameter["kind"] == "number":
        return f"{doc} Accepted: {_range_text(parameter)}"
    if parameter["kind"] == "choice":
        listed = ", ".join(f"{i} = {c}" for i, c in enumerate(parameter["choices"]))
        return f"{doc} {listed}"
    return doc.removesuffix(".")


def has_menus():
    """Whether shader groups can have menu sockets (Blender 5.0 on); before, a choice is a
    number."""
    return bpy.app.version >= (5, 0, 0)


def _choice_socket_type():
    return "NodeSocketMenu" if has_menus() else "NodeSocketInt"


def has_own_choices(group):
    """Whether the sockets of a group's choices are those that this Blender makes."""
    tag = group[pack.TAG]
    made = tag.get("sockets", {})
    found = {made[name] for name in json.loads(tag["choices"]) if name in made}
    kind = _choice_socket_type()
    items = (item for item in group.interface.items_tree if item.item_type == "SOCKET")
    return all(item.socket_type == kind for item in items if item.identifier in found)


def _choice_socket(group, parameter):
    default, kind = parameter["choices"].index(parameter["default"]), _choice_socket_type()
    if has_menus():
        return _socket(group, parameter["label"], kind, tooltip(parameter))
    return _socket(
        group,
        parameter["label"],
        kind,
        tooltip(parameter),
        min_value=0,
        max_value=len(parameter["choices"]) - 1,
        default_value=default,
    )


def _link_choice(group, source, target, parameter):
    if not has_menus():
        group.links.new(source, target)
        return
    switch = group.nodes.new("GeometryNodeMenuSwitch")
    switch.label = parameter["label"]
    switch.data_type = "INT"
    switch.enum_items.clear()
    for identifier in parameter["choices"]:
        switch.enum_items.new(choice_label(identifier))
    values = [s for s in switch.inputs if s.type == "INT"]
    for index, value in enumerate(values):
        value.default_value = index
    group.links.new(source, switch.inputs[0])
    group.links.new(switch.outputs[0], target)


def _number_socket(group, parameter):
    label, text = parameter["label"], tooltip(parameter)
    if parameter["kind"] == "color":
        color = (*parameter["default"], 1.0)
        return _socket(group, label, "NodeSocketColor", text, default_value=color)
    # Blender limits a slider to a socket's range but accepts typed numbers outside it: just what
    # the soft range means. Beyond the accepted range, the panel warns.
    low, high = parameter["soft_min"], parameter["soft_max"]
    settings = {"min_value": low, "max_value": high}
    if (low, high) == (0, 1) == (parameter["min"], parameter["max"]):
        settings = {"subtype": "FACTOR"} | settings
    return _socket(
        group, label, "NodeSocketFloat", text, **settings, default_value=parameter["default"]
    )


def _panel(group, name):
    """The panel of a group with this name, made if there is none. A new one is closed."""
    panels = (i for i in group.interface.items_tree if i.item_type == "PANEL")
    found = next((p for p in panels if p.name == name), None)
    return found or group.interface.new_panel(name, default_closed=True)


def _parameter_socket(group, parameter):
    make = _choice_socket if parameter["kind"] == "choice" else _number_socket
    socket = make(group, parameter)
    if name := parameter.get("panel"):
        panel = _panel(group, name)
        group.interface.move_to_parent(socket, panel, len(panel.interface_items))
    return socket


def add_parameter(group, group_input, target, parameter, socket=None):
    """Links a parameter's socket, which is made if not given, to an input inside the group. Returns
    the socket."""
    is_choice, is_new = parameter["kind"] == "choice", socket is None
    if is_new:
        socket = _parameter_socket(group, parameter)
    source = _output(group_input, socket)
    if not is_choice:
        group.links.new(source, target)
        return socket
    _link_choice(group, source, target, parameter)
    if is_new and has_menus():  # a menu socket takes its items from its link
        socket.default_value = choice_label(parameter["default"])
    return socket


#: Sockets of a group besides its model's parameters, and their tooltips.
VECTORS = {
    pack.NORMAL: "Shading normal; unlinked, the one of the surface",
    pack.TANGENT: "First axis of anisotropy; unlinked, the object's Z axis along the surface",
}


def vector_socket(group, name, text):
    # Hidden value: unlinked, the input keeps the shader's default, which is the shading normal or
    # the frame that the shader builds by itself.
    return _socket(group, name, "NodeSocketVector", text, hide_value=True)


class Interface:
    """Sockets of a group by name: created if missing, and linked to the group's nodes."""

    def __init__(self, group, group_input, known):
        """`known`: identifiers of the sockets that the group has, by name."""
        self.group, self.group_input = group, group_input
        items = (i for i in group.interface.items_tree if i.item_type == "SOCKET")
        found = {item.identifier: item for item in items if item.in_out == "INPUT"}
        self.sockets = {name: found[i] for name, i in known.items() if i in found}

    def parameter(self, name, target, parameter):
        """Links a parameter to an input inside the group."""
        have = self.sockets.get(name)
        self.sockets[name] = add_parameter(self.group, self.group_input, target, parameter, have)

    def require(self, name, parameter):
        """Makes a parameter's socket if the group has none, without a link."""
        if name not in self.sockets:
            self.sockets[name] = _parameter_socket(self.group, parameter)

    def output(self, name):
        """The output inside the group of a socket."""
        return _output(self.group_input, self.sockets[name])

    def vector(self, name):
        """The output inside the group of one of the sockets in VECTORS."""
        if name not in self.sockets:
            self.sockets[name] = vector_socket(self.group, name, VECTORS[name])
        return self.output(name)

    def identifiers(self):
        return {name: socket.identifier for name, socket in self.sockets.items()}
