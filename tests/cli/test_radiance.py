# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured BRDFs in Radiance's XML: matrices over patches and trees, made from functions, are read
as what they were made from; what is wrong in one is said in a line, and so is what is not read."""

import json

import numpy as np
import pytest
from measured_files import hemisphere
from radiance_files import (
    FULL,
    HALF,
    OLD_HALF,
    OLD_QUARTER,
    QUARTER,
    XYZ_OF_RADIANCE,
    Tree,
    averages,
    bsdf,
    data,
    matrix,
    patch_of,
    places,
    solid_angles,
    table,
    to_world,
    tree_places,
)
from support import run, scene
from test_measured import PLANE, lopsided, pairs, told

BASES = {"Full": FULL, "Half": HALF, "Quarter": QUARTER}
SMALL = ((0, 40, 90), (1, 4))


def small(*blocks, **more):
    """A file with the basis SMALL, named "s"."""
    return bsdf(*blocks, described=table("s", SMALL), **more)


def lopsided_light(wi, wo):
    """Not the same when light and view are swapped, when both are turned, nor in a mirror."""
    return lopsided(wi, wo)[:, 0] * (1 + 0.4 * wi[:, 0] + 0.3 * wo[:, 1])


def phong(wi, wo, exponent=20):
    """Lambert, and a lobe about the mirror direction."""
    along = np.clip((wi * [-1, -1, 1] * wo).sum(-1), 0, 1)
    return 0.1 + 0.5 * along**exponent


def cosine(count, seed):
    """Unit vectors, spread evenly in projected solid angle."""
    random = np.random.default_rng(seed)
    s, phi = np.sqrt(random.uniform(size=count)), 2 * np.pi * random.uniform(size=count)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.sqrt(1 - s * s)], -1)


def means_of_patches(file, basis, incident, side="Front"):
    """Means over outgoing patches and an incident one."""
    at = places(basis, 6)
    patches, each = at.shape[:2]
    outgoing = np.tile(at.reshape(-1, 3), (each, 1))
    wi, wo = to_world(side, np.repeat(at[incident], patches * each, 0), outgoing)
    return pairs(file, wi, wo)[0][:, 0].reshape(each, patches, each).mean((0, 2))


def write(folder, text, name="m.xml"):
    file = folder / name
    if isinstance(text, bytes):
        file.write_bytes(text)
    else:
        file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("side", ["Front", "Back"])
@pytest.mark.parametrize("structure", ["Columns", "Rows"])
def test_directions_are_those_of_the_side(tmp_path, side, structure):
    values = averages(lopsided_light, FULL, side, 2)
    block = matrix(values if structure == "Columns" else values.T, direction=f"Reflection {side}")
    file = write(tmp_path, bsdf(block, structure=structure))
    wi, wo = hemisphere(2000, 1, 0.25), hemisphere(2000, 2, 0.25)
    found, _ = pairs(file, wi, wo)
    expected = lopsided_light(wi, wo)
    np.testing.assert_allclose(found[:, 0], expected, rtol=0.06)
    assert np.abs(found[:, 0] - expected).mean() < 0.01 * expected.mean()
    assert (found == found[:, :1]).all()
    for other in ((wo, wi), (wi * [-1, 1, 1], wo * [-1, 1, 1]), (-wi * [1, 1, -1], wo)):
        assert np.abs(found[:, 0] - lopsided_light(*other)).mean() > 0.1 * expected.mean()
    said = told(file)
    assert said["format"] == "Radiance" and not said["isotropic"] and said["highest"] == 90
    assert said["description"] == "Cloth, Weaver"
    assert said["grid"] == "145 x 145 patches of light and view, LBNL/Klems Full"
    assert said["notes"] == [
        f"Reflection {side} is read",
        "averages over patches up to 30 degrees wide, the last from 75 to 90 degrees to the "
        "normal: what is narrower is not in the data",
    ]


@pytest.mark.parametrize("name", BASES)
def test_a_matte_surface_is_read_whole(tmp_path, name):
    basis = BASES[name]
    count = sum(basis[1])
    file = write(tmp_path, bsdf(matrix(np.full((count, count), 0.5 / np.pi), f"LBNL/Klems {name}")))
    wi, wo = hemisphere(1000, 3, 0.001), hemisphere(1000, 4, 0.001)
    np.testing.assert_allclose(pairs(file, wi, wo)[0], 0.5 / np.pi, rtol=1e-6)
    said = told(file)
    assert said["non_reciprocal"] < 1e-6 and said["lacks"] == []
    for view in said["albedo"]:
        assert view["rgb"] == pytest.approx([0.5] * 3, rel=5e-3)


#: The part of a lobe's light that is misplaced, interpolated and by the patches as they are.
LOST = {"Full": (0.016, 0.076), "Half": (0.035, 0.103), "Quarter": (0.069, 0.132)}


@pytest.mark.slow
@pytest.mark.parametrize("name", BASES)
def test_lobes_are_those_that_were_averaged(tmp_path, name):
    """By interpolation that keeps the means of patches; docs/measured.md has the figures."""
    basis = BASES[name]
    values = averages(phong, basis, count=5)
    file = write(tmp_path, bsdf(matrix(values, f"LBNL/Klems {name}")))
    incident, outgoing = cosine(20000, 1), cosine(20000, 2)
    wi, wo = to_world("Front", incident, outgoing)
    found, expected = pairs(file, wi, wo)[0][:, 0], phong(wi, wo)
    plain = values[patch_of(basis, outgoing), patch_of(basis, incident)]
    off = [np.abs(f - expected).sum() / expected.sum() for f in (found, plain)]
    assert off == pytest.approx(LOST[name], rel=0.05)
    assert found.sum() == pytest.approx(expected.sum(), rel=3e-3)
    # The reflectance of an incident patch is that of the matrix, as Radiance states it.
    means = means_of_patches(file, basis, 12)
    np.testing.assert_allclose(means, values[:, 12], rtol=0.03)  # of 36 places a patch
    omega = solid_angles(basis)
    assert means @ omega == pytest.approx(values[:, 12] @ omega, rel=5e-3)


@pytest.mark.slow
def test_what_a_file_says_of_its_basis_counts(tmp_path):
    """Not its name: Radiance has changed what two names mean."""
    random = np.random.default_rng(9)
    for name, basis in (
        ("LBNL/Klems Half", OLD_HALF),
        ("LBNL/Klems Quarter", OLD_QUARTER),
        ("LBNL/Klems Full", SMALL),
        ("of my own", ((0, 20, 55, 80), (1, 6, 5))),
    ):
        count = sum(basis[1])
        values = random.uniform(0.1, 0.2, (count, count))
        file = write(tmp_path, bsdf(matrix(values, name), described=table(name, basis)))
        said = told(file)
        assert said["grid"] == f"{count} x {count} patches of light and view, {name}"
        assert said["highest"] == basis[0][-1]
        incident = count - 2
        means = means_of_patches(file, basis, incident)
        np.testing.assert_allclose(means, values[:, incident], rtol=0.03)
        if basis[0][-1] < 90:
            assert "nothing was measured beyond 80 degrees" in said["lacks"][0]


def test_names_that_have_two_meanings(tmp_path):
    """Without a description the number of patches tells, and a sentence where it does not."""
    for name, basis, sentence in (
        ("LBNL/Klems Half", OLD_HALF, False),
        ("LBNL/Klems Half", HALF, False),
        ("lbnl/klems quarter", QUARTER, True),
    ):
        count = sum(basis[1])
        said = told(write(tmp_path, bsdf(matrix(np.ones((count, count)), name))))
        assert said["grid"].startswith(f"{count} x {count} patches")
        assert any("not described" in note for note in said["notes"]) == sentence
    assert (
        "LBNL/Klems Quarter is not described: taken for that of Radiance since July 2022, with "
        "rings up to 9, 27, 45, 63, 90 degrees"
    ) in said["notes"]


def test_what_is_not_read_is_said(tmp_path):
    values = np.full((5, 5), 0.2)
    values[2, 3] = -1
    parts = [
        matrix(values, "s", direction, wavelength)
        for wavelength in ("Solar", "Visible")
        for direction in ("Transmission Front", "Reflection Back", "Reflection Front")
    ]
    file = write(tmp_path, small(*parts))
    notes = told(file)["notes"]
    assert notes[0] == (
        "Reflection Front is read, not Transmission Front, Reflection Back, the data for Solar"
    )
    assert notes[1] == "1 number is negative, 4 %: taken for 0"
    file = write(tmp_path, small(*parts[:5]))
    assert told(file)["notes"][0].startswith("Reflection Back is read, not Transmission Front")
    one = write(tmp_path, small(parts[5], "</Layer><Layer>", parts[5]))
    assert told(one)["notes"][-1] == "there are several layers: the first one is read"


def coloured(rgb, basis="s", names=("CIE-X", "Visible", "CIE-Z")):
    """Matrices of a surface that reflects this much of Radiance's red, green and blue."""
    return [
        matrix(np.full((5, 5), value / np.pi), basis, wavelength=name)
        for name, value in zip(names, XYZ_OF_RADIANCE @ rgb, strict=True)
    ]


def test_colours_are_those_of_radiance(tmp_path):
    """What genBSDF's matrix made of red, green and blue, with four digits."""
    wi, wo = hemisphere(10, 1, 0.1), hemisphere(10, 2, 0.1)
    for rgb in ((0.4, 0.4, 0.4), (0.6, 0.2, 0.1), (0.1, 0.3, 0.5)):
        file = write(tmp_path, small(*coloured(rgb)))
        found = np.pi * pairs(file, wi, wo)[0]
        np.testing.assert_allclose(found, np.broadcast_to(rgb, found.shape), rtol=3e-3)
        assert not any("grey" in note for note in told(file)["notes"])
    beyond = write(tmp_path, small(*coloured((-0.1, 0.2, 0.4))))
    assert (
        "25 cells have a colour outside Radiance's RGB, 100 %: negative channels are taken for 0"
    ) in told(beyond)["notes"]
    some = coloured((0.6, 0.2, 0.1))
    file = write(tmp_path, small(*some[:2]))
    assert "CIE-X is there and CIE-Z is not: without both the data are grey" in told(file)["notes"]
    assert len(set(pairs(file, wi, wo)[0][0])) == 1


@pytest.mark.parametrize("side", ["Front", "Back"])
@pytest.mark.parametrize("dimensions", [3, 4])
def test_trees_are_what_they_were_made_from(tmp_path, side, dimensions):
    tree = Tree(dimensions, 3, np.random.default_rng(dimensions))
    block = data(tree.text, f"Reflection {side}", basis=None)
    file = write(tmp_path, bsdf(block, structure=f"TensorTree{dimensions}"))
    incident, outgoing = cosine(3000, 1), cosine(3000, 2)
    wi, wo = to_world(side, incident, outgoing)
    expected = tree.at(tree_places(dimensions, incident, outgoing))
    found = pairs(file, wi, wo)[0]
    assert np.isclose(found, expected[:, None], rtol=1e-6).mean() > 0.999
    said = told(file)
    assert said["isotropic"] == (dimensions == 3) and said["highest"] == 90
    assert f"over {dimensions} dimensions" in said["grid"]
    assert said["notes"] == [f"Reflection {side} is read"]


def test_colours_of_trees(tmp_path):
    """u' and v' of CIE 1976, each a tree with cells of its own."""
    random = np.random.default_rng(4)
    trees = [Tree(3, 2, random), Tree(3, 1, random, 0.2, 0.22), Tree(3, 2, random, 0.465, 0.485)]
    names = ("Visible", "CIE-u", "CIE-v")
    blocks = [data(t.text, wavelength=n, basis=None) for t, n in zip(trees, names, strict=True)]
    file = write(tmp_path, bsdf(*blocks, structure="TensorTree3"))
    incident, outgoing = cosine(2000, 5), cosine(2000, 6)
    wi, wo = to_world("Front", incident, outgoing)
    y, u, v = (t.at(tree_places(3, incident, outgoing)) for t in trees)
    xyz = np.stack([y * 9 * u / (4 * v), y, y * (12 - 3 * u - 20 * v) / (4 * v)], -1)
    expected = xyz @ np.linalg.inv(XYZ_OF_RADIANCE).T
    found = pairs(file, wi, wo)[0]
    off = np.abs(found - np.maximum(expected, 0)).max(1)
    assert np.quantile(off, 0.999) < 2e-3 * expected.max()
    # 4/19 and 9/19 are grey; a tree that has no colour anywhere is, too.
    for u, v in (("{ 0.21052632 }", "{ 0.47368421 }"), ("{ 0 }", "{ 0 }")):
        blocks = [
            data(t, wavelength=n, basis=None) for t, n in zip(("{ 0.3 }", u, v), names, strict=True)
        ]
        grey = pairs(write(tmp_path, bsdf(*blocks, structure="TensorTree3")), wi[:5], wo[:5])[0]
        np.testing.assert_allclose(grey, 0.3, rtol=2e-4)


def test_text_in_other_encodings(tmp_path):
    text = small(matrix(np.ones((5, 5)), "s"), name="Gewebe,\n gr\u00fcn ")
    for encoding in ("utf-16", "utf-8-sig"):
        content = text.replace('encoding="UTF-8"', "").encode(encoding)
        assert told(write(tmp_path, content))["description"] == "Gewebe, gr\u00fcn, Weaver"
    latin = text.replace("UTF-8", "ISO-8859-1").encode("latin-1")
    assert told(write(tmp_path, latin))["description"] == "Gewebe, gr\u00fcn, Weaver"
    # Bytes that are no UTF-8, although the file says so.
    assert (
        told(write(tmp_path, text.encode("latin-1")))["description"] == "Gewebe, gr\ufffdn, Weaver"
    )


def test_a_scene_is_lit_by_the_data(tmp_path):
    file = write(tmp_path, small(*coloured((0.5, 0.3, 0.2))))
    content = scene(
        materials={"m": {"measured": file.name}}, environment={"color": [1, 1, 1]}, **PLANE
    )
    path = tmp_path / "s.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    done = run("render", path, "--out", tmp_path / "o.exr")
    assert done.returncode == 0, done.stderr
    assert "Reflection Front is read" in done.stderr
    import OpenImageIO as oiio

    pixels = oiio.ImageBuf(str(tmp_path / "o.exr")).get_pixels()[..., :3]
    np.testing.assert_allclose(pixels.mean((0, 1)), [0.5, 0.3, 0.2], rtol=0.04)


GOOD = small(matrix(np.ones((5, 5)), "s"))
TREE = bsdf(data("{ 1 }", basis=None), structure="TensorTree4")
#: Content, and what is said of it.
BAD = {
    "nothing": ("", "line 1: expected XML of Radiance or WINDOW, found an error: "),
    "text": ("theta,phi\n1,2\n", "expected XML of Radiance or WINDOW, found an error: "),
    "other": ("<scene version='3'/>", "with the element WindowElement, found scene"),
    "truncated": (GOOD[: len(GOOD) // 2], "truncated?"),
    "cut": (GOOD.replace("</WindowElement>", ""), "truncated?"),
    "layer": (
        GOOD.replace("Layer>", "Pane>"),
        "WindowElement: expected Optical with an element Layer",
    ),
    "structure": (
        GOOD.replace(">Columns<", ">Diagonal<"),
        "DataDefinition: IncidentDataStructure: expected Columns, Rows, TensorTree3 or "
        "TensorTree4, got 'Diagonal'",
    ),
    "no structure": (GOOD.replace("IncidentDataStructure", "Structure"), "TensorTree4, got ''"),
    "transmission": (
        GOOD.replace("Reflection Front", "Transmission Back"),
        "expected WavelengthData Visible, Reflection Front or Reflection Back, found Visible, "
        "Transmission Back",
    ),
    "solar": (GOOD.replace(">Visible<", ">Solar<"), "found Solar, Reflection Front"),
    "no data": (small(), "Reflection Back, found none"),
    "twice": (
        small(*[matrix(np.ones((5, 5)), "s")] * 2),
        "WavelengthData Visible, Reflection Front: expected once, found again",
    ),
    "basis": (
        GOOD.replace("ColumnAngleBasis>s<", "ColumnAngleBasis>t<"),
        "expected an AngleBasis with AngleBasisBlocks for 't', or one of LBNL/Klems Full, "
        "LBNL/Klems Half, LBNL/Klems Quarter; the file describes s",
    ),
    "rows": (
        GOOD.replace("<RowAngleBasis>s<", "<RowAngleBasis>LBNL/Klems Full<"),
        "RowAngleBasis: expected s, as for the columns of Visible, got 'LBNL/Klems Full'",
    ),
    "bounds": (
        GOOD.replace("<LowerTheta>40<", "<LowerTheta>50<"),
        "AngleBasis s: LowerTheta: expected 40, where the block before ends, got 50",
    ),
    "horizon": (GOOD.replace(">90<", ">95<"), "UpperTheta: expected more than 40 and up to 90"),
    "phis": (
        GOOD.replace("<nPhis>4<", "<nPhis>0<"),
        "AngleBasis s: nPhis: expected 1 to 360, got 0",
    ),
    "half": (
        GOOD.replace("<nPhis>4<", "<nPhis>4.5<"),
        "AngleBasis s: nPhis: expected a whole number, got '4.5'",
    ),
    "theta": (
        GOOD.replace("<UpperTheta>40<", "<UpperTheta>wide<"),
        "AngleBasis s: UpperTheta: expected a number, got 'wide'",
    ),
    "few": (
        small(matrix(np.ones((5, 4)), "s")),
        "ScatteringData: expected 5 x 5 numbers, because s has 5 patches, found 20: truncated?",
    ),
    "many": (
        small(matrix(np.ones((5, 6)), "s")),
        "ScatteringData: expected 5 x 5 numbers, because s has 5 patches, found 30\n",
    ),
    "none": (
        small(data(" ", basis="s")),
        "Reflection Front: ScatteringData: expected numbers, found none",
    ),
    "nan": (
        small(
            matrix(np.where(np.arange(25).reshape(5, 5) == 7, np.nan, 1), "s"),
        ),
        "ScatteringData: number 8: expected a finite number up to 1e+30, got 'nan'",
    ),
    "word": (
        GOOD.replace("\n1,", "\n1,red,", 1),
        "number 2: expected a finite number up to 1e+30, got 'red'",
    ),
    "brace": (
        GOOD.replace("\n1,", "\n1,{", 1),
        "number 2: expected a finite number up to 1e+30, got ''",
    ),
    "black": (
        small(matrix(np.zeros((5, 5)), "s")),
        "expected a number above 0, found none: the data are black",
    ),
    "tree": (TREE.replace("{ 1 }", "{ 1 2 }"), "expected 1, 16, 256 or so numbers in braces"),
    "open": (
        TREE.replace("{ 1 }", "{ 1"),
        "expected '}' after 1 number, found the end: truncated?",
    ),
    "tree's basis": (
        TREE.replace("LBNL/Shirley-Chiu", "LBNL/Klems Full"),
        "AngleBasis: expected LBNL/Shirley-Chiu, got 'LBNL/Klems Full'",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_in_a_file_is_said(tmp_path, name):
    content, expected = BAD[name]
    file = write(tmp_path, content)
    done = run("measured", file)
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert str(file) in done.stderr and expected in done.stderr, done.stderr
    assert done.stdout == ""
