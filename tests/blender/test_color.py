# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the tool's previews through Blender's OpenColorIO configuration with pictures saved by
Blender; and tests metals and glass with measured n and k in the working space of the file."""

import importlib
import json
import os
import re
import subprocess
from pathlib import Path

import bpy
import mathutils
import numpy as np
import pytest
from helpers import add_camera, add_world, open_image_io, render_passes

CONFIG = Path(bpy.utils.resource_path("LOCAL")) / "datafiles" / "colormanagement" / "config.ocio"
OBSERVER = Path(__file__).parents[2] / "data" / "color" / "observer.csv"
ROOM = Path(__file__).parents[2] / "scenes" / "room-coupled.json"
#: Before 5.0 only Blender's own working space.
SPACES = ("Linear Rec.709", "Linear Rec.2020", "ACEScg")
SPACES = SPACES if hasattr(bpy.data, "colorspace") else SPACES[:1]
VERSION = re.search(r"ocio_profile_version: ([\d.]+)", CONFIG.read_text())[1]


def render(folder, view):
    content = json.loads(ROOM.read_text())
    content["settings"] |= {"width": 48, "height": 48, "spp": 4}
    (folder / "room.json").write_text(json.dumps(content))
    command = [os.environ["BRDFC_TOOL"], "render", folder / "room.json", "--view", view]
    command += ["--out", folder / "room.exr", "--preview", folder / "tool.png"]
    return subprocess.run(
        [str(c) for c in command], capture_output=True, text=True, env=os.environ | {"OCIO": CONFIG}
    )


def eight_bits(path):
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return np.round(255 * pixels.reshape(-1, 4)[:, :3])


@pytest.mark.parametrize("view", ["Standard", "Filmic", "AgX"])
def test_view_is_blenders(empty, tmp_path, view):
    """Equal to one step of 8 bits: Blender rounds and dithers differently."""
    done = render(tmp_path, view)
    if float(VERSION) > 2.1:  # newer than the tool's OpenColorIO supports
        assert f"{CONFIG} is of version {VERSION}, later than" in done.stderr
        if view != "Standard":
            assert done.returncode == 2 and "expected one of Standard, Raw" in done.stderr
            return
    assert done.returncode == 0, done.stderr
    # Without the variance layer, because of which Blender would read the file as multilayer.
    oiio = open_image_io()
    mean = oiio.ImageBufAlgo.channels(oiio.ImageBuf(str(tmp_path / "room.exr")), (0, 1, 2))
    assert mean.get_pixels().max() > 1
    assert mean.write(str(tmp_path / "mean.exr"))
    empty.display_settings.display_device = "sRGB"
    empty.view_settings.view_transform = view
    empty.view_settings.look = "None"
    empty.render.image_settings.file_format = "PNG"
    empty.render.image_settings.color_mode = "RGB"
    empty.render.dither_intensity = 0
    image = bpy.data.images.load(str(tmp_path / "mean.exr"))
    image.save_render(str(tmp_path / "blender.png"), scene=empty)
    tool, blender = eight_bits(tmp_path / "tool.png"), eight_bits(tmp_path / "blender.png")
    assert np.ptp(tool) > 100
    assert np.abs(tool - blender).max() <= 1


def use_working_space(name):
    if hasattr(bpy.data, "colorspace"):
        bpy.ops.wm.set_working_color_space(working_space=name, convert_colors=False)
        assert bpy.data.colorspace.working_space == name


@pytest.fixture
def color(extension):
    return importlib.import_module(f"{extension.package}.common.color")


def of_index(values):
    """Reflectance at normal incidence from n and k by channel."""
    n, k = (np.array([values[f"{q}_{c}"] for c in "rgb"]) for q in "nk")
    return ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)


@pytest.mark.parametrize("space", SPACES)
def test_a_metal_has_one_colour_in_every_working_space(extension, empty, color, space):
    """To 1e-3 of white; 4.5 writes the matrix of its interchange space with four digits."""
    use_working_space(space)
    assert color.working_space() == space
    white = color.to_xyz([1, 1, 1])
    np.testing.assert_allclose(white, [0.9504, 1, 1.089], atol=3e-4)
    material = extension.api.new_material("fresnel_conductor")
    for name, substance in extension.api.substances().items():
        values = extension.api.set_substance(material, name)
        got = extension.api.get_parameters(material)
        assert all(got[k] == pytest.approx(v, rel=1e-6) for k, v in values.items())
        off = np.abs(color.to_xyz(of_index(values)) - substance.xyz() * white).max()
        if name == "gold" and space == SPACES[0]:
            assert color.from_xyz(substance.xyz())[0] > 1.03 and off > 0.01
        else:
            assert off < 1e-3, (name, off)


@pytest.mark.parametrize("space", SPACES)
def test_a_rendered_patch_has_one_colour(extension, empty, color, space):
    """A mirror of copper under a white sky, seen from above, compared with the tool's numbers."""
    use_working_space(space)
    material = extension.api.new_material("fresnel_conductor")
    extension.api.set_substance(material, "copper")
    bpy.ops.mesh.primitive_plane_add(size=10)
    bpy.context.object.data.materials.append(material)
    scene = bpy.context.scene
    extension.scene_loader.apply_clean_settings(scene, samples=1, max_bounces=1)
    add_world(scene)
    add_camera(scene, location=(0, 0, 5), rotation=(0, 0, 0), orthographic=1)
    scene.render.resolution_x = scene.render.resolution_y = 4
    pixel = render_passes(scene)["Combined"][2, 2, :3]
    expected = extension.api.substances()["copper"].xyz() * color.to_xyz([1, 1, 1])
    np.testing.assert_allclose(color.to_xyz(pixel), expected, atol=1e-3)


def test_a_file_of_measurements_sets_glass(extension, empty, tmp_path):
    glass, file = extension.api.new_material("glass"), tmp_path / "own.csv"
    file.write_text("wl,n\n0.35,1.54\n0.9,1.51\n", encoding="utf-8")
    assert extension.api.set_substance(glass, str(file)) == {
        "ior": pytest.approx(1.527, abs=1e-3),
        # 20 (n_F - n_C) / (n_d - 1) for a straight line.
        "dispersion": pytest.approx(20 * 0.03 / 0.55 * (0.65627 - 0.48613) / 0.527, rel=1e-2),
        "attenuation": (1.0, 1.0, 1.0),  # no k: nothing is absorbed
    }
    before = extension.api.get_parameters(glass)
    for name, expected in (
        ("gold", "glass has no parameter that says which metal"),
        ("mithril", "expected one of aluminium, "),
        (str(tmp_path / "none.csv"), "none.csv: No such file"),
    ):
        with pytest.raises(ValueError, match=re.escape(expected)):
            extension.api.set_substance(glass, name)
    file.write_text("wl,n\n0.3,glass\n", encoding="utf-8")
    with pytest.raises(ValueError, match="own.csv line 2: expected 2 numbers, a wavelength and n"):
        extension.api.set_substance(glass, str(file))
    assert extension.api.get_parameters(glass) == before


@pytest.mark.many
@pytest.mark.parametrize(
    ("model", "own", "other"),
    [
        ("fresnel_conductor", "copper", "gold"),
        ("cook_torrance", "copper", "gold"),
        ("fresnel_dielectric", "water", "diamond"),
    ],
)
@pytest.mark.parametrize("free", ["all", "one", "none"])
def test_a_substance_that_a_scenes_own_extension_lacks(
    extension, empty, use_pack, model, own, other, free
):
    """It is refused if one of its numbers is a different constant there, and nothing is half
    set."""
    api = extension.api
    values = api.set_substance(api.new_material(model), own)
    varies = {"all": set(values), "one": set(list(values)[:1]), "none": set()}[free]
    given = {name: {"varies": True} if name in varies else v for name, v in values.items()}
    use_pack({"m": {"model": model, "parameters": given}})
    material = api.new_material(model)
    assert set(api.set_substance(material, own)) == varies
    before = api.get_parameters(material)
    if varies == set(values):
        assert set(api.set_substance(material, other)) == varies
        assert api.get_parameters(material) != before
        return
    folded = ", ".join(name for name in values if name not in varies)
    with pytest.raises(ValueError, match=f"was built for one scene: {folded} of .* can't be set"):
        api.set_substance(material, other)
    assert api.get_parameters(material) == before


@pytest.mark.long
def test_nothing_remains_of_an_earlier_substance(extension, empty, tmp_path):
    """Neither its absorption nor a metal's tint; and a new glass is green until it is told."""
    api, clear = extension.api, tmp_path / "clear.csv"
    clear.write_text("wl,n\n0.35,1.54\n0.9,1.51\n", encoding="utf-8")
    coloured = tmp_path / "coloured.csv"
    coloured.write_text("wl,n,k\n0.35,1.5,0\n0.6,1.5,2e-6\n0.9,1.5,0\n", encoding="utf-8")
    for model in api.models():
        for before, after in (
            (coloured, clear),
            ("gold", clear),
            (clear, "gold"),
            ("gold", "gold"),
        ):
            changed, fresh = api.new_material(model), api.new_material(model)
            try:
                api.set_substance(changed, str(before))
            except ValueError:
                continue  # not for this kind
            try:
                api.set_substance(changed, str(after))
            except ValueError:
                continue
            api.set_substance(fresh, str(after))
            got, wanted = api.get_parameters(changed), api.get_parameters(fresh)
            got.pop("density", None), wanted.pop("density", None)  # of nothing
            assert got == wanted, (model, before, after)
    glass = api.new_material("glass")
    api.set_substance(glass, "diamond")
    assert api.get_parameters(glass)["attenuation"] == (1.0, 1.0, 1.0)


def test_glass_absorbs_what_k_says(extension, empty, color, tmp_path):
    """Beer's law at every wavelength, at the stated thickness; density is per Blender unit."""
    glass, file = extension.api.new_material("glass"), tmp_path / "own.csv"
    rows = [(0.38, 5e-6), (0.55, 4e-7), (0.7, 8e-6)]
    k = "".join(f"{um},{value}\n" for um, value in rows)
    file.write_text(f"wl,n\n0.35,1.54\n0.9,1.51\nwl,k\n{k}", encoding="utf-8")
    table = np.genfromtxt(OBSERVER, delimiter=",", names=True)
    weights = np.stack([table[c] * table["d65"] for c in "xyz"], -1)
    nm = table["nm"]
    alpha = 4 * np.pi * np.interp(nm, *(np.array(rows).T * [[1000], [1]])) / (nm * 1e-9)
    for thickness, density in ((None, 100), (0.002, 500)):
        values = extension.api.set_substance(glass, str(file), thickness=thickness)
        xyz = np.exp(-alpha / density) @ weights / weights.sum(0)
        assert values["attenuation"] == pytest.approx(color.from_xyz(xyz), abs=1e-5)
        assert values["density"] == pytest.approx(density)
        got = extension.api.get_parameters(glass)
        assert got["attenuation"] == pytest.approx(values["attenuation"], rel=1e-6)
    # One unit is a millimetre.
    bpy.context.scene.unit_settings.scale_length = 0.001
    assert extension.api.set_substance(glass, str(file))["density"] == pytest.approx(0.1)
    before = extension.api.get_parameters(glass)
    for name, thickness, expected in (
        (str(file), 0.0, "Expected a thickness from 1e-06 to 1e+06 m, got 0"),
        (
            "silica",
            0.01,
            "A thickness says where absorption is exact: Fused silica absorbs nothing",
        ),
    ):
        with pytest.raises(ValueError, match=re.escape(expected)):
            extension.api.set_substance(glass, name, thickness=thickness)
    assert extension.api.get_parameters(glass) == before
    water = extension.api.new_material("fresnel_dielectric")
    assert set(extension.api.set_substance(water, "water")) == {"ior", "dispersion"}
    with pytest.raises(ValueError, match="fresnel_dielectric absorbs nothing"):
        extension.api.set_substance(water, "water", thickness=1.0)


def test_the_button_sets_what_is_absorbed(extension, empty):
    material = extension.api.new_material("glass")
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.materials.append(material)
    assert bpy.ops.brdfc.substance(substance="water", thickness=1.0) == {"FINISHED"}
    values = extension.api.get_parameters(material)
    red, green, blue = values["attenuation"]
    assert 0.7 < red < 0.76 and 0.95 < green < blue < 0.98 and values["density"] == 1
    assert bpy.ops.brdfc.substance(substance="silica") == {"FINISHED"}
    assert extension.api.get_parameters(material)["attenuation"] == (1, 1, 1)  # it has no k


def test_the_button_sets_a_metal(extension, empty, tmp_path):
    material = extension.api.new_material("ward")
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.materials.append(material)
    assert bpy.ops.brdfc.substance(substance="silver") == {"FINISHED"}
    red, _, blue = extension.api.get_parameters(material)["ks"]
    assert red > blue > 0.97
    file = tmp_path / "own.csv"
    file.write_text("wl,n,k\n0.3,0.5,3\n0.8,0.5,3\n", encoding="utf-8")
    assert bpy.ops.brdfc.substance(substance="FILE", filepath=str(file)) == {"FINISHED"}
    grey = (0.25 + 9) / (2.25 + 9)
    assert extension.api.get_parameters(material)["ks"] == pytest.approx([grey] * 3, abs=2e-4)
    with pytest.raises(RuntimeError, match="expected a file NAME.csv"):
        bpy.ops.brdfc.substance(substance="FILE", filepath=str(tmp_path / "own.dat"))


def test_the_screens_curve_is_srgb_and_luminance_is_that_of_the_space(extension, empty, color):
    x = np.linspace(0, 1, 33)
    srgb = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    encoded = color.to_screen(np.stack([x, x, x], -1))
    np.testing.assert_allclose(encoded[:, 1], srgb, atol=1e-5)
    np.testing.assert_allclose(color.from_srgb(encoded)[:, 2], x, atol=1e-5)
    np.testing.assert_allclose(color.luminance(np.eye(3)), [0.2126, 0.7152, 0.0722], atol=1e-4)
    for space in SPACES[1:]:
        use_working_space(space)
        weights = color.luminance(np.eye(3))
        assert weights.sum() == pytest.approx(1, abs=1e-5) and weights[0] > 0.26
        # A red in sRGB is the same on the screen, whatever the working space.
        red = mathutils.Color((0.5, 0, 0)).from_rec709_linear_to_scene_linear()
        np.testing.assert_allclose(color.to_screen(red), [0.73536, 0, 0], atol=1e-4)
