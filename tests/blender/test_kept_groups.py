# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that nodes of formulas are made once and appended the next time, and that both are the
same."""

import contextlib
import re
from importlib import import_module
from pathlib import Path

import bpy
import numpy as np
import pytest


@pytest.fixture
def kept(extension, empty, monkeypatch, tmp_path):
    """The module, with an empty folder; what other tests keep stays."""
    module = import_module(f"{extension.package}.content.kept_groups")
    monkeypatch.setattr(bpy.utils, "extension_path_user", lambda *_, **__: str(tmp_path))
    return module


def value(socket):
    found = getattr(socket, "default_value", None)
    return tuple(found) if hasattr(found, "__len__") else found


def described(tree, seen=None):
    """Everything that defines a tree, including the groups inside."""
    nodes = {node.name: i for i, node in enumerate(tree.nodes)}
    found = []
    for node in tree.nodes:
        inner = getattr(node, "node_tree", None)
        found.append(
            (
                node.bl_idname,
                getattr(node, "operation", None),
                tuple(node.location),
                tuple(value(socket) for socket in node.inputs),
                None if inner is None else described(inner),
            )
        )
    links = sorted(
        (
            nodes[link.from_node.name],
            link.from_socket.identifier,
            nodes[link.to_node.name],
            link.to_socket.identifier,
        )
        for link in tree.links
    )
    sockets = [(s.name, s.in_out, s.socket_type) for s in tree.interface.items_tree]
    return found, links, sockets


def formulas(material, extension):
    (node,) = extension.model_nodes.group_nodes(material)
    content = extension.model_nodes.content_group(node.node_tree)
    (inner,) = (n.node_tree for n in content.nodes if n.label == "Formulas")
    return inner


def new_file():
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def refuse(*_):
    raise AssertionError("made anew")


@pytest.mark.long
@pytest.mark.slow
def test_what_was_made_once_is_appended(extension, kept, monkeypatch):
    models = ("ward", "ashikhmin_shirley", "glass")
    made = {}
    for model in models:
        new_file()
        made[model] = described(formulas(extension.api.new_material(model, "nodes"), extension))
    monkeypatch.setattr(kept, "keep", refuse)
    new_file()
    for model in models:
        material = extension.api.new_material(model, "nodes")
        assert described(formulas(material, extension)) == made[model]
    assert len(bpy.data.libraries) == 0
    # A file contains parts that models share only once.
    names = [re.sub(r"\.\d+$", "", group.name) for group in bpy.data.node_groups]
    assert names.count(".brdfc lamp seen") == 1
    assert not [g.name for g in bpy.data.node_groups if g.users == 0 or g.library]
    for material in list(bpy.data.materials):
        bpy.data.materials.remove(material)
    extension.nodes.remove_unused_groups()
    assert not list(bpy.data.node_groups)


@pytest.mark.slow
def test_what_materials_add_to_a_file(extension, empty, tmp_path):
    """In bytes, compressed, as docs/nodes.md says: the first material brings the groups that all
    models share, others of its model next to nothing. In a Blender that has run long, addresses
    compress worse: 600, 200 and 700 KB; 493, 178 and 577 KB in a new one."""
    file = str(tmp_path / "grown.blend")
    sizes = []
    for model in (None, "phong", "phong", "ward", "factors"):
        if model:
            extension.api.new_material(model, "nodes").use_fake_user = True
        bpy.ops.wm.save_as_mainfile(filepath=file, compress=True, copy=True)
        sizes.append(Path(file).stat().st_size)
    first, again, ward, factors = np.diff(sizes)
    print("KB:", *(np.diff(sizes) // 1000))
    assert again < 5e3 and ward < 230e3 and first < 620e3 and factors < 750e3


@pytest.mark.slow
def test_parts_that_an_append_brings_again_are_merged(extension, empty, tmp_path):
    """Materials that are appended one by one share what their models have in common. Blender's own
    time for each append grows with the groups in the file."""
    parts = import_module(f"{extension.package}.content.part_groups")
    models = ("ward", "blinn", "microfacet")
    empty.cycles.shading_system = False
    for model in models:
        material = extension.api.new_material(model)
        material.name, material.use_fake_user = model, True
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))

    def digests():
        return sorted(g[parts.PART] for g in bpy.data.node_groups if parts.is_part(g))

    there = digests()
    shown = {m: described(bpy.data.materials[m].node_tree) for m in models}
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.context.scene.render.engine = "CYCLES"
    for model in (*models, "ward"):
        folder = f"{path}/Material/"
        assert bpy.ops.wm.append(directory=folder, filename=model) == {"FINISHED"}
    assert digests() == there and len(set(there)) == len(there) > 20
    for model in models:
        assert described(bpy.data.materials[model].node_tree) == shown[model]


def test_the_cursor_shows_that_nodes_are_built(extension, kept, monkeypatch):
    part_groups = import_module(f"{extension.package}.content.part_groups")
    shown, cursor = [], part_groups._wait_cursor

    @contextlib.contextmanager
    def recorded():
        with cursor():
            shown.append("busy")
            yield
        shown.append("done")

    monkeypatch.setattr(part_groups, "_wait_cursor", recorded)
    extension.api.new_material("ward", "nodes")
    assert shown == ["busy", "done"]
    new_file()
    extension.api.new_material("ward", "nodes")  # appended, which takes no time
    assert shown == ["busy", "done"]


@pytest.mark.slow
@pytest.mark.parametrize("content", [b"", b"no file of Blender", None])
def test_a_file_that_is_damaged_is_made_anew(extension, kept, content):
    made = described(formulas(extension.api.new_material("glass", "nodes"), extension))
    (path,) = kept._folder().iterdir()
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2] if content is None else content)
    new_file()
    material = extension.api.new_material("glass", "nodes")
    assert described(formulas(material, extension)) == made
    assert [p.stat().st_size > 1000 for p in kept._folder().iterdir()] == [True]


def test_files_of_other_versions_go(extension, kept):
    older = kept._folder() / "4.5.0-0123456789ab-0123456789abcdef.blend"
    older.write_bytes(b"")
    extension.api.new_material("glass", "nodes")
    (path,) = kept._folder().iterdir()
    assert path != older


def test_a_folder_that_can_not_be_made_matters_to_nobody(extension, kept, monkeypatch):
    def fail(*_, **__):
        raise ValueError("no such extension")

    monkeypatch.setattr(bpy.utils, "extension_path_user", fail)
    assert formulas(extension.api.new_material("glass", "nodes"), extension).nodes


def test_nothing_of_the_scene_is_kept(extension, kept):
    """It does not contain the lamps of the file in which a group was made."""
    light = bpy.data.lights.new("Lamp", "POINT")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Lamp", light))
    extension.api.new_material("ward", "nodes")
    (path,) = kept._folder().iterdir()
    with bpy.data.libraries.load(str(path)) as (there, _):
        assert there.node_groups and not there.objects and not there.scenes
        assert not [name for name in there.node_groups if name == ".brdfc Lamps"]
