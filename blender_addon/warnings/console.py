# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints why materials render black or by their twins: without a window no panel can say so."""

from bpy.app.handlers import persistent

from ..common import app_handlers
from . import checks


def _materials(scene):
    """Materials of a scene's objects, and of the objects that it instances."""
    left, objects = [*scene.objects], {}
    while left:
        item = left.pop()
        if item not in objects:
            objects[item] = None
            left += item.instance_collection.all_objects if item.instance_collection else []
    return {slot.material: None for o in objects for slot in o.material_slots if slot.material}


@persistent
def _before_render(scene, *_):
    why = {}
    for material in _materials(scene):
        for finding in checks.why_not_run(material, scene):
            why.setdefault(finding, []).append(material.name)
    for finding, names in why.items():
        more = f" and {len(names) - 3} more" if names[3:] else ""
        black = " will be black" if finding.severity == "ERROR" else ""
        print(f"brdfc: {finding.message}: {', '.join(names[:3])}{more}{black}")


def register():
    app_handlers.register({"render_init": _before_render})


def unregister():
    app_handlers.unregister({"render_init": _before_render})
