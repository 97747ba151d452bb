# SPDX-License-Identifier: GPL-3.0-or-later
"""Drivers of sockets by one number. They compute without Python, so that a file is right where
scripts are not allowed to run."""


def add(socket, channel=-1):
    """A driver of a socket's value, or of a channel of it, that is the mean of its one variable.
    Returns its curve and the variable, which is to be pointed at something."""
    curve = socket.driver_add("default_value", channel)
    curve.driver.type = "AVERAGE"
    return curve, curve.driver.variables.new()


def point_at(variable, owner, path):
    """Has a variable be a property of a data-block. A node tree that is part of a material is none:
    its property is the material's."""
    target = variable.targets[0]
    target.id_type, target.id = owner.id_type, owner
    target.data_path = path
