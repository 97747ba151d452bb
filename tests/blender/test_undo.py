# SPDX-License-Identifier: GPL-3.0-or-later
"""Every operator that changes the file is a single undo step, which restores everything."""

import json

import bpy
import pytest

#: Operators that change no data of the file need no undo.
CHANGE_NOTHING = {
    "brdfc.write_materials",
    "brdfc.details",
    "brdfc.more",
    "brdfc.bake_plan",
    "brdfc.add_library",
    "brdfc.remove_library",
    "brdfc.new_measured_library",
}


@pytest.fixture
def start(extension, empty):
    """start(model, **parameters): an object with that material, at the beginning of the undo
    history. After undo, data-blocks are new objects and must be looked up again."""

    def make(model="ward", **parameters):
        extension.scene_loader.apply_clean_settings(empty)
        material = extension.api.new_material(model, **parameters)
        mesh = bpy.data.meshes.new("Mesh")
        mesh.materials.append(material)
        item = bpy.data.objects.new("Item", mesh)
        empty.collection.objects.link(item)
        bpy.context.view_layer.objects.active = item
        bpy.ops.ed.undo_push(message="Start")
        return material.name

    return make


def plain(value):
    return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def tree_state(tree):
    sockets = {
        f"{node.name}/{socket.identifier}": plain(socket.default_value)
        for node in tree.nodes
        for socket in node.inputs
        if hasattr(socket, "default_value")
    }
    links = sorted(
        (k.from_node.name, k.from_socket.identifier, k.to_node.name, k.to_socket.identifier)
        for k in tree.links
    )
    groups = {n.name: n.node_tree.name for n in tree.nodes if getattr(n, "node_tree", None)}
    targets = {n.name: n.target for n in tree.nodes if hasattr(n, "target")}
    return [sorted(n.name for n in tree.nodes), sockets, links, groups, targets]


def state():
    """Everything in the file that the extension's operators may change, as text."""
    scene = bpy.context.scene
    found = {
        "render": [
            scene.render.engine,
            scene.cycles.device,
            scene.cycles.shading_system,
            scene.cycles.use_guiding,
        ],
        "texts": {t.name: hash(t.as_string()) for t in bpy.data.texts},
        "groups": {g.name: len(g.nodes) for g in bpy.data.node_groups},
        "materials": {
            m.name: [m.cycles.use_bump_map_correction, *tree_state(m.node_tree)]
            for m in bpy.data.materials
        },
        "slots": {o.name: [s.name for s in o.material_slots] for o in bpy.data.objects},
    }
    return json.dumps(found, sort_keys=True)


def node_name(extension):
    (node,) = extension.model_nodes.group_nodes(bpy.context.object.active_material)
    return node.name


def is_one_step(run):
    before = state()
    assert run() == {"FINISHED"}
    # When called from a script, an operator leaves the undo step to the caller.
    bpy.ops.ed.undo_push(message="Operator")
    after = state()
    assert after != before, "it changes something"
    assert bpy.ops.ed.undo() == {"FINISHED"}
    assert state() == before
    assert bpy.ops.ed.redo() == {"FINISHED"}
    assert state() == after


def test_every_operator_that_changes_the_file_has_undo(extension):
    for cls in extension.operators._CLASSES:
        if not issubclass(cls, bpy.types.Operator):
            continue
        assert ("UNDO" in cls.bl_options) == (cls.bl_idname not in CHANGE_NOTHING), cls.bl_idname


def test_new_material(extension, start):
    start()
    is_one_step(lambda: bpy.ops.brdfc.new_material(model="coupled"))


def test_search(extension, start):
    start()
    is_one_step(lambda: bpy.ops.brdfc.search(model="coupled"))


def test_settings(extension, start):
    start()
    scene = bpy.context.scene
    scene.cycles.shading_system, scene.render.engine = False, "BLENDER_WORKBENCH"
    bpy.ops.ed.undo_push(message="Spoil")
    is_one_step(bpy.ops.brdfc.enable_osl)


def test_guiding(extension, start):
    start()
    bpy.context.scene.cycles.use_guiding = True
    bpy.ops.ed.undo_push(message="Spoil")
    is_one_step(bpy.ops.brdfc.no_guiding)


def test_fix_material(extension, start):
    start("phong", representation="fitted")
    bpy.context.object.active_material.cycles.use_bump_map_correction = True
    bpy.ops.ed.undo_push(message="Spoil")
    is_one_step(bpy.ops.brdfc.fix_material)


def test_switch(extension, start):
    start("ward", ax=0.25)
    name = node_name(extension)
    is_one_step(lambda: bpy.ops.brdfc.switch(node=name, representation="sampled"))


def test_add_albedo(extension, start):
    start("ashikhmin_shirley")
    name = node_name(extension)
    is_one_step(lambda: bpy.ops.brdfc.add_albedo(node=name))


def test_add_coat(extension, start):
    start("lambert")
    is_one_step(bpy.ops.brdfc.add_coat)


def test_kernel(extension, start):
    start("lossless")
    tree = bpy.context.object.active_material.node_tree
    tree.nodes.new("ShaderNodeFloatCurve").mapping.curves[0].points[1].location = (1, 0.25)
    tree.nodes["Float Curve"].mapping.curves[0].points[0].location = (0, 1)
    tree.nodes["Float Curve"].mapping.update()
    bpy.ops.ed.undo_push(message="Draw")
    name = node_name(extension)
    is_one_step(lambda: bpy.ops.brdfc.kernel(node=name))


def test_update(extension, start):
    start("ward", ax=0.25)
    (node,) = extension.model_nodes.group_nodes(bpy.context.object.active_material)
    node.node_tree[extension.model_nodes.TAG]["digest"] = "of another version"
    node.node_tree.name = "Old"
    bpy.ops.ed.undo_push(message="Age")
    is_one_step(bpy.ops.brdfc.update)


def test_find_lamps(extension, start):
    """The list of lamps is also updated automatically: this only tests that undo works."""
    start("ward")
    assert bpy.ops.brdfc.find_lamps() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="Lamps")
    before = state()
    bpy.ops.brdfc.new_material(model="lambert")
    bpy.ops.ed.undo_push(message="Material")
    assert bpy.ops.ed.undo() == {"FINISHED"}
    assert state() == before


@pytest.fixture
def with_program(kept_program, monkeypatch):
    monkeypatch.setenv("BRDFC_TOOL", str(kept_program))


def test_bake(extension, start, with_program):
    start("coupled", r0=0.1)
    is_one_step(bpy.ops.brdfc.bake)


def test_details_say_what_the_panel_leaves_out(extension, start):
    start("oren_nayar", representation="fitted")
    (node,) = extension.model_nodes.group_nodes(bpy.context.object.active_material)
    form, _ = extension.model_nodes.manifest_entry(node)
    assert extension.ui.error_text(form["error"]).endswith(" %")
    lines = extension.ui.details(node, form)
    assert any(line.startswith("Fraction of the reflected light") for line in lines)
    assert any("Closures of Cycles: " in line for line in lines)
    before = state()
    assert bpy.ops.brdfc.details(node=node.name) == {"FINISHED"}
    assert state() == before
    for model, entry in extension.api.models().items():
        for form in entry["representations"].values():
            assert "L1" not in extension.ui.error_text(form["error"]), model
