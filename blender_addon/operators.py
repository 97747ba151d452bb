# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: add a group, make a material, turn OSL on, switch the form, mend settings."""

import functools

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy.types import AddonPreferences, Operator

from . import api, checks, color, library, nodes, pack
from .i18n import Sentence, iface, of_error, rpt, say, tip

_ERRORS = (ValueError, RuntimeError)  # CompileError and PackError are RuntimeErrors


def _doc(properties):
    try:
        entry = pack.model(properties.model)
    except _ERRORS:
        return ""
    return f"{entry['doc']}\n{entry['paper']}"


class _ModelOperator:
    model: StringProperty(name="Model", description="Identifier of the model")
    representation: StringProperty(
        name="Form",
        description="Form of the model: auto, or one that the model has",
        default="auto",
    )

    @classmethod
    def description(cls, context, properties):
        return _doc(properties)


def _refused(operator, error):
    """Reports an error in a sentence; what is behind it goes into the Info editor before it."""
    said, more = of_error(error)
    if more:
        operator.report({"INFO"}, more)
    operator.report({"ERROR"}, rpt(said))
    return {"CANCELLED"}


def _report_osl(operator, scene):
    for finding in checks.scene_warnings(scene):
        operator.report({"WARNING"}, rpt(finding.message))


class BRDFC_OT_add_node(_ModelOperator, Operator):
    bl_idname = "brdfc.add_node"
    bl_label = "Add Reflection Model"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        space = context.space_data
        return (
            space is not None
            and space.type == "NODE_EDITOR"
            and space.tree_type == "ShaderNodeTree"
            and space.edit_tree is not None
            and space.edit_tree.is_editable
        )

    def execute(self, context):
        space = context.space_data
        try:
            node = nodes.add_group_node(space.edit_tree, self.model, self.representation)
        except _ERRORS as error:
            return _refused(self, error)
        for other in space.edit_tree.nodes:
            other.select = False
        node.select = True
        space.edit_tree.nodes.active = node
        node.location = space.cursor_location
        if isinstance(space.id, bpy.types.Material):
            for change in api.prepare_material(space.id):
                self.report({"INFO"}, rpt(change))
        _report_osl(self, context.scene)
        return {"FINISHED"}

    def invoke(self, context, event):
        context.space_data.cursor_location_from_region(event.mouse_region_x, event.mouse_region_y)
        result = self.execute(context)
        if result == {"FINISHED"}:
            bpy.ops.node.translate_attach_remove_on_cancel("INVOKE_DEFAULT")
        return result


class BRDFC_OT_new_material(_ModelOperator, Operator):
    bl_idname = "brdfc.new_material"
    bl_label = "New Reflection Model Material"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        data = getattr(context.object, "data", None)
        return data is not None and hasattr(data, "materials") and data.is_editable

    def execute(self, context):
        try:
            material = api.new_material(self.model, self.representation)
        except _ERRORS as error:
            return _refused(self, error)
        target = context.object
        if not target.material_slots:
            target.data.materials.append(material)
        else:
            target.active_material = material
        said = say("{material} assigned to {object}", material=material.name, object=target.name)
        self.report({"INFO"}, rpt(said))
        _report_osl(self, context.scene)
        return {"FINISHED"}


#: Blender keeps no reference to the texts of a list that is made when it is asked for.
_listed = []


def _models(_operator, _context):
    """Every model as an item to choose: what its label, authors, title and year find."""
    found = [
        (name, f"{entry['label']} ({entry['paper']})", entry["doc"])
        for name, entry in api.models().items()
    ]
    if _listed != found:
        _listed[:] = found
    return _listed


class BRDFC_OT_search(Operator):
    bl_idname = "brdfc.search"
    bl_label = "Search Reflection Models..."
    bl_description = (
        "Find a model by its name, or by authors, title and year of its paper; a shader "
        "editor gets a node of it, elsewhere a material is made"
    )
    bl_options = {"REGISTER", "UNDO"}
    bl_property = "model"

    model: EnumProperty(name="Model", description="What was found", items=_models)

    @classmethod
    def poll(cls, context):
        return BRDFC_OT_add_node.poll(context) or BRDFC_OT_new_material.poll(context)

    def invoke(self, context, event):
        context.window_manager.invoke_search_popup(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        if BRDFC_OT_add_node.poll(context):
            how = "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"
            return bpy.ops.brdfc.add_node(how, model=self.model)
        return bpy.ops.brdfc.new_material(model=self.model)


class _OfActiveMaterial:
    @classmethod
    def poll(cls, context):
        return getattr(context.object, "active_material", None) is not None


class BRDFC_OT_enable_osl(Operator):
    bl_idname = "brdfc.enable_osl"
    bl_label = "Turn On OSL"
    bl_description = "Turn on Open Shading Language, which these shaders need, and Cycles with it"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            done = checks.enable_osl(context.scene)
        except RuntimeError as error:
            return _refused(self, error)
        for change in done or [say("Open Shading Language is on already")]:
            self.report({"INFO"}, rpt(change))
        return {"FINISHED"}


class BRDFC_OT_fix_material(_OfActiveMaterial, Operator):
    bl_idname = "brdfc.fix_material"
    bl_label = "Set Up Material"
    bl_description = "Give the active material the settings that its models need"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        changes = api.prepare_material(context.object.active_material)
        for change in changes or [say("Nothing to change")]:
            self.report({"INFO"}, rpt(change))
        return {"FINISHED"}


class BRDFC_OT_no_guiding(Operator):
    bl_idname = "brdfc.no_guiding"
    bl_label = "Turn Off Path Guiding"
    bl_description = "Turn path guiding off, which the forms of this extension can't follow"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        context.scene.cycles.use_guiding = False
        return {"FINISHED"}


def _model_node(material, name):
    """The model node of that name. Raises ValueError."""
    for node in nodes.group_nodes(material):
        if node.name == name:
            return node
    raise ValueError(
        say("Material {material!r} has no model node {node!r}", material=material.name, node=name)
    )


class BRDFC_OT_switch(_OfActiveMaterial, Operator):
    bl_idname = "brdfc.switch"
    bl_label = "Switch Form"
    bl_description = "Use another form of the same model; values and links stay"
    bl_options = {"REGISTER", "UNDO"}

    node: StringProperty(name="Node", description="Name of the group node")
    representation: StringProperty(
        name="Form",
        description="Form of the model: auto, or one that the model has",
        default="auto",
    )
    all_users: BoolProperty(
        name="All Materials",
        description="Also in every other material that has this model and form",
        default=False,
    )

    def execute(self, context):
        material = context.object.active_material
        materials = bpy.data.materials if self.all_users else [material]
        try:
            node = _model_node(material, self.node)
            identity = nodes.identity(node)
            for user in materials:
                for other in nodes.group_nodes(user):
                    if other == node or (self.all_users and nodes.identity(other) == identity):
                        nodes.switch(other, self.representation)
                api.prepare_material(user)
        except _ERRORS as error:
            return _refused(self, error)
        return {"FINISHED"}


class BRDFC_OT_find_lamps(Operator):
    bl_idname = "brdfc.find_lamps"
    bl_label = "Find Lamps"
    bl_description = "Look again for the lamps that materials aim at, the brightest first"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        found = api.see_lamps(context.scene)
        taken = sum(lamp.slot is not None for lamp in found)
        self.report(
            {"INFO"}, rpt(say("Lamps aimed at: {taken} of {all}", taken=taken, all=len(found)))
        )
        return {"FINISHED"}


def _selected_materials(context):
    objects = context.selected_objects or ([context.object] if context.object else [])
    found = [slot.material for o in objects for slot in o.material_slots if slot.material]
    return list(dict.fromkeys(found))


class BRDFC_OT_convert(Operator):
    bl_idname = "brdfc.convert"
    bl_label = "Convert to Reflection Models"
    bl_description = (
        "Put the nearest model in place of each Principled, Glossy, Diffuse or Glass node "
        "of the selected objects' materials; links stay, and it can be taken back"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return bool(_selected_materials(context))

    def invoke(self, context, event):
        try:
            self._plans = api.plan_conversion(_selected_materials(context))
        except _ERRORS as error:
            return _refused(self, error)
        if not self._plans:
            none = say("No selected material shows a Principled, Glossy, Diffuse or Glass node")
            return _refused(self, ValueError(none))
        return context.window_manager.invoke_props_dialog(self, width=600)

    def draw(self, context):
        column = self.layout.column(align=True)
        for made in self._plans:
            icon = "ERROR" if made.refusal else "CHECKMARK"
            column.label(text=iface(made.line()), icon=icon, translate=False)

    def execute(self, context):
        try:
            plans = getattr(self, "_plans", None)
            if plans is None:
                plans = api.plan_conversion(_selected_materials(context))
            count = api.convert_materials(plans)
        except _ERRORS as error:
            return _refused(self, error)
        for made in plans:
            self.report({"WARNING" if made.refusal else "INFO"}, rpt(made.line()))
        _report_osl(self, context.scene)
        return {"FINISHED"} if count else {"CANCELLED"}


class BRDFC_OT_convert_back(_OfActiveMaterial, Operator):
    bl_idname = "brdfc.convert_back"
    bl_label = "Back to Blender's Nodes"
    bl_description = (
        "Put Blender's own nodes back into the active material; where they were deleted, "
        "the model's twin"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            count = api.convert_back(context.object.active_material)
        except _ERRORS as error:
            return _refused(self, error)
        self.report({"INFO"}, rpt(say("Nodes put back: {count}", count=count)))
        return {"FINISHED"} if count else {"CANCELLED"}


class BRDFC_OT_details(_OfActiveMaterial, Operator):
    bl_idname = "brdfc.details"
    bl_label = "What This Means"
    bl_description = (
        "The part of the reflected light that this form sends in other directions than its "
        "model, on average over views: of an error of 1.2 % that is 1.2 of 100 parts, and 1 % is "
        "hard to see. Click for more figures"
    )
    bl_options = {"INTERNAL"}

    node: StringProperty(name="Node", description="Name of the group node")

    def invoke(self, context, event):
        return context.window_manager.invoke_popup(self, width=500)

    def draw(self, context):
        for line in self.lines(context):
            self.layout.label(text=iface(line), translate=False)

    def execute(self, context):
        for line in self.lines(context):
            self.report({"INFO"}, rpt(line))
        return {"FINISHED"}

    def lines(self, context):
        from . import ui

        try:
            node = _model_node(context.object.active_material, self.node)
            made = nodes.manifest_entry(node)
        except _ERRORS as error:
            said, more = of_error(error)
            return [said, more] if more else [said]
        return ui.details(node, made[0]) if made else [say("Made by another version")]


class BRDFC_OT_more(Operator):
    bl_idname = "brdfc.more"
    bl_label = "More About This"
    bl_description = "Show what is behind this sentence"
    bl_options = {"INTERNAL"}

    text: StringProperty(name="Text", description="What is shown")

    def invoke(self, context, event):
        return context.window_manager.invoke_popup(self, width=500)

    def draw(self, context):
        from . import ui

        for line in ui.lines_of(self.text):
            self.layout.label(text=line, translate=False)

    def execute(self, context):
        self.report({"INFO"}, self.text)
        return {"FINISHED"}


class BRDFC_OT_update(Operator):
    bl_idname = "brdfc.update"
    bl_label = "Update Materials"
    bl_description = (
        "Give the models that another version of the extension made the shaders of this "
        "one, where all that they are set to can stay"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            result = api.update_materials()
        except _ERRORS as error:
            return _refused(self, error)
        for sentence in (*result.refusals, *result.notes):
            self.report({"WARNING"}, rpt(sentence))
        self.report({"INFO"}, rpt(say("Models updated: {count}", count=result.count)))
        return {"FINISHED"}


class BRDFC_OT_add_albedo(_OfActiveMaterial, Operator):
    bl_idname = "brdfc.add_albedo"
    bl_label = "Add Albedo Output"
    bl_description = (
        "Give the model's node an output for its albedo, whose tables make the file larger"
    )
    bl_options = {"REGISTER", "UNDO"}

    node: StringProperty(name="Node", description="Name of the group node")

    def execute(self, context):
        material = context.object.active_material
        try:
            nodes.add_albedo(_model_node(material, self.node))
        except _ERRORS as error:
            return _refused(self, error)
        return {"FINISHED"}


class BRDFC_OT_add_twin(_OfActiveMaterial, Operator):
    bl_idname = "brdfc.add_twin"
    bl_label = "Add Twin for EEVEE"
    bl_description = (
        "Give the active material a second output, for EEVEE, made of Blender's own nodes"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            api.add_twin(context.object.active_material)
        except _ERRORS as error:
            return _refused(self, error)
        return {"FINISHED"}


class BRDFC_OT_kernel(_OfActiveMaterial, Operator):
    bl_idname = "brdfc.kernel"
    bl_label = "Kernel from Float Curve"
    bl_description = (
        "Draw the kernel of a lossless reflection by a Float Curve node of the same nodes"
    )
    bl_options = {"REGISTER", "UNDO"}

    node: StringProperty(
        name="Node", description="Name of the group node; empty for the active one"
    )

    def execute(self, context):
        material = context.object.active_material
        try:
            node = self._group(material)
            api.set_kernel(node, self._curve(node.id_data))
        except _ERRORS as error:
            return _refused(self, error)
        return {"FINISHED"}

    def _group(self, material):
        ours = [n for n in nodes.group_nodes(material) if nodes.identity(n)[0] == api.KERNEL_MODEL]
        wanted = [n for n in ours if n.name == self.node] if self.node else ours
        active = [n for n in wanted if n == n.id_data.nodes.active]
        if not wanted or (len(wanted) > 1 and not active):
            raise ValueError(
                say(
                    "Material {material!r}: expected an active node of the model {model!r}",
                    material=material.name,
                    model=api.KERNEL_MODEL,
                )
            )
        return (active or wanted)[0]

    def _curve(self, tree):
        curves = [n for n in tree.nodes if n.bl_idname == "ShaderNodeFloatCurve"]
        chosen = curves if len(curves) == 1 else [n for n in curves if n.select]
        if len(chosen) != 1:
            raise ValueError(
                say(
                    "Expected one Float Curve node beside the model's, or one that is selected; "
                    "there are {count}, {selected} selected",
                    count=len(curves),
                    selected=len(chosen),
                )
                if curves
                else say("Expected a Float Curve node beside the model's; there is none")
            )
        return chosen[0]


#: No name of a substance.
_FILE = "FILE"


@functools.cache
def _substances(locale):
    """Items of a menu in a language; Blender needs somebody to keep their texts."""
    known = api.substances().values()
    metals, others = ([s for s in known if s.conductor is kind] for kind in (True, False))
    rows = [(s.name, s.label, s.source) for s in (*metals, *others)]
    about = tip(say("Measurements as refractiveindex.info exports them: wl,n and wl,k"))
    return [*rows, (_FILE, iface(say("From File\u2026")), about)]


class BRDFC_OT_substance(_OfActiveMaterial, Operator):
    bl_idname = "brdfc.substance"
    bl_label = "Metal or Glass from n, k"
    bl_description = (
        "Give the model the colours of a metal, glass or liquid of measured refractive index, in "
        "the working space of the file"
    )
    bl_options = {"REGISTER", "UNDO"}

    node: StringProperty(name="Node", description="Name of the group node", options={"HIDDEN"})
    substance: EnumProperty(
        name="Substance",
        description="What the surface is made of",
        items=lambda self, context: _substances(bpy.app.translations.locale),
    )
    filepath: StringProperty(
        name="File",
        description="Measurements as refractiveindex.info exports them: wl,n and wl,k",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default="*.csv", options={"HIDDEN"})

    def invoke(self, context, event):
        if self.substance != _FILE:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        material = context.object.active_material
        name = bpy.path.abspath(self.filepath) if self.substance == _FILE else self.substance
        try:
            if self.substance == _FILE and not name.endswith(".csv"):
                raise ValueError(say("{file}: expected a file NAME.csv", file=repr(name)))
            node = _model_node(material, self.node) if self.node else None
            values = api.set_substance(material, name, node)
        except _ERRORS as error:
            return _refused(self, error)
        space = color.working_space()
        said = say("Set in {space}: {names}", space=space, names=", ".join(values))
        self.report({"INFO"}, rpt(said))
        return {"FINISHED"}


class BRDFC_OT_write_materials(Operator):
    bl_idname = "brdfc.write_materials"
    bl_label = "Write Materials"
    bl_description = (
        "List what this file uses, for `brdfc build --materials` to make an extension of it alone"
    )
    bl_options = {"REGISTER"}

    filepath: StringProperty(
        name="File", description="What is written", subtype="FILE_PATH", default="materials.json"
    )
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})
    check_existing: BoolProperty(default=True, options={"HIDDEN"})

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        path = bpy.path.abspath(self.filepath)
        try:
            count = api.write_materials(path)
        except (*_ERRORS, OSError) as error:
            return _refused(self, error)
        self.report({"INFO"}, rpt(say("{count} materials in {file}", count=count, file=path)))
        return {"FINISHED"}


class _Long:
    """An operator whose work is a lean.Job: it goes on beside the interface, which shows how far it
    is; Esc gives up, and then nothing is changed."""

    def begin(self, context, job):
        self.job = job
        manager = context.window_manager
        self.timer = manager.event_timer_add(0.1, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        self.tell(context, 0)  # before the first step: a user may want to cancel at once
        return {"RUNNING_MODAL"}

    def tell(self, context, share):
        context.window_manager.progress_update(100 * share)
        said = say("{work}: {share}   Esc: cancel", work=self.work(), share=f"{share:.0%}")
        context.workspace.status_text_set(iface(said))

    def work(self):
        return Sentence(self.bl_label)

    def modal(self, context, event):
        if event.type == "ESC":
            self.cancel(context)
            said = say("{work}: cancelled, nothing is changed", work=self.work())
            self.report({"INFO"}, rpt(said))
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            share = self.job.step()
        except _ERRORS as error:
            self.cancel(context)
            return _refused(self, error)
        if share is None:
            self.end(context)
            return self.finish(context, self.job.result)
        self.tell(context, share)
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        """Also what Blender calls when a window closes or a file is opened."""
        self.job.cancel()
        self.end(context)

    def end(self, context):
        context.window_manager.event_timer_remove(self.timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


class _Budget:
    error: FloatProperty(
        name="Error in Percent",
        description="Part of the light that a fitted form may misplace, which is then taken in "
        "place of a sampled one; 0: every material keeps its form",
        min=0,
        max=100,
        default=0,
    )

    fit: BoolProperty(
        name="Fit Closures",
        description="Less noise of aimed and sampled forms under skies and images, for seconds to "
        "minutes of work a material",
        default=False,
    )

    def budget(self):
        return {"error": self.error or None, "fit": self.fit}


class BRDFC_OT_bake(_Long, _Budget, Operator):
    bl_idname = "brdfc.bake"
    bl_label = "Bake Lean Materials"
    bl_description = (
        "Give the materials shaders that hold no more than this file needs; the program brdfc "
        "makes them"
    )
    bl_options = {"REGISTER", "UNDO"}

    def invoke(self, context, event):
        try:
            return self.begin(context, api.start_plan(**self.budget()))
        except _ERRORS as error:
            return _refused(self, error)

    def finish(self, context, plan):
        BRDFC_OT_bake_plan.plan, BRDFC_OT_bake_plan.planned_with = plan, self.budget()
        bpy.ops.brdfc.bake_plan("INVOKE_DEFAULT", error=self.error, fit=self.fit)
        return {"CANCELLED"}  # nothing is changed yet, so there is nothing to undo

    def execute(self, context):
        try:
            count = api.bake(api.plan(**self.budget()))
        except _ERRORS as error:
            return _refused(self, error)
        self.report({"INFO"}, rpt(say("Nodes that are lean now: {count}", count=count)))
        return {"FINISHED"}


class BRDFC_OT_bake_plan(_Budget, Operator):
    bl_idname = "brdfc.bake_plan"
    bl_label = "Bake Lean Materials"
    bl_description = "Show what lean materials would hold, and bake them"
    bl_options = {"INTERNAL"}

    plan, planned_with = None, None  # of the class: brdfc.bake leaves them here

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
            column.label(text=iface(line), translate=False)

    def execute(self, context):
        if self.budget() == self.planned_with:
            bpy.ops.brdfc.bake_apply("INVOKE_DEFAULT")
        else:  # then another plan is to be seen first
            bpy.ops.brdfc.bake("INVOKE_DEFAULT", error=self.error, fit=self.fit)
        return {"FINISHED"}


class BRDFC_OT_bake_apply(_Long, Operator):
    bl_idname = "brdfc.bake_apply"
    bl_label = "Bake Lean Materials"
    bl_description = "Put the lean shaders of a plan into the materials"
    bl_options = {"INTERNAL", "UNDO"}

    @classmethod
    def poll(cls, context):
        return BRDFC_OT_bake_plan.plan is not None

    def invoke(self, context, event):
        plan, BRDFC_OT_bake_plan.plan = BRDFC_OT_bake_plan.plan, None
        return self.begin(context, api.start_bake(plan))

    def finish(self, context, count):
        self.report({"INFO"}, rpt(say("Nodes that are lean now: {count}", count=count)))
        return {"FINISHED"}


class BRDFC_OT_add_library(_Long, Operator):
    bl_idname = "brdfc.add_library"
    bl_label = "Add the brdfc Materials to the Asset Browser"
    bl_description = (
        "Make a library of ready-made materials and name it in the preferences: from then "
        "on they are in the Asset Browser, to be dragged onto objects"
    )
    bl_options = {"REGISTER"}

    def invoke(self, context, event):
        try:
            return self.begin(context, library.Making())
        except _ERRORS as error:
            return _refused(self, error)

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
        except _ERRORS as error:
            return _refused(self, error)
        return self.finish(context, count)


class BRDFC_OT_remove_library(Operator):
    bl_idname = "brdfc.remove_library"
    bl_label = "Remove the brdfc Materials from the Asset Browser"
    bl_description = (
        "Take the library out of the preferences and delete it; materials in files stay as they are"
    )
    bl_options = {"REGISTER"}

    def execute(self, context):
        there_was = api.remove_library()
        said = say("Library removed") if there_was else say("There was no library")
        self.report({"INFO"}, rpt(said))
        return {"FINISHED"}


def draw_library(layout):
    """Buttons for the library of materials, where this extension has one."""
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
    bl_idname = __package__

    program: StringProperty(
        name="Program brdfc",
        description="What Bake Lean Materials runs; empty: it is looked for on the PATH",
        subtype="FILE_PATH",
    )
    update_on_load: BoolProperty(
        name="Update Materials of Files That Are Opened",
        description="Give models that another version of this extension made the shaders of this "
        "one when a file is opened, where all that they are set to can stay. Pictures may change",
        default=False,
    )

    def draw(self, context):
        self.layout.prop(self, "program")
        self.layout.prop(self, "update_on_load")
        draw_library(self.layout)


_CLASSES = (
    BrdfcPreferences,
    BRDFC_OT_bake,
    BRDFC_OT_bake_plan,
    BRDFC_OT_bake_apply,
    BRDFC_OT_add_albedo,
    BRDFC_OT_add_twin,
    BRDFC_OT_convert,
    BRDFC_OT_convert_back,
    BRDFC_OT_details,
    BRDFC_OT_more,
    BRDFC_OT_update,
    BRDFC_OT_find_lamps,
    BRDFC_OT_write_materials,
    BRDFC_OT_add_node,
    BRDFC_OT_new_material,
    BRDFC_OT_search,
    BRDFC_OT_add_library,
    BRDFC_OT_remove_library,
    BRDFC_OT_enable_osl,
    BRDFC_OT_fix_material,
    BRDFC_OT_no_guiding,
    BRDFC_OT_substance,
    BRDFC_OT_switch,
    BRDFC_OT_kernel,
)
register, unregister = bpy.utils.register_classes_factory(_CLASSES)
