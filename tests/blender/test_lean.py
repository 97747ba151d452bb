# SPDX-License-Identifier: GPL-3.0-or-later
"""Lean materials, baked from inside Blender with the program brdfc."""

import os
import sysconfig
import time
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import bpy
import helpers
import numpy as np
import pytest
from helpers import Layout, counts


@pytest.fixture
def used(extension, empty, kept_program, monkeypatch):
    """Materials of three models by name, one of them with a link."""
    monkeypatch.setenv("BRDFC_TOOL", str(kept_program))
    api = extension.api
    made = {
        "radziszewski_alda": api.new_material("radziszewski_alda", n=7.0, tint=(0.9, 0.5, 0.25)),
        "ward": api.new_material("ward", ax=0.25, normalisation="duer"),
        "coupled": api.new_material("coupled", r0=0.1, rm=(0.75, 0.5, 0.25)),
    }
    node = the_node(extension, made["ward"])
    value = made["ward"].node_tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = 0.5
    made["ward"].node_tree.links.new(value.outputs[0], extension.model_nodes.sockets(node)["ay"])
    for material in made.values():
        # An output that is not linked would be left out anyway.
        extension.api.add_albedo(material)
        emission = material.node_tree.nodes.new("ShaderNodeEmission")
        albedo = the_node(extension, material).outputs["Albedo"]
        material.node_tree.links.new(albedo, emission.inputs["Color"])
    return made


def the_node(extension, material):
    (node,) = extension.model_nodes.group_nodes(material)
    return node


def source(extension, material):
    """The text of all scripts in a material."""
    scripts = the_node(extension, material).node_tree.nodes
    return "".join(n.script.as_string() for n in scripts if n.bl_idname == "ShaderNodeScript")


def picture(extension, material):
    scene = bpy.data.scenes.new("Picture")
    scene.render.engine = "CYCLES"
    extension.api.enable_osl(scene)
    helpers.sphere_scene(scene, material, size=24, samples=64)
    found = helpers.render(scene)[..., :3]
    bpy.data.scenes.remove(scene)
    return found


@pytest.mark.long
@pytest.mark.slow
def test_lean_materials_show_the_same_and_hold_less(extension, used, tmp_path):
    api = extension.api
    values = {model: api.get_parameters(m) for model, m in used.items()}
    listed = api.used_materials()
    pictures = {model: picture(extension, m) for model, m in used.items()}
    sizes = {model: len(source(extension, m)) for model, m in used.items()}
    before = counts()

    plan = api.plan()
    lines = "\n".join(plan.lines())
    for words in ("ward, for Ward", "without parameter n: constant, n=7", "lambert", "bytes"):
        assert words in lines
    assert counts() == before, "a plan changes nothing"
    assert api.bake(plan) == 3
    # The file has no lamp, so no lean shader has a slot, and the group of lamps is removed. So are
    # three twins, one with an image, the albedos of ward and coupled, and the text that tells where
    # shaders run.
    less = {"node_groups": 4, "texts": 1, "images": 3}
    lean = before | {kind: before[kind] - count for kind, count in less.items()}
    assert counts() == lean, "groups and texts that nothing uses are left"
    assert extension.pack.root == extension.pack._INSTALLED

    free = {"radziszewski_alda": set(), "ward": {"ay"}, "coupled": set()}
    for model, material in used.items():
        node = the_node(extension, material)
        assert extension.model_nodes.is_baked(node)
        assert set(extension.model_nodes.sockets(node)) == free[model] | {"Normal", "Tangent"}
        # In coupled's short text, a table of three colours replaces a colour.
        part = 1.1 if model == "coupled" else 0.5
        assert len(source(extension, material)) < part * sizes[model]
        assert extension.model_nodes.uses_albedo(node)
        found = api.get_parameters(material)
        assert found.keys() == values[model].keys()
        for name, value in found.items():
            same = value if isinstance(value, str) else pytest.approx(value, rel=1e-6)
            assert values[model][name] == same
        # Only closures that no ray hits are left out; the noise differs.
        after = picture(extension, material)
        centre = (slice(8, 16), slice(8, 16))
        assert after[centre].mean() == pytest.approx(pictures[model][centre].mean(), rel=0.05)
    assert extension.model_nodes.sockets(the_node(extension, used["ward"]))["ay"].is_linked
    assert api.used_materials().keys() == listed.keys()
    for name, entry in api.used_materials().items():
        assert entry["parameters"] == listed[name]["parameters"]

    # The file keeps them when the pack is gone.
    path = tmp_path / "lean.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    material = bpy.data.materials["Coupled Matte/Specular"]
    assert extension.model_nodes.is_baked(the_node(extension, material))
    assert picture(extension, material)[8:16, 8:16].mean() == pytest.approx(
        pictures["coupled"][8:16, 8:16].mean(), rel=0.05
    )


@pytest.mark.long
@pytest.mark.slow
def test_a_farm_renders_a_lean_file_and_its_moving_lamp(
    extension, empty, kept_program, monkeypatch, tmp_path
):
    monkeypatch.setenv("BRDFC_TOOL", str(kept_program))
    extension.api.enable_osl(empty)
    material = extension.api.new_material("ward", "aimed", ax=0.3, ay=0.1)
    helpers.sphere_scene(empty, material, size=24, samples=16)
    lamp = bpy.data.objects.new("Key", bpy.data.lights.new("Key", "POINT"))
    lamp.data.energy, lamp.data.shadow_soft_size = 20000, 0.3
    empty.collection.objects.link(lamp)
    for frame, x in ((1, -3), (5, 3)):
        lamp.location = (x, -4, 2)
        lamp.keyframe_insert("location", frame=frame)
    empty.frame_set(1)
    extension.api.see_lamps(empty)
    assert extension.api.bake(extension.api.plan()) == 1
    expected = {}
    for frame in (1, 5):
        empty.frame_set(frame)
        expected[frame] = helpers.render(empty)
    left, right = (
        picture[:, :12, :3].sum() / picture[..., :3].sum() for picture in expected.values()
    )
    assert left > 0.55 and right < 0.45, "the lamp goes from left to right"
    path = tmp_path / "lean.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    found = helpers.render_without_the_extension(path, 5, tmp_path)
    assert np.array_equal(found, expected[5])


def test_a_lean_material_is_current_and_goes_back(extension, used, empty):
    api = extension.api
    material = used["coupled"]
    before = api.get_parameters(material)
    extension.api.enable_osl(empty)
    codes = [w.code for w in api.warnings(material, empty)]
    assert bpy.ops.brdfc.bake() == {"FINISHED"}
    assert [w.code for w in api.warnings(material, empty)] == codes
    layout = Layout()
    extension.ui.draw_material(layout, material, empty)
    text = "\n".join(layout.log)
    for part in ("Lean:", "Error:", "Cost:", "Albedo: 0", "operator brdfc.switch"):
        assert part in text
    with pytest.raises(ValueError, match="'r0' of .* the only value of a lean material"):
        api.set_parameters(material, r0=0.2)
    api.set_parameters(material, r0=0.1)
    api.switch_representation(material, "sampled")
    assert not extension.model_nodes.is_baked(the_node(extension, material))
    assert extension.model_nodes.identity(the_node(extension, material)) == ("coupled", "sampled")
    for name, value in api.get_parameters(material).items():
        same = value if isinstance(value, str) else pytest.approx(value, rel=1e-6)
        assert before[name] == same
    api.set_parameters(material, r0=0.2)


@pytest.mark.slow
def test_a_budget_takes_a_fit_in_place_of_drawing(extension, empty, kept_program):
    api = extension.api
    preferences = bpy.context.preferences.addons[extension.package].preferences
    preferences.program = str(kept_program)
    try:
        material = api.new_material("phong", e=40.0)
        assert bpy.ops.brdfc.bake(error=5) == {"FINISHED"}
    finally:
        preferences.program = ""
    node = the_node(extension, material)
    assert extension.model_nodes.identity(node) == ("phong", "fitted")
    assert extension.model_nodes.is_baked(node)
    assert api.get_parameters(material)["e"] == pytest.approx(40)
    assert np.isfinite(picture(extension, material)).all()


def lamp(name, kind, **settings):
    data = bpy.data.lights.new(name, kind)
    item = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(item)
    for key, value in settings.items():
        setattr(item if key == "hide_render" else data, key, value)
    return data


def test_lamps_without_a_size_are_told_of(extension, empty, program, monkeypatch, tmp_path):
    monkeypatch.setenv("BRDFC_TOOL", str(program))
    api = extension.api
    api.new_material("phong", e=40.0)
    for name, kind, settings in (
        ("Ball", "POINT", {"shadow_soft_size": 0.1}),
        ("Disk", "AREA", {"shadow_soft_size": 0.0}),
        ("Hidden", "POINT", {"shadow_soft_size": 0.0, "hide_render": True}),
        ("Wide Sun", "SUN", {"angle": 0.1, "shadow_soft_size": 0.0}),
    ):
        lamp(name, kind, **settings)
    file = tmp_path / "m.json"
    api.write_materials(file)
    assert file.read_text().count("sizeless_lamps") == 0

    def taken():
        (model,) = api.plan().explanation["models"]
        return [(c["form"], c["why"]) for c in model["choices"] if c["taken"]]

    ((form, why),) = taken()
    assert form == "aimed" and "without a size" not in why
    lamp("Spot", "SPOT", shadow_soft_size=0.0)
    lamp("Point", "POINT", shadow_soft_size=0.0)
    lamp("Sun", "SUN", angle=0.0)
    ((form, why),) = taken()
    assert form == "aimed" and "Point, Spot, Sun without a size" in why
    api.write_materials(file)
    assert '"Point",\n  "Spot",\n  "Sun"' in file.read_text()


def refused_and_unchanged(extension, material, match):
    before, group = counts(), the_node(extension, material).node_tree
    with pytest.raises(RuntimeError, match=match):
        bpy.ops.brdfc.bake()
    assert counts() == before
    assert the_node(extension, material).node_tree == group
    assert extension.pack.root == extension.pack._INSTALLED


def test_the_program_of_an_environment_is_found(extension, tmp_path, monkeypatch):
    """Where pip puts it: on the PATH if the environment is activated, otherwise beside the running
    Python."""
    for folder in ("path", "scripts"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "brdfc").symlink_to(os.environ["BRDFC_TOOL"])
    monkeypatch.delenv("BRDFC_TOOL")
    monkeypatch.setattr(sysconfig, "get_path", lambda name: str(tmp_path / name))
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    assert extension.lean.program() == str(tmp_path / "path" / "brdfc")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert extension.lean.program() == str(tmp_path / "scripts" / "brdfc")


def test_without_the_program_nothing_changes(extension, used, tmp_path, monkeypatch):
    material = used["coupled"]
    monkeypatch.delenv("BRDFC_TOOL")
    monkeypatch.setenv("PATH", str(tmp_path))
    refused_and_unchanged(extension, material, "The program brdfc was not found: give its path")
    monkeypatch.setenv("BRDFC_TOOL", str(tmp_path / "absent"))
    refused_and_unchanged(
        extension, material, "absent is not the program brdfc; BRDFC_TOOL names it"
    )
    fake = tmp_path / "brdfc"
    no_plan = "The program brdfc made no plan"
    for script, said, behind in (
        ("echo 'brdfc: no such thing' >&2; exit 2", no_plan, "no such thing"),
        ("exit 3", no_plan, "exit status 3"),
        ("echo no explanation", no_plan, "expected an explanation"),
        ('echo \'{"models": [], "unused_models": []}\'', "is damaged", "manifest.json"),
    ):
        fake.write_text(f"#!/bin/sh\n{script}\n")
        fake.chmod(0o755)
        monkeypatch.setenv("BRDFC_TOOL", str(fake))
        refused_and_unchanged(extension, material, said)
        with pytest.raises(RuntimeError, match=f"{said}.*{behind}"):
            extension.api.bake(extension.api.plan())


def test_a_shader_that_fails_to_compile_changes_nothing(extension, used, monkeypatch):
    compiler = import_module(f"{extension.package}.content.compiler")
    compile_, calls = compiler.compile_script, []

    def fail_second(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            raise extension.api.CompileError("as if it could not")
        compile_(*arguments)

    monkeypatch.setattr(compiler, "compile_script", fail_second)
    refused_and_unchanged(extension, used["coupled"], "as if it could not")
    assert len(calls) == 2


def test_a_file_without_models_has_nothing_to_bake(extension, empty):
    with pytest.raises(RuntimeError, match="No material of this file has a reflection model"):
        bpy.ops.brdfc.bake()


# ---- beside the interface ------------------------------------------------------------------------


class Stand(helpers.Stand):
    """An operator as Blender has it while it is modal; records what it finishes with."""

    finished = None

    def finish(self, context, result):
        self.finished = result
        return {"FINISHED"}


def run_through(stand, context, job, event="TIMER"):
    """Runs a modal operator; returns its final result."""
    assert stand.begin(context, job) == {"RUNNING_MODAL"}
    # Limited by time and not by events: how long the program takes depends on the machine's load.
    end = time.monotonic() + 300
    while time.monotonic() < end:
        result = stand.modal(context, SimpleNamespace(type=event))
        if result != {"RUNNING_MODAL"}:
            return result
    raise AssertionError("it does not end")


def test_plan_and_bake_go_on_beside_the_interface(extension, used, manager):
    operator = extension.operators.BRDFC_OT_bake
    stand = Stand(operator)
    before = counts()
    assert run_through(stand, manager.context, extension.api.start_plan()) == {"FINISHED"}
    assert manager.told[:3] == ["timer", "begin", "modal"]
    assert manager.told[-3:] == ["no timer", "end", None], "nothing of it is left on the screen"
    assert "Esc: cancel" in manager.told[4], "said before the program has said anything"
    assert counts() == before, "a plan changes nothing"
    plan = stand.finished
    apply = Stand(extension.operators.BRDFC_OT_bake_apply)
    assert run_through(apply, manager.context, extension.api.start_bake(plan)) == {"FINISHED"}
    assert apply.finished == 3
    assert all(extension.model_nodes.is_baked(the_node(extension, m)) for m in used.values())
    assert any(0 < t < 100 for t in manager.told if isinstance(t, float))


def test_esc_while_planning_ends_the_program_and_leaves_no_file(
    extension, used, manager, monkeypatch, tmp_path
):
    slow = tmp_path / "brdfc"
    slow.write_text("#!/bin/sh\necho 'brdfc build: 1/4 ward  0.1 s' >&2\nexec sleep 600\n")
    slow.chmod(0o755)
    monkeypatch.setenv("BRDFC_TOOL", str(slow))
    job = extension.api.start_plan()
    stand = Stand(extension.operators.BRDFC_OT_bake)
    stand.begin(manager.context, job)
    end = time.monotonic() + 60
    while 25.0 not in manager.told and time.monotonic() < end:
        assert stand.modal(manager.context, SimpleNamespace(type="TIMER")) == {"RUNNING_MODAL"}
    assert 25.0 in manager.told, "the share is what the program says"
    # Other events are blocked: what the user changed meanwhile would not be in the plan.
    assert stand.modal(manager.context, SimpleNamespace(type="A")) == {"RUNNING_MODAL"}
    assert stand.modal(manager.context, SimpleNamespace(type="MIDDLEMOUSE")) == {"PASS_THROUGH"}
    assert stand.modal(manager.context, SimpleNamespace(type="ESC")) == {"CANCELLED"}
    assert "nothing is changed" in stand.reports[0][1]
    assert job._process.poll() is not None
    assert not Path(job._folder.name).exists()
    job.cancel()


def test_esc_while_baking_leaves_the_file_as_it_was(extension, used, manager):
    plan = extension.api.plan()
    before = counts()
    groups = {name: the_node(extension, m).node_tree for name, m in used.items()}
    stand = Stand(extension.operators.BRDFC_OT_bake_apply)
    stand.begin(manager.context, extension.api.start_bake(plan))
    for _ in range(2):
        assert stand.modal(manager.context, SimpleNamespace(type="TIMER")) == {"RUNNING_MODAL"}
    assert counts() != before, "two models are made by now"
    assert extension.pack.root == extension.pack._INSTALLED, "panels are drawn meanwhile"
    assert stand.modal(manager.context, SimpleNamespace(type="ESC")) == {"CANCELLED"}
    assert counts() == before
    for name, material in used.items():
        assert the_node(extension, material).node_tree == groups[name]


def test_a_failure_beside_the_interface_is_said_and_changes_nothing(
    extension, used, manager, monkeypatch, tmp_path
):
    fake = tmp_path / "brdfc"
    fake.write_text("#!/bin/sh\necho 'brdfc: no such thing' >&2\nexit 2\n")
    fake.chmod(0o755)
    monkeypatch.setenv("BRDFC_TOOL", str(fake))
    before = counts()
    stand = Stand(extension.operators.BRDFC_OT_bake)
    job = extension.api.start_plan()
    assert run_through(stand, manager.context, job) == {"CANCELLED"}
    assert [text for _, text in stand.reports] == [
        "brdfc: no such thing",
        "The program brdfc made no plan",
    ]
    assert counts() == before
    assert manager.told[-3:] == ["no timer", "end", None]


def test_a_fault_beside_the_interface_ends_the_job(extension, used, manager):
    """The timer and the status text stayed."""
    ended = []

    def step():
        raise KeyError("as if the job had a fault")

    job = SimpleNamespace(step=step, cancel=lambda: ended.append("cancel"))
    stand = Stand(extension.operators.BRDFC_OT_bake)
    stand.begin(manager.context, job)
    with pytest.raises(KeyError):
        stand.modal(manager.context, SimpleNamespace(type="TIMER"))
    assert ended == ["cancel"] and manager.told[-3:] == ["no timer", "end", None]


@pytest.mark.parametrize("osl", [False, True], ids=["nodes", "osl"])
def test_a_material_whose_albedo_is_read(extension, empty, kept_program, monkeypatch, osl):
    """A coat reads it. Lean Formula Nodes lack it, and baking took the groups of all materials."""
    monkeypatch.setenv("BRDFC_TOOL", str(kept_program))
    empty.cycles.shading_system = osl
    coated, other = extension.api.new_material("lambert"), extension.api.new_material("ward")
    extension.api.add_coat(coated)
    ball = helpers.add_sphere(empty, coated)
    ball.data.materials.append(other)
    before = {n: n.node_tree for m in (coated, other) for n in extension.model_nodes.group_nodes(m)}
    assert extension.api.bake(extension.api.plan()) == (3 if osl else 2)
    for node, group in before.items():
        linked = any(o.name == "Albedo" and o.is_linked for o in node.outputs)
        assert extension.model_nodes.is_baked(node) == (osl or not linked)
        assert (node.node_tree == group) == (linked and not osl)


@pytest.mark.parametrize("whole", [0, 2])
def test_how_many_nodes_stay_whole_is_said(extension, whole):
    reports = []
    told = SimpleNamespace(
        job=SimpleNamespace(whole=whole), report=lambda kind, text: reports.append(text)
    )
    extension.operators.BRDFC_OT_bake_apply.finish(told, None, 3)
    assert [text.endswith(": 2") for text in reports[1:]] == [True] * (whole > 0)


def test_a_fault_while_groups_are_put_in_place_restores_all(
    extension, used, kept_program, monkeypatch
):
    plan, before = extension.api.plan(), counts()
    groups = {name: the_node(extension, m).node_tree for name, m in used.items()}
    replace, calls = extension.exchange.replace_group, []

    def fail_second(node, group):
        calls.append(group)
        if len(calls) == 2:
            raise KeyError("as if an output were missing")
        replace(node, group)

    monkeypatch.setattr(extension.exchange, "replace_group", fail_second)
    with pytest.raises(KeyError):
        extension.api.bake(plan)
    assert {name: the_node(extension, m).node_tree for name, m in used.items()} == groups
    assert counts() == before


def test_without_a_plan_there_is_none_to_show_or_to_bake(extension, empty):
    assert not bpy.ops.brdfc.bake_plan.poll()
    assert not bpy.ops.brdfc.bake_apply.poll()
