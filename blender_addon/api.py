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

from . import convert, lamps, lean, library
from .common import editable, expected
from .common.i18n import say
from .content.compiler import CompileError
from .groups import automatic, bump_correction, nodes, update, usage
from .groups.update import Update
from .lamps import Lamp
from .lean import PlanError
from .library import LibraryError
from .packs import kernel, pack
from .packs.pack import PackError
from .trees import shader_trees
from .warnings import checks, lamp_checks
from .warnings.checks import Finding

__all__ = [
    "CompileError",
    "PackError",
    "PlanError",
    "LibraryError",
    "Finding",
    "Lamp",
    "Update",
    "add_albedo",
    "add_library",
    "albedo",
    "bake",
    "convert_back",
    "convert_materials",
    "enable_osl",
    "enlarge_lamps",
    "follow_settings",
    "get_parameters",
    "make_local",
    "models",
    "new_material",
    "plan",
    "plan_conversion",
    "prepare_material",
    "remove_library",
    "scene_warnings",
    "see_lamps",
    "set_kernel",
    "set_parameters",
    "set_substance",
    "start_bake",
    "start_plan",
    "substances",
    "switch_representation",
    "update_materials",
    "used_materials",
    "warnings",
    "write_materials",
]


_NO_MATERIAL = say("No material of this file has a reflection model of brdfc")


def models():
    """Models by identifier: label, paper, doc, parameters, representations, as in the manifest."""
    return {name: pack.model(name) for name in pack.model_names()}


def _checked(model_name, representation, given):
    """The form to use, and the values in canonical form."""
    given = dict(given)
    fixed = pack.fixed(model_name)
    checked = {name: pack.check_value(model_name, name, v) for name, v in given.items()}
    values = {name: v for name, v in checked.items() if name not in fixed}
    representation = pack.resolve(model_name, representation, values)
    return representation, values


def prepare_material(material):
    """Gives a material the settings that its models need; returns a sentence for each change.

    Raises ValueError for a linked material, as do all that change one.
    """
    editable.check(expected.material(material))
    return bump_correction.prepare(material)


def new_material(model, representation="auto", **parameters):
    """Makes a material of one model. Parameters that are not given take their default.

    A material of "auto" follows the settings of the scene: where Open Shading Language does not
    run, it is made of Blender's own nodes. Raises ValueError for an unknown model, representation
    or parameter, or a value that is out of range; CompileError when Cycles can't compile the
    shader. Nothing is left in the file then.
    """
    form, values = _checked(model, representation, parameters)
    representation = "auto" if representation == "auto" else form
    nodes.ensure_group(model, representation, values=values)
    material = bpy.data.materials.new(pack.model(model)["label"])
    try:
        tree = nodes.empty_tree(material)
        node = nodes.add_group_node(tree, model, representation, values)
        for name, value in values.items():
            nodes.set_value(node, name, value)
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        output.location = (300, 0)
        tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
        prepare_material(material)
    except BaseException:
        bpy.data.materials.remove(material)
        raise
    return material


def _the_node(material):
    """The one node of this extension."""
    expected.material(material)
    ours = nodes.group_nodes(material)
    if len(ours) != 1:
        raise ValueError(
            say(
                "Material {material!r} has {count} reflection models, expected one",
                material=material.name,
                count=len(ours),
            )
        )
    return ours[0]


def set_parameters(material, **parameters):
    """Sets parameters of a material with one model. All are checked before one is changed.

    Raises ValueError as new_material does, and for a parameter that a link controls.
    """
    _set(_the_node(material), say("material {name!r}", name=material.name), parameters)


def _set(node, what, parameters):
    editable.check(node.id_data)
    model, representation = nodes.identity(node)[0], nodes.form_in_script(node)
    lean_node = nodes.is_baked(node)
    _, values = _checked(model, "auto" if lean_node else representation, parameters)
    present = nodes.sockets(node)
    for name, value in values.items():
        if lean_node and name not in present and not pack.same(value, nodes.get_value(node, name)):
            raise ValueError(
                f"{name!r} of {what} is {nodes.get_value(node, name)!r}, the only value of a lean "
                f"material; switch_representation() brings the others back; got {value!r}"
            )
        if name in present and shader_trees.is_driven(present[name]):
            raise ValueError(
                say("{parameter!r} of {what} is controlled by a link", parameter=name, what=what)
            )
    for name, value in values.items():
        nodes.set_value(node, name, value)


def set_kernel(group, curve):
    """Draws the kernel of a group node of `lossless` as a Float Curve node has it.

    The curve's x from 0 to 1 is the distance u from 0 to 3, y the height relative to the largest.
    Raises ValueError for another node, and where a height is not positive or too small beside the
    largest; nothing is changed then.
    """
    if not nodes.is_ours(expected.node(group)) or nodes.identity(group)[0] != kernel.MODEL:
        raise ValueError(
            say(
                "Node {node!r}: expected a node of the model {model!r}",
                node=group.name,
                model=kernel.MODEL,
            )
        )
    editable.check(group.id_data)
    values = {"kernel": "table", **kernel.heights(expected.node(curve))}
    _set(group, say("node {name!r}", name=group.name), values)


def set_substance(material, substance, node=None, thickness=None):
    """Gives a material of one model, or one node of it, the parameters of a metal, glass or liquid
    of measured refractive index, in the working space of the file: n and k by channel, or the
    colour that it reflects from above, as the model has them; what k absorbs inside, which is exact
    after `thickness`, in metres (0.01). The others stay.

    `substance`: one of substances(), or a file NAME.csv as refractiveindex.info exports it. Returns
    the parameters that were set; what was assumed of a file is printed. Raises ValueError for
    another name, a file that can't be read, naming line and what was expected, a model without such
    parameters, and a thickness of what absorbs nothing; nothing is changed then.
    """
    from .packs import optical

    node = _the_node(material) if node is None else expected.node(node)
    found = optical.find(substance)
    values = optical.parameters(nodes.identity(node)[0], found, thickness)
    for note in found.notes:
        print(f"brdfc: {note}")
    _set(node, say("material {name!r}", name=material.name), values)
    return values


def substances():
    """What set_substance() knows, by name: label, source, n and k."""
    from .brdfc import optics

    return optics.substances()


def get_parameters(material):
    """Values of the parameters that no link controls, of a material with one model."""
    node = _the_node(material)
    model_name, _ = nodes.identity(node)
    values = {name: nodes.get_value(node, name) for name in pack.parameters(model_name)}
    return {name: value for name, value in values.items() if value is not None}


def switch_representation(material, representation):
    """Changes the form of a material with one model; values and links stay."""
    nodes.switch(_the_node(material), representation)
    prepare_material(material)


def _prepare_all():
    for material in bpy.data.materials:
        if editable.stays(material):
            prepare_material(material)


def update_materials():
    """Gives the models of the open file that another version of the extension made the shaders of
    this one; values, links and forms stay.

    Returns an Update: `count` of nodes, `refusals` and `notes`, sentences. A node that would lose
    something stays as it is and is named there.
    """
    result = update.update()
    _prepare_all()
    return result


def plan_conversion(materials, limit=convert.LIMIT):
    """For each Diffuse, Glossy, Principled or Glass node of these materials that is shown: which
    model comes nearest, with which values, and what part of the light that misplaces; or why none
    does, as where it would misplace more than `limit`. Nothing is changed. Returns [convert.Plan],
    with line() in words; the error of what has no model near is infinite."""
    limit = expected.number(limit)
    return [p.within(limit) for p in convert.plan(expected.each(expected.material, materials))]


def convert_materials(plans):
    """Puts the models of plan_conversion() in place of the nodes; links stay. Returns how many.

    The nodes of before stay in the materials, unlinked, for convert_back(). Raises ValueError where
    a node is not what the plan was made of any more, CompileError; nothing is changed then.
    """
    plans = expected.each(functools.partial(expected.plan, convert.Plan), plans)
    count = convert.apply(plans)
    for plan_ in plans:
        if not plan_.refusal:
            prepare_material(plan_.material)
    return count


def convert_back(material):
    """Puts Blender's own nodes back; where the ones of before are gone, the model's twin. Returns
    how many; ValueError where there is neither."""
    return convert.restore(expected.material(material))


def add_albedo(material):
    """Gives the node of a material with one model its Albedo output: what the surface reflects of a
    white world. Where that takes large tables nodes are made without, so that files stay small.

    Raises ValueError for a lean node, and for one of another version of the extension.
    """
    nodes.add_albedo(_the_node(material))


def add_library():
    """Makes the library of ready-made materials, anew if there is one, and names it in the
    preferences, so that the Asset Browser shows it. Takes seconds: another Blender makes it.

    Returns how many materials it has. Raises LibraryError; nothing is changed then.
    """
    return library.Making().wait()


def remove_library():
    """Takes that library out of the preferences and deletes it; materials that files have of it
    stay. Returns whether there was one."""
    return library.remove()


def albedo(model, cos_theta_o, **parameters):
    """Directional albedo (r, g, b) from the model's table. Raises ValueError."""
    from .packs import energy

    if not isinstance(cos_theta_o, Real) or not 0 < cos_theta_o <= 1:
        raise ValueError(f"cos_theta_o: expected a number in (0, 1], got {cos_theta_o!r}")
    return energy.albedo(model, _checked(model, "auto", parameters)[1], cos_theta_o)


def used_materials():
    """How the open file uses the models, by material: as `materials` of a scene file has it.

    A parameter that a link controls, a curve animates or a driver sets is {"varies": True}. A
    material with several model nodes has an entry for each, MATERIAL/NODE.
    """
    return {name: use.entry for name, use in usage.uses().items()}


def _beside(path):
    """Where a file is written that then takes the place of `path`."""
    return path.with_name(f".{path.name}.{os.getpid()}")


def write_materials(path):
    """Writes used_materials(), and which lamps have no size, for `brdfc build --materials`, which
    makes a pack of just that.

    Returns how many there are. Raises ValueError if there is none, OSError if the file can't be
    written, as one that another program has open on Windows; an older file is then as it was.
    """
    materials = used_materials()
    if not materials:
        raise ValueError(_NO_MATERIAL)
    path = Path(path)
    beside = _beside(path)
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
        # Its own text names the file beside, which nobody asked for.
        raise OSError(say("{file} can't be written", more=failed.strerror, file=path)) from failed
    finally:
        # What is in the way of writing is so of removing, and nothing to be told twice.
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)
    return len(materials)


def start_plan(error=None, time=None, fit=False):
    """Starts the program brdfc on a plan for the open file; a lean.Job, whose result is the Plan.

    `error` in percent and `time` in units of Blender's Glossy node let it choose the forms: 5 or
    "5%", 1.2 or "1.2x". What is linked, animated or driven stays an input of the lean shaders. With
    `fit` aimed forms get closures fitted to these materials for a base, which takes seconds to
    minutes a material and leaves less noise under skies and images.
    Nothing is changed. Raises ValueError for another budget and where no material has a model,
    PlanError without the program.
    """
    budget = lean.budget(error, time)
    used = {
        name: use
        for name, use in usage.uses().items()
        if editable.stays(use.material, use.node.id_data)
    }
    if not used:
        raise ValueError(_NO_MATERIAL)
    return lean.Planning(used, *budget, fit)


def plan(error=None, time=None, fit=False):
    """What the open file needs of the extension, as the program brdfc says: a lean.Plan, with
    lines() in words and `explanation` as `brdfc build --explain` prints it, for bake().

    As start_plan(), and waits for the program. Raises PlanError where it refuses.
    """
    job = start_plan(error, time, fit)
    try:
        return job.wait()
    finally:
        job.cancel()


def bake(made):
    """Gives every material groups that hold what the open file needs and no more: as plan() made.

    Returns how many nodes have one now; switch_representation() goes back to the extension's own.
    Raises ValueError where values, links, animation, forms or lamps are not those that the plan was
    made for, which is also so once it has been baked; CompileError; PlanError where brdfc is of
    another version than the extension. The file is then as it was.
    """
    return start_bake(made).wait()


def start_bake(made):
    """The same as a lean.Job, a model a step. Until the last one the file is as it was."""
    return lean.Baking(expected.plan(lean.Plan, made), _prepare_all)


def see_lamps(scene):
    """Tells the materials that aim at lamps where those of a scene are. The extension does so by
    itself where something changes; painted environment images and suns it looks at here alone.

    Returns every lamp as a Lamp: name, slot from 1 or None, irradiance at the subject by which
    they are ranked, and why one is left out.
    """
    return lamps.see(expected.scene(scene))


def warnings(material, scene):
    """Everything that keeps a material from rendering as its models say. Changes nothing.

    Returns an empty list when the material has no group of this extension.
    """
    return checks.warnings(expected.material(material), expected.scene(scene))


def scene_warnings(scene):
    """What keeps any material of this extension from rendering in a scene, and what of a scene Open
    Shading Language spoils."""
    return checks.scene_warnings(expected.scene(scene))


def follow_settings(scene):
    """Has materials of "auto" follow the settings of a scene. The extension does so by itself when
    a user changes them, and before pictures; scripts that change settings and then ask warnings()
    have nothing else that tells it. Raises CompileError."""
    automatic.follow(expected.scene(scene))


def enable_osl(scene):
    """Turns OSL on for a scene, with what it needs. Returns a sentence for each change made.

    Raises RuntimeError when this Blender has no OSL.
    """
    done = checks.enable_osl(expected.scene(scene))
    automatic.follow()
    return done


def enlarge_lamps(scene):
    """Gives the lamps of a scene that are too small to be met by chance, by drawn directions and
    aimed forms that have no slot left, a size: 1 cm, or 0.02 rad of a sun. They shine as before.

    Returns (names of those, names of the lamps of another file, which stay as they are).
    """
    return lamp_checks.enlarge(expected.scene(scene))


def make_local(material):
    """Makes a material that is linked from another file, or is a library override, this file's own,
    with the groups that it is made of, so that it can be changed and aims at this file's lamps.
    Returns the local one, which linked objects do not have."""
    expected.material(material)
    if editable.refusal(material):
        material = material.make_local()
    nodes.make_local(material.node_tree)
    lamps.follow()
    automatic.follow()
    nodes.unite(nodes.with_parts({node.node_tree for node in nodes.group_nodes(material)}))
    return material
