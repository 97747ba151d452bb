# SPDX-License-Identifier: GPL-3.0-or-later
"""A folder of measured BRDFs as an asset catalogue."""

import itertools
import json
import os
import re
import sys
import uuid
from importlib import import_module
from types import SimpleNamespace

import bpy
import helpers
import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("by_the_tool")


@pytest.fixture(scope="module")
def module(extension):
    return import_module(f"{extension.package}.library.measured")


def write(path, red, green, blue):
    """A table of a Lambert surface."""
    angles = (0, 30, 60, 85)
    rows = [
        f"{ti},0,{to},{po},{red / np.pi:.9g},{green / np.pi:.9g},{blue / np.pi:.9g}"
        for ti, to, po in itertools.product(angles, angles, (0, 90, 180))
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("theta_i,phi_i,theta_o,phi_o,r,g,b\n" + "\n".join(rows) + "\n")


def write_wide(path, formulas):
    """A table of facets that face everywhere: any slope up to 1 makes a narrower highlight."""
    angles = range(0, 90, 10)
    grid = np.array(list(itertools.product(angles, [0], angles, range(0, 181, 10))), float)
    (ti, pi), (to, po) = np.radians(grid[:, :2]).T, np.radians(grid[:, 2:]).T
    wi, wo = (
        np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1)
        for t, p in ((ti, pi), (to, po))
    )
    f = formulas.model("microfacet").eval(wi, wo, ax=1.0, ay=1.0, distribution="ggx")
    header = "theta_i,phi_i,theta_o,phi_o,r,g,b"
    np.savetxt(path, np.hstack([grid, f]), "%.9g", ",", header=header, comments="")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("data")
    write(root / "red.csv", 0.8, 0.1, 0.1)
    write(root / "paper" / "white.csv", 0.8, 0.8, 0.8)
    write(root / "paper" / "red.csv", 0.6, 0.1, 0.1)
    (root / "broken.binary").write_bytes(b"x" * 100)
    (root / "notes.txt").write_text("not measured")
    write(root / ".trash" / "old.csv", 0.1, 0.1, 0.8)
    (root / "paper" / "._white.csv").write_bytes(b"what macOS writes beside files")
    return root


def catalogs(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    return {
        fields[1]: fields[0]
        for fields in (line.split(":") for line in lines if line[:1] not in ("", "#", "V"))
    }


def color(material):
    """Of the middle of a preview's ball."""
    width, height = material.preview.image_size
    shown = np.reshape(material.preview.image_pixels_float, (height, width, 4))
    return shown[height // 3 : height // 2, width // 3 : 2 * width // 3, :3].mean((0, 1))


def load(blend):
    with bpy.data.libraries.load(str(blend), link=True, assets_only=True) as (there, here):
        assert not there.node_groups, "materials alone are assets"
        here.materials = there.materials
    return {material.name: material for material in here.materials}


def replace_second_blender(module, monkeypatch, blend, listed=None):
    """By a program that copies `blend` as what it made, and the list that it was given to
    `listed`."""
    script = (
        "import pathlib, shutil, sys; blend, listed, folder, *given = sys.argv[1:];"
        "folder = pathlib.Path(folder); shutil.copy(blend, folder / 'materials.blend');"
        "listed and shutil.copy(given[0], listed); (folder / 'refusals.json').write_text('{}')"
    )
    command = [sys.executable, "-c", script, str(blend), str(listed or "")]
    monkeypatch.setattr(module, "build_command", lambda *arguments: [*command, *arguments])


@pytest.mark.long
def test_a_folder_becomes_a_catalogue(
    extension, module, empty, folder, tmp_path, tmp_path_factory, monkeypatch
):
    blend, cats = tmp_path / "measured.blend", tmp_path / "blender_assets.cats.txt"
    mine = str(uuid.uuid4())
    paper = str(uuid.uuid4())
    before = f"# mine\nVERSION 1\n\n{mine}:Wood:Wood\n{paper}:brdfc/Measured/paper:Paper\n"
    cats.write_text(before)
    counts = helpers.counts()
    job = extension.api.start_measured_library(folder, blend, "lambert")
    shares = list(iter(job.step, None))
    made = job.result
    assert helpers.counts() == counts, "the open file is left alone"
    assert shares == sorted(shares) and 0 <= shares[0] and shares[-1] < 1
    assert made.blend == blend and made.catalogs == cats
    assert {path.relative_to(folder).as_posix(): name for path, name in made.materials.items()} == {
        "red.csv": "red.csv",
        "paper/red.csv": "paper/red.csv",
        "paper/white.csv": "white",
    }
    assert [path.name for path in made.refusals] == ["broken.binary"]
    assert "header: expected 90 x 90 x 180" in made.refusals[folder / "broken.binary"]
    assert made.notes.keys() == made.materials.keys()
    for notes in made.notes.values():
        assert notes[0].startswith("phi_o lies within half a circle") and len(notes) == 2
    assert blend.read_bytes()[:4] == b"\x28\xb5\x2f\xfd", "compressed"
    assert sorted(p.name for p in tmp_path.iterdir()) == [cats.name, blend.name]
    # Nothing of what was there is lost, and a catalogue that exists is used.
    assert cats.read_text().startswith(before)
    known = catalogs(cats)
    assert known["Wood"] == mine and known["brdfc/Measured/paper"] == paper
    assert known.keys() == {"Wood", "brdfc", "brdfc/Measured", "brdfc/Measured/paper"}
    materials = load(blend)
    assert materials.keys() == set(made.materials.values())
    for name, material in materials.items():
        data, (node,) = material.asset_data, extension.model_nodes.group_nodes(material)
        below = "/paper" if name in ("white", "paper/red.csv") else ""
        assert data.catalog_id == known[f"brdfc/Measured{below}"]
        assert re.search(r"CSV, .* of view; nothing was measured beyond 85 deg", data.description)
        assert "; phi_o lies within half a circle" in data.description
        assert {t.name for t in data.tags} == {"measured", "CSV"}
        assert extension.model_nodes.identity(node).model == "lambert"
    red, white = color(materials["red.csv"]), color(materials["white"])
    assert red[0] > 2 * red[1] and white[2] > 2 * red[2] and np.ptp(white) < 0.1
    assert not [item for item in bpy.data.objects if item.library], "no scene of the pictures"
    # Once more: the file is replaced, and no catalogue comes twice. The second Blender is replaced
    # by a program that copies what it made: pictures take seconds.
    text, bytes_before = cats.read_text(), blend.read_bytes()
    kept = tmp_path_factory.mktemp("kept") / blend.name
    kept.write_bytes(bytes_before)
    blend.unlink()
    bpy.data.libraries.write(str(blend), set(), compress=False)
    replace_second_blender(module, monkeypatch, kept)
    again = extension.api.new_measured_library(folder, blend, "lambert")
    assert again.materials == made.materials and cats.read_text() == text
    assert blend.read_bytes() == bytes_before


def test_what_keeps_a_model_from_coming_closer(extension, module, tmp_path, monkeypatch):
    """Of each file, and in the description of its asset. The second Blender is replaced."""
    data = tmp_path / "data"
    data.mkdir()
    write_wide(data / "wide.csv", import_module(f"{extension.package}.brdfc"))
    blend, listed = tmp_path / "measured.blend", tmp_path / "listed.json"
    (tmp_path / "any.blend").write_bytes(b"x")
    replace_second_blender(module, monkeypatch, tmp_path / "any.blend", listed)
    made = extension.api.new_measured_library(data, blend, "cook_torrance")
    (said,) = made.remarks[data / "wide.csv"]
    assert said.startswith("The fit stopped at the end of the range of Slope")
    (entry,) = json.loads(listed.read_text(encoding="utf-8"))
    assert entry["description"].endswith(f"; {said}")
    blend.unlink()
    assert extension.api.new_measured_library(data, blend, "lambert").remarks == {}


def test_the_part_done_never_falls(module, folder, tmp_path, monkeypatch):
    """A file whose fit was nearly done counts as done, whether it became a fit or was refused."""

    class Fitting:
        def __init__(self, path, *_, **__):
            self.path, self.left, self.result = path, [0.5, 0.99], None

        def step(self):
            if self.left:
                return self.left.pop(0)
            if self.path.name == "broken.binary":
                raise module.MeasuredError("damaged")
            self.result = self.path.name
            return None

    monkeypatch.setattr(module, "fitting_of", Fitting)
    making = module.Making(folder, tmp_path / "measured.blend", "lambert")
    shares = [making.step() for _ in range(3 * 4)]
    assert shares == sorted(shares) and shares[2] == pytest.approx(shares[-1] / 4)


@pytest.mark.long
def test_the_operator_and_the_closest_model(extension, empty, tmp_path):
    write(tmp_path / "grey.csv", 0.5, 0.5, 0.5)
    (tmp_path / "broken.alta").write_text("#DIM 4 3\n")
    assert bpy.ops.brdfc.new_measured_library(directory=str(tmp_path)) == {"FINISHED"}
    (material,) = load(tmp_path / "measured.blend").values()
    (node,) = extension.model_nodes.group_nodes(material)
    assert material.name == "grey" and extension.model_nodes.identity(node).model == "lambert"
    layout = helpers.Layout()
    extension.ui.draw_material_menu(SimpleNamespace(layout=layout), bpy.context)
    assert any("brdfc.new_measured_library" in line for line in layout.log)


def test_an_asset_library_has_one_file_of_catalogues(module, tmp_path):
    libraries = bpy.context.preferences.filepaths.asset_libraries
    mine = libraries.new(name="mine", directory=str(tmp_path))
    try:
        found = module._catalogs_file(tmp_path / "deep" / "down" / "x.blend")
        assert found == tmp_path / "blender_assets.cats.txt"
    finally:
        libraries.remove(mine)
    assert module._catalogs_file(tmp_path / "deep" / "x.blend").parent == tmp_path / "deep"


def test_nothing_is_left_where_it_fails(extension, module, empty, folder, tmp_path, monkeypatch):
    api, blend = extension.api, tmp_path / "out.blend"
    cats = tmp_path / "blender_assets.cats.txt"
    cats.write_text("VERSION 1\n")
    bpy.data.libraries.write(str(blend), {bpy.data.materials.new("before")})
    before = blend.read_bytes()

    def refused(error, match, *arguments):
        with pytest.raises(error, match=match):
            api.new_measured_library(*arguments)
        assert sorted(p.name for p in tmp_path.iterdir()) == [cats.name, blend.name]
        assert blend.read_bytes() == before and cats.read_text() == "VERSION 1\n"

    refused(ValueError, "There is no folder", folder / "none", blend)
    refused(ValueError, "the name of a .blend in a folder that exists", folder, tmp_path / "x.png")
    refused(ValueError, "the name of a .blend", folder, tmp_path / "none" / "x.blend")
    refused(ValueError, "Expected one of the models .*lobes, got 'wood'", folder, blend, "wood")
    refused(ValueError, "no render method", folder, blend, "lambert", "painted")
    refused(api.MeasuredError, "ends with .binary, .bsdf", tmp_path, blend)
    # The second Blender fails, or its .blend can't be put into place.
    with monkeypatch.context() as patch:
        command = [sys.executable, "-c", "print('no such thing'); raise SystemExit(1)"]
        patch.setattr(module, "build_command", lambda *arguments: command)
        refused(api.MeasuredError, "could not be made: no such thing", folder, blend, "lambert")
    with monkeypatch.context() as patch:
        replace = os.replace

        def fail(source, target):
            if target == blend:
                raise PermissionError(13, "it is open")
            replace(source, target)

        script = (
            "import pathlib, sys; folder = pathlib.Path(sys.argv[1]);"
            "(folder / 'materials.blend').write_text('x');"
            "(folder / 'refusals.json').write_text('{}')"
        )
        patch.setattr(module, "build_command", lambda *a: [sys.executable, "-c", script, *a])
        patch.setattr(module.os, "replace", fail)
        refused(
            api.MeasuredError, "out.blend can't be written: it is open", folder, blend, "lambert"
        )
    job = api.start_measured_library(folder, blend, "lambert")
    job.step()
    job.cancel()
    job.cancel()
    monkeypatch.setenv("BRDFC_TOOL", "/nowhere/brdfc")
    refused(api.MeasuredError, "is not the program brdfc", folder, blend)


def test_a_file_that_is_no_library_is_not_replaced(extension, empty, folder, tmp_path):
    blend = tmp_path / "room.blend"
    mesh = bpy.data.objects.new("chair", bpy.data.meshes.new("chair"))
    bpy.data.libraries.write(str(blend), {mesh})
    for content, why in (
        (blend.read_bytes(), "room.blend has a scene or objects, so it is no library"),
        (b"broken", "room.blend can't be read"),
    ):
        blend.write_bytes(content)
        counts = helpers.counts()
        with pytest.raises(ValueError, match=why):
            extension.api.new_measured_library(folder, blend, "lambert")
        assert blend.read_bytes() == content and helpers.counts() == counts
        assert [p.name for p in tmp_path.iterdir()] == [blend.name]
    # One that was saved, which has a scene.
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True)
    with pytest.raises(ValueError, match="has a scene or objects"):
        extension.api.start_measured_library(folder, blend, "lambert")


def test_what_an_asset_is_described_by_is_short(module, tmp_path):
    told = {"lacks": ["a" * 100, "b" * 300], "notes": ["c" * 100, "d" * 200]}
    found = SimpleNamespace(path=tmp_path / "x.csv", format="CSV", grid="2 x 2", told=told)
    said = f"x.csv: CSV, 2 x 2; {'a' * 100}; {'c' * 100}"
    assert module._description(found) == said
    assert module._description(found, ["e" * 90]) == f"{said}; {'e' * 90}"


def test_a_folder_of_which_no_file_can_be_read(extension, empty, tmp_path):
    (tmp_path / "a.bin").write_bytes(b"x")
    (tmp_path / "b.csv").write_text("a,b\n")
    with pytest.raises(extension.api.MeasuredError, match="became a material: a.bin: .*; b.csv: "):
        extension.api.new_measured_library(tmp_path, tmp_path / "out.blend")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.bin", "b.csv"]
