# SPDX-License-Identifier: GPL-3.0-or-later
"""The library of ready-made materials: its contents, its registration in the Asset Browser, and
dragging from there. Blender's drag appends, as wm.append does with these options."""

import importlib
import json
import re
import shutil
import stat
import sys
import uuid
from pathlib import Path
from types import SimpleNamespace

import bpy
import helpers
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
#: Making the library takes most of the time of these tests.
LIBRARY = pytest.mark.together("library")


@pytest.fixture(scope="module")
def library(extension):
    return importlib.import_module(f"{extension.package}.library")


@pytest.fixture(scope="module")
def blender(tmp_path_factory):
    """Blender as a module has no program: this one parses its options as documented, and runs the
    script."""
    path = tmp_path_factory.mktemp("blender") / "blender"
    path.write_text(
        f"#!{sys.executable}\n"
        "import os, sys\n"
        "options = ['--background', '--factory-startup', '--python-exit-code', '1', '--python']\n"
        "assert sys.argv[1:6] == options and sys.argv[7] == '--', sys.argv\n"
        "os.execv(sys.executable, [sys.executable, *sys.argv[6:]])\n"
    )
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


@pytest.fixture(scope="module")
def made(library, blender):
    """The library, made by its operator, and the fractions done that were shown meanwhile."""
    assert library.registered() is None
    before, shares, step = helpers.counts(), [], library.Making.step

    def noting(job):
        shares.append(step(job))
        return shares[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(library, "_program", lambda: str(blender))
        patch.setattr(library.Making, "step", noting)
        assert bpy.ops.brdfc.add_library() == {"FINISHED"}
    assert helpers.counts() == before, "the open file is left alone"
    folder = library.folder()
    reuse = library.registered().import_method == "APPEND_REUSE"
    blend = folder / library.BLEND
    yield SimpleNamespace(folder=folder, blend=blend, reuse=reuse, shares=shares)
    bpy.ops.brdfc.remove_library()


def drag(made, name):
    """Does what dropping a material of the Asset Browser does; returns the material."""
    before = set(bpy.data.materials)
    bpy.ops.wm.append(
        directory=f"{made.blend / 'Material'}/",
        filename=name,
        do_reuse_local_id=made.reuse,
        clear_asset_data=True,
    )
    new = [m for m in bpy.data.materials if m not in before]
    return new[0] if new else bpy.data.materials[name]


def names(collection):
    return sorted(item.name for item in collection)


# What is listed


def test_every_value_is_one_that_its_model_takes(extension, library, subtests):
    entries = library.entries()
    assert len({entry.name for entry in entries}) == len(entries) >= 60
    assert {entry.model for entry in entries} == set(extension.api.models())
    for entry in entries:
        with subtests.test(entry.name):
            for name, value in entry.values.items():
                extension.pack.model(entry.model).check_value(name, value)
            assert entry.tags and not entry.description.endswith(".")


def test_a_model_of_which_nothing_is_made_is_there_with_its_defaults(
    extension, library, monkeypatch, tmp_path
):
    listed = json.loads((library._HERE / "materials.json").read_text(encoding="utf-8"))
    rest = {k: [row for row in rows if row["model"] != "ward"] for k, rows in listed.items()}
    (tmp_path / "materials.json").write_text(json.dumps(rest), encoding="utf-8")
    monkeypatch.setattr(library, "_HERE", tmp_path)
    (entry,) = [e for e in library.entries() if e.model == "ward"]
    assert entry.name == extension.pack.model("ward").label and entry.values == {}
    (tmp_path / "materials.json").write_text('{"Metals": [{"name": "x"}]}', encoding="utf-8")
    with pytest.raises(library.LibraryError, match="expected, by catalogue, objects with name"):
        library.entries()


@pytest.mark.long
@pytest.mark.slow
def test_what_needs_open_shading_language_says_so(extension, library, empty, third_of):
    empty.cycles.shading_system = False
    entries, found = third_of(library.entries()), set()
    for entry in entries:
        warned = extension.api.warnings(library.make(extension.api, entry), empty)
        needs = "osl_off" in {warning.code for warning in warned}
        assert needs == ("Needs Open Shading Language" in library.description(entry)), entry.name
        found |= {entry.name} if needs else set()
    # Rays through a surface, and a choice of a model that has refraction as another.
    rough_glass = {"Ground Glass", "Hoarfrost"}
    all_of_these = {"Frosted Glass", "Sea Glass", "Traffic Sign White", *rough_glass}
    assert found == all_of_these & {entry.name for entry in entries}


def test_every_picture_is_of_the_material_that_is_listed(library, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "script")
    previews = importlib.import_module("asset_previews")
    scene = importlib.import_module(f"{library.__name__}.preview")
    rows = (ROOT / "blender_addon" / "library" / "previews" / "made.csv").read_text().split()
    wanted = {
        entry.preview.stem: previews.fingerprint(entry, scene.SIZE, scene.SAMPLES)
        for entry in library.entries()
    }
    assert dict(row.split(",") for row in rows) == wanted, "run script/assets"
    assert all(entry.preview.is_file() for entry in library.entries())


# In the Asset Browser


@LIBRARY
def test_catalogues_and_what_is_said_of_each_material(extension, library, made, empty, subtests):
    lines = (made.folder / library.CATALOGS).read_text(encoding="utf-8").splitlines()
    assert lines[0] == "VERSION 1"
    catalogs = {}
    for line in lines[1:]:
        if line:
            identifier, path, simple = line.split(":")
            assert str(uuid.UUID(identifier)) == identifier and "/" not in simple
            assert path.split("/")[0] == library.NAME
            catalogs[identifier] = path.removeprefix(f"{library.NAME}/")
    paths = {*catalogs.values()}
    assert library.NAME in paths, "Blender shows what it adds itself as not saved"
    assert all(path.rpartition("/")[0] in paths for path in paths if "/" in path)
    with bpy.data.libraries.load(str(made.blend), link=True, assets_only=True) as (there, here):
        assert not there.node_groups, "materials alone are assets"
        here.materials = there.materials
    entries = {entry.name: entry for entry in library.entries()}
    assert names(here.materials) == sorted(entries)
    for material in here.materials:
        with subtests.test(material.name):
            entry, data = entries[material.name], material.asset_data
            assert catalogs[data.catalog_id] == entry.catalog
            paper = extension.pack.model(entry.model).paper
            assert entry.description in data.description and paper in data.description
            assert data.author == "brdfc contributors" and data.license == "GPL-3.0-or-later"
            assert set(entry.tags) <= {tag.name for tag in data.tags}
            width, height = material.preview.image_size
            shown = np.reshape(material.preview.image_pixels_float, (height, width, 4))
            assert width >= 128 and shown[..., :3].std() > 0.05
            ball = shown[height // 4 : height // 2, width // 3 : 2 * width // 3, :3]
            assert 0.02 < ball.mean() < 0.98, "it is lit"
            image = bpy.data.images.load(str(entry.preview))
            meant = np.reshape(image.pixels, shown.shape)
            assert np.abs(shown - meant).max() < 0.01


@LIBRARY
def test_the_second_blender_keeps_its_nodes_for_this_one(extension, made, empty):
    """And finds those that this one kept: making them takes seconds for each model."""
    kept = importlib.import_module(f"{extension.package}.content.kept_groups")
    (folder,) = kept.environment().values()
    formulas = [e for e in extension.api.models().values() if "nodes" in e["representations"]]
    assert len(list(Path(folder).iterdir())) >= len(formulas)
    files = sorted(Path(folder).iterdir())
    empty.cycles.shading_system = False
    extension.api.new_material("ward")
    assert sorted(Path(folder).iterdir()) == files, "it is appended"


@LIBRARY
def test_one_click_adds_it_and_one_takes_it_away(
    extension, library, made, empty, monkeypatch, tmp_path
):
    # The second Blender is replaced by a program that copies what it made: it takes seconds.
    shutil.copytree(made.folder, tmp_path / "library")
    copy = "import shutil, sys; shutil.copytree(*sys.argv[1:], dirs_exist_ok=True)"
    command = [sys.executable, "-c", copy, str(tmp_path / "library")]
    monkeypatch.setattr(library, "build_command", lambda folder: [*command, folder])

    def buttons():
        layout = helpers.Layout()
        extension.operators.preferences.draw_library(layout)
        return [re.search(r"brdfc\.\w+", line)[0] for line in layout.log if "brdfc." in line]

    libraries = bpy.context.preferences.filepaths.asset_libraries
    before = [item.name for item in libraries]
    (mine,) = [item for item in libraries if Path(item.path) == made.folder]
    method = "APPEND_REUSE" if bpy.app.version < (5, 0, 0) else "APPEND"
    assert mine.name == library.NAME and mine.import_method == method
    assert library.is_current() and buttons() == ["brdfc.remove_library"]
    stamp = made.folder / library.STAMP
    stamp.write_text('{"generator": "brdfc 0.0.1", "hash": ""}')
    assert not library.is_current()
    assert buttons() == ["brdfc.add_library", "brdfc.remove_library"]
    try:
        assert bpy.ops.brdfc.remove_library() == {"FINISHED"}
        assert library.registered() is None and not made.folder.exists()
        assert [item.name for item in libraries] == [n for n in before if n != library.NAME]
        assert buttons() == ["brdfc.add_library"]
        assert bpy.ops.brdfc.remove_library() == {"FINISHED"}, "also where there is none"
    finally:
        assert bpy.ops.brdfc.add_library() == {"FINISHED"}
    assert sorted(item.name for item in libraries) == sorted(before) and library.is_current()


@LIBRARY
def test_making_it_shows_how_much_is_done(library, made):
    *shares, last = made.shares
    assert last is None and shares == sorted(shares) and 0 <= shares[0] and shares[-1] < 1
    assert len(set(shares)) > 3 and library.is_current()


@LIBRARY
@pytest.mark.parametrize(
    ("command", "message"),
    [
        ([sys.executable, "-c", "print('no such thing'); raise SystemExit(1)"], "no such thing"),
        ([sys.executable, "-c", ""], "status 0"),
        (["/nowhere/blender"], "/nowhere/blender"),
    ],
)
def test_a_library_that_can_not_be_made(extension, library, made, monkeypatch, command, message):
    files = {p.name: p.stat().st_mtime_ns for p in made.folder.iterdir()}
    monkeypatch.setattr(library, "build_command", lambda *arguments: command)
    with pytest.raises(extension.api.LibraryError, match=f"could not be made: .*{message}"):
        extension.api.add_library()
    with pytest.raises(RuntimeError, match="could not be made"):
        bpy.ops.brdfc.add_library()
    assert {p.name: p.stat().st_mtime_ns for p in made.folder.iterdir()} == files


@LIBRARY
def test_making_it_may_be_given_up(library, made):
    files = {p.name: p.stat().st_mtime_ns for p in made.folder.iterdir()}
    job = library.Making()
    job.cancel()
    job.cancel()
    assert not job._made.exists()
    assert {p.name: p.stat().st_mtime_ns for p in made.folder.iterdir()} == files


# Dragged

#: Forms in the groups of a dragged material, with Open Shading Language and without: the group that
#: adapts to the scene, the form inside, and the stand-in.
FORMS = {True: ("auto", "twin"), False: ("auto", "nodes", "twin")}


def assert_aims_at(extension, material, lamp):
    """Checks that the lamp group in the material's model contains the lamp's position."""
    bpy.context.view_layer.update()
    (node,) = extension.model_nodes.group_nodes(material)
    content = extension.model_nodes.content_group(node.node_tree)
    inner = {getattr(n, "node_tree", None): n for n in content.nodes}
    inner = inner[bpy.data.node_groups[".brdfc Lamps"]]
    group = inner.node_tree.evaluated_get(bpy.context.evaluated_depsgraph_get())
    first = next(n for n in group.nodes if n.bl_idname == "ShaderNodeCombineXYZ")
    assert [s.default_value for s in first.inputs] == pytest.approx(list(lamp.location))


@LIBRARY
@pytest.mark.parametrize(
    ("by_hand", "osl", "faint"),
    [(True, True, 0), (False, True, 0), (True, False, 0), (False, False, 0), (False, False, 3)],
)
def test_dragging_brings_nothing_twice_and_finds_the_lamps(
    extension, made, empty, by_hand, osl, faint
):
    """`faint`: more lamps than the library's nodes have room for, which are made again then."""
    empty.cycles.shading_system = osl
    for x in range(faint):
        helpers.add_lamp(empty, name="Faint", location=(x, 2, 3), energy=1)
    lamp = helpers.add_lamp(empty, name="Key", location=(1, 2, 3), energy=100)
    ball = helpers.add_sphere(empty, None, segments=8)
    if by_hand:
        ball.active_material = extension.api.new_material("ward")
        assert_aims_at(extension, ball.active_material, lamp)
    once = None
    for name in ("Brushed Steel", "Turned Copper", "Red Plastic", "Brushed Steel"):
        ball.active_material = drag(made, name)
        assert_aims_at(extension, ball.active_material, lamp)
        found = tuple(map(names, (bpy.data.node_groups, bpy.data.texts, bpy.data.images)))
        if name == "Red Plastic":
            once = found
    assert found == once, "what was dragged once is not brought again"
    groups, texts, _ = once
    made_of = [
        f".{model} ({form})" for model in ("Ashikhmin-Shirley", "Ward") for form in FORMS[osl]
    ]
    ours = {n for n in groups if not n.startswith(".brdfc ") or n == ".brdfc Lamps"}
    assert ours >= {*made_of, ".brdfc Lamps"}
    used = {n for n in ours if bpy.data.node_groups[n].users}
    assert {re.sub(r"\.\d+$", "", n) for n in used} == {*made_of, ".brdfc Lamps"}
    assert len(texts) == (3 if osl else 0), "two shaders, and which tells whether they run"
    if made.reuse and not by_hand:
        assert names(bpy.data.materials) == ["Brushed Steel", "Red Plastic", "Turned Copper"]
    lamp.location = (3, -2, 1)
    assert_aims_at(extension, ball.active_material, lamp)
    assert not ball.active_material.asset_data


@LIBRARY
def test_a_group_that_differs_does_not_give_way(extension, made, empty):
    mine = extension.api.new_material("ward")
    (node,) = extension.model_nodes.group_nodes(mine)
    tag = node.node_tree[extension.model_nodes.TAG]
    tag["digest"] = "of another version"
    other = drag(made, "Brushed Steel")
    (theirs,) = extension.model_nodes.group_nodes(other)
    assert theirs.node_tree != node.node_tree
    assert len([g for g in bpy.data.node_groups if g.name.startswith(".brdfc Lamps")]) == 1


@LIBRARY
def test_what_is_asked_for_by_name_stays(extension, made, empty):
    """The user, or a script, may be using a group that was appended by name."""
    extension.api.new_material("ward")
    with bpy.data.libraries.load(str(made.blend)) as (there, here):
        here.node_groups = [name for name in there.node_groups if name == ".Ward (auto)"]
    (group,) = here.node_groups
    assert group.name == ".Ward (auto).001" and extension.model_nodes.TAG in group


@LIBRARY
def test_undo_of_a_drag(extension, made, empty):
    ball = helpers.add_sphere(empty, extension.api.new_material("ward"), segments=8)
    lamp = helpers.add_lamp(empty, name="Key", location=(1, 2, 3), energy=100)
    assert_aims_at(extension, ball.active_material, lamp)
    bpy.ops.ed.undo_push(message="Start")

    def state():
        kept = (bpy.data.materials, bpy.data.node_groups, bpy.data.texts)
        return [names(collection) for collection in kept]

    def used():
        groups = [g for g in bpy.data.node_groups if g.users]
        return names([g for g in groups if extension.model_nodes.TAG in g])

    before, in_use = state(), used()
    ball.active_material = drag(made, "Brushed Steel")
    bpy.ops.ed.undo_push(message="Drag")
    after = state()
    assert after != before and used() == in_use
    assert bpy.ops.ed.undo() == {"FINISHED"}
    assert state() == before
    assert_aims_at(extension, bpy.data.materials["Ward"], bpy.data.objects["Key"])
    assert bpy.ops.ed.redo() == {"FINISHED"}
    assert state() == after
    assert_aims_at(extension, bpy.data.materials["Brushed Steel"], bpy.data.objects["Key"])


@LIBRARY
@pytest.mark.full
def test_every_material_is_as_the_same_one_made_by_hand(
    extension, library, made, empty, few_of, subtests
):
    for entry in few_of(library.entries(), 12):
        with subtests.test(entry.name):
            dragged = drag(made, entry.name)
            by_hand = library.make(extension.api, entry)
            (theirs,), (ours,) = map(extension.model_nodes.group_nodes, (dragged, by_hand))
            assert theirs.node_tree == ours.node_tree, "the same shader, once"
            assert extension.model_nodes.all_values(theirs) == extension.model_nodes.all_values(
                ours
            )
            for settings in ("use_bump_map_correction", "use_transparent_shadow"):
                mine = [getattr(m, settings, None) for m in (dragged.cycles, by_hand.cycles)]
                assert mine[0] == mine[1]
            said, meant = (extension.api.warnings(m, empty) for m in (dragged, by_hand))
            assert said == meant


@LIBRARY
@pytest.mark.evidence
@pytest.mark.full
def test_dragged_materials_render_as_those_made_by_hand(extension, library, made, empty, subtests):
    """One of each catalogue, on balls in a row under a lamp and a white sky. Both pictures have the
    same noise. (script/assets renders all, with the same functions.)"""
    entries, pixels = list({e.catalog: e for e in library.entries()}.values()), 16
    balls = [helpers.add_sphere(empty, drag(made, e.name), segments=24) for e in entries]
    for x, ball in enumerate(balls):
        ball.location.x = 2.1 * x
    width = 2.1 * len(balls)
    helpers.add_camera(empty, location=(width / 2 - 1.05, -8, 0), orthographic=width)
    helpers.add_world(empty, strength=0.5)
    lamp = helpers.add_lamp(empty, name="Key", location=(width / 2, -width, width), energy=100)
    lamp.data.energy, lamp.data.shadow_soft_size = 100 * width**2, 10
    extension.api.enable_osl(empty)
    empty.cycles.samples, empty.cycles.use_adaptive_sampling = 16, False
    empty.render.resolution_x, empty.render.resolution_y = pixels * len(balls), pixels
    dragged = helpers.render(empty)
    for ball, entry in zip(balls, entries, strict=True):
        ball.active_material = library.make(extension.api, entry)
    by_hand = helpers.render(empty)
    assert np.isfinite(dragged).all()
    for x, entry in enumerate(entries):
        with subtests.test(entry.name):
            place = np.s_[4:12, x * pixels + 4 : x * pixels + 12, :3]
            assert 0.01 < dragged[place].mean() < 5
            assert np.array_equal(dragged[place], by_hand[place])
