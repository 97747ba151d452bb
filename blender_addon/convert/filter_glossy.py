# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether Cycles' Filter Glossy makes pictures of a node and of its model different: after a bounce
that spreads the light, it blurs the lobes of Blender's nodes, and those of Formula Nodes, but not
those of shaders in Open Shading Language, unless they are one of Cycles' closures.

Measured for a floor in a room with white walls under an area lamp, by renders of Blender's node
(tests/blender/test_filter_glossy.py). At a setting of 1 the picture of metal gets 10 % darker at a
roughness of 0.1, 7 % at 0.3, 2 % at 0.6, 0 % at 0.7; that of black plastic 1.2 % at 0.3, 0.9 % at
0.4. For metal of 0.1, a setting of 0.05 changes 0.6 % of the light, 0.1 1.7 %, 0.2 11 %.
"""

from ..common.i18n import say
from ..packs import device

#: Where the picture changes by 1 %: the setting, the roughness of metal and of plastic, and the
#: Metallic from which a node counts as metal.
_SETTING, _METAL, _PLASTIC, _METALLIC = 0.1, 0.65, 0.4, 0.1


def is_filtered(native):
    """Whether the setting of new files changes pictures of a node by more than 1 %, but not those
    of its model. Mirrors of both are blurred."""
    if native.kind == "glossy" or native.metallic >= _METALLIC:
        return not native.is_mirror and native.roughness < _METAL
    return native.kind == "principled" and native.f0 > 0 and native.roughness < _PLASTIC


def warning(plans, scene):
    """A sentence if a scene has Filter Glossy and that shows in what plans convert; else None."""
    shaders_run = scene.render.engine == "CYCLES" and not device.lacks_osl(scene)
    setting = scene.cycles.blur_glossy if shaders_run else 0
    if setting < _SETTING or not any(plan.filtered and not plan.refusal for plan in plans):
        return None
    return say(
        "Filter Glossy is {value}: in light that other surfaces scatter, it blurs Blender's nodes "
        "and not their models in Open Shading Language. Pictures differ by up to 11 % with metals, "
        "by 1 % with plastics. 0 is exact",
        value=f"{setting:g}",
    )
