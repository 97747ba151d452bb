# SPDX-License-Identifier: GPL-3.0-or-later
"""Bump Map Correction of a material: off while a form needs that, else as its owner has it.

Shaders bend normals themselves, as that setting does. It would also bend the normals of closures
that lean, which fitted forms are made of; twins are better with it than without. Earlier versions
turned it off for every form and did not record what it was.
"""

from ..common.i18n import say
from . import nodes

#: Of a material: what the setting was before it was turned off.
_BEFORE = "brdfc_bump_map_correction"
CODE = "bump_correction"


def _is_needed_off(material):
    entries = (nodes.manifest_entry(node) for node in nodes.group_nodes(material))
    return any(CODE in entry[0].get("warnings", []) for entry in entries if entry)


def prepare(material):
    """Turns the setting off where a form needs that, and else back to what it was; returns a
    sentence for each change."""
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
    """What the owner of a material has the setting at."""
    return bool(material.get(_BEFORE, material.cycles.use_bump_map_correction))


def restore(material, value):
    """Gives a material the setting of before its nodes were converted, but where a form still needs
    it off."""
    material.cycles.use_bump_map_correction = value
    material.pop(_BEFORE, None)
    prepare(material)
