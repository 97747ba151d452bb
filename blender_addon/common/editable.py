# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells which materials and node trees of the open file are saved with it when they change."""

import bpy

from .i18n import say


def named(block):
    """The material that owns a node tree, as such a tree has no name of its own; else the block."""
    if not block.is_embedded_data:
        return block
    return next((m for m in bpy.data.materials if m.node_tree == block), block)


def refusal(*blocks):
    """Why a change to one of these materials or trees would be lost on saving; None if it is
    kept."""
    for block in map(named, blocks):
        if block.library is not None:
            file = block.library.filepath
            return say(
                "{name!r} is linked from {file}: Make Local first", name=block.name, file=file
            )
        if (override := block.override_library) is not None:
            # Tested in Blender 4.5 to 5.2: of an overridden material, a file keeps which group a
            # node has, but no socket values, links, new nodes or settings of Cycles.
            file = override.reference.library.filepath
            return say(
                "{name!r} is a library override of {file}, and changes to its nodes would not be "
                "saved: Make Local first",
                name=block.name,
                file=file,
            )
    return None


def keeps_changes(*blocks):
    """Whether changes to these materials or trees are saved: refusal() finds no objection."""
    return refusal(*blocks) is None


def check(*blocks):
    """Raises ValueError with the text of refusal(), if there is one."""
    if why := refusal(*blocks):
        raise ValueError(why)


def local(block):
    """The block itself if its changes are saved; otherwise a block of this file in its place."""
    if keeps_changes(block):
        return block
    if block.library is None or not block.is_library_indirect:
        made = block.make_local()
        if keeps_changes(made):
            return made
    # Blender makes nothing local that other linked data use, as a linked object its material.
    return block.copy()
