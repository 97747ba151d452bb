# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus and panels."""

import math

import bpy
import numpy as np
from bpy.types import Menu, Panel

from .. import convert, lamps
from ..common import color, editable
from ..common.i18n import counted, form_name, iface, in_percent, of_error, say
from ..common.interface import material_of, may_have_surface
from ..groups import model_nodes, nodes
from ..packs import energy, kernel, optical, pack
from ..trees import shader_trees
from ..warnings import checks, closure_slots
from ..warnings.table import BUTTONS, MAKE_LOCAL, UNABLE
from .labels import wrapped
from .methods import METHODS

#: Names of the submenus, by the look that models declare.
LOOKS = {
    "matte": say("Matte"),
    "glossy": say("Glossy"),
    "metal": say("Metals"),
    "glass": say("Glass"),
    "special": say("Special"),
}


def menu_label(name):
    """A model's label with its paper's authors and year, all of which the menu search finds."""
    model = pack.model(name)
    return f"{model.label} ({model.citation})"


def _draw_looks(menu, _context):
    menu.layout.operator("brdfc.search", icon="VIEWZOOM")
    menu.layout.separator()
    for look in pack.models_by_look():
        menu.layout.menu(f"{menu.bl_idname}_{look}")


def _draw_models(menu, _context):
    for name in pack.models_by_look()[menu.look]:
        # Names from the papers are not translated.
        text = menu_label(name)
        item = menu.layout.operator(menu.operator, text=text, translate=False)
        item.model = name
        item.representation = "auto"


class NODE_MT_brdfc(Menu):
    bl_idname = "NODE_MT_brdfc"
    bl_label = "brdfc"
    operator = "brdfc.add_node"
    draw = _draw_looks


class MATERIAL_MT_brdfc(Menu):
    bl_idname = "MATERIAL_MT_brdfc"
    bl_label = "New Reflection Model"
    operator = "brdfc.new_material"
    draw = _draw_looks


def _submenu(menu, look):
    """The class of the submenu with the models of a look. Each is a class of its own, as Blender's
    search visits a class once."""
    name = f"{menu.bl_idname}_{look}"
    members = {
        "bl_idname": name,
        "bl_label": LOOKS[look],
        "operator": menu.operator,
        "look": look,
        "draw": _draw_models,
    }
    return type(name, (Menu,), members)


_SUBMENUS = [_submenu(menu, look) for menu in (NODE_MT_brdfc, MATERIAL_MT_brdfc) for look in LOOKS]


def draw_add_menu(self, context):
    if context.space_data is not None and not may_have_surface(context.space_data):
        return
    self.layout.separator()
    self.layout.menu(NODE_MT_brdfc.bl_idname)


def draw_material_menu(self, context):
    self.layout.menu(MATERIAL_MT_brdfc.bl_idname, icon="SHADING_RENDERED")
    self.layout.operator("brdfc.new_measured_material", icon="FILE_FOLDER")
    self.layout.operator("brdfc.new_measured_library", icon="ASSET_MANAGER")
    self.layout.operator("brdfc.convert", icon="FILE_REFRESH")
    self.layout.operator("brdfc.to_principled", icon="EXPORT")
    self.layout.operator("brdfc.add_coat", icon="NODE_MATERIAL")


def error_text(error):
    """The measured error of a form in a few words."""
    if (off := error.get("relative_l1")) is not None:
        return percent(off)
    # The form samples directions: the measurement shows that no energy is lost.
    if error.get("albedo") is not None:
        return say("none, only noise")
    return say("not measured")


def error_line(node, form):
    """The same for the panel, with the quantity that it is a fraction of."""
    error = pack.error_at(form, model_nodes.all_values(node))
    if (error.get("relative_l1") or 0) < ROUNDING:
        return say("Error: {error}", error=error_text(error))
    return say("Error: {error} of the light", error=error_text(error))


def percent(part):
    """A fraction in percent; rounding errors count as 0."""
    if part < ROUNDING:
        return say("none")
    return say("{percent} %", percent=in_percent(part))


#: Smaller errors are rounding errors of single precision.
ROUNDING = 1e-5


def details(node, form):
    """What the panel omits about a node's form, one sentence per line."""
    error = pack.error_at(form, model_nodes.all_values(node))
    out = [
        say("{what}: {error}", what=what, error=percent(error[key]))
        for key, what in (
            (
                "relative_l1",
                say(
                    "Fraction of the reflected light that leaves in other directions than in "
                    "the model"
                ),
            ),
            ("relative_l2", say("The same by squared differences: bright spots count more")),
            ("albedo", say("Largest error of the albedo of a white surface")),
        )
        if error.get(key) is not None
    ]
    if error.get("note"):  # the tool's text: where the error is largest
        out.append(error["note"].capitalize())
    out.append(say("Render time at equal samples: {cost}", cost=cost_text(node, form)))
    if form.get("closures"):
        out.append(say("Closures of Cycles: {count}", count=form["closures"]))
    return out


def cost_text(node, form):
    """Render time of a node's form in units of Blender's Glossy node."""
    if form["cost"] is None:
        return say("not measured")
    # In a pack cut to a scene, forms have fewer parameters, so their cost differs.
    cut = model_nodes.is_baked(node) or pack.model(model_nodes.identity(node).model).fixed
    times = f"{form['cost']:.2f}"
    if cut:
        return say("{times} x Glossy, at default parameters", times=times)
    return say("{times} x Glossy", times=times)


#: View angles in degrees at which the panel shows the energy.
ANGLES = (0, 45, 75, 85)


def energy_text(node):
    """Directional albedo for the current values at a few view angles that the pack covers, or the
    reason why there is none."""
    model_name, _ = model_nodes.identity(node)
    values = {}
    for name, parameter in pack.model(model_name).parameters.items():
        value = model_nodes.get_value(node, name)
        if value is None:
            return say("depends on what is linked to {socket}", socket=parameter["label"])
        values[name] = value
    low, high = energy.views(model_name)
    numbers = []
    for angle in ANGLES:
        cosine = math.cos(math.radians(angle))
        if not low <= cosine <= high:
            continue
        rgb = energy.albedo(model_name, values, cosine)
        luminance = color.luminance(np.array(rgb))
        numbers.append(f"{angle}\u00b0\u00a0{luminance:.3f}")  # kept on one line
    return ", ".join(numbers) or say("not at a view angle of this scene")


def _add_method(layout, node, name, pressed):
    """The button of a render method."""
    item = layout.operator("brdfc.switch", text=form_name(name).template, depress=pressed)
    item.node, item.representation = model_nodes.key(node), name


def _draw_form(layout, node, form, scene, changes):
    model_name, representation = model_nodes.identity(node)
    if lean := model_nodes.is_baked(node):
        wrapped(
            layout,
            say(
                "Lean: only what this file needs. Choosing a render method restores the whole model"
            ),
        )
    model = pack.model(model_name)
    # In one row their names would be cut off at the default width of the sidebar.
    methods = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
    methods.enabled = changes
    values = {key: model_nodes.get_value(node, key) for key in model.parameters}
    refusals, automatic = [], model_nodes.is_automatic(node)
    if model.native_form:
        _add_method(methods, node, "auto", automatic)
    for name, method in model.forms.items():
        if refusal := method.refusal(values):
            refusals.append(refusal)
            continue
        if not method.is_native and not pack.osl_available():
            refusals.append(pack.NO_OSL)
            continue
        _add_method(methods, node, name, name == representation and not lean and not automatic)
    column = layout.column(align=True)
    if automatic:
        wrapped(column, METHODS["auto"])
    wrapped(column, METHODS[representation])
    for refusal in dict.fromkeys(refusals):
        wrapped(column, refusal)
    # A button instead of a label, which could have no tooltip to explain the number.
    line = column.row()
    line.alignment = "LEFT"
    line.operator(
        "brdfc.details",
        text=iface(error_line(node, form)),
        translate=False,
        icon="QUESTION",
        emboss=False,
    ).node = model_nodes.key(node)
    wrapped(column, say("Cost: {cost}", cost=cost_text(node, form)))
    if model.entry.get("albedo"):
        wrapped(column, say("Albedo: {albedo}", albedo=energy_text(node)))


def _draw_values(layout, node):
    column = layout.column()
    column.use_property_split = True
    for socket in model_nodes.sockets(node).values():
        if socket.type != "VECTOR":
            row = column.row()
            row.enabled = not shader_trees.is_driven(socket)
            row.prop(socket, "default_value", text=socket.name, translate=False)


def draw_node(layout, node, scene):
    """Shows model, form, error, cost, energy and values of a group node."""
    model_name, _ = model_nodes.identity(node)
    layout.label(text=node.label or node.name, icon="MATERIAL", translate=False)
    if node.mute:
        said = say("This node is muted, and a muted shader is black: press M to unmute it")
        wrapped(layout.column(align=True), said, "INFO")
    changes = editable.keeps_changes(node.id_data)
    if made := model_nodes.manifest_entry(node):
        model = pack.model(model_name)
        column = layout.column(align=True)
        for said in filter(None, (model.paper, model.entry["equations"])):
            wrapped(column, said)
        _draw_form(layout, node, made.form, scene, changes)
    _draw_values(layout, node)
    layout = layout.column()
    layout.enabled = changes
    if made and optical.can_have(model_name):
        menu = layout.operator_menu_enum("brdfc.substance", "substance", icon="MATERIAL_DATA")
        menu.node = model_nodes.key(node)
    may_have = made and not model_nodes.is_baked(node) and model.has_albedo
    if may_have and nodes.ALBEDO not in node.outputs:
        layout.operator("brdfc.add_albedo", icon="ADD").node = model_nodes.key(node)
    if model_name == kernel.MODEL:
        layout.operator("brdfc.kernel", icon="FCURVE").node = model_nodes.key(node)


def _listed(names):
    return ", ".join(map(iface, counted(names)))


def draw_lamps(layout, material, scene):
    """Shows the lamps that the material's models aim at, if any of them does."""
    forms = [
        made.form
        for n in model_nodes.group_nodes(material)
        if (made := model_nodes.manifest_entry(n))
    ]
    slots = max((form.get("lamps") or 0 for form in forms), default=0)
    if slots == 0:
        return
    box = layout.box()
    # A material that is linked has the lamps of its file.
    theirs = model_nodes.lamps_of_other_file(material)
    found = lamps.last_found(scene, theirs)
    taken = [lamp.name for lamp in found if lamp.slot is not None and lamp.slot <= slots]
    if taken:
        said = say("Free of noise under {lamps}", lamps=_listed(taken))
    else:
        said = say("Free of noise under no lamp yet")
    wrapped(box.column(align=True), said, "LIGHT")
    if theirs is None and (missing := lamps.not_followed(scene, found)):
        said = say(
            "The viewport uses the lamps of {scene}, the scene of the first window, so {lamps} may "
            "be noisy or missing there; pictures are right",
            scene=lamps.current_scene().name,
            lamps=_listed(lamp.name for lamp in missing),
        )
        wrapped(box.column(align=True), said, "INFO")
    limit = closure_slots.lamps_that_fit()
    if limit is not None and limit[0] < min(slots, len(found)):
        room, largest = limit
        said = say(
            "Cycles has room for {count} lamps beside the shaders of {material}",
            count=room,
            material=largest.name,
        )
        wrapped(box.column(align=True), said, "ERROR")
    box.operator("brdfc.find_lamps", icon="FILE_REFRESH")


def _more(layout, said):
    """A button for the details of a sentence, if it has any."""
    if more := getattr(said, "more", ""):
        row = layout.row()
        row.alignment = "LEFT"
        row.operator("brdfc.more", icon="QUESTION", emboss=False).text = more


def draw_findings(layout, found):
    """Shows findings with buttons to fix them; equal sentences appear once."""
    said, offered = set(), set()
    for finding in found:
        line = iface(finding.message)
        if line not in said:
            row = layout.column(align=True)
            row.alert = finding.severity == "ERROR"
            wrapped(row, line, "ERROR" if finding.severity == "ERROR" else "INFO")
            _more(layout, finding.message)
        said.add(line)
        if finding.code in BUTTONS and finding.code not in offered:
            offered.add(finding.code)
            operator, text, settings = BUTTONS[finding.code]
            item = layout.operator(operator, text=text, icon="CHECKMARK")
            for key, value in settings.items():
                setattr(item, key, value)


def draw_material(layout, material, scene):
    """The whole panel of a material, beginning with the findings that change the picture."""
    found = checks.warnings(material, scene)
    first = [f for f in found if f.severity == "ERROR" or f.code in UNABLE]
    draw_findings(layout, first)
    ours = model_nodes.group_nodes(material)
    if why := editable.refusal(material, *(node.id_data for node in ours)):
        wrapped(layout.column(align=True), why, "LINKED")
        if not any(BUTTONS.get(f.code) == MAKE_LOCAL for f in found):
            layout.operator(MAKE_LOCAL.operator, text=MAKE_LOCAL.text, icon="CHECKMARK")
    for node in ours:
        draw_node(layout.box(), node, scene)
    draw_lamps(layout, material, scene)
    draw_findings(layout, [f for f in found if f not in first])
    if any(convert.is_converted(node) for node in ours):
        layout.operator("brdfc.convert_back", icon="LOOP_BACK")
    if convert.has_replaced(material):
        layout.operator("brdfc.to_models", icon="LOOP_BACK")
    layout.operator("brdfc.write_materials", icon="EXPORT")
    layout.operator("brdfc.bake", icon="MOD_DECIM")


class _BrdfcPanel:
    bl_label = "Reflection Model"

    def draw(self, context):
        try:
            draw_material(self.layout, material_of(context), context.scene)
        except pack.PackError as error:
            said, _ = of_error(error)
            wrapped(self.layout, said, "ERROR")
            _more(self.layout, said)


def _has_ours(context):
    material = material_of(context)
    return material is not None and bool(model_nodes.group_nodes(material))


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


_CLASSES = (
    *_SUBMENUS,
    NODE_MT_brdfc,
    MATERIAL_MT_brdfc,
    MATERIAL_PT_brdfc,
    NODE_PT_brdfc,
)
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
