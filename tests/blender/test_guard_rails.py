# SPDX-License-Identifier: GPL-3.0-or-later
"""Protection against wrong pictures: one line and one button for each problem, and files that other
versions of the extension made."""

import contextlib
import json
import time
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import bpy
import helpers
import pytest


def shown(extension, material, scene):
    layout = helpers.Layout()
    extension.ui.draw_findings(layout, extension.checks.warnings(material, scene))
    return layout.log


def old_gpu(extension, scene, monkeypatch):
    monkeypatch.setattr(extension.device, "gpu_backend", lambda: "CUDA")
    scene.cycles.device = "GPU"


def no_osl(extension, scene, monkeypatch):
    scene.cycles.shading_system = False


def eevee(extension, scene, monkeypatch):
    names = bpy.types.RenderSettings.bl_rna.properties["engine"].enum_items.keys()
    new = bpy.app.version >= (5, 0, 0)
    scene.render.engine = (
        "BLENDER_EEVEE" if new or "BLENDER_EEVEE" in names else "BLENDER_EEVEE_NEXT"
    )


def workbench(extension, scene, monkeypatch):
    scene.render.engine = "BLENDER_WORKBENCH"


def old_blender(extension, scene, monkeypatch):
    monkeypatch.setattr(extension.scene_rules, "BLENDER_MIN", (99, 0, 0))


SPOILED = [
    (old_gpu, "CUDA devices can't run these shaders", "brdfc.enable_osl Use the CPU"),
    (no_osl, "Open Shading Language is off", "brdfc.enable_osl Turn On OSL"),
    (eevee, "EEVEE can't run these shaders", "brdfc.enable_osl Use Cycles"),
    (workbench, "Workbench can't run these shaders", "brdfc.enable_osl Use Cycles"),
    (old_blender, "99.0 is needed", "wm.url_open Get Blender"),
]


def test_without_osl_models_are_blenders_own_nodes(extension, empty, monkeypatch):
    """As in Debian's packages: materials use the formulas, and a form made of scripts is refused
    without leaving anything behind."""
    _cycles = import_module("_cycles")  # a module in bpy
    extension.scene_loader.apply_clean_settings(empty)
    named = extension.api.new_material("phong", "aimed")
    automatic = extension.api.new_material("phong", e=20.0)
    monkeypatch.setattr(_cycles, "with_osl", False)
    made = [extension.api.new_material(model) for model in ("lambertian_specular", "glass")]
    empty.update_tag()
    bpy.context.view_layer.update()
    for material in (automatic, *made):
        (node,) = extension.model_nodes.group_nodes(material)
        assert extension.model_nodes.identity(node).form == "nodes"
        assert extension.checks.warnings(material, empty) == []
    assert extension.api.get_parameters(automatic)["e"] == pytest.approx(20)
    kept = len(bpy.data.node_groups), len(bpy.data.texts), len(bpy.data.materials)
    with pytest.raises(RuntimeError, match="built without Open Shading Language"):
        extension.api.new_material("phong", "sampled")
    with pytest.raises(RuntimeError, match="Rough Glass needs Open Shading Language, which this"):
        extension.api.new_material("rough_glass")
    assert kept == (len(bpy.data.node_groups), len(bpy.data.texts), len(bpy.data.materials))
    found = {f.code: f.severity for f in extension.checks.warnings(named, empty)}
    assert found.pop("no_osl") == "WARNING"
    assert found == ({} if bpy.app.version >= (5, 0, 0) else {"leaning_facets": "WARNING"})


@pytest.fixture
def phong(extension, empty):
    extension.scene_loader.apply_clean_settings(empty)
    material = extension.api.new_material("phong", "aimed", e=20.0)
    mesh = bpy.data.meshes.new("m")
    mesh.materials.append(material)
    item = bpy.data.objects.new("o", mesh)
    empty.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    assert shown(extension, material, empty) == []
    return material


@pytest.mark.parametrize(("spoil", "line", "button"), SPOILED)
def test_one_line_and_one_button(extension, empty, phong, monkeypatch, spoil, line, button):
    spoil(extension, empty, monkeypatch)
    log = shown(extension, phong, empty)
    first = next(i for i, entry in enumerate(log) if entry.startswith("operator"))
    said, offered = log[:first], log[first]
    assert line in " ".join(said)
    labels = import_module(f"{extension.package}.panels.labels")
    assert len(said) <= 2 and max(map(labels.width, said)) <= labels.room(icon=True)
    assert offered == f"operator {button}"
    module, name = button.split()[0].split(".")
    if module == "brdfc":
        assert getattr(bpy.ops.brdfc, name)() == {"FINISHED"}
        assert shown(extension, phong, empty) == []


def test_eevee_offers_cycles(extension, empty, phong):
    glass = extension.api.new_material("glass")
    empty.render.engine = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"
    assert shown(extension, glass, empty)[-1] == "operator brdfc.enable_osl Use Cycles"


def test_every_button_is_an_operator_with_these_settings(extension):
    for operator, text, settings in extension.ui.BUTTONS.values():
        group, name = operator.split(".")
        known = getattr(getattr(bpy.ops, group), name).get_rna_type().properties
        assert text
        assert set(settings) <= set(known.keys())


# ---- files of other versions ---------------------------------------------------------------------


def aged(extension, material, made_by="brdfc 0.0.1"):
    """Makes the material look like one of another version."""
    (node,) = extension.model_nodes.group_nodes(material)
    tag = node.node_tree[extension.model_nodes.TAG]
    tag["digest"], tag["made_by"] = "of another version", made_by
    return node


def test_materials_of_an_older_version_are_updated_at_once(extension, empty, phong):
    api = extension.api
    other = api.new_material("ward", "sampled", ax=0.25, normalisation="duer")
    old = [aged(extension, phong), aged(extension, other)]
    groups = [node.node_tree for node in old]
    *lines, button = shown(extension, phong, empty)
    assert " ".join(lines).startswith("Phong: made by brdfc 0.0.1; this is brdfc ")
    assert button == "operator brdfc.update Update Materials"
    assert bpy.ops.brdfc.update() == {"FINISHED"}
    assert api.get_parameters(phong)["e"] == pytest.approx(20)
    assert api.get_parameters(other)["ax"] == pytest.approx(0.25)
    assert api.get_parameters(other)["normalisation"] == "duer"
    assert extension.model_nodes.identity(old[1]) == ("ward", "sampled")
    assert shown(extension, phong, empty) == []
    del groups
    assert len(bpy.data.node_groups) == 5, "the old groups are gone; two models with twins, lamps"
    again = api.update_materials()
    assert (again.count, again.refusals, again.notes) == (0, (), ())


def test_a_file_of_a_later_version_says_so(extension, empty, phong):
    node = aged(extension, phong, "brdfc 99.1.0")
    group = node.node_tree
    line, button = shown(extension, phong, empty)[-2:]
    assert "brdfc 99.1.0" in " ".join(shown(extension, phong, empty))
    assert button == "operator screen.userpref_show Look for Updates"
    result = extension.api.update_materials()
    assert result.count == 0
    assert "brdfc 99.1.0 made it, and this is brdfc" in result.refusals[0]
    assert node.node_tree == group


def a_model(api):
    return api.new_material("ward", ax=0.25)


def a_kernel(api):
    """The choices of some models decide their form."""
    return api.new_material("radziszewski_alda", around="retro")


def a_sum(api):
    return api.new_sum([("ward", {"ax": 0.25}), ("lambert", {})])


def layers(api):
    return api.new_layers([("ward", {"ax": 0.25}), ("kelemen", {})])


def a_coat(api):
    material = bpy.data.materials.new("Diffuse")
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    api.add_coat(material)
    return material


def state(extension, node):
    """What an update keeps of a node."""
    sockets = extension.model_nodes.sockets(node)
    values = extension.model_nodes.all_values(node)
    return (
        extension.model_nodes.is_automatic(node),
        extension.model_nodes.identity(node),
        {name: value for name, value in values.items() if name in sockets},
        [s.name for s in node.inputs],
        [s.name for s in node.outputs],
        sorted((s.name, s.is_linked) for s in (*node.inputs, *node.outputs)),
    )


def aged_nodes(extension, material):
    """All nodes of a material, made to look like those of another version."""
    ours = extension.model_nodes.group_nodes(material)
    for node in ours:
        tag = node.node_tree[extension.model_nodes.TAG]
        tag["digest"], tag["made_by"] = "of another version", "brdfc 0.0.1"
    return ours


MADE = [a_model, a_kernel, a_sum, layers, a_coat]


@pytest.mark.parametrize("osl", [False, True])
@pytest.mark.parametrize("make", MADE)
def test_an_update_keeps_automatic_and_all_else_of_a_node(extension, empty, make, osl):
    extension.scene_loader.apply_clean_settings(empty)
    empty.cycles.shading_system = osl
    material = make(extension.api)
    ours = aged_nodes(extension, material)
    before = [state(extension, node) for node in ours]
    assert all(automatic for automatic, *_ in before)
    result = extension.api.update_materials()
    assert (result.count, result.refusals, result.notes) == (len(ours), (), ())
    assert [state(extension, node) for node in ours] == before
    uses = extension.api.used_materials().values()
    assert {use["representation"] for use in uses} == {"auto"}
    for wanted in (not osl, osl):
        empty.cycles.shading_system = wanted
        extension.api.follow_settings(empty)
        tags = [node.node_tree[extension.model_nodes.TAG] for node in ours]
        native = [tag["representation"] == "nodes" for tag in tags]
        assert all(native) != wanted, "the material follows the settings as before"


@pytest.mark.parametrize("make", MADE)
def test_a_file_saved_with_osl_is_updated_where_there_is_none(
    extension, empty, make, monkeypatch, tmp_path
):
    extension.scene_loader.apply_clean_settings(empty)
    material = make(extension.api)
    aged_nodes(extension, material)
    material.use_fake_user, name = True, material.name
    path = tmp_path / "osl.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    preferences = bpy.context.preferences.addons[extension.package].preferences
    monkeypatch.setattr(import_module("_cycles"), "with_osl", False)
    preferences.update_on_load = True
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path))
    finally:
        preferences.update_on_load = False
    update = import_module(f"{extension.package}.groups.update")
    ours = extension.model_nodes.group_nodes(bpy.data.materials[name])
    assert (update.last.count, update.last.refusals) == (len(ours), ())
    for node in ours:
        assert extension.model_nodes.is_automatic(node)
        group = extension.model_nodes.content_group(node.node_tree)
        assert group[extension.model_nodes.TAG]["representation"] == "nodes"


def test_an_update_keeps_values_under_links_and_an_albedo_output(extension, empty):
    extension.scene_loader.apply_clean_settings(empty)
    for form in ("auto", "aimed"):
        material = extension.api.new_material("ward", form)
        extension.api.add_albedo(material)
        (node,) = extension.model_nodes.group_nodes(material)
        socket = extension.model_nodes.sockets(node)["ax"]
        socket.default_value = 0.375
        value = material.node_tree.nodes.new("ShaderNodeValue")
        material.node_tree.links.new(value.outputs[0], socket)
        aged(extension, material)
        assert extension.api.update_materials().count == 1
        assert "Albedo" in node.outputs and not node.outputs["Albedo"].is_linked
        socket = extension.model_nodes.sockets(node)["ax"]
        assert socket.is_linked and socket.default_value == 0.375
        extension.api.switch_representation(material, "sampled")
        socket = extension.model_nodes.sockets(node)["ax"]
        assert socket.is_linked and socket.default_value == 0.375


def test_an_update_says_what_was_lean(extension, empty, phong):
    node = aged(extension, phong)
    tag = node.node_tree[extension.model_nodes.TAG]
    entry = extension.pack.model("phong").forms["aimed"].entry
    tag["baked"] = json.dumps({"of": "another", "form": entry, "parameters": {}})
    result = extension.api.update_materials()
    assert result.count == 1 and not extension.model_nodes.is_baked(node)
    assert "it was lean and has the whole model now" in result.notes[0]


def test_a_build_of_the_same_number_is_told_of_as_such(extension, empty, phong):
    own = extension.pack.manifest()["generator"]
    for made_by, said in (
        (own, f"made by another build of {own}; this is {own}"),
        ("brdfc 0", f"made by a first version of brdfc; this is {own}"),
    ):
        aged(extension, phong, made_by)
        found = {f.code: f.message for f in extension.checks.warnings(phong, empty)}
        assert said in found["outdated"]


def lose_the_model(tag):
    tag["model"] = "phony"


def lose_a_parameter(tag):
    tag["only"] = '{"gone": 1.0}'


def lose_a_choice(tag):
    tag["choices"] = '{"normalisation": ["bounded", "round", "ward"]}'


@pytest.mark.parametrize(
    ("lose", "why"),
    [
        (lose_the_model, "this version has no model 'phony'"),
        (lose_a_parameter, "has no parameter 'gone'"),
        (lose_a_choice, "'round' there, and no longer a choice"),
    ],
)
def test_what_would_be_lost_is_said_and_kept(extension, empty, lose, why):
    api = extension.api
    material = api.new_material("ward", normalisation="duer")
    kept = api.new_material("ward")
    node = aged(extension, material)
    if kept_node := extension.model_nodes.group_nodes(kept):
        assert kept_node[0].node_tree == node.node_tree, "one group serves both"
    group = node.node_tree
    lose(group[extension.model_nodes.TAG])
    if (
        lose is lose_a_choice
        and import_module(f"{extension.package}.content.group_sockets").has_menus()
    ):
        pytest.skip("menus of later versions of Blender hold labels, which can't be pretended")
    said = shown(extension, material, empty)
    assert why in " ".join(said)
    assert "operator brdfc.update Update Materials" not in said
    result = api.update_materials()
    assert node.node_tree == group
    assert any(why in sentence and material.name in sentence for sentence in result.refusals)


def test_a_form_that_is_no_more_becomes_another(extension, empty, phong):
    node = aged(extension, phong)
    node.node_tree[extension.model_nodes.TAG]["representation"] = "perfect"
    result = extension.api.update_materials()
    assert result.count == 1 and "Perfect is now Aimed" in result.notes[0]
    assert extension.model_nodes.identity(node) == ("phong", "aimed")
    assert extension.api.get_parameters(phong)["e"] == pytest.approx(20)


def test_files_are_updated_when_they_are_opened_if_the_preferences_say_so(
    extension, empty, phong, tmp_path
):
    api = extension.api
    lost = api.new_material("ward")
    lose_a_parameter(aged(extension, lost).node_tree[extension.model_nodes.TAG])
    aged(extension, phong)
    names = phong.name, lost.name
    for material in (phong, lost):
        material.use_fake_user = True
    path = tmp_path / "old.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    preferences = bpy.context.preferences.addons[extension.package].preferences
    assert not preferences.update_on_load, "pictures do not change unasked"
    for wanted in (False, True):
        preferences.update_on_load = wanted
        try:
            bpy.ops.wm.open_mainfile(filepath=str(path))
        finally:
            preferences.update_on_load = False
        phong, lost = (bpy.data.materials[n] for n in names)
        codes = [{f.code for f in api.warnings(m, bpy.context.scene)} for m in (phong, lost)]
        assert ("outdated" in codes[0]) != wanted
        assert "kept" in codes[1]
    assert api.get_parameters(phong)["e"] == pytest.approx(20)
    update = import_module(f"{extension.package}.groups.update")
    assert update.last.count == 1 and "'gone'" in update.last.refusals[0]


def test_linked_materials_are_left_to_their_file(extension, empty, phong, tmp_path):
    aged(extension, phong)
    path = tmp_path / "library.blend"
    bpy.data.libraries.write(str(path), {phong}, fake_user=True)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(path), link=True) as (there, here):
        here.materials = there.materials
    result = extension.api.update_materials()
    assert result.count == 0
    assert "is linked from" in result.refusals[0] and "library.blend" in result.refusals[0]


# ---- beside an extension that is cut to a scene --------------------------------------------------


def test_what_is_cut_to_a_file_never_replaces_the_whole(extension, empty, phong, lean_pack):
    folder = lean_pack({"m": {"model": "phong", "parameters": {"e": 20}}})
    (cut,) = folder.parent.glob("*.zip")
    assert cut.name.startswith("brdfc_shaders_materials-")
    repository = bpy.context.preferences.extensions.repos["User Default"].directory
    whole = extension.pack.manifest()["hash"]
    bpy.ops.extensions.package_install_files(
        filepath=str(cut), repo="user_default", enable_on_install=False
    )
    module = f"{extension.package}_materials"
    try:
        found = {p.name for p in Path(repository).iterdir() if not p.name.startswith(".")}
        assert found == {"brdfc_shaders", "brdfc_shaders_materials"}
        with pytest.raises(RuntimeError, match=f"{extension.package} is enabled"):
            import_module(module).register()
        with contextlib.suppress(RuntimeError):
            bpy.ops.preferences.addon_enable(module=module)
        assert module not in bpy.context.preferences.addons
        extension.pack.manifest.cache_clear()
        assert extension.pack.manifest()["hash"] == whole
        assert shown(extension, phong, empty) == []
        assert bpy.ops.brdfc.switch(
            node=extension.model_nodes.group_nodes(phong)[0].name, representation="sampled"
        ) == {"FINISHED"}
    finally:
        bpy.ops.extensions.package_uninstall(
            repo_directory=repository, pkg_id="brdfc_shaders_materials"
        )
    assert [p.name for p in Path(repository).iterdir() if p.name.startswith("b")] == [
        "brdfc_shaders"
    ]


def test_a_deleted_group_of_lamps_is_an_error_with_a_way_out(extension, empty):
    """The panel said that all was well, and new materials used the damaged group."""
    material = extension.api.new_material("ward")
    helpers.add_sphere(empty, material)
    bpy.data.node_groups.remove(bpy.data.node_groups[".brdfc Lamps"])
    said = [w for w in extension.api.warnings(material, empty) if w.code == "script_failed"]
    assert said and said[0].severity == "ERROR"
    other = extension.api.new_material("ward")
    assert "script_failed" not in [w.code for w in extension.api.warnings(other, empty)]
    extension.api.switch_representation(material, "nodes")
    extension.api.switch_representation(material, "auto")
    assert "script_failed" not in [w.code for w in extension.api.warnings(material, empty)]


@pytest.mark.parametrize("osl", [False, True], ids=["nodes", "osl"])
def test_an_emptied_group_is_an_error_with_a_way_out(extension, empty, osl, subtests):
    """Somebody deletes all nodes of a group inside the model's. Nothing was said, and new materials
    used the group."""
    empty.cycles.shading_system = osl
    helpers.add_lamp(empty)
    model_nodes = extension.model_nodes

    def inside(group):
        found = [n.node_tree for n in group.nodes if n.bl_idname == "ShaderNodeGroup"]
        return {*found, *(below for tree in found for below in inside(tree))}

    def damaged(material):
        found = extension.api.warnings(material, empty)
        return [f.severity for f in found if f.code == "script_failed"] == ["ERROR"]

    material = extension.api.new_material("kelemen")

    def groups():
        found = inside(model_nodes.group_nodes(material)[0].node_tree)
        return sorted((g for g in found if "brdfc_lamps" not in g), key=lambda g: g.name)

    count = len(groups())
    assert count > (0 if osl else 20)
    for index in {0, min(1, count - 1), *range(0, count, 8)}:  # forms, twins and their parts
        group = groups()[index]
        with subtests.test(group.name):
            assert not damaged(material)
            group.nodes.clear()
            assert damaged(material)
            other = extension.api.new_material("kelemen")
            assert not damaged(other) and damaged(material)
            extension.api.switch_representation(material, "auto")
            assert not damaged(material)
            bpy.data.materials.remove(other)
            extension.nodes.remove_unused_groups()
            assert all(group.nodes for group in bpy.data.node_groups)


def test_to_look_for_emptied_groups_takes_no_time(extension, empty):
    """The panel does it whenever it is drawn. A file with 100 materials, of all models, has 765
    groups."""
    material = extension.api.new_material("kelemen")
    (node,) = extension.model_nodes.group_nodes(material)
    for _ in range(1000):
        bpy.data.node_groups.new("Group", "ShaderNodeTree").nodes.new("NodeGroupInput")
    lacks_nodes = import_module(f"{extension.package}.content.part_groups").lacks_nodes
    times = []
    for _ in range(20):
        start = time.perf_counter()
        assert not lacks_nodes(node.node_tree)
        times.append(time.perf_counter() - start)
    print(min(times))
    assert min(times) < 1e-3


@pytest.mark.parametrize("left", [0, 5])
def test_an_emptied_group_of_lamps_is_filled_again(extension, empty, left):
    """The handlers of the extension ended with a traceback at each change of the scene."""
    material = extension.api.new_material("ward")
    helpers.add_sphere(empty, material)
    helpers.add_lamp(empty, location=(1, -2, 3))
    bpy.context.view_layer.update()
    group = bpy.data.node_groups[".brdfc Lamps"]
    shared_group = import_module(f"{extension.package}.lamps.shared_group")
    before = shared_group.written(group)
    for node in list(group.nodes)[left:]:
        group.nodes.remove(node)
    bpy.context.view_layer.update()
    assert group == bpy.data.node_groups[".brdfc Lamps"]
    assert shared_group.all_same(shared_group.written(group), before)
    assert len(group.links) == len(group.interface.items_tree)
    assert not [f for f in extension.api.warnings(material, empty) if f.code == "script_failed"]


def test_hidden_sockets_stay_hidden(extension, empty):
    """They moved by one place, as another group has other sockets before them."""
    material = extension.api.new_material("ward")
    (node,) = extension.model_nodes.group_nodes(material)
    for name in ("ks", extension.pack.TANGENT):
        extension.model_nodes.sockets(node)[name].hide = True
    for form in ("nodes", "aimed", "auto"):
        extension.api.switch_representation(material, form)
        sockets = extension.model_nodes.sockets(node)
        assert {name for name, s in sockets.items() if s.hide} == {"ks", extension.pack.TANGENT}


def test_an_exchange_that_fails_keeps_the_links(extension, empty, monkeypatch):
    material = extension.api.new_material("ward")
    (node,) = extension.model_nodes.group_nodes(material)
    texture = material.node_tree.nodes.new("ShaderNodeTexNoise")
    material.node_tree.links.new(
        texture.outputs["Color"], extension.model_nodes.sockets(node)["ks"]
    )
    before = node.node_tree
    links = {(k.from_socket, k.to_socket) for k in material.node_tree.links}
    group = extension.nodes.ensure_group("ward", "nodes")
    set_value = extension.model_nodes.set_value

    def fail(one, name, value):
        if one.node_tree == group:
            raise TypeError("as if the group were damaged")
        set_value(one, name, value)

    monkeypatch.setattr(extension.model_nodes, "set_value", fail)
    with pytest.raises(TypeError):
        extension.exchange.replace_group(node, group)
    assert node.node_tree == before
    found = {(k.from_socket, k.to_socket) for k in material.node_tree.links}
    assert len(found) == len(links) == 2


def test_panels_and_operators_mean_the_material_that_is_shown(extension, empty):
    """A pinned editor shows another one than that of the active object."""
    shown, active = (extension.api.new_material("ward") for _ in range(2))
    of = import_module(f"{extension.package}.common.interface").material_of
    item = SimpleNamespace(active_material=active)

    def context(space=None, **rest):
        return SimpleNamespace(space_data=space, object=item, **rest)

    def editor(what, tree=None):
        kind = {"type": "NODE_EDITOR", "tree_type": "ShaderNodeTree"}
        return SimpleNamespace(**kind, id=what, node_tree=tree)

    assert of(context()) == active
    assert of(context(SimpleNamespace(type="VIEW_3D"))) == active
    assert of(context(editor(shown))) == shown
    assert of(context(editor(bpy.data.worlds.new("World")))) is None
    assert of(context(editor(None, shown.node_tree))) == shown
    assert of(context(editor(None, bpy.data.node_groups[0]))) is None
    assert of(context(SimpleNamespace(type="PROPERTIES"), material=shown)) == shown
    assert of(SimpleNamespace(space_data=None, object=None)) is None
