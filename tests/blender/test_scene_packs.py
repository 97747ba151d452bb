# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders every scene of the repository with an extension cut to it, which contains only what that
scene needs; and tests every model with all, some and none of its parameters made constant by such
an extension."""

import json
import re
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

import bpy
import numpy as np
import pytest
from helpers import render
from scene_loader import SceneLoader

SCENES = Path(__file__).parents[2] / "scenes"
#: Scenes that cover all kinds of materials: mirrors, glass, metal, textures, all models at once.
QUICK = {"dispersion", "gl-fig11", "sh-fresnel", "sh-glass"}
#: The picture of the README, and meshes.
SLOWER = {"as-fig8", "small-lamp"}
REPOSITORY = "user_default"


def scenes():
    names = sorted(p.stem for p in SCENES.glob("*.json") if p.stem != "schema")

    def marks(name):
        if name in QUICK:
            return []
        return [pytest.mark.full] if name in SLOWER else [pytest.mark.full, pytest.mark.evidence]

    return [pytest.param(name, marks=marks(name)) for name in names]


@contextmanager
def installed(extension, path):
    """The modules of an extension that is installed from its zip in place of the whole one."""
    name = re.sub(r"-[\d.]+\.zip$", "", path.name)
    package = f"bl_ext.{REPOSITORY}.{name}"
    bpy.ops.preferences.addon_disable(module=extension.package)
    try:
        bpy.ops.extensions.package_install_files(
            filepath=str(path), repo=REPOSITORY, enable_on_install=True
        )
        assert package in bpy.context.preferences.addons
        yield lambda module: import_module(f"{package}.{module}")
    finally:
        bpy.ops.preferences.addon_disable(module=package)
        bpy.ops.preferences.addon_enable(module=extension.package)


@pytest.mark.long
@pytest.mark.parametrize("name", scenes())
def test_a_scene_renders_from_its_own_extension(extension, empty, answers, tool, tmp_path, name):
    """As the driver does: installs, loads and renders, with every material of the scene."""
    content = json.loads((SCENES / f"{name}.json").read_text(encoding="utf-8"))
    content["settings"] |= {"width": 16, "height": 16, "spp": 2}
    source = tmp_path / f"{name}.json"
    source.write_text(json.dumps(content), encoding="utf-8")
    built = answers.built(["build", "--scene", str(source), "--explain", "--out", "out"])
    (path,) = (built / "out").glob("*.zip")
    tool("scene", source, "--out", tmp_path / "scene")
    with installed(extension, path) as module:
        scene = SceneLoader(module("api").__package__).load_scene(tmp_path / "scene" / "scene.json")
        picture = render(scene)[..., :3]
        made = {m.name: module("groups.model_nodes").group_nodes(m) for m in bpy.data.materials}
        models = {
            module("groups.model_nodes").identity(n).model for ours in made.values() for n in ours
        }
    assert models == {m["model"] for m in content["materials"].values()}
    assert np.isfinite(picture).all() and picture.max() > 1e-3


@pytest.mark.long
def test_a_scene_renders_from_its_own_extension_without_osl(
    extension, empty, answers, tool, tmp_path
):
    """Materials without a fixed form then use Blender's own nodes, which the extension contains
    unless it was built without; the picture is the same within the noise."""
    content = json.loads((SCENES / "as-fig7.json").read_text(encoding="utf-8"))
    content["settings"] |= {"width": 32, "height": 32, "spp": 64}
    source = tmp_path / "open.json"
    source.write_text(json.dumps(content), encoding="utf-8")
    built = {}
    for name, options in (("both", []), ("osl", ["--osl-only"])):
        made = answers.built(["build", "--scene", str(source), *options, "--out", "out"])
        (manifest,) = (made / "out").glob("*/manifest.json")
        built[name] = manifest.parent
    tool("scene", source, "--out", tmp_path / "scene")
    assert not (built["osl"] / "nodes").exists()
    pictures, load = {}, extension.scene_loader.load_scene
    for pack, osl, wanted in (
        ("both", True, {"exact", "aimed"}),
        ("both", False, {"nodes"}),
        ("osl", True, {"exact", "aimed"}),
    ):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        extension.pack.use(built[pack])
        try:
            scene = load(tmp_path / "scene" / "scene.json", osl=osl)
            ours = [n for m in bpy.data.materials for n in extension.model_nodes.group_nodes(m)]
            assert {extension.model_nodes.identity(node).form for node in ours} == wanted
            pictures[pack, osl] = render(scene)[..., :3]
            assert {extension.model_nodes.identity(node).form for node in ours} == wanted
        finally:
            extension.pack.use()
    with_osl = pictures["both", True]
    np.testing.assert_array_equal(pictures["osl", True], with_osl)
    assert np.abs(pictures["both", False].mean() / with_osl.mean() - 1) < 0.01


#: How many of a model's parameters are constant. With all of them constant, most twins must be
#: fitted again, which takes seconds each: QUICK_TWINS represent them.
FOLDED = ("all", "some", "none")
QUICK_TWINS = {"coupled", "lambert", "lambertian_specular"}


def values_of(entry):
    """Values other than the defaults, if they don't require fitting a twin: colours, and numbers of
    models without a twin."""
    values = {}
    for parameter in entry["parameters"]:
        value = parameter["default"]
        if parameter["kind"] == "color":
            value = [0.9 * v + shift for v, shift in zip(value, (0.02, 0.03, 0.04), strict=True)]
        elif parameter["kind"] == "number" and "twin" not in entry["representations"]:
            value = 1.05 * value if value else parameter["soft_max"] / 4
            value = min(max(value, parameter["soft_min"]), parameter["soft_max"])
        values[parameter["name"]] = value
    return values


def has_twin(name, entry, folded, varies, values):
    """Whether a model has a twin that needs no fit with these materials: its fixed parameters must
    have the same values in all of them."""
    if folded == "all":
        return name in QUICK_TWINS
    forms = entry["representations"].values()
    return all(
        key not in varies and all(form["only"].get(key, values[key]) == value for form in forms)
        for key, value in entry["representations"]["twin"]["only"].items()
    )


def materials_of(models, folded):
    """A material for each form of each model, except forms that would have to be fitted first, as
    in a file for `build --materials`. Of some parameters, either colours and the number of the
    stored twin vary, or the first one does."""
    made = {}
    for name, entry in models.items():
        values = values_of(entry)
        axis = (entry["representations"].get("twin", {}).get("axis") or {}).get("name")
        colours = {p["name"] for p in entry["parameters"] if p["kind"] == "color"}
        some = colours | {axis} if axis else {next(iter(values))}
        varies = {"all": set(), "some": some, "none": set(values)}[folded]
        for form, about in entry["representations"].items():
            if form == "fitted" or (
                form == "twin" and not has_twin(name, entry, folded, varies, values)
            ):
                continue
            given = {key: {"varies": True} if key in varies else v for key, v in values.items()}
            made[f"{name} {form}"] = {
                "model": name,
                "representation": form,
                "parameters": given | about["only"],
            }
    return made


def stands_in(node):
    """Values of a group's stand-in node by socket; None if linked."""
    found = {}
    for inner in node.node_tree.nodes:
        if inner.bl_idname in ("ShaderNodeBsdfGlass", "ShaderNodeBsdfMetallic"):
            for socket in filter(lambda s: s.enabled, inner.inputs):
                if socket.is_linked and socket.links[0].from_node.type == "COMBXYZ":
                    parts = socket.links[0].from_node.inputs
                    found[socket.name] = [None if p.is_linked else p.default_value for p in parts]
                else:
                    found[socket.name] = None if socket.is_linked else socket.default_value
    return found


@pytest.mark.long
@pytest.mark.full
@pytest.mark.parametrize("part", FOLDED)
def test_every_model_with_constants_loads_with_its_twin(extension, empty, use_pack, few_of, part):
    api, nodes, pack = extension.api, extension.nodes, extension.pack
    canonical = extension.parameter_values.canonical
    whole = json.loads(json.dumps(dict(few_of(pack.manifest()["models"].items(), 5))))
    materials = materials_of(whole, part)
    albedos = {
        name: extension.energy.albedo(name, canonical(values_of(entry)), 0.7)
        for name, entry in whole.items()
        if entry.get("albedo")
    }
    use_pack(materials)
    for name, entry in whole.items():
        values = canonical(values_of(entry))
        fixed = pack.model(name).fixed
        assert {"all": len(fixed) == len(values), "none": not fixed, "some": True}[part], name
        for form in pack.model(name).forms:
            only = pack.model(name).forms[form].only
            given = {k: v for k, v in (values | only).items() if k not in fixed}
            material = api.new_material(name, form, **given)
            (node,) = extension.model_nodes.group_nodes(material)
            assert nodes.script_problem(node.node_tree) is None
            sockets = set(extension.model_nodes.sockets(node)) - {"Normal", "Tangent"}
            assert sockets.isdisjoint(fixed) and sockets <= set(given)
            complete = extension.model_nodes.all_values(node)
            for key, value in (values | only | fixed).items():
                equal = extension.parameter_values.equal_in_float32(complete[key], value)
                assert equal, (name, form, key)
            for socket, found in stands_in(node).items():
                check_stand_in(socket, found, fixed)
            if name in albedos and not only:
                found = api.albedo(name, 0.7, **given)
                assert found == pytest.approx(albedos[name], abs=2e-3), name
            bpy.data.materials.remove(material)


def check_stand_in(socket, found, fixed):
    """Checks that fixed parameters are constants of the node, and the others linked."""
    names = {"IOR": ["ior"], "Extinction": ["k_r", "k_g", "k_b"]}
    if isinstance(found, list):
        names["IOR"] = ["n_r", "n_g", "n_b"]
    if socket not in names:
        return
    values = found if isinstance(found, list) else [found]
    for name, value in zip(names[socket], values, strict=True):
        expected = fixed.get(name)
        assert value is None if expected is None else value == pytest.approx(expected), name
