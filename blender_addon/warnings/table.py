# SPDX-License-Identifier: GPL-3.0-or-later
"""Every warning, as a row: code, severity, sentence, predicate, button.

A new warning is a row and its predicate; script/warnings_page.py puts both into the documentation.
Warnings are shown in the order of the rows, except those that forms declare: in that of the forms.
"""

from ..common.i18n import button
from ..packs import pack
from ..trees import shader_trees
from . import lamp_rules, material_rules, node_rules, scene_rules, setting_rules
from .rows import ERROR, WARNING, Button, Row

DOWNLOAD = Button(
    "wm.url_open", button("Get Blender"), {"url": "https://www.blender.org/download/"}
)
USE_CYCLES = Button("brdfc.enable_osl", button("Use Cycles"))
TURN_ON_OSL = Button("brdfc.enable_osl", button("Turn On OSL"))
USE_CPU = Button("brdfc.enable_osl", button("Use the CPU"))
UPDATE = Button("brdfc.update", button("Update Materials"))
LOOK_FOR_UPDATES = Button(
    "screen.userpref_show", button("Look for Updates"), {"section": "EXTENSIONS"}
)
SET_UP = Button("brdfc.fix_material", button("Set Up Material"))
NO_GUIDING = Button("brdfc.no_guiding", button("Turn Off Path Guiding"))
ENLARGE = Button("brdfc.enlarge_lamps", button("Give Lamps a Size"))
MAKE_LOCAL = Button("brdfc.make_local", button("Make Local"))

#: About a scene: what prevents every shader from running, and what Open Shading Language spoils.
OF_SCENE = (
    Row(
        "blender_version",
        ERROR,
        "Blender {version} is too old: {needed} is needed",
        scene_rules.old_blender,
        DOWNLOAD,
    ),
    Row("no_osl", ERROR, pack.NO_OSL, scene_rules.built_without_osl, DOWNLOAD, stops=True),
    Row(
        "engine",
        ERROR,
        "{engine} can't run these shaders",
        scene_rules.other_engine,
        USE_CYCLES,
        stops=True,
    ),
    Row(
        "osl_off",
        ERROR,
        "Open Shading Language is off",
        scene_rules.osl_off,
        TURN_ON_OSL,
        stops=True,
    ),
    Row(
        "black_aovs",
        WARNING,
        "With Open Shading Language on, Cycles leaves AOVs black ({names}); the picture itself is "
        "right",
        scene_rules.black_aovs,
    ),
    Row(
        "device",
        ERROR,
        "{backend} devices can't run these shaders",
        scene_rules.unable_device,
        USE_CPU,
        stops=True,
    ),
    Row(
        "device_elsewhere",
        WARNING,
        "The device is GPU Compute: a computer with a GPU in its preferences renders on that GPU, "
        "and few GPUs can run these shaders",
        scene_rules.device_of_another_computer,
        USE_CPU,
    ),
    Row(
        "optix_untested",
        ERROR,
        "These shaders are untested on OptiX: choose Automatic or Formula Nodes, or the CPU",
        scene_rules.optix,
        USE_CPU,
    ),
)

#: About a group node, whatever its form.
OF_NODE = (
    Row(
        "script_failed",
        ERROR,
        "its shader is damaged: choose its render method again to make it anew",
        node_rules.damaged,
        more="{problem}",
    ),
    Row(
        "lost_tables",
        ERROR,
        "it renders wrong without its images ({images}), which were unpacked: put their files back "
        "in place",
        node_rules.lost_tables,
    ),
    Row(
        "newer",
        WARNING,
        "made by a later version, {version}",
        node_rules.of_later_version,
        LOOK_FOR_UPDATES,
    ),
    Row("kept", WARNING, "stays as another version made it: {why}", node_rules.of_version_kept),
    Row(
        "outdated",
        WARNING,
        "made by {maker}; this is {own}",
        node_rules.of_another_version,
        UPDATE,
    ),
    Row(
        "out_of_range",
        ERROR,
        "{parameter} is {value}, expected {low} to {high}",
        node_rules.out_of_range,
    ),
    Row(
        "no_effect",
        WARNING,
        "{parameter} has no effect while {choice} is {value}",
        node_rules.no_effect,
    ),
    Row(
        "out_of_fit",
        WARNING,
        "{parameter} is {value}; the render method {form} supports values from {low} to {high} "
        "and shows the nearest of these",
        node_rules.out_of_fit,
    ),
    Row(
        "path_guiding",
        WARNING,
        "Path Guiding is on: it only costs time with the render method Sampled",
        setting_rules.guiding_costs,
        NO_GUIDING,
    ),
    Row(
        "clamp_low",
        WARNING,
        "Indirect Light is clamped to {clamp}: it darkens highlights; 0 is exact",
        setting_rules.clamp_highlight,
    ),
    Row(
        "lost_lamps",
        ERROR,
        "Light of lamps without a size ({lamps}) is lost: {why}",
        lamp_rules.lost_lamps,
        ENLARGE,
    ),
    Row(
        "linked_lamps",
        ERROR,
        "Light of lamps without a size ({lamps}) is lost: {why}",
        lamp_rules.linked_lost_lamps,
        MAKE_LOCAL,
    ),
    Row(
        "multiple_importance",
        ERROR,
        "Light of lamps without Multiple Importance ({lamps}) is lost: {why}",
        lamp_rules.missed_lamps,
    ),
    Row("not_aimed", WARNING, "Noisy under {lamps}: {why}", lamp_rules.noisy_lamps),
    Row(
        "linked_lamps",
        WARNING,
        "Noisy under {lamps}: {why}",
        lamp_rules.linked_noisy_lamps,
        MAKE_LOCAL,
    ),
    Row(
        "multiple_importance",
        WARNING,
        "Multiple Importance is off for wide suns ({lamps}): light that other surfaces reflect "
        "becomes rare bright dots",
        lamp_rules.wide_suns,
    ),
    Row(
        "small_in_mirror",
        WARNING,
        "Small lamps ({lamps}) are rare, bright dots in this material's mirror: larger lamps or "
        "more samples help; a clamp on indirect light removes the dots and their light",
        lamp_rules.small_in_mirror,
    ),
    Row(
        "cast_shadow",
        WARNING,
        "Cast Shadow is off for lamps ({lamps}): behind other objects part of their light is "
        "missing, as with Blender's own nodes; turn off their Multiple Importance, too",
        lamp_rules.partly_without_shadow,
        more="Up to 7 % of the light of a lamp that looks 15 degrees wide, 13 % of one of "
        "37 degrees; a Glossy node lacks 10 % of the first",
    ),
    Row(
        "cast_shadow",
        WARNING,
        "Cast Shadow is off for lamps ({lamps}): behind other objects this material gets none of "
        "their light; use another render method",
        lamp_rules.without_shadow,
    ),
    Row(
        "ray_visibility",
        WARNING,
        "Ray Visibility of lamps ({lamps}) is off for diffuse or glossy rays: how much of this "
        "material's light is lost depends on the render method",
        lamp_rules.hidden_from_rays,
    ),
    Row(
        "sheared_lamps",
        WARNING,
        "Area lamps ({lamps}) are sheared by a parent or an instance that is scaled unevenly: "
        "their light is up to half too dark or too bright; apply that scale or make it even",
        lamp_rules.sheared_lamps,
    ),
    Row(
        "fast_gi",
        WARNING,
        "Fast GI Approximation is on: this material shows less of its light than Blender's own "
        "nodes do",
        setting_rules.fast_gi,
    ),
    Row(
        "glossy_bounces",
        WARNING,
        "Glossy bounces are limited to 0: this material loses light that other surfaces send to it",
        setting_rules.no_glossy_bounces,
    ),
)

#: About a group node whose form declares the code in the manifest (Form::warnings() of the
#: generator).
DECLARED = (
    Row(
        "bump_correction",
        ERROR,
        "Bump Map Correction is on in the material's settings: this material reflects light in "
        "wrong directions where it is seen from the side",
        setting_rules.bump_correction,
        SET_UP,
    ),
    Row(
        "path_guiding",
        ERROR,
        "Path Guiding is on: this material comes out wrong with it",
        setting_rules.guiding_spoils,
        NO_GUIDING,
    ),
    Row(
        "clamp_indirect",
        WARNING,
        "Indirect Light is clamped to {clamp}: it darkens bright reflections of this material; 0 "
        "is exact",
        setting_rules.clamp_indirect,
    ),
    Row(
        "clamp_direct",
        WARNING,
        "Direct Light is clamped to {clamp}: it darkens highlights of this material; 0 is exact",
        setting_rules.clamp_direct,
    ),
    Row(
        "zero_size_lights",
        WARNING,
        "Lamps too small for the render method Sampled ({lamps}): their highlights are noisy or "
        "missing; enlarge the lamps or use another method",
        lamp_rules.small_lamps,
        ENLARGE,
    ),
    Row(
        "multiple_importance",
        WARNING,
        "Multiple Importance is off for lamps ({lamps}): this material is too dark under them",
        lamp_rules.without_importance,
    ),
    Row(
        "orthographic_far",
        WARNING,
        "The orthographic camera is so far away that the noise of this material shows patterns: "
        "move it closer",
        setting_rules.far_camera,
    ),
    Row(
        "caustics",
        WARNING,
        "Reflective Caustics are off: light that this material reflects onto diffuse surfaces is "
        "lost",
        setting_rules.no_caustics,
    ),
    Row(
        "filter_glossy",
        WARNING,
        "Filter Glossy is {value}: it darkens repeated reflections of this material; 0 is exact",
        setting_rules.filter_glossy,
    ),
    Row(
        "albedo_passes",
        WARNING,
        "Colour and denoising passes show this material too bright: denoising may blur details; "
        "the picture itself is right",
        setting_rules.albedo_passes,
    ),
    Row(
        "albedo_passes_mirror",
        WARNING,
        "Colour and denoising passes show this material too bright: denoising may blur details; "
        "the picture itself is right",
        setting_rules.albedo_passes_mirror,
    ),
    Row(
        "clamp_mirror",
        WARNING,
        "Indirect Light is clamped to {clamp}: it darkens bright lights in this mirror; 0 is exact",
        setting_rules.clamp_mirror,
    ),
    Row(
        "normal_pass",
        WARNING,
        "The pass Denoising Normal of this material is noisy: denoising with it may blur details; "
        "the picture itself is right",
        setting_rules.normal_pass,
        more="Link Denoising Albedo alone to the Denoise node: it then keeps more details",
    ),
    Row(
        "leaning_facets",
        WARNING,
        "In Blender 4.5 this material is up to 14 % too bright where it is seen from the side; "
        "Blender 5.0 is right",
        setting_rules.leaning_facets,
    ),
)

#: About a material as a whole.
OF_MATERIAL = (
    Row("nodes_off", ERROR, shader_trees.NODES_OFF, material_rules.nodes_off),
    Row(
        "closures",
        ERROR,
        "This material has more closures than Cycles has room for, and light is lost: use fewer "
        "models in one material",
        material_rules.too_many_closures,
        more="{slots} slots of closures, and Cycles has {most}",
    ),
    Row(
        "closures",
        WARNING,
        "Beside the shaders of this material Cycles has room for {count} lamps, so the light of "
        "any other lamp is noisy in every material: use fewer models in this one",
        material_rules.few_lamps,
        more="{taken}",
    ),
)

ROWS = (*OF_SCENE, *OF_NODE, *DECLARED, *OF_MATERIAL)
#: The button for findings of each code, if it has one.
BUTTONS = {row.code: row.button for row in ROWS if row.button}
#: Codes under which shaders do not run.
UNABLE = {row.code for row in ROWS if row.stops}
