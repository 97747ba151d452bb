# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks a file and its settings for whatever makes a material of this extension render wrong."""

from dataclasses import dataclass

import bpy

from .. import lamps
from ..common import i18n
from ..common.i18n import Sentence, say
from ..groups import nodes, update
from ..packs import device, pack
from ..trees import shader_trees
from . import closure_pool, lamp_checks
from .setting_checks import DECLARED, black_aovs, clamp_highlight, is_clamped_as_new

BLENDER_MIN = (4, 5, 0)
#: Description of the recorded run of these shaders on an OptiX device; None if there is none.
OPTIX_RUN = None


@dataclass(frozen=True)
class Finding:
    """A problem that was found: a stable code, "ERROR" (the picture is wrong) or "WARNING", and a
    sentence. The sentence may be an i18n.Sentence: English in scripts, translated where shown."""

    code: str
    severity: str
    message: str


def lamps_that_fit(scene):
    """How many lamps the materials of the open file can aim at on a scene's device, and the
    material that sets this limit; None where no material aims at lamps."""
    return closure_pool.lamps_that_fit(device.runs_on_optix(scene))


def device_refusal(model_name, form, scene):
    """Why a form of a model can't run on a scene's device; None if it can."""
    size, room = pack.representation(model_name, form)["closure_bytes"], closure_pool.capacity()
    if size > room and device.runs_on_optix(scene):
        return say(
            "{form} takes more memory than OptiX has: it is for the CPU",
            more=f"{size} bytes of closures, and there is room for {room}",
            form=i18n.form_name(form),
        )
    return None


def _slot_findings(use, scene):
    """Warns if Cycles lacks closure slots for a material, or for its lamps in addition."""
    most = closure_pool.most_slots()
    if use.slots > most:
        yield Finding(
            "closures",
            "ERROR",
            say(
                "The shaders of this material are more than Cycles keeps, and light is lost: use "
                "fewer models in one material",
                more=f"{use.slots} slots of closures, and Cycles has {most}",
            ),
        )
        return
    room = use.lamps(on_optix=False)
    if room is not None and any(
        lamp.why == lamps.too_many(room) for lamp in lamps.last_found(scene)
    ):
        yield Finding(
            "closures",
            "WARNING",
            say(
                "Cycles has room for {count} lamps beside the shaders of this material, so the "
                "light of more lamps is noisy in every material: use fewer models in it",
                more=f"{use.slots} of {most} slots of closures, and {use.slots_per_lamp} a lamp",
                count=room,
            ),
        )


def _pool_findings(material, scene):
    """Warns if a material's closures exceed the memory that the device has for them."""
    use, room = closure_pool.of_material(material), closure_pool.capacity()
    yield from _slot_findings(use, scene)
    if not device.runs_on_optix(scene):
        return
    if use.size > room:
        yield Finding(
            "closure_pool",
            "ERROR",
            say(
                "The models of this material take more memory than OptiX has, and its picture is "
                "wrong: use other render methods, fewer models in one material, or the CPU",
                more=f"{use.size} bytes of closures, and there is room for {room}",
            ),
        )
    elif use.has_others:
        yield Finding(
            "closure_pool_shared",
            "WARNING",
            say(
                "On OptiX the other shaders of this material share what memory its models leave",
                more=f"there is room for {room} bytes of closures, of which the models take "
                f"{use.size}, and {use.per_lamp} a lamp",
            ),
        )


def engine_name(scene):
    """The display name of the render engine."""
    known = {"BLENDER_WORKBENCH": "Workbench"}
    return (
        "EEVEE" if device.is_eevee(scene) else known.get(scene.render.engine, scene.render.engine)
    )


def _by_twin(finding, ours):
    """The finding that shaders do not run in a scene where twins stand in for all of them."""
    off = [_twin_error(node) for node in ours]
    if None in off:
        said = say("{reason}: Blender's own nodes stand in", reason=finding.message)
    else:
        said = say(
            "{reason}: Blender's own nodes stand in, error {percent} %",
            reason=finding.message,
            percent=f"{100 * max(off):.2g}",
        )
    return Finding(finding.code, "WARNING", said)


def _twin(node):
    """Manifest entry of the twin of a node's model; None if it has no twin."""
    made, (model_name, _) = nodes.manifest_entry(node), nodes.identity(node)
    return pack.model(model_name)["representations"].get("twin") if made else None


def _twin_error(node):
    """Error of a node's twin; None if it is not known at the node's values."""
    entry, (model_name, _) = _twin(node), nodes.identity(node)
    if not entry or pack.reason_unavailable(model_name, "twin", nodes.all_values(node)):
        return None
    return entry["error"]["relative_l1"]


def scene_warnings(scene):
    """What prevents every form from rendering in a scene, and what OSL itself spoils there."""
    found = []
    if bpy.app.version < BLENDER_MIN:
        found.append(
            Finding(
                "blender_version",
                "ERROR",
                say(
                    "Blender {version} is too old: {needed} is needed",
                    version=".".join(map(str, bpy.app.version[:2])),
                    needed=".".join(map(str, BLENDER_MIN[:2])),
                ),
            )
        )
    if not pack.osl_available():
        return [*found, Finding("no_osl", "ERROR", pack.NO_OSL)]
    if scene.render.engine != "CYCLES":
        found.append(
            Finding(
                "engine",
                "ERROR",
                say("{engine} can't run these shaders", engine=engine_name(scene)),
            )
        )
        return found
    if not scene.cycles.shading_system:
        found.append(Finding("osl_off", "ERROR", say("Open Shading Language is off")))
    elif names := black_aovs(scene):
        said = say(
            "Open Shading Language is on: Cycles leaves AOVs black then ({names}); the picture "
            "itself is right",
            names=", ".join(names),
        )
        found.append(Finding("black_aovs", "WARNING", said))
    if backend := device.without_osl(scene):
        found.append(
            Finding(
                "device",
                "ERROR",
                say("{backend} devices can't run these shaders", backend=backend),
            )
        )
    if device.of_elsewhere(scene):
        said = say(
            "The device is GPU Compute: a computer whose preferences have a GPU renders on that, "
            "and few can run these shaders"
        )
        found.append(Finding("device_elsewhere", "WARNING", said))
    if OPTIX_RUN is None and device.runs_on_optix(scene):
        found.append(
            Finding(
                "optix_untested",
                "ERROR",
                say("These shaders are untested on OptiX devices"),
            )
        )
    return found


def _of_another_version(material, node, label):
    if nodes.is_newer(node):
        said = say("made by a later version, {version}", version=nodes.made_by(node))
        return Finding("newer", "WARNING", _of(label, said))
    if why := update.refusal(material, node):
        said = say("stays as another version made it: {why}", why=why)
        return Finding("kept", "WARNING", _of(label, said))
    return Finding("outdated", "WARNING", _of(label, say("made by another version")))


def _of(label, sentence):
    """A sentence about one node, with the node's label."""
    return say("{node}: {what}", node=label, what=sentence)


def node_warnings(node, material, scene):
    """The problems of one group node of a material."""
    label = node.label or node.name
    found = []
    if problem := nodes.script_problem(node.node_tree):
        said = say(
            "its shader is damaged: choose its render method again to make it anew", more=problem
        )
        found.append(Finding("script_failed", "ERROR", _of(label, said)))
    form, schema = nodes.manifest_entry(node) or ({}, {})
    if not form:
        found.append(_of_another_version(material, node, label))
    if stood_in := is_stood_in(node, scene):
        form = _twin(node) or {}
    declared = [] if device.is_eevee(scene) else form.get("warnings", [])
    for name, parameter in schema.items():
        value = nodes.get_value(node, name)
        if parameter["kind"] == "choice" or value is None:
            continue
        # Sockets hold single precision, so the limits are compared with a matching tolerance.
        slack = 1e-6 * max(abs(parameter["min"]), abs(parameter["max"]))
        low, high = parameter["min"] - slack, parameter["max"] + slack
        for number in value if parameter["kind"] == "color" else (value,):
            if not low <= number <= high:
                said = say(
                    "{parameter} is {value}, expected {low} to {high}",
                    parameter=parameter["label"],
                    value=f"{number:g}",
                    low=f"{parameter['min']:g}",
                    high=f"{parameter['max']:g}",
                )
                found.append(Finding("out_of_range", "ERROR", _of(label, said)))
    values = nodes.all_values(node)
    for name, choice in pack.unused_parameters(schema, values).items():
        said = say(
            "{parameter} has no effect while {choice} is {value}",
            parameter=schema[name]["label"],
            choice=schema[choice]["label"],
            value=pack.value_text(values[choice]),
        )
        found.append(Finding("no_effect", "WARNING", _of(label, said)))
    if axis := form.get("axis"):
        value = nodes.get_value(node, axis["name"])
        slack = 1e-6 * axis["max"]
        if value is not None and not axis["min"] - slack <= value <= axis["max"] + slack:
            said = say(
                "{parameter} is {value}; the render method Fitted knows values from {low} to "
                "{high} and shows the nearer end of that",
                parameter=schema[axis["name"]]["label"],
                value=f"{value:g}",
                low=f"{axis['min']:g}",
                high=f"{axis['max']:g}",
            )
            found.append(Finding("out_of_fit", "WARNING", _of(label, said)))
    # Measured: a sampled form renders correctly, with the same noise, but takes half as long again.
    sampled = form and nodes.identity(node)[1] == "sampled" and not stood_in
    if sampled and scene.cycles.use_guiding:
        said = say("Path Guiding is on: it only costs time with the render method Sampled")
        found.append(Finding("path_guiding", "WARNING", _of(label, said)))
    if form.get("highlight") and (result := clamp_highlight(node, form, scene)):
        found.append(Finding("clamp_low", result[0], _of(label, result[1])))
    for code, severity, said in lamp_checks.of_node(node, form, scene):
        found.append(Finding(code, severity, _of(label, said)))
    for code in declared:
        # Formula nodes render their lamps by light sampling, and a new scene has no other bright
        # light.
        if code == "clamp_indirect" and form.get("nodes") and is_clamped_as_new(scene):
            continue
        if code in DECLARED and (result := DECLARED[code](material, scene)):
            found.append(Finding(code, result[0], _of(label, result[1])))
    return found


#: Codes of the scene findings under which shaders do not run.
UNABLE = {"no_osl", "engine", "osl_off", "device"}


def of_scene(ours, scene):
    """The findings of a scene that concern these nodes; forms of Blender's own nodes run
    anywhere."""
    scripted = [node for node in ours if not nodes.runs_anywhere(node)]
    found = scene_warnings(scene) if scripted else []
    takes_nodes = scene.render.engine == "CYCLES" or device.is_eevee(scene)
    if not takes_nodes or not all(map(nodes.has_stand_in, scripted)):
        return found
    return [_by_twin(f, scripted) if f.code in UNABLE else f for f in found]


def is_stood_in(node, scene):
    """Whether a scene shows a node's twin in its place."""
    return nodes.has_stand_in(node) and any(f.code in UNABLE for f in of_scene([node], scene))


def why_not_run(material, scene):
    """The findings that explain why a material's shaders do not run in a scene: errors where they
    render black, warnings where twins stand in for them."""
    ours = nodes.shown_nodes(material)
    return [f for f in of_scene(ours, scene) if f.code in UNABLE]


def warnings(material, scene):
    """See api.warnings()."""
    if nodes.group_nodes(material) and shader_trees.shading(material) is None:
        return [Finding("nodes_off", "ERROR", shader_trees.nodes_off())]
    ours = nodes.shown_nodes(material)
    if not ours:
        return []
    found = of_scene(ours, scene)
    for node in ours:
        found += node_warnings(node, material, scene)
    found += _pool_findings(material, scene)
    return list(dict.fromkeys(found))


def enable_osl(scene):
    """See api.enable_osl()."""
    if not pack.osl_available():
        raise RuntimeError(pack.NO_OSL)
    done = []
    if scene.render.engine != "CYCLES":
        done.append(say("Render engine changed from {engine} to Cycles", engine=engine_name(scene)))
        scene.render.engine = "CYCLES"
    backend = device.without_osl(scene)
    if backend or device.of_elsewhere(scene):
        backend = backend or Sentence("GPU Compute")
        done.append(say("Device changed from {backend} to the CPU", backend=backend))
        scene.cycles.device = "CPU"
    if not scene.cycles.shading_system:
        done.append(say("Open Shading Language turned on"))
        scene.cycles.shading_system = True
    return done
