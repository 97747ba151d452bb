# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that make shaders for the open file alone."""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty
from bpy.types import Operator

from .. import api
from ..common.i18n import rpt, say
from ..panels.labels import wrapped
from .common import ERRORS, ModalJob, refused


class BRDFC_OT_write_materials(Operator):
    bl_idname = "brdfc.write_materials"
    bl_label = "Write Materials"
    bl_description = (
        "Write a list of what this file uses, from which `brdfc build --materials` makes an "
        "extension for this file only"
    )
    bl_options = {"REGISTER"}

    filepath: StringProperty(
        name="File", description="What is written", subtype="FILE_PATH", default="materials.json"
    )
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})
    check_existing: BoolProperty(default=True, options={"HIDDEN"})

    def invoke(self, context, event):
        # A default would not be proposed.
        self.filepath = str(Path(bpy.data.filepath or "untitled").with_suffix(".json"))
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        path = bpy.path.abspath(self.filepath)
        try:
            count = api.write_materials(path)
        except (*ERRORS, OSError) as error:
            return refused(self, error)
        self.report({"INFO"}, rpt(say("{count} materials in {file}", count=count, file=path)))
        return {"FINISHED"}


class _Budget:
    error: FloatProperty(
        name="Error in Percent",
        description=(
            "Largest error at which a material becomes Fitted, for less noise: the fraction of "
            "the reflected light that leaves in other directions than in the model. 0: every "
            "material keeps its render method"
        ),
        min=0,
        max=100,
        default=0,
    )

    fit: BoolProperty(
        name="Fit Closures",
        description=(
            "Reduce the noise of the render methods Aimed and Sampled under skies and images. "
            "This takes seconds to minutes for each material"
        ),
        default=False,
    )

    def budget(self):
        return {"error": self.error or None, "fit": self.fit}


class BRDFC_OT_bake(ModalJob, _Budget, Operator):
    bl_idname = "brdfc.bake"
    bl_label = "Bake Lean Materials"
    bl_description = (
        "Give the materials shaders that contain only what this file needs. The program brdfc "
        "makes them"
    )
    bl_options = {"REGISTER", "UNDO"}

    def invoke(self, context, event):
        try:
            return self.begin(context, api.start_plan(**self.budget()))
        except ERRORS as error:
            return refused(self, error)

    def finish(self, context, plan):
        BRDFC_OT_bake_plan.plan, BRDFC_OT_bake_plan.planned_with = plan, self.budget()
        bpy.ops.brdfc.bake_plan("INVOKE_DEFAULT", error=self.error, fit=self.fit)
        return {"CANCELLED"}  # nothing has changed yet, so there is no undo step

    def execute(self, context):
        try:
            count = api.bake(api.plan(**self.budget()))
        except ERRORS as error:
            return refused(self, error)
        self.report({"INFO"}, rpt(say("Nodes that are lean now: {count}", count=count)))
        return {"FINISHED"}


class BRDFC_OT_bake_plan(_Budget, Operator):
    bl_idname = "brdfc.bake_plan"
    bl_label = "Bake Lean Materials"
    bl_description = "Show what lean materials would contain, and bake them"
    bl_options = {"INTERNAL"}

    plan, planned_with = None, None  # class attributes, which brdfc.bake sets

    @classmethod
    def poll(cls, context):
        return cls.plan is not None

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self, width=800)

    def draw(self, context):
        self.layout.prop(self, "error")
        self.layout.prop(self, "fit")
        column = self.layout.column(align=True)
        for line in self.plan.lines():
            wrapped(column, line, pixels=780)

    def execute(self, context):
        if self.budget() == self.planned_with:
            bpy.ops.brdfc.bake_apply("INVOKE_DEFAULT")
        else:  # another plan: shows it first
            bpy.ops.brdfc.bake("INVOKE_DEFAULT", error=self.error, fit=self.fit)
        return {"FINISHED"}


class BRDFC_OT_bake_apply(ModalJob, Operator):
    bl_idname = "brdfc.bake_apply"
    bl_label = "Bake Lean Materials"
    bl_description = "Apply the lean shaders of a plan to the materials"
    bl_options = {"INTERNAL", "UNDO"}

    @classmethod
    def poll(cls, context):
        return BRDFC_OT_bake_plan.plan is not None

    def invoke(self, context, event):
        plan, BRDFC_OT_bake_plan.plan = BRDFC_OT_bake_plan.plan, None
        return self.begin(context, api.start_bake(plan))

    def finish(self, context, count):
        self.report({"INFO"}, rpt(say("Nodes that are lean now: {count}", count=count)))
        if whole := self.job.whole:
            said = say(
                "Nodes that stay whole, as another shader reads their albedo: {count}", count=whole
            )
            self.report({"INFO"}, rpt(said))
        return {"FINISHED"}
