# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus and panels."""

import math

import bpy
from bpy.types import Menu, Panel

from . import api, checks, convert, energy, lamps, nodes, pack

_WRAP = 46  # characters of a panel's line; Blender does not wrap labels


def _wrapped(layout, text, icon="NONE"):
    """A label over several lines."""
    line = ""
    for word in text.split():
        if line and len(line) + len(word) + 1 > _WRAP:
            layout.label(text=line, icon=icon)
            line, icon = "", "BLANK1" if icon != "NONE" else "NONE"
        line = f"{line} {word}".strip()
    layout.label(text=line, icon=icon)


def _draw_models(layout, operator):
    for name in pack.model_names():
        button = layout.operator(operator, text=pack.model(name)["label"])
        button.model = name
        button.representation = "auto"


class NODE_MT_brdfc(Menu):
    bl_idname = "NODE_MT_brdfc"
    bl_label = "brdfc"

    def draw(self, context):
        _draw_models(self.layout, "brdfc.add_node")


class MATERIAL_MT_brdfc(Menu):
    bl_idname = "MATERIAL_MT_brdfc"
    bl_label = "New Reflection Model"

    def draw(self, context):
        _draw_models(self.layout, "brdfc.new_material")


def draw_add_menu(self, context):
    self.layout.separator()
    self.layout.menu(NODE_MT_brdfc.bl_idname)


def draw_material_menu(self, context):
    self.layout.menu(MATERIAL_MT_brdfc.bl_idname, icon="SHADING_RENDERED")
    self.layout.operator("brdfc.convert", icon="FILE_REFRESH")


def error_text(entry):
    """The measured error of a representation in a few words."""
    error = entry["error"]
    parts = []
    if error.get("relative_l1") is not None:
        parts.append(f"{100 * error['relative_l1']:.2g} % of the light")
    if error.get("note"):
        parts.append(error["note"])
    return ", ".join(parts) or "not measured"


def details(node, form):
    """What the panel leaves out of a node's form, a sentence a line."""
    error = form["error"]
    out = [
        f"{what}: {100 * error[key]:.2g} %"
        for key, what in (
            ("relative_l1", "Light that leaves in other directions than the model's"),
            ("relative_l2", "The same by squares, to which bright spots count more"),
            ("albedo", "Largest error of how much is reflected, of a white surface"),
        )
        if error.get(key) is not None
    ]
    if error.get("note"):
        out.append(error["note"].capitalize())
    out.append(f"Run time at equal samples: {cost_text(node, form)}")
    if form.get("closures"):
        out.append(f"Closures of Cycles: {form['closures']}")
    return out


def cost_text(node, form):
    """Render time of a node's form in units of Blender's Glossy node."""
    if form["cost"] is None:
        return "not measured"
    # A form of other parameters, which a pack cut to a scene holds, has another one.
    cut = nodes.is_baked(node) or pack.fixed(nodes.identity(node)[0])
    return f"{form['cost']:.2f} x Glossy{', at default parameters' if cut else ''}"


#: View angles in degrees at which the panel shows energy.
ANGLES = (0, 45, 75, 85)


def energy_text(node):
    """Directional albedo for the current values at a few view angles that occur, or why there is
    none."""
    model_name, _ = nodes.identity(node)
    values = {}
    for name, parameter in pack.parameters(model_name).items():
        value = nodes.get_value(node, name)
        if value is None:
            return f"depends on what is linked to {parameter['label']}"
        values[name] = value
    low, high = energy.views(model_name)
    numbers = []
    for angle in ANGLES:
        cosine = math.cos(math.radians(angle))
        if not low <= cosine <= high:
            continue
        rgb = energy.albedo(model_name, values, cosine)
        luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
        numbers.append(f"{angle}\u00b0 {luminance:.3f}")
    return "   ".join(numbers) or "not at a view angle of this scene"


def _draw_form(layout, node, form, scene, editable):
    model_name, representation = nodes.identity(node)
    if lean := nodes.is_baked(node):
        _wrapped(layout, "Lean: only what this file needs. A form brings the whole one back")
    entry = pack.model(model_name)
    row = layout.row(align=True)
    row.enabled = editable
    values = {key: nodes.get_value(node, key) for key in pack.parameters(model_name)}
    refusals = []
    for name in entry["representations"]:
        refusal = pack.refusal(model_name, name, values)
        if refusal := refusal or checks.device_refusal(model_name, name, scene):
            refusals.append(refusal)
            continue
        button = row.operator(
            "brdfc.switch",
            text=name.capitalize(),
            depress=name == representation and not lean,
        )
        button.node, button.representation = node.name, name
    column = layout.column(align=True)
    for refusal in refusals:
        _wrapped(column, refusal[0].upper() + refusal[1:])
    _wrapped(column, f"Error: {error_text(form)}")
    column.operator("brdfc.details", icon="QUESTION", emboss=False).node = node.name
    _wrapped(column, f"Cost: {cost_text(node, form)}")
    if form.get("closures"):
        _wrapped(column, f"Closures: {form['closures']}")
    if entry.get("albedo"):
        _wrapped(column, f"Albedo: {energy_text(node)}")


def _draw_values(layout, node):
    column = layout.column()
    column.use_property_split = True
    for socket in nodes.sockets(node).values():
        if socket.type != "VECTOR":
            row = column.row()
            row.enabled = not socket.is_linked
            row.prop(socket, "default_value", text=socket.name)


def draw_node(layout, node, material, scene, editable=True):
    """Model, form, error, cost, energy and values of one group node."""
    model_name, representation = nodes.identity(node)
    layout.label(text=node.label or node.name, icon="MATERIAL")
    entry = {"representations": {}}
    if made := nodes.manifest_entry(node):
        entry = pack.model(model_name)
        _wrapped(layout, f"{entry['paper']} {entry['equations']}".strip())
        _draw_form(layout, node, made[0], scene, editable)
    _draw_values(layout, node)
    if made and nodes.ALBEDO not in node.outputs and not nodes.is_baked(node):
        layout.operator("brdfc.add_albedo", icon="ADD").node = node.name
    if api.TWIN in entry["representations"] and representation != api.TWIN:
        row = layout.row()
        row.enabled = not api.has_twin(material)
        row.operator("brdfc.add_twin", icon="NODE_MATERIAL")
    if model_name == api.KERNEL_MODEL:
        layout.operator("brdfc.kernel", icon="FCURVE").node = node.name


def draw_lamps(layout, material, scene):
    """Which lamps the material's models aim at, where a model does."""
    forms = [made[0] for n in nodes.group_nodes(material) if (made := nodes.manifest_entry(n))]
    slots = max((form.get("lamps") or 0 for form in forms), default=0)
    if slots == 0:
        return
    box = layout.box()
    found = lamps.seen(scene)
    taken = [lamp.name for lamp in found if lamp.slot is not None and lamp.slot <= slots]
    left_out = [lamp for lamp in found if lamp.slot is None or lamp.slot > slots]
    _wrapped(box, f"Free of noise under {', '.join(taken) or 'no lamp yet'}", "LIGHT")
    room = checks.lamps_that_fit(scene)
    if room is not None and room < slots:
        _wrapped(
            box,
            f"OptiX: {room} lamps at most are aimed at, for its memory for closures holds no more "
            "beside this file's models; all that a Mix Shader mixes shares that memory",
            "ERROR",
        )
    for lamp in left_out:
        _wrapped(box, f"{lamp.name} may be noisy: {lamp.why or lamps.too_many(slots)}")
    box.operator("brdfc.find_lamps", icon="FILE_REFRESH")


_DOWNLOAD = ("wm.url_open", "Get Blender", {"url": "https://www.blender.org/download/"})
#: The button under a finding of each code: operator, text, properties.
BUTTONS = {
    "blender_version": _DOWNLOAD,
    "no_osl": _DOWNLOAD,
    "engine": ("brdfc.enable_osl", "Use Cycles", {}),
    "eevee_twin": ("brdfc.add_twin", "Add Twin for EEVEE", {}),
    "osl_off": ("brdfc.enable_osl", "Turn On OSL", {}),
    "device": ("brdfc.enable_osl", "Use the CPU", {}),
    "outdated": ("brdfc.update", "Update Materials", {}),
    "newer": ("screen.userpref_show", "Look for Updates", {"section": "EXTENSIONS"}),
    "bump_correction": ("brdfc.fix_material", "Set Up Material", {}),
    "path_guiding": ("brdfc.no_guiding", "Turn Off Path Guiding", {}),
}


def draw_warnings(layout, material, scene):
    """The findings for a material, with buttons that mend what can be mended."""
    found = checks.warnings(material, scene)
    offered = set()
    for finding in found:
        row = layout.column(align=True)
        row.alert = finding.severity == "ERROR"
        _wrapped(row, finding.message, "ERROR" if finding.severity == "ERROR" else "INFO")
        if finding.code in BUTTONS and finding.code not in offered:
            offered.add(finding.code)
            operator, text, settings = BUTTONS[finding.code]
            button = layout.operator(operator, text=text, icon="CHECKMARK")
            for key, value in settings.items():
                setattr(button, key, value)
    return found


def draw_material(layout, material, scene):
    """Everything the panels show for a material."""
    draw_warnings(layout, material, scene)
    for node in nodes.group_nodes(material):
        draw_node(layout.box(), node, material, scene)
    draw_lamps(layout, material, scene)
    if any(convert.is_converted(node) for node in nodes.group_nodes(material)):
        layout.operator("brdfc.convert_back", icon="LOOP_BACK")
    layout.operator("brdfc.write_materials", icon="EXPORT")
    layout.operator("brdfc.bake", icon="MOD_DECIM")


class _BrdfcPanel:
    bl_label = "Reflection Model"

    def draw(self, context):
        try:
            draw_material(self.layout, context.object.active_material, context.scene)
        except pack.PackError as error:
            _wrapped(self.layout, str(error), "ERROR")


def _has_ours(context):
    material = getattr(context.object, "active_material", None)
    return material is not None and bool(nodes.group_nodes(material))


class MATERIAL_PT_brdfc(_BrdfcPanel, Panel):
    bl_idname = "MATERIAL_PT_brdfc"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"

    @classmethod
    def poll(cls, context):
        return _has_ours(context)


class NODE_PT_brdfc(_BrdfcPanel, Panel):
    bl_idname = "NODE_PT_brdfc"
    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "brdfc"

    @classmethod
    def poll(cls, context):
        return context.space_data.tree_type == "ShaderNodeTree" and _has_ours(context)


_CLASSES = (NODE_MT_brdfc, MATERIAL_MT_brdfc, MATERIAL_PT_brdfc, NODE_PT_brdfc)
_register, _unregister = bpy.utils.register_classes_factory(_CLASSES)
_MENUS = (
    ("NODE_MT_category_shader_shader", draw_add_menu),
    ("MATERIAL_MT_context_menu", draw_material_menu),
)


def register():
    _register()
    for menu, draw in _MENUS:
        getattr(bpy.types, menu).append(draw)


def unregister():
    for menu, draw in reversed(_MENUS):
        getattr(bpy.types, menu).remove(draw)
    _unregister()
