# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that make materials of files with measured BRDFs, also of files that are dropped."""

import os
from pathlib import Path

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, StringProperty
from bpy.types import FileHandler, Operator, OperatorFileListElement

from .. import api
from ..common.i18n import Sentence, iface, in_percent, of_error, rpt, say
from ..common.program import find
from ..groups import model_nodes
from ..measured import ENDINGS, SUM, Fittings, MeasuredError
from ..packs import pack
from ..panels.labels import wrapped
from .adding import BRDFC_OT_new_material
from .common import ERRORS, ModalJobOnPath, refused, report_osl

#: The file that a library of measured materials is written to.
MEASURED_BLEND = "measured.blend"
#: Models that the dialog offers, the closest first.
OFFERED = 8
#: Most files that the dialog lists.
_LISTED = 12
#: In the dialog for several files: the model that is nearest to each.
NEAREST = "nearest"


def _reason(path, error):
    """Why there is no material of a file, in a sentence that names it."""
    said, _ = of_error(error)
    name = Path(path).name
    return said if name in said else say("{file}: {reason}", file=name, reason=said)


def _report_refusal(operator, path, error):
    _, more = of_error(error)
    if more:
        operator.report({"INFO"}, more)
    operator.report({"WARNING"}, rpt(_reason(path, error)))


def _names(paths):
    return ", ".join(Path(path).name for path in paths)


def _make(operator, found, model, failed):
    """Makes a material of each Measured. Files of which none can be made are added to the list
    `failed`, unless there is only one file, whose error is raised."""
    materials = []
    single = len(found) == 1 and not failed
    for data in found:
        try:
            material = api.new_measured_material(data, model)
        except ERRORS as error:
            if single:
                raise
            _report_refusal(operator, data.path, error)
            failed.append(data.path)
            continue
        materials.append(material)
        said = () if model == SUM else data.fit(model).remarks()
        # The dialog shows the notes on a single file.
        for line in said if single else (*data.notes, *said):
            line = line if single else say("{file}: {reason}", file=data.path.name, reason=line)
            operator.report({"INFO"}, rpt(line))
    return materials


def _assign(operator, context, found, model=None, failed=()):
    """Makes materials, and assigns the first to the active object. `failed`: paths of other files,
    which were refused."""
    failed = list(failed)
    try:
        materials = _make(operator, found, model, failed)
    except ERRORS as error:
        return refused(operator, error)
    if not materials:
        return _nothing_made(operator, failed)
    target = context.object
    target.active_material = materials[0]  # Blender adds a slot if there is none
    for material in materials[1:]:
        material.use_fake_user = True  # so that it is saved with the file
    words = {"material": materials[0].name, "object": target.name}
    said = say("{material} assigned to {object}", **words)
    if len(materials) > 1:
        made = ", ".join(material.name for material in materials)
        said = say("Made {materials}; {material} assigned to {object}", materials=made, **words)
    if failed:
        said = say("{done}. Failed: {files}", done=said, files=_names(failed))
    operator.report({"WARNING" if failed else "INFO"}, rpt(said))
    ours = [node for material in materials for node in model_nodes.group_nodes(material)]
    report_osl(operator, ours, context.scene)
    return {"FINISHED"}


def _nothing_made(operator, failed):
    said = say("No material was made. Failed: {files}", files=_names(failed))
    operator.report({"ERROR"}, rpt(said))
    return {"CANCELLED"}


class BRDFC_OT_new_measured_material(ModalJobOnPath, Operator):
    bl_idname = "brdfc.new_measured_material"
    bl_label = "New Measured Material..."
    bl_description = (
        "Make a material that approximates a measured BRDF, or one for each of several: a file of "
        "MERL (.binary), RGL (.bsdf), UTIA (.bin), ALTA (.alta, .dat) or Radiance (.xml), or a "
        "table (.csv). The program brdfc fits every model to it"
    )
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(
        name="File",
        description="The file with the measurement",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    # Blender sets these two where several files are chosen or dropped; then `filepath` is one of
    # them.
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(type=OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    filter_glob: StringProperty(
        default=";".join(f"*{ending}" for ending in ENDINGS), options={"HIDDEN"}
    )

    @classmethod
    def poll(cls, context):
        return BRDFC_OT_new_material.poll.__func__(cls, context)

    given = ("filepath", "files")

    def arguments(self):
        files = [{"name": file.name} for file in self.files]
        return {"filepath": self.filepath, "directory": self.directory, "files": files}

    def chosen(self):
        """The paths of the files, in their order."""
        folder = bpy.path.abspath(self.directory)
        several = [os.path.join(folder, file.name) for file in self.files if file.name]
        return several or [self.filepath]

    def start(self):
        find(MeasuredError)
        return Fittings(self.chosen(), api.start_measured_fits)

    def work(self):
        paths, done = self.job.paths, self.job.done
        name = Path(paths[min(done, len(paths) - 1)]).name
        if len(paths) == 1:
            return say("Fitting models to {file}", file=name)
        return say(
            "Fitting models to {file}, {number} of {count}",
            file=name,
            number=min(done + 1, len(paths)),
            count=len(paths),
        )

    def _refuse(self, found, refusals):
        """Says which files were refused; returns the result if no other is left."""
        if not found and len(refusals) == 1:
            return refused(self, *refusals.values())
        for path, error in refusals.items():
            _report_refusal(self, path, error)
        return None if found else _nothing_made(self, refusals)

    def finish(self, context, result):
        found, refusals = result
        if (ended := self._refuse(found, refusals)) is not None:
            return ended
        BRDFC_OT_choose_measured.show(found.values(), refusals)
        bpy.ops.brdfc.choose_measured("INVOKE_DEFAULT")
        return {"CANCELLED"}  # nothing has changed yet, so there is no undo step

    def execute(self, context):
        if (result := self.begin_browsed()) is not None:
            return result
        try:
            found, refusals = self.start().wait()
        except ERRORS as error:
            return refused(self, error)
        if (ended := self._refuse(found, refusals)) is not None:
            return ended
        return _assign(self, context, [*found.values()], failed=refusals)


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

    given = ("directory",)

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


def _model_said(fit):
    return say(
        "{model}: error {percent} %",
        model=pack.model(fit.model).label,
        percent=in_percent(fit.used.error),
    )


def _sum_said(found):
    return say(
        "Sum of {count} lobes: error {percent} %",
        count=len(found.lobes),
        percent=in_percent(found.error),
    )


def _items_of_one(found):
    """The choices of the dialog for a file, as enum items."""
    items = [
        (fit.model, iface(_model_said(fit)), pack.model(fit.model).doc)
        for fit in found.fits[:OFFERED]
    ]
    if items and found.sums:
        best = found.lobe_sum()
        names = " + ".join(pack.model(lobe.model).label for lobe in best.lobes)
        items.append((SUM, iface(_sum_said(best)), names))
    return items


def _mean(errors):
    return in_percent(sum(errors) / len(errors))


def _items_of_several(found):
    """The choices of the dialog for several files, which apply to all of them."""
    errors = {}
    for data in found:
        for fit in data.fits:
            errors.setdefault(fit.model, []).append(fit.used.error + fit.mirror)
    fitted = [model for model, of in errors.items() if len(of) == len(found)]
    fitted.sort(key=lambda model: sum(errors[model]))
    nearest = say(
        "The nearest model for each file: mean error {percent} %",
        percent=_mean([data.fit().used.error for data in found]),
    )
    items = [(NEAREST, iface(nearest), "")]
    for model in fitted[:OFFERED]:
        said = say(
            "{model}: mean error {percent} %",
            model=pack.model(model).label,
            percent=_mean([data.fit(model).used.error for data in found]),
        )
        items.append((model, iface(said), pack.model(model).doc))
    if all(data.sums for data in found):
        said = say(
            "Sums of lobes: mean error {percent} %",
            percent=_mean([data.lobe_sum().error for data in found]),
        )
        items.append((SUM, iface(said), ""))
    return items


class BRDFC_OT_choose_measured(Operator):
    bl_idname = "brdfc.choose_measured"
    bl_label = "New Measured Material"
    bl_description = "Choose one of the models that are nearest to a measured BRDF"
    bl_options = {"INTERNAL", "UNDO"}

    #: A Measured for each file; the path and the error of each file that was refused.
    found, refusals = (), ()
    #: Blender holds no reference to the texts of these, and asks for them at each redraw.
    offered = ()

    @classmethod
    def show(cls, found, refusals):
        """Chooses what the dialog shows next."""
        cls.found, cls.refusals = tuple(found), tuple(refusals.items())
        several = len(cls.found) > 1
        cls.offered = _items_of_several(cls.found) if several else _items_of_one(*cls.found)

    model: EnumProperty(
        name="Model",
        description="The model that the material has",
        items=lambda _operator, _context: BRDFC_OT_choose_measured.offered,
    )

    @classmethod
    def poll(cls, context):
        return bool(cls.found) and BRDFC_OT_new_material.poll.__func__(cls, context)

    def invoke(self, context, event):
        self.model = self.offered[0][0]
        return context.window_manager.invoke_props_dialog(self, width=500)

    def draw(self, context):
        column = self.layout.column(align=True)
        said = [_reason(*refusal) for refusal in self.refusals]
        if len(self.found) > 1:
            said += [_of_file(data, self.model) for data in self.found]
            if more := said[_LISTED:]:
                said[_LISTED:] = [say("and {count} more", count=len(more))]
        else:
            (data,) = self.found
            # The format, the grid and the notes are the program's own text, which is in English.
            said += [Sentence("{file}: {format}, {grid}", **_facts(data)), *data.notes]
        for line in said:
            wrapped(column, line, pixels=480)
        self.layout.separator()
        self.layout.column().prop(self, "model", expand=True)
        if len(self.found) == 1:
            for line in _about_choice(*self.found, self.model):
                wrapped(self.layout.column(align=True), line, pixels=480)

    def execute(self, context):
        model = None if self.model == NEAREST else self.model
        return _assign(self, context, self.found, model, [path for path, _ in self.refusals])


def _of_file(data, choice):
    """What a file becomes by a choice for several."""
    if choice == SUM:
        said = _sum_said(data.lobe_sum())
    else:
        said = _model_said(data.fit(None if choice == NEAREST else choice))
    return say("{file}: {reason}", file=data.path.name, reason=said)


def _about_choice(data, choice):
    """What is to be said of a choice for a single file."""
    if choice == SUM:
        return [
            say(
                "{model}: {percent} %",
                model=pack.model(lobe.model).label,
                percent=in_percent(lobe.share),
            )
            for lobe in data.lobe_sum().lobes
        ]
    fit = data.fit(choice)
    said = fit.remarks()
    if matte := fit.used.matte:
        grey = in_percent(sum(matte) / 3)
        said.insert(0, say("A matte surface that reflects {percent} % is added", percent=grey))
    return said


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
