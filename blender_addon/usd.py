# SPDX-License-Identifier: GPL-3.0-or-later
"""Export to USD, which gets the nearest Principled material.

Blender's exporter looks for a Principled or Diffuse node among a material's own nodes only, so it
writes no shader for a model's group. It asks registered hooks about each material.
"""

import importlib.util
from pathlib import Path

import bpy

from .convert import is_of_conversion
from .groups import model_nodes
from .plotting import nearest_node

#: Name of the shader in the file. The exporter names its own after nodes.
_SHADER = "NearestPrincipled"


# Blender may be built without USD.
class BRDFC_UH_nearest(getattr(bpy.types, "USDHook", object)):
    bl_idname = "BRDFC_UH_nearest"
    bl_label = "brdfc"

    @staticmethod
    def on_material_export(export_context, bl_material, usd_material):
        """Fills in a material of models alone."""
        near = nearest_node.of_material(bl_material)
        if near is None or _has_textures(bl_material, usd_material):
            return False
        _fill(usd_material, near)
        return True


def _has_textures(material, usd_material):
    """Whether the exporter wrote the node that models with linked sockets replaced: conversion
    leaves it in the material, with its textures, which the nearest node lacks."""
    nodes = model_nodes.shown_nodes(material)
    linked = any(s.is_linked for node in nodes for s in model_nodes.sockets(node).values())
    left = all(map(is_of_conversion, nodes)) and bool(usd_material.GetSurfaceOutput())
    return linked and left


def _fill(usd_material, near):
    # Blender's own, which it imports for hooks.
    from pxr import Sdf, UsdShade

    prim, types = usd_material.GetPrim(), Sdf.ValueTypeNames
    shader = UsdShade.Shader.Define(prim.GetStage(), prim.GetPath().AppendChild(_SHADER))
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", types.Color3f).Set(tuple(map(float, near.color)))
    values = {
        "metallic": near.metallic,
        "roughness": near.roughness,
        "ior": near.ior,
        # The surface that USD has for glass: opacity does not weaken its highlights.
        "opacity": 0.0 if near.transmission else 1.0,
    }
    for name, value in values.items():
        shader.CreateInput(name, types.Float).Set(float(value))
    usd_material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")


def _is_possible():
    """Whether Blender can call hooks. For them it imports its module pxr. As a Python module, it
    finds that after bpy.utils.expose_bundled_modules() only, and aborts at an export or import if
    it doesn't; as that of 4.5, it hangs at its exit."""
    if bpy.app.version < (5, 0, 0) or not bpy.app.build_options.usd:
        return False
    found = importlib.util.find_spec("pxr")
    if found is None or found.origin is None:  # a folder of this name
        return False
    # Another package of this name can't read Blender's objects.
    own = Path(found.origin).is_relative_to(bpy.utils.resource_path("LOCAL"))
    return own or not bpy.app.module


def register():
    if _is_possible():
        bpy.utils.register_class(BRDFC_UH_nearest)


def unregister():
    if getattr(BRDFC_UH_nearest, "is_registered", False):
        bpy.utils.unregister_class(BRDFC_UH_nearest)
