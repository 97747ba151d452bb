# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots in the panel: their pixels are what the model says, and they cost little."""

import math
import statistics
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import bpy
import helpers
import numpy as np
import pytest

SCRIPTS = Path(__file__).parents[2] / "script"


@pytest.fixture(scope="module")
def panel(extension):
    return import_module(f"{extension.package}.plot_panel")


@pytest.fixture(scope="module")
def plots(extension):
    return import_module(f"{extension.package}.plots")


def pixels_of(preview):
    """(rows from below, columns, RGB) from 0 to 1, as Blender has them."""
    width, height = preview.image_size
    flat = np.empty(width * height, np.int32)
    preview.image_pixels.foreach_get(flat)
    return flat.view(np.uint8).reshape(height, width, 4)[..., :3] / 255


def shown(panel, extension, model, **values):
    material = extension.api.new_material(model, **values)
    (node,) = extension.nodes.group_nodes(material)
    preview, roughness = panel.picture(node)
    return pixels_of(preview), roughness


def peak_angle(picture):
    """Where the lobe above reaches furthest, in degrees from the normal, and how far."""
    size = picture.shape[1]
    upper = picture[size // 2 :].min(axis=-1)
    rows, columns = np.nonzero(upper > 0.9)
    x, y = (columns + 0.5) / (size / 2) - 1, (rows + 0.5) / (size / 2) - 0.03
    far = np.argmax(np.hypot(x, y))
    return math.degrees(math.atan2(x[far], y[far])), float(np.hypot(x[far], y[far]) / 0.94)


def loaded(package):
    start = f"{package}.brdfc.models."
    return sorted(name.removeprefix(start) for name in sys.modules if name.startswith(start))


def test_formulas_are_not_loaded_before_a_plot_is_drawn(
    extension, panel, empty, extension_zip, tmp_path
):
    """Blender starts faster for it."""
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


def test_the_ball_of_a_matte_surface_is_lamberts_cosine(extension, panel, empty):
    rho = np.array([0.8, 0.4, 0.1])
    picture, _ = shown(panel, extension, "lambert", rho=tuple(rho))
    half = picture.shape[0] // 2
    lamp = np.array([-0.45, 0.6, 0.66]) / np.linalg.norm([-0.45, 0.6, 0.66])
    for row, column in ((80, 80), (100, 60), (40, 100), (130, 70)):
        x, y = (2 * (column + 0.5) / half - 1) / 0.92, (2 * (row + 0.5) / half - 1) / 0.92
        n = np.array([x, y, math.sqrt(1 - x * x - y * y)])
        toned = 1 - np.exp(-rho * max(0.0, float(n @ lamp)))
        expected = np.where(toned < 0.0031308, 12.92 * toned, 1.055 * toned ** (1 / 2.4) - 0.055)
        np.testing.assert_allclose(picture[row, column], expected, atol=1 / 255)


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
def test_the_albedo_curve_is_that_of_the_table(extension, panel, empty, model, values):
    """Of the extension's table, which the C++ quadrature made. A pixel is 0.9 % of the light."""
    picture, _ = shown(panel, extension, model, **values)
    half = picture.shape[0] // 2
    margin, top = 10, 1.25
    for degrees in (3, 30, 60, 80):
        column = margin + round(degrees / 90 * (half - 2 * margin))
        cosine = math.cos(math.radians((column - margin) * 90 / (half - 2 * margin)))
        albedo = extension.api.albedo(model, cosine, **values)
        for c in range(3):
            line = picture[:half, half + column, c]
            rows = np.nonzero(line > 0.6)[0]
            share = (rows.mean() - margin) / (half - 2 * margin) * top
            assert share == pytest.approx(albedo[c], abs=0.025), (degrees, c)


def test_a_lobe_points_where_the_light_goes_and_a_matte_one_up(extension, panel, empty):
    angle, length = peak_angle(shown(panel, extension, "phong", e=3000, ks=0.5)[0])
    assert angle == pytest.approx(45, abs=1.5) and length == pytest.approx(0.95, abs=0.03)
    angle, _ = peak_angle(shown(panel, extension, "lambert", rho=1.0)[0])
    assert angle == pytest.approx(0, abs=10)
    # Ideal reflection: a ray as long as Schlick's share of it.
    angle, length = peak_angle(shown(panel, extension, "lambertian_specular", rs=0.7, rd=0.0)[0])
    assert angle == pytest.approx(45, abs=1.5) and length == pytest.approx(0.95 * 0.7, abs=0.03)


def test_the_nearest_glossy_node_is_as_rough_as_its_own_lobe(plots, extension, panel, empty):
    """Cook and Torrance's facets are Beckmann's, nearly GGX's: m is about the roughness squared."""
    theta = plots._angles()
    for roughness in (0.1, 0.35, 0.8):
        found, curve = plots.nearest_glossy(3 * plots.glossy_slice(roughness**2, theta))
        assert found == pytest.approx(roughness, abs=1e-9)
        np.testing.assert_allclose(curve, 3 * plots.glossy_slice(roughness**2, theta))
    smooth = shown(panel, extension, "cook_torrance", m=0.1)[1]
    rough = shown(panel, extension, "cook_torrance", m=0.4)[1]
    assert smooth**2 == pytest.approx(0.1, abs=0.03) and smooth < rough
    assert shown(panel, extension, "fresnel_conductor")[1] is None


def test_glossy_is_ggx_with_the_light_that_facets_reflect(plots):
    """From above facets of GGX lose nothing where they are narrow: the slice, turned about the
    normal, adds up to 1."""
    light = plots.INCIDENCE
    try:
        plots.INCIDENCE = 0.0
        theta = np.linspace(0, np.pi / 2, 20001)
        f_cos = plots.glossy_slice(0.05, theta)
    finally:
        plots.INCIDENCE = light
    assert np.sum(f_cos * np.sin(theta)) * theta[1] * 2 * np.pi == pytest.approx(1, abs=0.01)


def test_a_moved_slider_draws_anew_and_nothing_else_does(
    extension, panel, plots, empty, monkeypatch
):
    calls = []
    draw = plots.draw
    monkeypatch.setattr(plots, "draw", lambda *a: calls.append(a) or draw(*a))
    material = extension.api.new_material("ward")
    (node,) = extension.nodes.group_nodes(material)
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
    for i in range(40):  # more than are kept
        extension.api.set_parameters(material, ax=0.1 + i / 100)
        last = pixels_of(panel.picture(node)[0])
    fresh, _ = draw("ward", {**extension.api.get_parameters(material)})
    np.testing.assert_allclose(last, fresh[..., :3], atol=1 / 255)
    assert len(panel._places) <= panel._KEPT
    # Nothing of it is saved with the file.
    assert (len(bpy.data.images), len(bpy.data.textures)) == before


def test_the_panel_names_what_it_cannot_know(extension, panel, plots, empty, monkeypatch):
    material = extension.api.new_material("cook_torrance")
    (node,) = extension.nodes.group_nodes(material)
    layout = helpers.Layout()
    panel.draw_plots(layout, material)
    assert "picture 12" in layout.log
    assert any("Glossy, roughness" in line for line in layout.log)
    assert not any("default" in line for line in layout.log)
    value = node.id_data.nodes.new("ShaderNodeValue")
    node.id_data.links.new(value.outputs[0], extension.nodes.sockets(node)["m"])
    layout = helpers.Layout()
    panel.draw_plots(layout, material)
    label = extension.pack.parameters("cook_torrance")["m"]["label"]
    assert f"At the default of {label}" in layout.log
    # A model that a pack cut to a scene lacks: said, not raised.
    monkeypatch.setattr(plots.brdfc, "NAMES", ())
    monkeypatch.setattr(panel, "_places", {})
    layout = helpers.Layout()
    panel.draw_plots(layout, material)
    assert any("does not have this model" in line for line in layout.log)


def test_a_value_at_the_edge_of_its_range_is_drawn(extension, panel, empty):
    """Sockets are floats: 1e-4 as one lies below the 1e-4 that is accepted."""
    for ax in (1e-4, 1.0):
        picture, _ = shown(panel, extension, "ward", ax=ax, ay=ax)
        assert picture.max() > 0.5


def test_every_model_is_drawn_in_less_than_50_ms(extension, plots, empty):
    for model in extension.pack.model_names():
        plots.draw(model, {})
        times = []
        for _ in range(5):
            start = time.process_time()
            picture, _ = plots.draw(model, {})
            times.append(time.process_time() - start)
        assert picture.shape == (plots.SIZE, plots.SIZE, 4)
        assert 0 <= picture.min() and picture.max() <= 1
        assert statistics.median(times) < 0.05, (model, times)
