# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts what materials take of the memory that OptiX has for the closures of a shading point.

Cycles does not check whether they fit; sizes are the generator's (closures/closure_pool.h).
"""

from dataclasses import dataclass

import bpy

from . import nodes, pack, shader_trees


@dataclass(frozen=True)
class Use:
    """Bytes of the pool that a material's models and what joins them take without lamps, and for
    each lamp; whether there are other shaders, which take more."""

    size: int
    per_lamp: int
    shared: bool

    @property
    def lamps(self):
        """How many lamps there is room for; None where nothing aims at lamps."""
        return max(capacity() - self.size, 0) // self.per_lamp if self.per_lamp else None


def capacity():
    """Bytes of the pool."""
    return pack.manifest()["closure_pool"]["bytes"]


def of_material(material):
    """Use of a material, of what its output for Cycles hangs on."""
    pool = pack.manifest()["closure_pool"]
    joining = {"ShaderNodeMixShader": pool["mix"], "ShaderNodeAddShader": pool["add"]}
    size, per_lamp, shared = 0, 0, False
    for node in (shown.node for shown in shader_trees.shown(material)):
        if nodes.is_ours(node) and (made := nodes.manifest_entry(node)):
            size += made[0]["closure_bytes"]
            per_lamp += made[0]["lamp_bytes"]
        elif nodes.is_ours(node) or node.bl_idname not in joining:
            shared = True
        else:
            size += joining.get(node.bl_idname, 0)
    return Use(size, per_lamp, shared)


def lamps_that_fit():
    """How many lamps the materials that the open file uses can aim at, which share one list: as
    many as the largest of them has room for. None where no material aims at lamps."""
    rooms = [of_material(material).lamps for material in bpy.data.materials if material.users]
    return min((room for room in rooms if room is not None), default=None)
