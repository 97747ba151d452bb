# SPDX-License-Identifier: GPL-3.0-or-later
"""What the predicates of warnings look at: a scene, a material in it, and a node of that. What
several predicates ask for is found once."""

from functools import cached_property

import bpy

from .. import lamps
from ..groups import model_nodes, update
from ..lamps import emission
from ..packs import device, pack
from . import closure_slots

#: Nodes of a world with a uniform colour.
_PLAIN_WORLD = {"ShaderNodeBackground", "ShaderNodeOutputWorld"}
#: What is to be said of a form that is one of Cycles' closures.
_OF_CLOSURES = ("caustics", "filter_glossy")


def twin_of(node):
    """The twin of a node's model, as pack.Form; None if it has no twin."""
    if model_nodes.manifest_entry(node) is None:
        return None
    return pack.model(model_nodes.identity(node).model).forms.get("twin")


class SceneContext:
    """A scene."""

    def __init__(self, scene):
        self.scene = scene
        self.in_cycles = scene.render.engine == "CYCLES"

    @cached_property
    def has_osl(self):
        return pack.osl_available()

    @cached_property
    def offers_osl(self):
        """Whether Open Shading Language can be turned on here."""
        return self.has_osl and self.in_cycles

    @cached_property
    def lamps(self):
        """The lamp objects that are visible in renders."""
        return lamps.lamps_of(self.scene)

    @cached_property
    def found_lamps(self):
        """[slots.Lamp] of the last survey."""
        return lamps.last_found(self.scene)

    @cached_property
    def _is_evenly_dim(self):
        """Whether nothing shines but lamps, and a uniform world no brighter than white."""
        world = self.scene.world
        plain = model_nodes.all_nodes(world) if world else []
        colors = [n.inputs for n in plain if n.bl_idname == "ShaderNodeBackground"]
        return (
            {n.bl_idname for n in plain} <= _PLAIN_WORLD
            and all(
                max(sockets["Color"].default_value[:3]) * sockets["Strength"].default_value <= 1
                for sockets in colors
            )
            and not any(emission.may_shine(material) for material in bpy.data.materials)
        )

    @cached_property
    def is_lit_moderately(self):
        """Whether all lamps are moderate, and the world as in a new scene. Measured for eight
        models without a mirror on a floor, as formula nodes under a sun of 1 or 3 and 11 degrees, a
        spot of 1000 W, an area light of 100 W and 1 m, points of 10 and of 1000 W: a clamp at 10
        takes up to 0.12 % of the light, and no more than 0.3 % in 95 of 100 blocks of 8 x 8
        pixels."""
        return self._is_evenly_dim and all(
            lamps.kind_of(item.data).is_moderate(item.data) for item in self.lamps
        )

    @cached_property
    def is_lit_as_new(self):
        """Whether the scene is lit by nothing but point lamps no brighter than a new one of
        Blender, if there are any, and a uniform world no brighter than white. Measured for such a
        scene with a lamp and a floor (fresnel_conductor, schlick, coupled, radziszewski_alda): a
        clamp at 10 takes no light, and Filter Glossy at 1 changes blocks of 8 x 8 pixels by at most
        0.6 %."""
        found = [item.data for item in self.lamps]
        return self._is_evenly_dim and all(lamps.kind_of(data).is_like_new(data) for data in found)


class MaterialContext:
    """A material in a scene."""

    def __init__(self, of_scene, material):
        self.of_scene, self.scene, self.material = of_scene, of_scene.scene, material
        self.nodes = model_nodes.shown_nodes(material)

    @cached_property
    def use(self):
        """The closure slots that its shaders take."""
        return closure_slots.of_material(self.material)


class NodeContext:
    """A group node of a material. `stood_in`: whether the scene shows its twin in its place."""

    def __init__(self, of_material, node, stood_in):
        self.material, self.node, self.stood_in = of_material.material, node, stood_in
        self.of_scene, self.scene = of_material.of_scene, of_material.scene
        #: The manifest's entry of the form that is shown, and the parameters by name; both empty if
        #: another version made the node.
        self.form, self.schema = model_nodes.manifest_entry(node) or ({}, {})
        self.is_current = bool(self.form)
        if stood_in:
            twin = twin_of(node)
            self.form = twin.entry if twin else {}
        elif self.is_current and model_nodes.is_closure(node):
            kept = [code for code in self.form.get("warnings", []) if code in _OF_CLOSURES]
            self.form = self.form | {"warnings": kept, "lamps": 0}
        in_cycles = self.of_scene.in_cycles
        #: The form if Cycles renders it, and the number of lamps that it aims at.
        self.cycles_form = self.form if in_cycles else {}
        self.aims = self.cycles_form.get("lamps") or 0

    @property
    def lamps(self):
        return self.of_scene.lamps

    @property
    def declared(self):
        """The codes of the settings and lamps that the form declares itself sensitive to."""
        codes = [] if device.is_eevee(self.scene) else self.form.get("warnings", [])
        # Forms that declare both do so because of the model's mirror.
        if "clamp_mirror" in codes and not self.may_mirror:
            return [code for code in codes if code not in ("clamp_mirror", "multiple_importance")]
        return codes

    @cached_property
    def may_mirror(self):
        """Whether the material may have an ideal mirror: some models do at some values alone."""
        name, _ = model_nodes.identity(self.node)
        return pack.model(name).may_mirror(model_nodes.constants(self.node))

    @cached_property
    def values(self):
        """The value of each parameter, None where it is linked."""
        return model_nodes.all_values(self.node)

    @cached_property
    def why_kept(self):
        """Why an update leaves the node as it is; None if it does not."""
        return update.refusal(self.material, self.node)

    @cached_property
    def _others_lamps(self):
        return model_nodes.lamps_of_library(self.node)

    @cached_property
    def elsewhere(self):
        """Why a linked node aims at no lamp of this file; None for a node of this file."""
        group = self._others_lamps
        return lamps.elsewhere(group.library) if group is not None else None

    @cached_property
    def found_lamps(self):
        """[slots.Lamp] of the last survey, with the slots of the group that the node reads."""
        group = self._others_lamps
        return self.of_scene.found_lamps if group is None else lamps.last_found(self.scene, group)

    @cached_property
    def not_aimed(self):
        """[(lamp, reason)] of the lamps that the node does not aim at."""
        return [
            (lamp, lamp.why or lamps.too_many(self.aims))
            for lamp in (self.found_lamps if self.aims else ())
            if lamp.slot is None or lamp.slot > self.aims
        ]
