# SPDX-License-Identifier: GPL-3.0-or-later
"""Input sockets of node groups: one a parameter of the model, with range and tooltip."""

import bpy

from . import pack
from .pack import choice_label


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
    """Tooltip of a parameter's socket: its description and what it accepts."""
    doc = parameter["doc"].rstrip()
    doc += "" if doc.endswith((".", "!", "?")) or not doc else "."
    if parameter["kind"] == "number":
        return f"{doc} Accepted: {_range_text(parameter)}"
    if parameter["kind"] == "choice":
        listed = ", ".join(f"{i} = {c}" for i, c in enumerate(parameter["choices"]))
        return f"{doc} {listed}"
    return doc.removesuffix(".")


def has_menus():
    """Whether shader groups can have menu sockets (from 5.0); a choice is a number before that."""
    return bpy.app.version >= (5, 0, 0)


def _add_choice(group, group_input, script_input, parameter):
    default = parameter["choices"].index(parameter["default"])
    if not has_menus():
        socket = _socket(
            group,
            parameter["label"],
            "NodeSocketInt",
            tooltip(parameter),
            min_value=0,
            max_value=len(parameter["choices"]) - 1,
            default_value=default,
        )
        group.links.new(group_input.outputs[-2], script_input)
        return socket
    switch = group.nodes.new("GeometryNodeMenuSwitch")
    switch.label = parameter["label"]
    switch.data_type = "INT"
    switch.enum_items.clear()
    for identifier in parameter["choices"]:
        switch.enum_items.new(choice_label(identifier))
    values = [s for s in switch.inputs if s.type == "INT"]
    for index, value in enumerate(values):
        value.default_value = index
    socket = _socket(group, parameter["label"], "NodeSocketMenu", tooltip(parameter))
    group.links.new(group_input.outputs[-2], switch.inputs[0])
    group.links.new(switch.outputs[0], script_input)
    socket.default_value = choice_label(parameter["default"])
    return socket


def add_parameter(group, group_input, script_input, parameter):
    label, text, kind = parameter["label"], tooltip(parameter), parameter["kind"]
    if kind == "choice":
        return _add_choice(group, group_input, script_input, parameter)
    if kind == "color":
        color = (*parameter["default"], 1.0)
        socket = _socket(group, label, "NodeSocketColor", text, default_value=color)
    else:
        # Blender holds a slider to a socket's range but accepts other typed numbers: that is
        # the meaning of the soft range. Out of the accepted range, the panel warns.
        low, high = parameter["soft_min"], parameter["soft_max"]
        settings = {"min_value": low, "max_value": high}
        if (low, high) == (0, 1) == (parameter["min"], parameter["max"]):
            settings = {"subtype": "FACTOR"} | settings
        socket = _socket(
            group, label, "NodeSocketFloat", text, **settings, default_value=parameter["default"]
        )
    group.links.new(group_input.outputs[-2], script_input)
    return socket


#: Sockets of a group beside its model's parameters, and their tooltips.
VECTORS = {
    pack.NORMAL: "Shading normal; unlinked, the one of the surface",
    pack.TANGENT: "First axis of anisotropy; unlinked, the object's Z axis along the surface",
}


def vector_socket(group, name, text):
    # Without a value, an unlinked input keeps the shader's own default: the shading normal, and
    # the frame that the shader builds for itself.
    return _socket(group, name, "NodeSocketVector", text, hide_value=True)
