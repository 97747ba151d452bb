# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the slots of the shared group with the brightest lamps of a scene."""

from types import SimpleNamespace

import bpy

from . import kinds, scenes, shared_group, slots
from .survey import Survey

#: Number of values in a slot.
_SIZE = 3 * len(slots.PARTS)


def _by_slot(numbers):
    return [numbers[_SIZE * i : _SIZE * (i + 1)] for i in range(slots.SLOTS)]


def _arranged(chosen, before):
    """Assigns the chosen lamps to slots. Wide lamps come first: the light of a wide lamp's lobe is
    subtracted from the lobe of a smaller lamp in front of it (docs/aimed.md). Otherwise lamps keep
    their slots, so that one more or less changes a single slot."""
    arranged, rest = [None] * slots.SLOTS, []
    before = [slots.decoded(numbers) for numbers in before]
    for candidate in chosen:
        places = [i for i in range(min(len(chosen), len(before))) if arranged[i] is None]
        kept = next((i for i in places if shared_group.all_same(candidate.values, before[i])), None)
        if kept is None:
            rest.append(candidate)
        else:
            arranged[kept] = candidate
    for candidate in rest:
        arranged[arranged.index(None)] = candidate
    # sorted() is stable.
    return sorted(arranged[: len(chosen)], key=lambda c: -c.width)


def _no_limit():
    return slots.Budget(slots.SLOTS * slots.MOST_CONES)


def _always():
    return True


budget_of_file, _are_codes_read = _no_limit, _always


def ask(budget, are_codes_read):
    """Sets two functions that look into groups, which are made of this package. budget(): the
    slots.Budget of the open file's materials. are_codes_read(): whether all materials of the open
    file read slots.coded(), which those of older versions don't."""
    global budget_of_file, _are_codes_read
    budget_of_file, _are_codes_read = budget, are_codes_read


def _cones(chosen, budget):
    """The number of cones that each chosen lamp may have; bright lamps get theirs first."""
    order = sorted(range(len(chosen)), key=lambda i: -chosen[i].rank)
    sheets = [chosen[i].sheet for i in order]
    counts = budget.cones([1 if sheet is None else sheet.cones() for sheet in sheets])
    return [count for _, count in sorted(zip(order, counts, strict=True))]


def _clusters(chosen):
    """A number for each chosen lamp: lamps with the same number never overlap. 0 if it is not flat,
    or if no other chosen lamp has its number."""
    clusters, members = [0] * len(chosen), []
    for i, candidate in enumerate(chosen):
        sheet = candidate.sheet
        if sheet is None or not sheet.stays:
            continue
        for group in members:
            if all(chosen[j].sheet.never_overlaps(sheet) for j in group):
                group.append(i)
                break
        else:
            members.append([i])
    for cluster, group in enumerate((g for g in members if len(g) > 1), 1):
        for i in group:
            clusters[i] = cluster
    return clusters


def _numbers(chosen, budget):
    """The numbers of the slots of the chosen lamps."""
    cones, clusters = _cones(chosen, budget), _clusters(chosen)
    if (max(cones, default=1) > 1 or any(clusters)) and not _are_codes_read():
        return [c.values for c in chosen]
    found = zip(chosen, cones, clusters, strict=True)
    return [slots.coded(c.values, count, cluster) for c, count, cluster in found]


def _worth_aiming(survey):
    return [c for c in survey.candidates if not c.why and c.rank > 0]


def _listed(survey, chosen, why=None):
    """[slots.Lamp] of a survey, those with a slot first; `why` the others have none, if the reason
    is not the number of slots."""
    taken = {id(c) for c in chosen}
    why = why or slots.too_many(len(chosen))
    placed = sorted(enumerate(chosen, 1), key=lambda item: -item[1].rank)
    listed = [(c, slot, "") for slot, c in placed]
    listed += [(c, None, c.why or why) for c in survey.candidates if id(c) not in taken]
    return [
        slots.Lamp(c.name, slot, c.rank, reason, c.sizeless, c.met, c.distorted)
        for c, slot, reason in listed
    ]


#: Result of the last survey and the session_uid of its scene; busy: whether the group is being
#: filled.
memory = SimpleNamespace(scene=None, survey=Survey(), lamps=[], budget=None, busy=False)


def _survey(scene, depsgraph, subject=None):
    """scenes.survey_lamps(), including the lamps of scenes that appear in the scene's pictures,
    because Blender calls handlers for the main scene only. Lamps are ranked within their own
    scene."""
    survey = scenes.survey_lamps(scene, depsgraph, subject)
    for other in scenes.shown_with(scene):
        known = [(c.name, c.values) for c in survey.candidates]
        found = scenes.survey_lamps(other, None).candidates
        survey.candidates += [c for c in found if (c.name, c.values) not in known]
    survey.candidates.sort(key=lambda c: (-c.rank, c.name))
    return survey


def _fill(scene, depsgraph, subject=None, keep=True):
    """Updates the shared group, if there is one; returns [slots.Lamp]. `keep`: lamps keep their
    slots where possible."""
    survey = _survey(scene, depsgraph, subject)
    budget = budget_of_file()
    group = shared_group.deduplicate()
    if group:
        shared_group.mend(group)
    now = shared_group.written(group) if group else []
    chosen = _arranged(
        _worth_aiming(survey)[: budget.lamps()], _by_slot(now) if group and keep else []
    )
    if group:
        sockets = shared_group.sockets(group)
        empty = (0.0,) * _SIZE
        filled = _numbers(chosen, budget)
        wanted = [v for numbers in filled for v in numbers]
        wanted += [*empty] * (slots.SLOTS - len(chosen))
        sheets = {c.name for c in chosen if c.sheet is not None}
        survey.sheets = sheets if len(sheets) > 1 else set()
        for (socket, _), old, new in zip(sockets, now, wanted, strict=True):
            # Writes only what changed: each change recompiles shaders and calls handlers again.
            if not shared_group.same(old, new):
                shared_group.write(socket, new)
    lamps = _listed(survey, chosen)
    memory.scene, memory.survey = scene.session_uid, survey
    memory.lamps, memory.budget = lamps, budget
    return lamps


def current_scene():
    """The scene that the shared group follows: that of the first window."""
    windows = bpy.context.window_manager.windows if bpy.context.window_manager else ()
    return windows[0].scene if len(windows) else bpy.context.scene


def _depsgraph(scene):
    """The evaluated scene, up to date."""
    layer = scene.view_layers[0]
    for window in bpy.context.window_manager.windows if bpy.context.window_manager else ():
        if window.scene == scene:
            layer = window.view_layer
            break
    # With a window the scene is up to date, and during a render the viewport may be using it.
    if bpy.app.background or layer.depsgraph is None:
        layer.update()
    return layer.depsgraph


def ensure_group():
    """The shared group; if the file has none, or somebody has deleted nodes of it, it is made and
    filled from the window's scene."""
    group = shared_group.find()
    if group is not None and shared_group.is_whole(group):
        return group
    group = group or shared_group.make()
    if scene := current_scene():
        _fill(scene, depsgraph=_depsgraph(scene))
    return group


def room_needed():
    """The slots.Room that nodes need for the lamps of the shared group."""
    return shared_group.room(ensure_group())


def quietly(scene, depsgraph=None, **options):
    """_fill() with `busy` set, so that the handlers it triggers do nothing."""
    if memory.busy:
        return []
    memory.busy = True
    try:
        return _fill(scene, depsgraph or _depsgraph(scene), **options)
    finally:
        memory.busy = False


def follow():
    """Updates the shared group, if the file has one, from the window's scene."""
    if shared_group.find() is not None and (scene := current_scene()):
        quietly(scene)


def refresh(scene):
    """Fills the slots of the shared group from a scene, and examines environment images anew.
    Returns every lamp of the scene as a slots.Lamp; those with a slot come first, then the
    brightest."""
    kinds.forget()
    return quietly(scene, keep=False)


def last_found(scene, group=None):
    """[slots.Lamp] of the last survey of a scene, for panels, which must not change anything.
    `group`: a shared group of another file, for materials that are linked from there."""
    surveyed = memory.scene == scene.session_uid
    if surveyed and group is None:
        return memory.lamps
    survey = memory.survey if surveyed else _survey(scene, scene.view_layers[0].depsgraph)
    worth = _worth_aiming(survey)
    if group is None:
        return _listed(survey, _arranged(worth[: budget_of_file().lamps()], []))
    there = [slots.decoded(numbers) for numbers in _by_slot(shared_group.written(group))]
    chosen = [c for c in worth if any(slots.is_same_lamp(c.values, slot) for slot in there)]
    return _listed(survey, chosen, slots.elsewhere(group.library))


def not_followed(scene, found):
    """The lamps of a scene that its pictures show without noise, but not a viewport beside the
    first window, if that has another scene. `found`: last_found() of the scene."""
    if scene == current_scene():
        return []
    there = {lamp.name for lamp in memory.lamps if lamp.slot is not None}
    return [lamp for lamp in found if lamp.slot is not None and lamp.name not in there]


def count():
    """The number of lamps to aim at, in the scene of the open file with the most."""
    surveys = [_survey(scene, _depsgraph(scene)) for scene in bpy.data.scenes]
    return max(len(_worth_aiming(survey)) for survey in surveys)
