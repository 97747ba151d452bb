# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the lamps of a scene, and ranks them by their irradiance where the camera looks."""

import math

import bpy
import numpy as np
from mathutils import Vector

from ..common.i18n import say
from . import emission, instancers, kinds, world
from .kinds.light import Light
from .kinds.mesh import FACED
from .survey import Search, Survey

#: Above this angular radius, uneven emission of a lamp matters: a lobe carries the mean of the
#: model over the lamp.
_MAX_UNEVEN_SIZE = 0.05
#: Ratio of radius to distance from which shaders leave a lamp to random rays (kNearest in
#: generator/forms/aimed.h).
_MAX_ANGULAR_SIZE = 0.85


def _rendered(scene, found=None):
    """Objects that are visible in the scene's renders, including those of background sets."""
    found = {} if found is None else found

    def walk(layer):
        if layer.collection.hide_render:
            return
        if not layer.exclude:
            for item in layer.collection.objects:
                found[item] = None
        for child in layer.children:
            walk(child)

    for layer in [v for v in scene.view_layers if v.use] or scene.view_layers:
        # In 5.2 it is None for a scene that was just created.
        if layer.layer_collection is not None:
            walk(layer.layer_collection)
    if scene.background_set is not None:
        _rendered(scene.background_set, found)
    return found


def lamps_of(scene):
    """The lamp objects that are visible in the scene's renders."""
    found = [(item, kinds.of_object(item)) for item in _rendered(scene)]
    return [item for item, kind in found if isinstance(kind, Light) and kind.shines(item)]


def _subject(scene, shown, matrix_of):
    """Points at which lamps are ranked: the centres of the four meshes nearest to the camera and in
    its view, or else of all meshes."""
    if not shown:
        return np.zeros((1, 3))
    boxes = [o.bound_box for o in shown]
    middles = [(Vector(box[0]) + Vector(box[6])) / 2 for box in boxes]  # opposite corners
    centres = np.array([matrix_of(o) @ m for o, m in zip(shown, middles, strict=True)])
    camera = scene.camera
    if camera is not None and camera.type == "CAMERA":
        matrix, data = matrix_of(camera), camera.data
        to = centres - np.array(matrix.translation)
        depth = to @ -np.array(matrix.col[2].to_3d().normalized())
        aside = np.sqrt(np.maximum((to**2).sum(-1) - depth**2, 0))
        # A cone around the camera frame; an object larger than the frame has its centre elsewhere.
        if data.type == "ORTHO":
            seen = aside < 0.75 * data.ortho_scale
        else:
            seen = aside < 1.5 * math.tan(min(data.angle, 3.0) / 2) * depth
        seen &= depth > 0
        if seen.any():
            order = np.argsort((to**2).sum(-1) + np.where(seen, 0, np.inf))
            return centres[order[: min(4, seen.sum())]]
    return centres.mean(0)[None]


def shown_with(scene):
    """Other scenes that appear in a scene's renders, through its compositor and sequencer."""
    found = []

    def walk(tree, seen):
        for node in tree.nodes if tree is not None and tree not in seen else ():
            if node.bl_idname == "CompositorNodeRLayers":
                found.append(node.scene)
            walk(getattr(node, "node_tree", None), [*seen, tree])

    if scene.render.use_compositing:
        if hasattr(scene, "compositing_node_group"):  # since 5.0
            walk(scene.compositing_node_group, [])
        elif scene.use_nodes:
            walk(scene.node_tree, [])
    if scene.render.use_sequencer and scene.sequence_editor is not None:
        strips = scene.sequence_editor.strips_all
        found += [strip.scene for strip in strips if strip.type == "SCENE"]
    return list(dict.fromkeys(s for s in found if s is not None and s != scene))


def _copies(search):
    """Candidates of what objects instance."""
    found = {kind: [] for kind in kinds.KINDS}
    for instance in search.depsgraph.object_instances:
        item, parent = instance.object, instance.parent
        if not instance.is_instance or item.hide_render:
            continue
        if parent is None or parent.original.hide_render:
            continue
        kind = kinds.of_object(item)
        copy = kind.of_copy(instance, search) if kind is not None else None
        if copy is not None:
            found[kind].append(copy)
    return [candidate for kind, copies in found.items() for candidate in kind.of_copies(copies)]


def _judge(survey):
    """Ranks candidates, and finds those that shaders can't aim at."""
    for candidate in survey.candidates:
        if candidate.judge is not None:
            candidate.judge(survey.subject)
        candidate.rank = float(np.mean(candidate.irradiance(survey.subject)))
        angle = float(np.mean(candidate.angular_size(survey.subject)))
        if not math.isfinite(candidate.rank + angle):  # a mesh with invalid coordinates
            candidate.rank = angle = 0.0
        candidate.width = round(math.log2(max(angle, 1e-4)))
        uneven, met = candidate.uneven, candidate.met
        if uneven and angle > _MAX_UNEVEN_SIZE and met and not candidate.why:
            candidate.why = say("its light is not the same all over it")
        elif not met and angle > _MAX_ANGULAR_SIZE:
            candidate.why = say("it looks too large for a closure")


def survey_lamps(scene, depsgraph, subject=None):
    """A Survey of a scene. `subject`: points of an earlier survey, so that they need not be
    determined."""
    survey = Survey(subject=subject)
    survey.emission = {m.name_full: emission.of_material(m) for m in bpy.data.materials}
    emitting = {m: e for m in bpy.data.materials if (e := survey.emission[m.name_full]) > 0}
    survey.uneven = {m.name_full for m in emitting if not emission.is_even(m)}
    search = Search(survey, depsgraph, emitting)
    shown, placing = [], instancers.Instancers(emitting)
    for item in _rendered(scene):
        if item.parent is not None and item.parent.instance_type in {"VERTS", "FACES"}:
            continue  # only its instances are rendered
        if item.type in FACED and item.hide_render:
            continue
        kind = kinds.of_object(item)
        candidate = kind.of_object(item, search) if kind is not None else None
        if candidate is not None:
            survey.candidates.append(candidate)
        elif item.type in FACED:
            shown.append(item)
        if placing.places(item):
            survey.instancers.add(item.name_full)
    if survey.subject is None:
        survey.subject = _subject(scene, shown, search.matrix)
    if survey.instancers and depsgraph:
        survey.candidates += _copies(search)
    survey.candidates += world.candidates(scene.world)
    _judge(survey)
    survey.candidates.sort(key=lambda c: (-c.rank, c.name))
    return survey
