# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that fix settings of scenes and materials, and that search for lamps."""

from bpy.types import Operator

from .. import api
from ..common.i18n import rpt, say
from ..common.interface import material_of
from ..groups import model_nodes
from ..warnings import checks
from .common import ChangesActiveMaterial, OfActiveMaterial, refused


class BRDFC_OT_enable_osl(Operator):
    bl_idname = "brdfc.enable_osl"
    bl_label = "Turn On OSL"
    bl_description = "Turn on Cycles and Open Shading Language, which these shaders need"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            done = checks.enable_osl(context.scene)
        except RuntimeError as error:
            return refused(self, error)
        for change in done or [say("Open Shading Language is on already")]:
            self.report({"INFO"}, rpt(change))
        for finding in checks.scene_warnings(context.scene):
            self.report({"WARNING"}, rpt(finding.message))
        return {"FINISHED"}


class BRDFC_OT_fix_material(ChangesActiveMaterial, Operator):
    bl_idname = "brdfc.fix_material"
    bl_label = "Set Up Material"
    bl_description = "Give the active material the settings that its models need"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        changes = api.prepare_material(material_of(context))
        for change in changes or [say("Nothing to change")]:
            self.report({"INFO"}, rpt(change))
        return {"FINISHED"}


class BRDFC_OT_no_guiding(Operator):
    bl_idname = "brdfc.no_guiding"
    bl_label = "Turn Off Path Guiding"
    bl_description = (
        "Turn off Path Guiding, which makes materials of this extension wrong or only slower"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        context.scene.cycles.use_guiding = False
        return {"FINISHED"}


class BRDFC_OT_find_lamps(Operator):
    bl_idname = "brdfc.find_lamps"
    bl_label = "Find Lamps"
    bl_description = (
        "Search for lamps again. Materials show the light of the brightest ones with little noise"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        found = api.see_lamps(context.scene)
        taken = sum(lamp.slot is not None for lamp in found)
        self.report(
            {"INFO"},
            rpt(
                say("Lamps that leave little noise: {taken} of {all}", taken=taken, all=len(found))
            ),
        )
        material = material_of(context)
        theirs = model_nodes.lamps_of_other_file(material) if material is not None else None
        if theirs is not None:
            said = say(
                "{material!r} uses the lamps of {file}, from which it is linked: Make Local first",
                material=material.name,
                file=theirs.library.filepath,
            )
            self.report({"WARNING"}, rpt(said))
        return {"FINISHED"}


class BRDFC_OT_enlarge_lamps(Operator):
    bl_idname = "brdfc.enlarge_lamps"
    bl_label = "Give Lamps a Size"
    bl_description = (
        "Enlarge lamps that are too small for random rays to hit: to 1 cm, and suns to a little "
        "more than a degree. Their light stays the same, with softer shadows"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        done, kept = api.enlarge_lamps(context.scene)
        if kept:
            said = say("{lamps}: of another file, and stay as they are", lamps=", ".join(kept))
            self.report({"WARNING"}, rpt(said))
        said = say("Lamps that were enlarged: {count}", count=len(done))
        self.report({"INFO"}, rpt(said))
        return {"FINISHED"} if done else {"CANCELLED"}


class BRDFC_OT_make_local(OfActiveMaterial, Operator):
    bl_idname = "brdfc.make_local"
    bl_label = "Make Local"
    bl_description = (
        "Make the active material local, and its object and data if they are linked. It can then "
        "be changed, and uses the lamps of this file"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        target = context.object
        if target.library is not None:
            target = target.make_local()
        if target.data.library is not None:
            target.data.make_local()
        api.make_local(target.active_material)
        return {"FINISHED"}
