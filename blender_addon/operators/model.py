# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators on a material's model: its form, details, outputs and values."""

import functools

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy.types import Operator

from .. import api
from ..common import color, editable
from ..common.i18n import Sentence, iface, of_error, rpt, say, tip
from ..common.interface import material_of
from ..groups import model_nodes, nodes
from ..packs import kernel, optical, pack
from ..panels.labels import wrapped
from ..panels.methods import METHODS
from .common import ERRORS, ChangesActiveMaterial, OfActiveMaterial, refused


def _what_has(node):
    """What the panel shows as a node's model and render method."""
    model_name, _ = model_nodes.identity(node)
    return model_name, model_nodes.asked_form(node), model_nodes.is_baked(node)


class BRDFC_OT_switch(ChangesActiveMaterial, Operator):
    bl_idname = "brdfc.switch"
    bl_label = "Switch Render Method"
    bl_description = "Change how Cycles renders this model; values and links stay"
    bl_options = {"REGISTER", "UNDO"}

    node: StringProperty(name="Node", description="Name of the group node")
    representation: StringProperty(
        name="Render Method",
        description="How Cycles renders the model: auto, or a method that the model has",
        default="auto",
    )
    all_users: BoolProperty(
        name="All Materials",
        description="Also in every other material that has this model and render method",
        default=False,
    )

    @classmethod
    def description(cls, context, properties):
        return tip(METHODS.get(properties.representation) or Sentence(cls.bl_description))

    def execute(self, context):
        material = material_of(context)
        materials = bpy.data.materials if self.all_users else [material]
        try:
            node = model_nodes.named(material, self.node)
            wanted = _what_has(node)
            editable.check(node.id_data)
            # All nodes are found before any is changed. Groups are shared by materials.
            alike = [
                other
                for user in filter(editable.keeps_changes, materials)
                for other in model_nodes.group_nodes(user)
                if editable.keeps_changes(other.id_data) and _what_has(other) == wanted
            ]
            changed = dict.fromkeys(alike) if self.all_users else [node]
            for other in changed:
                nodes.switch(other, self.representation)
            for tree in dict.fromkeys(other.id_data for other in changed):
                for user in model_nodes.users_of(tree):
                    api.prepare_material(user)
        except ERRORS as error:
            return refused(self, error)
        return {"FINISHED"}


class BRDFC_OT_details(OfActiveMaterial, Operator):
    bl_idname = "brdfc.details"
    bl_label = "What This Means"
    bl_description = (
        "The fraction of the reflected light that leaves in other directions than in the model, "
        "averaged over views. 1 % is hard to see. Click for more figures"
    )
    bl_options = {"INTERNAL"}

    node: StringProperty(name="Node", description="Name of the group node")

    def invoke(self, context, event):
        return context.window_manager.invoke_popup(self, width=500)

    def draw(self, context):
        for line in self.lines(context):
            wrapped(self.layout, line, pixels=480)

    def execute(self, context):
        for line in self.lines(context):
            self.report({"INFO"}, rpt(line))
        return {"FINISHED"}

    def lines(self, context):
        from ..panels import ui

        try:
            node = model_nodes.named(material_of(context), self.node)
            made = model_nodes.manifest_entry(node)
        except ERRORS as error:
            said, more = of_error(error)
            return [said, more] if more else [said]
        return ui.details(node, made.form) if made else [say("Made by another version")]


class BRDFC_OT_more(Operator):
    bl_idname = "brdfc.more"
    bl_label = "More About This"
    bl_description = "Show what is behind this sentence"
    bl_options = {"INTERNAL"}

    text: StringProperty(name="Text", description="What is shown")

    def invoke(self, context, event):
        return context.window_manager.invoke_popup(self, width=500)

    def draw(self, context):
        wrapped(self.layout.column(align=True), self.text, pixels=480)

    def execute(self, context):
        self.report({"INFO"}, self.text)
        return {"FINISHED"}


class BRDFC_OT_update(Operator):
    bl_idname = "brdfc.update"
    bl_label = "Update Materials"
    bl_description = (
        "Update models of other versions of the extension to the shaders of this version, if all "
        "of their settings can stay"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            result = api.update_materials()
        except ERRORS as error:
            return refused(self, error)
        for sentence in (*result.refusals, *result.notes):
            self.report({"WARNING"}, rpt(sentence))
        self.report({"INFO"}, rpt(say("Models updated: {count}", count=result.count)))
        return {"FINISHED"}


class BRDFC_OT_add_albedo(ChangesActiveMaterial, Operator):
    bl_idname = "brdfc.add_albedo"
    bl_label = "Add Albedo Output"
    bl_description = (
        "Add an output for the albedo to the model's node. Its tables make the file larger"
    )
    bl_options = {"REGISTER", "UNDO"}

    node: StringProperty(name="Node", description="Name of the group node")

    def execute(self, context):
        material = material_of(context)
        try:
            nodes.add_albedo(model_nodes.named(material, self.node))
        except ERRORS as error:
            return refused(self, error)
        return {"FINISHED"}


class BRDFC_OT_add_coat(ChangesActiveMaterial, Operator):
    bl_idname = "brdfc.add_coat"
    bl_label = "Add Coat"
    bl_description = (
        "Put a clear varnish over the material, whatever nodes it has. What lies below gets the "
        "light that the varnish does not reflect"
    )
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            api.add_coat(material_of(context))
        except ERRORS as error:
            return refused(self, error)
        return {"FINISHED"}


class BRDFC_OT_kernel(ChangesActiveMaterial, Operator):
    bl_idname = "brdfc.kernel"
    bl_label = "Kernel from Float Curve"
    bl_description = (
        "Set the kernel of a lossless reflection to the curve of a Float Curve node in the "
        "same node tree"
    )
    bl_options = {"REGISTER", "UNDO"}

    node: StringProperty(
        name="Node", description="Name of the group node; empty for the active one"
    )

    def execute(self, context):
        material = material_of(context)
        try:
            node = self._group(material)
            api.set_kernel(node, self._curve(node.id_data))
        except ERRORS as error:
            return refused(self, error)
        return {"FINISHED"}

    def _group(self, material):
        ours = [
            n
            for n in model_nodes.group_nodes(material)
            if model_nodes.identity(n).model == kernel.MODEL
        ]
        wanted = [n for n in ours if model_nodes.key(n) == self.node] if self.node else ours
        active = [n for n in wanted if n == n.id_data.nodes.active]
        if not wanted or (len(wanted) > 1 and not active):
            raise ValueError(
                say(
                    "Material {material!r}: expected an active node of the model {model!r}",
                    material=material.name,
                    model=kernel.MODEL,
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


#: An item that is not the name of a substance.
_FILE = "FILE"


@functools.cache
def _substances(locale):
    """Enum items in a language, cached because Blender needs their texts to stay alive."""
    known = api.substances().values()
    metals, others = ([s for s in known if s.conductor is kind] for kind in (True, False))
    rows = [(s.name, s.label, s.source) for s in (*metals, *others)]
    about = tip(
        say(
            "n and k over the wavelength: a table with a header such as wl,n,k, a YAML file of "
            "refractiveindex.info's database, or a spectrum NAME.eta.spd"
        )
    )
    return [*rows, (_FILE, iface(say("From File\u2026")), about)]


class BRDFC_OT_substance(ChangesActiveMaterial, Operator):
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
    thickness: FloatProperty(
        name="Thickness in Metres",
        description="Distance after which the colour of an absorbing material is exact",
        default=0.01,
        min=1e-6,
        max=1e6,
        precision=4,
        options={"SKIP_SAVE"},
    )
    filepath: StringProperty(
        name="File",
        description=(
            "n and k over the wavelength: a table with a header such as wl,n,k, a YAML file of "
            "refractiveindex.info's database, or a spectrum NAME.eta.spd"
        ),
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default="*.csv;*.txt;*.yml;*.yaml;*.spd", options={"HIDDEN"})

    def invoke(self, context, event):
        if self.substance != _FILE:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        material = material_of(context)
        name = bpy.path.abspath(self.filepath) if self.substance == _FILE else self.substance
        try:
            if self.substance == _FILE and not name.lower().endswith(optical.ENDINGS):
                expected = say(
                    "{file}: expected a file NAME.csv, NAME.txt, NAME.yml or NAME.eta.spd",
                    file=repr(name),
                )
                raise ValueError(expected)
            node = model_nodes.named(material, self.node) if self.node else None
            stated = self.properties.is_property_set("thickness")
            values = api.set_substance(material, name, node, self.thickness if stated else None)
        except ERRORS as error:
            return refused(self, error)
        for note in optical.find(name).notes:
            self.report({"INFO"}, note)
        space = color.working_space()
        chosen = node or model_nodes.group_nodes(material)[0]  # the only one
        parameters = pack.model(model_nodes.identity(chosen).model).parameters
        labels = [parameters[name]["label"] for name in values]
        said = say("Set in {space}: {names}", space=space, names=", ".join(labels))
        self.report({"INFO"}, rpt(said))
        return {"FINISHED"}
