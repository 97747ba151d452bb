# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension as a user meets it: installation, nodes, menus, panels, operators, saved files."""

import contextlib
import dataclasses
import hashlib
import json
import math
import re
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import bpy
import helpers
import numpy as np
import pytest

SCRIPTS = Path(bpy.utils.resource_path("LOCAL")) / "scripts"


def forms(extension):
    """Forms that are shaders; test_twin.py tests those of Blender's own nodes."""
    return [
        (model, representation)
        for model, entry in extension.api.models().items()
        for representation, form in entry["representations"].items()
        if "shader" in form
    ]


def sampled_forms(extension):
    pairs = forms(extension)
    return [p for p in pairs if p[1] == "sampled"]


def test_official_validator_accepts_the_zip(extension_zip):
    command = [
        sys.executable,
        SCRIPTS / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py",
        "validate",
        f"--valid-tags={SCRIPTS / 'modules' / '_bpy_internal' / 'extensions' / 'tags.py'}",
        extension_zip,
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_zip_holds_no_binary(extension_zip):
    import zipfile

    with zipfile.ZipFile(extension_zip) as archive:
        suffixes = {Path(name).suffix for name in archive.namelist()}
    assert suffixes <= {".py", ".toml", ".json", ".osl", ".exr", ".jpg"}


@pytest.fixture(scope="module")
def every_form(extension, third_of, tmp_path_factory):
    """One file for all tests, which also shows that the groups coexist: a material for each form,
    and a row of spheres with a third of them, as Open Shading Language compiles each for a third of
    a second; and the pixels of each. If making a material raised an exception, that takes its
    place."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    extension.api.enable_osl(scene)
    pairs, made, pixels = forms(extension), {}, 16
    shown = third_of(pairs)
    for model, representation in pairs:
        try:
            material = extension.api.new_material(model, representation)
        except Exception as error:  # fails this form alone
            made[model, representation] = error
            continue
        made[model, representation] = material.name
        material.use_fake_user = True
        if (model, representation) in shown:
            x = shown.index((model, representation))
            helpers.add_sphere(scene, material).location.x = 2.1 * x
    width = 2.1 * len(shown)
    helpers.add_camera(scene, location=(width / 2 - 1, -8, 0), orthographic=width)
    helpers.add_world(scene)
    scene.render.resolution_x, scene.render.resolution_y = pixels * len(shown), pixels
    scene.cycles.samples = 16
    picture = helpers.render(scene)
    blend = tmp_path_factory.mktemp("saved") / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    pictures = {form: picture[:, i * pixels :][:, :pixels] for i, form in enumerate(shown)}
    return SimpleNamespace(made=made, picture=picture, pictures=pictures, blend=blend)


@pytest.fixture
def made_forms(extension, every_form):
    """(model, form, material) of all forms, from one file: compiling them again would take
    seconds."""
    bpy.ops.wm.open_mainfile(filepath=str(every_form.blend))
    names = {f: n for f, n in every_form.made.items() if isinstance(n, str)}
    assert names
    return [(*form, bpy.data.materials[name]) for form, name in names.items()]


def test_every_form_compiles_and_renders(extension, every_form, subtests):
    assert len(every_form.made) >= 4
    bpy.ops.wm.open_mainfile(filepath=str(every_form.blend))
    for (model, representation), made in every_form.made.items():
        with subtests.test(model=model, representation=representation):
            if isinstance(made, Exception):
                raise made
            node = extension.model_nodes.group_nodes(bpy.data.materials[made])[0]
            assert extension.model_nodes.identity(node) == (model, representation)
            script = next(n for n in node.node_tree.nodes if n.bl_idname == "ShaderNodeScript")
            found = {s.identifier: s.type for s in script.inputs}
            expected = extension.group_content.expected_inputs(
                extension.pack.model(model).forms[representation]
            )
            assert expected.items() <= found.items()
            apart = extension.pack.model(model).forms[representation].has_albedo_script
            outputs = ["BSDF"] if apart or model in helpers.WITHOUT_ALBEDO else ["BSDF", "Albedo"]
            assert [s.identifier for s in script.outputs] == outputs
            assert script.mode == "INTERNAL" and script.bytecode
            for name in expected:
                assert next(s for s in script.inputs if s.identifier == name).is_linked

            picture = every_form.pictures.get((model, representation))
            if picture is None:
                continue
            assert np.isfinite(picture).all()
            centre = picture[6:10, 6:10, :3]
            assert centre.min() > 0.01
            assert centre.max() < 1.5  # only noise exceeds a white world


def test_sliders_do_not_recompile(extension, every_form, monkeypatch, subtests):
    """Every number and colour of every form is a socket: changing it leaves text and bytecode
    alone, and does not call the compiler."""
    import cycles.osl

    compiled, compiler = [], cycles.osl.osl_compile

    def compile_and_note(path, report):
        compiled.append(path)
        return compiler(path, report)

    monkeypatch.setattr(cycles.osl, "osl_compile", compile_and_note)
    bpy.ops.wm.open_mainfile(filepath=str(every_form.blend))
    assert not any(isinstance(made, Exception) for made in every_form.made.values())

    def state(group):
        script = next(n for n in group.nodes if n.bl_idname == "ShaderNodeScript")
        text = script.script
        assert script.bytecode and script.bytecode_hash
        return script, text, text.as_string(), script.bytecode, script.bytecode_hash

    for (model, representation), made in every_form.made.items():
        with subtests.test(model=model, representation=representation):
            material = bpy.data.materials[made]
            (node,) = extension.model_nodes.group_nodes(material)
            group, before, data = node.node_tree, state(node.node_tree), helpers.counts()
            old, values = extension.api.get_parameters(material), {}
            for name, p in (
                extension.pack.model(model).forms[representation].socket_parameters.items()
            ):
                if p["kind"] == "color":
                    values[name] = (0.3, 0.6, 0.2)
                elif p["kind"] == "number":
                    values[name] = p["soft_min"] + 0.37 * (p["soft_max"] - p["soft_min"])
            assert values
            extension.api.set_parameters(material, **values)
            found = extension.api.get_parameters(material)
            for name, value in values.items():
                assert found[name] == pytest.approx(value, rel=1e-6) != old[name]
            assert node.node_tree == group and state(group) == before
            assert helpers.counts() == data
            assert not compiled
    # Shows that a compilation would have been noticed.
    script = state(group)[0]
    script.script = script.script
    assert compiled


def statements(source):
    """The largest number of statements that one call of a shader may execute: the longest of
    alternatives, and loop bodies once."""

    def count(text):
        chains = re.finditer(r"#\d+#(?:\s*else[^#;]*#\d+#)*", text)
        longest = (max(map(int, re.findall(r"#(\d+)#", chain[0]))) for chain in chains)
        return text.count(";") + sum(longest)

    code = re.sub(r"//.*|\[\[.*?\]\]", "", source)
    body = code[re.search(r"^shader \w+\(", code, re.MULTILINE).start() :]
    body = body[body.index("\n{") :]
    # Removes the semicolons of loops and the braces of tables.
    body = re.sub(r"for \([^;]*;[^;]*;[^{\n]*\)|= \{[^{}]*\}", "", body)
    while "{" in body:
        body = re.sub(r"\{([^{}]*)\}", lambda block: f"#{count(block[1])}#", body)
    return count(body)


def test_shaders_are_short(extension_zip, subtests):
    """Every shader of the extension has fewer than 600 statements, counted by the generator as
    operations and here in its text. Aimed forms contain a base and the computations for lamps in
    addition to a model's value and sampling: up to 1,400 statements, which compile in about 0.4 s;
    `lossless`, whose value is a long sum, has 2,900; `factors`, with three curves, has 2,300, and
    900 without a base and lamps; `disney`, `kelemen` and `thin_film` have 1,600, the fit of `hapke`
    800."""
    import zipfile

    text = "shader x(float a = 0 [[ int b = 1; ]],\n    output color Albedo = 0)\n{\n"
    text += "float t[2] = {0.0,\n 1.0}; // ;\nif (a == 0) { a; b; }\nelse if (a == 1) "
    text += "{ for (int i = 0; i < 9; i++) { c; d;\n e; } f; }\nelse { g; }\nh;\n}\n"
    assert statements(text) == 6
    with zipfile.ZipFile(extension_zip) as archive:
        manifest = json.loads(archive.read("manifest.json"))
        made = [f for m in manifest["models"].values() for f in m["representations"].values()]
        forms = [f for f in made if "shader" in f]
        shaders = {f["shader"]: f["operations"] for f in forms}
        # Table look-ups are not operations of the model.
        shaders |= {f["albedo_shader"]: 0 for f in forms if f["albedo_shader"]}
        assert set(shaders) == {name for name in archive.namelist() if name.endswith(".osl")}
        for name, operations in shaders.items():
            with subtests.test(name):
                found = statements(archive.read(name).decode())
                print(f"{name}: {operations} operations, {found} statements")
                longer = {
                    **{"lossless_aimed": 2900, "factors_aimed": 2300, "factors_sampled": 900},
                    **{"disney_aimed": 1600, "kelemen_aimed": 1600, "thin_film_aimed": 1600},
                    **{"hapke_fitted": 800},
                }
                most = next((m for part, m in longer.items() if part in name), None)
                most = most or (1510 if "_aimed" in name else 600)
                assert operations < most
                assert 0 < found < most


@pytest.mark.long
@pytest.mark.slow
def test_every_choice_reaches_the_shader(extension, empty, few_of, subtests):
    """Each choice of a parameter gives a different picture, that of its index: setting the script
    node's own input must render the same as setting the group's socket."""
    tested = 0

    def choices_of(form):
        model, name = form
        sockets = extension.pack.model(model).forms[name].socket_parameters.values()
        return [p for p in sockets if p["kind"] == "choice"]

    for model, representation in few_of(filter(choices_of, forms(extension)), 12):
        sockets = extension.pack.model(model).forms[representation].socket_parameters.values()
        choices = choices_of((model, representation))
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = bpy.context.scene
        extension.scene_loader.apply_clean_settings(scene)
        # One material for all: compiling its shader takes longer than rendering.
        material = extension.api.new_material(model, representation)
        helpers.sphere_scene(scene, material, size=16, samples=16)
        tree = extension.model_nodes.group_nodes(material)[0].node_tree
        script = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeScript")
        # Different values and broad lobes: otherwise some choices would make no difference.
        for i, number in enumerate(p for p in sockets if p["kind"] == "number"):
            least = number["soft_min"]
            value = least + (number["default"] - least) * min(0.1 * (i + 1), 0.9)
            extension.api.set_parameters(material, **{number["name"]: value})
        for parameter in choices:
            name = parameter["name"]
            by_socket = []
            for choice in parameter["choices"]:
                extension.api.set_parameters(material, **{name: choice})
                by_socket.append(helpers.render(scene))
            with subtests.test(model=model, representation=representation, parameter=name):
                assert len({picture.tobytes() for picture in by_socket}) == len(by_socket)
            extension.api.set_parameters(material, **{name: parameter["default"]})
            socket = next(s for s in script.inputs if s.identifier == name)
            source = socket.links[0].from_socket
            tree.links.remove(socket.links[0])
            for index, choice in enumerate(parameter["choices"]):
                with subtests.test(model=model, representation=representation, choice=choice):
                    socket.default_value = index
                    assert np.array_equal(helpers.render(scene), by_socket[index])
                    tested += 1
            tree.links.new(source, socket)
    assert tested


def test_sockets_equal_the_manifest(extension, made_forms, third_of, subtests):
    """And an Albedo output is added to a third of the forms, which compiles a shader for most."""
    manifest = json.loads((extension.pack.root / "manifest.json").read_text())
    adding = {(model, representation) for model, representation, _ in third_of(made_forms)}
    for model, representation, material in made_forms:
        node = extension.model_nodes.group_nodes(material)[0]
        sockets = extension.model_nodes.sockets(node)
        interface = {
            item.identifier: item
            for item in node.node_tree.interface.items_tree
            if item.item_type == "SOCKET" and item.in_out == "INPUT"
        }
        for parameter in manifest["models"][model]["parameters"]:
            name = parameter["name"]
            with subtests.test(model=model, representation=representation, parameter=name):
                if name not in extension.pack.model(model).forms[representation].socket_parameters:
                    assert name not in sockets
                    continue
                socket = sockets[name]
                item = interface[socket.identifier]
                assert socket.name == item.name == parameter["label"]
                assert item.description.startswith(parameter["doc"].rstrip("."))
                # Blender's own panel is nameless.
                assert item.parent.name == parameter.get("panel", "")
                if parameter["kind"] == "number":
                    assert socket.type == "VALUE"
                    assert item.min_value == np.float32(parameter["soft_min"])
                    assert item.max_value == np.float32(parameter["soft_max"])
                    assert socket.default_value == np.float32(parameter["default"])
                    assert f"{parameter['min']:g} to {parameter['max']:g}" in item.description
                elif parameter["kind"] == "color":
                    assert socket.type == "RGBA"
                    expected = np.float32((*parameter["default"], 1))
                    assert np.array_equal(np.float32(socket.default_value), expected)
                elif socket.type == "MENU":
                    label = extension.parameter_values.choice_label
                    assert socket.default_value == label(parameter["default"])
                    for choice in parameter["choices"]:
                        socket.default_value = label(choice)
                        assert extension.model_nodes.get_value(node, name) == choice
                    with pytest.raises(TypeError):
                        socket.default_value = "No Such Choice"
                else:
                    assert socket.type == "INT"
                    assert (item.min_value, item.max_value) == (0, len(parameter["choices"]) - 1)
                    assert socket.default_value == parameter["choices"].index(parameter["default"])
                    assert all(choice in item.description for choice in parameter["choices"])
        for name in ("Normal", "Tangent"):
            assert sockets[name].hide_value and not sockets[name].is_linked
        if model in helpers.WITHOUT_ALBEDO:
            assert [s.name for s in node.outputs] == ["BSDF"]
            with pytest.raises(ValueError, match="has no Albedo output"):
                extension.nodes.add_albedo(node)
            continue
        apart = extension.pack.model(model).forms[representation].has_albedo_script
        assert [s.name for s in node.outputs] == (["BSDF"] if apart else ["BSDF", "Albedo"])
        if (model, representation) not in adding:
            continue
        extension.nodes.add_albedo(node)
        assert [s.name for s in node.outputs] == ["BSDF", "Albedo"]


def test_one_group_a_form(extension, empty):
    first = extension.api.new_material("coupled", r0=0.1)
    second = extension.api.new_material("coupled", r0=0.2)
    groups = [extension.model_nodes.group_nodes(m)[0].node_tree for m in (first, second)]
    assert groups[0] == groups[1]
    assert extension.api.get_parameters(first)["r0"] == pytest.approx(0.1)
    assert extension.api.get_parameters(second)["r0"] == pytest.approx(0.2)


@pytest.mark.long
def test_values_round_trip(extension, empty, subtests):
    for model, entry in extension.api.models().items():
        values = {}
        for p in entry["parameters"]:
            if p["kind"] == "choice":
                values[p["name"]] = p["choices"][-1]
            elif p["kind"] == "color":
                values[p["name"]] = (0.25, 0.5, 0.75)
            else:
                values[p["name"]] = p["soft_min"] + 0.25 * (p["soft_max"] - p["soft_min"])
        with subtests.test(model=model):
            material = extension.api.new_material(model, **values)
            found = extension.api.get_parameters(material)
            assert found.keys() == values.keys()
            for name, value in values.items():
                expected = value if isinstance(value, str) else pytest.approx(value, rel=1e-6)
                assert found[name] == expected


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            (["gloss"], {}),
            r"unknown model 'gloss'; did you mean 'glass'\? expected one of .*lambert",
        ),
        (
            (["coupled", "fitted"], {}),
            r"has no render method 'fitted'.*auto \(Automatic\), aimed, .*nodes \(Formula Nodes\)",
        ),
        ((["coupled"], {"r1": 0.1}), r"'coupled' has no parameter 'r1'; expected one of r0, rm"),
        ((["coupled"], {"r0": 1.5}), r"coupled\.r0: expected a number from 0 to 1, got 1\.5"),
        ((["coupled"], {"r0": -0.1}), r"coupled\.r0: expected a number from 0 to 1"),
        ((["coupled"], {"r0": math.nan}), r"coupled\.r0: expected a number .* got nan"),
        ((["coupled"], {"r0": "high"}), r"coupled\.r0: expected a number .* got 'high'"),
        ((["coupled"], {"r0": True}), r"coupled\.r0: expected a number .* got True"),
        ((["coupled"], {"rm": (0.1, 0.2)}), r"coupled\.rm: expected a number or three"),
        ((["coupled"], {"rm": "red"}), r"coupled\.rm: expected a number or three"),
        ((["coupled"], {"rm": (0.1, 0.2, 7)}), r"coupled\.rm \(b\): expected .* got 7"),
        (
            (["coupled"], {"fresnel": "snell"}),
            r"coupled\.fresnel: expected one of schlick.*'snell'",
        ),
    ],
)
def test_bad_arguments(extension, empty, arguments, message):
    before = helpers.counts()
    with pytest.raises(ValueError, match=message):
        extension.api.new_material(*arguments[0], **arguments[1])
    assert helpers.counts() == before


def test_set_parameters_is_all_or_nothing(extension, empty):
    material = extension.api.new_material("coupled", r0=0.1)
    with pytest.raises(ValueError, match="coupled.rm"):
        extension.api.set_parameters(material, r0=0.2, rm="red")
    assert extension.api.get_parameters(material)["r0"] == pytest.approx(0.1)
    extension.api.set_parameters(material, r0=0.2, rm=0.5)
    values = extension.api.get_parameters(material)
    assert values["r0"] == pytest.approx(0.2) and values["rm"] == (0.5, 0.5, 0.5)
    tree = material.node_tree
    node = extension.model_nodes.group_nodes(material)[0]
    number = tree.nodes.new("ShaderNodeValue")
    tree.links.new(number.outputs[0], extension.model_nodes.sockets(node)["r0"])
    sockets = extension.model_nodes.sockets(node)
    sockets["rm"].driver_add("default_value", 0).driver.expression = "0.5"
    with pytest.raises(ValueError, match="'rm'.*controlled by a driver"):
        extension.api.set_parameters(material, rm=0.7)
    sockets["rm"].driver_remove("default_value", 0)
    with pytest.raises(ValueError, match="'r0'.*controlled by a link"):
        extension.api.set_parameters(material, r0=0.3)
    with pytest.raises(ValueError, match="has 0 reflection models"):
        extension.api.set_parameters(bpy.data.materials.new("other"), r0=0.3)


BROKEN = {
    "does not parse": ("shader x(output closure color BSDF = 0) { BSDF = ; }", "failed to compile"),
    "unknown function": (
        "shader x(color rho = 0, output closure color BSDF = 0) { BSDF = nonsense(N); }",
        "nonsense",
    ),
    "lacks sockets": (
        "shader x(output closure color BSDF = 0) { BSDF = diffuse(N); }",
        "lacks the sockets .*rho",
    ),
    "missing include": ('#include "beside.h"\nshader x(output closure color BSDF = 0) {}', "fail"),
}


def spoil(extension, monkeypatch, source):
    """Makes the pack return this source for every shader."""
    real = extension.pack.Form.source

    def spoilt(form):
        return real(form) if form.name == "twin" else ("broken", source)

    monkeypatch.setattr(extension.pack.Form, "source", spoilt)


@pytest.mark.parametrize("case", BROKEN)
def test_broken_shader_is_an_error(extension, empty, monkeypatch, case):
    source, message = BROKEN[case]
    spoil(extension, monkeypatch, source)
    before = helpers.counts()
    with pytest.raises(extension.api.CompileError, match=message):
        extension.api.new_material("lambert")
    assert helpers.counts() == before


@pytest.mark.parametrize("engine", ["CYCLES", "BLENDER_WORKBENCH"])
def test_compiled_shaders_leave_no_temporary_files(extension, empty, monkeypatch, tmp_path, engine):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    empty.render.engine = engine
    extension.api.new_material("lambert")
    assert [t.name for t in bpy.data.texts]
    assert [p.name for p in tmp_path.iterdir()] == []
    assert tempfile.gettempdir() == str(tmp_path)


def test_broken_shader_under_another_engine(extension, empty, monkeypatch):
    empty.render.engine = "BLENDER_WORKBENCH"
    spoil(extension, monkeypatch, BROKEN["lacks sockets"][0])
    with pytest.raises(extension.api.CompileError):
        extension.api.new_material("lambert")
    monkeypatch.undo()
    assert extension.api.new_material("lambert").node_tree is not None


def scripts_of(node):
    """The scripts of the model, without the one that tells where shaders run."""
    found = [n for n in node.node_tree.nodes if n.bl_idname == "ShaderNodeScript"]
    return [n for n in found if n.name != "Runs"]


def test_shaders_are_short_but_for_outputs_that_were_asked_for(extension, made_forms, subtests):
    """A file contains source and bytecode of each shader. Fits contain their own tables; two aimed
    forms still contain too much for each of their many choices."""
    longer = {("ashikhmin_shirley", "aimed"): 161_500, ("radziszewski_alda", "aimed"): 200_000}
    for model, form, material in made_forms:
        with subtests.test(model=model, form=form):
            source = extension.pack.model(model).forms[form].source()[1]
            if form != "fitted":
                assert len(source) <= longer.get((model, form), 116_500)
            apart = extension.pack.model(model).forms[form].albedo_source()
            assert extension.pack.model(model).forms[form].has_albedo_script == (apart is not None)
            node = extension.model_nodes.group_nodes(material)[0]
            assert [s.script.as_string() for s in scripts_of(node)] == [source]


def test_albedo_output_is_added_and_kept_while_it_is_linked(extension, empty):
    """If it takes a script of its own: it gets the node's values and links, is made once per form,
    and is not saved when unused."""
    api, nodes = extension.api, extension.nodes
    values = {"ax": 0.3, "ks": (0.1, 0.2, 0.3)}
    material, other, third = (api.new_material("ward", "sampled", **values) for _ in "123")
    tree, node = material.node_tree, extension.model_nodes.group_nodes(material)[0]
    assert [s.name for s in node.outputs] == ["BSDF"]
    assert not extension.model_nodes.uses_albedo(node)
    value = tree.nodes.new("ShaderNodeValue")
    tree.links.new(value.outputs[0], extension.model_nodes.sockets(node)["ay"])
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    whole, before = node.node_tree, helpers.counts()

    api.add_albedo(material)
    assert [s.name for s in node.outputs] == ["BSDF", "Albedo"]
    assert extension.model_nodes.get_value(node, "ax") == pytest.approx(0.3)
    assert extension.model_nodes.get_value(node, "ks") == pytest.approx((0.1, 0.2, 0.3))
    assert extension.model_nodes.sockets(node)["ay"].links[0].from_node == value
    assert output.inputs["Surface"].links[0].from_node == node
    model, albedo = scripts_of(node)
    assert [s.identifier for s in albedo.outputs] == ["Albedo"]
    assert (
        albedo.script.as_string()
        == extension.pack.model("ward").forms["sampled"].albedo_source()[1]
    )
    assert all(s.is_linked for s in albedo.inputs)
    assert nodes.script_problem(node.node_tree) is None
    assert api.warnings(material, empty) == api.warnings(other, empty)
    assert extension.model_nodes.group_nodes(other)[0].node_tree == whole, (
        "another material got it too"
    )

    full, added = node.node_tree, helpers.counts()
    assert (
        added["texts"] == before["texts"] + 2 and added["node_groups"] == before["node_groups"] + 1
    )
    api.add_albedo(material)
    assert node.node_tree == full
    api.add_albedo(other)
    assert (
        extension.model_nodes.group_nodes(other)[0].node_tree == full and helpers.counts() == added
    )
    api.add_albedo(third)
    left = helpers.counts()
    assert left["texts"] == before["texts"] + 1 and left["node_groups"] == before["node_groups"]

    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(node.outputs["Albedo"], emission.inputs["Color"])
    api.switch_representation(material, "sampled")
    assert node.node_tree == full
    assert emission.inputs["Color"].links[0].from_socket == node.outputs["Albedo"]
    tree.nodes.remove(emission)
    api.switch_representation(material, "sampled")
    assert [s.name for s in node.outputs] == ["BSDF"] and len(scripts_of(node)) == 1

    albedo.bytecode = ""
    assert "Albedo output is not compiled" in nodes.script_problem(full)


def test_albedo_output_goes_from_form_to_form(extension, empty):
    """Including a form whose single script provides it, and back."""
    material = extension.api.new_material("coupled", "sampled")
    tree, node = material.node_tree, extension.model_nodes.group_nodes(material)[0]
    extension.api.add_albedo(material)
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(node.outputs["Albedo"], emission.inputs["Color"])
    for form, scripts in (("exact", 1), ("sampled", 2)):
        extension.api.switch_representation(material, form)
        assert extension.model_nodes.identity(node) == ("coupled", form)
        assert len(scripts_of(node)) == scripts
        assert emission.inputs["Color"].links[0].from_socket == node.outputs["Albedo"]


def test_albedo_output_that_can_not_be_added_changes_nothing(extension, empty, monkeypatch):
    material = extension.api.new_material("ward")
    node = extension.model_nodes.group_nodes(material)[0]
    group, before = node.node_tree, helpers.counts()
    broken = ("broken", BROKEN["does not parse"][0])
    with monkeypatch.context() as patch:
        patch.setattr(extension.pack.Form, "albedo_source", lambda _: broken)
        with pytest.raises(extension.api.CompileError, match="the Albedo output: .* failed to"):
            extension.api.add_albedo(material)
    assert node.node_tree == group and helpers.counts() == before
    group[extension.model_nodes.TAG]["digest"] = "of an older version"
    with pytest.raises(ValueError, match="of another version of the extension"):
        extension.api.add_albedo(material)


def test_operator_adds_the_albedo_output_where_it_lacks(extension, empty):
    mesh = bpy.data.meshes.new("mesh")
    target = bpy.data.objects.new("target", mesh)
    empty.collection.objects.link(target)
    bpy.context.view_layer.objects.active = target
    material = extension.api.new_material("ward")
    mesh.materials.append(material)
    node = extension.model_nodes.group_nodes(material)[0]

    def is_offered():
        layout = helpers.Layout()
        extension.ui.draw_material(layout, material, empty)
        return any(line.startswith("operator brdfc.add_albedo") for line in layout.log)

    assert is_offered()
    assert bpy.ops.brdfc.add_albedo(node=node.name) == {"FINISHED"}
    assert "Albedo" in node.outputs and not is_offered()
    with pytest.raises(RuntimeError, match="has no model node 'nothing'"):
        bpy.ops.brdfc.add_albedo(node="nothing")


def test_switch_keeps_values_and_links(extension, empty):
    model = "lambert"
    parameter = extension.pack.model(model).parameters["rho"]
    material = extension.api.new_material(model, "exact", rho=(0.1, 0.2, 0.3))
    tree = material.node_tree
    node = extension.model_nodes.group_nodes(material)[0]
    bump = tree.nodes.new("ShaderNodeBump")
    tree.links.new(bump.outputs[0], extension.model_nodes.sockets(node)["Normal"])
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    material.cycles.use_bump_map_correction = True
    for form in ("sampled", "exact", "sampled"):
        extension.api.switch_representation(material, form)
        assert extension.model_nodes.identity(node) == (model, form)
        sockets = extension.model_nodes.sockets(node)
        assert extension.model_nodes.get_value(node, parameter["name"]) == pytest.approx(
            (0.1, 0.2, 0.3)
        )
        assert sockets["Normal"].links[0].from_node == bump
        assert output.inputs["Surface"].links[0].from_node == node
    assert material.cycles.use_bump_map_correction is True
    with pytest.raises(ValueError, match="has no render method"):
        extension.api.switch_representation(material, "aimed")
    assert extension.model_nodes.identity(node) == (model, "sampled")


def test_group_of_another_version_is_offered_for_update(extension, empty, monkeypatch):
    material = extension.api.new_material("coupled", r0=0.3)
    node = extension.model_nodes.group_nodes(material)[0]
    node.node_tree[extension.model_nodes.TAG]["digest"] = "of an older version"
    extension.scene_loader.apply_clean_settings(empty)
    assert [w.code for w in extension.api.warnings(material, empty)] == ["outdated"]
    old = node.node_tree
    extension.api.switch_representation(material, "exact")
    assert node.node_tree != old
    assert extension.api.get_parameters(material)["r0"] == pytest.approx(0.3)
    assert extension.api.warnings(material, empty) == []


# Warnings


def add_bright_lamp(scene):
    """A lamp whose light clamps and filters show in."""
    helpers.add_lamp(scene, energy=1e5, shadow_soft_size=1)


def clean(extension, scene, model="lambert", form="exact"):
    """A material without any warnings."""
    material = extension.api.new_material(model, form)
    extension.api.enable_osl(scene)
    scene.cycles.sample_clamp_indirect = scene.cycles.sample_clamp_direct = 0
    scene.cycles.blur_glossy, scene.cycles.use_denoising = 0, False
    assert extension.api.warnings(material, scene) == []
    return material


def codes(extension, material, scene):
    return [w.code for w in extension.api.warnings(material, scene)]


def test_declared_sensitivities_are_known(extension):
    for pair in forms(extension):
        declared = set(extension.pack.model(pair[0]).forms[pair[1]].entry["warnings"])
        assert declared <= {row.code for row in extension.table.DECLARED}


def test_no_warnings_for_other_materials(extension, empty):
    assert extension.api.warnings(bpy.data.materials.new("plain"), empty) == []


def test_warning_engine_and_osl(extension, empty):
    material = clean(extension, empty, "glass")  # its stand-in has no warnings of its own
    empty.render.engine = "BLENDER_WORKBENCH"
    assert codes(extension, material, empty) == ["engine"]
    empty.render.engine = "CYCLES"
    empty.cycles.shading_system = False
    assert codes(extension, material, empty) == ["osl_off"]
    assert extension.api.enable_osl(empty) == ["Open Shading Language turned on"]
    assert codes(extension, material, empty) == []
    assert extension.api.enable_osl(empty) == []


@pytest.mark.parametrize(
    ("backend", "code"),
    [("CUDA", "device"), ("HIP", "device"), ("METAL", "device"), ("OPTIX", "optix_untested")],
)
def test_warning_device(extension, empty, monkeypatch, backend, code):
    # This machine may lack the device, so only the preference is simulated.
    monkeypatch.setattr(extension.device, "gpu_backend", lambda: backend)
    material = clean(extension, empty, "glass")  # its stand-in has no warnings of its own
    empty.cycles.device = "GPU"
    assert codes(extension, material, empty) == [code]
    extension.api.enable_osl(empty)
    assert empty.cycles.device == "CPU"
    assert codes(extension, material, empty) == []


def test_warning_device_of_another_computer(extension, empty, monkeypatch):
    """Without a GPU in the preferences, Cycles uses the CPU, and the file keeps GPU Compute."""
    monkeypatch.setattr(extension.device, "gpu_backend", lambda: "NONE")
    material = clean(extension, empty, "glass")
    empty.cycles.device = "GPU"
    (finding,) = extension.api.warnings(material, empty)
    assert (finding.code, finding.severity) == ("device_elsewhere", "WARNING")
    assert "GPU Compute" in finding.message
    empty.cycles.shading_system = False
    assert codes(extension, material, empty) == ["osl_off"]
    empty.cycles.shading_system = True
    assert extension.api.enable_osl(empty) == ["Device changed from GPU Compute to the CPU"]
    assert empty.cycles.device == "CPU"
    assert codes(extension, material, empty) == []


def test_gpu_backend_is_the_preference(extension, empty):
    preferences = bpy.context.preferences.addons["cycles"].preferences
    assert extension.device.gpu_backend() == preferences.compute_device_type


def test_warning_of_a_parameter_without_effect(extension, empty):
    made = extension.api.new_material
    material = made("radziszewski_alda", n_theta=12.0, ior=1.5)
    extension.api.prepare_material(material)

    def said():
        found = extension.api.warnings(material, empty)
        return [str(f.message) for f in found if f.code == "no_effect"]

    extension.api.enable_osl(empty)
    node = "Radziszewski-Alda"
    assert said() == [f"{node}: Latitudinal Glossiness has no effect while Proportion is Paper"], (
        "the other is at its default"
    )
    (group,) = extension.model_nodes.group_nodes(material)
    tree = material.node_tree
    source = tree.nodes.new("ShaderNodeValue")
    tree.links.new(source.outputs[0], extension.model_nodes.sockets(group)["ior"])
    assert any(f"{node}: IOR has no effect while" in line for line in said())
    extension.api.set_parameters(material, proportion="custom", around="refraction")
    assert said() == []
    extension.api.set_parameters(material, n=9.0)
    assert said() == [f"{node}: Glossiness has no effect while Proportion is Custom"]


def test_only_choices_leave_parameters_unread(extension):
    needs = {
        (model, parameter["name"]): parameter["needs"]
        for model, entry in extension.api.models().items()
        for parameter in entry["parameters"]
        if "needs" in parameter
    }
    drawn = {("lossless", f"h{i}"): {"kernel": ["table"]} for i in range(4)}
    proportion = {"proportion": ["custom"]}
    assert needs == {
        ("ashikhmin_shirley", "rd"): {"part": ["both", "diffuse"]},
        ("microfacet", "again"): {"distribution": ["multiscatter_ggx"]},
        **drawn,
        ("radziszewski_alda", "n"): {"proportion": ["paper", "equal"]},
        ("radziszewski_alda", "n_theta"): proportion | {"part": ["product", "latitudinal"]},
        ("radziszewski_alda", "n_phi"): proportion | {"part": ["product", "longitudinal"]},
        ("radziszewski_alda", "ior"): {"around": ["refraction"]},
        ("shaped_facets", "gamma"): {"distribution": ["gtr"]},
    }


def test_warning_old_blender_and_no_osl(extension, empty, monkeypatch):
    material = clean(extension, empty, "glass")  # its stand-in has no warnings of its own
    monkeypatch.setattr(extension.scene_rules, "BLENDER_MIN", (99, 0, 0))
    assert codes(extension, material, empty) == ["blender_version"]
    monkeypatch.undo()
    monkeypatch.setattr(extension.pack, "osl_available", lambda: False)
    assert codes(extension, material, empty) == ["no_osl"]
    with pytest.raises(RuntimeError, match="without Open Shading Language"):
        extension.api.enable_osl(empty)


def test_warning_bump_correction(extension, empty):
    """Only fitted forms need it off, and they restore it, unless it was off before."""
    api = extension.api
    material = clean(extension, empty, "phong", "fitted")
    assert material.cycles.use_bump_map_correction is False
    material.cycles.use_bump_map_correction = True
    assert "bump_correction" in codes(extension, material, empty)
    assert api.prepare_material(material) != []
    assert "bump_correction" not in codes(extension, material, empty)
    for form in ("sampled", "aimed", "twin"):
        api.switch_representation(material, "fitted")
        assert material.cycles.use_bump_map_correction is False
        api.switch_representation(material, form)
        assert material.cycles.use_bump_map_correction is True
        assert "bump_correction" not in codes(extension, material, empty)
    material.cycles.use_bump_map_correction = False
    api.switch_representation(material, "fitted")
    api.switch_representation(material, "aimed")
    assert material.cycles.use_bump_map_correction is False


def test_warning_clamp_indirect(extension, empty):
    material = clean(extension, empty, *sampled_forms(extension)[0])
    empty.cycles.sample_clamp_indirect = 10
    assert codes(extension, material, empty) == ["clamp_indirect"]


def test_warning_path_guiding(extension, empty):
    material = clean(extension, empty, *sampled_forms(extension)[0])
    empty.cycles.use_guiding = True
    assert codes(extension, material, empty) == ["path_guiding"]
    assert codes(extension, extension.api.new_material("lambert", "exact"), empty) == []


def test_warning_clamp_direct(extension, empty):
    """What only random rays show of a lamp is as bright as the lamp itself."""
    material = clean(extension, empty, *sampled_forms(extension)[0])
    empty.cycles.sample_clamp_direct = 10
    assert codes(extension, material, empty) == ["clamp_direct"]
    aimed = extension.api.new_material("cook_torrance", "aimed")
    assert codes(extension, aimed, empty) == []


@pytest.mark.parametrize("reopened", [False, True])
def test_what_a_material_is_made_of_goes_with_it(extension, empty, tmp_path, reopened):
    """Blender gives every new text a fake user, which would keep each shader's text for good."""
    before = helpers.counts()
    made = [("lambert", "auto"), ("glass", "auto"), ("phong", "aimed"), ("phong", "twin")]
    materials = [extension.api.new_material(model, form) for model, form in made]
    materials.append(extension.api.new_material("ashikhmin_shirley"))
    extension.api.add_albedo(materials[-1])
    extension.api.switch_representation(materials[0], "sampled")
    names = [material.name for material in materials]
    if reopened:
        for material in materials:
            material.use_fake_user = True
        path = str(tmp_path / "file.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
    for name in names:
        bpy.data.materials.remove(bpy.data.materials[name])
    bpy.data.orphans_purge(do_recursive=True)
    assert helpers.counts() == before


@pytest.mark.parametrize("osl", [False, True])
def test_what_was_removed_is_not_saved(extension, empty, tmp_path, osl):
    """Parts of a group without a user stayed in the file, one level fewer each time that it was
    opened: 11 MB for Formula Nodes."""
    empty.cycles.shading_system = osl
    before = helpers.counts()
    material = extension.api.new_material("ashikhmin_shirley")
    name, form = material.name, list(material.node_tree.nodes.keys())
    material.use_fake_user = True
    bpy.ops.ed.undo_push(message="Made")
    bpy.data.materials.remove(material)
    bpy.ops.ed.undo_push(message="Removed")
    path = str(tmp_path / "file.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    assert helpers.counts() == before
    bpy.ops.ed.undo()
    material = bpy.data.materials[name]
    assert list(material.node_tree.nodes.keys()) == form
    found = extension.api.warnings(material, bpy.context.scene)
    assert not [w for w in found if w.severity == "ERROR"]
    helpers.sphere_scene(bpy.context.scene, material)
    assert helpers.render(bpy.context.scene)[6:10, 6:10, :3].mean() > 0.2
    bpy.ops.wm.open_mainfile(filepath=path)
    assert helpers.counts() == before


def test_a_text_that_an_older_version_kept_goes_too(extension, empty):
    before = helpers.counts()
    first = extension.api.new_material("phong")
    for text in bpy.data.texts:
        text.use_fake_user = True
    second = extension.api.new_material("phong")
    for material in (first, second):
        bpy.data.materials.remove(material)
    bpy.data.orphans_purge(do_recursive=True)
    assert helpers.counts() == before


def test_warning_multiple_importance(extension, empty):
    """Lamps that BSDF sampling does not hit."""
    made = {
        (model, form): clean(extension, empty, model, form)
        for model, form in (
            ("blinn", "sampled"),
            ("blinn", "aimed"),
            ("coupled", "exact"),
            ("blinn", "fitted"),
        )
    }
    data = bpy.data.lights.new("Key", "SUN")
    data.angle = 1.0
    lamp = bpy.data.objects.new("Key", data)
    empty.collection.objects.link(lamp)
    assert not any(codes(extension, m, empty) for m in made.values())
    data.cycles.use_multiple_importance_sampling = False
    # Aimed forms miss none of the light, but are noisy under a sun that is so wide.
    for angle, silent in (1.0, set()), (0.4, {("blinn", "aimed")}):
        data.angle = angle
        warned = {key for key, m in made.items() if codes(extension, m, empty)}
        assert warned == made.keys() - {("blinn", "fitted")} - silent
    (found,) = extension.api.warnings(made["blinn", "sampled"], empty)
    assert found.code == "multiple_importance" and "Key" in found.message
    lamp.hide_render = True
    assert not any(codes(extension, m, empty) for m in made.values())


def test_warning_small_lamps(extension, empty):
    material = clean(extension, empty, *sampled_forms(extension)[0])
    data = bpy.data.lights.new("tiny", "POINT")
    data.shadow_soft_size = 0
    empty.collection.objects.link(bpy.data.objects.new("tiny", data))
    found = extension.api.warnings(material, empty)
    assert [w.code for w in found] == ["zero_size_lights"] and "tiny" in found[0].message
    data.shadow_soft_size = 0.5
    assert codes(extension, material, empty) == []
    sun = bpy.data.lights.new("sun", "SUN")
    sun.angle = 0
    empty.collection.objects.link(bpy.data.objects.new("sun", sun))
    assert codes(extension, material, empty) == ["zero_size_lights"]


def test_warning_far_orthographic_camera(extension, empty):
    material = clean(extension, empty, *sampled_forms(extension)[0])
    camera = helpers.add_camera(empty, location=(0, -10, 0), orthographic=4)
    bpy.context.view_layer.update()
    assert codes(extension, material, empty) == []
    empty.camera.location = (0, -10000, 0)
    bpy.context.view_layer.update()
    assert codes(extension, material, empty) == ["orthographic_far"]
    camera.type = "PERSP"
    assert codes(extension, material, empty) == []


@pytest.mark.parametrize(
    ("code", "spoil"),
    [
        ("path_guiding", {"use_guiding": True}),
        ("clamp_direct", {"sample_clamp_direct": 1.0}),
        ("caustics", {"caustics_reflective": False}),
        ("filter_glossy", {"blur_glossy": 1.0}),
    ],
)
def test_warnings_a_form_may_declare(extension, empty, monkeypatch, code, spoil):
    material = clean(extension, empty)
    add_bright_lamp(empty)
    entry = extension.pack.model("lambert").forms["exact"].entry
    for name, value in {
        "blur_glossy": 0,
        "use_guiding": False,
        "caustics_reflective": True,
    }.items():
        setattr(empty.cycles, name, value)
    monkeypatch.setitem(entry, "warnings", [code])
    assert codes(extension, material, empty) == []
    for name, value in spoil.items():
        setattr(empty.cycles, name, value)
    assert codes(extension, material, empty) == [code]


@pytest.mark.parametrize(
    ("code", "setting", "value"),
    [("fast_gi", "use_fast_gi", True), ("glossy_bounces", "glossy_bounces", 0)],
)
def test_warnings_of_formula_nodes(extension, empty, code, setting, value):
    """Cycles counts their random directions as glossy; others follow Blender's own nodes."""
    empty.cycles.blur_glossy = 0
    materials = [clean(extension, empty, "oren_nayar", form) for form in ("nodes", "aimed")]
    materials.append(clean(extension, empty, "lambert"))
    assert [code in codes(extension, m, empty) for m in materials] == [False, False, False]
    setattr(empty.cycles, setting, value)
    assert [code in codes(extension, m, empty) for m in materials] == [True, False, False]


def test_warning_clamp_that_shows_in_exact_forms(extension, empty):
    """In a mirror always; in a highlight if the clamp is low; under a dim world never."""
    mirror = clean(extension, empty, "coupled", "exact")
    highlight = clean(extension, empty, "modified_phong", "exact")
    for clamp, in_mirror, in_highlight in (
        (0, [], []),
        (10, ["clamp_mirror"], []),
        (1, ["clamp_mirror"], ["clamp_low"]),
    ):
        empty.cycles.sample_clamp_indirect = clamp
        assert codes(extension, mirror, empty) == (in_mirror if clamp < 10 else [])
        add_bright_lamp(empty)
        assert codes(extension, mirror, empty) == in_mirror
        assert codes(extension, highlight, empty) == in_highlight
        bpy.data.objects.remove(empty.objects["Lamp"])


def test_warning_clamp_that_shows_in_a_narrow_highlight(extension, empty):
    """Narrower highlights are brighter: in a fit along its slider, in exact forms and in aimed
    ones."""
    for model, form in (
        ("max_phong", "fitted"),
        ("modified_phong", "exact"),
        ("max_phong", "aimed"),
    ):
        material = clean(extension, empty, model, form)
        add_bright_lamp(empty)
        empty.cycles.sample_clamp_indirect = 10
        extension.api.set_parameters(material, e=10.0)
        assert codes(extension, material, empty) == []
        extension.api.set_parameters(material, e=500.0)
        assert codes(extension, material, empty) == ["clamp_low"]
        bpy.data.objects.remove(empty.objects["Lamp"])
        assert codes(extension, material, empty) == []
        empty.cycles.sample_clamp_indirect = 0


def test_warning_normal_pass(extension, empty):
    """A sampled lobe has its own normal, which the denoiser sees."""
    material = clean(extension, empty, *sampled_forms(extension)[0])
    passes = empty.view_layers[0].cycles
    passes.denoising_store_passes = True
    assert codes(extension, material, empty) == ["normal_pass"]
    passes.denoising_store_passes = False
    empty.cycles.use_denoising = True
    empty.cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL"
    assert codes(extension, material, empty) == []


def test_warning_albedo_passes_of_a_mirror_beside_samples(extension, empty):
    """Blender 5.2 counts both in the albedo that the denoiser is given."""
    material = clean(extension, empty, "coupled", "sampled")
    empty.view_layers[0].use_pass_diffuse_color = True
    expected = ["albedo_passes_mirror"] if bpy.app.version >= (5, 2, 0) else []
    assert codes(extension, material, empty) == expected


def test_warning_albedo_passes(extension, empty):
    """An exact form with negative weights has closures whose weights exceed the reflected light."""
    form = extension.pack.model("coupled").forms["exact"].entry
    assert "albedo_passes" in form["warnings"]
    material = clean(extension, empty, "coupled", "exact")
    layer = empty.view_layers[0]
    for setting, owner in (
        ("use_pass_diffuse_color", layer),
        ("use_pass_glossy_color", layer),
        ("denoising_store_passes", layer.cycles),
    ):
        assert codes(extension, material, empty) == []
        setattr(owner, setting, True)
        assert codes(extension, material, empty) == ["albedo_passes"]
        setattr(owner, setting, False)


@pytest.mark.parametrize("model", ["coupled", "cook_torrance", "radziszewski_alda", "schlick"])
def test_a_new_material_in_a_new_file_greets_without_warnings(extension, model):
    """There a clamp at 10, Filter Glossy at 1 and denoising change less than 1 % of the picture. A
    sun causes the warnings of the first two."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene = bpy.context.scene
    material = extension.api.new_material(model)
    extension.api.enable_osl(scene)
    extension.api.see_lamps(scene)
    assert codes(extension, material, scene) == []
    scene.cycles.sample_clamp_indirect = 1
    assert len(codes(extension, material, scene)) == 1
    scene.cycles.sample_clamp_indirect = 10
    bpy.data.lights["Light"].type = "SUN"
    brought = {"coupled", "schlick"}
    assert ("filter_glossy" in codes(extension, material, scene)) == (model in brought)


@pytest.mark.parametrize(
    ("shines", "change"),
    [
        (False, lambda node, tree, material: None),
        (True, lambda node, tree, material: setattr(_strength_of(node), "default_value", 2.0)),
        (True, lambda node, tree, material: _strength_of(node).keyframe_insert("default_value")),
        (True, lambda node, tree, material: _sampled_by_chance(node, material)),
        (False, lambda node, tree, material: tree.nodes.new("ShaderNodeEmission")),
    ],
    ids=["dark", "bright", "animated", "met by chance", "not shown"],
)
def test_what_shines_brings_the_warning_of_a_mirror(extension, shines, change):
    """Any emitter in addition to a new file's lamp causes it, but not an unused one."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene = bpy.context.scene
    material = extension.api.new_material("schlick")
    extension.api.enable_osl(scene)
    extension.api.see_lamps(scene)
    other = bpy.data.materials.new("Other")
    other.use_nodes = True
    tree = other.node_tree
    tree.nodes.clear()
    emission, output = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("Emission", "OutputMaterial")
    )
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    _strength_of(emission).default_value = 0.0
    change(emission, tree, other)
    assert ("filter_glossy" in codes(extension, material, scene)) == shines


def _strength_of(emission):
    return emission.inputs["Strength"]


def _sampled_by_chance(emission, material):
    _strength_of(emission).default_value = 2.0
    material.cycles.emission_sampling = "NONE"


@pytest.mark.parametrize(
    ("model", "values", "expected"),
    [
        ("ashikhmin_shirley", {}, ["albedo_passes"]),
        ("microfacet", {"tint": 0.8}, ["albedo_passes", "filter_glossy"]),
        (
            "microfacet",
            {},
            ["filter_glossy"],
        ),  # one of Cycles' closures
        ("cook_torrance", {}, ["filter_glossy"]),
        ("radziszewski_alda", {}, []),
    ],
)
def test_warnings_of_formula_nodes_by_their_base(extension, empty, model, values, expected):
    """Cones with ramps and rough facets are too bright in passes; Filter Glossy blurs facets."""
    material = clean(extension, empty, model, "nodes")
    extension.api.set_parameters(material, **values)
    add_bright_lamp(empty)
    assert codes(extension, material, empty) == []
    empty.view_layers[0].use_pass_glossy_color = True
    empty.cycles.blur_glossy = 1.0
    assert sorted(codes(extension, material, empty)) == expected


def test_denoising_at_its_defaults_is_no_reason_to_warn(extension, empty):
    """Measured: with too bright an albedo, Cycles' own denoiser gives a result that differs by 0.1
    % of the light from the one without albedo."""
    material = clean(extension, empty, "coupled", "exact")
    empty.cycles.use_denoising = True
    empty.cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL"
    assert codes(extension, material, empty) == []


def test_warnings_of_an_aimed_form_that_is_denoised(extension, empty):
    """Base and rest have weights of both signs; normals are those of the sampled lobe unless a base
    outweighs it."""
    passes = empty.view_layers[0].cycles
    for model, expected in (
        ("cook_torrance", ["albedo_passes"]),
        ("lossless", ["albedo_passes"]),
        ("coupled", ["albedo_passes"]),
        ("phong", ["albedo_passes"]),
        ("radziszewski_alda", ["albedo_passes", "normal_pass"]),
        ("schlick_double", ["albedo_passes"]),
    ):
        material = clean(extension, empty, model, "aimed")
        passes.denoising_store_passes = True
        assert codes(extension, material, empty) == expected, model
        passes.denoising_store_passes = False


def test_warning_script_failed(extension, empty):
    material = clean(extension, empty)
    group = extension.model_nodes.group_nodes(material)[0].node_tree
    script = next(n for n in group.nodes if n.bl_idname == "ShaderNodeScript")
    script.inputs.remove(next(s for s in script.inputs if s.identifier == "rho"))
    found = extension.api.warnings(material, empty)
    assert [w.code for w in found] == ["script_failed"] and "rho" in found[0].message
    script.bytecode = ""
    assert "not compiled" in extension.api.warnings(material, empty)[0].message
    group.nodes.remove(script)
    assert "no script node" in extension.api.warnings(material, empty)[0].message
    # A broken group is not reused for the next material.
    assert (
        extension.model_nodes.group_nodes(extension.api.new_material("lambert"))[0].node_tree
        != group
    )


def test_warning_out_of_range(extension, empty):
    material = clean(extension, empty, "coupled")
    node = extension.model_nodes.group_nodes(material)[0]
    extension.model_nodes.sockets(node)["r0"].default_value = 1.5
    found = extension.api.warnings(material, empty)
    assert [w.code for w in found] == ["out_of_range"] and "1.5" in found[0].message
    extension.model_nodes.sockets(node)["r0"].default_value = 1.0
    assert codes(extension, material, empty) == []
    # A range that ends at 6e29 begins at 0 all the same.
    material = clean(extension, empty, "factors", "sampled")
    node = extension.model_nodes.group_nodes(material)[0]
    extension.model_nodes.sockets(node)["strength"].default_value = -1
    assert "out_of_range" in codes(extension, material, empty)


def test_warnings_reach_nested_groups(extension, empty):
    inner = bpy.data.node_groups.new("mine", "ShaderNodeTree")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    node = extension.nodes.add_group_node(inner, "coupled")
    inner.links.new(node.outputs[0], inner.nodes.new("NodeGroupOutput").inputs[0])
    material = bpy.data.materials.new("outer")
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    assert codes(extension, material, bpy.data.scenes.new("other")) == [], "it is not shown"
    tree.links.new(group.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    assert "engine" in codes(extension, material, bpy.data.scenes.new("other"))


# Saved files


@pytest.mark.long
@pytest.mark.slow
def test_saved_file_renders_without_the_extension(every_form, tmp_path):
    expected = every_form.picture
    assert (expected[6:10, :, :3].max(axis=(0, 2)) > 0.01).all()
    found = helpers.render_without_the_extension(every_form.blend, 1, tmp_path)
    assert np.array_equal(found, expected)


# Menus, panels, operators

#: Names of the submenus, by what models declare.
LOOKS = {
    "matte": "Matte",
    "glossy": "Glossy",
    "metal": "Metals",
    "glass": "Glass",
    "special": "Special",
}


@contextlib.contextmanager
def shader_editor(material):
    """Makes an area of the window that shows the material's nodes the context."""
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    area.type = "NODE_EDITOR"
    area.ui_type = "ShaderNodeTree"
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        space = bpy.context.space_data
        space.shader_type = "OBJECT"
        space.pin = True
        space.node_tree = material.node_tree
        yield


def draw_functions(menu):
    return [f.__name__ for f in getattr(bpy.types, menu)._dyn_ui_initialize()]


def test_add_menu_lists_every_model(extension, empty):
    assert draw_functions("NODE_MT_category_shader_shader").count("draw_add_menu") == 1
    layout = helpers.Layout()
    extension.ui.draw_add_menu(SimpleNamespace(layout=layout), bpy.context)
    assert layout.log == ["menu NODE_MT_brdfc"]
    by_look = extension.pack.models_by_look()
    models = extension.api.models()
    assert sorted(sum(by_look.values(), [])) == sorted(models)
    assert list(by_look) == list(LOOKS), "a model of each look, in this order"
    for menu, operator in (("NODE_MT_brdfc", "add_node"), ("MATERIAL_MT_brdfc", "new_material")):
        submenus = [f"{menu}_{look}" for look in LOOKS]
        assert menu_log(menu) == ["operator brdfc.search ", *(f"menu {name}" for name in submenus)]
        for submenu, (look, label) in zip(submenus, LOOKS.items(), strict=True):
            assert getattr(bpy.types, submenu).bl_label == label
            names = by_look[look]
            assert all(models[name]["look"] == look for name in names)
            labels = [models[name]["label"] for name in names]
            assert labels == sorted(labels, key=str.casefold)
            cited = [extension.pack.model(name).citation for name in names]
            assert menu_log(submenu) == [
                f"operator brdfc.{operator} {label} ({paper})"
                for label, paper in zip(labels, cited, strict=True)
            ]


def menu_log(menu):
    kind = getattr(bpy.types, menu)
    layout = helpers.Layout()
    told = SimpleNamespace(**vars(kind) | {"layout": layout})
    kind.draw(told, bpy.context)
    return layout.log


def test_a_menu_and_a_catalogue_of_one_kind_have_one_name(extension):
    library = import_module(f"{extension.package}.library")
    catalogs = {entry.catalog.split("/")[0] for entry in library.entries()}
    assert catalogs & set(LOOKS.values()) == {"Matte", "Metals"}
    with_metal = {catalog for catalog in catalogs if "metal" in catalog.lower()}
    assert with_metal == {"Metals"}


def test_menus_cite_papers_as_the_page_of_models_does(extension, subtests):
    page = (Path(__file__).parents[2] / "docs" / "models.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \|[^|]*\| ([^|]*) \|", page, re.M)
    assert dict(rows).keys() == extension.api.models().keys()
    for name, papers in rows:
        with subtests.test(name):
            cited = extension.pack.model(name).citation
            assert papers.split("; ")[0] == cited
    other = extension.pack.model("lambert").entry | {"paper": "J. H. Lambert, Photometria, 1760"}
    with pytest.raises(extension.pack.PackError, match="expected authors, a colon"):
        extension.pack.Model("lambert", other).citation  # noqa: B018


def test_the_page_of_models_has_their_forms(extension):
    page = (Path(__file__).parents[2] / "docs" / "models.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \|.*\| ([^|]*) \|$", page, re.M))
    for name, entry in extension.api.models().items():
        # Every model has some forms of Blender's own nodes.
        assert rows[name] == ", ".join(
            f for f, e in entry["representations"].items() if "nodes" not in e
        )


def test_the_readme_has_the_errors_that_panel_and_scripts_show(extension):
    page = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    for form, method in (("fitted", "Fitted"), ("twin", "Blender Nodes")):
        errors = [
            100 * entry["representations"][form]["error"]["relative_l1"]
            for entry in extension.api.models().values()
            if form in entry["representations"]
        ]
        low, high = ("0" if e < 1e-3 else f"{e:.2g}" for e in (min(errors), max(errors)))
        (row,) = re.findall(rf"^\| {method}\b.*$", page, re.M)
        assert f"| {low} to {high} % of the light" in row


def test_the_page_says_what_scripts_are_given(extension):
    """The page documents every attribute of the returned objects, and no key that does not
    exist."""
    page = (Path(__file__).parents[2] / "docs" / "blender.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| (.*) \| (`.*) \|$", page.split("### What they return")[1], re.M))
    said = {of: re.findall(r"`(\w+)`", has) for of, has in rows.items()}
    convert = import_module(f"{extension.package}.convert")
    api = extension.api
    for kind in (api.Finding, api.Lamp, api.Update, api.MeasuredLibrary, convert.Plan):
        (of,) = (of for of in said if of.endswith(f": `{kind.__name__}`"))
        assert said[of] == [field.name for field in dataclasses.fields(kind)]
    for model in extension.api.models().values():
        assert set(said["`models()[NAME]`"]) <= model.keys()
        (of,) = (of for of in said if of.endswith(", a list"))
        for parameter in model["parameters"]:
            kind = {"number": {"choices"}, "choice": {"min", "max"}, "color": {"choices"}}
            assert set(said[of]) - kind[parameter["kind"]] - {"needs"} <= parameter.keys()
        for form in model["representations"].values():
            assert set(said['`models()[NAME]["representations"][FORM]`']) <= form.keys()
            assert set(said["its `error`"]) - {"None"} <= form["error"].keys()


def test_search_finds_models_by_name_author_title_and_year(extension, empty):
    items = extension.operators.adding.models_as_items(None, bpy.context)
    assert [item[0] for item in items] == extension.pack.model_names()
    texts = {name: text.lower() for name, text, _ in items}

    def found(words):
        """Blender's search lists entries that contain all of the words."""
        return {n for n, text in texts.items() if all(w in text for w in words.lower().split())}

    assert found("ward 1992") == found("measuring anisotropic 1992") == {"ward"}
    assert found("Nayar") == {"oren_nayar"}
    assert "coupled" in found("smits practitioners") and found("Photometria 1760") == {"lambert"}
    doc = extension.operators.BRDFC_OT_add_node.description(None, SimpleNamespace(model="ward"))
    ward = extension.pack.model("ward")
    assert ward.doc in doc and ward.paper in doc, "tooltips name the paper"


def test_search_makes_a_node_or_a_material(extension, empty):
    assert not bpy.ops.brdfc.search.poll()
    target = bpy.data.objects.new("target", bpy.data.meshes.new("mesh"))
    empty.collection.objects.link(target)
    bpy.context.view_layer.objects.active = target
    assert bpy.ops.brdfc.search(model="ward") == {"FINISHED"}
    material = target.active_material
    assert [
        extension.model_nodes.identity(n).model for n in extension.model_nodes.group_nodes(material)
    ] == ["ward"]
    with shader_editor(material):
        assert bpy.ops.brdfc.search(model="glass") == {"FINISHED"}
    assert len(extension.model_nodes.group_nodes(material)) == 2
    assert target.active_material == material


def test_panel_shows_model_form_values_and_warnings(extension, made_forms, subtests):
    scene = bpy.context.scene
    scene.cycles.shading_system = False
    for model, representation, material in made_forms:
        with subtests.test(model=model, representation=representation):
            layout = helpers.Layout()
            extension.ui.draw_material(layout, material, scene)
            text = "\n".join(layout.log)
            entry = extension.pack.model(model).entry
            assert entry["label"] in text
            for part in ("Error:", "Cost:"):
                assert part in text
            assert ("Albedo: 0\u00b0" in text) == bool(entry.get("albedo"))
            for form in entry["representations"]:
                native = {"nodes": "Formula Nodes", "twin": "Blender Nodes"}
                label = native.get(form, form.capitalize())
                assert f"operator brdfc.switch {label}" in text
            _, shown = extension.model_nodes.identity(
                extension.model_nodes.group_nodes(material)[0]
            )
            form = extension.pack.model(model).forms[shown]
            for parameter in form.socket_parameters.values():
                assert f"value {parameter['label']}:" in text
            assert "Open Shading Language is off" in text
            assert "operator brdfc.enable_osl" in text


def test_a_redraw_of_the_panel_reads_and_hashes_no_shader(extension, made_forms, monkeypatch):
    """For each form: a panel is redrawn at every movement of the mouse over it."""
    made = [material for *_, material in made_forms]
    for material in made:
        extension.ui.draw_material(helpers.Layout(), material, bpy.context.scene)

    def refuse(*_, **__):
        raise AssertionError("the panel read a file or hashed one")

    for module, name in ((Path, "read_text"), (Path, "read_bytes"), (hashlib, "sha256")):
        monkeypatch.setattr(module, name, refuse)
    for material in made:
        layout = helpers.Layout()
        extension.ui.draw_material(layout, material, bpy.context.scene)
        assert any("Error:" in line for line in layout.log), "the group is not known"


def test_the_manifest_has_the_hash_of_each_shader(extension, subtests):
    """It identifies groups made by another version."""
    for model, form in forms(extension):
        with subtests.test(model=model, form=form):
            text = extension.pack.model(model).forms[form].source()[1]
            stated = extension.pack.model(model).forms[form].entry["sha256"]
            assert hashlib.sha256(text.encode()).hexdigest() == stated


@pytest.mark.long
def test_panel_shows_costs_of_forms_made_of_a_fit(extension, empty, lean_pack, subtests):
    """Costs are measured at the model's default parameters, which a pack cut to a scene lacks."""
    names = ("sampled", "fitted", "twin")
    listed = {
        name: {"model": "phong", "representation": name, "parameters": {"e": 40}} for name in names
    }
    extension.pack.use(lean_pack(listed))
    try:
        forms_of_phong = extension.pack.model("phong").forms
        assert set(forms_of_phong) == set(names)
        for name in names:
            with subtests.test(representation=name):
                layout = helpers.Layout()
                material = extension.api.new_material("phong", name)
                extension.ui.draw_material(layout, material, empty)
                cost = forms_of_phong[name].entry["cost"]
                assert f"Cost: {cost:.2f} x Glossy, at default parameters" in layout.log
    finally:
        extension.pack.use()
    layout = helpers.Layout()
    extension.ui.draw_material(layout, extension.api.new_material("phong", "sampled"), empty)
    assert any(line.startswith("Cost:") and line.endswith("x Glossy") for line in layout.log)


def test_a_form_that_lacks_a_choice_is_refused_and_auto_takes_another(extension, empty):
    api, pack = extension.api, extension.pack
    only = "'exact' only for fresnel='schlick', not for 'dielectric'"
    with pytest.raises(ValueError, match=only):
        api.new_material("coupled", "exact", fresnel="dielectric")
    material = api.new_material("coupled", fresnel="dielectric", r0=0.1)
    assert extension.model_nodes.identity(extension.model_nodes.group_nodes(material)[0]) == (
        "coupled",
        "aimed",
    )
    with pytest.raises(ValueError, match=only):
        api.switch_representation(material, "exact")
    assert api.get_parameters(material)["fresnel"] == "dielectric"
    layout = helpers.Layout()
    extension.ui.draw_material(layout, material, empty)
    text = "\n".join(layout.log)
    assert "operator brdfc.switch Exact" not in text
    assert "operator brdfc.switch Sampled" in text
    api.set_parameters(material, fresnel="schlick")
    api.switch_representation(material, "auto")
    assert extension.model_nodes.identity(extension.model_nodes.group_nodes(material)[0]) == (
        "coupled",
        "exact",
    )
    assert api.get_parameters(material)["fresnel"] == "schlick"
    with pytest.raises(ValueError, match=only):
        api.set_parameters(material, fresnel="dielectric")
    assert pack.model("coupled").resolve("auto", {"fresnel": "dielectric"}).name == "aimed"


def test_panel_says_why_there_is_no_albedo(extension, empty):
    material = extension.api.new_material("coupled")
    tree = material.node_tree
    node = extension.model_nodes.group_nodes(material)[0]
    tree.links.new(
        tree.nodes.new("ShaderNodeValue").outputs[0], extension.model_nodes.sockets(node)["r0"]
    )
    assert "Normal Reflectance" in extension.ui.energy_text(node)


def test_operator_new_material(extension, empty):
    mesh = bpy.data.meshes.new("mesh")
    target = bpy.data.objects.new("target", mesh)
    empty.collection.objects.link(target)
    bpy.context.view_layer.objects.active = target
    model, form = "phong", "fitted"
    assert bpy.ops.brdfc.new_material(model=model, representation=form) == {"FINISHED"}
    material = target.active_material
    node = extension.model_nodes.group_nodes(material)[0]
    assert extension.model_nodes.identity(node) == (model, form)
    assert material.cycles.use_bump_map_correction is False
    assert bpy.ops.brdfc.enable_osl() == {"FINISHED"}
    assert empty.cycles.shading_system is True
    material.cycles.use_bump_map_correction = True
    assert bpy.ops.brdfc.fix_material() == {"FINISHED"}
    assert material.cycles.use_bump_map_correction is False
    extension.api.switch_representation(material, "sampled")
    empty.cycles.use_guiding = True
    layout = helpers.Layout()
    extension.ui.draw_material(layout, material, empty)
    assert "operator brdfc.no_guiding" in "\n".join(layout.log)
    assert bpy.ops.brdfc.no_guiding() == {"FINISHED"}
    assert empty.cycles.use_guiding is False
    with pytest.raises(RuntimeError, match="unknown model"):
        bpy.ops.brdfc.new_material(model="nonsense")
    assert target.active_material == material


def drawing():
    bpy.ops.object.grease_pencil_add(type="STROKE")  # which gives it a material
    return bpy.context.object


def cloud():
    data = bpy.data.volumes.new("cloud")
    data.materials.append(bpy.data.materials.new("smoke"))
    item = bpy.data.objects.new("cloud", data)
    bpy.context.scene.collection.objects.link(item)
    return item


@pytest.mark.parametrize("make", [drawing, cloud])
def test_no_new_material_where_none_is_a_surface(extension, empty, make):
    item = make()
    material = item.active_material
    bpy.context.view_layer.objects.active = item
    with pytest.raises(RuntimeError, match="Objects of this type show no surface of a material"):
        bpy.ops.brdfc.new_material(model="lambert")
    assert not bpy.ops.brdfc.search.poll()
    assert material is not None and item.active_material == material


def surfaces():
    mesh = bpy.data.meshes.new("mesh")
    yield mesh
    for kind in ("CURVE", "SURFACE", "FONT"):
        yield bpy.data.curves.new(kind, kind)
    yield bpy.data.metaballs.new("meta")
    yield bpy.data.hair_curves.new("hair")
    yield bpy.data.pointclouds.new("points")


def test_new_material_of_all_that_has_a_surface(extension, empty):
    for data in list(surfaces()):
        item = bpy.data.objects.new(data.name, data)
        empty.collection.objects.link(item)
        bpy.context.view_layer.objects.active = item
        assert bpy.ops.brdfc.new_material(model="lambert") == {"FINISHED"}
        assert extension.model_nodes.group_nodes(item.active_material)


def test_operator_switch(extension, empty):
    mesh = bpy.data.meshes.new("mesh")
    target = bpy.data.objects.new("target", mesh)
    empty.collection.objects.link(target)
    bpy.context.view_layer.objects.active = target
    first, second = (extension.api.new_material("lambert", "exact") for _ in range(2))
    mesh.materials.append(first)
    name = extension.model_nodes.group_nodes(first)[0].name

    def form(material):
        return extension.model_nodes.identity(extension.model_nodes.group_nodes(material)[0]).form

    bpy.ops.brdfc.switch(node=name, representation="sampled")
    assert (form(first), form(second)) == ("sampled", "exact")
    bpy.ops.brdfc.switch(node=name, representation="exact")
    bpy.ops.brdfc.switch(node=name, representation="sampled", all_users=True)
    assert (form(first), form(second)) == ("sampled", "sampled")
    with pytest.raises(RuntimeError, match="no model node"):
        bpy.ops.brdfc.switch(node="nonsense", representation="exact")


def test_the_panel_says_that_a_node_is_muted(extension, empty):
    material = extension.api.new_material("ward")
    (node,) = extension.model_nodes.group_nodes(material)
    for muted in (False, True):
        node.mute = muted
        layout = helpers.Layout()
        extension.ui.draw_material(layout, material, empty)
        assert ("This node is muted, and" in " ".join(layout.log)) == muted


def test_the_preferences_say_what_runs_the_program(extension):
    addon = bpy.context.preferences.addons[extension.package]
    said = addon.preferences.bl_rna.properties["program"].description
    for operator in ("bake", "new_measured_material", "new_measured_library"):
        label = getattr(bpy.ops.brdfc, operator).get_rna_type().name
        assert label.rstrip(".") in said


def test_all_materials_are_those_that_show_the_same_render_method(extension, empty):
    """A material that is Automatic, and aimed at the moment, is not one of Aimed."""
    mesh = bpy.data.meshes.new("mesh")
    target = bpy.data.objects.new("target", mesh)
    empty.collection.objects.link(target)
    bpy.context.view_layer.objects.active = target
    automatic = extension.api.new_material("ward")
    named, other = (extension.api.new_material("ward", "aimed") for _ in range(2))
    every = automatic, named, other

    def forms():
        found = [extension.model_nodes.group_nodes(m)[0] for m in every]
        return [extension.model_nodes.asked_form(n) for n in found]

    mesh.materials.append(named)
    (node,) = extension.model_nodes.group_nodes(named)
    bpy.ops.brdfc.switch(node=node.name, representation="sampled", all_users=True)
    assert forms() == ["auto", "sampled", "sampled"]


@pytest.fixture
def drawn(extension, empty):
    """A `lossless` node and a Float Curve node in the active object's material."""
    material = extension.api.new_material("lossless")
    mesh = bpy.data.meshes.new("Mesh")
    mesh.materials.append(material)
    target = bpy.data.objects.new("Object", mesh)
    empty.collection.objects.link(target)
    bpy.context.view_layer.objects.active = target
    curve = material.node_tree.nodes.new("ShaderNodeFloatCurve")
    draw(curve, 0.5, 0.4, 0.3, 0.05)
    return extension.model_nodes.group_nodes(material)[0], curve


def draw(curve, *heights):
    """Sets a curve of straight lines with these heights at x = 0, 1/3, 2/3, 1."""
    points = curve.mapping.curves[0].points
    while len(points) < len(heights):
        points.new(0.5, 0.5)
    for i, (point, height) in enumerate(zip(points, heights, strict=True)):
        point.location = (i / (len(heights) - 1), height)
        point.handle_type = "VECTOR"
    curve.mapping.use_clip = False
    curve.mapping.update()


def kernel_of(extension, node):
    names = ("kernel", "h0", "h1", "h2", "h3")
    return [extension.model_nodes.get_value(node, name) for name in names]


def test_kernel_from_a_float_curve(extension, drawn):
    node, curve = drawn
    assert kernel_of(extension, node)[0] == "sech2"
    assert bpy.ops.brdfc.kernel() == {"FINISHED"}
    kernel, *heights = kernel_of(extension, node)
    assert kernel == "table"
    # Blender evaluates curves through a table of 256 entries, which rounds corners off.
    assert heights == pytest.approx([1, 0.8, 0.6, 0.1], rel=1e-2)
    # From a script, and where the first height is not the largest.
    draw(curve, 0.2, 0.4, 0.3, 0.1)
    extension.api.set_kernel(node, curve)
    assert kernel_of(extension, node)[1:] == pytest.approx([0.5, 1, 0.75, 0.25], rel=1e-2)
    # If there are several curves, the selected one is used.
    other = node.id_data.nodes.new("ShaderNodeFloatCurve")
    draw(other, 0.5, 0.4, 0.3, 0.05)
    curve.select, other.select = False, True
    assert bpy.ops.brdfc.kernel(node=node.name) == {"FINISHED"}
    assert kernel_of(extension, node)[1:] == pytest.approx([1, 0.8, 0.6, 0.1], rel=1e-2)


def test_kernel_says_what_is_wrong_with_a_curve(extension, drawn):
    node, curve = drawn
    tree, before = node.id_data, kernel_of(extension, node)
    for heights, message in (
        ((0.5, 0.4, 0.3, 0), "at x = 1: expected a height above 0, got 0"),
        ((0.5, -0.4, 0.3, 0.1), "at x = 0.333: expected a height above 0"),
        ((1, 0.4, 0.3, 0.0005), "at x = 1: expected at least 0.001 of the largest height"),
    ):
        draw(curve, *heights)
        with pytest.raises(ValueError, match=message):
            extension.api.set_kernel(node, curve)
        with pytest.raises(RuntimeError, match=message):
            bpy.ops.brdfc.kernel()
    draw(curve, 0.5, 0.4, 0.3, 0.1)
    with pytest.raises(ValueError, match="expected a Float Curve"):
        extension.api.set_kernel(node, node)
    with pytest.raises(ValueError, match="expected a node of the model 'lossless'"):
        extension.api.set_kernel(curve, curve)
    value = tree.nodes.new("ShaderNodeValue")
    link = tree.links.new(value.outputs[0], extension.model_nodes.sockets(node)["h2"])
    with pytest.raises(RuntimeError, match="'h2' .* controlled by a link"):
        bpy.ops.brdfc.kernel()
    tree.links.remove(link)
    other = tree.nodes.new("ShaderNodeFloatCurve")
    curve.select = other.select = True
    with pytest.raises(RuntimeError, match="one that is selected; there are 2, 2 selected"):
        bpy.ops.brdfc.kernel()
    tree.nodes.remove(curve)
    tree.nodes.remove(other)
    with pytest.raises(RuntimeError, match="there is none"):
        bpy.ops.brdfc.kernel()
    with pytest.raises(RuntimeError, match="expected an active node"):
        bpy.ops.brdfc.kernel(node="nonsense")
    assert kernel_of(extension, node) == before


def test_operator_add_node(extension, empty):
    material = bpy.data.materials.new("mine")
    if material.node_tree is None:
        material.use_nodes = True
    mesh = bpy.data.meshes.new("mesh")
    mesh.materials.append(material)
    target = bpy.data.objects.new("target", mesh)
    empty.collection.objects.link(target)
    bpy.context.view_layer.objects.active = target
    with shader_editor(material):
        assert bpy.types.NODE_PT_brdfc.poll(bpy.context) is False
        assert bpy.ops.brdfc.add_node(model="coupled") == {"FINISHED"}
        assert bpy.types.NODE_PT_brdfc.poll(bpy.context) is True
    assert len(extension.model_nodes.group_nodes(material)) == 1


def test_disable_leaves_nothing_behind(extension, empty):
    classes = [c for module in (extension.ui, extension.operators) for c in module._CLASSES]
    defined = {
        value
        for module in (extension.ui, *helpers.modules_of_operators(extension))
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, bpy.types.bpy_struct)
        and value.__module__ == module.__name__
    } | set(extension.ui._SUBMENUS)
    assert defined == set(classes) and len(classes) > 10
    handlers = {
        name: list(getattr(bpy.app.handlers, name))
        for name in dir(bpy.app.handlers)
        if isinstance(getattr(bpy.app.handlers, name), list)
    }
    others = {
        name: [f for f in found if not f.__module__.startswith(extension.package)]
        for name, found in handlers.items()
    }
    assert others != handlers
    menus = ("NODE_MT_category_shader_shader", "MATERIAL_MT_context_menu")
    with_extension = [draw_functions(menu) for menu in menus]
    try:
        bpy.ops.preferences.addon_disable(module=extension.package)
        for menu in menus:
            assert not {"draw_add_menu", "draw_material_menu"} & set(draw_functions(menu))
        assert not any(c.is_registered for c in classes)
        assert not hasattr(bpy.types, "BRDFC_OT_add_node")
        assert others == {name: list(getattr(bpy.app.handlers, name)) for name in handlers}
    finally:
        bpy.ops.preferences.addon_enable(module=extension.package)
    assert [draw_functions(menu) for menu in menus] == with_extension
    now = {name: list(getattr(bpy.app.handlers, name)) for name in handlers}
    assert {n: len(f) for n, f in now.items()} == {n: len(f) for n, f in handlers.items()}
    assert all(c.is_registered for c in classes)


@pytest.mark.parametrize(
    "way", ["new_material", "set_parameters", "see_lamps", "warnings", "prepare_material"]
)
def test_a_script_that_imports_a_disabled_extension_enables_it(
    extension, empty, way, capfd, monkeypatch
):
    enabling = import_module(f"{extension.package}.common.enabling")
    monkeypatch.setattr(enabling, "_said", False)
    # Without handlers, a lamp that moves would stay where it was in every material.
    material = extension.api.new_material("ward")
    bpy.ops.preferences.addon_disable(module=extension.package)
    try:
        given, values = {
            "new_material": (("phong",), {}),
            "set_parameters": ((material,), {"ax": 0.3}),
            "see_lamps": ((empty,), {}),
            "warnings": ((material, empty), {}),
            "prepare_material": ((material,), {}),
        }[way]
        getattr(extension.api, way)(*given, **values)
        assert bpy.types.BRDFC_OT_add_node.is_registered
        assert "enabled for this session" in capfd.readouterr().out
        extension.api.new_material("phong")
        assert "enabled" not in capfd.readouterr().out
    finally:
        bpy.ops.preferences.addon_enable(module=extension.package)


def test_it_is_said_once_that_a_script_enables_the_extension(extension, empty, capfd, monkeypatch):
    """wm.read_factory_settings disables it each time, as its preferences name no extension."""
    enabling = import_module(f"{extension.package}.common.enabling")
    monkeypatch.setattr(enabling, "_said", False)
    try:
        for _ in range(3):
            bpy.ops.preferences.addon_disable(module=extension.package)
            assert not hasattr(bpy.types, "BRDFC_OT_add_node")
            extension.api.new_material("phong")
            assert hasattr(bpy.types, "BRDFC_OT_add_node")
        assert capfd.readouterr().out.count("enabled for this session") == 1
    finally:
        bpy.ops.preferences.addon_enable(module=extension.package)


def test_a_disabled_extension_says_why_it_cant_be_enabled(extension, empty, monkeypatch):
    def refuse():
        raise RuntimeError("another is enabled")

    bpy.ops.preferences.addon_disable(module=extension.package)
    try:
        with monkeypatch.context() as patch:
            patch.setattr(import_module(extension.package), "register", refuse)
            with pytest.raises(RuntimeError, match="can't be enabled: another is enabled"):
                extension.api.new_material("phong")
        assert not bpy.data.materials
    finally:
        bpy.ops.preferences.addon_enable(module=extension.package)


def test_every_form_has_its_cost(extension):
    unknown = [
        (model, name)
        for model, entry in extension.api.models().items()
        for name, form in entry["representations"].items()
        if not form["cost"]
    ]
    assert not unknown, "run evidence/bench --forms"
