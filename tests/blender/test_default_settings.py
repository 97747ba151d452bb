# SPDX-License-Identifier: GPL-3.0-or-later
"""What users get who change no settings: in a new file Open Shading Language is off, and materials
of the form "auto" must be right nevertheless, and follow when the setting changes."""

import math

import bpy
import numpy as np
import pytest
from helpers import (
    add_camera,
    add_sphere,
    add_world,
    compiled_once,
    node_material,
    render,
    render_without_the_extension,
)

BLOCK = 8
#: Width and height in pixels of a model's part of the picture.
PLACE = 32
COLUMNS = 6


@pytest.fixture
def new_file(extension):
    """A new file with Cycles, without the cube."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    assert not scene.cycles.shading_system
    return scene


def few_samples(scene, samples, size=16):
    scene.cycles.samples, scene.cycles.use_denoising = samples, False
    scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x = scene.render.resolution_y = size


def form_of(extension, material):
    (node,) = extension.model_nodes.group_nodes(material)
    return extension.model_nodes.identity(node).form


def update(scene):
    """The event after a user's click, which a script's assignment does not cause."""
    scene.update_tag()
    bpy.context.view_layer.update()


def native(extension, model):
    form = extension.pack.model(model).native_form
    return form and form.name


def gallery(scene, materials):
    """Balls, one for each material, in rows in front of the camera."""
    rows = math.ceil(len(materials) / COLUMNS)
    for index, material in enumerate(materials):
        ball = add_sphere(scene, material, segments=64)
        ball.location = (2.2 * (index % COLUMNS), 0, 2.2 * (index // COLUMNS))
        # Filter Glossy would change closures seen in a mirror, differently for each kind.
        ball.visible_diffuse = ball.visible_glossy = False
    width, height = 2.2 * COLUMNS, 2.2 * rows
    where = (width / 2 - 1.1, -20, height / 2 - 1.1)
    add_camera(scene, where, (math.pi / 2, 0, 0), orthographic=max(width, height))
    scene.render.resolution_x, scene.render.resolution_y = PLACE * COLUMNS, PLACE * rows
    bpy.data.objects["Light"].location = (width / 2, -7, height / 2 + 4)


def blocks(picture, index):
    """Means of the blocks of pixels in a model's part of the picture."""
    row, column = divmod(index, COLUMNS)
    part = picture[row * PLACE : (row + 1) * PLACE, column * PLACE : (column + 1) * PLACE]
    side = PLACE // BLOCK
    return part.reshape(side, BLOCK, side, BLOCK).mean((1, 3)).ravel()


@pytest.mark.long
@pytest.mark.slow
def test_every_model_in_a_new_file(extension, new_file, few_of):
    """Materials of the menu *Add > Shader > brdfc* must be right and have no warnings.

    In a new file, with its lamp, world and settings, the form without Open Shading Language is
    compared with the one with it, which is known to match the reference renderer: means of balls,
    and blocks of pixels within the noise."""
    models = [m for m in few_of(extension.api.models(), 6) if native(extension, m)]
    materials = [extension.api.new_material(model) for model in models]
    few_samples(new_file, 24)
    gallery(new_file, materials)
    update(new_file)
    for model, material in zip(models, materials, strict=True):
        assert form_of(extension, material) == native(extension, model) == "nodes", model
        assert extension.api.warnings(material, new_file) == [], model
    found = {}
    for osl in (False, True):
        new_file.cycles.shading_system = osl
        pictures = []
        with compiled_once(new_file):
            for new_file.cycles.seed in range(4):
                pictures.append(render(new_file)[..., 1])
        forms = {form_of(extension, material) for material in materials}
        assert forms == ({"exact", "aimed"} if osl else {"nodes"})
        found[osl] = np.array([[blocks(p, i) for p in pictures] for i in range(len(models))])
    for model, off, on in zip(models, found[False], found[True], strict=True):
        count = len(off)
        errors = [x.mean(1).var(ddof=1) / count for x in (off, on)]
        relative = off.mean() / on.mean() - 1
        error = math.sqrt(sum(errors)) / on.mean()
        # The standard error is estimated from four pictures, and may be half of the true one.
        assert abs(relative) < 6 * error + 5e-3, f"{model}: {relative:+.2%} \u00b1 {error:.2%}"
        noise = (off.var(0, ddof=1) + on.var(0, ddof=1)) / count
        # Excludes the noisiest block, where a mirror shows the small lamp by chance.
        lit = (on.mean(0) > 0.02 * on.mean(0).max()) & (noise < noise.max())
        apart = (off.mean(0) - on.mean(0))[lit] ** 2
        # Besides the noise, each block may differ by half a percent of the ball's light: twins
        # differ by 1 to 26 %.
        allowed = noise[lit].sum() + lit.sum() * (5e-3 * on.mean()) ** 2
        assert apart.sum() / allowed < 3.5, f"{model}: blocks {apart.sum() / allowed:.2f}"


def test_rough_glass_in_a_new_file_is_a_node_of_blender_and_says_so(extension, new_file):
    """No node sends rays through a surface in a direction of its own."""
    material = extension.api.new_material("rough_glass", alpha=0.09)
    update(new_file)
    assert native(extension, "rough_glass") is None
    (found,) = extension.api.warnings(material, new_file)
    assert found.code == "osl_off"
    assert "Blender's own nodes stand in" in found.message
    (node,) = extension.model_nodes.group_nodes(material)
    (glass,) = [n for n in node.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfGlass"]
    assert glass.distribution == "GGX"
    assert glass.inputs["Roughness"].links[0].from_node.operation == "SQRT"
    new_file.cycles.shading_system = True
    update(new_file)
    assert extension.api.warnings(material, new_file) == []


def state(tree):
    """Values, links, drivers and animation of a material's tree."""
    values = {
        (node.name, socket.identifier): getattr(socket, "default_value", None)
        for node in tree.nodes
        for socket in node.inputs
    }
    data = tree.animation_data
    return (
        {k: tuple(v) if hasattr(v, "__len__") else v for k, v in values.items()},
        [(k.from_socket.path_from_id(), k.to_socket.path_from_id()) for k in tree.links],
        sorted(curve.data_path for curve in data.drivers) if data else [],
        sorted(c.data_path for c in animated(data)) if data and data.action else [],
    )


def animated(data):
    return [
        curve
        for layer in data.action.layers
        for strip in layer.strips
        for bag in strip.channelbags
        for curve in bag.fcurves
    ]


def moving_material(extension, model="lambertian_specular"):
    """A material with a link, a driver and an animated value."""
    material = extension.api.new_material(model, rs=0.3)
    (node,) = extension.model_nodes.group_nodes(material)
    found, tree = extension.model_nodes.sockets(node), material.node_tree
    color = tree.nodes.new("ShaderNodeRGB")
    color.outputs[0].default_value = (0.2, 0.6, 0.3, 1)
    tree.links.new(color.outputs[0], found["rd"])
    found["rs"].keyframe_insert("default_value", frame=1)
    found["rs"].default_value = 0.9
    found["rs"].keyframe_insert("default_value", frame=11)
    driver = color.outputs[0].driver_add("default_value", 2).driver
    driver.type, driver.expression = "SCRIPTED", "0.3 + frame / 50"
    return material


@pytest.mark.slow
@pytest.mark.many
@pytest.mark.parametrize(
    ("kind", "watts", "warned"),
    [("SUN", 1, False), ("SPOT", 1000, False), ("AREA", 20, False), ("AREA", 1000, True)],
)
def test_a_clamp_that_takes_no_light_is_no_finding(extension, new_file, kind, watts, warned):
    """Blender clamps indirect light at 10 in a new file. Of formula nodes without a mirror that
    takes light under bright area lamps alone; mirrors show clamped lamps in other surfaces."""
    data = bpy.data.lights["Light"]
    data.type, data.energy = kind, watts
    if kind == "AREA":  # 1 x 0.1 m
        bpy.data.objects["Light"].data.size = 1.0

    def codes(model):
        material = extension.api.new_material(model)
        assert form_of(extension, material) == "nodes"
        update(new_file)
        return {w.code for w in extension.api.warnings(material, new_file)}

    assert ("clamp_indirect" in codes("cook_torrance")) == warned
    assert [c for c in codes("coupled") if c.startswith("clamp")] == ["clamp_mirror"], "once"
    assert len([c for c in codes("phong_material") if c.startswith("clamp")]) <= 1
    bpy.data.objects.remove(bpy.data.objects["Light"])
    assert "clamp_indirect" not in codes("oren_nayar"), "without a lamp"


def test_caustics_that_are_off(extension, new_file):
    """Then Cycles drops Toon closures behind a diffuse surface, also those of matte models."""
    update(new_file)
    for caustics in (True, False):
        new_file.cycles.caustics_reflective = caustics
        for model, lost in (("oren_nayar", not caustics), ("lambert", False)):
            material = extension.api.new_material(model)
            found = {w.code for w in extension.api.warnings(material, new_file)}
            assert ("caustics" in found) == lost


def test_a_material_follows_the_scene(extension, new_file):
    """Whatever causes the change: the node stays, with values, links, animation and drivers."""
    few_samples(new_file, 64)
    material = moving_material(extension)
    add_sphere(new_file, material)
    add_camera(new_file)
    new_file.frame_set(6)
    before, pictures = state(material.node_tree), {}
    for osl in (False, True, False, True):
        new_file.cycles.shading_system = osl
        update(new_file)
        assert form_of(extension, material) == ("exact" if osl else "nodes")
        assert state(material.node_tree) == before
        picture = render(new_file)[..., :3]
        np.testing.assert_array_equal(picture, pictures.setdefault(osl, picture))
    np.testing.assert_allclose(pictures[True].mean(), pictures[False].mean(), rtol=5e-3)
    new_file.frame_set(11)
    assert np.abs(render(new_file)[..., :3] - pictures[True]).max() > 0.01
    groups = [g.name for g in bpy.data.node_groups if extension.model_nodes.TAG in g]
    assert len(groups) == 2  # its own and the twin's


def test_a_render_follows_what_a_script_has_changed(extension, new_file):
    """Without a click, the extension is first notified by the render."""
    few_samples(new_file, 1, 8)
    add_camera(new_file)
    material = extension.api.new_material("lambert")
    add_sphere(new_file, material)
    new_file.cycles.shading_system = True
    assert form_of(extension, material) == "nodes"
    render(new_file)
    assert form_of(extension, material) == "exact"


def test_baking_follows(extension, new_file):
    """A baked image must show the same as a render."""
    few_samples(new_file, 4)
    material = extension.api.new_material("lambert", rho=(0.5, 0.4, 0.3))
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.materials.append(material)
    target = material.node_tree.nodes.new("ShaderNodeTexImage")
    target.image = bpy.data.images.new("Baked", 8, 8, float_buffer=True)
    material.node_tree.nodes.active = target
    baked = {}
    for osl in (True, False):
        new_file.cycles.shading_system = osl
        bpy.ops.object.bake(type="COMBINED")
        assert form_of(extension, material) == ("exact" if osl else "nodes")
        baked[osl] = np.array(target.image.pixels).reshape(8, 8, 4)[..., :3]
    assert baked[False].min() > 1e-3
    np.testing.assert_allclose(baked[False].mean((0, 1)), baked[True].mean((0, 1)), rtol=0.05)


@pytest.mark.parametrize("change", ["engine", "new file", "CUDA", "OPTIX", "build", "osl"])
def test_what_lacks_osl(extension, new_file, monkeypatch, change):
    """A GPU, another engine, a Blender that was built without Open Shading Language."""
    new_file.cycles.shading_system = change not in ("osl", "new file")
    material = extension.api.new_material("shirley_1991")
    wanted = "nodes"
    if change in ("CUDA", "OPTIX"):  # OptiX could run the shaders, but nobody has seen it do so
        monkeypatch.setattr(extension.device, "gpu_backend", lambda: change)
        new_file.cycles.device = "GPU"
    elif change == "build":
        monkeypatch.setattr(extension.pack, "osl_available", lambda: False)
    elif change == "engine":
        # There Blender's own nodes stand in, selected inside the group.
        new_file.render.engine, wanted = "BLENDER_WORKBENCH", "exact"
    elif change == "new file":
        # The engine of new files is not Cycles. What is saved there may be linked elsewhere.
        new_file.render.engine = "BLENDER_WORKBENCH"
    update(new_file)
    assert form_of(extension, material) == wanted
    if change == "build":
        other = extension.api.new_material("lambertian_specular")
        assert form_of(extension, other) == "nodes"


def test_what_was_asked_for_by_name_stays(extension, new_file):
    material = extension.api.new_material("shirley_1991", "sampled")
    add_sphere(new_file, material, segments=8)
    for osl in (True, False):
        new_file.cycles.shading_system = osl
        update(new_file)
        assert form_of(extension, material) == "sampled"
    (said,) = [f for f in extension.api.warnings(material, new_file) if f.code == "osl_off"]
    assert "Blender's own nodes stand in, error" in said.message
    extension.api.switch_representation(material, "auto")
    assert form_of(extension, material) == "nodes"
    assert extension.api.warnings(material, new_file) == []
    extension.api.switch_representation(material, "exact")
    assert form_of(extension, material) == "exact"


def test_a_choice_that_nodes_lack(extension, new_file):
    """While the choice is one that the nodes lack, the twin is shown with a warning; otherwise the
    formulas, in the same group."""
    few_samples(new_file, 64)
    material = extension.api.new_material("ashikhmin_shirley", diffuse="tabulated")
    add_sphere(new_file, material)
    add_camera(new_file)
    add_world(new_file)
    (node,) = extension.model_nodes.group_nodes(material)
    group = node.node_tree
    assert form_of(extension, material) == "aimed"
    assert [f.code for f in extension.api.warnings(material, new_file)][0] == "osl_off"
    other = render(new_file)
    extension.api.set_parameters(material, diffuse="paper")
    assert node.node_tree == group
    assert form_of(extension, material) == "nodes"
    assert extension.api.warnings(material, new_file) == []
    plain = render(new_file)
    extension.api.switch_representation(material, "nodes")
    # Nodes with room for more lamps may have their closures in another order: other noise.
    np.testing.assert_allclose(render(new_file).mean(), plain.mean(), rtol=1e-3)
    assert np.abs(plain - other).max() > 0.01
    extension.api.switch_representation(material, "twin")
    np.testing.assert_allclose(other, render(new_file), atol=1e-6)


def test_undo(extension, new_file):
    """Undo restores the setting, and with it the form, whichever groups that requires. Every state
    is restored, including values that were changed in between."""
    material = moving_material(extension)
    mesh = bpy.data.meshes.new("Mesh")
    mesh.materials.append(material)
    name = material.name
    add_camera(new_file)

    def now():
        scene, found = bpy.context.scene, bpy.data.materials[name]
        (node,) = extension.model_nodes.group_nodes(found)
        group = node.node_tree
        return (
            scene.cycles.shading_system,
            form_of(extension, found),
            state(found.node_tree),
            len(group.nodes),
            sorted(g.name for g in bpy.data.node_groups),
            sorted(t.name for t in bpy.data.texts),
            extension.nodes.is_sound(group),
        )

    def push(message):
        bpy.ops.ed.undo_push(message=message)
        update(bpy.context.scene)  # after the step was recorded, as in the interface
        states.append(now())

    states = []
    push("Start")
    bpy.context.scene.cycles.shading_system = True
    push("On")
    (node,) = extension.model_nodes.group_nodes(bpy.data.materials[name])
    extension.model_nodes.set_value(node, "rs", 0.5)
    push("Value")
    bpy.context.scene.cycles.shading_system = False
    push("Off")
    bpy.data.objects.new("Item", None)
    push("Other")
    assert [s[1] for s in states] == ["nodes", "exact", "exact", "nodes", "nodes"]
    for expected in states[-2::-1]:
        assert bpy.ops.ed.undo() == {"FINISHED"}
        assert now() == expected
    for expected in states[1:]:
        assert bpy.ops.ed.redo() == {"FINISHED"}
        assert now() == expected


def add_lamp(scene, x, size=0.0):
    light = bpy.data.lights.new("Another", "POINT")
    light.energy, light.shadow_soft_size = 300.0, size
    item = bpy.data.objects.new("Another", light)
    item.location = (x, -3.0, 4.0)
    scene.collection.objects.link(item)
    return item


def room_of(extension, material):
    """For how many lamps, with how many cones each, a material's nodes have room, as its tag and as
    its nodes tell."""
    (node,) = extension.model_nodes.group_nodes(material)
    tag = node.node_tree[extension.model_nodes.TAG]
    inner = extension.model_nodes.content_group(node.node_tree)
    assert inner[extension.model_nodes.TAG]["representation"] == "nodes"

    def inside(tree, name):
        groups = [n for n in tree.nodes if n.bl_idname == "ShaderNodeGroup"]
        return [n for n in groups if name in n.node_tree.name]

    (shared,) = inside(inner, ".brdfc Lamps")
    slots = sum(o.is_linked for o in shared.outputs) // 4
    (formulas,) = inside(inner, "formulas")
    lamps = inside(formulas.node_tree, ": lamp")
    cones = len(inside(lamps[0].node_tree, "part of lamp"))
    assert len(lamps) == slots
    assert tuple(tag.get("room", (8, 4))) == (slots, cones)
    return slots, cones


@pytest.mark.slow
@pytest.mark.many
@pytest.mark.parametrize("form", ["auto", "nodes"])
def test_nodes_have_room_for_the_lamps_of_the_scene(extension, new_file, form):
    """Empty slots cost time before the first sample. A lamp without a size that has no slot in the
    nodes would be dark, so the picture equals that of nodes with room for all lamps."""
    few_samples(new_file, 16, 24)
    add_camera(new_file)
    material = extension.api.new_material("cook_torrance", form)
    add_sphere(new_file, material)
    update(new_file)
    pictures, rooms = [render(new_file)], [room_of(extension, material)]
    for x in (-3.0, 2.0, 5.0, 0.0):
        last = add_lamp(new_file, x)
        pictures.append(render(new_file))
        rooms.append(room_of(extension, material))
    assert rooms == [(2, 1), (2, 1), (4, 1), (4, 1), (8, 1)]
    last.hide_render = True
    hidden = render(new_file)
    assert room_of(extension, material) == (8, 1)
    np.testing.assert_allclose(hidden, pictures[3], rtol=1e-5, atol=1e-6)
    extension.api.switch_representation(material, {"auto": "nodes", "nodes": "auto"}[form])
    last.hide_render = False
    for picture in reversed(pictures):
        np.testing.assert_allclose(render(new_file), picture, rtol=1e-5, atol=1e-6)
        if others := [o for o in new_file.objects if o.name.startswith("Another")]:
            bpy.data.objects.remove(others[-1])


@pytest.mark.parametrize("form", ["auto", "nodes"])
def test_room_for_the_cones_of_an_area_lamp(extension, new_file, form):
    """Nodes compute the model four times for each lamp only where a lamp is flat; and what was
    needed once stays."""
    few_samples(new_file, 16, 24)
    add_camera(new_file)
    material = extension.api.new_material("cook_torrance", form)
    add_sphere(new_file, material)
    update(new_file)
    assert room_of(extension, material) == (2, 1)
    (lamp,) = [o for o in new_file.objects if o.type == "LIGHT"]
    lamp.data.type = "AREA"
    lamp.data.shape, lamp.data.size = "SQUARE", 2.0
    render(new_file)
    assert room_of(extension, material) == (2, 4)
    lamp.data.type = "POINT"
    for x in (-3.0, 2.0):
        add_lamp(new_file, x)
    render(new_file)
    assert room_of(extension, material) == (4, 4)


def test_room_for_a_lamp_that_is_shown_later(extension, new_file):
    """A mesh that shines from some frame on has no slot before that."""
    few_samples(new_file, 16, 24)
    add_camera(new_file)
    material = extension.api.new_material("cook_torrance")
    add_sphere(new_file, material)
    bpy.ops.mesh.primitive_plane_add(size=0.5, location=(2.0, -3.0, 2.0), rotation=(1.2, 0.0, 0.6))
    item = bpy.context.object
    add_lamp(new_file, -2.0)
    shining = bpy.data.materials.new("Shining")
    tree = extension.nodes.empty_tree(shining)
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = 300.0
    end = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs[0], end.inputs[0])
    item.data.materials.append(shining)
    for frame, hidden in ((2, False), (1, True)):
        item.hide_render = hidden
        item.keyframe_insert("hide_render", frame=frame)
    new_file.frame_set(1)
    before = render(new_file)
    assert room_of(extension, material) == (2, 1)
    new_file.frame_set(2)
    assert room_of(extension, material) == (4, 4)  # the mesh is a square
    assert render(new_file).mean() > 1.05 * before.mean()


@pytest.mark.parametrize("form", ["auto", "nodes"])
def test_undo_of_a_lamp(extension, new_file, form):
    """Groups that were made again after an undo step was recorded are not those of the step."""
    few_samples(new_file, 4)
    add_camera(new_file)
    material = extension.api.new_material("cook_torrance", form)
    add_sphere(new_file, material)
    name, pictures = material.name, []
    for x in (None, 2.0, -2.0):
        if x is not None:
            add_lamp(bpy.context.scene, x)
        bpy.ops.ed.undo_push(message="Step")
        update(bpy.context.scene)
        pictures.append(render(bpy.context.scene))
    for step, expected in ((bpy.ops.ed.undo, 1), (bpy.ops.ed.undo, 0), (bpy.ops.ed.redo, 1)):
        assert step() == {"FINISHED"}
        np.testing.assert_allclose(render(bpy.context.scene), pictures[expected], rtol=1e-5)
        assert room_of(extension, bpy.data.materials[name]) == ((2, 2, 4)[expected], 1)


def test_a_saved_file_renders_without_the_extension(extension, new_file, tmp_path):
    """With the settings that it was saved with; and the stand-in for scripts with others."""
    few_samples(new_file, 16)
    new_file.cycles.seed = 3
    add_camera(new_file)
    add_sphere(new_file, extension.api.new_material("coupled", r0=0.1))
    path = tmp_path / "default.blend"
    here = render(new_file)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    np.testing.assert_allclose(
        render_without_the_extension(path, 1, tmp_path), here, rtol=1e-5, atol=1e-6
    )


def test_convert(extension, new_file):
    """Nodes become models that follow the scene, with values that both forms support."""
    material = node_material("ShaderNodeBsdfDiffuse", Color=(0.5, 0.4, 0.3, 1), Roughness=0.6)
    (plan,) = extension.api.plan_conversion([material])
    assert extension.api.convert_materials([plan]) == 1
    for osl in (False, True):
        new_file.cycles.shading_system = osl
        update(new_file)
        wanted = (
            "nodes" if not osl else extension.pack.model(plan.model).automatic(plan.values).name
        )
        assert form_of(extension, material) == wanted
        assert extension.api.warnings(material, new_file) == []
