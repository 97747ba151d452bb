# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: add a group, make a material, turn OSL on, switch the form, mend settings."""

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty
from bpy.types import AddonPreferences, Operator

from . import api, checks, nodes, pack

_ERRORS = (ValueError, RuntimeError)  # CompileError and PackError are RuntimeErrors


def _doc(properties):
    try:
        return pack.model(properties.model)["doc"]
    except _ERRORS:
        return ""


class _ModelOperator:
    model: StringProperty(name="Model", description="Identifier of the model")
    representation: StringProperty(
        name="Representation",
        description="Form of the model: auto, or one that the model has",
        default="auto",
    )

    @classmethod
    def description(cls, context, properties):
        return _doc(properties)


def _report_osl(operator, scene):
    for finding in checks.scene_warnings(scene):
        operator.report({"WARNING"}, finding.message)


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
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for other in space.edit_tree.nodes:
            other.select = False
        node.select = True
        space.edit_tree.nodes.active = node
        node.location = space.cursor_location
        if isinstance(space.id, bpy.types.Material):
            for change in api.prepare_material(space.id):
                self.report({"INFO"}, change)
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
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        target = context.object
        if not target.material_slots:
            target.data.materials.append(material)
        else:
            target.active_material = material
        self.report({"INFO"}, f"{material.name} assigned to {target.name}")
        _report_osl(self, context.scene)
        return {"FINISHED"}


class _OfActiveMaterial:
    @classmethod
    def poll(cls, context):
        return getattr(context.object, "active_material", None) is not None


class BRDFC_OT_enable_osl(Operator):
    """Turn on Open Shading Language, which these shaders need, and Cycles with it"""

    bl_idname = "brdfc.enable_osl"
    bl_label = "Turn On OSL"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            done = checks.enable_osl(context.scene)
        except RuntimeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        text = "; ".join(done) if done else "Open Shading Language is on already"
        self.report({"INFO"}, text[0].upper() + text[1:])
        return {"FINISHED"}


class BRDFC_OT_fix_material(_OfActiveMaterial, Operator):
    """Give the active material the settings that its models need"""

    bl_idname = "brdfc.fix_material"
    bl_label = "Set Up Material"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        changes = api.prepare_material(context.object.active_material)
        self.report({"INFO"}, "; ".join(changes) if changes else "Nothing to change")
        return {"FINISHED"}


class BRDFC_OT_no_guiding(Operator):
    """Turn path guiding off, which the forms of this extension can't follow"""

    bl_idname = "brdfc.no_guiding"
    bl_label = "Turn Off Path Guiding"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        context.scene.cycles.use_guiding = False
        return {"FINISHED"}


def _model_node(material, name):
    """The model node of that name. Raises ValueError."""
    for node in nodes.group_nodes(material):
        if node.name == name:
            return node
    raise ValueError(f"material {material.name} has no model node {name!r}")


class BRDFC_OT_switch(_OfActiveMaterial, Operator):
    """Use another form of the same model; values and links stay"""

    bl_idname = "brdfc.switch"
    bl_label = "Switch Form"
    bl_options = {"REGISTER", "UNDO"}

    node: StringProperty(name="Node", description="Name of the group node")
    representation: StringProperty(name="Representation", default="auto")
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
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class BRDFC_OT_find_lamps(Operator):
    """Look again for the lamps that materials aim at, the brightest first"""

    bl_idname = "brdfc.find_lamps"
    bl_label = "Find Lamps"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        found = api.see_lamps(context.scene)
        taken = sum(lamp.slot is not None for lamp in found)
        self.report({"INFO"}, f"Lamps aimed at: {taken} of {len(found)}")
        return {"FINISHED"}


def _selected_materials(context):
    objects = context.selected_objects or ([context.object] if context.object else [])
    found = [slot.material for o in objects for slot in o.material_slots if slot.material]
    return list(dict.fromkeys(found))


class BRDFC_OT_convert(Operator):
    """Put the nearest model in place of each Principled, Glossy, Diffuse or Glass node of the
    selected objects' materials; links stay, and it can be taken back"""

    bl_idname = "brdfc.convert"
    bl_label = "Convert to Reflection Models"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return bool(_selected_materials(context))

    def invoke(self, context, event):
        try:
            self._plans = api.plan_conversion(_selected_materials(context))
        except _ERRORS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not self._plans:
            self.report(
                {"ERROR"}, "No selected material has a Principled, Glossy, Diffuse or Glass"
            )
            return {"CANCELLED"}
        return context.window_manager.invoke_props_dialog(self, width=600)

    def draw(self, context):
        column = self.layout.column(align=True)
        for made in self._plans:
            column.label(text=made.line(), icon="ERROR" if made.refusal else "CHECKMARK")

    def execute(self, context):
        try:
            plans = getattr(self, "_plans", None)
            if plans is None:
                plans = api.plan_conversion(_selected_materials(context))
            count = api.convert_materials(plans)
        except _ERRORS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for made in plans:
            self.report({"WARNING" if made.refusal else "INFO"}, made.line())
        _report_osl(self, context.scene)
        return {"FINISHED"} if count else {"CANCELLED"}


class BRDFC_OT_convert_back(_OfActiveMaterial, Operator):
    """Put Blender's own nodes back into the active material; where they were deleted, the model's
    twin"""

    bl_idname = "brdfc.convert_back"
    bl_label = "Back to Blender's Nodes"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            count = api.convert_back(context.object.active_material)
        except _ERRORS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"Nodes put back: {count}")
        return {"FINISHED"} if count else {"CANCELLED"}


class BRDFC_OT_details(_OfActiveMaterial, Operator):
    """The error is the part of the reflected light that a form sends in other directions than its
    model, on average over views; 1 % is hard to see. More figures are behind this button"""

    bl_idname = "brdfc.details"
    bl_label = "What This Means"
    bl_options = {"INTERNAL"}

    node: StringProperty(name="Node", description="Name of the group node")

    def invoke(self, context, event):
        return context.window_manager.invoke_popup(self, width=500)

    def draw(self, context):
        for line in self.lines(context):
            self.layout.label(text=line)

    def execute(self, context):
        for line in self.lines(context):
            self.report({"INFO"}, line)
        return {"FINISHED"}

    def lines(self, context):
        from . import ui

        try:
            node = _model_node(context.object.active_material, self.node)
            made = nodes.manifest_entry(node)
        except _ERRORS as error:
            return [str(error)]
        return (
            ui.details(node, made[0]) if made else ["Another version made this: nothing is known"]
        )


class BRDFC_OT_update(Operator):
    """Give the models that another version of the extension made the shaders of this one, where all
    that they are set to can stay"""

    bl_idname = "brdfc.update"
    bl_label = "Update Materials"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            result = api.update_materials()
        except _ERRORS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for sentence in (*result.refusals, *result.notes):
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"Models updated: {result.count}")
        return {"FINISHED"}


class BRDFC_OT_add_albedo(_OfActiveMaterial, Operator):
    """Give the model's node an output for its albedo, whose tables make the file larger"""

    bl_idname = "brdfc.add_albedo"
    bl_label = "Add Albedo Output"
    bl_options = {"REGISTER", "UNDO"}

    node: StringProperty(name="Node", description="Name of the group node")

    def execute(self, context):
        material = context.object.active_material
        try:
            nodes.add_albedo(_model_node(material, self.node))
        except _ERRORS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class BRDFC_OT_add_twin(_OfActiveMaterial, Operator):
    """Give the active material an output for EEVEE, made of Blender's own nodes"""

    bl_idname = "brdfc.add_twin"
    bl_label = "Add Twin for EEVEE"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            api.add_twin(context.object.active_material)
        except _ERRORS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class BRDFC_OT_kernel(_OfActiveMaterial, Operator):
    """Draw the kernel of a lossless reflection by a Float Curve node of the same nodes"""

    bl_idname = "brdfc.kernel"
    bl_label = "Kernel from Float Curve"
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
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def _group(self, material):
        ours = [n for n in nodes.group_nodes(material) if nodes.identity(n)[0] == api.KERNEL_MODEL]
        wanted = [n for n in ours if n.name == self.node] if self.node else ours
        active = [n for n in wanted if n == n.id_data.nodes.active]
        if not wanted or (len(wanted) > 1 and not active):
            raise ValueError(
                f"material {material.name!r}: expected an active node of the model "
                f"{api.KERNEL_MODEL!r}"
            )
        return (active or wanted)[0]

    def _curve(self, tree):
        curves = [n for n in tree.nodes if n.bl_idname == "ShaderNodeFloatCurve"]
        chosen = curves if len(curves) == 1 else [n for n in curves if n.select]
        if len(chosen) != 1:
            raise ValueError(
                f"expected one Float Curve node beside the model's, or one that is selected; "
                f"there are {len(curves)}, {len(chosen)} selected"
                if curves
                else "expected a Float Curve node beside the model's; there is none"
            )
        return chosen[0]


class BRDFC_OT_write_materials(Operator):
    """List what this file uses, for `brdfc build --materials` to make an extension of it alone"""

    bl_idname = "brdfc.write_materials"
    bl_label = "Write Materials"
    bl_options = {"REGISTER"}

    filepath: StringProperty(name="File", subtype="FILE_PATH", default="materials.json")
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
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{path}: {count} materials")
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
        context.workspace.status_text_set(f"{self.bl_label}: {share:.0%}   Esc: cancel")

    def modal(self, context, event):
        if event.type == "ESC":
            self.cancel(context)
            self.report({"INFO"}, f"{self.bl_label}: cancelled, nothing is changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            share = self.job.step()
        except _ERRORS as error:
            self.cancel(context)
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
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
        description="Fit closures to the materials that take drawn directions, which then only set "
        "these right: less noise under skies and images. Takes seconds to minutes a material",
        default=False,
    )

    def budget(self):
        return {"error": self.error or None, "fit": self.fit}


class BRDFC_OT_bake(_Long, _Budget, Operator):
    """Give the materials shaders that hold no more than this file needs; brdfc makes them"""

    bl_idname = "brdfc.bake"
    bl_label = "Bake Lean Materials"
    bl_options = {"REGISTER", "UNDO"}

    def invoke(self, context, event):
        try:
            return self.begin(context, api.start_plan(**self.budget()))
        except _ERRORS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    def finish(self, context, plan):
        BRDFC_OT_bake_plan.plan, BRDFC_OT_bake_plan.planned_with = plan, self.budget()
        bpy.ops.brdfc.bake_plan("INVOKE_DEFAULT", error=self.error, fit=self.fit)
        return {"CANCELLED"}  # nothing is changed yet, so there is nothing to undo

    def execute(self, context):
        try:
            count = api.bake(api.plan(**self.budget()))
        except _ERRORS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"Nodes that are lean now: {count}")
        return {"FINISHED"}


class BRDFC_OT_bake_plan(_Budget, Operator):
    """Show what lean materials would hold, and bake them"""

    bl_idname = "brdfc.bake_plan"
    bl_label = "Bake Lean Materials"
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
            column.label(text=line)

    def execute(self, context):
        if self.budget() == self.planned_with:
            bpy.ops.brdfc.bake_apply("INVOKE_DEFAULT")
        else:  # then another plan is to be seen first
            bpy.ops.brdfc.bake("INVOKE_DEFAULT", error=self.error, fit=self.fit)
        return {"FINISHED"}


class BRDFC_OT_bake_apply(_Long, Operator):
    """Put the lean shaders of a plan into the materials"""

    bl_idname = "brdfc.bake_apply"
    bl_label = "Bake Lean Materials"
    bl_options = {"INTERNAL", "UNDO"}

    @classmethod
    def poll(cls, context):
        return BRDFC_OT_bake_plan.plan is not None

    def invoke(self, context, event):
        plan, BRDFC_OT_bake_plan.plan = BRDFC_OT_bake_plan.plan, None
        return self.begin(context, api.start_bake(plan))

    def finish(self, context, count):
        self.report({"INFO"}, f"Nodes that are lean now: {count}")
        return {"FINISHED"}


class BrdfcPreferences(AddonPreferences):
    bl_idname = __package__

    program: StringProperty(
        name="Program brdfc",
        description="The generator, which Bake Lean Materials runs; empty: found on the PATH",
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
    BRDFC_OT_update,
    BRDFC_OT_find_lamps,
    BRDFC_OT_write_materials,
    BRDFC_OT_add_node,
    BRDFC_OT_new_material,
    BRDFC_OT_enable_osl,
    BRDFC_OT_fix_material,
    BRDFC_OT_no_guiding,
    BRDFC_OT_switch,
    BRDFC_OT_kernel,
)
register, unregister = bpy.utils.register_classes_factory(_CLASSES)
