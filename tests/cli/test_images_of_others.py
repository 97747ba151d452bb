# SPDX-License-Identifier: GPL-3.0-or-later
"""Images and OpenColorIO configurations from other programs: non-finite and negative values,
primaries stated in files, and other names of colour spaces."""

import json
import os
import struct
import subprocess
import zlib

import numpy as np
import OpenImageIO as oiio
import PyOpenColorIO as ocio
import pytest
from colors import converted
from support import CONFIG, SPACES, TOOL, run, scene

REC709, REC2020, ACESCG = SPACES
AP1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
AP0 = (0.7347, 0.2653, 0, 1, 0.0001, -0.077, 0.32168, 0.33767)
P3 = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290)
XYZ = (1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3)
#: A green inside all working spaces, and white.
COLORS = np.array([[[0.18, 0.4, 0.15], [1, 1, 1]]], np.float32)


def write(path, pixels, kind=oiio.FLOAT, **attributes):
    pixels = np.asarray(pixels, np.float32)
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    for name, value in attributes.items():
        if name == "chromaticities":
            spec.attribute(name, oiio.TypeDesc("float[8]"), value)
        else:
            spec.attribute(name, value)
    buffer = oiio.ImageBuf(spec)
    buffer.set_pixels(oiio.ROI(), np.ascontiguousarray(pixels))
    assert buffer.write(str(path)), oiio.geterror()


def resolve(folder, config=None, **changes):
    path = folder / "s.json"
    path.write_text(json.dumps(scene(**changes)), encoding="utf-8")
    return run("scene", path, "--out", folder / "out", config=config)


def as_sky(folder, name, config=None, space=None, **keys):
    """The pixels that both renderers get for an image as the environment, and the tool's
    messages."""
    more = {"working_space": space} if space else {}
    done = resolve(folder, config, environment={"image": name, **keys}, **more)
    assert done.returncode == 0, done.stderr
    resolved = json.loads((folder / "out" / "scene.json").read_text())["environment"]["image"]
    pixels = oiio.ImageBuf(str(folder / "out" / resolved)).get_pixels(oiio.FLOAT)
    lines = done.stderr.splitlines()[:-1]
    return pixels, [line.removeprefix(f"brdfc: {folder / name}: ") for line in lines]


def refused(done, *words):
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    for word in words:
        assert word in done.stderr, done.stderr


def test_what_is_not_finite_is_black_and_what_is_negative_stays(tmp_path):
    """The same as Cycles does: see tests/blender/test_files_of_others.py."""
    sky = np.full((4, 8, 3), 0.5)
    sky[1, 2, 0], sky[1, 3], sky[2, 5, 1] = np.nan, np.inf, -np.inf
    sky[3, 0, 2], sky[3, 1] = -6e-8, -2
    write(tmp_path / "sky.exr", sky)
    pixels, said = as_sky(tmp_path, "sky.exr")
    expected = np.where(np.isfinite(sky).all(-1, keepdims=True), sky, 0).astype(np.float32)
    np.testing.assert_array_equal(pixels, expected)
    assert said == [
        "3 pixels are NaN or infinite, the first at (2, 1), taken for black as in Cycles",
        "4 values are negative, the first at (0, 3), the least -2; they take light away, as in "
        "Cycles",
    ]
    # A sky with mostly negative light still has a mean, on which both sampling techniques agree.
    path = tmp_path / "s.json"
    means = []
    for strategy in ("mis", "brdf"):
        done = run(
            "render", path, "--out", tmp_path / "a.exr", "--spp", 256, "--strategy", strategy
        )
        assert done.returncode == 0, done.stderr
        means.append(oiio.ImageBuf(str(tmp_path / "a.exr")).get_pixels()[2:6, 2:6, :3].mean())
    assert means[0] == pytest.approx(means[1], rel=0.05)


@pytest.mark.parametrize("alpha", [128, 20, 0])
@pytest.mark.parametrize("colour, channels", [(4, 1), (6, 3)], ids=["grey", "rgb"])
def test_alpha_darkens_colours_but_not_what_has_one_channel(tmp_path, colour, channels, alpha):
    """As in Cycles, whose own pictures of such files Blender 4.5 and 5.2 gave."""
    row = bytes([0, *2 * [*channels * [200], alpha]])
    (tmp_path / "sky.png").write_bytes(png(2, 1, colour, row))
    found, _ = as_sky(tmp_path, "sky.png")
    stored = 200 / 255 * (1 if channels == 1 else alpha / 255)
    linear = ((stored + 0.055) / 1.055) ** 2.4 if stored > 0.04045 else stored / 12.92
    np.testing.assert_allclose(found[..., :3], linear, atol=0.01)


def test_a_texture_beyond_the_range_ends_there(tmp_path):
    write(tmp_path / "t.exr", [[[0.5, -6e-8, 0.5], [1.25, np.nan, 0.5]], [[0.5] * 3] * 2])
    texture = {"texture": {"image": "t.exr"}}
    materials = {"m": {"model": "lambert", "parameters": {"rho": texture}}}
    quad = [{"name": "o", "shape": {"type": "quad"}, "material": "m"}]
    done = resolve(tmp_path, materials=materials, objects=quad)
    assert done.returncode == 0, done.stderr
    said = done.stderr.splitlines()
    assert "1 pixel is NaN or infinite, the first at (1, 0), taken for black" in said[0]
    assert '1 value is outside of [0, 1], the range of "rho", the first -6e-08 at (0, 0)' in said[1]
    (image,) = (tmp_path / "out").glob("*.exr")
    pixels = oiio.ImageBuf(str(image)).get_pixels(oiio.FLOAT)
    assert pixels[0].tolist() == [[0.5, 0, 0.5], [0, 0, 0]]


@pytest.mark.many
@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize(
    ("primaries", "name"),
    [(AP1, "ACEScg"), (AP0, "ACES2065-1"), (XYZ, "Linear CIE-XYZ D65"), (P3, None)],
)
def test_primaries_that_a_file_states_are_honoured(tmp_path, primaries, name, space):
    colors = converted(COLORS, REC709, name) if name else COLORS
    write(tmp_path / "a.exr", colors, chromaticities=primaries)
    pixels, said = as_sky(tmp_path, "a.exr", space=space)
    assert not said
    if name:
        np.testing.assert_allclose(pixels, converted(COLORS, REC709, space), atol=3e-4)
    else:
        np.testing.assert_allclose(pixels[0, 1], 1, atol=1e-4)
        assert np.abs(pixels[0, 0] - COLORS[0, 0]).max() > 0.005
    # The scene's statement takes precedence.
    stored, _ = as_sky(tmp_path, "a.exr", space=space, colorspace="linear")
    np.testing.assert_array_equal(stored, colors)


@pytest.mark.slow
def test_color_interop_ids_are_honoured(tmp_path):
    for id, name in (
        ("lin_rec709_scene", REC709),
        ("lin_rec2020_scene", REC2020),
        ("lin_ap1_scene", ACESCG),
        ("lin_ap0_scene", "ACES2065-1"),
        ("lin_ciexyzd65_scene", "Linear CIE-XYZ D65"),
    ):
        colors = converted(COLORS, REC709, name)
        # It takes precedence over the chromaticities.
        write(tmp_path / "a.exr", colors, colorInteropID=id, chromaticities=P3)
        np.testing.assert_allclose(as_sky(tmp_path, "a.exr")[0], COLORS, atol=3e-4)
    write(tmp_path / "a.exr", COLORS, colorInteropID="data")
    np.testing.assert_array_equal(as_sky(tmp_path, "a.exr")[0], COLORS)
    write(tmp_path / "a.exr", COLORS, colorInteropID="slog3_sgamut3cine")
    done = resolve(tmp_path, environment={"image": "a.exr"})
    refused(done, "environment.image: ", "a.exr: its colours are in 'slog3_", "colorspace")
    as_sky(tmp_path, "a.exr", colorspace="linear")
    write(tmp_path / "a.exr", COLORS, chromaticities=(0,) * 8)
    refused(resolve(tmp_path, environment={"image": "a.exr"}), "expected chromaticities of three")


def test_a_picture_of_ours_is_a_sky_of_its_own_space(tmp_path):
    path = tmp_path / "first.json"
    sky = {"color": [0.2, 0.6, 0.1]}
    path.write_text(json.dumps(scene(environment=sky, objects=[], working_space=REC2020)))
    if run("render", path, "--out", tmp_path / "a.exr").returncode:  # a scene may need an object
        far = {"translate": [0, 1000, 0], "scale": 0.001}
        item = {"name": "o", "shape": {"type": "sphere"}, "material": "m", "transform": far}
        path.write_text(json.dumps(scene(environment=sky, objects=[item], working_space=REC2020)))
        assert run("render", path, "--out", tmp_path / "a.exr").returncode == 0
    pixels, _ = as_sky(tmp_path, "a.exr", space=REC709)
    expected = converted([[[0.2, 0.6, 0.1]]], REC2020, REC709)[0, 0]
    np.testing.assert_allclose(pixels[0, 0], expected, atol=1e-4)
    same, _ = as_sky(tmp_path, "a.exr", space=REC2020)
    np.testing.assert_array_equal(same[0, 0], np.float32([0.2, 0.6, 0.1]))


def test_an_environment_has_a_colorspace(tmp_path):
    write(tmp_path / "a.png", COLORS, oiio.UINT8)
    stored = np.round(COLORS * 255) / 255
    np.testing.assert_allclose(as_sky(tmp_path, "a.png", colorspace="linear")[0], stored, atol=1e-6)
    decoded = converted(stored, "sRGB", REC709)
    for keys in ({}, {"colorspace": "srgb"}, {"colorspace": "auto"}):
        np.testing.assert_allclose(as_sky(tmp_path, "a.png", **keys)[0], decoded, atol=1e-6)
    of_rec2020 = as_sky(tmp_path, "a.png", colorspace=REC2020)[0]
    np.testing.assert_allclose(of_rec2020, converted(stored, REC2020, REC709), atol=1e-6)
    done = resolve(tmp_path, environment={"image": "a.png", "colorspace": "srbg"})
    refused(done, "environment.colorspace: expected one of auto, linear, srgb")


# ---- files that are none ------------------------------------------------------------------------


def png(width, height, colour=2, rows=None):
    """An image of 8 bits with this type of colour, without its end if there are no `rows`."""

    def chunk(name, data):
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0))
    if rows is None:
        return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", b"\x78\x9c")
    content = chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + head + content


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.png", b"", "a.png: not a PNG file, as its name says"),
        ("a.exr", b"hello, world", "a.exr: not an OpenEXR file, as its name says"),
        ("a.png", b"\xff\xd8\xff\xe0", "a.png: not a PNG file, as its name says, but JPEG"),
        ("a.hdr", b"\x76\x2f\x31\x01", "a.hdr: not a Radiance file, as its name says, but OpenEXR"),
        ("a.jpg", b"\xff\xd8\xff\xe0", "a.jpg: damaged JPEG file: "),
        ("a.tif", b"II*\0\0\0\0\0", "a.tif: damaged TIFF file: "),
        ("a.png", png(8, 8), "a.png: damaged PNG file: "),
        ("a.webp", b"RIFF", "a.webp: expected an image file that ends in one of .exr, .hdr"),
    ],
)
def test_what_is_no_image_is_said_in_words_of_ours(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    refused(resolve(tmp_path, environment={"image": name}), "environment.image: ", words)


# ---- configurations of studios ------------------------------------------------------------------

BUILT_IN = list(ocio.BuiltinConfigRegistry())


def written(folder, name):
    path = folder / f"{name}.ocio"
    path.write_text(ocio.Config.CreateFromBuiltinConfig(name).serialize(), encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.many
@pytest.mark.parametrize("name", [n for n in BUILT_IN if n.endswith("ocio-v2.1")])
def test_configurations_of_aces(tmp_path, name):
    """The configurations' own names for sRGB, the linear spaces and the default view are found."""
    config = written(tmp_path, name)
    write(tmp_path / "a.png", COLORS, oiio.UINT8)
    stored = np.round(COLORS * 255) / 255
    expected = converted(stored, "sRGB - Texture", "ACEScg", config)
    np.testing.assert_allclose(as_sky(tmp_path, "a.png", config)[0], expected, atol=1e-6)
    for alias in ("srgb", "srgb_tx", "matte_paint", "Utility - sRGB - Texture"):
        found = as_sky(tmp_path, "a.png", config, colorspace=alias)[0]
        np.testing.assert_allclose(found, expected, atol=1e-6)
    np.testing.assert_allclose(as_sky(tmp_path, "a.png", config, colorspace="Raw")[0], stored)
    for space in SPACES:
        of_file = {REC709: "Linear Rec.709 (sRGB)"}.get(space, space)
        found = as_sky(tmp_path, "a.png", config, space=space)[0]
        np.testing.assert_allclose(
            found, converted(stored, "sRGB - Texture", of_file, config), atol=1e-5
        )
    # Images that state their space are converted, and shown with the display's default view.
    write(tmp_path / "b.exr", converted(COLORS, REC709, "ACES2065-1"), chromaticities=AP0)
    found = as_sky(tmp_path, "b.exr", config)[0]
    np.testing.assert_allclose(found, converted(COLORS, REC709, ACESCG), atol=5e-4)
    preview = ("--preview", tmp_path / "a.preview.png")
    done = run("render", tmp_path / "s.json", "--out", tmp_path / "a.exr", *preview, config=config)
    assert done.returncode == 0, done.stderr
    other = (*preview, "--view", "AgX")
    done = run("render", tmp_path / "s.json", "--out", tmp_path / "a.exr", *other, config=config)
    refused(done, "--view AgX: expected one of ACES 1.0 - SDR Video, ")
    gold = json.loads(run("optical", "gold", "--json", config=config).stdout)
    assert (gold[0] if isinstance(gold, list) else gold)["reflectance"][0] < 1


def test_a_configuration_without_the_names_of_srgb_has_its_curve(tmp_path):
    text = CONFIG.read_text(encoding="utf-8").replace("sRGB", "Byte")
    config = tmp_path / "own.ocio"
    config.write_text(text, encoding="utf-8")
    assert "sRGB" not in text
    write(tmp_path / "a.png", COLORS, oiio.UINT8)
    expected = converted(np.round(COLORS * 255) / 255, "sRGB", REC709)
    np.testing.assert_allclose(as_sky(tmp_path, "a.png", config)[0], expected, atol=2e-6)


def test_configurations_that_are_too_new_are_said(tmp_path):
    """With Debian 12's OpenColorIO 2.1, brdfc's own configuration is used instead; a later version
    reads them."""
    write(tmp_path / "a.png", COLORS, oiio.UINT8)
    resolve(tmp_path, environment={"image": "a.png"})
    for config, words in (
        (written(tmp_path, next(n for n in BUILT_IN if n.endswith("v2.4"))), "is of version 2.4"),
        ("ocio://cg-config-v1.0.0_aces-v1.3_ocio-v2.1", "needs OpenColorIO 2.2"),
        ("ocio://default", "needs OpenColorIO 2.2"),
    ):
        done = run("scene", tmp_path / "s.json", "--out", tmp_path / "out", config=config)
        assert done.returncode == 0, done.stderr
        line = done.stderr.splitlines()[0]
        assert f"{config} {words}, later than OpenColorIO 2.1" in line and "config.ocio" in line
    done = run("optical", "gold", config=tmp_path / "none.ocio")
    refused(done, "none.ocio: expected an OpenColorIO configuration")


def test_a_configuration_without_scene_linear_is_an_error(tmp_path):
    text = CONFIG.read_text(encoding="utf-8")
    config = tmp_path / "own.ocio"
    config.write_text("\n".join(li for li in text.split("\n") if "scene_linear:" not in li))
    done = subprocess.run(
        [TOOL, "optical", "gold"], capture_output=True, text=True, env=os.environ | {"OCIO": config}
    )
    refused(done, "own.ocio: expected the role scene_linear")
