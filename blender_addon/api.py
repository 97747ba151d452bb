# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials from scripts, with and without a window.

    from bl_ext.user_default.brdfc_shaders import api
    material = api.new_material("coupled", r0=0.05, rm=(0.8, 0.1, 0.1))
    bpy.data.objects["Cube"].active_material = material

Names and values are those of the models' schema: numbers, colours as (r, g, b) or one grey
number, choices by identifier.
"""

import contextlib
import functools
import json
import os
from numbers import Real
from pathlib import Path

import bpy

from . import convert, lamps, lean, library, measured
from .common import argument_checks, editable, enabling, files
from .common.i18n import say
from .content.compiler import CompileError
from .groups import automatic, bump_correction, model_nodes, nodes, stacks, tangents, update, usage
from .groups.update import Update
from .lamps import Lamp
from .lean import PlanError
from .library import LibraryError
from .library import measured as measured_library
from .library.measured import MeasuredLibrary
from .measured import Measured, MeasuredError
from .packs import kernel, pack
from .packs.pack import PackError
from .packs.parameter_values import equal_in_float32
from .plotting import nearest_node
from .trees import animation, shader_trees
from .warnings import checks
from .warnings.rows import Finding

__all__ = [
    "CompileError",
    "PackError",
    "PlanError",
    "LibraryError",
    "Finding",
    "Lamp",
    "Measured",
    "MeasuredError",
    "MeasuredLibrary",
    "Update",
    "add_albedo",
    "add_coat",
    "add_library",
    "albedo",
    "bake",
    "conversion_warning",
    "convert_back",
    "convert_materials",
    "enable_osl",
    "enlarge_lamps",
    "follow_settings",
    "get_parameters",
    "make_local",
    "measured_fits",
    "models",
    "nearest_principled",
    "new_layers",
    "new_material",
    "new_measured_library",
    "new_measured_material",
    "new_sum",
    "plan",
    "plan_conversion",
    "prepare_material",
    "remove_library",
    "replace_by_principled",
    "restore_models",
    "scene_warnings",
    "see_lamps",
    "set_kernel",
    "set_parameters",
    "set_substance",
    "start_bake",
    "start_measured_fits",
    "start_measured_library",
    "start_plan",
    "substances",
    "switch_representation",
    "update_materials",
    "used_materials",
    "warnings",
    "write_materials",
]


#: What `microfacet` is as a coat, unless its caller says otherwise.
_VARNISH = {"f0": (0.04, 0.04, 0.04), "ax": 0.01, "ay": 0.01}

_NO_MATERIAL = say("No material of this file has a reflection model of brdfc")


def models():
    """Models by identifier: label, paper, doc, parameters, representations, as in the manifest."""
    return {name: pack.model(name).entry for name in pack.model_names()}


def _checked(model_name, representation, given):
    """Returns the form to use, or "auto", and the parameter values in canonical form."""
    given = dict(given)
    model = pack.model(model_name)
    checked = {name: model.check_value(name, v) for name, v in given.items()}
    values = {name: v for name, v in checked.items() if name not in model.fixed}
    form = model.resolve(representation, values).name
    return "auto" if representation == "auto" else form, values


def prepare_material(material):
    """Gives a material the settings that its models need; returns a sentence for each change.

    Raises ValueError for a linked material, as every function here does that changes a material.
    """
    enabling.enable()
    editable.check(argument_checks.material(material))
    return bump_correction.prepare(material)


def new_material(model, representation="auto", **parameters):
    """Makes a material of one model. Parameters that are not given take their default.

    A material whose representation is "auto" follows the settings of the scene: where Open Shading
    Language does not run, it consists of Blender's own nodes.

    Raises ValueError for an unknown model, representation or parameter and for a value out of
    range, and CompileError when Cycles can't compile the shader. After an error nothing is left in
    the file.
    """
    form, values = _checked(model, representation, parameters)
    nodes.ensure_group(model, form, values=values)
    material = bpy.data.materials.new(pack.model(model).label)
    try:
        tree = nodes.empty_tree(material)
        node = _add_model(tree, model, form, values)
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        output.location = (300, 0)
        tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
        prepare_material(material)
    except BaseException:
        bpy.data.materials.remove(material)
        raise
    return material


def start_measured_fits(path):
    """Starts to fit every model to a file with a measured BRDF, as measured_fits() does, and
    returns a job: step() returns the fraction done until it is None, and then `result` is set.
    Raises MeasuredError."""
    return measured.Fitting(path)


def measured_fits(path):
    """Fits every model to a file with a measured BRDF: MERL (.binary), RGL (.bsdf), UTIA (.bin),
    ALTA (.alta, .dat) or Radiance (.xml), or a table (.csv). Takes some ten seconds, by the program
    brdfc.

    Returns a Measured: its `fits` are the models, the closest first, each with `model`,
    `parameters`, `matte` and `error`; `stopped`, `turned` and remarks() tell what keeps it from
    coming closer. Raises MeasuredError without the program, and for a file that it refuses.
    """
    return start_measured_fits(path).wait()


def new_measured_material(found, model=None, representation="auto"):
    """Makes a material that comes close to a measured BRDF.

    `found`: a file, or what measured_fits() returned of it. `model`: one of the models, or "lobes"
    for the sum of several; without it the model that comes closest. Only that is fitted to a file.
    The material has no fake user: Blender saves it with the file if something uses it. Where the
    fit has a matte part, the light of a Diffuse node is added to the model's. Where it is `turned`,
    nodes turn the tangent. Raises ValueError, and what measured_fits() and new_material() raise.
    """
    measured.check_model(model, representation)
    if not isinstance(found, Measured):
        found = measured.fitting_of(found, model).wait()
    if model == measured.SUM:
        return new_sum(found.lobe_sum().lobes, representation, found.path.stem)
    fit = found.fit(model)
    material = new_material(fit.model, representation, **fit.used.parameters)
    material.name = found.path.stem
    node = _the_node(material)
    if fit.turned:
        tangents.turn(node, -fit.turned.angle)
    if fit.used.matte:
        stacks.add_matte(material.node_tree, node, fit.used.matte)
    return material


def start_measured_library(folder, blend, model=None, representation="auto"):
    """Starts what new_measured_library() does, and returns a job, as start_measured_fits() does."""
    return measured_library.Making(folder, blend, model, representation)


def new_measured_library(folder, blend, model=None, representation="auto"):
    """Writes a .blend with a material for each measured file in a folder and its subfolders, as
    assets of the catalogue brdfc/Measured, or one for each subfolder below it, with previews.

    `model` and `representation` are those of new_measured_material(). A library of that name is
    replaced, and a .blend with a scene or objects refused; the file of catalogues beside it, or of
    the asset library that contains it, keeps what it has. The open file is left alone. Files and
    folders whose names begin with a dot are left out. Takes some ten seconds a file.

    Returns a MeasuredLibrary: `blend`, `catalogs`, and by file the names of its `materials`,
    `refusals`, a sentence for each file of which no material was made, `notes`, what the data lack,
    and `remarks`, what keeps the fit from coming closer. Raises ValueError for arguments that are
    wrong, and MeasuredError without the program or without any material; no file is changed then.
    """
    job = start_measured_library(folder, blend, model, representation)
    try:
        return job.wait()
    finally:
        job.cancel()


def new_sum(lobes, representation="auto", name="Sum"):
    """Makes a material whose light is the sum of that of several models, by Add Shader nodes.

    `lobes`: a list of models, each with a dictionary of its parameters, as in
    `[("lambert", {"rho": (0.2, 0.1, 0.1)}), ("ward", {})]`, or those of a fitted sum. Raises
    ValueError, and what new_material() raises; after an error nothing is left in the file.
    """
    return _new_stack(lobes, representation, name, stacks.add_shaders)


def new_layers(layers, representation="auto", name="Layers"):
    """Makes a material of models that lie one over another; the first is on top.

    What lies below a layer gets the light that the layer leaves: 1 minus the largest channel of
    its albedo for the view. So no light is gained, as in the Principled node; and as there, light
    is not attenuated by its own direction, so the material is not reciprocal. `layers` is as for
    new_sum(), which says what is raised.
    """
    return _new_stack(layers, representation, name, stacks.put_layers)


def add_coat(material, model="microfacet", representation="auto", **parameters):
    """Puts a model over all that a material shows, of whatever nodes, as new_layers() does, and
    returns its node. `microfacet` is a clear varnish with an IOR of 1.5, unless `parameters` say
    otherwise: `f0` 0.04, `ax` and `ay` 0.01.

    Raises ValueError, also where nothing leads to the material's surface, and CompileError; after
    an error the material is as it was.
    """
    editable.check(argument_checks.material(material))
    if model == "microfacet":
        parameters = _VARNISH | parameters
    measured.as_pairs([(model, parameters)])  # refuses models that let light through
    form, values = _checked(model, representation, parameters)
    surface = stacks.surface_of(material)
    coat = _add_model(material.node_tree, model, form, values)
    try:
        stacks.add_coat(coat, surface)
    except BaseException:
        material.node_tree.nodes.remove(coat)
        raise
    prepare_material(material)
    return coat


def _add_model(tree, model, form, values):
    """Adds a model's node with these values to a tree."""
    node = nodes.add_group_node(tree, model, form, values)
    for parameter, value in values.items():
        model_nodes.set_value(node, parameter, value)
    return node


def _new_stack(lobes, representation, name, put_together):
    argument_checks.text(name)
    (first, values), *others = measured.as_pairs(lobes)
    checked = [(model, *_checked(model, representation, given)) for model, given in others]
    material = new_material(first, representation, **values)
    try:
        tree, node = material.node_tree, _the_node(material)
        added = [_add_model(tree, *model_form_values) for model_form_values in checked]
        put_together(tree, node, added)
        prepare_material(material)
    except BaseException:
        bpy.data.materials.remove(material)
        raise
    material.name = name
    return material


def _the_node(material, node=None):
    """A model node of a material: its only one, or the one that `node` is or names."""
    enabling.enable()
    argument_checks.material(material)
    if isinstance(node, str):
        return model_nodes.named(material, node)
    ours = model_nodes.group_nodes(material)
    if node is not None and argument_checks.node(node) in ours:
        return node
    if node is None and len(ours) == 1:
        return ours[0]
    of = {"material": material.name, "count": len(ours)}
    if node is not None:
        raise ValueError(
            say("Node {node!r} is no model of material {material!r}", node=node.name, **of)
        )
    if not ours:
        raise ValueError(
            say("Material {material!r} has {count} reflection models, expected one", **of)
        )
    raise ValueError(
        say(
            "Material {material!r} has {count} reflection models: expected node=, one of {names}",
            **of,
            names=", ".join(repr(model_nodes.key(n)) for n in ours),
        )
    )


def set_parameters(material, node=None, **parameters):
    """Sets parameters of a material with one model, or of the one that `node` names. All values are
    checked before any is changed.

    Raises ValueError as new_material does, and for a parameter that a link or a driver controls. A
    value that has keys comes back at the next frame.
    """
    found = _the_node(material, node)
    _set(found, say("material {name!r}", name=material.name), parameters)


def _set(node, what, parameters):
    editable.check(node.id_data)
    model, representation = model_nodes.identity(node).model, model_nodes.form_in_script(node)
    lean_node = model_nodes.is_baked(node)
    _, values = _checked(model, "auto" if lean_node else representation, parameters)
    present = model_nodes.sockets(node)
    for name, value in values.items():
        if (
            lean_node
            and name not in present
            and not equal_in_float32(value, model_nodes.get_value(node, name))
        ):
            raise ValueError(
                f"{name!r} of {what} is {model_nodes.get_value(node, name)!r}, the only value of a "
                f"lean material; switch_representation() restores the others; got {value!r}"
            )
        if name in present and shader_trees.is_driven(present[name]):
            raise ValueError(
                say("{parameter!r} of {what} is controlled by a link", parameter=name, what=what)
            )
        if name in present and animation.has_driver(present[name]):
            raise ValueError(
                say("{parameter!r} of {what} is controlled by a driver", parameter=name, what=what)
            )
    for name, value in values.items():
        model_nodes.set_value(node, name, value)


def set_kernel(group, curve):
    """Sets the kernel of a `lossless` group node to the curve of a Float Curve node.

    x from 0 to 1 on the curve is the distance u from 0 to 3; y is the height relative to the
    largest. Raises ValueError for a node of another model, and where a height is not positive or
    too small beside the largest; in that case nothing is changed.
    """
    is_ours = model_nodes.is_ours(argument_checks.node(group))
    if not is_ours or model_nodes.identity(group).model != kernel.MODEL:
        raise ValueError(
            say(
                "Node {node!r}: expected a node of the model {model!r}",
                node=group.name,
                model=kernel.MODEL,
            )
        )
    editable.check(group.id_data)
    values = {"kernel": "table", **kernel.heights(argument_checks.node(curve))}
    _set(group, say("node {name!r}", name=group.name), values)


def set_substance(material, substance, node=None, thickness=None):
    """Gives a material the parameters of a metal, glass or liquid with measured refractive index.

    The material must have one model, or `node` is or names one of its model nodes. The values are
    in the working space of the file: n and k by channel, or the colour reflected at normal
    incidence, whichever parameters the model has, and the absorption inside, which is exact at
    `thickness` metres (0.01 by default). Where no k is given, nothing is absorbed. All other
    parameters keep their values.

    `substance`: one of substances(), or a file: a table NAME.csv or NAME.txt, as
    refractiveindex.info exports it, NAME.yml of its database, or NAME.eta.spd, a spectrum as pbrt
    has them. Returns the parameters that were set, and prints the assumptions made about a file.
    Raises ValueError for an unknown name, for a file that can't be read (with the line and what was
    expected), for a model without such parameters, and for a thickness where nothing is absorbed;
    in that case nothing is changed.
    """
    from .packs import optical

    node = _the_node(material, node)
    found = optical.find(substance)
    values = optical.parameters(model_nodes.identity(node).model, found, thickness)
    for note in found.notes:
        print(f"brdfc: {note}")
    _set(node, say("material {name!r}", name=material.name), values)
    return values


def substances():
    """The substances that set_substance() accepts by name: label, source, n and k of each."""
    from .brdfc import optics

    return optics.substances()


def get_parameters(material, node=None):
    """The parameter values of a material with one model, or of the one that `node` names, except
    those that a link controls."""
    node = _the_node(material, node)
    model_name, _ = model_nodes.identity(node)
    values = {name: model_nodes.get_value(node, name) for name in pack.model(model_name).parameters}
    return {name: value for name, value in values.items() if value is not None}


def switch_representation(material, representation, node=None):
    """Changes the form of the models of a material, or of the one that `node` names; values and
    links stay. Raises ValueError, with all models as they were, if one of them lacks the form."""
    argument_checks.material(material)
    several = node is None and len(model_nodes.group_nodes(material)) > 1
    chosen = model_nodes.group_nodes(material) if several else [_the_node(material, node)]
    for one in chosen:
        editable.check(one.id_data)
        if representation != "auto":
            model = pack.model(model_nodes.identity(one).model)
            model.resolve(representation, model_nodes.constants(one))
    for one in chosen:
        nodes.switch(one, representation)
    for tree in dict.fromkeys(one.id_data for one in chosen):
        for user in model_nodes.users_of(tree):
            prepare_material(user)


def _prepare_all():
    for material in bpy.data.materials:
        if editable.keeps_changes(material):
            prepare_material(material)


def update_materials():
    """Updates model nodes of the open file whose shaders another version of the extension made.

    Values, links and forms stay. Returns an Update with the `count` of updated nodes and two lists
    of sentences, `refusals` and `notes`. A node whose update would lose something is left as it is
    and named in `refusals`.
    """
    result = update.update()
    _prepare_all()
    return result


def plan_conversion(materials, limit=convert.LIMIT):
    """Finds the nearest model for each visible Diffuse, Glossy, Metallic, Principled or Glass node,
    also of those in node groups, whose plans name the `others`, the materials that change as well.

    Returns [convert.Plan]; line() describes a plan in words. A plan has the model, its values and
    the fraction of the light that the replacement misplaces; or, where no model comes within
    `limit`, the reason for the refusal. If no model comes near at all, the error is infinite.
    Changes nothing."""
    limit = argument_checks.not_negative(limit)
    return [
        p.within(limit)
        for p in convert.plan(
            dict.fromkeys(argument_checks.each(argument_checks.material, materials))
        )
    ]


def convert_materials(plans):
    """Replaces nodes by the models of plan_conversion(); links stay. Returns the number of nodes.

    The original nodes stay in the materials, unlinked, for convert_back(). Raises ValueError where
    a node has changed since the plan was made, and CompileError; in both cases nothing is changed.
    """
    plans = argument_checks.each(functools.partial(argument_checks.plan, convert.Plan), plans)
    count = convert.apply(plans)
    changed = (material for plan_ in plans if not plan_.refusal for material in plan_.materials)
    for material in dict.fromkeys(changed):
        prepare_material(material)
    return count


def conversion_warning(plans, scene):
    """What a setting of a scene changes about pictures of plan_conversion()'s plans: a sentence if
    it has Filter Glossy, which models ignore, and pictures differ by more than 1 %; None if not."""
    plans = argument_checks.each(functools.partial(argument_checks.plan, convert.Plan), plans)
    return convert.warning(plans, argument_checks.scene(scene))


def convert_back(material):
    """Restores the original nodes; where they were deleted, uses the model's twin instead. Nodes in
    node groups are restored for all materials that use the groups.

    Returns the number of nodes restored. Raises ValueError where there is neither."""
    return convert.restore(argument_checks.material(material))


def nearest_principled(material, node=None):
    """The inputs of the Principled node that comes nearest to a material with one model, or to the
    one that `node` names: base_color, metallic, roughness, ior and transmission, and the fraction
    of the light from 45 degrees that the node misplaces, error. None for a black material. Linked
    parameters have their default.

    For exporters that know no other node; those to glTF and USD use it by themselves.
    """
    near = nearest_node.of_node(_the_node(material, node))
    if near is None:
        return None
    return {
        "base_color": near.color,
        "metallic": near.metallic,
        "roughness": near.roughness,
        "ior": near.ior,
        "transmission": float(near.transmission),
        "error": near.error,
    }


def replace_by_principled(material):
    """Puts the nearest Principled node in the place of a material's models, for export to files
    that can't hold these. The models stay in the material, unlinked, for restore_models().

    Links of normals and tangents, and of a colour that the base colour follows, are kept. Returns
    an object with the fraction of the light from 45 degrees that the node misplaces, `error`, and
    the labels of the parameters whose links are not kept, `lost`; line() says both. Raises
    ValueError for a material that shows no model, for a converted one, which convert_back()
    restores, and where other shaders than constant mixes, coats and Diffuse nodes stand beside the
    models; in all cases nothing is changed."""
    return convert.replace_by_principled(argument_checks.material(material))


def restore_models(material):
    """Undoes replace_by_principled(). Returns whether there was something to undo. Raises
    ValueError if the models' node was deleted or has another name."""
    return convert.restore_models(argument_checks.material(material))


def add_albedo(material, node=None):
    """Adds the Albedo output to the node of a material with one model, or to the one that `node`
    names.

    The output is the fraction of a uniform white environment's light that the surface reflects.
    Models whose albedo needs large tables are added without it, to keep files small. Raises
    ValueError for a lean node, and for one made by another version of the extension.
    """
    nodes.add_albedo(_the_node(material, node))


def add_library():
    """Builds the library of ready-made materials and registers it in the preferences.

    The Asset Browser shows it from then on. An existing library is rebuilt. Takes seconds, as a
    second Blender builds it. Returns the number of materials. Raises LibraryError; in that case
    nothing is changed.
    """
    return library.Making().wait()


def remove_library():
    """Unregisters the library and deletes its files; materials already in files stay.

    Returns whether there was one."""
    return library.remove()


def albedo(model, cos_theta_o, **parameters):
    """Directional albedo (r, g, b) from the model's table. Raises ValueError."""
    from .packs import energy

    # Rounding may have made a cosine of 1 larger.
    if not isinstance(cos_theta_o, Real) or not 0 < cos_theta_o <= 1 + 1e-6:
        raise ValueError(f"cos_theta_o: expected a number in (0, 1], got {cos_theta_o!r}")
    return energy.albedo(model, _checked(model, "auto", parameters)[1], min(cos_theta_o, 1.0))


def used_materials():
    """The models that the open file uses, by material, in the format of `materials` in a scene
    file.

    A parameter that is linked, animated or driven is {"varies": True}. A material with several
    model nodes has an entry for each, named MATERIAL/NODE.
    """
    return {name: use.entry for name, use in usage.uses().items()}


def write_materials(path):
    """Writes the file for `brdfc build --materials`, which makes a pack of only what it lists.

    The file holds used_materials() and which lamps have no size. Returns the number of materials.
    Raises ValueError if there are none, and OSError if the file can't be written (on Windows, if
    another program has it open); an existing file is unchanged then.
    """
    materials = used_materials()
    if not materials:
        raise ValueError(_NO_MATERIAL)
    path = Path(path)
    beside = files.beside(path)
    try:
        beside.write_text(json.dumps(lean.needs(materials), indent=1) + "\n", encoding="utf-8")
        os.replace(beside, path)
    except PermissionError as failed:
        said = say(
            "{file} can't be written: it may be open in another program, or write-protected",
            more=failed.strerror,
            file=path,
        )
        raise PermissionError(said) from failed
    except OSError as failed:
        # The error's own text names the temporary file, which means nothing to the user.
        raise OSError(say("{file} can't be written", more=failed.strerror, file=path)) from failed
    finally:
        # Whatever prevented writing also prevents removing; one error message is enough.
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)
    return len(materials)


def start_plan(error=None, time=None, fit=False):
    """Starts the program brdfc on a plan for the open file. Returns a lean.Job that yields the
    Plan.

    Given `error` (in percent: 5 or "5%") or `time` (in units of Blender's Glossy node: 1.2 or
    "1.2x"), brdfc chooses the forms. Linked, animated and driven parameters stay inputs of the lean
    shaders. With `fit`, aimed forms use closures fitted to these materials as their base: this
    takes seconds to minutes per material, and lowers the noise under skies and images.
    Changes nothing. Raises ValueError for an invalid budget and where no material has a model, and
    PlanError if the program is missing.
    """
    budget = lean.budget(error, time)
    used = {
        name: use
        for name, use in usage.uses().items()
        if editable.keeps_changes(use.material, use.node.id_data)
    }
    if not used:
        raise ValueError(_NO_MATERIAL)
    return lean.Planning(used, *budget, fit)


def plan(error=None, time=None, fit=False):
    """Runs the program brdfc on the open file and returns the lean.Plan for bake().

    lines() gives the plan in words, `explanation` the output of `brdfc build --explain`. Takes the
    arguments of start_plan() and waits for the result. Raises PlanError if brdfc refuses.
    """
    job = start_plan(error, time, fit)
    try:
        return job.wait()
    finally:
        job.cancel()


def bake(made):
    """Gives every material the lean groups of a plan, which hold only what the open file needs.

    Returns the number of nodes that now have a lean group; switch_representation() restores the
    extension's own. Raises ValueError where values, links, animation, forms or lamps have changed
    since the plan was made (also after the plan has been baked), CompileError, and PlanError where
    brdfc and the extension differ in version. After an error the file is as it was.
    """
    return start_bake(made).wait()


def start_bake(made):
    """The same as a lean.Job, one model per step. The file changes in the last step only."""
    return lean.Baking(argument_checks.plan(lean.Plan, made), _prepare_all)


def see_lamps(scene):
    """Updates the lamp list that aimed materials read, from the lamps of a scene.

    The extension does this by itself after changes; but painted environment images and their suns
    are examined here only. Returns every lamp as a Lamp: its name, its slot (from 1, or None), its
    irradiance at the subject, by which lamps are ranked, and why it was left out.
    """
    enabling.enable()
    return lamps.refresh(argument_checks.scene(scene))


def warnings(material, scene):
    """Everything that keeps a material from rendering as its models specify.

    Returns an empty list if the material has no group of this extension. Materials of the form
    "auto" first follow the settings of the window's scene, as they do before a render.
    """
    enabling.enable()
    automatic.follow_quietly()
    return checks.warnings(argument_checks.material(material), argument_checks.scene(scene))


def scene_warnings(scene):
    """What keeps materials of the file from rendering in a scene, if they need Open Shading
    Language; and which other parts of the scene Open Shading Language spoils. Materials follow
    settings first, as for warnings()."""
    enabling.enable()
    automatic.follow_quietly()
    return checks.of_file(argument_checks.scene(scene))


def follow_settings(scene):
    """Adapts materials of the form "auto" to the settings of a scene. Raises CompileError.

    The extension does so by itself when a user changes settings, and before each render. A script
    needs this function for another scene than the window's."""
    enabling.enable()
    automatic.follow(argument_checks.scene(scene))


def enable_osl(scene):
    """Turns OSL on for a scene, with the settings it requires. Returns a sentence for each change.

    Raises RuntimeError when this Blender has no OSL.
    """
    done = checks.enable_osl(argument_checks.scene(scene))
    automatic.follow()
    return done


def enlarge_lamps(scene):
    """Enlarges lamps that are too small for random rays to hit and have no slot in aimed forms.

    They become 1 cm large, suns 0.02 rad, and emit as much light as before. Returns two lists of
    names: the enlarged lamps, and the lamps of other files, which stay as they are.
    """
    return lamps.enlarge(argument_checks.scene(scene))


def make_local(material):
    """Makes a linked material or a library override local to this file, with its node groups.

    It can then be edited, and aims at this file's lamps. Returns the local material; linked objects
    keep the linked one."""
    argument_checks.material(material)
    material = editable.local(material)
    if material.node_tree is not None:
        nodes.make_local(material.node_tree)
    lamps.follow()
    automatic.follow()
    nodes.merge_duplicates(
        nodes.with_parts({node.node_tree for node in model_nodes.group_nodes(material)})
    )
    return material
