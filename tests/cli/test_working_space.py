# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that name their working space: the reference renderer computes in it, and readers of its
pictures know it."""

import json
import sys

import numpy as np
import OpenImageIO as oiio
import pytest
from colors import converted
from support import CONFIG, ROOT, SPACES, run, scene

sys.path.insert(0, str(ROOT / "script"))
from pictures import read_rgb

REC709, REC2020, ACESCG = SPACES


def mirrors(folder, **changes):
    """A mirror of gold, one of copper, and a picture of a single colour, side by side under a white
    sky, without noise."""
    color = np.array([0.18, 0.4, 0.05], np.float32)
    buffer = oiio.ImageBuf(oiio.ImageSpec(2, 2, 3, oiio.FLOAT))
    buffer.set_pixels(oiio.ROI(), np.broadcast_to(color, (2, 2, 3)).copy())
    assert buffer.write(str(folder / "green.exr"))
    texture = {"texture": {"image": "green.exr", "colorspace": "Linear Rec.709"}}
    materials = {
        "gold": {"model": "fresnel_conductor", "optical": "gold"},
        "copper": {"model": "fresnel_conductor", "optical": "copper"},
        "green": {"model": "lambert", "parameters": {"rho": texture}},
    }
    shape = {"type": "quad", "size": [2, 9]}
    objects = [
        {"name": m, "shape": shape, "transform": {"translate": [2 * i - 2, 0, 0]}, "material": m}
        for i, m in enumerate(materials)
    ]
    camera = {"type": "orthographic", "height": 6, "position": [0, 0, 4]}
    camera |= {"look_at": [0, 0, 0], "up": [0, 1, 0]}
    content = scene(camera=camera, materials=materials, objects=objects) | changes
    path = folder / "mirrors.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def render(folder, space, *options, name="", config=None):
    path = mirrors(folder, **({"working_space": space} if space else {}))
    out = folder / f"{name or space or 'none'}.exr"
    done = run("render", path, "--out", out, *options, config=config)
    assert done.returncode == 0, done.stderr
    return out


def patches(pixels):
    """Colours of gold, copper and green."""
    return pixels[4, [1, 4, 6], :3]


def in_file(path):
    picture = oiio.ImageBuf(str(path))
    return patches(picture.get_pixels(oiio.FLOAT)), picture.spec()


def test_a_scene_has_one_look_in_every_working_space(tmp_path):
    """Except gold's red in Rec.709, which is outside that space."""
    numbers = {s: in_file(render(tmp_path, s))[0] for s in SPACES}
    looks = {s: converted(v, s, REC709) for s, v in numbers.items()}
    assert np.abs(numbers[REC2020] - numbers[REC709]).max() > 0.05, "numbers are the space's own"
    for space in SPACES:
        np.testing.assert_allclose(looks[space][2], [0.18, 0.4, 0.05], atol=1e-3)
    np.testing.assert_allclose(looks[ACESCG], looks[REC2020], atol=1e-3)
    np.testing.assert_allclose(looks[REC709][1:], looks[REC2020][1:], atol=1e-3)
    (red, *rest), (held, *same) = looks[REC709][0], looks[REC2020][0]
    np.testing.assert_allclose(rest, same, atol=1e-3)
    assert red == pytest.approx(0.999, abs=1e-5) and held == pytest.approx(1.038, abs=1e-3)
    assert numbers[REC2020][0].max() < 1 and numbers[ACESCG][0].max() < 1


def test_a_picture_says_its_space_if_the_scene_does(tmp_path):
    for space, name, red in (
        (REC709, "lin_rec709_scene", (0.64, 0.33)),
        (REC2020, "lin_rec2020_scene", (0.708, 0.292)),
        (ACESCG, "lin_ap1_scene", (0.713, 0.293)),
    ):
        out = render(tmp_path, space)
        spec = in_file(out)[1]
        assert spec.get_string_attribute("colorInteropID") == name
        assert spec["chromaticities"][:2] == pytest.approx(red)
        look = converted(in_file(out)[0], space, REC709)
        np.testing.assert_allclose(patches(read_rgb(out)), look, atol=1e-6)
    colors, spec = in_file(render(tmp_path, None))
    assert spec.get_string_attribute("colorInteropID") == ""
    assert "chromaticities" not in {a.name for a in spec.extra_attribs}
    np.testing.assert_array_equal(colors, in_file(tmp_path / f"{REC709}.exr")[0])


def comparison(*files):
    done = run("compare", *files, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_compare_and_previews_convert_from_what_a_file_says(tmp_path):
    files = {s: render(tmp_path, s, "--preview", tmp_path / f"{s}.png") for s in SPACES}
    shown = [in_file(tmp_path / f"{s}.png")[0] for s in SPACES]
    assert np.ptp(shown[0]) > 0.5
    for other in shown[1:]:  # a display can't show more of gold's red than of white
        np.testing.assert_allclose(other, shown[0], atol=1.01 / 255)
    assert comparison(files[ACESCG], files[REC2020])["max"] < 1e-3
    assert comparison(files[REC2020], files[ACESCG])["max"] < 1e-3
    same = comparison(files[REC2020], files[REC2020])
    assert same["max"] == 0 and same["noise_mse"] is not None
    # A file that states no space is in the configuration's working space.
    silent = render(tmp_path, None)
    assert comparison(files[REC2020], silent)["max"] == pytest.approx(0.039, abs=2e-3)
    assert comparison(files[REC709], silent)["max"] == 0


def test_the_scenes_space_comes_before_the_configurations(tmp_path):
    text = CONFIG.read_text(encoding="utf-8")
    config = tmp_path / "other.ocio"
    config.write_text(text.replace("scene_linear: Linear Rec.709", f"scene_linear: {ACESCG}"))
    plain, _ = in_file(render(tmp_path, REC2020))
    under, _ = in_file(render(tmp_path, REC2020, name="under", config=config))
    np.testing.assert_array_equal(plain, under)
    of_config, spec = in_file(render(tmp_path, None, config=config))
    assert spec.get_string_attribute("colorInteropID") == ""
    np.testing.assert_array_equal(of_config, in_file(render(tmp_path, ACESCG))[0])


def test_spaces_that_there_are_not_are_errors(tmp_path):
    def told(space, config=None):
        path = mirrors(tmp_path, working_space=space)
        done = run("render", path, "--out", tmp_path / "o.exr", config=config)
        assert done.returncode == 2
        return done.stderr

    expected = "expected one of Linear Rec.709, Linear Rec.2020, ACEScg"
    for bad, meant in (
        ("Rec.2020", "did you mean Linear Rec.2020? "),
        ("sRGB", ""),
        ("Non-Color", ""),
        (3, ""),
        (["ACEScg"], ""),
    ):
        assert f"mirrors.json: working_space: {meant}{expected}" in told(bad)
    config = tmp_path / "small.ocio"
    text = CONFIG.read_text(encoding="utf-8").replace("name: ACEScg", "name: Other")
    config.write_text(text.replace("lin_ap1_scene", "other"))  # otherwise its alias would match
    error = told(ACESCG, config)
    assert "mirrors.json: working_space: " in error
    assert "small.ocio has no colour space 'ACEScg', expected one of Linear Rec.709, sRGB" in error


@pytest.mark.parametrize(
    ("attribute", "value", "message"),
    [
        ("colorInteropID", "lin_p3d65_scene", "its colours are in 'lin_p3d65_scene', expected one"),
        (
            "chromaticities",
            (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329),
            "its colours have the chromaticities 0.68 0.32 0.265 0.69",
        ),
    ],
)
def test_a_picture_in_another_space_is_an_error(tmp_path, attribute, value, message):
    picture = oiio.ImageBuf(oiio.ImageSpec(2, 2, 3, oiio.FLOAT))
    kind = "string" if isinstance(value, str) else "float[8]"
    picture.specmod().attribute(attribute, kind, value)
    assert picture.write(str(tmp_path / "p3.exr"))
    done = run("compare", tmp_path / "p3.exr", tmp_path / "p3.exr")
    assert done.returncode == 2 and f"p3.exr: {message}" in done.stderr
    assert "Linear Rec.709, Linear Rec.2020, ACEScg" in done.stderr
