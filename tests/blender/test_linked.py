# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of another file, linked and as library overrides: they can be read, and a change that
the saved file would not keep is refused with a sentence."""

import dataclasses
import re
from importlib import import_module

import bpy
import helpers
import pytest

#: Operators that change the active material.
CHANGING = ("switch", "fix_material", "add_albedo", "kernel", "substance", "convert_back")
MODELS = ("phong", "lossless", "fresnel_conductor")


@pytest.fixture
def library(extension, empty, tmp_path):
    """A file with a material for each of the models, named after it; that of Phong is on a ball."""
    for model in MODELS:
        material = extension.api.new_material(model)
        material.name, material.use_fake_user = model, True
        material.node_tree.nodes.new("ShaderNodeFloatCurve")
    phong = bpy.data.materials["phong"]
    extension.api.switch_representation(phong, "sampled")
    extension.api.set_parameters(phong, e=20.0)
    helpers.add_sphere(empty, phong)
    principled = bpy.data.materials.new("principled")
    principled.use_fake_user = True
    if principled.node_tree is None:  # before 5.0
        principled.use_nodes = True
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    extension.scene_loader.apply_clean_settings(bpy.context.scene)
    extension.api.enable_osl(bpy.context.scene)
    return path


def linked(path, kind, name):
    with bpy.data.libraries.load(str(path), link=True) as (_, to):
        setattr(to, kind, [name])
    return getattr(to, kind)[0]


def overridden(path, kind, name):
    return linked(path, kind, name).override_create(remap_local_usages=True)


def put_on_a_ball(material):
    """It then is the active material."""
    item = helpers.add_sphere(bpy.context.scene, material)
    bpy.context.view_layer.objects.active = item


def make_active(item):
    if item.name not in bpy.context.scene.collection.objects:
        bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item


@pytest.fixture(params=[linked, overridden])
def foreign(library, request):
    """foreign(name): a material of that file in a new one, as the active material."""

    def get(name):
        material = request.param(library, "materials", name)
        put_on_a_ball(material)
        return material

    return get


def state(extension, material):
    (node,) = extension.model_nodes.group_nodes(material)
    return extension.model_nodes.identity(node), extension.model_nodes.all_values(node)


def reopened(tmp_path):
    path = tmp_path / "reopened.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))


def set_kernel(api, material):
    tree = material.node_tree.nodes
    api.set_kernel(tree["Group"], tree["Float Curve"])


WRITES = [
    ("phong", lambda api, m: api.switch_representation(m, "aimed")),
    ("phong", lambda api, m: api.set_parameters(m, e=30.0)),
    ("phong", lambda api, m: api.prepare_material(m)),
    ("phong", lambda api, m: api.add_albedo(m)),
    ("phong", lambda api, m: api.convert_back(m)),
    ("fresnel_conductor", lambda api, m: api.set_substance(m, "gold")),
    ("lossless", set_kernel),
]


@pytest.mark.parametrize(("name", "write"), WRITES)
def test_scripts_are_told_why_nothing_is_changed(extension, foreign, name, write):
    material = foreign(name)
    before = state(extension, material)
    with pytest.raises(ValueError, match=rf"'{name}' is .*library\.blend.*: Make Local first"):
        write(extension.api, material)
    assert state(extension, material) == before


def test_what_only_reads_works(extension, foreign):
    material = foreign("phong")
    api = extension.api
    assert api.get_parameters(material)["e"] == pytest.approx(20)
    assert api.warnings(material, bpy.context.scene) == []
    assert api.used_materials()["phong"]["representation"] == "sampled"
    assert api.plan_conversion([material]) == []


def test_nodes_of_other_files_are_not_converted(extension, foreign):
    api = extension.api
    (plan,) = api.plan_conversion([foreign("principled")])
    assert re.search(r"stays, 'principled' is .*library\.blend.*: Make Local first", plan.line())
    assert api.convert_materials([plan]) == 0
    possible = dataclasses.replace(plan, model="lambert", refusal="")
    with pytest.raises(ValueError, match="'principled' is .*: Make Local first"):
        api.convert_materials([possible])
    assert bpy.ops.brdfc.make_local() == {"FINISHED"}
    (plan,) = api.plan_conversion([bpy.context.object.active_material])
    assert not plan.refusal and api.convert_materials([plan]) == 1


def test_buttons_are_greyed_and_say_why(extension, foreign):
    material = foreign("phong")
    for name in CHANGING:
        assert not getattr(bpy.ops.brdfc, name).poll(), name
    assert bpy.ops.brdfc.details.poll() and bpy.ops.brdfc.make_local.poll()
    with pytest.raises(RuntimeError, match=r"library\.blend.*: Make Local first"):
        bpy.ops.brdfc.switch(node="Group", representation="aimed")
    layout = helpers.Layout()
    extension.ui.draw_material(layout, material, bpy.context.scene)
    assert "Make Local first" in " ".join(layout.log)
    assert layout.log.count("operator brdfc.make_local Make Local") == 1
    extension.ui.draw_material(layout, foreign("lossless"), bpy.context.scene)
    extension.ui.draw_material(layout, foreign("fresnel_conductor"), bpy.context.scene)
    greyed = {"brdfc.switch", "brdfc.add_albedo", "brdfc.kernel", "brdfc.substance"}
    assert layout.greyed == greyed


def test_find_lamps_says_that_a_material_uses_those_of_its_file(extension, foreign):
    """It said how many lamps it had found, none of which the material uses."""
    operator = import_module(f"{extension.package}.operators.settings").BRDFC_OT_find_lamps
    foreign("lossless")
    helpers.add_lamp(bpy.context.scene, "POINT", location=(2, -3, 2))

    def reports():
        stand = helpers.Stand(operator)
        assert stand.execute(bpy.context) == {"FINISHED"}
        assert stand.reports[0][1].startswith("Lamps that leave little noise: 1 of 1")
        return stand.reports[1:]

    (((kind,), said),) = reports()
    expected = r"'lossless' uses the lamps of .*library\.blend, from which it is linked: Make Local"
    assert kind == "WARNING" and re.match(expected, said)
    assert bpy.ops.brdfc.make_local() == {"FINISHED"}
    assert reports() == []
    foreign("phong")  # sends no rays to lamps
    assert reports() == []


def test_buttons_of_the_files_own_materials_are_not_greyed(extension, library):
    layout = helpers.Layout()
    for model in MODELS:
        put_on_a_ball(extension.api.new_material(model))
        for name in CHANGING:
            assert getattr(bpy.ops.brdfc, name).poll()
        material = bpy.context.object.active_material
        extension.ui.draw_material(layout, material, bpy.context.scene)
    assert layout.greyed == set() and "operator brdfc.kernel " in layout.log
    assert "Make Local" not in " ".join(layout.log)


def test_all_materials_are_all_that_can_be_changed(extension, foreign):
    theirs = foreign("phong")
    before = state(extension, theirs)
    own = [extension.api.new_material("phong", "sampled") for _ in range(2)]
    put_on_a_ball(own[0])
    shown = [extension.model_nodes.group_nodes(material)[0] for material in own]
    assert bpy.ops.brdfc.switch(node="Group", representation="aimed", all_users=True) == {
        "FINISHED"
    }
    assert [extension.model_nodes.identity(node).form for node in shown] == ["aimed", "aimed"]
    assert state(extension, theirs) == before
    names = [g.name for g in bpy.data.node_groups if g.library is None]
    assert not [name for name in names if "sampled" in name], "no group stays behind"


def test_a_linked_group_in_the_files_own_material(extension, library):
    """The node that contains the model belongs to another file, the material does not."""
    material = bpy.data.materials.new("own")
    tree = helpers.empty_tree(material)
    inner = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    extension.nodes.add_group_node(inner, "phong", "sampled")
    tree.nodes.new("ShaderNodeGroup").node_tree = inner
    material.use_fake_user = True
    path = library.with_name("group.blend")
    bpy.data.libraries.write(str(path), {inner}, fake_user=True)
    tree.nodes[0].node_tree = linked(path, "node_groups", "inner")
    put_on_a_ball(material)
    (node,) = extension.model_nodes.group_nodes(material)
    assert node.id_data.library is not None
    with pytest.raises(ValueError, match=r"'inner' is linked from .*group\.blend"):
        extension.api.switch_representation(material, "aimed")
    with pytest.raises(RuntimeError, match=r"'inner' is linked from .*group\.blend"):
        bpy.ops.brdfc.switch(node=node.name, representation="aimed")
    layout = helpers.Layout()
    extension.ui.draw_material(layout, material, bpy.context.scene)
    assert "brdfc.switch" in layout.greyed and "'inner' is linked" in " ".join(layout.log)
    assert bpy.ops.brdfc.make_local() == {"FINISHED"}
    extension.api.switch_representation(material, "aimed")


def changed_and_kept(extension, tmp_path):
    """Whether the active material, after Make Local, accepts changes that its file keeps."""
    assert bpy.ops.brdfc.make_local() == {"FINISHED"}
    material = bpy.context.object.active_material
    extension.api.set_parameters(material, e=30.0)
    (node,) = extension.model_nodes.group_nodes(material)
    assert bpy.ops.brdfc.switch(node=node.name, representation="aimed") == {"FINISHED"}
    name = bpy.context.object.name
    reopened(tmp_path)
    material = bpy.data.objects[name].active_material
    (form, values) = state(extension, material)
    assert form == ("phong", "aimed") and values["e"] == pytest.approx(30)


def test_made_local_it_can_be_changed(extension, foreign, tmp_path):
    foreign("phong")
    changed_and_kept(extension, tmp_path)


def test_a_material_without_nodes_is_local_already(extension, empty):
    material = bpy.data.materials.new("Plain")  # before 5.0 it has no node tree
    assert extension.api.make_local(material) == material


@pytest.mark.parametrize("get", [linked, overridden])
def test_made_local_with_its_object(extension, library, tmp_path, get):
    make_active(get(library, "objects", "Sphere"))
    assert not bpy.ops.brdfc.switch.poll()
    changed_and_kept(extension, tmp_path)


def test_a_script_makes_the_material_of_a_linked_object_local(extension, library):
    """The linked object keeps its material, which is as it was."""
    item = linked(library, "objects", "Sphere")
    make_active(item)
    theirs = item.data.materials[0]
    before = state(extension, theirs)
    material = extension.api.make_local(theirs)
    assert material.library is None and item.data.materials[0] == theirs != material
    assert state(extension, theirs) == before
    (node,) = extension.model_nodes.group_nodes(material)
    assert node.node_tree.library is None
    extension.api.set_parameters(material, e=30.0)
    extension.api.switch_representation(material, "aimed")
    assert state(extension, theirs) == before


def test_new_materials_are_for_what_keeps_them(extension, library, tmp_path):
    item = overridden(library, "objects", "Sphere")
    make_active(item)
    with pytest.raises(RuntimeError, match=r"'Sphere' is linked from .*library\.blend"):
        bpy.ops.brdfc.new_material(model="lambert")
    item.data.override_create(remap_local_usages=True)
    assert bpy.ops.brdfc.new_material(model="lambert") == {"FINISHED"}
    name = item.active_material.name
    reopened(tmp_path)
    assert bpy.context.object.active_material.name == name


def test_overrides_keep_no_values(library, tmp_path):
    """The reason why they are refused."""
    material = overridden(library, "materials", "phong")
    material.use_fake_user = True
    sockets = material.node_tree.nodes["Group"].inputs
    sockets["Exponent"].default_value = 30
    reopened(tmp_path)
    (material,) = [m for m in bpy.data.materials if m.name == "phong" and m.library is None]
    assert material.override_library is not None
    assert material.node_tree.nodes["Group"].inputs["Exponent"].default_value == 20
