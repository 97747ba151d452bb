# SPDX-License-Identifier: GPL-3.0-or-later
"""What an editor of Blender shows."""

import bpy


def may_have_surface(space):
    """Whether the tree in a shader editor may have a surface: that of a material, or a group that
    was opened by itself, but not that of a world, a lamp or a line style."""
    return isinstance(getattr(space, "id", None), bpy.types.Material | None)


def material_of(context):
    """The material that an editor shows, also if it is pinned there; elsewhere, that of the active
    object; None if there is none."""
    space = getattr(context, "space_data", None)
    kind = space.type if space is not None else ""
    if kind == "NODE_EDITOR" and space.tree_type == "ShaderNodeTree":
        if space.id is None:  # scripts may open a tree
            return next((m for m in bpy.data.materials if m.node_tree == space.node_tree), None)
        return space.id if isinstance(space.id, bpy.types.Material) else None
    if kind == "PROPERTIES" and getattr(context, "material", None) is not None:
        return context.material
    return getattr(getattr(context, "object", None), "active_material", None)
