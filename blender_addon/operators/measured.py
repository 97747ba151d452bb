# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that make materials of files with measured BRDFs, also of files that are dropped."""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy.types import FileHandler, Operator

from .. import api
from ..common.i18n import Sentence, iface, in_percent, rpt, say
from ..groups import model_nodes
from ..measured import ENDINGS, SUM
from ..packs import pack
from ..panels.labels import wrapped
from .adding import BRDFC_OT_new_material
from .common import ERRORS, ModalJobOnPath, refused, report_osl

#: The file that a library of measured materials is written to.
MEASURED_BLEND = "measured.blend"
#: Models that the dialog offers, the closest first.
OFFERED = 8


def _assign(operator, context, found, model=None):
    material = api.new_measured_material(found, model)
    for said in () if model == SUM else found.fit(model).remarks():
        operator.report({"INFO"}, rpt(said))
    target = context.object
    target.active_material = material  # Blender adds a slot if there is none
    said = say("{material} assigned to {object}", material=material.name, object=target.name)
    operator.report({"INFO"}, rpt(said))
    report_osl(operator, model_nodes.group_nodes(material), context.scene)


class BRDFC_OT_new_measured_material(ModalJobOnPath, Operator):
    bl_idname = "brdfc.new_measured_material"
    bl_label = "New Measured Material..."
    bl_description = (
        "Make a material that approximates a measured BRDF: a file of MERL (.binary), RGL "
        "(.bsdf), UTIA (.bin), ALTA (.alta, .dat) or Radiance (.xml), or a table (.csv). The "
        "program brdfc fits every model to it"
    )
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(
        name="File",
        description="The file with the measurement",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(
        default=";".join(f"*{ending}" for ending in ENDINGS), options={"HIDDEN"}
    )

    @classmethod
    def poll(cls, context):
        return BRDFC_OT_new_material.poll.__func__(cls, context)

    path = "filepath"

    def start(self):
        return api.start_measured_fits(self.filepath)

    def work(self):
        return say("Fitting models to {file}", file=Path(self.filepath).name)

    def finish(self, context, found):
        BRDFC_OT_choose_measured.show(found)
        bpy.ops.brdfc.choose_measured("INVOKE_DEFAULT")
        return {"CANCELLED"}  # nothing has changed yet, so there is no undo step

    def execute(self, context):
        if (result := self.begin_browsed()) is not None:
            return result
        try:
            _assign(self, context, api.measured_fits(self.filepath))
        except ERRORS as error:
            return refused(self, error)
        return {"FINISHED"}


class BRDFC_OT_new_measured_library(ModalJobOnPath, Operator):
    bl_idname = "brdfc.new_measured_library"
    bl_label = "New Measured Library..."
    bl_description = (
        "Make an asset of each measured BRDF in a folder and its subfolders, with the nearest "
        "model and a preview, and write them to measured.blend in that folder"
    )
    bl_options = {"REGISTER"}

    directory: StringProperty(
        name="Folder",
        description="The folder with the measurements",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    filter_folder: BoolProperty(default=True, options={"HIDDEN"})

    path = "directory"

    def start(self):
        return api.start_measured_library(*self._paths())

    def _paths(self):
        return self.directory, Path(self.directory) / MEASURED_BLEND

    def work(self):
        return say("Fitting models to the files in {folder}", folder=Path(self.directory).name)

    def finish(self, context, made):
        for path, why in made.refusals.items():
            said = say("{file}: {reason}", file=path.name, reason=why)
            self.report({"WARNING"}, rpt(said))
        if made.notes:
            said = say(
                "Files whose data are incomplete, see the descriptions of their assets: {count}",
                count=len(made.notes),
            )
            self.report({"INFO"}, rpt(said))
        said = say(
            "{file} has {count} materials: add its folder to the asset libraries in the "
            "Preferences to see them in the Asset Browser",
            file=made.blend.name,
            count=len(made.materials),
        )
        self.report({"INFO"}, rpt(said))
        return {"FINISHED"}

    def execute(self, context):
        if (result := self.begin_browsed()) is not None:
            return result
        try:
            return self.finish(context, api.new_measured_library(*self._paths()))
        except ERRORS as error:
            return refused(self, error)


def _fits_as_items(found):
    items = [
        (
            fit.model,
            iface(
                say(
                    "{model}: error {percent} %",
                    model=pack.model(fit.model).label,
                    percent=in_percent(fit.used.error),
                )
            ),
            pack.model(fit.model).doc,
        )
        for fit in found.fits[:OFFERED]
    ]
    if items and found.sums:
        items.append(_sum_as_item(found.lobe_sum()))
    return items


def _sum_as_item(found):
    said = say(
        "Sum of {count} lobes: error {percent} %",
        count=len(found.lobes),
        percent=in_percent(found.error),
    )
    names = " + ".join(pack.model(lobe.model).label for lobe in found.lobes)
    return (SUM, iface(said), names)


class BRDFC_OT_choose_measured(Operator):
    bl_idname = "brdfc.choose_measured"
    bl_label = "New Measured Material"
    bl_description = "Choose one of the models that are nearest to a measured BRDF"
    bl_options = {"INTERNAL", "UNDO"}

    found = None
    #: Blender holds no reference to the texts of these, and asks for them at each redraw.
    offered = ()

    @classmethod
    def show(cls, found):
        """Chooses what the dialog shows next."""
        cls.found, cls.offered = found, _fits_as_items(found)

    model: EnumProperty(
        name="Model",
        description="The model that the material has",
        items=lambda _operator, _context: BRDFC_OT_choose_measured.offered,
    )

    @classmethod
    def poll(cls, context):
        return cls.found is not None and BRDFC_OT_new_material.poll.__func__(cls, context)

    def invoke(self, context, event):
        self.model = self.found.fits[0].model
        return context.window_manager.invoke_props_dialog(self, width=500)

    def draw(self, context):
        column = self.layout.column(align=True)
        # The format, the grid and the notes are the program's own text, which is in English.
        for line in (
            Sentence("{file}: {format}, {grid}", **_facts(self.found)),
            *self.found.notes,
        ):
            wrapped(column, line, pixels=480)
        self.layout.separator()
        self.layout.column().prop(self, "model", expand=True)
        if self.model == SUM:
            parts = (
                say(
                    "{model}: {percent} %",
                    model=pack.model(lobe.model).label,
                    percent=in_percent(lobe.share),
                )
                for lobe in self.found.lobe_sum().lobes
            )
            for part in parts:
                wrapped(self.layout.column(align=True), part, pixels=480)
            return
        fit = self.found.fit(self.model)
        said = fit.remarks()
        if matte := fit.used.matte:
            grey = sum(matte) / 3
            said.insert(
                0,
                say("A matte surface that reflects {percent} % is added", percent=in_percent(grey)),
            )
        for line in said:
            wrapped(self.layout.column(align=True), line, pixels=480)

    def execute(self, context):
        try:
            _assign(self, context, self.found, self.model)
        except ERRORS as error:
            return refused(self, error)
        return {"FINISHED"}


def _facts(found):
    return {"file": found.path.name, "format": found.format, "grid": found.grid}


class BRDFC_FH_measured(FileHandler):
    bl_idname = "BRDFC_FH_measured"
    bl_label = "Measured Material"
    bl_import_operator = "brdfc.new_measured_material"
    # Blender imports tables as point clouds.
    bl_file_extensions = ";".join(ending for ending in ENDINGS if ending != ".csv")

    @classmethod
    def poll_drop(cls, context):
        area = context.area
        shows_shaders = area is not None and area.ui_type == "ShaderNodeTree"
        shown = area is not None and (area.type == "VIEW_3D" or shows_shaders)
        return shown and BRDFC_OT_new_measured_material.poll(context)
