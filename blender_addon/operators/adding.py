# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that add models to the file: as a node, as a material, or by search."""

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy.types import Operator

from .. import api
from ..common.i18n import rpt, say, tip
from ..common.interface import may_have_surface
from ..groups import model_nodes, nodes
from ..packs import pack
from .common import ERRORS, keeps_changes, refused, report_osl


def _doc(properties):
    try:
        model = pack.model(properties.model)
    except ERRORS:
        return ""
    return f"{model.doc}\n{model.paper}"


class _ModelOperator:
    model: StringProperty(name="Model", description="Identifier of the model")
    representation: StringProperty(
        name="Render Method",
        description="How Cycles renders the model: auto, or a method that the model has",
        default="auto",
    )

    @classmethod
    def description(cls, context, properties):
        return _doc(properties)


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
            and may_have_surface(space)
            and space.edit_tree is not None
            and keeps_changes(cls, *filter(None, (space.id, space.edit_tree)))
        )

    def execute(self, context):
        space = context.space_data
        try:
            node = nodes.add_group_node(space.edit_tree, self.model, self.representation)
        except ERRORS as error:
            return refused(self, error)
        for other in space.edit_tree.nodes:
            other.select = False
        node.select = True
        space.edit_tree.nodes.active = node
        node.location = space.cursor_location
        if isinstance(space.id, bpy.types.Material):
            for change in api.prepare_material(space.id):
                self.report({"INFO"}, rpt(change))
        report_osl(self, [node], context.scene)
        return {"FINISHED"}

    def invoke(self, context, event):
        context.space_data.cursor_location_from_region(event.mouse_region_x, event.mouse_region_y)
        result = self.execute(context)
        if result == {"FINISHED"}:
            bpy.ops.node.translate_attach_remove_on_cancel("INVOKE_DEFAULT")
        return result


#: Object types whose materials are surfaces, unlike those of Grease Pencil and volumes.
SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT", "CURVES", "POINTCLOUD"}


class BRDFC_OT_new_material(_ModelOperator, Operator):
    bl_idname = "brdfc.new_material"
    bl_label = "New Reflection Model Material"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        target = context.object
        if target is None or target.data is None:
            return False
        if target.type not in SURFACES:
            cls.poll_message_set(tip(say("Objects of this type show no surface of a material")))
            return False
        # The material slots of an overridden mesh are saved with the file.
        return target.data.is_editable or keeps_changes(cls, target.data)

    def execute(self, context):
        try:
            material = api.new_material(self.model, self.representation)
        except ERRORS as error:
            return refused(self, error)
        target = context.object
        target.active_material = material  # Blender adds a slot if there is none
        said = say("{material} assigned to {object}", material=material.name, object=target.name)
        self.report({"INFO"}, rpt(said))
        report_osl(self, model_nodes.group_nodes(material), context.scene)
        return {"FINISHED"}


#: Keeps the texts alive: Blender holds no reference to the items of a dynamic list.
_listed = []


def models_as_items(_operator, _context):
    """Every model as an enum item, which the search finds by label, authors, title and year."""
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
        "Find a model by its name, or by the authors, title or year of its paper. In a shader "
        "editor this adds a node, elsewhere it makes a material"
    )
    bl_options = {"REGISTER", "UNDO"}
    bl_property = "model"

    model: EnumProperty(name="Model", description="What was found", items=models_as_items)

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
