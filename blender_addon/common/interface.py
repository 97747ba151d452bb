# SPDX-License-Identifier: GPL-3.0-or-later
"""What an editor of Blender shows."""

import bpy


def material_of(context):
    """The material that an editor shows, also if it is pinned there; elsewhere, that of the active
    object; None if there is none."""
    space = getattr(context, "space_data", None)
    kind = space.type if space is not None else ""
    if kind == "NODE_EDITOR" and space.tree_type == "ShaderNodeTree":
        return space.id if isinstance(space.id, bpy.types.Material) else None
    if kind == "PROPERTIES" and getattr(context, "material", None) is not None:
        return context.material
    return getattr(getattr(context, "object", None), "active_material", None)
