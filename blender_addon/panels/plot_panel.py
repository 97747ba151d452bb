# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Plots. It shows pictures of plots.py as previews, which are not saved in files."""

import functools

import bpy
import bpy.utils.previews
import numpy as np
from bpy.types import Panel

from ..common import color
from ..common.i18n import form_name, in_percent, of_error, say
from ..common.interface import material_of
from ..groups import model_nodes
from ..packs import pack
from ..plotting import nearest_node
from .labels import wrapped

#: Number of cached pictures; the oldest is discarded.
_KEPT = 16
_previews = None
_places = {}  # values and form: name of the preview, legend


def drawn(node):
    """plots.draw() for a node's values, with its form's reflection if that can be determined: the
    form may be of any version."""
    # NumPy's formulas are imported on first use.
    from ..plotting import form_light, plots, shader_text

    model_name, _ = model_nodes.identity(node)
    values, _ = nearest_node.values(node)
    form = functools.partial(form_light.lobes, node) if model_nodes.is_fitted(node) else None
    try:
        return plots.draw(model_name, values, form)
    except shader_text.Unreadable:
        return plots.draw(model_name, values)


def picture(node):
    """The preview for a node's values and its plots.Legend; drawn if the values are new. Raises
    ValueError for a model that the extension lacks."""
    model_name, form = model_nodes.identity(node)
    values, _ = nearest_node.values(node)
    key = (
        model_name,
        form,
        node.node_tree[model_nodes.TAG]["digest"],
        color.working_space(),
        *((n, tuple(np.ravel(v))) for n, v in values.items() if v is not None),
    )
    if key not in _places:
        pixels, legend = drawn(node)
        if len(_previews) < _KEPT:
            name = f"plot {len(_previews)}"
            _previews.new(name)
        else:
            name, _ = _places.pop(next(iter(_places)))
        preview = _previews[name]
        preview.image_size = pixels.shape[1::-1]
        # Packs the four bytes of a pixel into one integer.
        packed = np.ascontiguousarray((pixels * 255 + 0.5).astype(np.uint8)).view(np.int32)
        preview.image_pixels.foreach_set(packed.ravel())
        _places[key] = (name, legend)
    name, legend = _places[key]
    return _previews[name], legend


def _percent(share):
    return in_percent(round(share, 4))


def _shares(color):
    """One percentage, or three for red, green and blue."""
    texts = [f"{100 * share:.3g}" for share in color]
    return texts[0] if len(set(texts)) == 1 else ", ".join(texts)


def _form_said(node, legend):
    form = form_name(model_nodes.identity(node).form)
    if legend.form is not None:
        percent = _percent(legend.form)
        return say(
            "Dotted: render method {form}, error {percent} %",
            form=form,
            percent=percent,
        )
    if model_nodes.is_fitted(node):
        return say("Render method {form}: what it reflects can't be plotted", form=form)
    return say("Render method {form}: reflects what the model does", form=form)


def _legend(node, legend):
    """The sentences of the legend by subject; the material itself comes first."""
    if legend.mirror is not None:
        shares = _shares(legend.mirror)
        yield say("Arrow above: an ideal mirror, {percent} % of the light", percent=shares)
    if legend.refracted is not None:
        yield say("Arrow below: refracted, {percent} %", percent=_shares(legend.refracted))
    yield say("Solid: the model")
    yield _form_said(node, legend)
    if legend.glossy is not None:
        yield say("Grey: the nearest Glossy, roughness {value}", value=f"{legend.glossy:.2f}")
    if near := legend.principled:
        percent = _percent(near.error)
        yield say(
            "Dashed: the nearest Principled, error {percent} %",
            percent=percent,
        )
        yield say(
            "Its roughness {roughness}, metallic {metallic}, IOR {ior}",
            roughness=f"{near.roughness:.2f}",
            metallic=f"{near.metallic:.2f}",
            ior=f"{near.ior:.2f}",
        )
        shares = {"mirror": _shares(near.mirror), "refracted": _shares(near.refracted)}
        if near.transmission and near.roughness > 0:
            yield say("Its transmission 1")
        elif near.transmission:
            yield say("Its transmission 1, mirror {mirror} %, refracted {refracted} %", **shares)
        elif any(near.mirror):
            yield say("Its mirror {mirror} %: the dashed arrow", mirror=shares["mirror"])
        elif legend.mirror is not None:
            yield say("It is rough, without ideal mirror")


def draw_plots(layout, material):
    for node in model_nodes.group_nodes(material):
        column = layout.column(align=True)
        column.label(text=node.label or node.name, icon="MATERIAL", translate=False)
        try:
            preview, legend = picture(node)
        except ValueError as error:
            said = say("This extension does not have this model", more=str(error))
            wrapped(column, said, "ERROR")
            continue
        column.template_icon(icon_value=preview.icon_id, scale=14.4)
        wrapped(column, say("Above: light from 45\u00b0, and where it goes"))
        for said in _legend(node, legend):
            wrapped(column, said)
        wrapped(column, say("Middle: under a lamp; the line below a ball tells which it is"))
        wrapped(column, say("Below: albedo, views from 0° to 90°"))
        _, linked = nearest_node.values(node)
        if linked:
            labels = pack.model(model_nodes.identity(node).model).parameters
            names = ", ".join(labels[name]["label"] for name in linked)
            said = say("At the default of {parameters}", parameters=names)
            wrapped(column, said, "INFO")


class _Plots:
    bl_label = "Plots"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return material_of(context) is not None

    def draw(self, context):
        try:
            draw_plots(self.layout, material_of(context))
        except pack.PackError as error:
            wrapped(self.layout, of_error(error)[0], "ERROR")


class MATERIAL_PT_brdfc_plots(_Plots, Panel):
    bl_idname = "MATERIAL_PT_brdfc_plots"
    bl_parent_id = "MATERIAL_PT_brdfc"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"


class NODE_PT_brdfc_plots(_Plots, Panel):
    bl_idname = "NODE_PT_brdfc_plots"
    bl_parent_id = "NODE_PT_brdfc"
    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "brdfc"


_register, _unregister = bpy.utils.register_classes_factory(
    (MATERIAL_PT_brdfc_plots, NODE_PT_brdfc_plots)
)


def register():
    global _previews
    _previews = bpy.utils.previews.new()
    _register()


def unregister():
    global _previews
    _unregister()
    _places.clear()
    bpy.utils.previews.remove(_previews)
    _previews = None
