# SPDX-License-Identifier: GPL-3.0-or-later
"""The preferences, and the operators for the library of materials in them."""

from bpy.props import BoolProperty, StringProperty
from bpy.types import AddonPreferences, Operator

from .. import api, library
from ..common.extension import PACKAGE
from ..common.i18n import rpt, say
from .common import ERRORS, ModalJob, refused


class BRDFC_OT_add_library(ModalJob, Operator):
    bl_idname = "brdfc.add_library"
    bl_label = "Add the brdfc Materials to the Asset Browser"
    bl_description = (
        "Make a library of ready-made materials and add it to the preferences. You can then drag "
        "the materials from the Asset Browser onto objects"
    )
    bl_options = {"REGISTER"}

    def invoke(self, context, event):
        try:
            return self.begin(context, library.Making())
        except ERRORS as error:
            return refused(self, error)

    def finish(self, context, count):
        said = say(
            "Materials in the library {name} of the Asset Browser: {count}",
            name=library.NAME,
            count=count,
        )
        self.report({"INFO"}, rpt(said))
        return {"FINISHED"}

    def execute(self, context):
        try:
            count = api.add_library()
        except ERRORS as error:
            return refused(self, error)
        return self.finish(context, count)


class BRDFC_OT_remove_library(Operator):
    bl_idname = "brdfc.remove_library"
    bl_label = "Remove the brdfc Materials from the Asset Browser"
    bl_description = (
        "Remove the library from the preferences and delete it. Materials in files stay as they are"
    )
    bl_options = {"REGISTER"}

    def execute(self, context):
        there_was = api.remove_library()
        said = say("Library removed") if there_was else say("There was no library")
        self.report({"INFO"}, rpt(said))
        return {"FINISHED"}


def draw_library(layout):
    """Buttons for the library of materials, if this extension has one."""
    if not library.available():
        return
    if library.registered() is None:
        layout.operator("brdfc.add_library", icon="ASSET_MANAGER")
        return
    if not library.is_current():
        layout.label(text="Another version made the brdfc materials", icon="INFO")
        layout.operator("brdfc.add_library", text="Make Them Anew", icon="FILE_REFRESH")
    layout.operator("brdfc.remove_library", icon="TRASH")


class BrdfcPreferences(AddonPreferences):
    bl_idname = PACKAGE

    program: StringProperty(
        name="Program brdfc",
        description=(
            "The program that Bake Lean Materials, New Measured Material and New Measured Library "
            "run. If empty, it is searched for on the PATH"
        ),
        subtype="FILE_PATH",
    )
    update_on_load: BoolProperty(
        name="Update Materials of Files That Are Opened",
        description=(
            "When a file is opened, update models of other versions of this extension to the "
            "shaders of this version, if all of their settings can stay. Pictures may change"
        ),
        default=False,
    )

    def draw(self, context):
        self.layout.prop(self, "program")
        self.layout.prop(self, "update_on_load")
        draw_library(self.layout)
