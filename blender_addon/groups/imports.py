# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that are appended, or dragged from the Asset Browser, bring the groups that they are
made of. Where the file has an equal one, that stays alone; the list of lamps is brought up to date.

Blender itself would have each drag add another copy where the file has a group of its own making.
"""

import bpy
from bpy.app.handlers import persistent

from .. import lamps
from ..common import app_handlers
from . import automatic, nodes


def _brought(context):
    """The groups of this extension that came because something else needs them. What was asked for
    by name must stay: Blender hands it on."""
    return [
        item.id
        for item in context.import_items
        if item.id_type == "NODETREE"
        and item.append_action == "MAKE_LOCAL"
        and "INDIRECT_USAGE" in item.import_info
        and item.id is not None
        and item.id.library is None
    ]


@persistent
def _after_import(context):
    brought = _brought(context)
    groups = [group for group in brought if nodes.TAG in group]
    known = {group.session_uid for group in groups}
    if groups or any(lamps.is_group(group) for group in brought):
        lamps.follow()
        automatic.follow()
    if any(item.id_type == "NODETREE" for item in context.import_items):
        # Some may have gone, as parts of what has become another form.
        nodes.unite([group for group in bpy.data.node_groups if group.session_uid in known])


def register():
    app_handlers.register({"blend_import_post": _after_import})


def unregister():
    app_handlers.unregister({"blend_import_post": _after_import})
