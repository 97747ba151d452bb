# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of scenes and materials that spoil forms: the rules by which forms say so."""

import bpy
import numpy as np

from . import lamp_checks, nodes, shader_trees
from .i18n import say

#: Sampled forms draw random numbers from positions in single precision. Measured to fail where a
#: pixel is about 1e-6 of the distance; an orthographic camera has no direction to help out.
FAR_PIXEL = 1e-5
#: Below this, a clamp on indirect light shows in the highlights of Blender's own closures.
LOW_CLAMP = 10
#: A brighter one shows earlier: measured (script/conditions) under a sun of irradiance 3, in which
#: a highlight of f cos = 14 loses 6 % of its light to a clamp at 10, and one of 2 nothing.
CLAMP_OF_HIGHLIGHT = 5


def _pixel_size(scene):
    render, camera = scene.render, scene.camera.data
    longest = max(render.resolution_x, render.resolution_y) * render.resolution_percentage / 100
    return camera.ortho_scale / max(longest, 1)


def _far_orthographic(scene):
    camera = scene.camera
    if camera is None or camera.type != "CAMERA" or camera.data.type != "ORTHO":
        return False
    distance = camera.matrix_world.translation.length
    return _pixel_size(scene) < FAR_PIXEL * distance


def _warning(wrong, message):
    return ("WARNING", message) if wrong else None


def _bump_correction(material, scene):
    if material.cycles.use_bump_map_correction:
        return (
            "ERROR",
            say(
                "Bump Map Correction is on in the material's settings: where a normal map or bump "
                "bends the surface this form sends light the wrong way"
            ),
        )


def _path_guiding(material, scene):
    if scene.cycles.use_guiding:
        return "ERROR", say("Path Guiding is on: this form comes out wrong with it")


def _clamp_indirect(material, scene):
    clamp = scene.cycles.sample_clamp_indirect
    return _warning(
        clamp > 0,
        say(
            "Indirect Light is clamped to {clamp}: it darkens bright reflections of this form; "
            "0 is exact",
            clamp=f"{clamp:g}",
        ),
    )


def _clamp_mirror(material, scene):
    clamp = scene.cycles.sample_clamp_indirect
    return _warning(
        clamp > 0,
        say(
            "Indirect Light is clamped to {clamp}: it darkens bright lights in this mirror; "
            "0 is exact",
            clamp=f"{clamp:g}",
        ),
    )


def _clamp_direct(material, scene):
    clamp = scene.cycles.sample_clamp_direct
    return _warning(
        clamp > 0,
        say(
            "Direct Light is clamped to {clamp}: it darkens highlights of this form; 0 is exact",
            clamp=f"{clamp:g}",
        ),
    )


def _far_camera(material, scene):
    return _warning(
        _far_orthographic(scene),
        say(
            "The orthographic camera is so far away that the noise of this form shows "
            "patterns: move it closer"
        ),
    )


def _caustics(material, scene):
    return _warning(
        not scene.cycles.caustics_reflective,
        say(
            "Reflective Caustics are off: light that this form reflects onto diffuse surfaces "
            "is lost"
        ),
    )


def _filter_glossy(material, scene):
    return _warning(
        scene.cycles.blur_glossy > 0,
        say(
            "Filter Glossy is {value}: it darkens repeated reflections of this form; 0 is exact",
            value=f"{scene.cycles.blur_glossy:g}",
        ),
    )


def _albedo_passes(material, scene):
    cycles = scene.cycles
    denoised = cycles.use_denoising and cycles.denoising_input_passes != "RGB"
    layers = scene.view_layers
    passes = any(v.use_pass_diffuse_color or v.cycles.denoising_store_passes for v in layers)
    if denoised:
        return (
            "WARNING",
            say(
                "Denoising may blur details of this form; without it the picture is right",
                more="The colour that the denoiser is given of it is too bright",
            ),
        )
    if passes:
        return (
            "WARNING",
            say(
                "Colour and denoising passes show this form too bright: denoising may blur "
                "details; the picture itself is right"
            ),
        )


def _albedo_passes_mirror(material, scene):
    # Measured: from 5.2 the denoiser counts a part of a mirror beside drawn directions.
    return _albedo_passes(material, scene) if bpy.app.version >= (5, 2, 0) else None


def _normal_pass(material, scene):
    cycles = scene.cycles
    denoised = cycles.use_denoising and cycles.denoising_input_passes == "RGB_ALBEDO_NORMAL"
    if denoised or any(v.cycles.denoising_store_passes for v in scene.view_layers):
        return (
            "WARNING",
            say(
                "Denoising may blur details of this form; without it the picture is right",
                more="The normals that the denoiser is given of it are noisy: Albedo alone is "
                "better",
            ),
        )


def _leaning_facets(material, scene):
    # Measured (tests/blender/test_every_fit.py); later versions are right.
    if bpy.app.version < (5, 0, 0) and scene.render.engine == "CYCLES":
        return (
            "WARNING",
            say(
                "In Blender 4.5 a twin is up to 7 % too bright where it is seen from the side; "
                "Blender 5.0 is right"
            ),
        )


def black_aovs(scene):
    """Names of the AOVs of a scene that OSL leaves black: Cycles does not run the nodes then that
    write them. Tried in Blender 4.5, 5.0 and 5.2 (tests/blender/test_findings.py)."""
    wanted = {aov.name for layer in scene.view_layers for aov in layer.aovs}
    if not wanted:
        return []
    owners = [*bpy.data.materials, *([scene.world] if scene.world else [])]
    written = {
        node.aov_name
        for owner in owners
        if shader_trees.shading(owner) is not None
        for node in nodes.all_nodes(owner)
        if node.bl_idname == "ShaderNodeOutputAOV" and not node.mute
    }
    return sorted(wanted & written)


#: What a form may declare itself sensitive to in the manifest. A rule returns
#: (severity, message), or None where nothing is wrong.
DECLARED = {
    "bump_correction": _bump_correction,
    "path_guiding": _path_guiding,
    "clamp_indirect": _clamp_indirect,
    "clamp_direct": _clamp_direct,
    "zero_size_lights": lamp_checks.tiny,
    "multiple_importance": lamp_checks.multiple_importance,
    "orthographic_far": _far_camera,
    "caustics": _caustics,
    "filter_glossy": _filter_glossy,
    "albedo_passes": _albedo_passes,
    "albedo_passes_mirror": _albedo_passes_mirror,
    "clamp_mirror": _clamp_mirror,
    "normal_pass": _normal_pass,
    "leaning_facets": _leaning_facets,
}


def clamp_highlight(node, form, scene):
    """A clamp that shows in the highlight that a form has at the node's values."""
    clamp, highlight = scene.cycles.sample_clamp_indirect, form["highlight"]
    bright = max(highlight["f_cos"])
    if highlight["name"]:
        value = nodes.get_value(node, highlight["name"])
        if value is not None:
            bright = np.interp(value, highlight["values"], highlight["f_cos"])
    if 0 < clamp < max(LOW_CLAMP, CLAMP_OF_HIGHLIGHT * bright):
        return (
            "WARNING",
            say(
                "Indirect Light is clamped to {clamp}: it darkens highlights; 0 is exact",
                clamp=f"{clamp:g}",
            ),
        )
