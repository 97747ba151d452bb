# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of measured BRDFs: files made here from formulas, and what is found in them."""

import dataclasses
import functools
import itertools
import json
import math
import os
import subprocess
from importlib import import_module
from types import SimpleNamespace

import bpy
import helpers
import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("by_the_tool")
#: Fitting every model to a file takes most of the time of these tests.
FITS = pytest.mark.together("measured fits")


def direction(theta, phi):
    theta, phi = np.radians(theta), np.radians(phi)
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )


@pytest.fixture(scope="module")
def write_table(extension, tmp_path_factory):
    """write_table(name, model, matte=0, **values): an isotropic table of f of a model, and of a
    Lambert surface beside it."""
    formulas = import_module(f"{extension.package}.brdfc")
    angles = [0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50, 55, 60, 65, 70, 75, 80, 85]
    turns = [*range(0, 160, 10), *range(160, 181, 2)]

    def write(name, model, matte=0.0, **values):
        grid = np.array(list(itertools.product(angles, [0], angles, turns)), float)
        wi, wo = direction(grid[:, 0], grid[:, 1]), direction(grid[:, 2], grid[:, 3])
        f = formulas.model(model).eval(wi, wo, **values) + matte / math.pi
        path = tmp_path_factory.mktemp("measured") / name
        rows = np.concatenate([grid, f], axis=1)
        np.savetxt(
            path,
            rows,
            fmt="%.9g",
            delimiter=",",
            header="theta_i,phi_i,theta_o,phi_o,r,g,b",
            comments="",
        )
        return path

    return write


@pytest.fixture(scope="module")
def paint(write_table):
    return write_table("paint.csv", "ward", ks=(0.2, 0.1, 0.05), ax=0.25, ay=0.25)


@pytest.fixture(scope="module")
def found(extension, paint):
    return extension.api.measured_fits(paint)


@FITS
def test_what_a_file_holds(paint, found):
    assert found.isotropic and found.path == paint
    # Of models whose errors hardly differ, the simpler one comes first. No data hold a mirror.
    errors = [fit.error + fit.mirror for fit in found.fits]
    assert all(before < 1.06 * after for before, after in itertools.pairwise(errors))
    ward = found.fit("ward")
    assert ward.error < 0.02  # what straight lines between angles miss
    assert ward.parameters["ax"] == pytest.approx(0.25, rel=0.02)
    assert ward.parameters["ks"] == pytest.approx((0.2, 0.1, 0.05), rel=0.03)
    with pytest.raises(ValueError, match="Expected one of the models"):
        found.fit("lunar_lambert")


def test_only_the_model_of_the_material_is_fitted(extension, empty, paint, monkeypatch):
    asked = []
    fitting = extension.api.measured.Fitting

    def recorded(path, models, sums):
        asked.append((models, sums))
        return fitting(path, models, sums)

    monkeypatch.setattr(extension.api.measured, "Fitting", recorded)
    extension.api.new_measured_material(paint, "ward")
    with pytest.raises(ValueError, match="Expected one of the models .*lobes, got 'wood'"):
        extension.api.new_measured_material(paint, "wood")
    with pytest.raises(ValueError, match="has no render method"):
        extension.api.new_measured_material(paint, "ward", "exact")
    assert asked == [("ward", False)]


@FITS
@pytest.mark.parametrize("model", ["ward", "factors"])
def test_a_material_of_a_file(extension, empty, found, model):
    material = extension.api.new_measured_material(found, model)
    assert material.name == "paint"
    (node,) = extension.model_nodes.group_nodes(material)
    for name, value in found.fit(model).parameters.items():
        if not isinstance(value, str):
            got = extension.model_nodes.get_value(node, name)
            assert got == pytest.approx(value, rel=1e-5, abs=1e-6), name


@pytest.mark.long
@pytest.mark.slow
def test_matte_light_is_added(extension, empty, write_table):
    """In a white world the sum is brighter than the model by the Lambert surface's albedo."""
    path = write_table("paper.csv", "cook_torrance", matte=0.4, m=0.3)
    found = extension.api.measured_fits(path)
    assert found.fit("cook_torrance").matte == pytest.approx((0.4,) * 3, rel=0.05)
    seen = []
    for measured in (True, False):
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        scene = bpy.context.scene
        extension.scene_loader.apply_clean_settings(scene)
        material = (
            extension.api.new_measured_material(found, "cook_torrance")
            if measured
            else extension.api.new_material("cook_torrance", m=0.3)
        )
        helpers.sphere_scene(scene, material, size=8, samples=256)
        seen.append(helpers.render(scene)[3:5, 3:5, 1].mean())
    assert seen[0] - seen[1] == pytest.approx(0.4, rel=0.05)


@FITS
def test_the_sum_of_lobes_is_added_up(extension, empty, found):
    """A node a lobe, whose sum leads to the output; nothing is left after an error."""
    best = found.lobe_sum()
    assert [len(each.lobes) for each in found.sums] == list(range(1, len(found.sums) + 1))
    errors = [each.error for each in found.sums]
    assert errors == sorted(errors, reverse=True) and sum(
        lobe.share for lobe in best.lobes
    ) == pytest.approx(1)
    assert best.error <= found.fits[0].error
    material = extension.api.new_measured_material(found, "lobes")
    assert material.name == "paint"
    nodes = {
        extension.model_nodes.identity(n).model: n
        for n in extension.model_nodes.group_nodes(material)
    }
    assert nodes.keys() == {lobe.model for lobe in best.lobes}
    for lobe in best.lobes:
        for name, value in lobe.parameters.items():
            if not isinstance(value, str):
                got = extension.model_nodes.get_value(nodes[lobe.model], name)
                assert got == pytest.approx(value, rel=1e-5, abs=1e-6), name
    tree = material.node_tree
    added = [n for n in tree.nodes if n.type == "ADD_SHADER"]
    assert len(added) == len(best.lobes) - 1
    materials = len(bpy.data.materials)
    with pytest.raises(ValueError, match="ax"):
        extension.api.new_sum([("ward", {}), ("ward", {"ax": 5})])
    for given in ([], None, "ward", ["ward", "lambert"], [{"model": "ward"}], [("ward", None)]):
        with pytest.raises(ValueError, match="Expected a list of lobes, each a model and a dict"):
            extension.api.new_sum(given)
    most = extension.pack.manifest()["lobes"]["most"]
    with pytest.raises(ValueError, match=f"Expected at most {most} lobes, got {most + 1}"):
        extension.api.new_sum([("lambert", {})] * (most + 1))
    assert len(bpy.data.materials) == materials


SUM = {
    "sum": [
        {"model": "lambert", "parameters": {"rho": [0.3, 0.2, 0.1]}},
        {"model": "cook_torrance", "parameters": {"m": 0.25, "f0": [0.1, 0.2, 0.3]}},
        {
            "model": "lafortune",
            "parameters": {"cxy": 1, "cz": 0.9, "e": 8, "ks": [0.2, 0.1, 0.1]},
        },
    ]
}


BALL = {
    "name": "ball",
    "settings": {"width": 24, "height": 24, "spp": 1024, "seed": 1, "max_bounces": 0},
    "camera": {
        "type": "orthographic",
        "height": 2.2,
        "position": [0, -5, 0],
        "look_at": [0, 0, 0],
        "up": [0, 0, 1],
    },
    "objects": [{"name": "o", "shape": {"type": "sphere", "radius": 1}, "material": "m"}],
    "lights": [{"type": "point", "position": [2, -4, 3], "radius": 0.5, "power": 300}],
    "environment": {"color": [0.3, 0.3, 0.3]},
}


def blocks(picture):
    """Means of 4 x 4 pixels, without those at the edge of the picture."""
    return picture[..., :3].reshape(6, 4, 6, 4, 3).mean((1, 3))[1:5, 1:5]


@pytest.fixture(scope="module")
def ball(program, tmp_path_factory):
    """ball(name, material): the file of a scene, a ball under a lamp and a grey sky, and its blocks
    by the reference. Equal ones are made once for all tests."""
    folder = tmp_path_factory.mktemp("balls")

    @functools.cache
    def render(name, text):
        file, out = folder / f"{name}.json", folder / f"{name}.exr"
        file.write_text(json.dumps(BALL | {"materials": {"m": json.loads(text)}}))
        subprocess.run([program, "render", file, "--out", out], check=True, capture_output=True)
        pixels = helpers.open_image_io().ImageBuf(str(out)).get_pixels()
        return file, blocks(pixels[::-1])  # row 0 at the bottom, as in helpers.render()

    return lambda name, material: render(name, json.dumps(material))


@pytest.fixture(scope="module")
def resolved(program, tmp_path_factory):
    """resolved(file): a scene's file with what is fitted to its data in their place."""
    folder = tmp_path_factory.mktemp("resolved")

    @functools.cache
    def resolve(file):
        subprocess.run([program, "scene", file, "--out", folder / file.stem], check=True)
        return folder / file.stem / "scene.json"

    return resolve


@pytest.fixture
def in_blender(extension, empty, resolved):
    """in_blender(file, osl): the blocks of a scene's file by Blender."""

    def render(file, osl):
        return blocks(helpers.render(extension.scene_loader.load_scene(resolved(file), osl=osl)))

    return render


@pytest.fixture(scope="module")
def two_colored(write_table):
    """A Ward highlight with a colour of its own over a matte surface."""
    return write_table("paint.csv", "ward", matte=0.2, ks=(0.2, 0.1, 0.05), ax=0.2, ay=0.2)


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize("osl", [True, False])
def test_blender_and_the_reference_have_one_sum(ball, in_blender, osl):
    """Blocks of the pictures differ by noise, and a lobe that is left out is seen."""
    file, expected = ball("whole", SUM)
    got = in_blender(file, osl)
    _, without = ball("part", {"sum": SUM["sum"][:2]})
    print(np.abs(got / expected - 1).max())
    assert np.abs(got / expected - 1).max() < 0.03
    assert np.abs(without / expected - 1).max() > 0.15
    np.testing.assert_allclose(got.mean((0, 1)), expected.mean((0, 1)), rtol=0.01)


LAYERS = {
    "layers": [
        {
            "model": "microfacet",
            "parameters": {"f0": [0.1, 0.2, 0.3], "ax": 0.3, "ay": 0.5, "distribution": "beckmann"},
        },
        {"model": "radziszewski_alda", "parameters": {"n": 8, "tint": [0.3, 0.2, 0.3]}},
        {"model": "lambert", "parameters": {"rho": [0.8, 0.3, 0.1]}},
    ]
}


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize("osl", [True, False])
def test_blender_and_the_reference_have_the_same_layers(ball, in_blender, osl):
    """What lies below is dimmed: blocks differ by noise, and from those of the sum."""
    file, expected = ball("layers", LAYERS)
    got = in_blender(file, osl)
    _, added = ball("added", {"sum": LAYERS["layers"]})
    print(np.abs(got / expected - 1).max())
    assert np.abs(got / expected - 1).max() < 0.03
    assert np.abs(added / expected - 1).max() > 0.15
    np.testing.assert_allclose(got.mean((0, 1)), expected.mean((0, 1)), rtol=0.01)


@pytest.mark.parametrize("native", [True, False])
def test_a_coat_lies_over_any_nodes(extension, empty, native):
    """A white ball under varnish in a white world stays white; after an error nothing changes."""
    if native:
        material = helpers.node_material("ShaderNodeBsdfDiffuse", Color=(1.0, 1.0, 1.0, 1.0))
    else:
        material = extension.api.new_material("lambert", rho=1.0)
    names = set(material.node_tree.nodes.keys())
    with pytest.raises(ValueError, match="ax"):
        extension.api.add_coat(material, ax=5)
    refracting = {"radziszewski_alda": {"around": "refraction"}, "glass": {}, "rough_glass": {}}
    for model, values in refracting.items():
        with pytest.raises(ValueError, match="lets light through"):
            extension.api.add_coat(material, model, **values)
    assert set(material.node_tree.nodes.keys()) == names
    coat = extension.api.add_coat(material, ax=0.2, ay=0.2)
    assert extension.model_nodes.get_value(coat, "f0") == pytest.approx((0.04,) * 3)
    extension.scene_loader.apply_clean_settings(empty, samples=256, osl=False)
    helpers.sphere_scene(empty, material, size=16, samples=1024)
    picture = helpers.render(empty)[4:12, 4:12, :3]
    assert picture.mean() == pytest.approx(1, abs=2e-3)
    assert np.abs(picture - 1).max() < 0.02


@pytest.mark.parametrize("kind", ["ShaderNodeBsdfPrincipled", "ShaderNodeBsdfDiffuse"])
def test_a_coat_stands_beside_the_node_that_it_covers(extension, empty, kind):
    """Above a Principled node it was out of sight. No node covers another one."""
    material = helpers.node_material(kind)
    tree = material.node_tree
    below = next(n for n in tree.nodes if n.bl_idname == kind)
    below.location = (-40, 200)
    for _ in range(2):
        coat = extension.api.add_coat(material)
        (over,) = (link.to_node for link in coat.outputs["BSDF"].links)
        output = tree.get_output_node("CYCLES")
        row = [below, coat, over, output]
        assert [n.location.y for n in row[:3]] == [200] * 3
        for left, right in zip(row[:-1], row[1:], strict=True):
            assert 0 < right.location.x - (left.location.x + left.width) <= 100
        below = over


@pytest.mark.parametrize("model", ["disney", "eon", "factors", "hapke", "thin_film"])
def test_models_without_an_albedo_are_coats_as_twins(extension, empty, model):
    """As docs/blender.md says, and where they lie below a coat."""
    material = helpers.node_material("ShaderNodeBsdfDiffuse")
    nodes = material.node_tree.nodes
    names = set(nodes.keys())
    with pytest.raises(ValueError, match="has no Albedo output"):
        extension.api.add_coat(material, model)
    assert set(nodes.keys()) == names
    assert extension.api.add_coat(material, model, "twin").outputs["Albedo"].is_linked
    extension.api.new_layers([("microfacet", {}), (model, {})])


def test_nothing_to_coat(extension, empty):
    material = bpy.data.materials.new("Bare")
    extension.nodes.empty_tree(material)
    groups = len(bpy.data.node_groups)
    with pytest.raises(ValueError, match="Nothing is connected to the surface of material 'Bare'"):
        extension.api.add_coat(material)
    assert len(bpy.data.node_groups) == groups and not material.node_tree.nodes
    if bpy.app.version < (5, 0):
        material.use_nodes = False
        with pytest.raises(ValueError, match="Use Nodes is off"):
            extension.api.add_coat(material)


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize("osl", [True, False])
def test_curves_look_as_the_data_do(ball, in_blender, two_colored, osl):
    """The reference renders the data themselves, to which no other single model is near."""
    path = str(two_colored)
    file, fitted = ball("curves", {"measured": path, "as": "factors"})
    _, data = ball("data", {"measured": path})
    got = in_blender(file, osl)
    print(np.abs(got / fitted - 1).max())
    assert np.abs(got / fitted - 1).max() < 0.03
    print(np.abs(got / data - 1).max())
    assert np.abs(got / data - 1).max() < 0.06
    np.testing.assert_allclose(got.mean((0, 1)), data.mean((0, 1)), rtol=0.02)


def done(found):
    """A job whose result is known."""
    return SimpleNamespace(step=lambda: None, result=found)


@FITS
@pytest.mark.slow
def test_the_operator_makes_the_closest(extension, empty, paint, found, monkeypatch):
    # Fitting all models once more takes ten seconds.
    start = extension.api.start_measured_fits
    monkeypatch.setattr(
        extension.api,
        "start_measured_fits",
        lambda path: done(found) if str(path) == str(paint) else start(path),
    )
    ball = helpers.add_sphere(empty, None)
    bpy.context.view_layer.objects.active = ball
    assert bpy.ops.brdfc.new_measured_material(filepath=str(paint)) == {"FINISHED"}
    (node,) = extension.model_nodes.group_nodes(ball.active_material)
    assert extension.model_nodes.identity(node).model == "ward"
    with pytest.raises(RuntimeError, match="There is no file"):
        bpy.ops.brdfc.new_measured_material(filepath=str(paint) + "x")
    # As Blender passes on what was dropped.
    files = [{"name": paint.name}, {"name": "none.csv"}]
    assert bpy.ops.brdfc.new_measured_material(
        filepath=str(paint), directory=str(paint.parent), files=files
    ) == {"FINISHED"}
    assert ball.active_material.name == "paint.001"
    handler = bpy.types.FileHandler.bl_rna_get_subclass_py("BRDFC_FH_measured")
    assert handler.bl_import_operator == "brdfc.new_measured_material"
    assert handler.bl_file_extensions == ".binary;.bsdf;.bin;.alta;.dat;.xml"


@pytest.fixture(scope="module")
def wide(extension, write_table):
    """What is found where facets face everywhere: the highlight of any Beckmann slope up to 1 is
    narrower."""
    path = write_table("wide.csv", "microfacet", ax=1.0, ay=1.0, distribution="ggx")
    return fitted(extension, path, "cook_torrance")


@pytest.fixture(scope="module")
def brushed(extension, tmp_path_factory):
    """What is found where a highlight lies along a tangent that is turned by 30 degrees."""
    formulas = import_module(f"{extension.package}.brdfc")
    angles, azimuths = [0, 15, 30, 45, 60, 75, 85], range(0, 360, 30)
    grid = np.array(list(itertools.product(angles, azimuths, angles, azimuths)), float)
    wi, wo = (direction(grid[:, k], grid[:, k + 1] - 30) for k in (0, 2))
    f = formulas.model("ward").eval(wi, wo, ks=0.3, ax=0.2, ay=0.6)
    path = tmp_path_factory.mktemp("measured") / "brushed.csv"
    header = "theta_i,phi_i,theta_o,phi_o,r,g,b"
    np.savetxt(path, np.hstack([grid, f]), "%.6g", ",", header=header, comments="")
    return fitted(extension, path, "ward")


def fitted(extension, path, model):
    """One model is fitted in a second."""
    return import_module(f"{extension.package}.measured").Fitting(path, model, sums=False).wait()


def test_a_fit_says_what_keeps_it_from_coming_closer(wide, brushed, found):
    narrow, straight = wide.fit("cook_torrance"), brushed.fit("ward")
    assert narrow.stopped == ("m",) and narrow.turned is None
    assert narrow.remarks() == [
        "The fit stopped at the end of the range of Slope: values beyond it might come closer"
    ]
    assert straight.stopped == () and straight.turned.error < 0.7 * straight.error
    assert math.degrees(straight.turned.angle) == pytest.approx(-30, abs=1)
    (said,) = straight.remarks()
    degrees = f"{-math.degrees(straight.turned.angle):.1f} degrees"
    assert said == f"The tangent is turned by {degrees}, as the model has no rotation"
    assert straight.used == straight.turned
    fine = found.fit("ward")
    assert fine.stopped == () and fine.turned is None and fine.remarks() == []


def _plane(scene, material, turn):
    """A picture of a large plane that faces the camera, turned about its normal, under a lamp."""
    mesh = bpy.data.meshes.new("Plane")
    mesh.from_pydata(
        [(x, 0, z) for x, z in itertools.product((-9, 9), (-9, 9))], [], [(0, 1, 3, 2)]
    )
    mesh.flip_normals()
    mesh.materials.append(material)
    plane = bpy.data.objects.new("Plane", mesh)
    plane.rotation_euler = (0, turn, 0)
    scene.collection.objects.link(plane)
    picture = helpers.render(scene)[..., :3]
    bpy.data.objects.remove(plane)
    return picture


@pytest.mark.slow
@pytest.mark.parametrize("osl", [False, True], ids=["nodes", "osl"])
def test_the_tangent_is_turned_instead_of_the_data(extension, empty, brushed, osl):
    """As if the object were turned, which takes its tangent along."""
    empty.cycles.shading_system = osl
    helpers.add_camera(empty, orthographic=6)
    helpers.add_lamp(empty, "POINT", location=(2, -3, 1.5), energy=500)
    empty.render.resolution_x = empty.render.resolution_y = 16
    empty.cycles.samples = 64
    found = _plane(empty, extension.api.new_measured_material(brushed), 0)
    model = extension.api.new_material("ward", ks=0.3, ax=0.2, ay=0.6)
    # Seen from the camera, which looks along +y, a turn about y is clockwise: from the bitangent
    # to the tangent.
    off = {
        turn: np.abs(_plane(empty, model, math.radians(turn)) - found).sum() / found.sum()
        for turn in (-30, 0, 30)
    }
    print(off)
    # The table is coarse.
    (fit,) = brushed.fits
    assert off[-30] < fit.turned.error < 0.9 * fit.error < min(off[0], off[30])


def test_the_dialog_and_the_message_say_it(extension, empty, monkeypatch, wide, brushed):
    operators = import_module(f"{extension.package}.operators.measured")
    operator = operators.BRDFC_OT_choose_measured
    item = helpers.add_sphere(empty, None)
    bpy.context.view_layer.objects.active = item
    for data in (wide, brushed):
        (fit,) = data.fits
        (said,) = fit.remarks()
        layout, reports = helpers.Layout(), []
        told = SimpleNamespace(
            layout=layout,
            found=(data,),
            refusals=(),
            model=fit.model,
            report=lambda kind, text, reports=reports: reports.append((kind, text)),
        )
        operator.draw(told, bpy.context)
        assert said in " ".join(layout.log)
        assert operator.execute(told, bpy.context) == {"FINISHED"}
        assert ({"INFO"}, str(said)) in reports
        assert reports[-1][1] != said
    # Without a dialog, too.
    monkeypatch.setattr(extension.api, "start_measured_fits", lambda path: done(brushed))
    told = helpers.Stand(operators.BRDFC_OT_new_measured_material)
    told.filepath, told.directory, told.files = "x", "", []
    assert told.execute(bpy.context) == {"FINISHED"}
    assert ({"INFO"}, str(said)) in told.reports


class Dropped(helpers.Stand):
    bl_idname, _started = "brdfc.new_measured_material", None


@pytest.fixture
def dropped(extension, empty, monkeypatch, wide, brushed, write_table):
    """The operator as it is when three files are dropped together, the second of which is
    damaged."""
    broken = wide.path.with_name("broken.csv")
    broken.write_text("theta_i,phi_i\n1,2\n")
    known = {str(data.path): data for data in (wide, brushed)}
    start = extension.api.start_measured_fits
    monkeypatch.setattr(
        extension.api,
        "start_measured_fits",
        lambda path: done(known[path]) if path in known else start(path),
    )
    operators = import_module(f"{extension.package}.operators.measured")
    stand = Dropped(operators.BRDFC_OT_new_measured_material)
    # Paths that are absolute stay as they are beside another folder.
    paths = [str(path) for path in (brushed.path, broken, wide.path)]
    stand.filepath, stand.directory = paths[0], str(wide.path.parent)
    stand.files = [SimpleNamespace(name=path) for path in paths]
    bpy.context.view_layer.objects.active = helpers.add_sphere(empty, None)
    return stand


def test_each_of_several_files_becomes_a_material(extension, dropped):
    """Only the first did, and nothing was said. A file that is refused is named; others go on."""
    assert dropped.execute(bpy.context) == {"FINISHED"}
    assert [m.name for m in bpy.data.materials] == ["brushed", "wide"]
    assert bpy.context.object.active_material.name == "brushed"
    assert bpy.data.materials["wide"].use_fake_user, "it has no other user, and would not be saved"
    warnings = [text for kind, text in dropped.reports if kind == {"WARNING"}]
    assert warnings[0] == "broken.csv can't be read as a measured material"
    assert warnings[1:] == ["Made brushed, wide; brushed assigned to Sphere. Failed: broken.csv"]
    (said,) = (text for _, text in dropped.reports if "The tangent is turned" in text)
    assert said.startswith("brushed.csv: ")


def test_a_file_browser_passes_on_what_was_selected(extension, dropped):
    dropped.browsed = True
    called = []

    def stand_in(how, **given):
        called.append((how, given))
        return {"RUNNING_MODAL"}

    with pytest.MonkeyPatch.context() as patch:
        ops = SimpleNamespace(brdfc=SimpleNamespace(new_measured_material=stand_in))
        patch.setattr(bpy, "ops", ops)
        assert dropped.execute(bpy.context) == {"RUNNING_MODAL"}
    ((how, given),) = called
    assert how == "INVOKE_DEFAULT" and given["filepath"] == dropped.filepath
    assert given["directory"] == dropped.directory
    assert [file["name"] for file in given["files"]] == [file.name for file in dropped.files]


def test_several_files_that_all_fail(extension, dropped):
    broken = dropped.files[1]
    dropped.files = [broken, SimpleNamespace(name="none.csv")]
    assert dropped.execute(bpy.context) == {"CANCELLED"}
    assert not bpy.data.materials
    assert dropped.reports[-1] == (
        {"ERROR"},
        "No material was made. Failed: broken.csv, none.csv",
    )
    dropped.reports.clear()
    dropped.files = [broken]
    assert dropped.execute(bpy.context) == {"CANCELLED"}
    assert dropped.reports[-1] == (
        {"ERROR"},
        "broken.csv can't be read as a measured material",
    )


def test_the_choice_for_several_files_applies_to_all(extension, dropped, wide, brushed):
    """Models that were fitted to all of them are offered, and the nearest of each."""
    operator = import_module(f"{extension.package}.operators.measured").BRDFC_OT_choose_measured
    found, refusals = dropped.start().wait()
    try:
        operator.show(found.values(), refusals)
        # One model was fitted to each file, and not the same.
        assert [item[0] for item in operator.offered] == ["nearest"]
        both = [dataclasses.replace(brushed, fits=(*brushed.fits, *wide.fits)), wide]
        operator.show(both, refusals)
        assert [item[0] for item in operator.offered] == ["nearest", "cook_torrance"]
        stand, layout = helpers.Stand(operator), helpers.Layout()
        stand.layout, stand.model = layout, "cook_torrance"
        stand.draw(bpy.context)
        text = " ".join(layout.log)
        for part in ("broken.csv can't be read", "brushed.csv: ", "wide.csv: "):
            assert part in text
        assert stand.execute(bpy.context) == {"FINISHED"}
    finally:
        operator.found, operator.refusals, operator.offered = (), (), ()
    models = {
        material.name: extension.model_nodes.identity(node).model
        for material in bpy.data.materials
        for node in extension.model_nodes.group_nodes(material)
    }
    assert models == {"brushed": "cook_torrance", "wide": "cook_torrance"}
    assert stand.reports[-1][1].endswith("Failed: broken.csv")


def test_progress_and_esc_with_several_files(extension, dropped, manager, monkeypatch):
    """The file and its number are shown. After Esc nothing is changed, and nothing runs."""
    start, started = extension.api.start_measured_fits, []

    def start_slowly(path):
        if path != dropped.files[1].name:
            return start(path)
        started.append(SimpleNamespace(step=lambda: 0.5, cancel=lambda: started.append("ended")))
        return started[0]

    monkeypatch.setattr(extension.api, "start_measured_fits", start_slowly)
    assert dropped.invoke(manager.context, None) == {"RUNNING_MODAL"}
    for _ in range(3):
        result = dropped.modal(manager.context, SimpleNamespace(type="TIMER"))
        assert result == {"RUNNING_MODAL"}
    shown = [text for text in manager.told if isinstance(text, str) and "Esc" in text]
    assert shown[0] == "Fitting models to brushed.csv, 1 of 3: 0%   Esc: cancel"
    assert shown[-1] == "Fitting models to broken.csv, 2 of 3: 50%   Esc: cancel"
    escape = SimpleNamespace(type="ESC")
    assert dropped.modal(manager.context, escape) == {"CANCELLED"}
    assert started[-1] == "ended" and not bpy.data.materials
    assert "nothing is changed" in dropped.reports[-1][1]


def test_the_dialogs_list_keeps_its_texts(extension, empty, wide):
    """Blender holds no reference to them: new ones at each redraw were shown as garbage."""
    operator = import_module(f"{extension.package}.operators.measured").BRDFC_OT_choose_measured
    try:
        operator.show([wide], {})
        items = operator.__annotations__["model"].keywords["items"]
        first, again = (items(None, bpy.context) for _ in range(2))
        assert first and all(a is b for a, b in zip(first, again, strict=True))
        assert wide.fits[0].model == first[0][0]
    finally:
        operator.found, operator.offered = (), ()


@pytest.mark.parametrize("name", ["new_measured_material", "new_measured_library"])
def test_a_browsed_file_that_fails_is_a_sentence(extension, empty, monkeypatch, tmp_path, name):
    """It was a traceback, as was to cancel the file browser."""
    module = import_module(f"{extension.package}.operators.measured")
    operator = getattr(module, f"BRDFC_OT_{name}")
    monkeypatch.setenv("BRDFC_TOOL", str(tmp_path / "none"))
    stand = helpers.Stand(operator)
    stand.browsed = True
    stand.filepath, stand.directory, stand.files = str(tmp_path / "x.csv"), str(tmp_path), []
    assert stand.execute(bpy.context) == {"CANCELLED"}
    assert stand.reports[-1][0] == {"ERROR"}
    stand.cancel(bpy.context)


@pytest.mark.parametrize(
    ("content", "said"),
    [("theta_i,phi_i\n1,2\n", "can't be read"), ("", "can't be read")],
)
def test_a_file_that_is_none_is_refused(extension, empty, tmp_path, content, said):
    path = tmp_path / "bad.csv"
    path.write_text(content)
    materials = len(bpy.data.materials)
    with pytest.raises(extension.api.MeasuredError, match=said):
        extension.api.new_measured_material(path)
    with pytest.raises(extension.api.MeasuredError, match="is a folder: New Measured Library"):
        extension.api.measured_fits(str(tmp_path))
    with pytest.raises(extension.api.MeasuredError, match="There is no file"):
        extension.api.new_measured_material(tmp_path / "none.binary")
    assert len(bpy.data.materials) == materials


def test_without_the_program(extension, empty, paint, monkeypatch):
    monkeypatch.delenv("BRDFC_TOOL")
    monkeypatch.setenv("PATH", os.devnull)
    with pytest.raises(extension.api.MeasuredError, match="The program brdfc was not found"):
        extension.api.measured_fits(paint)
