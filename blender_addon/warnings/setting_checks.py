# SPDX-License-Identifier: GPL-3.0-or-later
"""Rules for the settings of scenes and materials that spoil forms, as forms declare in the
manifest."""

import bpy
import numpy as np

from .. import lamps
from ..common.i18n import say
from ..groups import nodes
from ..lamps import emission
from ..trees import shader_trees
from . import lamp_checks

#: Sampled forms derive random numbers from positions in single precision. Measured: they fail where
#: a pixel is about 1e-6 of the distance. With an orthographic camera the view direction does not
#: vary to make up for it.
FAR_PIXEL = 1e-5
#: A lower clamp on indirect light is visible in the highlights of Blender's own closures.
LOW_CLAMP = 10
#: Brighter highlights are clamped earlier. Measured (evidence/conditions) under a sun of irradiance
#: 3: a clamp at 10 takes 6 % of the light of a highlight of f cos = 14, and nothing of one of 2.
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
                "Bump Map Correction is on in the material's settings: this material sends light "
                "the wrong way where it is seen from the side"
            ),
        )


def _path_guiding(material, scene):
    if scene.cycles.use_guiding:
        return "ERROR", say("Path Guiding is on: this material comes out wrong with it")


def _clamp_indirect(material, scene):
    clamp = scene.cycles.sample_clamp_indirect
    return _warning(
        clamp > 0,
        say(
            "Indirect Light is clamped to {clamp}: it darkens bright reflections of this material; "
            "0 is exact",
            clamp=f"{clamp:g}",
        ),
    )


#: Power and radius of a new lamp in Blender.
NEW_LAMP = 1000, 0.1
#: Nodes of a world with a uniform colour.
_PLAIN_WORLD = {"ShaderNodeBackground", "ShaderNodeOutputWorld"}


def _is_lit_as_a_new_scene(scene):
    """Whether the scene is lit only by point lamps no brighter than a new one of Blender, and by a
    uniform world no brighter than white. Measured for such a scene with a floor (fresnel_conductor,
    schlick, coupled, radziszewski_alda): a clamp at 10 takes no light, and Filter Glossy at 1
    changes blocks of 8 x 8 pixels by at most 0.6 %."""
    watts, radius = NEW_LAMP
    found = [item.data for item in lamps.lamps_of(scene)]
    plain = nodes.all_nodes(scene.world) if scene.world else []
    colors = [n.inputs for n in plain if n.bl_idname == "ShaderNodeBackground"]
    return (
        bool(found)
        and all(
            data.type == "POINT"
            and data.energy <= watts
            and data.shadow_soft_size >= radius * (1 - 1e-6)
            for data in found
        )
        and {n.bl_idname for n in plain} <= _PLAIN_WORLD
        and all(
            max(sockets["Color"].default_value[:3]) * sockets["Strength"].default_value <= 1
            for sockets in colors
        )
        and not any(emission.may_shine(material) for material in bpy.data.materials)
    )


def is_clamped_as_new(scene):
    """Whether indirect light is not clamped, or the clamp takes nothing as the scene is lit like a
    new one."""
    clamp = scene.cycles.sample_clamp_indirect
    return clamp == 0 or (clamp >= LOW_CLAMP and _is_lit_as_a_new_scene(scene))


def _clamp_mirror(material, scene):
    clamp = scene.cycles.sample_clamp_indirect
    return _warning(
        not is_clamped_as_new(scene),
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
            "Direct Light is clamped to {clamp}: it darkens highlights of this material; 0 is "
            "exact",
            clamp=f"{clamp:g}",
        ),
    )


def _far_camera(material, scene):
    return _warning(
        _far_orthographic(scene),
        say(
            "The orthographic camera is so far away that the noise of this material shows "
            "patterns: move it closer"
        ),
    )


def _caustics(material, scene):
    return _warning(
        not scene.cycles.caustics_reflective,
        say(
            "Reflective Caustics are off: light that this material reflects onto diffuse surfaces "
            "is lost"
        ),
    )


def _filter_glossy(material, scene):
    blur = scene.cycles.blur_glossy
    return _warning(
        blur > 1 or (blur > 0 and not _is_lit_as_a_new_scene(scene)),
        say(
            "Filter Glossy is {value}: it darkens repeated reflections of this material; 0 is "
            "exact",
            value=f"{scene.cycles.blur_glossy:g}",
        ),
    )


def _shows_passes(scene):
    """Whether the passes for denoisers are also kept for users or the compositor."""
    return any(layer.cycles.denoising_store_passes for layer in scene.view_layers)


def _albedo_passes(material, scene):
    # If only Cycles' own denoiser reads them, the picture is within 0.1 % of the one without
    # passes.
    if _shows_passes(scene) or any(v.use_pass_diffuse_color for v in scene.view_layers):
        return (
            "WARNING",
            say(
                "Colour and denoising passes show this material too bright: denoising may blur "
                "details; the picture itself is right"
            ),
        )


def _albedo_passes_mirror(material, scene):
    # Measured: from 5.2 on, the denoiser counts a mirror component beside sampled directions.
    return _albedo_passes(material, scene) if bpy.app.version >= (5, 2, 0) else None


def _normal_pass(material, scene):
    if _shows_passes(scene):
        return (
            "WARNING",
            say(
                "Denoising may blur details of this material; without it the picture is right",
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
                "In Blender 4.5 this material is up to 7 % too bright where it is seen from the "
                "side; Blender 5.0 is right"
            ),
        )


def black_aovs(scene):
    """Names of the AOVs of a scene that are black with OSL, as Cycles does not run the nodes that
    write them. Tested in Blender 4.5, 5.0 and 5.2 (tests/blender/test_findings.py)."""
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


#: The settings that a form may declare itself sensitive to in the manifest. Each rule returns
#: (severity, message), or None if nothing is wrong.
DECLARED = {
    "bump_correction": _bump_correction,
    "path_guiding": _path_guiding,
    "clamp_indirect": _clamp_indirect,
    "clamp_direct": _clamp_direct,
    "zero_size_lights": lamp_checks.small_lamps,
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
    """Warns of a clamp that is visible in the highlight of a form at the node's values."""
    clamp, highlight = scene.cycles.sample_clamp_indirect, form["highlight"]
    bright = max(highlight["f_cos"])
    if highlight["name"]:
        value = nodes.get_value(node, highlight["name"])
        if value is not None:
            bright = np.interp(value, highlight["values"], highlight["f_cos"])
    shows = 0 < clamp < max(LOW_CLAMP, CLAMP_OF_HIGHLIGHT * bright)
    if shows and (clamp < LOW_CLAMP or not _is_lit_as_a_new_scene(scene)):
        return (
            "WARNING",
            say(
                "Indirect Light is clamped to {clamp}: it darkens highlights; 0 is exact",
                clamp=f"{clamp:g}",
            ),
        )
