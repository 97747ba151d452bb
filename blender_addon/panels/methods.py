# SPDX-License-Identifier: GPL-3.0-or-later
"""Descriptions of the render methods: what each is good for."""

from ..common.i18n import say

#: Tooltip of each form; "form" is the name in scripts, the interface says "render method".
METHODS = {
    "auto": say(
        "Automatic: Exact or Aimed with Open Shading Language on, Formula Nodes with it off and "
        "on GPUs. The material adapts when you change these settings"
    ),
    "exact": say(
        "Exact: Cycles' own shaders add up to the model. No error, and the noise of Blender's own "
        "nodes"
    ),
    "aimed": say(
        "Aimed: Cycles samples the lamps, and random rays find all other light. No error on "
        "average, and little noise"
    ),
    "sampled": say(
        "Sampled: random rays only, which rarely hit small lamps. No error on average, but much "
        "noise"
    ),
    "fitted": say(
        "Fitted: eight of Cycles' own shaders that approximate the model. A small error, and the "
        "noise of Blender's own nodes"
    ),
    "nodes": say(
        "Formula Nodes: the model's formulas as Blender's math nodes. No error on average, on "
        "every device and without Open Shading Language, and more noise under skies"
    ),
    "twin": say(
        "Blender Nodes: Glossy and Diffuse nodes that approximate the model, with a larger error. "
        "EEVEE and Material Preview always show them"
    ),
}
