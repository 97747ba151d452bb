# SPDX-License-Identifier: GPL-3.0-or-later
"""How forms that aim at lamps know about them: the shared node group and its updates."""

import math
import os
import subprocess
import sys
from importlib import import_module

import bpy
import helpers
import numpy as np
import pytest
from mathutils import Matrix, Quaternion, Vector


@pytest.fixture(scope="module")
def lamps(extension):
    return import_module(f"{extension.package}.lamps")


@pytest.fixture(scope="module")
def shared_group(lamps):
    return import_module(f"{lamps.__name__}.shared_group")


@pytest.fixture(scope="module")
def scenes(lamps):
    return import_module(f"{lamps.__name__}.scenes")


@pytest.fixture(scope="module")
def handlers(lamps):
    return import_module(f"{lamps.__name__}.handlers")


@pytest.fixture(scope="module")
def aimed(extension):
    """A model with a form that aims at lamps."""
    return next(
        (model, form)
        for model, entry in extension.api.models().items()
        for form, made in entry["representations"].items()
        if made.get("lamps")
    )


@pytest.fixture
def ball(extension, empty, aimed):
    """A ball at the origin, with a material that aims at lamps, in the empty file."""
    return helpers.add_sphere(empty, extension.api.new_material(*aimed), segments=8)


def add_lamp(scene, kind, name=None, location=(0, 0, 4), turn=(0.3, -0.5, 0.9), **settings):
    return helpers.add_lamp(scene, kind, name or kind, location, turn, **settings)


@pytest.fixture(scope="module")
def studio(extension, tmp_path_factory):
    """A file with a ball and two lamps, one of which has a parent. A collection has both kinds."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    ball = helpers.add_sphere(scene, extension.api.new_material("ward"), segments=8)
    ball.name, ball.active_material.name = "Studio Ball", "Studio Metal"
    key, rim = (add_lamp(scene, "POINT", f"Studio {name}") for name in ("Key", "Rim"))
    rim.parent = bpy.data.objects.new("Studio Rig", None)
    scene.collection.objects.link(rim.parent)
    for name, objects in (("Alone", [ball]), ("Lit", [ball, key])):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        for one in objects:
            collection.objects.link(one)
    assert [lamp.slot for lamp in extension.api.see_lamps(scene)] == [1, 2]
    path = tmp_path_factory.mktemp("studio") / "studio.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.mark.many
@pytest.mark.parametrize("osl", [False, True])
@pytest.mark.parametrize(
    ("kind", "name", "wanted"),
    [
        ("Material", "Studio Metal", []),
        ("Object", "Studio Ball", ["Studio Ball"]),
        ("Object", "Studio Key", ["Studio Key"]),
        ("Collection", "Alone", ["Studio Ball"]),
        ("Collection", "Lit", ["Studio Ball", "Studio Key"]),
    ],
)
def test_what_is_appended_brings_no_lamps_but_those_asked_for(
    extension, studio, empty, kind, name, wanted, osl
):
    empty.cycles.shading_system = osl
    own = add_lamp(empty, "POINT", "Own")
    helpers.add_sphere(empty, extension.api.new_material("ward"), segments=8)
    had, lights = set(bpy.data.objects), len(bpy.data.lights)
    for _ in range(2):
        bpy.ops.wm.append(directory=f"{studio}/{kind}/", filename=name)
    found = [block.name.split(".")[0] for block in bpy.data.objects if block not in had]
    assert sorted(found) == sorted(2 * wanted)
    keys = 2 * wanted.count("Studio Key")
    assert len(bpy.data.lights) == lights + keys
    aimed_at = [lamp for lamp in extension.api.see_lamps(empty) if lamp.slot]
    assert len(aimed_at) == 1 + keys and own.name in [lamp.name for lamp in aimed_at]


@pytest.mark.parametrize("elsewhere", [False, True], ids=["same file", "other file"])
@pytest.mark.parametrize(
    "copied", [["Studio Ball"], ["Studio Ball", "Studio Rim"], ["Studio Key"]], ids=" ".join
)
def test_what_is_pasted_brings_no_lamps_but_those_that_were_copied(
    extension, studio, copied, elsewhere
):
    """Blender pastes all that the copied objects depend on, so each paste added all lamps of the
    list, which shone."""
    bpy.ops.wm.open_mainfile(filepath=str(studio))
    for item in bpy.context.scene.objects:
        item.select_set(item.name in copied)
    bpy.ops.view3d.copybuffer()
    if elsewhere:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        extension.api.new_material("phong")
    had = set(bpy.data.objects)
    for _ in range(2):
        bpy.ops.view3d.pastebuffer()
    wanted = copied + ["Studio Rig"] * ("Studio Rim" in copied)
    found = [item.name.split(".")[0] for item in bpy.data.objects if item not in had]
    assert sorted(found) == sorted(2 * wanted)
    listed = {lamp.name for lamp in extension.api.see_lamps(bpy.context.scene) if lamp.slot}
    assert listed == {item.name for item in bpy.context.scene.objects if item.type == "LIGHT"}


def test_a_copy_buffer_of_another_layout_counts_as_copied_whole(extension, tmp_path):
    copy_buffer = import_module(f"{extension.package}.common.copy_buffer")
    path = tmp_path / copy_buffer.NAME
    for data in (b"", b"BLENDER-v405GLOB", b"BLENDER17-01v0502DNA1" + 80 * b"\xff", b"\x1f\x8b..."):
        path.write_bytes(data)
        with pytest.raises(ValueError):
            copy_buffer.copied_objects(path)


@pytest.mark.parametrize("own", [[], ["Studio Key"]], ids=["empty", "namesake"])
def test_make_local_brings_no_lamps(extension, studio, empty, own):
    """Blender's Make Local > All puts objects into the scene that only lists of lamps read."""
    for name in own:
        add_lamp(empty, "POINT", name)
    with bpy.data.libraries.load(str(studio), link=True) as (_, to):
        to.objects = ["Studio Ball"]
    (ball,) = to.objects
    empty.collection.objects.link(ball)
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = ball
    ball.select_set(True)
    bpy.ops.object.make_local(type="ALL")
    bpy.context.view_layer.update()
    assert sorted(item.name for item in empty.objects) == ["Studio Ball", *own]
    assert bpy.context.object.active_material.library is None
    assert [lamp.name for lamp in extension.api.see_lamps(empty) if lamp.slot] == own


def _link_metal(studio):
    bpy.ops.wm.link(directory=f"{studio}/Material/", filename="Studio Metal")
    ball = helpers.add_sphere(bpy.context.scene, bpy.data.materials["Studio Metal"], segments=8)
    bpy.context.view_layer.update()
    return ball


def _names(scene):
    return sorted(item.name for item in scene.objects)


def test_where_a_material_is_linked_own_objects_stay(extension, studio, empty):
    """Objects of the names of the linked file's lamps, and of what these depend on, left the scene
    when they were added, duplicated or brought back by undo."""
    _link_metal(studio)
    names = ["Studio Key", "Studio Rim", "Studio Rig"]
    made = [add_lamp(empty, "POINT", name) for name in names[:2]]
    made.append(bpy.data.objects.new("Studio Rig", None))
    empty.collection.objects.link(made[2])
    bpy.context.view_layer.update()
    copies = [one.copy() for one in made]
    for one in copies:
        empty.collection.objects.link(one)
    bpy.context.view_layer.update()
    assert all(one.users_collection for one in made + copies)
    bpy.ops.ed.undo_push(message="objects")
    bpy.data.batch_remove(made + copies)
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="none")
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    found = [name.split(".")[0] for name in _names(bpy.context.scene) if name.startswith("Studio")]
    assert sorted(found) == sorted(2 * names)


@pytest.mark.parametrize("then", ["another file", "the same file", "new file"])
def test_a_file_after_one_with_a_linked_material_keeps_its_objects(
    extension, studio, tmp_path, then
):
    bpy.ops.wm.open_mainfile(filepath=str(studio))
    path = str(tmp_path / "file.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    objects = _names(bpy.context.scene)
    if then == "the same file":
        bpy.ops.wm.open_mainfile(filepath=path)
        scene = bpy.context.scene
        for item in (bpy.data.objects["Studio Ball"], bpy.data.materials["Studio Metal"]):
            item.name = f"Own {item.name}"
        _link_metal(studio)
        bpy.ops.wm.save_mainfile()
        objects = _names(scene)
    else:
        bpy.ops.wm.read_homefile(use_empty=True)
        _link_metal(studio)
    if then == "new file":
        bpy.ops.wm.read_homefile(use_empty=True)
        objects = ["Studio Key", "Studio Rim"]
        for name in objects:
            add_lamp(bpy.context.scene, "POINT", name)
    else:
        bpy.ops.wm.open_mainfile(filepath=path)
    for _ in range(2):
        bpy.context.scene.objects[objects[0]].location.x += 0.1
        bpy.context.view_layer.update()
    assert _names(bpy.context.scene) == objects


def test_other_handlers_of_imports_come_first(extension, studio, empty):
    """Those behind would meet pointers to blocks that are gone, and Blender would crash."""
    handlers, seen = bpy.app.handlers.blend_import_post, []
    before = list(handlers)

    def note(context):
        seen.append([item.id.name for item in context.import_items if item.id])

    handlers.append(note)
    try:
        for kind, name in 2 * [("Material", "Studio Metal"), ("Object", "Studio Ball")]:
            bpy.ops.wm.append(directory=f"{studio}/{kind}/", filename=name)
        assert handlers[:] == [*before[:-1], note, before[-1]]
    finally:
        handlers.remove(note)
    assert len(seen) == 4 and all("Studio Rim" in names for names in seen)
    assert handlers[:] == before
    assert not [item for item in bpy.data.objects if item.type == "LIGHT"]


def slots(scene, update=True):
    """The twelve numbers of each filled slot, as Cycles gets them from the evaluated group, without
    what codes() returns."""
    found = coded_slots(scene, update)
    for slot in found:
        slot[9] %= 8
    return found


def codes(scene):
    """[(number of cones, number of the cluster)] of the filled slots."""
    found = [int(slot[9] // 8) for slot in coded_slots(scene)]
    return [(code % 8 + 1, code // 8) for code in found]


def coded_slots(scene, update=True):
    layer = scene.view_layers[0]
    if update:
        layer.update()
        layer.update()  # after changes by handlers
    group = bpy.data.node_groups[".brdfc Lamps"].evaluated_get(layer.depsgraph)
    assert group.is_evaluated
    numbers = []
    for i in range(1, 9):
        numbers.append([])
        for part in ("LampPlace", "LampTurn", "LampScale", "LampShape"):
            numbers[-1] += [s.default_value for s in group.nodes[f"{part}{i}"].inputs]
    kinds = [n[9] for n in numbers]
    filled = next((i for i, k in enumerate(kinds) if k == 0), 8)
    assert not any(np.any(n) for n in numbers[filled:]), "empty slots hold nothing"
    return [np.array(n) for n in numbers[:filled]]


def axes(slot):
    """The lamp's axes, as columns, as the shader computes them from its quaternion."""
    quaternion = Quaternion((slot[8], *slot[3:6]))
    assert quaternion.magnitude == pytest.approx(1, abs=1e-5)
    return np.array(quaternion.to_matrix())


def expected(item):
    """(kind, a, b) of a lamp, its position, axes of unit length and scales."""
    light, matrix = item.data, np.array(item.matrix_world)
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    shape = {
        "POINT": lambda: (1, light.shadow_soft_size, 0),
        "SPOT": lambda: (1 + 0.45 * light.spot_blend, light.shadow_soft_size, light.spot_size),
        "SUN": lambda: (2, light.angle, 0),
        "AREA": lambda: (
            (3 if light.shape in {"SQUARE", "RECTANGLE"} else 4)
            + 0.499 * (1 - light.spread / math.pi),
            light.size,
            light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size,
        ),
    }[light.type]()
    return shape, matrix[:3, 3], matrix[:3, :3] / scale, scale


def assert_lamp(slot, item):
    shape, place, turn, scale = expected(item)
    assert slot[9:] == pytest.approx(shape, rel=1e-5)
    assert slot[:3] == pytest.approx(place, abs=1e-5)
    assert slot[6:8] == pytest.approx(scale[:2], rel=1e-4)
    found = axes(slot)
    assert found[:, 2] == pytest.approx(turn[:, 2], abs=1e-4), "it shines along -z"
    # A rectangle rotated by 180 degrees is the same.
    for axis in (0, 1):
        assert abs(found[:, axis] @ turn[:, axis]) == pytest.approx(1, abs=1e-4)


def assert_lamps(found, items):
    assert len(found) == len(items)
    for item in items:
        place = np.array(item.matrix_world.translation)
        near = [s for s in found if np.allclose(s[:3], place, atol=1e-4)]
        assert near, f"no slot holds {item.name}"
        assert_lamp(near[0], item)


def test_model_groups_are_fed_by_the_one_group(extension, ball, aimed):
    model, form = aimed
    others = [m for m, e in extension.api.models().items() if form in e["representations"]]
    extension.api.new_material(others[-1], form)
    (shared,) = [g for g in bpy.data.node_groups if g.name.startswith(".brdfc Lamps")]
    count = extension.pack.model(aimed[0]).forms[aimed[1]].entry["lamps"]
    node = extension.model_nodes.group_nodes(ball.active_material)[0]
    script = next(n for n in node.node_tree.nodes if n.bl_idname == "ShaderNodeScript")
    fed = {s.identifier: s.links[0] for s in script.inputs if s.identifier.startswith("Lamp")}
    assert len(fed) == 4 * count
    for name, link in fed.items():
        assert link.from_node.node_tree == shared and link.from_socket.name == name
    assert not extension.nodes.script_problem(node.node_tree)
    assert slots(bpy.context.scene) == []
    # The group is removed with its last user.
    for material in list(bpy.data.materials):
        bpy.data.materials.remove(material)
    extension.nodes.remove_unused_groups()
    assert helpers.counts() == dict.fromkeys(helpers.counts(), 0)


LAMPS = {
    "point": ("POINT", {"shadow_soft_size": 0.25}),
    "spot": ("SPOT", {"shadow_soft_size": 0.0, "spot_size": 0.5, "spot_blend": 1.0}),
    "sun": ("SUN", {"angle": 0.03}),
    "square": ("AREA", {"shape": "SQUARE", "size": 0.5, "size_y": 3.0}),
    "rectangle": ("AREA", {"shape": "RECTANGLE", "size": 0.5, "size_y": 2.0}),
    "disk": ("AREA", {"shape": "DISK", "size": 0.5, "size_y": 3.0}),
    "ellipse": ("AREA", {"shape": "ELLIPSE", "size": 0.5, "size_y": 2.0, "spread": 0.1}),
}


def test_every_type_of_lamp(ball, empty, subtests):
    for name, (kind, settings) in LAMPS.items():
        with subtests.test(name):
            lamp = add_lamp(empty, kind, location=(1, 2, 3), **settings)
            for scale in ((1, 1, 1), (2, 0.5, 3), (-2, 0.5, 1), (-1, -1, -1)):
                lamp.scale = scale
                (slot,) = slots(empty)
                assert_lamp(slot, lamp)
            bpy.data.objects.remove(lamp)
            assert slots(empty) == []


def test_cones_of_flat_lamps(extension, ball, empty, monkeypatch):
    """Each may have four, or as many as a material's closures have room for."""
    lamp = add_lamp(empty, "AREA", shape="RECTANGLE", size=1.0, size_y=0.1)
    assert codes(empty) == [(4, 0)]
    (slot,) = slots(empty)
    assert_lamp(slot, lamp)
    lamp.data.shape = "ELLIPSE"
    assert codes(empty) == [(4, 0)]
    lamp.data.shape = "RECTANGLE"
    faint = add_lamp(empty, "AREA", "Faint", (5, 0, 9), shape="RECTANGLE", size=1.0, size_y=0.1)
    faint.data.energy = 0.01
    filling = import_module(f"{extension.package}.lamps.filling")
    budget = import_module(f"{extension.package}.lamps.slots").Budget
    monkeypatch.setattr(filling, "budget_of_file", lambda: budget(5))
    extension.api.see_lamps(empty)
    assert sorted(codes(empty)) == [(1, 0), (4, 0)]
    # Shaders of another version would take these numbers for other kinds of lamps.
    update = import_module(f"{extension.package}.groups.update")
    monkeypatch.setattr(update, "others", lambda: [(None, None)])
    extension.api.see_lamps(empty)
    assert codes(empty) == [(1, 0), (1, 0)]


@pytest.mark.parametrize("left", [(0, 100.0), (9, 12.5), (9, 0.0), (9, -13.0), (-1, 100.0)])
def test_a_model_that_leaves_no_room_gets_no_lamp(extension, ball, empty, monkeypatch, left):
    """Neither all but the faintest lamp nor an error, for which it takes more than nine lamps."""
    for index in range(11):
        add_lamp(empty, "POINT", f"{index}", (index, 0, 4))
    filling = import_module(f"{extension.package}.lamps.filling")
    budget = import_module(f"{extension.package}.lamps.slots").Budget(*left)
    monkeypatch.setattr(filling, "budget_of_file", lambda: budget)
    found = extension.api.see_lamps(empty)
    assert [lamp.slot for lamp in found] == [None] * 11 and slots(empty) == []
    filling.memory.scene = None  # as for a scene that has not been surveyed
    assert [lamp.slot for lamp in filling.last_found(empty)] == [None] * 11


def test_lamps_that_never_overlap(extension, ball, empty):
    """Panes of a window have one number, lamps that can hide each other have none."""

    def clusters():
        return sorted(cluster for _, cluster in codes(empty))

    panes = [
        add_lamp(empty, "AREA", f"Pane {i}", (i % 2, i // 2, 3), (0, 0, 0), shape="SQUARE", size=1)
        for i in range(4)
    ]
    assert clusters() == [1] * 4
    panes[3].location.z = 3.1
    assert clusters() == [0, 1, 1, 1]
    panes[3].location.z = 3
    extension.api.see_lamps(empty)  # as before a render
    assert clusters() == [1] * 4
    panes[3].location.x = 0.9  # it overlaps Pane 2
    assert clusters() == [0, 1, 1, 1]
    panes[3].location.x = 5
    panes[3].rotation_euler = (math.pi, 0, 0)  # nothing is lit by it and by the others
    assert clusters() == [1] * 4
    panes[3].location = (0, 0, 6)  # it shines on the backs of the others
    assert clusters() == [0, 1, 1, 1]
    for pane in panes[1:]:
        bpy.data.objects.remove(pane)
    assert clusters() == [0]
    disk = add_lamp(empty, "AREA", "Disk", (1.1, 0.2, 3), (0, 0, 1), shape="DISK", size=0.5)
    assert clusters() == [1, 1]
    # Without the extension nobody would see that it has moved over the other.
    disk.keyframe_insert("location", frame=1)
    extension.api.see_lamps(empty)
    assert clusters() == [0, 0]


def test_softboxes_around_a_subject_never_overlap(extension, ball, empty):
    """Each is in front of the plane of every other one, although circles around them overlap."""
    for angle in np.radians(range(-80, 81, 40)):
        add_lamp(
            empty, "AREA", f"At {angle:.1f}", (4 * np.sin(angle), -4 * np.cos(angle), 0),
            (math.pi / 2, 0, angle), shape="SQUARE", size=2.6,
        )  # fmt: skip
    assert [cluster for _, cluster in codes(empty)] == [1] * 5
    # A point may see this one through one of the others.
    behind = add_lamp(empty, "AREA", "Behind", (0, -9, 0), (math.pi / 2, 0, 0), size=2.6)
    assert sorted(cluster for _, cluster in codes(empty)) == [0] + [1] * 5
    behind.location.y = 9
    behind.rotation_euler.z = math.pi
    assert [cluster for _, cluster in codes(empty)] == [1] * 6


def test_quaternions_are_of_one_sign(ball, empty):
    """Blender computes the four numbers separately."""
    random = np.random.default_rng(1)
    lamp = add_lamp(empty, "SUN")
    for _ in range(40):
        lamp.rotation_euler = random.uniform(-7, 7, 3)
        lamp.scale = random.choice([-1, 1], 3) * random.uniform(0.2, 3, 3)
        assert_lamp(slots(empty)[0], lamp)


def test_parents_and_constraints(ball, empty):
    parent = bpy.data.objects.new("Parent", None)
    empty.collection.objects.link(parent)
    parent.location, parent.rotation_euler, parent.scale = (1, 2, 3), (1, 0.2, 0.4), (2, 2, 2)
    child = add_lamp(empty, "AREA", "Child", shape="RECTANGLE", size=0.5, size_y=2)
    child.parent = parent
    tracked = add_lamp(empty, "SPOT", "Tracked", location=(-3, 1, 5))
    tracked.constraints.new("TRACK_TO").target = parent
    assert_lamps(slots(empty), [child, tracked])
    # A stretched parent shears the child; the direction of its light is kept.
    parent.scale = (3, 1, 1)
    found = slots(empty)
    oblique = next(s for s in found if s[9] == 3)
    direction = child.matrix_world.col[2].to_3d().normalized()
    assert axes(oblique)[:, 2] == pytest.approx(direction, abs=1e-4)
    parent.scale = (1, 1, 1)
    assert_lamps(slots(empty), [child, tracked])


def animate(lamp):
    for frame, place, turn, radius in ((1, (0, 0, 4), 0.0, 0.1), (11, (2, -1, 5), 1.0, 0.6)):
        lamp.location, lamp.rotation_euler.x = place, turn
        lamp.data.shadow_soft_size = radius
        lamp.keyframe_insert("location", frame=frame)
        lamp.keyframe_insert("rotation_euler", frame=frame)
        lamp.data.keyframe_insert("shadow_soft_size", frame=frame)


def test_animation_renaming_and_removing(ball, empty):
    lamp, other = (
        add_lamp(empty, "POINT", "Key"),
        add_lamp(empty, "SUN", "Fill", location=(1, 1, 1)),
    )
    animate(lamp)
    seen = set()
    for frame in (1, 6, 11):
        empty.frame_set(frame)
        found = slots(empty, update=False)
        assert_lamps(found, [lamp, other])
        seen.add(round(float(next(s for s in found if s[9] == 1)[10]), 4))
    assert len(seen) == 3
    lamp.name, lamp.data.name, other.name = "Renamed", "Too", "Key"
    assert_lamps(slots(empty), [lamp, other])
    bpy.data.objects.remove(lamp)
    assert_lamps(slots(empty), [other])
    add_lamp(empty, "POINT", "New", location=(3, 0, 0))
    assert len(slots(empty)) == 2
    other.hide_render = True
    assert len(slots(empty)) == 1
    other.hide_render = False
    other.data.energy = 0
    assert len(slots(empty)) == 1
    other.data.energy = 1
    assert len(slots(empty)) == 2
    collection = bpy.data.collections.new("Hidden")
    empty.collection.children.link(collection)
    empty.collection.objects.unlink(other)
    collection.objects.link(other)
    assert len(slots(empty)) == 2
    collection.hide_render = True
    assert len(slots(empty)) == 1


def test_a_lamp_that_animation_hides_has_an_empty_slot(ball, empty):
    """At its place another lamp may shine in its stead, which it must not make noisy. Drivers do
    this, so that a farm without the extension renders the same."""
    pair = [add_lamp(empty, "AREA", name, size=1.0) for name in ("Day", "Night")]
    pair += [add_lamp(empty, "SPOT", name, location=(3, 0, 0)) for name in ("Dusk", "Dawn")]
    for i, lamp in enumerate(pair):
        for frame in (1, 11):
            lamp.hide_render = (frame == 11) == (i % 2 == 0)
            lamp.keyframe_insert("hide_render", frame=frame)

    def kinds():
        group = bpy.data.node_groups[".brdfc Lamps"]
        group = group.evaluated_get(empty.view_layers[0].depsgraph)
        codes = [group.nodes[f"LampShape{i}"].inputs[0].default_value for i in range(1, 9)]
        return [int(code % 8) for code in codes]

    for _ in range(2):
        empty.view_layers[0].update()
    found = []
    for frame in (1, 11, 1):
        empty.frame_set(frame)
        found.append(kinds())
        assert sorted(found[-1]) == [0] * 6 + [1, 3]
    assert found[0] == found[2] != found[1]


def test_lamps_that_are_rendered_in_a_frame_get_slots_before_others(ball, empty, extension):
    """Of more lamps than slots, those that the frame shows; hidden ones lose no light."""
    lamps = [add_lamp(empty, "POINT", f"L{i:02}", location=(i, 0, 4)) for i in range(12)]
    for i, lamp in enumerate(lamps):
        lamp.data.shadow_soft_size = 0.0
        lamp.data.energy = 100.0 * (12 - i)
        for frame in range(1, 7):
            lamp.hide_render = i // 2 != frame - 1
            lamp.keyframe_insert("hide_render", frame=frame)
    for frame in (1, 6, 3):
        empty.frame_set(frame)
        listed = extension.api.see_lamps(empty)
        brightest = {lamp.name for lamp in listed[:2] if lamp.slot}
        assert brightest == {f"L{2 * frame - 2:02}", f"L{2 * frame - 1:02}"}
        codes = {finding.code for finding in extension.api.warnings(ball.active_material, empty)}
        assert "lost_lamps" not in codes


def test_undo(ball, empty):
    add_lamp(empty, "POINT", "Key")
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="one")
    add_lamp(empty, "SUN", "Fill", location=(1, 1, 1))
    assert len(slots(empty)) == 2
    bpy.ops.ed.undo_push(message="two")
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert [o.name for o in scene.objects if o.type == "LIGHT"] == ["Key"]
    assert_lamps(slots(scene), [bpy.data.objects["Key"]])
    bpy.ops.ed.redo()
    scene = bpy.context.scene
    assert_lamps(slots(scene), [o for o in scene.objects if o.type == "LIGHT"])
    assert len(slots(scene)) == 2


def test_two_scenes(lamps, shared_group, ball, empty, extension):
    here = add_lamp(empty, "POINT", "Here")
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(ball)
    there = [add_lamp(other, "POINT", "There"), add_lamp(other, "SUN", "Sun", location=(5, 5, 5))]
    assert_lamps(slots(empty), [here])
    other.view_layers[0].update()
    assert_lamps(slots(empty), [here])
    window = bpy.context.window
    window.scene = other
    assert_lamps(slots(other), there)
    window.scene = empty
    assert_lamps(slots(empty), [here])
    # A picture of a scene that no window shows uses that scene's lamps.
    met = []

    def note(scene, *_):
        met.append((scene.name, len([s for s in written() if s[9] != 0])))

    def written():
        values = shared_group.written(lamps.find_group())
        return [values[12 * i : 12 * i + 12] for i in range(8)]

    bpy.app.handlers.render_pre.append(note)
    try:
        other.render.engine = "CYCLES"
        other.cycles.samples = 1
        other.render.resolution_x = other.render.resolution_y = 8
        helpers.add_camera(other)
        helpers.render(other)
    finally:
        bpy.app.handlers.render_pre.remove(note)
    assert met == [("Other", 2)]
    assert_lamps(slots(empty), [here])


def test_the_panel_says_that_another_window_has_other_lamps(extension, ball, empty):
    """Pictures of its scene are right, and the panel said that the viewport is, too."""
    add_lamp(empty, "POINT", "Here")
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(ball)
    there = add_lamp(other, "POINT", "There")
    slots(empty)

    def said(scene):
        scene.view_layers[0].update()
        layout = helpers.Layout()
        extension.ui.draw_lamps(layout, ball.active_material, scene)
        return " ".join(layout.log)

    sentence = f"The viewport uses the lamps of {empty.name}, the scene of the first window, so "
    assert "Free of noise under Here" in said(empty) and sentence not in said(empty)
    assert "Free of noise under There" in said(other)
    assert f"{sentence}There may be noisy or missing there; pictures are right" in said(other)
    empty.collection.objects.link(there)
    slots(empty)
    assert "Free of noise under There" in said(other) and sentence not in said(other)


def test_copies_of_the_group_give_way(extension, shared_group, ball, empty, aimed, tmp_path):
    lamp = add_lamp(empty, "POINT", "Key")
    name = ball.active_material.name
    bpy.context.view_layer.update()
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    # Appended to a file that already has such a group.
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    own = extension.api.new_material(*aimed)
    lamp = add_lamp(scene, "SUN", "Own")
    with bpy.data.libraries.load(str(path)) as (_, to):
        to.materials = [name]
    helpers.add_sphere(scene, to.materials[0], segments=8)
    helpers.add_sphere(scene, own, segments=8)
    assert_lamps(slots(scene), [lamp])
    (group,) = [g for g in bpy.data.node_groups if shared_group.TAG in g]
    for material in (own, to.materials[0]):
        (node,) = extension.model_nodes.group_nodes(material)
        inner = [n for n in node.node_tree.nodes if n.bl_idname == "ShaderNodeGroup"]
        (inner,) = [n for n in inner if shared_group.TAG in n.node_tree]
        assert inner.node_tree == group
    inner.node_tree = group.copy()
    lamp.data.angle = 0.5
    assert_lamps(slots(scene), [lamp])
    assert len([g for g in bpy.data.node_groups if shared_group.TAG in g]) == 1


def test_linked_lamps(extension, empty, aimed, tmp_path):
    add_lamp(empty, "POINT", "Key", location=(1, 2, 3))
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    with bpy.data.libraries.load(str(path), link=True) as (_, to):
        to.objects = ["Key"]
    scene.collection.objects.link(to.objects[0])
    helpers.add_sphere(scene, extension.api.new_material(*aimed), segments=8)
    assert_lamps(slots(scene), [to.objects[0]])


REOPENED = """
import sys, os, bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not any("brdfc" in key for key in bpy.context.preferences.addons.keys())
assert not bpy.app.autoexec_fail
scene = bpy.context.scene
bpy.data.objects["Sun"].rotation_euler.y += 0.4
bpy.data.objects["Area"].data.size = 1.5
scene.frame_set(6)
layer = bpy.context.view_layer
layer.update()
group = bpy.data.node_groups[".brdfc Lamps"].evaluated_get(layer.depsgraph)
for lamp in ("Key", "Sun", "Area"):
    item = bpy.data.objects[lamp]
    light, matrix = item.data, item.matrix_world
    print("LAMP", lamp, *matrix.translation, *matrix.col[2][:3])
for i in (1, 2, 3):
    values = [s.default_value for part in ("Place", "Turn", "Scale", "Shape")
              for s in group.nodes[f"Lamp{part}{i}"].inputs]
    print("SLOT", *values)
sys.stdout.flush()
os._exit(0)
"""


def test_a_file_needs_no_extension(ball, empty, tmp_path):
    """In a separate process with Blender's factory settings, where scripts in files may not run."""
    animate(add_lamp(empty, "POINT", "Key"))
    add_lamp(empty, "SUN", "Sun", location=(1, 0, 7))
    add_lamp(empty, "AREA", "Area", location=(3, 3, 3), size=0.5)
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    script = tmp_path / "reopened.py"
    script.write_text(REOPENED)
    done = subprocess.run(
        [sys.executable, str(script), str(path)],
        capture_output=True,
        text=True,
        env={"BLENDER_USER_RESOURCES": str(tmp_path), "PATH": "/usr/bin:/bin"},
    )
    lines = [line.split() for line in done.stdout.splitlines()]
    found = [np.array(line[1:], float) for line in lines if line and line[0] == "SLOT"]
    items = {line[1]: np.array(line[2:], float) for line in lines if line and line[0] == "LAMP"}
    assert len(items) == 3, done.stdout + done.stderr
    shapes = {"Key": (1, 0.35, 0), "Sun": (2, None, 0), "Area": (3, 1.5, 1.5)}
    for name, numbers in items.items():
        (slot,) = [s for s in found if s[:3] == pytest.approx(numbers[:3], abs=1e-4)]
        assert axes(slot)[:, 2] == pytest.approx(numbers[3:], abs=1e-4)
        shape = slot[9] % 8  # the rest says how many cones it may have: slots.coded()
        for got, want in zip((shape, *slot[10:]), shapes[name], strict=True):
            assert want is None or got == pytest.approx(want, rel=1e-4)


def test_more_lamps_than_slots(extension, ball, empty):
    for i in range(11):
        place = (4 * math.cos(i), 4 * math.sin(i), 3)
        add_lamp(empty, "POINT", f"Lamp{i}", location=place, energy=10 * (i + 1))
    found = extension.api.see_lamps(empty)
    assert [lamp.slot for lamp in found] == [*range(1, 9), None, None, None]
    assert [lamp.name for lamp in found] == [f"Lamp{i}" for i in range(10, -1, -1)]
    assert found[0].irradiance > found[7].irradiance > found[8].irradiance > 0
    assert "fainter" in found[8].why and not found[7].why
    assert_lamps(slots(empty), [bpy.data.objects[f"Lamp{i}"] for i in range(3, 11)])
    # A lamp that becomes bright takes the slot of the faintest; the others keep theirs.
    before = slots(empty)
    bpy.data.objects["Lamp0"].data.energy = 1000
    after = slots(empty)
    kept = [np.array_equal(a, b) for a, b in zip(before, after, strict=True)]
    assert kept == [True] * 7 + [False]
    assert_lamp(after[7], bpy.data.objects["Lamp0"])
    # What counts is the irradiance where the camera looks.
    far = add_lamp(empty, "POINT", "Far", location=(0, 0, 500), energy=5000)
    assert all(not np.allclose(s[:3], far.location) for s in slots(empty))
    lines = helpers.Layout()
    extension.ui.draw_lamps(lines, ball.active_material, empty)
    text = " ".join(lines.log)
    assert "Free of noise under" in text and "Far" not in text
    assert "operator brdfc.find_lamps" in text
    assert bpy.ops.brdfc.find_lamps() == {"FINISHED"}
    assert_lamp(slots(empty)[0], bpy.data.objects["Lamp0"])


def test_lamps_of_one_name_are_said_once_with_their_count(extension, ball, empty):
    mesh = bpy.data.meshes.new("bulbs")
    mesh.from_pydata([(x, -3, 3) for x in range(12)], [], [])
    bulbs = bpy.data.objects.new("bulbs", mesh)
    empty.collection.objects.link(bulbs)
    bulbs.instance_type = "VERTS"
    bulb = add_lamp(empty, "POINT", "bulb", location=(0, 0, 0), energy=100)
    bulb.parent = bulbs
    add_lamp(empty, "POINT", "alone", location=(0, -2, 3), energy=200)
    slots(empty)
    lines = helpers.Layout()
    extension.ui.draw_lamps(lines, ball.active_material, empty)
    text = " ".join(lines.log)
    assert "alone" in text and " x bulbs/bulb" in text
    assert text.count("bulbs/bulb") == 1
    found = extension.checks.warnings(ball.active_material, empty)
    said = [f.message for f in found if f.code == "lost_lamps"]
    assert said and all(sentence.count("bulbs/bulb") == 1 for sentence in said)


def test_copies_of_collections(ball, empty):
    collection = bpy.data.collections.new("Lamps")
    lamp = add_lamp(empty, "AREA", "Inner", location=(1, 0, 0), shape="RECTANGLE", size=0.5)
    empty.collection.objects.unlink(lamp)
    collection.objects.link(lamp)
    collection.instance_offset = (0, 0, 1)
    places = []
    for i in range(2):
        item = bpy.data.objects.new(f"Copy{i}", None)
        item.instance_type, item.instance_collection = "COLLECTION", collection
        item.location, item.rotation_euler.x = (3 * i, 2, 4), i * 0.5
        item.keyframe_insert("location", frame=1)
        item.location.z += 2
        item.keyframe_insert("location", frame=11)
        empty.collection.objects.link(item)
        places.append(item)
    own = lamp.matrix_basis.copy()

    def check(found):
        assert len(found) == 2
        for item in places:
            matrix = item.matrix_world @ Matrix.Translation((0, 0, -1)) @ own
            (slot,) = [s for s in found if np.allclose(s[:3], matrix.translation, atol=1e-4)]
            assert slot[9:11] == pytest.approx((3, 0.5))
            direction = matrix.col[2].to_3d().normalized()
            assert axes(slot)[:, 2] == pytest.approx(direction, abs=1e-4)

    for frame in (1, 6, 11):
        empty.frame_set(frame)
        check(slots(empty, update=False))
    places[0].animation_data_clear()
    places[0].location.x = 7
    check(slots(empty))


def sky(scene, **settings):
    tree, background = helpers.add_world(scene)
    node = tree.nodes.new("ShaderNodeTexSky")
    if bpy.app.version < (5, 0, 0):
        node.sky_type = "NISHITA"
    for key, value in settings.items():
        setattr(node, key, value)
    tree.links.new(node.outputs["Color"], background.inputs["Color"])
    return node


def test_sun_of_a_sky(ball, empty):
    node = sky(empty, sun_elevation=0.4, sun_rotation=1.2, sun_size=0.02)
    assert slots(empty) == [pytest.approx([0, 0, 0, 0.4, 1.2, 0, 1, 1, 1, 5, 0.02, 0])]
    node.sun_elevation, node.name = 0.7, 'A "name" of its own'
    assert slots(empty)[0][3] == pytest.approx(0.7)
    node.sun_rotation = 0.1
    assert slots(empty)[0][4] == pytest.approx(0.1)
    for frame, elevation in ((1, 0.7), (11, 0.9)):
        node.sun_elevation = elevation
        node.keyframe_insert("sun_elevation", frame=frame)
    for frame, elevation in ((1, 0.7), (6, 0.8), (11, 0.9)):
        empty.frame_set(frame)
        assert slots(empty, update=False)[0][3] == pytest.approx(elevation)
    node.sun_disc = False
    assert slots(empty) == []
    node.sun_disc = True
    assert len(slots(empty)) == 1
    node.sky_type = "PREETHAM"
    assert slots(empty) == []


def environment(scene, pixels):
    height, width, _ = pixels.shape
    image = bpy.data.images.new("sky", width, height, float_buffer=True)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.update()
    tree, background = helpers.add_world(scene)
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    tree.links.new(node.outputs["Color"], background.inputs["Color"])
    return tree, background, node


def spotted(direction, half_angle, radiance, width=512):
    """A dim picture with a bright disk in a direction, and the directions of its pixels."""
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(width // 2) + 0.5) * 2 / width)
    phi, theta = (0.5 - u) * 2 * np.pi, (v - 0.5) * np.pi
    to = [np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)]
    inside = np.stack(to, -1) @ np.array(direction) > math.cos(half_angle)
    pixels = np.ones((width // 2, width, 4))
    pixels[..., :3] = np.where(inside, radiance, 0.2)[..., None]
    return pixels


def test_bright_spots_are_found(lamps, subtests):
    find = import_module(f"{lamps.__name__}.bright_spots").find
    for direction in ((1, 0, 0), (-1, 0.001, 0.2), (0.3, -0.8, 0.5), (0, 0.1, 1), (0, 0, -1)):
        with subtests.test(direction=direction):
            to = np.array(direction) / np.linalg.norm(direction)
            pixels = spotted(to, 0.05, 5000.0)[..., 0]
            (spot,) = find(pixels)
            assert spot[0] @ to > math.cos(0.01)
            assert 0.1 <= spot[1] < 0.13
            assert spot[2] == pytest.approx(5000 * math.pi * 0.05**2, rel=0.05)
    plain = np.ones((64, 128))
    assert find(plain) == [] == find(0 * plain)
    window = spotted(np.array([1.0, 0, 0]), 0.2, 100.0)[..., 0]
    (spot,) = find(window)
    assert 0.38 <= spot[1] < 0.42
    assert find(spotted(np.array([1.0, 0, 0]), 0.3, 100.0)[..., 0]) == []  # too wide
    assert find(spotted(np.array([1.0, 0, 0]), 0.05, 3.0)[..., 0]) == []  # too little light
    # The glow around a sun is not a spot; an equally bright wall elsewhere is one.
    glow = spotted(np.array([0.0, 1, 0]), 0.02, 5e4) + spotted(np.array([0.0, 1, 0]), 0.2, 60.0)
    spots = find((glow + spotted(np.array([1.0, 0, 0]), 0.2, 60.0))[..., 0])
    assert [spot[0] @ (0, 1, 0) > 0.99 for spot in spots] == [True, False]
    assert spots[0][1] < 0.07 and spots[1][1] > 0.38
    large = spotted(np.array([0.6, 0, 0.8]), 0.01, 1e5, width=2048)[..., 0]
    (spot,) = find(large)
    assert 0.02 <= spot[1] < 0.026


def test_spot_of_an_environment_image(extension, ball, empty):
    direction = np.array([0.48, -0.6, 0.64])
    tree, background, node = environment(empty, spotted(direction, 0.03, 5000.0))
    (slot,) = slots(empty)
    assert slot[9] == 2 and 0.06 <= slot[10] < 0.09
    assert axes(slot)[:, 2] == pytest.approx(direction, abs=5e-3)
    # The spot is rotated by the inverse of the rotation that is applied to the ray's direction.
    coordinate = tree.nodes.new("ShaderNodeTexCoord")
    mapping = tree.nodes.new("ShaderNodeMapping")
    tree.links.new(coordinate.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
    rotation = mapping.inputs["Rotation"].default_value
    rotation[:] = (0.2, 0.1, 0.8)
    for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL"):
        mapping.vector_type = kind
        turn = np.array(rotation.to_matrix())
        turn = turn.T if kind == "TEXTURE" else turn
        (slot,) = slots(empty)
        assert turn @ axes(slot)[:, 2] == pytest.approx(direction, abs=5e-3)
    bright = extension.api.see_lamps(empty)[0].irradiance
    background.inputs["Strength"].default_value = 3.0
    assert extension.api.see_lamps(empty)[0].irradiance == pytest.approx(3 * bright)
    mapping.vector_type = "POINT"
    mapping.inputs["Location"].default_value = (0.3, 0, 0)
    assert slots(empty) == []
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs["Color"], node.inputs["Vector"])
    assert slots(empty) == []
    (lamp,) = extension.api.see_lamps(empty)
    assert lamp.slot is None and "vector" in lamp.why


def emissive(strength=50.0, kind="ShaderNodeEmission"):
    material = bpy.data.materials.new("Glow")
    tree = helpers.empty_tree(material)
    node, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    name = "Strength" if kind == "ShaderNodeEmission" else "Emission Strength"
    node.inputs[name].default_value = strength
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material, node.inputs[name]


def test_emission_that_varies_over_a_surface_counts_as_one(lamps, empty):
    """Only the unknown part of it: a texture times 5 is 5."""
    material, strength = emissive()
    tree = material.node_tree
    texture, times = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexVoronoi", "Math"))
    times.operation = "MULTIPLY"
    times.inputs[1].default_value = 5.0
    tree.links.new(texture.outputs["Distance"], times.inputs[0])
    tree.links.new(times.outputs[0], strength)
    level = import_module(f"{lamps.__name__}.emission").of_material
    assert level(material) == pytest.approx(5, rel=1e-5)


@pytest.mark.parametrize("kind", ["ShaderNodeEmission", "ShaderNodeBsdfPrincipled"])
def test_emissive_meshes(extension, ball, empty, kind):
    material, strength = emissive(kind=kind)
    glow = helpers.add_sphere(empty, material, segments=16)
    glow.location, glow.scale = (2, 3, 6), (0.2, 0.2, 0.2)

    def ball_at(place, radius):
        return pytest.approx([*place, 0, 0, 0, 0, 0, 1, 1, radius, 0], rel=1e-4, abs=1e-5)

    assert slots(empty) == [ball_at((2, 3, 6), 0.2)]
    glow.location.x, glow.scale = 4, (0.3, 0.3, 0.3)
    assert slots(empty) == [ball_at((4, 3, 6), 0.3)]
    strength.default_value = 0
    assert slots(empty) == []
    strength.default_value = 5
    assert len(slots(empty)) == 1
    # A ball that is not at its object's origin can't be driven, but handlers follow it.
    glow.data.transform(Matrix.Translation((1, 0, 0)))
    glow.data.update()
    glow.rotation_euler = (0, 0, math.pi / 2)
    assert slots(empty) == [ball_at((4, 3.3, 6), 0.3)]
    glow.location.z = 7
    assert slots(empty) == [ball_at((4, 3.3, 7), 0.3)]
    glow.location, glow.scale = (4, -12, 0), (12, 12, 12)
    assert slots(empty) == []
    glow.location, glow.scale = (4, 3, 7), (1.5, 0.3, 0.3)
    (lamp,) = extension.api.see_lamps(empty)
    assert lamp.slot is None and "neither flat, round nor small" in lamp.why


def emissive_plane(scene, material, points):
    mesh = bpy.data.meshes.new("Panel")
    mesh.from_pydata([(*p, 0) for p in points], [], [range(len(points))])
    mesh.materials.append(material)
    item = bpy.data.objects.new("Panel", mesh)
    scene.collection.objects.link(item)
    return item


def test_flat_meshes_are_area_lamps(extension, ball, empty):
    """As rectangles and ellipses that emit towards the subject, whatever the order of their
    points."""
    material, _ = emissive()
    panel = emissive_plane(empty, material, [(-1, -0.5), (1, -0.5), (1, 0.5), (-1, 0.5)])
    for turn, points, stretch in ((0, 0, 3), (0.4, 0, 3), (0.4, 0.7, 1)):
        panel.data.transform(Matrix.Rotation(points, 4, Vector((0.2, 0.5, 1)).normalized()))
        panel.location, panel.rotation_euler, panel.scale = (
            (1, -2, 5),
            (turn, turn, 0.3),
            (1, stretch, 1),
        )
        empty.view_layers[0].update()
        (slot,) = slots(empty)
        corners = [panel.matrix_world @ v.co for v in panel.data.vertices]
        assert slot[9] == 3 and slot[:3] == pytest.approx(sum(corners, Vector()) / 4, abs=1e-4)
        across, along, back = axes(slot).T
        half = across * slot[10] / 2, along * slot[11] / 2
        made = {
            tuple(np.round(slot[:3] + a * half[0] + b * half[1], 2))
            for a in (-1, 1)
            for b in (-1, 1)
        }
        there = {tuple(np.round(c, 2)) for c in corners}
        assert np.sort(list(made), 0) == pytest.approx(np.sort(list(there), 0), abs=0.011)
        assert back @ np.array(slot[:3]) > 0  # the ball is at the origin
    area = np.prod(slot[10:12])
    (lamp,) = extension.api.see_lamps(empty)
    distance = np.linalg.norm(slot[:3])
    facing = back @ np.array(slot[:3]) / distance
    assert lamp.irradiance == pytest.approx(50 * area * facing / distance**2, rel=1e-3)
    bpy.data.objects.remove(panel)
    angles = np.arange(24) * 2 * np.pi / 24
    emissive_plane(
        empty, material, np.stack([np.cos(angles), 2 * np.sin(angles)], -1)
    ).location.z = 6
    (slot,) = slots(empty)
    assert slot[9] == 4 and sorted(slot[10:12]) == pytest.approx([2, 4], rel=0.02)
    bpy.data.objects.remove(bpy.data.objects["Panel"])
    # Random rays meet the first of these two seldom, though it is wide.
    for size, why in ((1.0, "neither flat, round nor small"), (6.0, "so large or near")):
        corner = np.array([(0, 0), (2, 0), (2, 0.4), (0.4, 0.4), (0.4, 2), (0, 2)])
        item = emissive_plane(empty, material, [tuple(c) for c in corner * (size, size)])
        item.location.z = 6
        (lamp,) = extension.api.see_lamps(empty)
        assert lamp.slot is None and why in lamp.why
        bpy.data.objects.remove(item)
    tube = helpers.add_sphere(empty, material, segments=16)
    tube.location, tube.scale = (2, 0, 1), (0.03, 0.03, 1)
    (lamp,) = extension.api.see_lamps(empty)
    assert lamp.slot is None and "neither flat, round nor small" in lamp.why


def test_lamps_whose_light_differs_over_them(extension, ball, empty):
    """If half of a softbox is dark, a lobe would show all of it half as bright."""
    item = add_lamp(empty, "AREA", "Softbox", shape="SQUARE", size=1.0)
    item.data.use_nodes = True
    tree = item.data.node_tree
    (emission,) = (n for n in tree.nodes if n.bl_idname == "ShaderNodeEmission")
    warm = tree.nodes.new("ShaderNodeBlackbody")
    tree.links.new(warm.outputs[0], emission.inputs["Color"])
    assert [lamp.slot for lamp in extension.api.see_lamps(empty)] == [1]
    tree.links.new(
        tree.nodes.new("ShaderNodeNewGeometry").outputs["Parametric"], emission.inputs["Strength"]
    )
    (lamp,) = extension.api.see_lamps(empty)
    assert lamp.slot is None and lamp.why == "its light is not the same all over it"
    item.data.size = 0.1  # so small that it makes no difference
    assert [lamp.slot for lamp in extension.api.see_lamps(empty)] == [1]
    item.data.type = "POINT"
    bpy.data.objects.remove(item)
    material, _ = emissive()
    emissive_plane(empty, material, [(-1, -1), (1, -1), (1, 1), (-1, 1)]).location.z = 6
    assert [lamp.slot for lamp in extension.api.see_lamps(empty)] == [1]
    (emission,) = (n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeEmission")
    image = material.node_tree.nodes.new("ShaderNodeTexImage")
    material.node_tree.links.new(image.outputs[0], emission.inputs["Color"])
    assert [lamp.slot for lamp in extension.api.see_lamps(empty)] == [None]


def _mask(tree):
    """1 on half of a mesh, 0 on the other half."""
    place = tree.nodes.new("ShaderNodeTexCoord")
    step = tree.nodes.new("ShaderNodeMath")
    step.operation = "GREATER_THAN"
    tree.links.new(place.outputs["Generated"], step.inputs[0])
    return step.outputs[0]


def _mixed(tree, emission, factor):
    mix, clear = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfTransparent")
    tree.links.new(factor, mix.inputs[0])
    tree.links.new(emission.outputs[0], mix.inputs[1])
    tree.links.new(clear.outputs[0], mix.inputs[2])
    return mix.outputs[0]


def _grouped(tree, emission, factor):
    """The Emission node in a group whose strength is an input."""
    inner = bpy.data.node_groups.new("Glow", "ShaderNodeTree")
    inner.interface.new_socket("Strength", in_out="INPUT", socket_type="NodeSocketFloat")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    node, ends = inner.nodes.new("ShaderNodeEmission"), []
    for kind in ("NodeGroupInput", "NodeGroupOutput"):
        ends.append(inner.nodes.new(kind))
    inner.links.new(ends[0].outputs[0], node.inputs["Strength"])
    inner.links.new(node.outputs[0], ends[1].inputs[0])
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    tree.links.new(factor, group.inputs[0])
    return group.outputs[0]


def _principled(tree, emission, factor, socket="Alpha"):
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.inputs["Emission Strength"].default_value = 10
    tree.links.new(factor, node.inputs[socket])
    return node.outputs[0]


def _backfacing(tree, emission, factor):
    side = tree.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    return _mixed(tree, emission, side)


def _painted(tree, emission, factor):
    return _principled(tree, emission, factor, "Roughness")


@pytest.mark.parametrize(
    "shader, even",
    [
        *((shader, False) for shader in (_mixed, _grouped, _principled)),
        *((shader, True) for shader in (_backfacing, _painted)),
    ],
)
def test_what_makes_light_differ(extension, ball, empty, shader, even):
    material, strength = emissive()
    tree = material.node_tree
    surface = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial").inputs[0]
    emissive_plane(empty, material, [(-1, -1), (1, -1), (1, 1), (-1, 1)]).location.z = 6
    assert len(slots(empty)) == 1
    tree.links.new(shader(tree, strength.node, _mask(tree)), surface)
    assert len(slots(empty)) == even, "and handlers see it"


def test_parts_of_balls_and_of_planes(extension, ball, empty):
    """Their light differs from that of the whole ball or plane."""
    bright, dim = emissive()[0], emissive(5.0)[0]
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    panel = emissive_plane(empty, bright, [*square[:2], (1, 0), *square[2:], (-1, 0)])
    panel.location.z = 6
    assert len(slots(empty)) == 1
    panel.data.clear_geometry()
    corners = [(-1, -1, 0), (1, -1, 0), (1, 0, 0), (-1, 0, 0), (1, 1, 0), (-1, 1, 0)]
    panel.data.from_pydata(corners, [], [(0, 1, 2, 3), (3, 2, 4, 5)])
    panel.data.materials.append(dim)
    panel.data.polygons[1].material_index = 1
    panel.data.update()
    (lamp,) = extension.api.see_lamps(empty)
    assert lamp.slot is None and "not the same" in lamp.why
    bpy.data.objects.remove(panel)
    glow = helpers.add_sphere(empty, bright, segments=16)
    glow.location.z = 6
    assert len(slots(empty)) == 1
    glow.data.materials.append(bpy.data.materials.new("Dark"))
    for polygon in glow.data.polygons:
        polygon.material_index = int(polygon.center.x > 0)
    glow.data.update()
    (lamp,) = extension.api.see_lamps(empty)
    assert lamp.slot is None and "neither flat" in lamp.why


def test_soft_lamps_with_textures_and_scaled_spots(extension, ball, empty):
    item = add_lamp(empty, "POINT", shadow_soft_size=1.0)
    item.data.use_nodes = True
    tree = item.data.node_tree
    (emission,) = (n for n in tree.nodes if n.bl_idname == "ShaderNodeEmission")
    tree.links.new(_mask(tree), emission.inputs["Strength"])
    assert slots(empty) == []
    item.data.shadow_soft_size = 0.1
    assert len(slots(empty)) == 1
    bpy.data.objects.remove(item)
    item = add_lamp(empty, "SPOT", shadow_soft_size=0.8)
    item.scale = (2, 2, 2)
    assert len(slots(empty)) == 1
    item.scale = (0.3, 1, 1)
    assert slots(empty) == []


def test_a_fine_grid_in_edit_mode(extension, ball, empty):
    """A plane may have any number of faces, and stays a plane in Edit Mode."""
    n = 160
    mesh = bpy.data.meshes.new("Grid")
    points = [(x / n - 0.5, y / n - 0.5, 0) for y in range(n + 1) for x in range(n + 1)]
    row = n + 1
    faces = [
        (i, i + 1, i + 1 + row, i + row) for y in range(n) for i in range(y * row, y * row + n)
    ]
    mesh.from_pydata(points, [], faces)
    mesh.materials.append(emissive()[0])
    grid = bpy.data.objects.new("Grid", mesh)
    grid.location.z, grid.rotation_euler = 5, (0.2, 0.3, 0.5)
    empty.collection.objects.link(grid)
    (slot,) = slots(empty)
    assert slot[9] == 3 and slot[10:12] == pytest.approx([1, 1], abs=1e-3)
    bpy.context.view_layer.objects.active = grid
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        assert [lamp.slot for lamp in extension.api.see_lamps(empty)] == [1]
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def test_materials_of_geometry_nodes(extension, ball, empty):
    plain = bpy.data.materials.new("Plain")
    panel = emissive_plane(empty, plain, [(-1, -1), (1, -1), (1, 1), (-1, 1)])
    panel.location.z = 6
    assert slots(empty) == []
    tree = bpy.data.node_groups.new("Paint", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    paint = tree.nodes.new("GeometryNodeSetMaterial")
    paint.inputs["Material"].default_value = emissive()[0]
    tree.links.new(start.outputs[0], paint.inputs[0])
    tree.links.new(paint.outputs[0], end.inputs[0])
    panel.modifiers.new("Paint", "NODES").node_group = tree
    assert [lamp.slot for lamp in extension.api.see_lamps(empty)] == [1]


def test_lamps_that_geometry_nodes_place(extension, ball, empty):
    """The lamps are in a collection that is an input of the modifier."""
    lamps = bpy.data.collections.new("Lamps")
    data = bpy.data.lights.new("Bulb", "POINT")
    data.shadow_soft_size = 0.1
    bulb = bpy.data.objects.new("Bulb", data)
    bulb.location.z = 4
    lamps.objects.link(bulb)
    tree = bpy.data.node_groups.new("Place", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    socket = tree.interface.new_socket(
        "Collection", in_out="INPUT", socket_type="NodeSocketCollection"
    )
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    info = tree.nodes.new("GeometryNodeCollectionInfo")
    tree.links.new(start.outputs[0], info.inputs["Collection"])
    tree.links.new(info.outputs[0], end.inputs[0])
    item = bpy.data.objects.new("Fitting", bpy.data.meshes.new("Fitting"))
    empty.collection.objects.link(item)
    modifier = item.modifiers.new("Place", "NODES")
    modifier.node_group = tree
    assert slots(empty) == []
    if hasattr(modifier, "properties"):
        getattr(modifier.properties.inputs, socket.identifier).value = lamps
    else:
        modifier[socket.identifier] = lamps
    item.update_tag()
    bpy.context.view_layer.update()
    (lamp,) = extension.api.see_lamps(empty)
    assert lamp.slot == 1 and lamp.name == "Fitting/Bulb"
    assert slots(empty)[0][:3] == pytest.approx([0, 0, 4])


def square(scene, material, side=0.5):
    corners = [(-side, -side), (side, -side), (side, side), (-side, side)]
    return emissive_plane(scene, material, corners)


def in_collection(scene, item):
    """Moves the item to a collection that is itself hidden."""
    collection = bpy.data.collections.new("Copied")
    scene.collection.objects.unlink(item)
    collection.objects.link(item)
    return collection


def placing(scene, *nodes):
    """An object with geometry nodes: a point for each corner of a square of 2 m, and `nodes(tree,
    points)`, which makes the output from them."""
    tree = bpy.data.node_groups.new("Place", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    end, grid = tree.nodes.new("NodeGroupOutput"), tree.nodes.new("GeometryNodeMeshGrid")
    for name in ("Size X", "Size Y", "Vertices X", "Vertices Y"):
        grid.inputs[name].default_value = 2
    put = tree.nodes.new("GeometryNodeInstanceOnPoints")
    tree.links.new(grid.outputs["Mesh"], put.inputs["Points"])
    tree.links.new(nodes[0](tree), put.inputs["Instance"])
    tree.links.new(put.outputs[0], end.inputs[0])
    item = bpy.data.objects.new("Placing", bpy.data.meshes.new("Placing"))
    item.location.z = 5
    scene.collection.objects.link(item)
    item.modifiers.new("Place", "NODES").node_group = tree
    return item


def copies_by_collection(scene, material):
    shown = bpy.data.objects.new("Copy", None)
    shown.instance_type, shown.location = "COLLECTION", (1, 0, 5)
    shown.instance_collection = in_collection(scene, square(scene, material))
    scene.collection.objects.link(shown)
    return [(1, 0, 5)]


def copies_by_nested_collections(scene, material):
    copies_by_collection(scene, material)
    (inner,) = (o for o in scene.collection.objects if o.name == "Copy")
    shown = bpy.data.objects.new("Outer", None)
    shown.instance_type, shown.location = "COLLECTION", (0, 1, 0)
    shown.instance_collection = in_collection(scene, inner)
    scene.collection.objects.link(shown)
    return [(1, 1, 5)]


def copies_by_faces(scene, material):
    parent = emissive_plane(scene, None, [(-1, -1), (1, -1), (1, 1), (-1, 1)])
    parent.location.z, parent.instance_type = 5, "FACES"
    square(scene, material).parent = parent
    return [(0, 0, 5)]


def copies_by_vertices(scene, material):
    parent = emissive_plane(scene, None, [(-1, -1), (1, -1), (1, 1), (-1, 1)])
    parent.location.z, parent.instance_type = 5, "VERTS"
    square(scene, material, 0.1).parent = parent
    return [(x, y, 5) for x in (-1, 1) for y in (-1, 1)]


def copies_by_particles(scene, material):
    item = square(scene, material, 0.1)
    collection = in_collection(scene, item)
    scene.collection.children.link(collection)
    item.hide_viewport = False
    item.location.z = -100
    parent = emissive_plane(scene, None, [(-1, -1), (1, -1), (1, 1), (-1, 1)])
    parent.location.z = 5
    parent.modifiers.new("Hair", "PARTICLE_SYSTEM")
    settings = parent.particle_systems[0].settings
    settings.type, settings.count, settings.use_advanced_hair = "HAIR", 3, True
    settings.render_type, settings.instance_object = "OBJECT", item
    return None


def copies_by_nodes_of_an_object(scene, material):
    item = square(scene, material, 0.1)
    in_collection(scene, item)

    def info(tree):
        node = tree.nodes.new("GeometryNodeObjectInfo")
        node.inputs["Object"].default_value = item
        return node.outputs["Geometry"]

    placing(scene, info)
    return [(x, y, 5) for x in (-1, 1) for y in (-1, 1)]


def copies_by_nodes_of_what_they_make(scene, material):
    def lamp(tree):
        grid, paint = (
            tree.nodes.new(f"GeometryNode{name}") for name in ("MeshGrid", "SetMaterial")
        )
        for name, value in (("Size X", 0.2), ("Size Y", 0.2), ("Vertices X", 2), ("Vertices Y", 2)):
            grid.inputs[name].default_value = value
        paint.inputs["Material"].default_value = material
        tree.links.new(grid.outputs["Mesh"], paint.inputs[0])
        return paint.outputs[0]

    placing(scene, lamp)
    return [(x, y, 5) for x in (-1, 1) for y in (-1, 1)]


@pytest.mark.parametrize(
    "place",
    [
        copies_by_collection,
        copies_by_nested_collections,
        copies_by_faces,
        copies_by_vertices,
        copies_by_particles,
        copies_by_nodes_of_an_object,
        copies_by_nodes_of_what_they_make,
    ],
)
def test_copies_of_what_shines(extension, ball, empty, place):
    places = place(empty, emissive()[0])
    bpy.context.view_layer.update()
    found = extension.api.see_lamps(empty)
    numbers = slots(empty)
    if places is None:
        assert len(numbers) == 4, [lamp.name for lamp in found]
        assert sum(s[2] == pytest.approx(5, abs=0.1) for s in numbers) == 3
        return
    assert sorted(tuple(s[:3].round(4)) for s in numbers) == sorted(places)
    assert {s[9] for s in numbers} == {3}


def test_a_new_kind_of_lamp(extension, lamps, ball, empty, monkeypatch):
    """All of it is in one class: what it reads, its slot, its copies, and what changes it."""
    kinds, parts = (import_module(f"{lamps.__name__}.{name}") for name in ("kinds", "slots"))

    class Loud(import_module(f"{kinds.__name__}.kind").Kind):
        objects, nodes = frozenset({"SPEAKER"}), frozenset({"ShaderNodeTexMagic"})

        def candidate(self, name, values, why=""):
            far = parts.angular_size_distant(0.1)
            return parts.Candidate(name, values, lambda points: np.ones(len(points)), far, why)

        def of_object(self, item, search):
            placed = parts.placed(item, search.matrix(item).copy())
            sizes = 0.5 * item.scale.x, 0.0
            return self.candidate(item.name, parts.numbers(parts.BALL, *placed, sizes))

        def of_copy(self, instance, search):
            placed = parts.placed(None, instance.matrix_world.copy())
            values = parts.numbers(parts.BALL, *placed, (0.25, 0.0))
            return self.candidate(search.name_of(instance), values)

        def may_shine(self, item, emitting):
            return True

        def is_changed(self, update, survey, crowded):
            return update.is_updated_transform

        def of_node(self, shown, strength):
            yield self.candidate(shown.node.name, None, f"strength {strength:g}")

    item = bpy.data.objects.new("Voice", bpy.data.speakers.new("Voice"))
    item.location = (1, 2, 3)
    empty.collection.objects.link(item)
    assert slots(empty) == []
    monkeypatch.setattr(kinds, "KINDS", (*kinds.KINDS, Loud()))
    assert [(x.name, x.slot) for x in extension.api.see_lamps(empty)] == [("Voice", 1)]
    assert slots(empty)[0] == pytest.approx([1, 2, 3, 0, 0, 0, 1, 1, 1, 1, 0.5, 0])
    item.location.x, item.scale.x = 4, 1.5
    assert slots(empty)[0] == pytest.approx([4, 2, 3, 0, 0, 0, 1.5, 1, 1, 1, 0.75, 0])
    shown = bpy.data.objects.new("Copy", None)
    shown.instance_type, shown.location = "COLLECTION", (0, 0, 2)
    shown.instance_collection = in_collection(empty, item)
    empty.collection.objects.link(shown)
    bpy.context.view_layer.update()
    assert [x.name for x in extension.api.see_lamps(empty)] == ["Copy/Voice"]
    assert slots(empty)[0] == pytest.approx([4, 2, 5, 0, 0, 0, 1.5, 1, 1, 1, 0.25, 0])
    tree, background = helpers.add_world(empty, 3.0)
    magic = tree.nodes.new("ShaderNodeTexMagic")
    tree.links.new(magic.outputs["Color"], background.inputs["Color"])
    found = {x.name: (x.slot, x.why) for x in extension.api.see_lamps(empty)}
    assert found == {"Copy/Voice": (1, ""), "Magic Texture": (None, "strength 3")}


def bulb(scene, at=(0, 0, 0)):
    """A lamp that is itself hidden."""
    data = bpy.data.lights.new("Bulb", "POINT")
    data.shadow_soft_size = 0.1
    item = bpy.data.objects.new("Bulb", data)
    item.location = at
    scene.collection.objects.link(item)
    return item


def lamps_by(kind):
    """A lamp at each vertex or face of a square of 2 m."""

    def place(scene):
        parent = emissive_plane(scene, None, [(-1, -1), (1, -1), (1, 1), (-1, 1)])
        parent.location.z, parent.instance_type = 5, kind
        parent.show_instancer_for_render = False  # half of each lamp would be behind it
        bulb(scene).parent = parent
        return [(0, 0, 5)] if kind == "FACES" else [(x, y, 5) for x in (-1, 1) for y in (-1, 1)]

    return place


def lamps_by_nodes_of_an_object(scene):
    item = bulb(scene)
    in_collection(scene, item)

    def info(tree):
        node = tree.nodes.new("GeometryNodeObjectInfo")
        node.inputs["Object"].default_value = item
        node.inputs["As Instance"].default_value = True
        return node.outputs["Geometry"]

    placing(scene, info)
    return [(x, y, 5) for x in (-1, 1) for y in (-1, 1)]


def lamps_by_nodes_of_a_collection(scene):
    collection = in_collection(scene, bulb(scene))

    def info(tree):
        node = tree.nodes.new("GeometryNodeCollectionInfo")
        node.inputs["Collection"].default_value = collection
        return node.outputs[0]

    placing(scene, info)
    return [(x, y, 5) for x in (-1, 1) for y in (-1, 1)]


@pytest.mark.parametrize(
    "place",
    [
        lamps_by("VERTS"),
        lamps_by("FACES"),
        lamps_by_nodes_of_an_object,
        lamps_by_nodes_of_a_collection,
    ],
    ids=["vertices", "faces", "object", "collection"],
)
def test_copies_of_lamps(extension, ball, empty, place):
    """Their number and positions are as in Cycles: a floor looks the same under real lamps in their
    place."""
    places = place(empty)
    bpy.context.view_layer.update()
    extension.api.see_lamps(empty)
    numbers = slots(empty)
    assert sorted(tuple(s[:3].round(4)) for s in numbers) == sorted(places)
    assert {(s[9], round(float(s[10]), 4)) for s in numbers} <= {(1, 0.1)}
    copies = floor_picture(empty)
    for item in [o for o in empty.collection.all_objects if o.type in {"LIGHT", "MESH"}]:
        if item.name.startswith(("Bulb", "Panel", "Placing")):
            bpy.data.objects.remove(item)
    for at in places:
        bulb(empty, at)
    np.testing.assert_allclose(copies, floor_picture(empty), rtol=0.02)


def floor_picture(scene):
    """Light of each quarter of a diffuse floor of 4 m below the lamps, seen from above."""
    if "Floor" not in bpy.data.objects:
        floor = emissive_plane(scene, None, [(-2, -2), (2, -2), (2, 2), (-2, 2)])
        floor.name, floor.location.z = "Floor", -2
        floor.data.materials.append(helpers.node_material("ShaderNodeBsdfDiffuse"))
        bpy.data.objects["Sphere"].hide_render = True
        helpers.add_camera(scene, (0, 0, 0), (0, 0, 0), orthographic=4)
        scene.render.resolution_x = scene.render.resolution_y = 16
        scene.cycles.samples = 64
        scene.cycles.max_bounces = 0
    picture = helpers.render(scene)[..., 1]
    return [picture[y : y + 8, x : x + 8].mean() for x in (0, 8) for y in (0, 8)]


def test_many_copies_of_what_shines(extension, ball, empty):
    """The nearest ones, and one entry for all others."""
    item = square(empty, emissive()[0], 0.02)
    collection = in_collection(empty, item)
    for i in range(100):
        shown = bpy.data.objects.new(f"Copy{i:02}", None)
        shown.instance_type, shown.instance_collection = "COLLECTION", collection
        shown.location = (0.1 * i, 0, 5 + 0.1 * i)
        empty.collection.objects.link(shown)
    bpy.context.view_layer.update()
    found = extension.api.see_lamps(empty)
    assert [lamp.name for lamp in found[:8]] == [f"Copy0{i}/Panel" for i in range(8)]
    assert [lamp.slot for lamp in found[:9]] == [*range(1, 9), None]
    assert 9 < len(found) < 50 and any("and 67 more" in lamp.name for lamp in found)
    # An instance that moves, and the original of all.
    bpy.data.objects["Copy50"].location = (0, 0, 3)
    assert any(s[:3] == pytest.approx([0, 0, 3]) for s in slots(empty))
    item.data.transform(Matrix.Translation((0, 0, 0.5)))
    item.data.update()
    assert any(s[:3] == pytest.approx([0, 0, 3.5]) for s in slots(empty))


def test_broken_and_empty_meshes(extension, ball, empty):
    """They raise no exception and take no slot."""
    material, _ = emissive()
    for points, faces in (
        ([], []),
        ([(0, 0, 1)], []),
        ([(0, 0, float("nan")), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]),
        ([(0, 0, 1), (1, 0, 1), (2, 0, 1)], [(0, 1, 2)]),
    ):
        mesh = bpy.data.meshes.new("Broken")
        mesh.from_pydata(points, [], faces)
        mesh.materials.append(material)
        empty.collection.objects.link(bpy.data.objects.new("Broken", mesh))
    add_lamp(empty, "POINT", "Key")
    assert [(lamp.name, lamp.slot) for lamp in extension.api.see_lamps(empty)][0] == ("Key", 1)
    assert len(slots(empty)) == 1


def test_images_of_another_file_with_the_same_name(extension, ball, empty, tmp_path):
    directions = (0.6, 0, 0.8), (0, 0.6, 0.8)
    for number, direction in enumerate(directions):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = bpy.context.scene
        helpers.add_sphere(scene, extension.api.new_material("ashikhmin_shirley", "aimed"), 8)
        _, _, node = environment(scene, spotted(np.array(direction), 0.03, 5000.0))
        node.image.pack()
        (slot,) = slots(scene)
        assert axes(slot)[:, 2] == pytest.approx(direction, abs=5e-3)
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / f"{number}.blend"))
    for number in (0, 1, 0):
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / f"{number}.blend"))
        (slot,) = slots(bpy.context.scene)
        assert axes(slot)[:, 2] == pytest.approx(directions[number], abs=5e-3)


def test_an_environment_image_that_changes(extension, ball, empty, tmp_path):
    """Its spots are those that Cycles shows; the pixels are freed that were read for them."""
    follow = import_module(f"{extension.package}.lamps.filling").follow
    directions = (0.6, 0, 0.8), (0, 0.6, 0.8)
    tree, background, node = environment(empty, spotted(np.array(directions[0]), 0.03, 5000.0))
    path = tmp_path / "sky.exr"

    def paint(image, direction):
        pixels = spotted(np.array(direction), 0.03, 5000.0)
        image.pixels.foreach_set(pixels.astype(np.float32).ravel())
        image.update()

    def save(direction):
        image = bpy.data.images.new("saved", 512, 256, float_buffer=True)
        paint(image, direction)
        image.file_format = "OPEN_EXR"
        image.save(filepath=str(path))
        bpy.data.images.remove(image)

    def seen():
        follow()
        bpy.context.view_layer.update()
        (slot,) = slots(empty, update=False)
        return axes(slot)[:, 2]

    for direction in directions:
        paint(node.image, direction)
        assert seen() == pytest.approx(direction, abs=5e-3), "painted, and not saved"
    save(directions[0])
    node.image = bpy.data.images.load(str(path))
    assert seen() == pytest.approx(directions[0], abs=5e-3)
    assert not node.image.has_data
    save(directions[1])
    os.utime(path, (1, 1))  # some file systems count whole seconds
    assert seen() == pytest.approx(directions[1], abs=5e-3), "saved again"
    assert len(node.image.pixels) and node.image.has_data  # as when an editor shows it
    save(directions[0])
    os.utime(path, (2, 2))
    assert seen() == pytest.approx(directions[0], abs=5e-3), "saved while Blender has pixels"


def test_the_colour_space_of_an_environment_image_counts(extension, empty, tmp_path):
    spots = import_module(f"{extension.package}.lamps.kinds.bright_spot")._spots
    image, pixels = bpy.data.images.new("sky", 64, 32), np.full((32, 64, 4), 0.02, np.float32)
    pixels[20:22, 10:12] = 0.5
    image.pixels.foreach_set(pixels.ravel())
    image.file_format = "PNG"
    image.save(filepath=str(tmp_path / "sky.png"))
    image = bpy.data.images.load(str(tmp_path / "sky.png"))
    ((_, _, dim),) = spots.of(image)
    image.colorspace_settings.name = "Non-Color"
    ((_, _, bright),) = spots.of(image)
    assert bright > 1.5 * dim


@pytest.mark.long
def test_lamps_that_are_not_normalised(extension, ball, empty):
    """Their power refers to a size of 1."""
    helpers.add_camera(empty)
    empty.render.resolution_x = empty.render.resolution_y = 16
    empty.cycles.samples = 64
    settings = {
        "POINT": ({"shadow_soft_size": 0.1}, 4 * math.pi * 0.1**2),
        "SPOT": ({"shadow_soft_size": 0.1, "spot_size": 3.0}, 4 * math.pi * 0.1**2),
        "AREA": ({"shape": "ELLIPSE", "size": 0.2, "size_y": 0.4}, math.pi / 4 * 0.08),
        "SUN": ({"angle": 1.2}, math.pi * math.sin(0.6) ** 2),
    }
    for kind, (values, size) in settings.items():
        item = add_lamp(empty, kind, **values)
        (whole,) = extension.api.see_lamps(empty)
        item.data.normalize = False
        (lamp,) = extension.api.see_lamps(empty)
        assert lamp.irradiance == pytest.approx(size * whole.irradiance)
        pictures = []
        for normalize in (True, False):
            item.data.normalize = normalize
            pictures.append(helpers.render(empty)[..., :3].mean())
        assert pictures[1] == pytest.approx(size * pictures[0], rel=0.05), f"{kind} in Cycles"
        bpy.data.objects.remove(item)


def test_scenes_within_the_picture(extension, ball, empty):
    """The compositor shows another scene, whose lamps are aimed at as well."""
    other = bpy.data.scenes.new("Other")
    add_lamp(empty, "POINT", "Here")
    add_lamp(other, "POINT", "There")
    assert [lamp.name for lamp in extension.api.see_lamps(empty)] == ["Here"]
    if hasattr(empty, "compositing_node_group"):
        tree = empty.compositing_node_group = bpy.data.node_groups.new("C", "CompositorNodeTree")
    else:
        empty.use_nodes = True
        tree = empty.node_tree
    tree.nodes.new("CompositorNodeRLayers").scene = other
    assert sorted(lamp.name for lamp in extension.api.see_lamps(empty)) == ["Here", "There"]
    assert [lamp.name for lamp in extension.api.see_lamps(other)] == ["There"]
    filling = import_module(f"{extension.package}.lamps.filling")
    assert filling.count() == 2, "lean materials have room for both"
    filling.memory.scene = None
    assert sorted(lamp.name for lamp in filling.last_found(empty)) == ["Here", "There"]
    suns = []
    for scene, turn in ((empty, 0.0), (other, 2.5)):
        suns.append(sky(scene))
        suns[-1].sun_rotation = turn
    assert len(extension.api.see_lamps(empty)) == 4, "of one name, and not the same"
    suns[1].sun_rotation = 0.0
    assert len(extension.api.see_lamps(empty)) == 3
    for sun in suns:
        sun.sun_disc = False
    empty.render.use_compositing = False
    assert [lamp.name for lamp in extension.api.see_lamps(empty)] == ["Here"]
    strips = empty.sequence_editor_create().strips
    strips.new_scene("Strip", other, 1, 1)
    assert sorted(lamp.name for lamp in extension.api.see_lamps(empty)) == ["Here", "There"]


def test_nothing_is_written_when_nothing_changed(shared_group, handlers, ball, empty, monkeypatch):
    """Anything that is written recompiles shaders."""
    written = []
    write = shared_group.write
    monkeypatch.setattr(shared_group, "write", lambda s, v: (written.append(s), write(s, v)))
    sky(empty)
    _, _, node = environment(empty, spotted(np.array([0.6, 0, 0.8]), 0.03, 5000.0))
    lamp = add_lamp(empty, "POINT", "Key", shadow_soft_size=0.25)
    add_lamp(empty, "AREA", "Area", location=(5, 5, 5))
    glow = helpers.add_sphere(empty, emissive()[0], segments=8)
    glow.location, glow.scale = (4, 4, 4), (0.1, 0.1, 0.1)
    assert len(slots(empty)) == 4 and written
    written.clear()
    lamp.location.x = 3
    lamp.data.energy = 3
    lamp.data.shadow_soft_size = 0.3  # too little to change the order
    ball.location.z = 0.5
    glow.location.x = 5
    ball.active_material.diffuse_color = (0, 0, 0, 1)
    bpy.context.view_layer.update()
    empty.frame_set(4)
    handlers._now()
    for _ in range(3):
        bpy.context.view_layer.update()
    assert not written
    assert_lamp(slots(empty)[[s[9] for s in slots(empty)].index(3)], bpy.data.objects["Area"])


def test_selecting_is_no_reason_to_look(scenes, ball, empty, monkeypatch):
    add_lamp(empty, "POINT", "Key")
    assert len(slots(empty)) == 1
    surveys, survey = [], scenes.survey_lamps
    monkeypatch.setattr(scenes, "survey_lamps", lambda *a: (surveys.append(1), survey(*a))[1])
    ball.select_set(not ball.select_get())
    bpy.context.view_layer.update()
    ball.location.x = 0.1
    bpy.context.view_layer.update()
    assert not surveys
    bpy.data.objects["Key"].data.energy = 5
    bpy.context.view_layer.update()
    assert surveys


def test_a_sun_without_a_size_is_seen(extension, ball, empty):
    """Random rays never hit it, aimed closures do in every sample; this must also work in a script
    that never updates anything."""
    extension.api.enable_osl(empty)
    add_lamp(empty, "SUN", turn=(0.9, 0, 0), angle=0.0)
    helpers.add_camera(empty)
    empty.render.resolution_x = empty.render.resolution_y = 16
    empty.cycles.samples, empty.cycles.use_denoising = 64, False
    pictures = []
    for seed in (1, 2):
        empty.cycles.seed = seed
        pictures.append(helpers.render(empty)[5:11, 5:11, :3])
    # What remains is noise at the edges of the coarse ball's faces, as in Lambert's exact form.
    assert min(p.min() for p in pictures) > 0
    assert np.median(np.abs(pictures[0] / pictures[1] - 1)) < 0.05


def test_handlers_come_and_go(lamps, handlers, scenes, empty, monkeypatch):
    def ours():
        return [
            name
            for name in dir(bpy.app.handlers)
            for function in (getattr(bpy.app.handlers, name),)
            if isinstance(function, list)
            and any(getattr(f, "__module__", "") == handlers.__name__ for f in function)
        ]

    assert set(ours()) == set(handlers._HANDLERS)
    automatic = import_module(lamps.__name__.replace(".lamps", ".groups.automatic"))
    automatic.unregister()
    lamps.unregister()
    assert ours() == []
    lamps.register()
    automatic.register()  # after them, because it makes room for the lamps that they find
    # In a file without such a group, handlers don't examine anything.
    surveys = []
    monkeypatch.setattr(scenes, "survey_lamps", lambda *_: surveys.append(1))
    add_lamp(empty, "POINT", "Key")
    bpy.context.view_layer.update()
    empty.frame_set(2)
    assert not surveys


def test_lean_files_name_the_number_of_lamps(extension, ball, empty):
    lean = import_module(f"{extension.package}.lean")
    add_lamp(empty, "POINT", "Key")
    add_lamp(empty, "SUN", "Sun")
    bpy.context.view_layer.update()
    assert lean.needs(extension.api.used_materials())["lamps"] == 2


def test_lamps_that_drawn_directions_do_not_meet(extension, ball, empty):
    """The sign of their size marks them for the shaders; and the panel warns if closures miss them,
    too."""
    extension.scene_loader.apply_clean_settings(empty)
    extension.api.enable_osl(empty)
    material = ball.active_material
    kinds = [("POINT", "shadow_soft_size"), ("SPOT", "shadow_soft_size"), ("SUN", "angle")]
    for kind, size in [*kinds, ("AREA", "size")]:
        item = add_lamp(empty, kind, energy=10.0)
        setattr(item.data, size, 0.5)
        assert slots(empty)[0][10] == pytest.approx(0.5)
        item.data.cycles.use_multiple_importance_sampling = False
        item.data.update_tag()  # as the panel does
        assert slots(empty)[0][10] == pytest.approx(-0.5), kind
        assert extension.api.warnings(material, empty) == []
        item.data.cycles.use_multiple_importance_sampling = True
        item.data.update_tag()
        item.data.use_shadow = False
        assert slots(empty)[0][10] == pytest.approx(-0.5), kind
        (found,) = extension.api.warnings(material, empty)
        assert (found.code, found.severity) == ("cast_shadow", "WARNING") and kind in found.message
        item.data.cycles.use_multiple_importance_sampling = False
        assert extension.api.warnings(material, empty) == []
        if kind == "SUN":
            item.data.angle = 0.6
            (found,) = extension.api.warnings(material, empty)
            assert (found.code, found.severity) == ("multiple_importance", "WARNING")
        bpy.data.objects.remove(item)
    near = add_lamp(empty, "POINT", "Near", location=(0, 0, 2), shadow_soft_size=1.9)
    near.data.cycles.use_multiple_importance_sampling = False
    (lamp,) = extension.api.see_lamps(empty)
    assert lamp.slot is None and not lamp.met and "too large" in lamp.why
    (found,) = extension.api.warnings(material, empty)
    assert (found.code, found.severity) == ("multiple_importance", "ERROR")
    assert "Near" in found.message and lamp.why in found.message
    near.data.shadow_soft_size, near.data.energy = 0.1, 240.0  # the faintest, but not negligible
    for i in range(8):
        add_lamp(empty, "POINT", f"Lamp{i}", location=(0, i, 3), energy=5000.0)
    assert len(slots(empty)) == 8
    (found,) = extension.api.warnings(material, empty)
    assert found.code == "multiple_importance" and "fainter" in found.message


@pytest.mark.parametrize(
    ("form", "expected"),
    [("aimed", "Multiple Importance, too"), ("sampled", "none of their light"), ("twin", "")],
)
def test_lamps_without_shadows_are_a_finding(extension, empty, form, expected):
    """tests/blender/test_highlights.py shows what is lost; Blender's own nodes lose it as well."""
    extension.scene_loader.apply_clean_settings(empty)
    extension.api.enable_osl(empty)
    material = extension.api.new_material("ward", form)
    helpers.add_sphere(empty, material, segments=8)
    item = add_lamp(empty, "POINT", "Key", shadow_soft_size=0.5)

    def findings():
        return [f for f in extension.api.warnings(material, empty) if f.code == "cast_shadow"]

    assert findings() == []
    item.data.use_shadow = False
    item.data.update_tag()
    found = findings()
    assert len(found) == bool(expected)
    assert all(expected in f.message and "Key" in f.message for f in found)


IES = """IESNA:LM-63-1995
[TEST] none
TILT=INCLUDE
1
2
0, 90
1.0 1.0
1 1000 2.0 3 2 1 2 0 0 0
0.5 1.0 100
0 45 90
0 90
10 20 30
40 50 60
"""


def test_light_that_nodes_give(extension, ball, empty, tmp_path):
    """A lamp's brightness, which decides about its slot, includes what is linked to its
    strength."""
    item = add_lamp(empty, "POINT", energy=10.0)
    (plain,) = extension.api.see_lamps(empty)
    item.data.use_nodes = True
    tree = item.data.node_tree
    (node,) = (n for n in tree.nodes if n.bl_idname == "ShaderNodeEmission")

    def power(kind, output=0, **values):
        source = tree.nodes.new(f"ShaderNode{kind}")
        for name, value in values.items():
            source.inputs[name].default_value = value
        tree.links.new(source.outputs[output], node.inputs["Strength"])
        return source, lambda: extension.api.see_lamps(empty)[0].irradiance / plain.irradiance

    source, found = power("Value")
    source.outputs[0].default_value = 7.0
    assert found() == pytest.approx(7, rel=1e-4)
    assert power("LightFalloff", "Quadratic", Strength=3.0)[1]() == pytest.approx(3, rel=1e-4)
    source, found = power("TexIES", Strength=2.0)
    assert found() == pytest.approx(2, rel=1e-4), "there is no file"
    file = tmp_path / "lamp.ies"
    file.write_text(IES)
    wanted = 2 * 0.0706650768394 * 60 * 2.0 * 0.5
    source.mode, source.filepath = "EXTERNAL", str(file)
    assert found() == pytest.approx(wanted, rel=1e-4)
    source.mode, source.ies = "INTERNAL", bpy.data.texts.new("lamp.ies")
    source.ies.write(IES)
    assert found() == pytest.approx(wanted, rel=1e-4)
    for broken in (
        "",
        "TILT=NONE\n1 2 3",
        IES.replace("60", "much"),
        IES.replace("90\n10", "90\n"),
    ):
        source.ies.clear()
        source.ies.write(broken)
        assert found() > 0
    tree.links.remove(node.inputs["Strength"].links[0])
    node.inputs["Strength"].default_value = 4.0
    black = tree.nodes.new("ShaderNodeBlackbody")
    tree.links.new(black.outputs[0], node.inputs["Color"])
    assert extension.api.see_lamps(empty)[0].irradiance / plain.irradiance == pytest.approx(
        4, rel=1e-4
    )
    assert len(slots(empty)) == 1
