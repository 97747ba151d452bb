# SPDX-License-Identifier: GPL-3.0-or-later
"""Bump Map Correction of a material: off while one of its forms needs that, else the user's choice.

The shaders of brdfc correct bumped normals themselves, as that setting does. It would also bend the
tilted normals of the closures that fitted forms consist of; twins are better with it on. Earlier
versions turned it off for every form and did not record the user's choice.
"""

from ..common.i18n import say
from . import model_nodes

#: Custom property of a material: the setting before it was turned off.
_BEFORE = "brdfc_bump_map_correction"
CODE = "bump_correction"


def _is_needed_off(material):
    entries = (model_nodes.manifest_entry(node) for node in model_nodes.group_nodes(material))
    return any(CODE in entry.form.get("warnings", []) for entry in entries if entry)


def prepare(material):
    """Turns the setting off where a form needs that, and restores it otherwise; returns a sentence
    for each change."""
    cycles = material.cycles
    if _is_needed_off(material):
        if not cycles.use_bump_map_correction:
            return []
        material[_BEFORE] = True
        cycles.use_bump_map_correction = False
        return [say("Bump Map Correction turned off for this material")]
    if material.pop(_BEFORE, False) and not cycles.use_bump_map_correction:
        cycles.use_bump_map_correction = True
        return [say("Bump Map Correction turned on again for this material")]
    return []


def recorded(material):
    """The value that the user chose for the setting."""
    return bool(material.get(_BEFORE, material.cycles.use_bump_map_correction))


def restore(material, value):
    """Restores the setting from before a conversion, unless a form still needs it off."""
    material.cycles.use_bump_map_correction = value
    material.pop(_BEFORE, None)
    prepare(material)
