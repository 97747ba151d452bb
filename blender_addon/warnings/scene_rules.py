# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicates of warnings about a scene: engine, device, Open Shading Language."""

import bpy

from ..groups import model_nodes
from ..packs import device
from ..trees import shader_trees
from .rows import when

BLENDER_MIN = (4, 5, 0)


def engine_name(scene):
    """The display name of the render engine."""
    known = {"BLENDER_WORKBENCH": "Workbench"}
    return (
        "EEVEE" if device.is_eevee(scene) else known.get(scene.render.engine, scene.render.engine)
    )


def old_blender(at):
    """Blender is older than the extension needs."""
    return when(
        bpy.app.version < BLENDER_MIN,
        version=".".join(map(str, bpy.app.version[:2])),
        needed=".".join(map(str, BLENDER_MIN[:2])),
    )


def built_without_osl(at):
    """This build of Blender has no Open Shading Language, as that of Debian."""
    return when(not at.has_osl)


def other_engine(at):
    """The render engine is not Cycles."""
    return when(at.has_osl and not at.in_cycles, engine=engine_name(at.scene))


def osl_off(at):
    """Cycles renders without Open Shading Language."""
    return when(at.offers_osl and not at.scene.cycles.shading_system)


def black_aovs(at):
    """With Open Shading Language on, nodes of a material or the world write an AOV of a view layer:
    Cycles does not run these nodes then."""
    # Tested in Blender 4.5, 5.0 and 5.2 (tests/blender/test_findings.py).
    scene = at.scene
    wanted = {aov.name for layer in scene.view_layers for aov in layer.aovs}
    if not wanted or not at.offers_osl or not scene.cycles.shading_system:
        return []
    owners = [*bpy.data.materials, *([scene.world] if scene.world else [])]
    written = {
        node.aov_name
        for owner in owners
        if shader_trees.shading(owner) is not None
        for node in model_nodes.all_nodes(owner)
        if node.bl_idname == "ShaderNodeOutputAOV" and not node.mute
    }
    names = sorted(wanted & written)
    return when(names, names=", ".join(names))


def unable_device(at):
    """The scene renders on a GPU through CUDA, HIP, Metal or oneAPI."""
    backend = device.gpu(at.scene) if at.offers_osl else None
    return when(backend and backend not in device.OSL_DEVICES, backend=backend)


def device_of_another_computer(at):
    """Open Shading Language is on, the device is GPU Compute, and the preferences of this computer
    have no GPU: here the scene renders on the CPU."""
    on = at.offers_osl and at.scene.cycles.shading_system
    return when(on and device.of_elsewhere(at.scene))


def optix(at):
    """The scene renders through OptiX with Open Shading Language, where no shader of this extension
    has been run, and where too many closures would overwrite other memory."""
    on = at.offers_osl and at.scene.cycles.shading_system
    return when(on and device.gpu(at.scene) in device.OSL_DEVICES)
