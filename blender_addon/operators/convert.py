# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that replace Blender's own nodes by models, and restore them."""

import math

from bpy.props import FloatProperty
from bpy.types import Operator

from .. import api, convert
from ..common.i18n import of_error, rpt, say, tip
from ..common.interface import material_of
from ..groups import model_nodes
from ..panels.labels import wrapped
from .common import ERRORS, ChangesActiveMaterial, refused, report_osl


def _selected_materials(context):
    objects = context.selected_objects or ([context.object] if context.object else [])
    found = [slot.material for o in objects for slot in o.material_slots if slot.material]
    return list(dict.fromkeys(found))


class BRDFC_OT_convert(Operator):
    bl_idname = "brdfc.convert"
    bl_label = "Convert to Reflection Models"
    bl_description = (
        "Replace each Principled, Glossy, Metallic, Diffuse or Glass node of the selected objects' "
        "materials by the nearest model. Links stay, and the nodes can be restored"
    )
    bl_options = {"REGISTER", "UNDO"}

    limit: FloatProperty(
        name="Largest Error",
        description="Nodes stay if the error of the nearest model is larger",
        subtype="PERCENTAGE",
        default=100 * convert.LIMIT,
        min=0,
        soft_max=100,
        max=200,
    )

    @classmethod
    def poll(cls, context):
        found = bool(_selected_materials(context))
        if not found:
            cls.poll_message_set(tip(say("No selected object has a material in its slots")))
        return found

    #: Plans of the open dialog; None otherwise, as undo may have removed their nodes.
    _plans = None

    def _within(self):
        return [made.within(self.limit / 100) for made in self._plans or ()]

    def invoke(self, context, event):
        try:
            self._plans = api.plan_conversion(_selected_materials(context), math.inf)
        except ERRORS as error:
            return refused(self, error)
        if not self._plans:
            none = say(
                "No selected material shows a Principled, Glossy, Metallic, Diffuse or Glass node"
            )
            return refused(self, ValueError(none))
        return context.window_manager.invoke_props_dialog(self, width=600)

    def draw(self, context):
        self.layout.prop(self, "limit")
        column = self.layout.column(align=True)
        for made in self._within():
            icon = "ERROR" if made.refusal else "CHECKMARK"
            wrapped(column, made.line(), icon, pixels=560)
        for told in (convert.cost, convert.warning):
            if said := told(self._within(), context.scene):
                wrapped(column, said, "INFO", pixels=560)

    def execute(self, context):
        try:
            if self._plans is None:
                self._plans = api.plan_conversion(_selected_materials(context), math.inf)
            plans, self._plans = self._within(), None
            count = api.convert_materials(plans)
        except ERRORS as error:
            return refused(self, error)
        for made in plans:
            self.report({"WARNING" if made.refusal else "INFO"}, rpt(made.line()))
        if said := convert.cost(plans, context.scene):
            self.report({"INFO"}, rpt(said))
        if said := convert.warning(plans, context.scene):
            self.report({"WARNING"}, rpt(said))
        done = [node for m in _selected_materials(context) for node in model_nodes.group_nodes(m)]
        report_osl(self, done, context.scene)
        return {"FINISHED"} if count else {"CANCELLED"}


class BRDFC_OT_to_principled(Operator):
    bl_idname = "brdfc.to_principled"
    bl_label = "Replace by Principled Nodes"
    bl_description = (
        "For export: in the selected objects' materials, put the nearest Principled node in the "
        "place of the models, which can be put back"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        found = any(map(model_nodes.shown_nodes, _selected_materials(context)))
        if not found:
            cls.poll_message_set(tip(say("No selected object has a material with a model")))
        return found

    def execute(self, context):
        done = 0
        for material in filter(model_nodes.shown_nodes, _selected_materials(context)):
            try:
                self.report({"INFO"}, rpt(api.replace_by_principled(material).line()))
                done += 1
            except ERRORS as error:
                self.report({"WARNING"}, rpt(of_error(error)[0]))
        return {"FINISHED"} if done else {"CANCELLED"}


class BRDFC_OT_to_models(ChangesActiveMaterial, Operator):
    bl_idname = "brdfc.to_models"
    bl_label = "Back to the Models"
    bl_description = "Put the active material's models back in the place of its Principled node"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            done = api.restore_models(material_of(context))
        except ERRORS as error:
            return refused(self, error)
        return {"FINISHED"} if done else {"CANCELLED"}


class BRDFC_OT_convert_back(ChangesActiveMaterial, Operator):
    bl_idname = "brdfc.convert_back"
    bl_label = "Back to Blender's Nodes"
    bl_description = (
        "Restore Blender's own nodes in the active material. If they were deleted, nodes that "
        "approximate the model replace them"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            count = api.convert_back(material_of(context))
        except ERRORS as error:
            return refused(self, error)
        self.report({"INFO"}, rpt(say("Nodes put back: {count}", count=count)))
        return {"FINISHED"} if count else {"CANCELLED"}
