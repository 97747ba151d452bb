# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the images in which groups store tables as they were made: Texture Paint offers them, as
all images of materials, and Unpack Resources writes them to files, which may be gone later."""

import contextlib
from pathlib import Path

import bpy

from ..content.twin import TABLE, hash_of
from . import model_nodes, nodes
from .model_nodes import TAG


def _tables():
    return [i for i in bpy.data.images if i.library is None and TABLE in i]


def _packed(image):
    """Packs an image into the file, unless it is. Returns whether it is packed then."""
    if image.packed_file is None:
        with contextlib.suppress(RuntimeError):
            image.pack()
    return image.packed_file is not None


def _spoilt(unpacked_only):
    """The images that hold other numbers than they were made with. What was painted and is not yet
    packed is undone, and what was unpacked is packed again."""
    found = set()
    for image in _tables():
        if unpacked_only and image.packed_file is not None:
            continue
        if image.is_dirty:
            image.reload()
        if hash_of(image) != image[TABLE] or not _packed(image):
            found.add(image)
    return found


def _read_by(group):
    """The images that a group reads; None among them stands for one that was deleted."""
    return {n.image for n in group.nodes if n.bl_idname == "ShaderNodeTexImage"}


def restore(unpacked_only=False):
    """Makes the groups anew whose tables were painted on, or are gone. Returns those that adapt to
    the scene, which were filled again. `unpacked_only`: without a look at packed images, and at
    groups whose images were deleted."""
    spoilt, filled = _spoilt(unpacked_only), []
    if unpacked_only and not spoilt:
        return filled
    for group in [g for g in bpy.data.node_groups if TAG in g and g.library is None]:
        if not _read_by(group) & {*spoilt, None}:
            continue
        if not model_nodes.is_current(group) or "baked" in group[TAG]:
            continue
        if nodes.make_anew(group):
            filled.append(group)
    for image in _tables():
        if image.users == 0:
            bpy.data.images.remove(image)
    return filled


def _is_gone(image):
    return not Path(bpy.path.abspath(image.filepath, library=image.library)).is_file()


def lacking(node):
    """The images of tables that a group node reads and whose files were unpacked and are gone, also
    those of linked files."""
    unpacked = (i for i in bpy.data.images if TABLE in i and i.packed_file is None)
    if not (missing := {image for image in unpacked if _is_gone(image)}):
        return []
    read = set().union(*map(_read_by, nodes.with_parts([node.node_tree])))
    return sorted(missing & read, key=lambda image: image.name)
