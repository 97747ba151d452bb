# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots in the panel: their pixels show the model's values, and drawing them is fast."""

import functools
import json
import math
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import bpy
import helpers
import numpy as np
import pytest
from goniometer import unit
from helpers import arguments, pairs_csv, read_csv
from test_fitted import along_sliders

SCRIPTS = Path(__file__).parents[2] / "script"


@pytest.fixture(scope="module")
def panel(extension):
    return import_module(f"{extension.package}.panels.plot_panel")


@pytest.fixture(scope="module")
def plots(extension):
    return import_module(f"{extension.package}.plotting.plots")


def pixels_of(preview):
    """(rows from below, columns, RGB) from 0 to 1, as Blender stores them."""
    width, height = preview.image_size
    flat = np.empty(width * height, np.int32)
    preview.image_pixels.foreach_get(flat)
    return flat.view(np.uint8).reshape(height, width, 4)[..., :3] / 255


def shown(panel, extension, model, **values):
    material = extension.api.new_material(model, **values)
    (node,) = extension.model_nodes.group_nodes(material)
    preview, near = panel.picture(node)
    return pixels_of(preview), near


def above(picture):
    """The half circle; rows from below."""
    return picture[-(picture.shape[1] // 2) :]


def peak_angle(picture):
    """The angle from the normal, in degrees, at which the lobe in the half circle is longest, and
    its length."""
    size = picture.shape[1]
    upper = above(picture).min(axis=-1)
    rows, columns = np.nonzero(upper > 0.9)
    x, y = (columns + 0.5) / (size / 2) - 1, (rows + 0.5) / (size / 2) - 0.03
    far = np.argmax(np.hypot(x, y))
    return math.degrees(math.atan2(x[far], y[far])), float(np.hypot(x[far], y[far]) / 0.94)


def loaded(package):
    start = f"{package}.brdfc.models."
    return sorted(name.removeprefix(start) for name in sys.modules if name.startswith(start))


@pytest.mark.slow
def test_formulas_are_not_loaded_before_a_plot_is_drawn(
    extension, panel, empty, extension_zip, tmp_path
):
    """This makes Blender start faster."""
    script = f"""
import sys
sys.path.insert(0, {str(SCRIPTS)!r})
import render_scene
render_scene.start_blender({str(extension_zip)!r}, {str(tmp_path)!r})
print("loaded:", [m for m in sys.modules if ".brdfc.models" in m or m.endswith(".plots")])
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "loaded: []" in done.stdout
    # Other tests have drawn other models.
    for name in loaded(extension.package):
        del sys.modules[f"{extension.package}.brdfc.models.{name}"]
    shown(panel, extension, "lambert")
    assert loaded(extension.package) == ["lambert"]


@pytest.mark.parametrize(("form", "balls"), [("exact", 2), ("twin", 3)])
def test_balls_of_a_matte_surface_are_lamberts_cosine(extension, panel, plots, empty, form, balls):
    """For the model, for a twin, and for a Principled node without a specular interface."""
    rho = np.array([0.8, 0.4, 0.1])
    material = extension.api.new_material("lambert", form, rho=tuple(rho))
    (node,) = extension.model_nodes.group_nodes(material)
    picture = pixels_of(panel.picture(node)[0])[plots.BALLS]
    lamp = np.array([-0.45, 0.6, 0.66]) / np.linalg.norm([-0.45, 0.6, 0.66])
    for ball in range(balls):
        left = round((ball + 0.5) / balls * plots.SIZE - plots.BALL / 2)
        for row, column in ((53, 53), (66, 40), (26, 66), (86, 46)):
            x, y = ((2 * (at + 0.5) / plots.BALL - 1) / 0.92 for at in (column, row))
            n = np.array([x, y, math.sqrt(1 - x * x - y * y)])
            toned = 1 - np.exp(-rho * max(0.0, float(n @ lamp)))
            screen = np.where(toned < 0.0031308, 12.92 * toned, 1.055 * toned ** (1 / 2.4) - 0.055)
            found = picture[plots.KEY + row, left + column]
            np.testing.assert_allclose(found, screen, atol=1.5 / 255, err_msg=f"{ball}")


@pytest.mark.parametrize(
    ("model", "values"),
    [
        ("lambert", {"rho": 0.5}),
        ("cook_torrance", {"f0": (1.0, 0.6, 0.2), "m": 0.3}),
        ("oren_nayar", {"rho": (0.9, 0.5, 0.3), "sigma": 0.5}),
        ("lossless", {"tint": (1.0, 0.7, 0.4), "n": 25}),
        ("ward", {"ks": 0.9, "ax": 0.3, "ay": 0.3}),
    ],
)
def test_the_albedo_curve_is_that_of_the_table(extension, panel, plots, empty, model, values):
    """Compared with the extension's table, which C++ quadrature made. A pixel is 1.3 % of the
    light."""
    picture = shown(panel, extension, model, **values)[0][plots.CURVES]
    height, width, _ = picture.shape
    margin, top = 8, 1.15
    for degrees in (3, 30, 60, 80):
        column = margin + round(degrees / 90 * (width - 2 * margin))
        cosine = math.cos(math.radians((column - margin) * 90 / (width - 2 * margin)))
        albedo = extension.api.albedo(model, cosine, **values)
        for c in range(3):
            row = margin + albedo[c] / top * (height - 2 * margin)
            inked = np.nonzero(picture[:, column, c] > 0.6)[0]
            assert np.abs(inked - row).min() < 2, (degrees, c)


def over_the_hemisphere(wo, count=120):
    """Directions and their solid angles: rings about the mirror direction, denser towards it."""
    x, part = np.polynomial.legendre.leggauss(count)
    first, whole = 1e-3, math.log(math.pi / 1e-3 + 1)
    grown = np.exp((x + 1) / 2 * whole)
    off, step = first * (grown - 1), first * grown * whole * part / 2
    turn = (np.arange(count) + 0.5) / count * 2 * math.pi
    mirror = wo * [-1, -1, 1]
    along = np.array([mirror[2], 0, -mirror[0]])
    around = np.cos(turn)[:, None] * along + np.sin(turn)[:, None] * [0, 1, 0]
    wi = np.cos(off)[:, None, None] * mirror + np.sin(off)[:, None, None] * around
    share = np.repeat(np.sin(off) * step * 2 * math.pi / count, count)
    wi, up = wi.reshape(-1, 3), wi.reshape(-1, 3)[:, 2] > 1e-6
    return unit(wi[up]), share[up]


def light_of(extension, plots, form_light, material):
    (node,) = extension.model_nodes.group_nodes(material)
    model = plots.brdfc.model(extension.model_nodes.identity(node).model)
    values = plots.reflected.values_in_range(model, extension.api.get_parameters(material))
    form = (
        functools.partial(form_light.lobes, node) if extension.model_nodes.is_fitted(node) else None
    )
    return plots.light(model, values, form)


@pytest.mark.many
@pytest.mark.parametrize(
    ("model", "form", "values", "over"),
    [
        ("cook_torrance", "fitted", {"m": 0.37, "f0": (0.9, 0.3, 0.05)}, ["--over", "m"]),
        ("phong", "fitted", {"e": 90.0}, ["--over", "e"]),
        ("phong", "twin", {"e": 90.0}, ["--over", "e"]),
        ("ward", "twin", {"ks": (0.2, 0.9, 0.5)}, []),
        ("lossless", "twin", {}, []),
    ],
)
def test_the_albedo_of_a_form_is_that_of_the_tools_closures(
    extension, plots, form_light, tool, empty, model, form, values, over
):
    """Compared with the sum over the hemisphere. The curve is within half a percent of the light,
    and at 73 degrees within 1.5."""
    material = extension.api.new_material(model, form, **values)
    values = {name: extension.api.get_parameters(material)[name] for name in values}
    albedo = light_of(extension, plots, form_light, material).albedos[1]
    for view in (0, 4, 8, 10):
        wo = plots.reflected.directions()[view]
        wi, share = over_the_hemisphere(wo)
        every = np.broadcast_to(wo, wi.shape)
        expected = share @ of_tool(tool, form, model, values, over, wi, every)
        off = 0.015 if view == 10 else 0.005
        np.testing.assert_allclose(albedo[view], expected, atol=off, err_msg=f"{view}")
        assert expected.max() > 0.03


def test_albedos_of_what_equals_the_model_are_its_own(extension, plots, form_light, empty):
    rho = (0.8, 0.4, 0.1)
    lambert = extension.api.new_material("lambert", "twin", rho=rho)
    for albedo in light_of(extension, plots, form_light, lambert).albedos:
        np.testing.assert_allclose(albedo, np.tile(rho, (13, 1)), atol=2e-5)
    # The mirror is included: each term reflects the fraction that its slider says.
    twin = extension.api.new_material("lambertian_specular", "twin", rd=rho, rs=0.15)
    albedo = light_of(extension, plots, form_light, twin).albedos[1]
    np.testing.assert_allclose(albedo, np.tile(np.array(rho) + 0.15, (13, 1)), atol=2e-3)


@pytest.mark.parametrize(
    ("model", "values"),
    [
        ("cook_torrance", {"m": 0.5}),
        ("phong_material", {}),
        ("ward", {"ks": (0.2, 0.9, 0.5)}),
        ("lambert", {"rho": 0.5}),
    ],
)
def test_the_albedo_of_the_principled_node_adds_its_light_up(
    extension, plots, form_light, empty, model, values
):
    """test_convert.py compares the added terms with Cycles' renders."""
    found = light_of(extension, plots, form_light, extension.api.new_material(model, **values))
    native = found.near.native
    for view in (0, 4, 8, 10):
        wo = plots.reflected.directions()[view]
        wi, share = over_the_hemisphere(wo)
        every = wo[None], np.zeros(len(wi), int)
        f_cos = plots.native_bsdf.f_cos(native, wi, np.broadcast_to(wo, wi.shape), every)
        np.testing.assert_allclose(found.albedos[2][view], share @ f_cos, rtol=0.01)


@pytest.mark.parametrize(("model", "form"), [("phong", "fitted"), ("lossless", "twin")])
def test_the_ball_of_a_form_is_lit_as_each_of_its_pixels(
    extension, plots, form_light, empty, model, form
):
    """It is computed for one view of each ring, in another frame."""
    material = extension.api.new_material(model, form)
    ball = light_of(extension, plots, form_light, material).balls[1]
    _, wi, wo, _ = plots._ball()
    some = np.flatnonzero(wi[:, 2] > 0)[::97]
    lights, viewers = wi[some][:, None], wo[some]
    each = of_form(form_light, plots, extension, material, lights, viewers)
    np.testing.assert_allclose(ball[some], np.pi * np.concatenate(each), rtol=1e-5, atol=1e-6)
    assert not ball[wi[:, 2] < 0].any()


def test_curves_are_lines_dots_and_dashes(extension, panel, plots, empty):
    """For the albedo, where the curves differ; and below each ball the line style of its curve."""
    material = extension.api.new_material("lossless", "twin")
    picture = legend_of(panel, extension, material)[2]
    (node,) = extension.model_nodes.group_nodes(material)
    keys = picture[plots.BALLS][plots.KEY // 2]
    third = plots.SIZE // 3
    lit = [keys[i * third : (i + 1) * third].max(axis=-1) > 0.5 for i in range(3)]
    runs = [int(np.count_nonzero(np.diff(x.astype(int)) == 1)) for x in lit]
    assert runs[0] == 1 and runs[1] > runs[2] > 3
    # The model reflects everything, the node 69 %.
    curves, height = picture[plots.CURVES], 104 - 16
    dashes = curves[round(8 + 0.69 / 1.15 * height) + np.arange(-2, 3)].max(axis=0)[8:250, 0]
    assert 0.4 < (dashes > 0.7).mean() < 0.8
    line = curves[round(8 + 1.0 / 1.15 * height), 8:250]
    assert (line[:, 0] > 0.7).all()


def test_a_lobe_points_where_the_light_goes_and_a_matte_one_up(extension, panel, empty):
    angle, length = peak_angle(shown(panel, extension, "phong", e=3000, ks=0.5)[0])
    assert angle == pytest.approx(45, abs=1.5) and length == pytest.approx(0.95, abs=0.03)
    angle, _ = peak_angle(shown(panel, extension, "lambert", rho=1.0)[0])
    assert angle == pytest.approx(0, abs=10)
    # Ideal reflection is an arrow, whose brightness is its fraction of the light.
    angle, length = peak_angle(shown(panel, extension, "lambertian_specular", rs=0.7, rd=0.0)[0])
    assert angle == pytest.approx(45, abs=1.5) and length == pytest.approx(0.7, abs=0.03)


def test_the_nearest_glossy_node_is_as_rough_as_its_own_lobe(plots, extension, panel, empty):
    """Cook and Torrance's microfacets are Beckmann's, similar to GGX: m is about the roughness
    squared."""
    theta = plots.reflected.angles()
    for roughness in (0.1, 0.35, 0.8):
        found, curve = plots.nearest_glossy(3 * plots.glossy_slice(roughness**2, theta))
        assert found == pytest.approx(roughness, abs=1e-9)
        np.testing.assert_allclose(curve, 3 * plots.glossy_slice(roughness**2, theta))
    smooth = shown(panel, extension, "cook_torrance", m=0.1)[1].glossy
    rough = shown(panel, extension, "cook_torrance", m=0.4)[1].glossy
    assert smooth**2 == pytest.approx(0.1, abs=0.03) and smooth < rough
    assert shown(panel, extension, "fresnel_conductor")[1].glossy is None


@pytest.fixture(scope="module")
def principled(extension):
    return import_module(f"{extension.package}.nearest.principled")


@pytest.fixture(scope="module")
def node_curve(principled, plots):
    """f cos of a Principled node over the angles of a plot; test_convert.py compares that formula
    with Cycles' renders."""

    def curve(color, roughness, metallic, ior):
        f0 = ((ior - 1) / (ior + 1)) ** 2
        native = principled.Native("principled", color, roughness, metallic=metallic, f0=f0)
        light = plots.reflected.in_plane(np.radians(-plots.reflected.INCIDENCE))
        return principled.node_slice(
            native, plots.reflected.in_plane(plots.reflected.angles()), light
        )

    return curve


def misplaced(plots, curve, expected):
    """The fraction of a curve's area that is misplaced, by the trapezoid rule."""
    area = np.trapezoid if hasattr(np, "trapezoid") else np.trapz
    off = area(np.abs(curve - expected), plots.reflected.angles(), axis=0).sum()
    return off / area(expected, plots.reflected.angles(), axis=0).sum()


@pytest.mark.parametrize(
    "node",
    [
        ((1.0, 0.6, 0.2), 0.3, 1.0, 1.5),  # metals
        ((0.9, 0.5, 0.1), 0.72, 1.0, 1.5),
        ((0.8, 0.7, 0.6), 0.08, 1.0, 1.5),
        ((0.9, 0.1, 0.3), 0.2, 0.0, 1.5),  # plastics
        ((0.2, 0.3, 0.8), 0.55, 0.0, 1.8),
        ((0.9, 0.5, 0.1), 0.45, 0.5, 1.5),
    ],
)
def test_the_nearest_principled_node_is_the_one_that_is_drawn(plots, principled, node_curve, node):
    color, roughness, metallic, ior = node
    curve = node_curve(*node)
    found = principled.nearest_principled(
        curve, plots.reflected.angles(), plots.reflected.INCIDENCE
    )
    assert found.error < 0.01 and misplaced(plots, found.curve, curve) < 0.01
    assert (found.ior, found.metallic) == (ior, pytest.approx(metallic, abs=0.051))
    assert found.roughness == pytest.approx(roughness, rel=0.01)
    np.testing.assert_allclose(found.color, color, atol=0.02)


def test_a_matte_surface_is_a_principled_node(extension, panel, plots, empty):
    rho = (0.8, 0.4, 0.1)
    near = shown(panel, extension, "lambert", rho=rho)[1].principled
    assert near.error < 1e-6 and (near.metallic, near.ior) == (0, 1)
    np.testing.assert_allclose(near.color, rho, atol=1e-6)


@pytest.mark.parametrize(
    ("model", "values"),
    [
        ("ward", {"ks": 0.6, "ax": 0.2, "ay": 0.2}),
        ("cook_torrance", {}),
        ("ashikhmin_shirley", {}),
        ("oren_nayar", {}),
        ("phong_material", {}),
    ],
)
def test_no_principled_node_beside_it_is_nearer(plots, principled, node_curve, model, values):
    """And its error is as stated, by the squared errors weighted by the angles. A neighbouring node
    may be better within the resolution of the search."""
    curve = plots.reflected.slice_of(plots.brdfc.model(model), values, plots.reflected.angles())
    near = principled.nearest_principled(curve, plots.reflected.angles(), plots.reflected.INCIDENCE)
    assert near.error == pytest.approx(misplaced(plots, near.curve, curve), rel=0.01)
    area = np.gradient(plots.reflected.angles())

    def squares(**change):
        node = {k: getattr(near, k) for k in ("color", "roughness", "metallic", "ior")} | change
        node["color"] = tuple(np.clip(node["color"], 0, 1))
        return area @ ((node_curve(**node) - curve) ** 2).sum(axis=1)

    least = squares()
    assert least == pytest.approx(area @ ((near.curve - curve) ** 2).sum(axis=1), rel=1e-9)
    beside = [{"roughness": min(near.roughness * f, 1)} for f in (0.7, 0.95, 1.05, 1.4)]
    beside += [{"metallic": float(np.clip(near.metallic + d, 0, 1))} for d in (-0.3, 0.3)]
    beside += [{"color": np.array(near.color) + d} for d in (-0.1, -0.03, 0.03, 0.1)]
    beside += [{"ior": near.ior + d} for d in (-0.2, 0.5) if near.ior + d >= 1]
    for change in beside:
        assert least < 1.02 * squares(**change), change


def test_the_curve_of_the_principled_node_is_dashed(extension, panel, plots, empty):
    """Where it exceeds the model's, it is dark on paper, with gaps."""
    picture, near = shown(panel, extension, "cook_torrance", m=0.3)
    red = above(picture)[..., 0]
    model = plots.brdfc.model("cook_torrance")
    values = plots.reflected.values_in_range(model, {"m": 0.3})
    curve = plots.reflected.slice_of(model, values, plots.reflected.angles())
    radius, angle, _ = plots._polar_grid()

    def over_peak(c):
        return np.interp(angle, plots.reflected.angles(), 0.95 * c[:, 0] / curve.max())

    node, own = over_peak(near.principled.curve), over_peak(curve)
    on = (np.abs(radius - node) < 0.003) & (radius > own + 0.03)
    inked = red[on] > 0.7
    assert on.sum() > 20 and 0.3 < inked.mean() < 0.9
    assert near.principled.error > 0.1


@pytest.fixture(scope="module")
def form_light(extension):
    return import_module(f"{extension.package}.plotting.form_light")


def of_form(form_light, plots, extension, material, wi, wo):
    """f cos of a material's form at its values, for several views wo and light directions wi of
    each."""
    (node,) = extension.model_nodes.group_nodes(material)
    model = plots.brdfc.model(extension.model_nodes.identity(node).model)
    values = plots.reflected.values_in_range(model, extension.api.get_parameters(material))
    lobes = form_light.lobes(node, plots._complete(model, values), np.array(wo))
    return [lobes.scattered(w[None], slice(i, i + 1))[0] for i, w in enumerate(wi)]


def of_tool(tool, form, model, values, over, wi, wo):
    """The tool's result for that: the closures of its own fit."""
    options = [*(["--twin"] if form == "twin" else []), *over, "--pairs"]
    text = tool("fit", model, *arguments(values), *options, stdin=pairs_csv(wi, wo))
    return read_csv(text)[1]


#: Views of forms: steep and grazing, in the plane of the plots and outside it.
VIEWS = [unit(v) for v in ((-1, 0, 1), (0.1, 0.2, 1), (0.5, -0.8, 0.6), (-0.3, 0.9, 0.1))]


def lights(wo):
    """Directions over the whole hemisphere, including its rim, and near the mirror direction."""
    rng = np.random.default_rng(1)
    z, phi = rng.uniform(0.02, 1, 60), rng.uniform(0, 2 * np.pi, 60)
    around = np.stack([np.cos(phi), np.sin(phi), np.zeros(60)], axis=-1)
    spread = np.geomspace(0.003, 0.3, 60)[:, None] * rng.normal(size=(60, 3))
    near = unit(wo * (-1, -1, 1) + spread)
    wide = np.sqrt(1 - z * z)[:, None] * around + z[:, None] * [0, 0, 1]
    return np.concatenate([wide, near[near[:, 2] > 0.01]])


@pytest.fixture
def off_the_tool(form_light, plots, extension, tool):
    """off_the_tool(form, model, values, *options): the largest difference over VIEWS between a
    form's curve and the tool's result, relative to the largest value."""

    def measured(form, model, values, *options):
        material = extension.api.new_material(model, form, **values)
        values = {name: extension.api.get_parameters(material)[name] for name in values}
        wi = [lights(wo) for wo in VIEWS]
        curves = of_form(form_light, plots, extension, material, wi, VIEWS)
        wo = [np.broadcast_to(o, i.shape) for i, o in zip(wi, VIEWS, strict=True)]
        wi, wo = np.concatenate(wi), np.concatenate(wo)
        expected = of_tool(tool, form, model, values, options, wi, wo)
        assert expected.max() > 0.01, model
        return np.abs(np.concatenate(curves) - expected).max() / expected.max()

    return measured


@pytest.mark.long
def test_the_curve_of_a_fitted_form_is_that_of_the_tool(off_the_tool, extension, empty):
    """Its closures in double precision, from tables and numbers with six digits: for every fitted
    form of the extension, at two values of all that is a socket."""
    for model, name, values in along_sliders(extension):
        assert off_the_tool("fitted", model, values, "--over", name) < 2e-6, (model, values)


#: Values of numbers and colours of a twin: one for each kind of socket, and one with a mirror.
TWINS = {
    "phong": {"e": 73.0, "ks": (0.9, 0.6, 0.2)},
    "cook_torrance": {"m": 0.37, "f0": (0.9, 0.3, 0.05)},
    "schlick": {"rough": 0.21, "r": (0.7, 0.4, 0.1)},
    "coupled": {"r0": 0.15, "rm": (0.8, 0.3, 0.5)},
    "phong_material": {},
    "ward": {"ks": (0.2, 0.9, 0.5)},
    "lossless": {"tint": (1.0, 0.7, 0.4)},
    "factors": {
        **{"rho": (0.2, 0.1, 0.05), "rim": 0.4, "strength": 2.0, "ax": 0.05, "ay": 0.05},
        **{"widening": 1.6, "heights": 0.3, "d3": (0.4, 0.6, 0.7), "d12": (0.1, 0.0, 0.9)},
    },
}


@pytest.mark.long
def test_the_curve_of_a_twin_is_that_of_the_tool(off_the_tool, extension, empty):
    """Blender's nodes are in single precision."""
    for model, values in TWINS.items():
        axis = extension.pack.model(model).forms["twin"].entry["axis"]
        mixed = json.loads(extension.pack.model(model).forms["twin"].source()[1]).get("mixed")
        over = [*(["--over", axis["name"]] if axis else []), *(["--any", *mixed] if mixed else [])]
        off = off_the_tool("twin", model, values, *over)
        print(f"{model}: {off:.2g}")
        assert off < 2e-5, model


def test_a_file_that_is_opened_has_the_same_curves(form_light, plots, extension, empty, tmp_path):
    wo = VIEWS[0]
    wi = lights(wo)

    def curves(materials):
        return [of_form(form_light, plots, extension, m, [wi], [wo])[0] for m in materials]

    made = [extension.api.new_material("phong", form, e=73.0) for form in ("fitted", "twin")]
    before, names = curves(made), [m.name for m in made]
    for material in made:
        material.use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    for old, new in zip(before, curves(bpy.data.materials[n] for n in names), strict=True):
        assert old.max() > 0.1
        np.testing.assert_array_equal(new, old)


def legend_of(panel, extension, material):
    layout = helpers.Layout()
    panel.draw_plots(layout, material)
    (node,) = extension.model_nodes.group_nodes(material)
    preview, legend = panel.picture(node)
    return layout.log, legend, pixels_of(preview)


def inked(picture):
    """Pixels of dots, which are pink."""
    red, green, blue = np.moveaxis(above(picture), -1, 0)
    return (red > 0.9) & (green < 0.5) & (np.abs(blue - 0.75) < 0.1)


@pytest.mark.evidence
def test_a_form_made_for_other_values_has_its_own_curve(
    panel, plots, extension, tool, use_pack, empty
):
    """It is drawn from the shader in the file, made by a pack that no longer exists; the stated
    error of its curve is that of the tool relative to the model."""
    values = {"ks": (0.9, 0.7, 0.3), "ax": 0.25, "ay": 0.25}
    use_pack({"ward": {"model": "ward", "parameters": values, "representation": "fitted"}})
    material = extension.api.new_material("ward", "fitted", **values)
    extension.pack.use()
    log, legend, picture = legend_of(panel, extension, material)
    wi, wo = (
        plots.reflected.in_plane(plots.reflected.angles())[1:-1],
        plots.reflected.in_plane(np.radians(-plots.reflected.INCIDENCE)),
    )
    wo = np.broadcast_to(wo, wi.shape)
    closures = of_tool(tool, "fitted", "ward", values, (), wi, wo)
    f = helpers.evaluate(tool, "ward", values, wi, wo)
    area = np.trapezoid if hasattr(np, "trapezoid") else np.trapz
    off = area(np.abs(closures - f * wi[:, 2:]), plots.reflected.angles()[1:-1], axis=0).sum()
    off /= area(f * wi[:, 2:], plots.reflected.angles()[1:-1], axis=0).sum()
    assert legend.form == pytest.approx(off, rel=0.01) and 0.001 < off < 0.05
    said = f"Dotted: render method Fitted, error {100 * off:.2g} %"
    assert said in " ".join(log)


def test_the_curve_of_a_form_is_dotted(panel, plots, form_light, extension, empty):
    """A twin lacks the round flanks of this kernel, so it has dots with gaps there, and nowhere
    else."""
    material = extension.api.new_material("lossless", "twin")
    on = inked(legend_of(panel, extension, material)[2])
    wi, wo = (
        plots.reflected.in_plane(plots.reflected.angles()),
        plots.reflected.in_plane(np.radians(-plots.reflected.INCIDENCE)),
    )
    (curve,) = of_form(form_light, plots, extension, material, [wi], [wo])
    curve = curve.max(axis=1)
    own = plots.reflected.slice_of(plots.brdfc.model("lossless"), {}, plots.reflected.angles()).max(
        axis=1
    )
    radius, angle, unit = plots._polar_grid()

    def over_peak(c):
        return np.interp(angle, plots.reflected.angles(), 0.95 * c / own.max())

    away = np.abs(over_peak(curve) - over_peak(own)) > 0.1
    near = np.abs(radius - over_peak(curve)) * unit < 1
    assert (near & away).sum() > 50 and 0.2 < on[near & away].mean() < 0.8
    assert not (on & away & (np.abs(radius - over_peak(own)) < 0.02)).any()
    # Where the curve is steep, a line of two pixels covers more of a radius.
    steep = np.interp(
        angle, plots.reflected.angles(), np.abs(np.gradient(curve, plots.reflected.angles()))
    )
    tilt = np.hypot(1, 0.95 / own.max() * steep / np.maximum(radius, 0.02))
    assert (np.abs(radius - over_peak(curve)) * unit / tilt)[on].max() < 3


def test_forms_that_equal_the_model_have_no_curve(panel, extension, empty):
    for model, form in (("ward", "aimed"), ("ward", "sampled"), ("lambert", "exact")):
        material = extension.api.new_material(model, form)
        log, legend, picture = legend_of(panel, extension, material)
        assert legend.form is None and not inked(picture).any()
        assert f"Render method {form.capitalize()}: reflects what the model does" in " ".join(log)
    twin = extension.api.new_material("ward", "twin")
    assert inked(legend_of(panel, extension, twin)[2]).any()


def test_a_form_that_can_not_be_read_is_said(panel, extension, empty):
    """A file may contain anything."""
    material = extension.api.new_material("phong", "fitted")
    (node,) = extension.model_nodes.group_nodes(material)
    script = next(n for n in node.node_tree.nodes if n.bl_idname == "ShaderNodeScript")
    said = "Render method Fitted: what it reflects can't be plotted"
    good = script.script.as_string()
    for text in ("", "shader x(\n)\n{\n  BSDF = diffuse(N);\n}\n", good.replace("exp(", "eval(")):
        extension.api.set_parameters(material, e=10.0 + len(text) % 97)  # drawn again
        script.script.from_string(text)
        log, legend, _ = legend_of(panel, extension, material)
        assert said in " ".join(log) and legend.form is None and legend.principled is not None
    twin = extension.api.new_material("phong", "twin")
    (group,) = extension.model_nodes.group_nodes(twin)
    (end,) = (n for n in group.node_tree.nodes if n.bl_idname == "NodeGroupOutput")
    glass = group.node_tree.nodes.new("ShaderNodeBsdfGlass")
    group.node_tree.links.new(glass.outputs[0], end.inputs["BSDF"])
    assert said.replace("Fitted", "Blender Nodes") in " ".join(legend_of(panel, extension, twin)[0])


@pytest.mark.parametrize(
    "text",
    [
        "x = __import__(1)",
        "x = (1 + 2",
        "x = 1 2",
        "x = y",
        "x.y = 1",
        "x = sin",
        "x[0] = 1",
        "for (;;) x = 1",
        "x = " + "(" * 5000,
        "x = 1 / 0",
        "x = 'a'",
        "x = brdfc_table1(1, 2, 0.5)",
        "float x[2] = {1, 2}; x = brdfc_table1(x, 5, 3.5)",
    ],
)
def test_what_is_no_fitted_shader_is_unreadable(extension, text):
    shader_text = import_module(f"{extension.package}.plotting.shader_text")
    source = f"\nshader s(\n)\n{{\n{text}; BSDF = x;\n}}"
    wi = np.array([[0.0, 0.0, 1.0]])
    with pytest.raises(shader_text.Unreadable):
        shader_text.lobes(source, {}, wi).scattered(wi[None])


@pytest.mark.parametrize(
    ("model", "values"),
    [
        ("fresnel_conductor", {}),
        ("coupled", {"r0": 0.2}),
        ("lambertian_specular", {"rs": 0.3}),
        ("fresnel_dielectric", {"ior": 1.8}),
        ("glass", {"ior": 2.4, "dispersion": 1.0}),
        ("schlick", {}),
    ],
)
def test_arrows_are_as_bright_as_the_tools_mirror(
    panel, plots, extension, tool, empty, model, values
):
    """And the transmitted light is the rest of the albedo, for models that scatter nothing."""
    material = extension.api.new_material(model, **values)
    log, legend, picture = legend_of(panel, extension, material)
    values = {k: extension.api.get_parameters(material)[k] for k in values}
    cosine = math.cos(math.radians(plots.reflected.INCIDENCE))
    albedo, mirror = (x[0] for x in helpers.albedo_and_mirror(tool, model, values, [cosine]))
    np.testing.assert_allclose(legend.mirror, mirror, rtol=1e-6)
    assert any(
        line.startswith(f"Arrow above: an ideal mirror, {100 * mirror[0]:.3g}") for line in log
    )
    through = model in ("glass", "fresnel_dielectric")
    assert (legend.refracted is not None) == through
    directions = {plots.reflected.INCIDENCE: mirror}
    if through:
        np.testing.assert_allclose(legend.refracted, albedo - mirror, rtol=1e-6)
        bent = math.degrees(
            math.asin(math.sin(math.radians(plots.reflected.INCIDENCE)) / values["ior"])
        )
        directions[180 - bent] = albedo - mirror
    radius, angle, unit = plots._polar_grid(through)
    for degrees, share in directions.items():
        off = angle - math.radians(degrees)
        along, across = radius * np.cos(off) * unit, radius * np.sin(off) * unit
        for c in range(3):
            way = (np.abs(across) < 0.6) & (along > 3)
            bright = way & (along < share[c] * unit - 1)
            assert (above(picture)[bright][:, c] > 0.99).all(), (degrees, c)
            if model in ("glass", "fresnel_dielectric", "fresnel_conductor"):
                dim = way & (along > share[c] * unit + 1) & (along < unit - 12)
                assert (above(picture)[dim][:, c] < 0.6).all(), (degrees, c)


def test_all_is_reflected_beyond_the_critical_angle(panel, extension, empty):
    legend = shown(panel, extension, "fresnel_dielectric", ior=0.6)[1]
    assert legend.mirror == pytest.approx((1, 1, 1)) and legend.refracted is None


@pytest.mark.parametrize("ior", [1.3, 1.8, 2.4])
def test_the_principled_node_of_a_dielectric_is_it(extension, panel, tool, empty, ior):
    """With Transmission and the same IOR: Fresnel reflection and refraction, without an error."""
    material = extension.api.new_material("fresnel_dielectric", ior=ior)
    log, legend, _ = legend_of(panel, extension, material)
    near = legend.principled
    assert near.transmission and near.error < 2e-3
    assert near.ior == pytest.approx(ior, abs=0.01)
    cosine = math.cos(math.radians(45))
    albedo, mirror = (
        x[0] for x in helpers.albedo_and_mirror(tool, "fresnel_dielectric", {"ior": ior}, [cosine])
    )
    np.testing.assert_allclose(near.mirror, mirror, atol=1e-3)
    np.testing.assert_allclose(near.refracted, albedo - mirror, atol=1e-3)
    assert any(line.startswith("Its transmission 1, mirror") for line in log)


@pytest.mark.parametrize(
    ("model", "values", "most"),
    [
        ("fresnel_conductor", {}, 0.01),
        ("coupled", {"r0": 0.15, "rm": (0.8, 0.3, 0.5)}, 0.1),
        ("lambertian_specular", {"rs": 0.3, "rd": (0.6, 0.3, 0.1)}, 0.02),
    ],
)
def test_no_smooth_node_beside_it_is_nearer(
    extension, plots, form_light, panel, empty, model, values, most
):
    """By the squared errors of both fractions of the light, over the hemisphere."""
    material = extension.api.new_material(model, **values)
    found = light_of(extension, plots, form_light, material)
    near, native = found.near, plots.native_bsdf
    assert near.roughness == 0 and near.error < most and not near.transmission
    wo = plots.reflected.directions()
    own = plots.brdfc.model(model)
    mirror = own.mirror(wo, **values)
    scattered = found.albedos[0] - mirror
    weight = wo[:, 2] * np.sqrt(1 - wo[:, 2] ** 2)

    def squares(color, metallic, ior):
        node = native.Native(
            "principled",
            tuple(np.clip(color, 0, 1)),
            0.0,
            metallic=float(np.clip(metallic, 0, 1)),
            f0=((ior - 1) / (ior + 1)) ** 2,
        )
        of_node = native.mirror(node, wo)
        rest = native.albedo(node, wo, native.view_terms(node, wo)) - of_node
        return weight @ ((of_node - mirror) ** 2 + (rest - scattered) ** 2).sum(axis=1)

    color, metallic, ior = np.array(near.color), near.metallic, near.ior
    least = squares(color, metallic, ior)
    beside = [(color + d, metallic, ior) for d in (-0.05, -0.01, 0.01, 0.05)]
    beside += [(color, metallic + d, ior) for d in (-0.2, -0.02, 0.02, 0.2)]
    beside += [(color, metallic, ior + d) for d in (-0.3, -0.03, 0.03, 0.3) if ior + d >= 1]
    for node in beside:
        assert least <= 1.001 * squares(*node) + 1e-12, node
    # The error at 45 degrees, as a fraction of the light.
    light = plots.reflected.in_plane(np.radians(-plots.reflected.INCIDENCE))
    node = near.native
    shares = native.mirror(node, light[None])[0], own.mirror(light, **values)
    off = np.abs(shares[0] - shares[1]).sum()
    if model != "fresnel_conductor":
        off += found.here.scattered.sum() * misplaced(plots, near.curve, found.slices[0])
    total = (found.here.scattered + shares[1]).sum()
    assert near.error == pytest.approx(off / total, rel=0.02)
    np.testing.assert_allclose(near.mirror, shares[0])


def test_the_arrow_of_the_principled_node_is_dashed(extension, panel, plots, empty):
    """Beside the model's own arrow; its brightness is its fraction of the light."""
    material = extension.api.new_material("lambertian_specular", rs=0.7, rd=0.0)
    log, legend, picture = legend_of(panel, extension, material)
    share = legend.principled.mirror[0]
    assert share == pytest.approx(0.7, abs=0.02)
    assert f"Its mirror {100 * share:.3g} %: the dashed arrow" in log
    radius, angle, unit_ = plots._polar_grid()
    off = angle - math.radians(plots.reflected.INCIDENCE)
    along, across = radius * np.cos(off) * unit_, radius * np.sin(off) * unit_
    beside = np.abs(across - 5) < 0.6
    bright = above(picture)[..., 0] > 0.9
    assert 0.3 < bright[beside & (along > 6) & (along < share * unit_ - 2)].mean() < 0.9
    assert not bright[beside & (along > share * unit_ + 2)].any()


def test_a_lobe_that_outweighs_its_mirror_has_a_rough_node(extension, panel, empty):
    """And the panel says that the node lacks the mirror."""
    material = extension.api.new_material("schlick", rough=0.45, r=0.8)
    log, legend, _ = legend_of(panel, extension, material)
    near = legend.principled
    assert legend.mirror[0] > 0 and near.roughness > 0 and not any(near.mirror)
    assert "It is rough, without ideal mirror" in log
    assert near.error > 0.9 * legend.mirror[0]


def test_glossy_is_ggx_with_the_light_that_facets_reflect(plots):
    """At normal incidence, narrow GGX lobes lose nothing: the slice, rotated about the normal,
    integrates to 1."""
    light = plots.reflected.INCIDENCE
    try:
        plots.reflected.INCIDENCE = 0.0
        theta = np.linspace(0, np.pi / 2, 20001)
        f_cos = plots.glossy_slice(0.05, theta)
    finally:
        plots.reflected.INCIDENCE = light
    assert np.sum(f_cos * np.sin(theta)) * theta[1] * 2 * np.pi == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("roughness", [0.2, 0.5, 0.9])
def test_glossy_masks_at_grazing_angles_as_cycles_does(plots, roughness):
    """E. Heitz: Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs, JCGT 2014,
    eq. 99 with GGX's Lambda: masking and shadowing are correlated by height."""
    alpha, theta = roughness**2, np.radians([-85.0, -40.0, 0.0, 45.0, 80.0, 89.0])
    a2, light, out = alpha**2, np.cos(np.radians(plots.reflected.INCIDENCE)), np.cos(theta)
    cosine = np.cos((theta - np.radians(plots.reflected.INCIDENCE)) / 2)
    ggx = a2 / (np.pi * (cosine**2 * (a2 - 1) + 1) ** 2)
    both = out * np.sqrt(a2 + (1 - a2) * light**2) + light * np.sqrt(a2 + (1 - a2) * out**2)
    expected = ggx * (2 * light * out / both) / (4 * light)
    np.testing.assert_allclose(plots.glossy_slice(alpha, theta), expected, rtol=1e-9)


@pytest.mark.slow
def test_a_moved_slider_draws_anew_and_nothing_else_does(
    extension, panel, plots, empty, monkeypatch
):
    calls = []
    draw = plots.draw
    monkeypatch.setattr(plots, "draw", lambda *a: calls.append(a) or draw(*a))
    material = extension.api.new_material("ward")
    (node,) = extension.model_nodes.group_nodes(material)
    before = len(bpy.data.images), len(bpy.data.textures)
    pictures = []
    for ax in (0.11, 0.21, 0.31):
        extension.api.set_parameters(material, ax=ax)
        for _ in range(3):
            pictures.append(pixels_of(panel.picture(node)[0]))
    assert len(calls) == 3
    assert (
        np.array_equal(pictures[0], pictures[2]) and np.abs(pictures[2] - pictures[3]).max() > 0.1
    )
    for i in range(40):  # more than are cached
        extension.api.set_parameters(material, ax=0.1 + i / 100)
        last = pixels_of(panel.picture(node)[0])
    fresh, _ = draw("ward", {**extension.api.get_parameters(material)})
    np.testing.assert_allclose(last, fresh[..., :3], atol=1 / 255)
    assert len(panel._places) <= panel._KEPT
    # Nothing of it is saved with the file.
    assert (len(bpy.data.images), len(bpy.data.textures)) == before


def test_the_panel_names_what_it_cannot_know(extension, panel, plots, empty, monkeypatch):
    material = extension.api.new_material("cook_torrance")
    (node,) = extension.model_nodes.group_nodes(material)
    layout = helpers.Layout()
    panel.draw_plots(layout, material)
    assert "picture 14.4" in layout.log
    assert any("Glossy, roughness" in line for line in layout.log)
    assert any("Principled, error 1" in line for line in layout.log)
    assert any("Its roughness 0.58, metallic 1.00, IOR 1.50" in line for line in layout.log)
    assert not any("default" in line for line in layout.log)
    value = node.id_data.nodes.new("ShaderNodeValue")
    node.id_data.links.new(value.outputs[0], extension.model_nodes.sockets(node)["m"])
    layout = helpers.Layout()
    panel.draw_plots(layout, material)
    label = extension.pack.model("cook_torrance").parameters["m"]["label"]
    assert f"At the default of {label}" in layout.log
    # A model that a pack cut to a scene lacks causes a message, and no exception.
    monkeypatch.setattr(plots.brdfc, "NAMES", ())
    monkeypatch.setattr(panel, "_places", {})
    layout = helpers.Layout()
    panel.draw_plots(layout, material)
    assert any("does not have this model" in line for line in layout.log)


def test_a_value_at_the_edge_of_its_range_is_drawn(extension, panel, empty):
    """Sockets are floats: 1e-4 in single precision is below the accepted 1e-4."""
    for ax in (1e-4, 1.0):
        picture, _ = shown(panel, extension, "ward", ax=ax, ay=ax)
        assert picture.max() > 0.5


def test_every_model_is_drawn(extension, plots, empty):
    """script/plots.py measures how long that takes."""
    for model in extension.pack.model_names():
        picture, _ = plots.draw(model, {})
        assert picture.shape == (plots.ABOVE.stop, plots.SIZE, 4), model
        assert 0 <= picture.min() and picture.max() <= 1, model
