# SPDX-License-Identifier: GPL-3.0-or-later
"""Which materials and trees of the open file keep a change when the file is saved."""

import bpy

from .i18n import say


def named(block):
    """The material that a tree is part of, for such a tree has no name of its own."""
    if not block.is_embedded_data:
        return block
    return next((m for m in bpy.data.materials if m.node_tree == block), block)


def refusal(*blocks):
    """Why a change to one of these materials or trees would be gone in the saved file; None where
    it stays."""
    for block in map(named, blocks):
        if block.library is not None:
            file = block.library.filepath
            return say(
                "{name!r} is linked from {file}: Make Local first", name=block.name, file=file
            )
        if (override := block.override_library) is not None:
            # Tried in Blender 4.5 to 5.2: of a material's override a file keeps which group a node
            # has, and neither values of sockets, links and new nodes nor settings of Cycles.
            file = override.reference.library.filepath
            return say(
                "{name!r} is a library override of {file}, and changes to its nodes would not be "
                "saved: Make Local first",
                name=block.name,
                file=file,
            )
    return None


def stays(*blocks):
    """Whether there is no refusal()."""
    return refusal(*blocks) is None


def check(*blocks):
    """Raises ValueError where there is a refusal()."""
    if why := refusal(*blocks):
        raise ValueError(why)
