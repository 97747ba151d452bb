# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicates of warnings about settings of scenes and materials that spoil a form."""

import bpy
import numpy as np

from ..groups import model_nodes
from .rows import when

#: Sampled forms derive random numbers from positions in single precision. Measured: they fail where
#: a pixel is about 1e-6 of the distance. With an orthographic camera the view direction does not
#: vary to make up for it.
FAR_PIXEL = 1e-5
#: A lower clamp on indirect light is visible in the highlights of Blender's own closures.
LOW_CLAMP = 10
#: Brighter highlights are clamped earlier. Measured (evidence/conditions) under a sun of irradiance
#: 3: a clamp at 10 takes 6 % of the light of a highlight of f cos = 14, and nothing of one of 2.
CLAMP_OF_HIGHLIGHT = 5


def bump_correction(at):
    """Bump Map Correction of the material is on, which bends the normals of fitted forms."""
    return when(at.material.cycles.use_bump_map_correction)


def guiding_spoils(at):
    """Path Guiding is on, which does not support closures that subtract light."""
    return when(at.scene.cycles.use_guiding)


def guiding_costs(at):
    """Path Guiding is on, and the form is Sampled. Measured: it renders correctly, with the same
    noise, but takes half as long again."""
    sampled = at.form and model_nodes.identity(at.node).form == "sampled" and not at.stood_in
    return when(sampled and at.scene.cycles.use_guiding)


# ---- clamps --------------------------------------------------------------------------------------


def _is_clamped_as_new(at):
    """Whether indirect light is not clamped, or the clamp takes nothing as the scene is lit like a
    new one."""
    clamp = at.scene.cycles.sample_clamp_indirect
    return clamp == 0 or (clamp >= LOW_CLAMP and at.of_scene.is_lit_as_new)


def clamp_indirect(at):
    """Indirect Light is clamped, and the form receives light by random rays. Formula nodes render
    their lamps by light sampling: they are warned of only where the scene has brighter light than
    moderate lamps. Materials with a mirror have the row clamp_mirror instead."""
    clamp = at.scene.cycles.sample_clamp_indirect
    harmless = _is_clamped_as_new(at) or (clamp >= LOW_CLAMP and at.of_scene.is_lit_moderately)
    spared = at.form.get("nodes") and harmless
    said = "clamp_mirror" in at.declared and clamp_mirror(at)
    return when(clamp > 0 and not spared and not said, clamp=f"{clamp:g}")


def clamp_mirror(at):
    """Indirect Light is clamped, and the material has an ideal mirror. A clamp at 10 or more is
    harmless where a scene is lit like a new one."""
    clamp = at.scene.cycles.sample_clamp_indirect
    return when(not _is_clamped_as_new(at), clamp=f"{clamp:g}")


def clamp_highlight(at):
    """Indirect Light is clamped so low that it shows in highlights as bright as this form's."""
    clamp, highlight = at.scene.cycles.sample_clamp_indirect, at.form.get("highlight")
    if not highlight:
        return []
    bright = max(highlight["f_cos"])
    if highlight["name"]:
        value = model_nodes.get_value(at.node, highlight["name"])
        if value is not None:
            bright = np.interp(value, highlight["values"], highlight["f_cos"])
    shows = 0 < clamp < max(LOW_CLAMP, CLAMP_OF_HIGHLIGHT * bright)
    said = "clamp_indirect" in at.declared and (clamp_indirect(at) or clamp_mirror(at))
    return when(shows and not _is_clamped_as_new(at) and not said, clamp=f"{clamp:g}")


def clamp_direct(at):
    """Direct Light is clamped."""
    clamp = at.scene.cycles.sample_clamp_direct
    return when(clamp > 0, clamp=f"{clamp:g}")


# ---- other settings of the scene -----------------------------------------------------------------


def far_camera(at):
    """A pixel of an orthographic camera is smaller than a hundred-thousandth of its distance from
    the origin: single precision does not tell neighbouring points apart."""
    camera, render = at.scene.camera, at.scene.render
    if camera is None or camera.type != "CAMERA" or camera.data.type != "ORTHO":
        return []
    longest = max(render.resolution_x, render.resolution_y) * render.resolution_percentage / 100
    pixel = camera.data.ortho_scale / max(longest, 1)
    return when(pixel < FAR_PIXEL * camera.matrix_world.translation.length)


def no_caustics(at):
    """Reflective Caustics are off."""
    return when(not at.scene.cycles.caustics_reflective)


def filter_glossy(at):
    """Filter Glossy is above 0, which blurs reflections after a diffuse bounce. Up to 1 it is
    harmless where a scene is lit like a new one."""
    blur = at.scene.cycles.blur_glossy
    wrong = blur > 1 or (blur > 0 and not at.of_scene.is_lit_as_new)
    return when(wrong, value=f"{blur:g}")


def _sends_rays(at):
    """Whether Cycles shows a node's Formula Nodes with random directions, which it counts as glossy
    whatever the model."""
    is_nodes = at.cycles_form and model_nodes.identity(at.node).form == "nodes"
    return is_nodes and not at.stood_in and at.is_current and not model_nodes.is_closure(at.node)


def fast_gi(at):
    """Fast GI Approximation is on, and the node has Formula Nodes with random directions."""
    return when(at.scene.cycles.use_fast_gi and _sends_rays(at))


def no_glossy_bounces(at):
    """The limit of Glossy bounces is 0, and the node has Formula Nodes with random directions."""
    return when(at.scene.cycles.glossy_bounces == 0 and _sends_rays(at))


# ---- passes and denoising ------------------------------------------------------------------------


def _shows_passes(scene):
    """Whether the passes for denoisers are also kept for users or the compositor."""
    return any(layer.cycles.denoising_store_passes for layer in scene.view_layers)


def albedo_passes(at):
    """A view layer keeps the diffuse or the glossy colour or Denoising Data, in which the closures
    of the material add up to more than it reflects."""
    # If only Cycles' own denoiser reads them, the picture is within 0.1 % of the one without
    # passes.
    layers = at.scene.view_layers
    colours = any(v.use_pass_diffuse_color or v.use_pass_glossy_color for v in layers)
    return when(_shows_passes(at.scene) or colours)


def albedo_passes_mirror(at):
    """The same from Blender 5.2 on, which also counts a mirror beside sampled directions."""
    return albedo_passes(at) if bpy.app.version >= (5, 2, 0) else []


def normal_pass(at):
    """A view layer keeps Denoising Data, and the form has a random normal at each sample."""
    return when(_shows_passes(at.scene))


def leaning_facets(at):
    """Blender is older than 5.0, and Blender's own nodes imitate the model with a tilted
    normal."""
    # Measured (tests/blender/test_every_fit.py); later versions are right.
    return when(bpy.app.version < (5, 0, 0) and at.of_scene.in_cycles)
