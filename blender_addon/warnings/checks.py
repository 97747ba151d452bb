# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds what makes a material of this extension render wrong: asks each row of the table."""

from dataclasses import replace

import bpy

from ..common.i18n import Sentence, in_percent, say
from ..groups import model_nodes
from ..packs import device, pack
from .context import MaterialContext, NodeContext, SceneContext, twin_of
from .rows import WARNING, Finding
from .scene_rules import engine_name
from .table import DECLARED, OF_MATERIAL, OF_NODE, OF_SCENE, UNABLE


def _found(rows, at):
    return [finding for row in rows for finding in row.findings(at)]


def _by_twin(finding, ours):
    """The finding that shaders do not run in a scene where twins stand in for all of them."""
    off = [_twin_error(node) for node in ours]
    if None in off:
        said = say("{reason}: Blender's own nodes stand in", reason=finding.message)
    else:
        said = say(
            "{reason}: Blender's own nodes stand in, error {percent} %",
            reason=finding.message,
            percent=in_percent(max(off)),
        )
    return Finding(finding.code, WARNING, said)


def _twin_error(node):
    """Error of a node's twin; None if it is not known at the node's values."""
    twin, values = twin_of(node), model_nodes.all_values(node)
    if twin is None or twin.refusal(values):
        return None
    return pack.error_at(twin.entry, values).get("relative_l1")


def scene_warnings(scene):
    """What keeps shaders of Open Shading Language from running in a scene, or is spoilt by it."""
    return _found(OF_SCENE, SceneContext(scene))


def of_file(scene):
    """See api.scene_warnings()."""
    ours = [node for material in bpy.data.materials for node in model_nodes.shown_nodes(material)]
    needed = not all(map(model_nodes.runs_anywhere, ours))
    return [f for f in scene_warnings(scene) if needed or f.code not in UNABLE]


def of_scene(ours, scene):
    """The findings of a scene that concern these nodes; forms of Blender's own nodes run
    anywhere."""
    scripted = [node for node in ours if not model_nodes.runs_anywhere(node)]
    found = scene_warnings(scene) if scripted else []
    takes_nodes = scene.render.engine == "CYCLES" or device.is_eevee(scene)
    if not takes_nodes or not all(map(model_nodes.has_stand_in, scripted)):
        return found
    return [_by_twin(f, scripted) if f.code in UNABLE else f for f in found]


def _of_node(at):
    declared = [row for code in at.declared for row in DECLARED if row.code == code]
    return _found((*OF_NODE, *declared), at)


def why_not_run(material, scene):
    """The findings that explain why a material's shaders do not run in a scene: errors where they
    render black, warnings where twins stand in for them."""
    ours = model_nodes.shown_nodes(material)
    return [f for f in of_scene(ours, scene) if f.code in UNABLE]


def warnings(material, scene):
    """See api.warnings()."""
    at = MaterialContext(SceneContext(scene), material)
    found = of_scene(at.nodes, scene)
    stopped = any(f.code in UNABLE for f in found)
    of_nodes = {}
    for node in at.nodes:
        stood_in = (
            stopped and model_nodes.has_stand_in(node) and not model_nodes.runs_anywhere(node)
        )
        for finding in _of_node(NodeContext(at, node, stood_in)):
            of_nodes.setdefault(finding, []).append(node.label or node.name)
    found += [_said_of(finding, names) for finding, names in of_nodes.items()]
    return list(dict.fromkeys(found + _found(OF_MATERIAL, at)))


def _said_of(finding, names):
    """The finding of one or more nodes, which it names. What is wrong with all of them is said
    once."""
    listed = ", ".join(dict.fromkeys(names))
    return replace(finding, message=say("{node}: {what}", node=listed, what=finding.message))


def enable_osl(scene):
    """See api.enable_osl()."""
    if not pack.osl_available():
        raise RuntimeError(pack.NO_OSL)
    done = []
    if scene.render.engine != "CYCLES":
        done.append(say("Render engine changed from {engine} to Cycles", engine=engine_name(scene)))
        scene.render.engine = "CYCLES"
    backend = device.gpu(scene)
    if backend or device.of_elsewhere(scene):
        backend = backend or Sentence("GPU Compute")
        done.append(say("Device changed from {backend} to the CPU", backend=backend))
        scene.cycles.device = "CPU"
    if not scene.cycles.shading_system:
        done.append(say("Open Shading Language turned on"))
        scene.cycles.shading_system = True
    return done
