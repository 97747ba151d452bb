# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pictures the gallery shows, and its pages."""

import json
import re

import demo_matrix
import gallery_check
import gallery_models
import gallery_pages
import numpy as np
import OpenImageIO as oiio
import pytest
from support import ROOT

MODELS = {"plain": {"auto": "exact", "representations": {"exact": {}, "sampled": {}}}}
SCENE = {
    "settings": {"width": 400, "height": 200, "spp": 64, "seed": 1},
    "materials": {"a": {"model": "plain"}},
}


@pytest.mark.parametrize(
    ("wanted", "expected"),
    [("auto", ["exact"]), ("unit", ["glossy", "exact"]), ("all", ["glossy", "exact", "sampled"])],
)
def test_forms_that_are_rendered(wanted, expected):
    assert [f.name for f in demo_matrix.forms_of(SCENE, MODELS, {}, wanted)] == expected


def test_pictures_are_made_smaller_and_never_larger():
    small = demo_matrix.smaller(SCENE, 100, 16)["settings"]
    assert small == {"width": 100, "height": 50, "spp": 16, "seed": 1}
    assert demo_matrix.smaller(SCENE, 1000, 1000)["settings"] == SCENE["settings"]


def scene(name, passed):
    test = {"passed": passed, "accepted": 0.9987, "rejected_tiles": 2, "tiles": 30}
    form = {
        "form": "exact",
        "test": test,
        "materials": [{"representation": "exact"}],
        "images": ["a", "b"],
        "spp": 32,
        "cpu_seconds": [1.5, 2.0],
        "rel_mse": 0.0012,
        "noise_floor": 0.001,
        "bias": -0.001,
        "bias_standard_error": 0.002,
    }
    return {
        "scene": name,
        "description": f"What {name} shows.",
        "forms": [form],
        "reference": {"spp": 256, "wall_seconds": 9.0},
        "provenance": {"Blender": "4.5.15", "Processor": "one"},
    }


def test_a_page_a_paper(tmp_path, monkeypatch):
    names = ("gl-fig5", "ra-fig1", "lamps")
    for name in names:
        (tmp_path / name).mkdir()
        for i, file in enumerate(("exact.png", "reference.png", "exact-difference.png")):
            region = oiio.ROI(0, 20, 0, 10, 0, 1, 0, 3)
            picture = oiio.ImageBufAlgo.fill(
                ((i == 0) * 1.0, (i == 1) * 1.0, (i == 2) * 1.0), region
            )
            assert picture.write(str(tmp_path / name / file), "uint8")
    scenes = [scene(name, name != "lamps") for name in names]
    (tmp_path / "report.json").write_text(json.dumps({"scenes": scenes}))
    pages = tmp_path / "pages"
    monkeypatch.setattr("sys.argv", ["gallery_pages.py", str(tmp_path), str(pages), "make it"])
    gallery_pages.main()

    index = (pages / "overview.md").read_text()
    assert "(suffern.md) | 1 | 1 |" in index and "(more.md) | 1 | 0 |" in index
    assert "shirley.md" not in index, "no page without scenes"
    page = (pages / "more.md").read_text()
    assert "`make it` made this page" in page
    assert "**differs**: 99.87 % of pixels accepted, 2 of 30 tiles rejected" in page
    assert "exact, 32 samples, 3.5 s CPU" in page and "What lamps shows." in page

    # A second run with other scenes keeps what the first made.
    report = {"scenes": [scene("gl-fig5", False)]}
    (tmp_path / "report.json").write_text(json.dumps(report))
    gallery_pages.main()
    again = (pages / "overview.md").read_text()
    assert "(suffern.md) | 1 | 0 |" in again and "(more.md) | 1 | 0 |" in again
    assert (pages / "more.md").read_text() == page
    strip = oiio.ImageBuf(str(pages / "gl-fig5.jpg"))
    gap = gallery_pages.GAP
    assert (strip.spec().width, strip.spec().height) == (60 + 2 * gap, 10)
    for i in range(3):
        colour = strip.getpixel(i * (20 + gap) + 10, 5)
        assert max(range(3), key=lambda c: colour[c]) == i, "Blender, reference, difference"


def test_the_pixel_test_is_told_of_a_model_s_balls():
    """Their scene is made for the page: it is none of scenes/."""
    cells = gallery_pages.measured(scene("ball-shiny", True))[-1]
    assert "the same within noise: 99.87 % of pixels accepted" in cells


NUMBER = {"kind": "number", "label": "Sharpness", "doc": "Of the lobe"}
MODEL = {
    "name": "shiny",
    "label": "Shiny",
    "doc": "A lobe.",
    "properties": {
        "fit_axis": "",
        "reciprocal": True,
        "lossless": False,
        "conserving": False,
        "isotropic": True,
    },
    "parameters": [
        {"name": "tint", "kind": "color", "default": [1, 1, 1]},
        NUMBER | {"name": "k", "soft_min": 0, "soft_max": 1, "default": 0.5, "by_factors": False},
        NUMBER | {"name": "e", "soft_min": 1, "soft_max": 1e4, "default": 100, "by_factors": True},
    ],
}


def test_a_ball_a_value_of_the_schema():
    assert gallery_models.shown(MODEL) == [{"e": 10}, {"e": 100}, {"e": 1000}]
    of_k = MODEL | {"properties": MODEL["properties"] | {"fit_axis": "k"}}
    assert gallery_models.shown(of_k) == [{"k": 0.25}, {"k": 0.5}, {"k": 0.75}]
    made = gallery_models.ball_scene(MODEL)
    assert made["materials"]["ball_2"] == {"model": "shiny", "parameters": {"e": 1000}}
    plain = MODEL | {"parameters": MODEL["parameters"][:1]}
    assert gallery_models.ball_scene(plain)["materials"]["ball_0"]["parameters"] == {
        "tint": [0.2, 0.2, 0.2]
    }


def test_a_model_s_page_says_what_its_schema_claims():
    assert gallery_models.claims(MODEL) == (
        "It is reciprocal and it gains light for some parameters and views."
    )


def noisy(rng, factor=1.0):
    """A picture with bright and dark parts, and noise."""
    light = np.linspace(0.1, 2, 40 * 30)[:, None].repeat(3, 1).reshape(30, 40, 3)
    return light * factor * rng.gamma(4, 1 / 4, light.shape)


def test_the_gallery_check_lets_noise_pass_and_no_more():
    rng = np.random.default_rng(1)
    reference = noisy(rng)
    off, noise = gallery_check.judge(noisy(rng), reference, 0)
    assert abs(off) < 4 * noise and 0.005 < noise < 0.05
    darker = noisy(rng, 0.8)
    assert gallery_check.judge(darker, reference, 0.2)[0] < -0.1, "within the stated error"
    red = noisy(rng)
    red[..., 0] *= 1.2
    bad, nothing = noisy(rng), np.zeros_like(reference)
    bad[3, 4, 1] = np.nan
    for picture, message in (
        (darker, "in Blender -"),
        (red, "of the reference's light in R"),
        (bad, "1 bad values"),
        (nothing, "is black"),
    ):
        with pytest.raises(gallery_check.CheckError, match=message):
            gallery_check.judge(picture, reference, 0)


def test_a_scene_states_the_error_of_its_worst_form():
    forms = [{"error": {"relative_l1": 0.02}}, {"error": {"relative_l1": None}}, {"error": None}]
    record = {"materials": {"a": forms[1:], "b": forms, "node": [{"representation": "glossy"}]}}
    assert gallery_check.stated_error(record) == 0.02
    assert gallery_check.stated_error({"materials": {}}) == 0


def test_every_scene_is_among_some_third():
    scenes = [f"scene{i}" for i in range(10)]
    thirds = {tuple(gallery_check.third(scenes, f"commit {i}")) for i in range(50)}
    assert len(thirds) == 3
    assert sorted(scene for third in thirds for scene in third) == sorted(scenes)


def test_large_pictures_are_of_scenes_and_large():
    page = (ROOT / "docs" / "gallery" / "pictures.md").read_text(encoding="utf-8")
    shown = re.findall(r"\]\((\S+)-large\.jpg\)", page)
    made = {p.name.removesuffix("-large.jpg") for p in (ROOT / "docs/gallery").glob("*-large.jpg")}
    assert len(shown) > 3 and set(shown) == made, "run script/gallery large"
    for name in shown:
        assert (ROOT / "scenes" / f"{name}.json").is_file()
        assert oiio.ImageBuf(str(ROOT / f"docs/gallery/{name}-large.jpg")).spec().width >= 800
