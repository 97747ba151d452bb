# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers functions as Blender's handlers: {name in bpy.app.handlers: function}."""

import bpy


def register(functions):
    for name, function in functions.items():
        getattr(bpy.app.handlers, name).append(function)


def unregister(functions):
    for name, function in functions.items():
        if function in (handlers := getattr(bpy.app.handlers, name)):
            handlers.remove(function)
