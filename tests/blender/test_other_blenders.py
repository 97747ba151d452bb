# SPDX-License-Identifier: GPL-3.0-or-later
"""Choices in files of another version of Blender, where their sockets are of another type."""

import bpy
import pytest
from converting import flat

VALUES = {"normalisation": "duer", "ax": 0.5, "ay": 0.5, "ks": (1.0, 1.0, 1.0)}


@pytest.fixture
def like_before(extension, monkeypatch):
    """Makes groups as Blender before 5.0 does, until the returned function is called."""
    if bpy.app.version < (5, 0):
        pytest.skip("a Blender without menus can't make them")
    from bl_ext.user_default.brdfc_shaders.content import group_content, group_sockets, kept_groups

    for module in (group_sockets, group_content):
        monkeypatch.setattr(module, "has_menus", lambda: False)
    # The cache has groups of this Blender.
    monkeypatch.setattr(kept_groups, "append", lambda digest: [])
    monkeypatch.setattr(kept_groups, "keep", lambda group, digest: None)
    return monkeypatch.undo


def choice(material):
    node = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeGroup")
    return next(s for s in node.inputs if s.name == "Normalisation")


def mean(scene, material):
    return flat(scene, material)[0][0]


@pytest.mark.parametrize("form", ["auto", "nodes", "sampled"])
def test_a_choice_survives_opening_and_what_makes_its_group_anew(
    extension, empty, like_before, tmp_path, form
):
    api, path = extension.api, tmp_path / "before.blend"
    made = api.new_material("ward", form, **VALUES)
    made.use_fake_user = True
    name, before = made.name, mean(empty, made)
    assert choice(made).type == "INT"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    like_before()
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene, made = bpy.context.scene, bpy.data.materials[name]
    assert choice(made).type == "MENU"
    for osl in (False, True, False):
        scene.cycles.shading_system = osl
        bpy.context.view_layer.update()
        assert api.get_parameters(made)["normalisation"] == "duer"
        if osl or form != "sampled":
            assert mean(scene, made) == pytest.approx(before, abs=0.01)
    # Another choice is 0.06 brighter.
    api.set_parameters(made, normalisation="bounded")
    assert mean(scene, made) > before + 0.03 or form == "sampled"


def test_what_is_appended_keeps_its_choice_beside_the_same_model(
    extension, empty, like_before, tmp_path
):
    path = tmp_path / "before.blend"
    extension.api.new_material("ward", **VALUES).name = "Appended"
    bpy.data.materials["Appended"].use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    like_before()
    bpy.ops.wm.read_homefile(use_empty=True)
    here = extension.api.new_material("ward", normalisation="ward")
    bpy.ops.wm.append(directory=f"{path}/Material/", filename="Appended")
    made = bpy.data.materials["Appended"]
    assert choice(made).type == "MENU"
    assert extension.api.get_parameters(made)["normalisation"] == "duer"
    assert extension.api.get_parameters(here)["normalisation"] == "ward"


def test_a_linked_choice_stays_a_number_and_its_group_as_it_is(
    extension, empty, like_before, tmp_path
):
    path = tmp_path / "before.blend"
    made = extension.api.new_material("ward", **VALUES)
    made.use_fake_user = True
    name = made.name
    source = made.node_tree.nodes.new("ShaderNodeValue")
    source.outputs[0].default_value = 1
    made.node_tree.links.new(source.outputs[0], choice(made))
    before = mean(empty, made)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    like_before()
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene, made = bpy.context.scene, bpy.data.materials[name]
    scene.cycles.shading_system = True
    bpy.context.view_layer.update()
    assert choice(made).type == "INT"
    assert mean(scene, made) == pytest.approx(before, abs=0.01)


def test_a_save_writes_choices_for_blenders_that_read_no_menus(extension, empty, tmp_path):
    made = extension.api.new_material("ward", **VALUES)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    node = next(n for n in made.node_tree.nodes if n.bl_idname == "ShaderNodeGroup")
    if bpy.app.version < (5, 0):
        assert "brdfc_choices" not in node
    else:
        assert node["brdfc_choices"].to_dict() == {"normalisation": "duer"}
