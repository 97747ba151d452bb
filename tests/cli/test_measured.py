# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured BRDFs: files of every format, made from functions, are read as what they were made from;
what is wrong in one is said in a line, and so is what data lack."""

import io
import json
import re
import struct
import subprocess
import sys

import numpy as np
import pytest
from measured_files import (
    GOLDEN,
    KINDS,
    alta,
    facets,
    golden_directions,
    hemisphere,
    rgl_fields,
    utia,
    utia_directions,
)
from measured_formats import above, merl, merl_directions, tensor, unit
from support import ROOT, TOOL, run, scene

COLUMNS = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z"


def eval_pairs(arguments, wi, wo):
    """What a command of the tool prints for pairs of directions."""
    # All rows at once: Python took longer to print them than the tool to answer.
    rows = np.hstack([wi, wo])
    text = ("%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n" * len(rows)) % tuple(rows.ravel().tolist())
    command = [TOOL, *arguments]
    done = subprocess.run(command, input=f"{COLUMNS}\n{text}", capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return np.loadtxt(io.StringIO(done.stdout), delimiter=",", skiprows=1, ndmin=2)


def pairs(file, wi, wo):
    """f (N, 3) and pdf (N,) as the tool has them."""
    found = eval_pairs(["measured", str(file), "--pairs"], wi, wo)
    return found[:, :3], found[:, 3]


def told(file):
    done = run("measured", file, "--json", "--models", "none")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def glossy(wi, wo, exponent=30):
    """Blinn's lobe over a matte base, in three colours; reciprocal."""
    h = unit(wi + wo)
    lobe = np.clip(h[:, 2], 0, 1) ** exponent
    return above(wi, wo) * (np.array([0.1, 0.05, 0.02]) + lobe[:, None] * np.array([0.5, 0.6, 0.7]))


def brushed(wi, wo):
    """Anisotropic, and not reciprocal."""
    h = unit(wi + wo)
    lobe = np.exp(-6 * h[:, 0] ** 2 - 2 * h[:, 1] ** 2) * (1 + 0.3 * wi[:, 0])
    return above(wi, wo) * (0.05 + lobe[:, None] * np.array([0.2, 0.15, 0.1]))


@pytest.fixture(scope="module")
def merl_file(tmp_path_factory):
    file = tmp_path_factory.mktemp("merl") / "glossy.binary"
    file.write_bytes(merl(glossy(*merl_directions())))
    return file


def test_merl_is_what_it_was_made_from(merl_file):
    """Between the entries by interpolation, whose error is an eighth of the lobe's curvature times
    the squared distance of 2 degrees; for any azimuth, and with light and view swapped."""
    wi, wo = hemisphere(2000, 1, 0.1), hemisphere(2000, 2, 0.1)
    found, _ = pairs(merl_file, wi, wo)
    np.testing.assert_allclose(found, glossy(wi, wo), rtol=5e-3)
    np.testing.assert_allclose(pairs(merl_file, wo, wi)[0], found, rtol=1e-9)


def test_merl_entries_are_in_their_places(merl_file):
    """Each entry is a number of its own, which the tool gives back in the middle of its cell."""
    wi, wo = merl_directions()
    f = np.stack([1 + np.arange(len(wi)), 0.5 + np.arange(len(wi)), 0.25 * np.arange(len(wi))], -1)
    file = merl_file.parent / "counted.binary"
    file.write_bytes(merl(f))
    some = np.random.default_rng(3).permutation(np.flatnonzero(above(wi, wo).ravel()))[:3000]
    np.testing.assert_allclose(pairs(file, wi[some], wo[some])[0], f[some], rtol=1e-6)


def test_merl_is_read_in_two_seconds(merl_file):
    found = told(merl_file)
    assert found["format"] == "MERL" and found["isotropic"] and found["seconds"] < 2
    assert found["notes"] == [] and found["lacks"] == [] and found["non_reciprocal"] < 1e-6
    # The base reflects pi times its value, and the lobe of Blinn more.
    at_normal = found["albedo"][0]["rgb"]
    assert np.pi * 0.1 < at_normal[0] < np.pi * 0.1 + 0.5 and found["albedo"][0]["degrees"] == 0


@pytest.mark.slow
def test_holes_are_filled_from_beside_them(merl_file):
    wi, wo = merl_directions()
    f = glossy(wi, wo)
    holes = np.random.default_rng(4).uniform(size=len(f)) < 0.2
    f[holes] = -1
    dark = np.flatnonzero(~holes & above(wi, wo).ravel())[:50]
    f[dark, 2] = -0.001
    file = merl_file.parent / "holes.binary"
    file.write_bytes(merl(f))
    notes = told(file)["notes"]
    share = holes[above(wi, wo).ravel()].mean()
    assert len(notes) == 2 and f"{100 * share:.2g} %: not measured" in notes[0]
    assert notes[1].startswith("50 entries are negative in one channel or two")
    i, o = hemisphere(500, 5, 0.2), hemisphere(500, 6, 0.2)
    found, _ = pairs(file, i, o)
    near = np.isclose(found, glossy(i, o), rtol=0.05, atol=2e-3).all(-1)
    assert near.mean() > 0.97 and (found >= 0).all()


def at_half_angles(theta_h, theta_d, phi_d):
    """wi and wo with these angles, in degrees, of a half vector with azimuth 0."""
    theta_h, theta_d, phi_d = np.broadcast_arrays(theta_h, theta_d, phi_d)
    rest = 0 * theta_h
    view, light = half_directions(*(np.radians(a).ravel() for a in (theta_h, rest, theta_d, phi_d)))
    return view, light


def microfacets(wi, wo, roughness=0.3, f0=0.04):
    """GGX over a matte base."""
    h = unit(wi + wo)
    masked = sum(
        (np.sqrt(1 + roughness**2 * (1 / np.maximum(w[:, 2], 1e-4) ** 2 - 1)) - 1) / 2
        for w in (wi, wo)
    )
    d = roughness**2 / (np.pi * (h[:, 2] ** 2 * (roughness**2 - 1) + 1) ** 2)
    fresnel = f0 + (1 - f0) * (1 - np.clip((wi * h).sum(-1), 0, 1)) ** 5
    cosines = np.maximum(wi[:, 2], 1e-4) * np.maximum(wo[:, 2], 1e-4)
    lobe = fresnel * d / (1 + masked) / (4 * cosines)
    return above(wi, wo) * (np.array([0.15, 0.03, 0.015]) + lobe[:, None])


@pytest.mark.slow
def test_gaps_of_many_cells_are_filled_whole(tmp_path):
    """The value where the measurement ends holds beyond; a gap inside is crossed linearly. Cells
    below the horizon are no part of it."""
    wi, wo = merl_directions()
    h, d, p = (a.ravel() for a in np.meshgrid(*map(np.arange, (90, 90, 180)), indexing="ij"))
    known = (1 + d / 90)[:, None] * np.array([0.3, 0.2, 0.1])
    file = tmp_path / "m.binary"

    def read(missing, *angles):
        f = np.where(above(wi, wo), known, -1)
        f[missing] = -1
        file.write_bytes(merl(f))
        light, view = at_half_angles(*angles)
        return pairs(file, light, view)[0] / [0.3, 0.2, 0.1]

    # The middle of cell 59 is at 59.5 degrees.
    at = np.array([59.5, 61, 70, 80, 89])
    np.testing.assert_allclose(read(d >= 60, 0.5, at, 90.5), 1 + 59 / 90, rtol=1e-6)
    np.testing.assert_allclose(read(d < 20, 0.5, [0.5, 10, 20.5], 30), 1 + 20 / 90, rtol=1e-6)
    between = read((d > 20) & (d < 50), 10, [20.5, 30.5, 35.5, 50.5], 90.5)
    np.testing.assert_allclose(between[:, 0], 1 + np.array([20, 30, 35, 50]) / 90, rtol=1e-6)
    # Rows that lack everything, and planes.
    for missing in (h < 20, (h < 20) & (p > 90), (p > 20) & (p < 120), (h > 30) & (p < 90)):
        found = read(missing, [[0], [10]], [[20.5, 40.5]], 60.5)
        np.testing.assert_allclose(found[:, 0], 1 + np.array([20, 40] * 2) / 90, rtol=1e-6)
    (note,) = told(file)["notes"]
    assert "not measured, filled along theta_d; where a row has nothing, along phi_d" in note


def test_a_model_is_found_in_spite_of_a_gap(tmp_path):
    """What was not measured is no darkness to which the model is fitted."""
    wi, wo = merl_directions()
    f = np.where(above(wi, wo), microfacets(wi, wo), -1)
    h = unit(wi + wo)
    f[(wi * h).sum(-1) < np.cos(np.radians(60))] = -1
    file = tmp_path / "m.binary"
    file.write_bytes(merl(f))
    done = run("measured", file, "--json", "--models", "microfacet")
    (fit,) = json.loads(done.stdout)["fits"]
    assert fit["error"] < 0.02
    assert fit["parameters"]["f0"] == pytest.approx([0.04] * 3, rel=0.03)
    assert fit["parameters"]["ax"] == pytest.approx(0.3, rel=0.02)


def test_gaps_of_alta_are_filled_whole(tmp_path):
    axes = np.radians(range(0, 81, 10)), np.radians(range(0, 91, 10)), np.radians(range(0, 181, 15))
    th, td, pd = (a.ravel() for a in np.meshgrid(*axes, indexing="ij"))
    f = np.where(td > 1, -1, 0.3 + 0.1 * td)
    file = tmp_path / "m.alta"
    file.write_text(alta("RUSIN_TH_TD_PD", "INV_STERADIAN", th, td, pd, f))
    light, view = at_half_angles(0, [50, 60, 75, 85], 90)
    np.testing.assert_allclose(pairs(file, light, view)[0], 0.3 + 0.1 * np.radians(50), rtol=1e-6)
    assert any("not measured, filled along theta_d" in note for note in told(file)["notes"])


@pytest.mark.parametrize("kind", KINDS)
def test_rgl_files_are_what_mitsuba_makes_of_them(tmp_path, kind):
    """measured_files.py wrote what Mitsuba's plug-in says: f times the cosine."""
    file = tmp_path / "m.bsdf"
    file.write_bytes(tensor(rgl_fields(kind)))
    rows = [line.split(",") for line in GOLDEN.read_text(encoding="utf-8").splitlines()]
    golden = np.array([row[1:] for row in rows if row[0] == kind], float)
    light, view = golden_directions(kind)
    np.testing.assert_allclose(golden[:, :6], np.hstack([light, view]), atol=1e-8)
    expected = golden[:, 6:]
    if kind == "spectral":
        table = np.genfromtxt(ROOT / "data/color/observer.csv", delimiter=",", names=True)
        weights = np.stack([table[c] * table["d65"] for c in "xyz"], -1)
        white = weights.sum(0) / weights.sum(0)[1]
        # IEC 61966-2-1, whose white is D65 with four digits.
        to_rgb = np.linalg.inv(
            [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
        )
        xyz = expected @ (weights / weights.sum(0)) * white
        expected = xyz @ to_rgb.T
        tolerance = {"rtol": 2e-3}
    else:
        tolerance = {"rtol": 1e-4}
    found, _ = pairs(file, light, view)
    np.testing.assert_allclose(found * light[:, 2:], expected, atol=1e-7, **tolerance)
    said = told(file)
    assert said["isotropic"] == (kind in ("isotropic", "spectral"))
    assert said["description"] == "Made up" and said["highest"] == pytest.approx(88)
    assert any("nothing was measured beyond 88" in s for s in said["lacks"])


def test_utia_is_what_it_was_made_from(tmp_path):
    file = tmp_path / "m.bin"
    wi, wo = utia_directions()
    file.write_bytes(utia(brushed(wi, wo)))
    some = np.random.default_rng(8).integers(0, len(wi), 500)
    found, _ = pairs(file, wi[some], wo[some])
    np.testing.assert_allclose(found, brushed(wi[some], wo[some]), rtol=1e-6)
    i, o = hemisphere(500, 9, 0.3), hemisphere(500, 10, 0.3)
    assert np.abs(pairs(file, i, o)[0] - brushed(i, o)).mean() < 0.02 * brushed(i, o).mean()
    said = told(file)
    assert not said["isotropic"] and said["highest"] == 75 and said["non_reciprocal"] > 0.02
    assert any("not reciprocal" in s for s in said["lacks"])


def angles(w):
    return np.degrees(np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2])), np.degrees(
        np.arctan2(w[:, 1], w[:, 0])
    )


def grid(*axes):
    out = np.meshgrid(*map(np.asarray, axes), indexing="ij")
    return [a.ravel().astype(float) for a in out]


def vector(theta, phi):
    theta, phi = np.radians(theta), np.radians(phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def angle_table(*columns):
    rows = "\n".join(",".join(f"{x:.9g}" for x in row) for row in zip(*columns, strict=True))
    return "theta_i,phi_i,theta_o,phi_o,r,g,b\n" + rows + "\n"


@pytest.mark.many
@pytest.mark.parametrize("options", [[], ["--lobes", "2"], ["--models", "ward"]])
def test_nothing_is_fitted_to_a_few_rows(tmp_path, options):
    """Fits of all models, which take longest, are made of larger tables in other tests."""
    file = tmp_path / "m.csv"
    angles = [0, 10, 20, 30, 40, 50, 60, 70, 80]
    for lights, views, enough in (
        ([0], [0], False),
        (angles[:3], angles[:5], False),
        *([([0, 45], angles, True)] if options else []),
    ):
        axes = grid(lights, [0], views, [0])
        one = np.ones(len(axes[0]))
        file.write_text(angle_table(*axes, one, one, one), encoding="utf-8")
        done = run("measured", file, *options)
        assert done.returncode == (0 if enough else 2), done.stderr
        said = f"at least 16 pairs of directions to fit something to, found {len(one)}"
        assert enough or said in done.stderr
        assert run("measured", file, "--models", "none").returncode == 0


def test_a_table_is_what_it_was_made_from(tmp_path):
    file = tmp_path / "m.csv"
    ti, pi, to, po = grid(range(0, 86, 5), [0], range(0, 86, 5), range(0, 181, 10))
    f = glossy(vector(ti, pi), vector(to, po), exponent=4)
    file.write_text(angle_table(ti, pi, to, po, *f.T), encoding="utf-8")
    said = told(file)
    assert said["isotropic"] and said["format"] == "CSV" and "mirror image" in said["notes"][0]
    # As Windows names it, and its programs write it.
    windows = tmp_path / "W.CSV"
    windows.write_text(file.read_text(), encoding="utf-8-sig", newline="\r\n")
    assert told(windows)["albedo"] == said["albedo"]
    i, o = hemisphere(500, 11, 0.1), hemisphere(500, 12, 0.1)
    expected = glossy(i, o, exponent=4)
    assert np.abs(pairs(file, i, o)[0] - expected).mean() < 0.01 * expected.mean()
    at_nodes = slice(0, None, 7)
    i, o = vector(ti, pi)[at_nodes], vector(to, po)[at_nodes]
    np.testing.assert_allclose(pairs(file, i, o)[0], f[at_nodes], rtol=1e-6)
    # Turned as a whole, and the mirror image.
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    for a, b in ((i @ turn, o @ turn), (i * [1, -1, 1], o * [1, -1, 1])):
        np.testing.assert_allclose(pairs(file, a, b)[0], f[at_nodes], rtol=1e-5)
    # Anisotropic, as vectors; the azimuth of a direction along the normal stands once.
    ti, pi, to, po = grid(range(0, 81, 20), range(0, 360, 30), range(0, 81, 20), range(0, 360, 30))
    once = ((ti > 0) | (pi == 0)) & ((to > 0) | (po == 0))
    i, o = vector(ti, pi)[once], vector(to, po)[once]
    text = COLUMNS + ",r,g,b\n"
    for row in np.hstack([i, o, brushed(i, o)]):
        text += ",".join(f"{x:.9g}" for x in row) + "\n"
    file.write_text(text, encoding="utf-8")
    assert not told(file)["isotropic"]
    np.testing.assert_allclose(pairs(file, i, o)[0], brushed(i, o), rtol=1e-6)


def test_unit_vectors_of_six_digits(tmp_path):
    """Rounding makes angles different that were the same."""
    ti, pi, to, po = grid(range(0, 81, 20), range(0, 360, 30), range(0, 81, 20), range(0, 360, 30))
    i, o = vector(ti, pi), vector(to, po)
    file = tmp_path / "m.csv"
    text = COLUMNS + ",r,g,b\n"
    for row in np.hstack([i, o, brushed(i, o)]):
        text += ",".join(f"{x:.6f}" for x in row) + "\n"
    file.write_text(text, encoding="utf-8")
    said = told(file)
    assert said["grid"] == "5 x 12 directions of light, 5 x 12 of view" and said["notes"] == []
    np.testing.assert_allclose(pairs(file, i, o)[0], brushed(i, o), rtol=1e-3, atol=2e-6)


def test_what_a_table_leaves_out_is_said(tmp_path):
    file = tmp_path / "m.csv"

    def notes(*axes, change=None):
        ti, pi, to, po = grid(*axes)
        f = 0 * ti + 0.2
        if change is not None:
            f[change(ti, pi, to, po)] *= 1.5
        file.write_text(angle_table(ti, pi, to, po, f, f, f), encoding="utf-8")
        return told(file)["notes"]

    theta, circle = [0, 30, 60], range(0, 360, 30)
    assert notes(theta, circle, theta, circle) == []
    assert notes(theta, circle, theta, [*circle, 360]) == []
    (said,) = notes(theta, range(0, 91, 30), theta, circle)
    assert said == "phi_i: nothing was measured from 90 to 360 degrees: linear between these"
    (said,) = notes(theta, [0], theta, range(0, 271, 30))
    assert said == "phi_o: nothing was measured from 270 to 360 degrees: linear between these"
    _, said = notes(theta, [0], theta, range(0, 151, 30))
    assert said == "phi_o: measured from 0 to 150 degrees: the values at these ends hold beyond"
    (said,) = notes([10, 30], circle, theta, circle)
    assert said == "theta_i begins at 10 degrees: its values there hold below"
    (said,) = notes(
        theta, circle, theta, circle, change=lambda ti, pi, to, po: (ti == 0) & (pi == 90)
    )
    # Rows that say the same twice are one.
    file.write_text(file.read_text() + file.read_text().partition("\n")[2])
    assert told(file)["notes"] == [said]
    assert said.startswith("rows of one direction along the normal differ by up to 48 %")


def test_azimuths_that_are_far_apart_are_told(tmp_path):
    """A goniometer that measures the plane of incidence alone tells nothing of what is beside it;
    data that don't depend on azimuth lose nothing."""
    theta, told_of = [0, 30, 60], {}
    for kind, bend in (("constant", 0), ("plane", 1)):
        for azimuths in ([0, 180], [0, 60, 180], [0, 90, 180], [0, 120, 240], [0, 60, 180, 240]):
            ti, pi, to, po = grid(theta, [0], theta, azimuths)
            bent = np.sin(np.radians(ti)) * np.sin(np.radians(to)) * np.cos(np.radians(po))
            f = 0.2 + 0.1 * bend * bent
            file = tmp_path / "m.csv"
            file.write_text(angle_table(ti, pi, to, po, f, f, f), encoding="utf-8")
            notes = [n for n in told(file)["notes"] if "nothing was measured" in n]
            told_of[kind, *azimuths] = notes
    assert not any(notes for (kind, *_), notes in told_of.items() if kind == "constant")
    start, end = "phi_o: nothing was measured from ", " degrees: linear between these"
    assert told_of["plane", 0, 180] == [f"{start}0 to 180{end}"]
    assert told_of["plane", 0, 60, 180] == [f"{start}60 to 180{end}"]
    assert told_of["plane", 0, 90, 180] == []
    assert told_of["plane", 0, 120, 240] == [
        f"{start}0 to 120, from 120 to 240, from 240 to 360{end}"
    ]
    assert told_of["plane", 0, 60, 180, 240] == [f"{start}60 to 180, from 240 to 360{end}"]
    # ALTA's azimuths of the light from the view, and those of the view about the half vector.
    tv, tl, dp = (a.ravel() for a in np.meshgrid(*np.radians([theta, theta, [0, 60, 180]])))
    file = tmp_path / "m.alta"
    f = 0.2 + 0.1 * np.sin(tv) * np.cos(dp)
    file.write_text(alta("ISOTROPIC_TV_TL_DPHI", "INV_STERADIAN", tv, tl, dp, f))
    assert f"{start}60 to 180{end}" in told(file)["notes"]
    file.write_text(alta("RUSIN_TH_TD_PD", "INV_STERADIAN", tv, tl, dp, 0.2 + 0 * f))
    assert not any("nothing was measured" in note for note in told(file)["notes"])
    f = 0.2 + 0.1 * np.sin(tl) * np.cos(2 * dp)
    file.write_text(alta("RUSIN_TH_TD_PD", "INV_STERADIAN", tv, tl, dp, f))
    assert f"phi_d: nothing was measured from 60 to 180{end}" in told(file)["notes"]


def test_headers_are_read_as_programs_write_them(tmp_path):
    """Quotes, capitals, spaces, byte order mark and CR LF; other columns are named."""
    file = tmp_path / "m.csv"
    ti, pi, to, po = grid([0, 30, 60], [0], [0, 30, 60], range(0, 181, 30))
    f = 0.1 + ti / 900
    text = angle_table(ti, pi, to, po, f, f, f)
    file.write_text(text, encoding="utf-8")
    plain = told(file)
    _, *rows = text.splitlines()
    header = '"Theta_I" , PHI_I,"theta_o","phi_o",  R ,"G",b'
    file.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8-sig", newline="\r\n")
    assert told(file)["albedo"] == plain["albedo"] and told(file)["notes"] == plain["notes"]
    # As numpy.savetxt writes headers, and with comments anywhere.
    lines = ["# a felt", f"# {header}", "", *rows[:2], "#", " # 30 degrees", *rows[2:]]
    file.write_text("\n".join(lines), encoding="utf-8-sig")
    assert told(file)["albedo"] == plain["albedo"] and told(file)["notes"] == plain["notes"]
    rows = [f'"{row.split(",")[0]}",{row.split(",", 1)[1]},"a, b",7' for row in rows]
    file.write_text("\n".join([f"{header},Sample,Run", *rows]), encoding="utf-8")
    said = told(file)
    assert said["albedo"] == plain["albedo"]
    assert said["notes"][0] == "columns are not known and not read: sample, run"
    file.write_text("\n".join([f"{header},r", *rows]), encoding="utf-8")
    done = run("measured", file)
    assert done.returncode == 2 and "line 1: expected one column r, found several" in done.stderr


def test_every_model_is_fitted_to_data_that_are_almost_black(tmp_path):
    """Light of a single pair of directions at the horizon, which samples do not find."""
    file = tmp_path / "black.csv"
    axes = grid([*range(0, 90, 15), 89.9999, 90], [0], [*range(0, 90, 15), 89.9999, 90], [0, 180])
    f = np.where((axes[0] == 90) & (axes[2] == 90), 0.1, 0)
    file.write_text(angle_table(*axes, f, f, f), encoding="utf-8")
    done = run("measured", file, "--json", "--models", "lambert,factors,microfacet")
    assert done.returncode == 0, done.stderr
    fits = {fit["model"]: fit for fit in json.loads(done.stdout)["fits"]}
    assert fits["factors"]["error"] == 0 and fits["lambert"]["error"] == 0


def test_why_a_model_stands_below_one_with_a_larger_error_is_said(tmp_path):
    """The light of a mirror, which data do not hold, counts in the order alone; and none of less
    than 0.005 % is worth a word."""
    file = tmp_path / "m.csv"
    ti, pi, to, po = grid(range(0, 86, 15), [0], range(0, 86, 15), range(0, 181, 15))

    def printed(f, models):
        file.write_text(angle_table(ti, pi, to, po, f, f, f), encoding="utf-8")
        done = run("measured", file, "--models", models)
        assert done.returncode == 0, done.stderr
        lines = done.stdout.partition("  error  ")[2].splitlines()[1:]
        rows = [re.match(r"  (\w+) +([\d.]+) %", line) for line in lines]
        return [(row[1], float(row[2])) for row in rows if row], lines

    wi, wo = vector(ti, pi), vector(to, po)
    rows, lines = printed(2 * glossy(wi, wo, 4)[:, 2], "schlick,lambert")
    assert [model for model, _ in rows] == ["lambert", "schlick"] and rows[0][1] > rows[1][1]
    assert "its mirror" in lines[1]
    assert lines[2:] == [
        "  the order counts the light of a mirror as an error, which the column does not"
    ]
    rim = 0.05 + 0.2 * (1 - unit(wi + wo)[:, 2] ** 2)
    rows, lines = printed(rim, "lambert,oren_nayar,coupled")
    assert [model for model, _ in rows] == ["oren_nayar", "lambert", "coupled"]
    assert len(lines) == 3 and "mirror" not in lines[2], lines


def test_a_table_is_read_however_its_text_is_written(tmp_path):
    file = tmp_path / "m.csv"
    axes = grid(range(0, 91, 15), [0], range(0, 91, 15), range(0, 181, 15))
    f = 0.1 + axes[0] / 900
    text = angle_table(*axes, f, f, f)
    found = []
    for data in (text.encode(), text.replace("\n", "\r").encode(), text.encode("utf-16")):
        file.write_bytes(data)
        found.append({k: v for k, v in told(file).items() if k != "seconds"})
    assert found[0] == found[1] == found[2]


def test_radians_are_named_or_refused(tmp_path):
    file = tmp_path / "m.csv"
    axes = grid(range(0, 91, 15), [0], range(0, 91, 15), range(0, 181, 15))
    f = 0.1 + axes[0] / 900
    file.write_text(angle_table(*axes, f, f, f), encoding="utf-8")
    in_degrees = told(file)
    text = angle_table(*(np.round(np.radians(a), 4) for a in axes), f, f, f)
    file.write_text(text, encoding="utf-8")
    done = run("measured", file)
    assert done.returncode == 2 and "expected degrees, and the largest is 1.57" in done.stderr
    assert "theta_i_rad,phi_i_rad,theta_o_rad,phi_o_rad for angles in radians" in done.stderr
    head = "theta_i,phi_i,theta_o,phi_o"
    named = text.replace(head, head.replace("_i", "_i_rad").replace("_o", "_o_rad"))
    file.write_text(named, encoding="utf-8")
    assert told(file)["albedo"] == in_degrees["albedo"]
    assert told(file)["grid"] == in_degrees["grid"]
    file.write_text(named.replace("\n0.2618,", "\n2.5,", 1), encoding="utf-8")
    done = run("measured", file)
    assert done.returncode == 2
    assert "theta_i_rad: expected radians from 0 to pi/2, got 2.5" in done.stderr
    file.write_text(text.replace(head, head.replace("_i", "_i_deg").replace("_o", "_o_deg")))
    assert any("nothing was measured beyond 1.57" in s for s in told(file)["lacks"])
    # Few small angles may be degrees.
    axes = grid([0, 1], [0], [0, 1], [0, 3])
    file.write_text(angle_table(*axes, *(0 * axes[0] + 0.2,) * 3), encoding="utf-8")
    assert told(file)["highest"] == 1


def test_more_light_than_comes_is_said(tmp_path):
    file = tmp_path / "m.csv"
    ti, pi, to, po = grid([0, 45, 90], [0], [0, 45, 90], [0, 90, 180])
    file.write_text(angle_table(ti, pi, to, po, *(0 * ti + 0.5,) * 3), encoding="utf-8")
    said = told(file)
    for view in said["albedo"]:
        assert view["rgb"] == pytest.approx([np.pi / 2] * 3, rel=0.01)
    assert any(re.search(r"more light than it gets: 1\.5[678] times", s) for s in said["lacks"])


def changed(**fields):
    """A .bsdf file with other fields; None leaves one out."""
    return tensor({k: v for k, v in (rgl_fields("isotropic") | fields).items() if v is not None})


def with_nan(array):
    array = array.copy()
    array.ravel()[5] = np.nan
    return array


RGL = rgl_fields("isotropic")
FLAT = np.zeros((90 * 90 * 180, 3))
SPHERICAL = b"#DIM 4 3\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT RGB_COLOR\n"
#: Nothing that was measured is reflected.
DARK = np.where(np.arange(len(FLAT))[:, None] % 2, -1.0, 0.0) + FLAT
#: File name, content, and what is said of it.
BAD = {
    "empty.binary": (b"", "header: expected 3 numbers"),
    "short.binary": (merl(FLAT + 1)[:-8], "expected 34992012 bytes"),
    "long.binary": (merl(FLAT + 1) + b"\0", "expected 34992012 bytes"),
    "size.binary": (struct.pack("<3i", 90, 90, 360), "expected 90 x 90 x 180 values"),
    "nan.binary": (merl(np.where(np.arange(len(FLAT))[:, None] == 7, np.nan, 1) + FLAT), "entry 7"),
    "holes.binary": (merl(FLAT - 1), "expected values above the horizon, found none"),
    "short.bin": (bytes(1000), "expected 1990656 bytes"),
    "float.binary": (
        merl(FLAT + 1)[:12] + np.ones(FLAT.size, np.float32).tobytes(),
        "got 17496012: are these numbers in single precision?",
    ),
    "turned.binary": (struct.pack(">3i", 90, 90, 180), "the byte order is reversed"),
    "half_turned.binary": (
        merl(FLAT)[:12] + np.full(FLAT.size, 0.7, ">f8").tobytes(),
        "is the byte order reversed?",
    ),
    "nan.bin": (utia(np.full((288 * 288, 3), np.nan)), "column 0: expected finite numbers"),
    "turned.bin": (np.full(288 * 288 * 3, 0.7, ">f8").tobytes(), "is the byte order reversed?"),
    "float.bin": (
        np.ones(288 * 288 * 3, np.float32).tobytes(),
        "got 995328: are these numbers in single precision?",
    ),
    "not.bsdf": (bytes(1000), "expected a tensor file"),
    "short.bsdf": (changed()[:-1], "truncated?"),
    "head.bsdf": (changed()[:40], "truncated?"),
    "version.bsdf": (tensor(RGL, version=(2, 0)), "version: expected 1.0, got 2.0"),
    "no_vndf.bsdf": (changed(vndf=None), "vndf: expected this field"),
    "no_rgb.bsdf": (changed(rgb=None), "rgb: expected this field"),
    "double.bsdf": (changed(ndf=RGL["ndf"].astype(float)), "ndf: expected numbers of type float32"),
    "dims.bsdf": (changed(sigma=RGL["sigma"][0]), "sigma: expected 2 dimensions, got 1"),
    "nan.bsdf": (changed(ndf=with_nan(RGL["ndf"])), "ndf: expected finite numbers, got nan at 5"),
    "negative.bsdf": (changed(vndf=-RGL["vndf"]), "vndf: expected no number below 0"),
    "empty.bsdf": (changed(vndf=0 * RGL["vndf"]), "vndf: expected a number above 0 in each slice"),
    "slices.bsdf": (changed(theta_i=RGL["theta_i"][:-1]), "vndf: expected 6 slices"),
    "order.bsdf": (changed(theta_i=RGL["theta_i"][::-1].copy()), "theta_i: expected increasing"),
    "degrees.bsdf": (changed(theta_i=10 * RGL["theta_i"]), "theta_i: expected radians"),
    "rgb.bsdf": (changed(rgb=RGL["rgb"][:, :, :2]), "rgb: expected 1 x 7 x 3 x n x n numbers"),
    "infrared.bsdf": (
        changed(spectra=RGL["rgb"], rgb=None, wavelengths=np.array([800, 900, 1000], np.float32)),
        "wavelengths: expected 430 to 650 nm",
    ),
    "empty.csv": (b"", "expected a header with the columns theta_i"),
    "columns.csv": (b"theta_i,phi_i\n0,0\n", "expected a header with the columns theta_i"),
    "rows.csv": (b"theta_i,phi_i,theta_o,phi_o,r,g,b\n", "expected rows below the header"),
    "angle.csv": (
        b"theta_i,phi_i,theta_o,phi_o,r,g,b\n95,0,0,0,1,1,1\n",
        "line 2: theta_i: expected",
    ),
    "twice.csv": (
        b"theta_i,phi_i,theta_o,phi_o,r,g,b\n10,0,10,0,1,1,1\n\n10,0,10,0,1,1,2\n",
        "line 4: expected each combination of angles once, or the same values: "
        "theta_i 10, phi_i 0, theta_o 10, phi_o 0 is in line 2, too\n",
    ),
    "pole.csv": (
        b"theta_i,phi_i,theta_o,phi_o,r,g,b\n0,0,10,0,1,1,1\n0,0,10,0,1,1,2\n",
        "line 3: expected each combination of angles once, or the same values: "
        "theta_i 0, phi_i 0, theta_o 10, phi_o 0 is in line 2, too\n",
    ),
    "turn.csv": (
        b"theta_i,phi_i,theta_o,phi_o,r,g,b\n10,0,10,0,1,1,1\n10,360,10,0,1,1,2\n",
        "phi_o 0 is in line 2, too: azimuths a full turn apart are the same",
    ),
    "black.binary": (merl(FLAT), "expected a number above 0, found none: the data are black"),
    "dark.binary": (merl(DARK), "expected a number above 0, found none: the data are black"),
    "black.bin": (utia(np.zeros((288 * 288, 3))), "expected a number above 0, found none"),
    "black.bsdf": (changed(rgb=0 * RGL["rgb"]), "expected a number above 0, found none: the data"),
    "ndf.bsdf": (changed(ndf=0 * RGL["ndf"]), "ndf: expected a number above 0, found none"),
    "black.csv": (
        b"theta_i,phi_i,theta_o,phi_o,r,g,b\n10,0,10,0,0,0,0\n10,0,10,90,0,-1,0\n",
        "black.csv: expected a number above 0, found none: the data are black",
    ),
    "semicolons.csv": (
        b"theta_i;phi_i;theta_o;phi_o;r;g;b\n10;0;10;0;1;1;1\n",
        "line 1: expected fields separated by commas, got semicolons",
    ),
    "tabs.csv": (
        b"theta_i\tphi_i\ttheta_o\tphi_o\tr\tg\tb\n",
        "line 1: expected fields separated by commas, got tabs",
    ),
    "gap.csv": (
        b"theta_i,phi_i,theta_o,phi_o,r,g,b\n10,0,10,0,1,1,1\n20,0,20,0,1,1,1\n10,0,20,0,1,1,1\n",
        "1 is missing, the first theta_i 20, phi_i 0, theta_o 10, phi_o 0",
    ),
    "text.csv": (b"theta_i,phi_i,theta_o,phi_o,r,g,b\n0,0,0,0,1,1,red\n", "b: expected a finite"),
    "empty.alta": (b"", "expected a line #DIM with the numbers of coordinates and values of a row"),
    "none.alta": (SPHERICAL + b"\n", "expected rows below the header, found none"),
    "unknown.dat": (
        SPHERICAL.replace(b"SPHERICAL_TL_PL_TV_PV", b"STARK_3D") + b"0 0 0 0 1 1 1\n",
        "#PARAM_IN: expected one of CARTESIAN, SPHERICAL_TL_PL_TV_PV, ISOTROPIC_TV_TL_DPHI, "
        "ISOTROPIC_TL_TV_PROJ_DPHI, RUSIN_TH_PH_TD_PD, RUSIN_TH_TD_PD, RUSIN_TH_TD, COS_TH_TD, "
        "COS_TH, got 'STARK_3D'",
    ),
    "xyz.alta": (
        SPHERICAL.replace(b"RGB", b"XYZ"),
        "#PARAM_OUT: expected one of INV_STERADIAN, INV_STERADIAN_COSINE_FACTOR, RGB_COLOR, got "
        "'XYZ_COLOR'",
    ),
    "dim.alta": (SPHERICAL.replace(b"4 3", b"3 3"), "#DIM: expected 4 3 for SPHERICAL_TL_PL_TV_PV"),
    "two.alta": (SPHERICAL + b"#DIM 4 3\n", "line 4: #DIM: expected once, found again"),
    "binary.alta": (SPHERICAL + b"#FORMAT binary\n\0\1", "#FORMAT: expected text, got 'binary'"),
    "row.alta": (SPHERICAL + b"0 0 0 0 1 1\n", "line 4: expected 7 numbers, 4 coordinates and 3"),
    "more.alta": (SPHERICAL + b"0 0 0 0 1 1 1 1\n", "line 4: expected 7 numbers"),
    "text.alta": (SPHERICAL + b"0 0 0 0 1 1 nan\n", "line 4: expected finite numbers, got 'nan'"),
    "degrees.alta": (
        SPHERICAL + b"30 0 0 0 1 1 1\n",
        "line 4: number 1: expected an angle from 0 to pi/2, got 30",
    ),
    "gap.alta": (
        SPHERICAL + b"0.1 0 0.1 0 1 1 1\n0.1 0 0.2 0 1 1 1\n0.2 0 0.1 0 1 1 1\n",
        "expected a row for every combination of angles: 2 theta_i, 1 phi_i, 2 theta_o, "
        "1 phi_o; 1 is missing",
    ),
    "twice.alta": (
        SPHERICAL + b"0.1 0 0.1 0 1 1 1\n\n0.1 0 0.1 0 1 1 2\n",
        "line 6: expected each combination of angles once, or the same values",
    ),
    "vector.alta": (
        b"#DIM 6 1\n#PARAM_IN CARTESIAN\n#PARAM_OUT INV_STERADIAN\n0 0 1 0.6 0 -0.8 1\n",
        "line 4: numbers 4 to 6: expected a unit vector above the surface",
    ),
    "black.alta": (SPHERICAL + b"0.1 0 0.1 0 0 0 0\n", "expected a number above 0, found none"),
    "holes.alta": (
        b"#DIM 2 1\n#PARAM_IN RUSIN_TH_TD\n#PARAM_OUT INV_STERADIAN\n0.1 0.1 -1\n",
        "expected a number above 0, found none",
    ),
    "data.xyz": (
        b"",
        "expected a name that ends with one of .binary, .bsdf, .bin, .alta, .dat, .xml, .csv",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_in_a_file_is_said(tmp_path, name):
    content, expected = BAD[name]
    (tmp_path / name).write_bytes(content)
    done = run("measured", tmp_path / name)
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert name in done.stderr and expected in done.stderr, done.stderr
    assert done.stdout == ""


def test_fields_that_are_not_known_are_named(tmp_path):
    file = tmp_path / "m.bsdf"
    file.write_bytes(changed(valid=np.ones(3, np.float32)))
    assert told(file)["notes"] == ["valid: this field is not known and was not read"]


def half_directions(th, ph, td, pd):
    """View and light of ALTA's angles, by its documentation: those of the half vector, and of the
    view about it."""
    x, y, z = vector(np.degrees(td), np.degrees(pd)).T
    turned = np.stack([np.cos(th) * x + np.sin(th) * z, y, np.cos(th) * z - np.sin(th) * x], -1)
    c, s = np.cos(ph), np.sin(ph)
    view = np.stack([c * turned[:, 0] - s * y, s * turned[:, 0] + c * y, turned[:, 2]], -1)
    half = vector(np.degrees(th), np.degrees(ph))
    return view, 2 * (view * half).sum(-1, keepdims=True) * half - view


def brushed_smooth(wi, wo):
    h = wi + wo
    h = h / np.maximum(np.linalg.norm(h, axis=-1, keepdims=True), 1e-9)
    lobe = np.exp(-4 * (h[:, 0] ** 2 + 3 * h[:, 1] ** 2))
    return above(wi, wo) * (0.1 + lobe[:, None] * np.array([0.5, 0.6, 0.7]))


def alta_file(name):
    """What ALTA writes of a function, by its parametrisation: the text, and what its directions
    are as light, view and f. Rows are shuffled."""
    radians = [np.radians(a) for a in (range(0, 90, 5), range(0, 181, 15), range(0, 360, 15))]
    theta, half, circle = radians
    f = brushed_smooth if name.endswith("4") else lambda i, o: glossy(i, o, exponent=4)
    if name == "CARTESIAN":
        ti, dp, to = (a.ravel() for a in np.meshgrid(theta, half, theta, indexing="ij"))
        light, view = vector(np.degrees(ti), 0 * ti), vector(np.degrees(to), np.degrees(dp))
        x = (*view.T, *light.T)
    elif name == "SPHERICAL_TL_PL_TV_PV":
        x = [a.ravel() for a in np.meshgrid(theta[::2], circle, theta[::2], circle, indexing="ij")]
        light, view = (vector(*np.degrees(a)) for a in (x[:2], x[2:]))
        f = brushed_smooth
    elif name == "ISOTROPIC_TV_TL_DPHI":
        x = [a.ravel() for a in np.meshgrid(theta, theta, half, indexing="ij")]
        view, light = vector(np.degrees(x[0]), 0 * x[0]), vector(*np.degrees(x[1:]))
    elif name == "ISOTROPIC_TL_TV_PROJ_DPHI":
        ti, to, dp = (a.ravel() for a in np.meshgrid(theta, theta, circle, indexing="ij"))
        light, view = vector(np.degrees(ti), 0 * ti), vector(np.degrees(to), np.degrees(dp))
        x = ti, to * np.cos(dp), to * np.sin(dp)
    else:
        th = (np.arange(0, 46) / 45) ** 2 * np.pi / 2
        td = np.radians(np.arange(0, 91, 3))
        free = {
            "RUSIN_TH_PH_TD_PD": (th[::3], circle, td[::3], half),
            "RUSIN_TH_TD_PD": (th, [0], td, half),
            "RUSIN_TH_TD": (th, [0], td, [np.pi / 2]),
            "COS_TH_TD": (th, [0], td, [np.pi / 2]),
            "COS_TH": (th, [0], [0], [0]),
        }[name]
        th, ph, td, pd = (a.ravel() for a in np.meshgrid(*free, indexing="ij"))
        view, light = half_directions(th, ph, td, pd)
        if name == "RUSIN_TH_PH_TD_PD":
            f = brushed_smooth
        # A function of the half vector is the same for all directions about it.
        f = f(light, view) if name.startswith("RUSIN_TH_PH") else base_of_half(th)
        kept = np.minimum(view[:, 2], light[:, 2]) > 1e-6
        if name != "RUSIN_TH_TD_PD":  # with all rows, as converted from MERL
            th, ph, td, pd, light, view, f = (a[kept] for a in (th, ph, td, pd, light, view, f))
        else:
            f = np.where(kept[:, None], f, -1)
            light, view = light[kept], view[kept]
        x = {
            "RUSIN_TH_PH_TD_PD": (th, ph, td, pd),
            "RUSIN_TH_TD_PD": (th, td, pd),
            "RUSIN_TH_TD": (th, td),
            "COS_TH_TD": (np.cos(th), np.cos(td)),
            "COS_TH": (np.cos(th),),
        }[name]
        return x, light, view, f
    return x, light, view, f(light, view)


def base_of_half(theta):
    return 0.1 + np.cos(theta)[:, None] ** 6 * np.array([0.5, 0.6, 0.7])


ALTA = (
    "CARTESIAN",
    "SPHERICAL_TL_PL_TV_PV",
    "ISOTROPIC_TV_TL_DPHI",
    "ISOTROPIC_TL_TV_PROJ_DPHI",
    "RUSIN_TH_PH_TD_PD",
    "RUSIN_TH_TD_PD",
    "RUSIN_TH_TD",
    "COS_TH_TD",
    "COS_TH",
)


@pytest.mark.many
@pytest.mark.parametrize("name", ALTA)
def test_alta_text_is_what_it_was_made_from(tmp_path, name):
    x, light, view, f = alta_file(name)
    order = np.random.default_rng(1).permutation(len(f))
    file = tmp_path / "m.alta"
    columns = [np.asarray(a)[order] for a in (*x, *f.T)]
    file.write_text("# made up\n" + alta(name, "RGB_COLOR", *columns, more="#ALTA HEADER END\n"))
    said = told(file)
    anisotropic = name in ("SPHERICAL_TL_PL_TV_PV", "RUSIN_TH_PH_TD_PD")
    assert said["format"] == "ALTA" and said["isotropic"] == (not anisotropic)
    assert not any("negative" in note for note in said["notes"]), said["notes"]
    by_half = "TH" in name
    i, o = hemisphere(800, 11, 0.2), hemisphere(800, 12, 0.2)
    if name == "RUSIN_TH_PH_TD_PD" or name == "SPHERICAL_TL_PL_TV_PV":
        expected, most = brushed_smooth(i, o), 0.05
    elif by_half:
        h = unit(i + o)
        expected, most = base_of_half(np.arccos(h[:, 2])), 0.002
    else:
        expected, most = glossy(i, o, exponent=4), 0.01
    assert np.abs(pairs(file, i, o)[0] - expected).mean() < most * expected.mean()
    if not by_half:
        at = slice(0, None, max(len(f) // 500, 1))
        high = np.minimum(light[at, 2], view[at, 2]) > 1e-3
        np.testing.assert_allclose(
            pairs(file, light[at][high], view[at][high])[0], f[at][high], rtol=2e-5
        )


def lopsided(wi, wo):
    """Not the same when light and view are swapped, nor in a mirror."""
    turn = wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0]
    return (1 + 0.5 * turn + 0.8 * wi[:, 2] ** 2)[:, None] * above(wi, wo) * np.ones(3)


def test_light_and_view_of_alta_are_not_swapped(tmp_path):
    """ALTA has the view first in CARTESIAN and ISOTROPIC_TV_TL_DPHI, the light first elsewhere; its
    azimuth is that of the light about the view, or of the view where it is projected."""
    theta, circle = np.radians(range(0, 90, 10)), np.radians(range(0, 360, 10))
    i, o = hemisphere(300, 21, 0.3), hemisphere(300, 22, 0.3)
    expected = lopsided(i, o)
    assert np.abs(expected - lopsided(o, i)).mean() > 0.1
    for name in ("CARTESIAN", "ISOTROPIC_TV_TL_DPHI", "ISOTROPIC_TL_TV_PROJ_DPHI"):
        ti, to, dp = (a.ravel() for a in np.meshgrid(theta, theta, circle, indexing="ij"))
        light, view = vector(np.degrees(ti), 0 * ti), vector(np.degrees(to), np.degrees(dp))
        x = {
            "CARTESIAN": (*view.T, *light.T),
            "ISOTROPIC_TV_TL_DPHI": (to, ti, -dp),
            "ISOTROPIC_TL_TV_PROJ_DPHI": (ti, to * np.cos(dp), to * np.sin(dp)),
        }[name]
        file = tmp_path / f"{name}.dat"
        file.write_text(alta(name, "RGB_COLOR", *x, *lopsided(light, view).T))
        np.testing.assert_allclose(pairs(file, i, o)[0], expected, rtol=0.02)
    # The view about the half vector, all round.
    th, td = np.radians(range(0, 91, 6)), np.radians(range(0, 91, 6))
    th, ph, td, pd = (a.ravel() for a in np.meshgrid(th, [0], td, circle, indexing="ij"))
    view, light = half_directions(th, ph, td, pd)
    f = lopsided(light, view)
    kept = np.minimum(view[:, 2], light[:, 2]) > 1e-6
    file = tmp_path / "half.dat"
    x = (a[kept] for a in (th, td, pd, *f.T))
    file.write_text(alta("RUSIN_TH_TD_PD", "RGB_COLOR", *x))
    np.testing.assert_allclose(pairs(file, i, o)[0], expected, rtol=0.05)


def test_values_of_alta_that_the_cosine_weights(tmp_path):
    """One number a row, weighted by the cosine of the view; rows of a view at the horizon, where it
    is 0, are left out, and so are confidence intervals."""
    file = tmp_path / "m.alta"
    theta = np.radians(range(0, 91, 10))
    ti, to, dp = (a.ravel() for a in np.meshgrid(theta, theta, [0, np.pi], indexing="ij"))
    f = 0.2 + 0.1 * np.cos(ti)
    text = alta("ISOTROPIC_TV_TL_DPHI", "INV_STERADIAN_COSINE_FACTOR", to, ti, dp, f * np.cos(to))
    head, row = text.split("\n", 1)
    rows = [line + ("" if line[0] == "#" else " 0.1") for line in row.splitlines()]
    file.write_text(f'{head}\n#VS 1\n#SAMPLE "Felt"\n' + "\r\n".join(rows))
    said = told(file)
    assert (
        said["description"] == '"Felt"'
        and said["grid"] == "10 x 1 directions of light, 9 x 2 of view"
    )
    for expected in (
        "one number a row: the data are grey",
        "confidence intervals are not read",
        "values are divided by the cosine of the view, with which they are weighted",
        "20 rows are of a view at the horizon left out",
    ):
        assert expected in said["notes"]
    i, o = hemisphere(100, 5, 0.2), hemisphere(100, 6, 0.2)
    expected = 0.2 + 0.1 * i[:, 2:] * np.ones(3)
    np.testing.assert_allclose(pairs(file, i, o)[0], expected, rtol=0.01)


@pytest.mark.slow
@pytest.mark.many
@pytest.mark.parametrize("turn", [0, 0.25, 0.5, 1])
def test_what_a_tensor_file_reflects_is_what_is_sampled(tmp_path, turn):
    """The weight of a sample is nearly the albedo, whatever is drawn: relative variances are up to
    0.023, and 0.05 to 0.16 where half vectors are drawn from a table. The pdf is one, and the
    albedo by samples is that by quadrature."""
    azimuths = np.linspace(-np.pi, (2 * turn - 1) * np.pi, 12) if turn else np.zeros(1)
    file = tmp_path / "m.bsdf"
    file.write_bytes(tensor(facets(azimuths)))
    said = {view["degrees"]: view["rgb"][0] for view in told(file)["albedo"]}
    cells = 300
    z, phi = (a.ravel() for a in np.meshgrid(*[(np.arange(cells) + 0.5) / cells] * 2))
    theta = (np.pi / 2) * z
    light = vector(np.degrees(theta), 360 * phi)
    area = np.sin(theta) * np.pi**2 / cells**2
    for degrees, azimuth in ((15, 0), (45, 130), (60, 250)):
        view = np.broadcast_to(vector(degrees, azimuth), light.shape)
        f, pdf = pairs(file, light, view)
        f_cos = f[:, 0] * light[:, 2]
        albedo = (f_cos * area).sum()
        # Some samples are lost below the horizon.
        assert 0.9 < (pdf * area).sum() < 1.003
        variance = (f_cos**2 / pdf * area).sum() / albedo**2 - 1
        assert variance < 0.03, variance
        if turn == 0:
            assert albedo == pytest.approx(said[degrees], rel=5e-3)


def test_azimuths_that_a_tensor_file_lacks_are_said(tmp_path):
    """The tables are those of negative azimuths. Others used to be looked up at the ends."""
    fields = rgl_fields("anisotropic")
    file = tmp_path / "m.bsdf"
    file.write_bytes(tensor(fields))
    assert told(file)["notes"] == []
    file.write_bytes(tensor(fields | {"phi_i": fields["phi_i"] + np.float32(np.pi)}))
    assert told(file)["notes"] == [
        "phi_i: measured from 0 to 180 degrees, and azimuths from -180 to 0 are needed: the values "
        "at these ends hold beyond"
    ]


@pytest.mark.parametrize(
    "name", ["none.binary", "none.bsdf", "none.bin", "none.alta", "none.csv", "none.xml"]
)
def test_what_is_not_there_is_said(tmp_path, name):
    done = run("measured", tmp_path / name)
    assert done.returncode == 2 and f"{name}: expected a file, found none" in done.stderr


def lobe_table(folder, matte=0.0):
    """Blinn's model, as a table in steps of 5 degrees."""
    file = folder / "lobe.csv"
    ti, pi, to, po = grid(range(0, 90, 5), [0], range(0, 90, 5), range(0, 181, 5))
    f = eval_pairs(["eval", "blinn", "ks=0.5,0.3,0.1", "e=10"], vector(ti, pi), vector(to, po))
    f = f[:, :3] + np.asarray(matte)
    file.write_text(angle_table(ti, pi, to, po, *f.T), encoding="utf-8")
    return file


@pytest.mark.slow
def test_models_are_ranked(tmp_path):
    """The model that the data were made from comes first, with what they were made from."""
    file = lobe_table(tmp_path)
    done = run("measured", file, "--json", "--models", "lambert,blinn,ward,phong")
    assert done.returncode == 0, done.stderr
    fits = json.loads(done.stdout)["fits"]
    counted = re.findall(r"^brdfc measured: (\d)/4 \w+$", done.stderr, re.M)
    assert sorted(counted) == ["1", "2", "3", "4"]
    assert [f["model"] for f in fits][0] == "blinn" and len(fits) == 4
    assert fits[0]["error"] < 0.01 and fits[1]["error"] > 2 * fits[0]["error"]
    errors = [f["error"] for f in fits]
    assert all(a < 1.05 * b + 5e-4 for a, b in zip(errors, errors[1:], strict=False))
    of_model = json.loads(run("list", "--json").stdout)
    assert fits[0]["parameters"].keys() == {
        p["name"] for m in of_model if m["name"] == "blinn" for p in m["parameters"]
    }
    text = run("measured", file, "--models", "blinn").stdout
    assert re.search(r"blinn +0\.\d+ % .*ks=.* e=", text)
    for names, expected in (("blin", "'blin'"), ("fresnel_conductor", "is a mirror alone")):
        done = run("measured", file, "--models", names)
        assert done.returncode == 2 and expected in done.stderr


def test_lobes_of_all_models_and_pairs_alone(tmp_path):
    file = lobe_table(tmp_path)
    command = ("measured", file, "--json", "--lobes", "1")
    found = [json.loads(run(*command, *more).stdout)["sums"] for more in ((), ("--from", "all"))]
    assert found[0][0]["lobes"] == found[1][0]["lobes"]
    for more in (("--lobes", "2"), ("--models", "ward"), ("--no-matte",), ("--at", "0")):
        done = run("measured", file, "--pairs", *more)
        assert done.returncode == 2 and f"{more[0]} excludes --pairs" in done.stderr


def test_data_that_are_missing_are_named(tmp_path):
    """The file that is needed, not another one by which the folder is known."""
    file = lobe_table(tmp_path)
    command = [TOOL, "measured", str(file), "--models", "none"]
    environment = {"BRDFC_DATA": "/nowhere"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 2 and done.stderr.startswith(
        "brdfc: data/color/config.ocio is needed"
    )
    assert "BRDFC_DATA=/nowhere" in done.stderr and "blender_manifest" not in done.stderr


def test_a_form_that_a_material_lacks_is_refused_when_the_scene_is_read(tmp_path):
    lambert, phong = {"model": "lambert"}, {"model": "phong"}
    lobes = [lambert, phong]
    for material, expected in (
        (
            {"sum": lobes, "representation": "exact"},
            ": lobe 2: phong has no form 'exact'",
        ),
        (phong | {"representation": "exact"}, ": phong has no form 'exact'; it has auto, aimed, "),
        (phong | {"representation": "excat"}, ": phong has no form 'excat'; it has auto, aimed, "),
    ):
        content = scene(materials={"m": material}, **PLANE)
        file = tmp_path / "s.json"
        file.write_text(json.dumps(content), encoding="utf-8")
        for command in ("scene", "build --scene", "render"):
            out = tmp_path / ("o.exr" if command == "render" else "out")
            done = run(*command.split(), file, "--out", out)
            assert done.returncode == 2, done.stderr
            assert f"{file}: materials.m.representation{expected}" in done.stderr, done.stderr
            assert "aimed" in done.stderr


def test_matte_light_is_added_unless_told_otherwise(tmp_path):
    file = lobe_table(tmp_path, matte=[0.1, 0.05, 0.02])
    with_matte, alone = (
        json.loads(run("measured", file, "--json", "--models", "blinn", *more).stdout)["fits"][0]
        for more in ((), ("--no-matte",))
    )
    assert with_matte["matte"] == pytest.approx([np.pi * c for c in (0.1, 0.05, 0.02)], rel=0.02)
    assert alone["matte"] is None and alone["error"] > 5 * with_matte["error"]


PLANE = {
    "camera": {
        "type": "orthographic",
        "height": 1,
        "position": [0, 0, 4],
        "look_at": [0, 0, 0],
        "up": [0, 1, 0],
    },
    "objects": [{"name": "o", "shape": {"type": "quad", "size": [4, 4]}, "material": "m"}],
    "settings": {"width": 8, "height": 8, "spp": 1024, "seed": 1, "max_bounces": 0},
}


def rendered(folder, material, *options, **changes):
    import OpenImageIO as oiio

    content = scene(materials={"m": material}, **(PLANE | changes))
    (folder / "s.json").write_text(json.dumps(content), encoding="utf-8")
    done = run("render", folder / "s.json", "--out", folder / "s.exr", *options)
    assert done.returncode == 0, done.stderr
    return oiio.ImageBuf(str(folder / "s.exr")).get_pixels(oiio.FLOAT)[..., :3], done.stderr


@pytest.mark.many
@pytest.mark.slow
@pytest.mark.parametrize("strategy", ["brdf", "mis"])
def test_the_reference_renders_data_as_they_are(tmp_path, merl_file, strategy):
    """A white world shows the albedo; under a lamp every way of sampling has one mean."""
    material = {"measured": str(merl_file)}
    pixels, _ = rendered(tmp_path, material, "--strategy", strategy)
    expected = told(merl_file)["albedo"][0]["rgb"]
    np.testing.assert_allclose(pixels.mean((0, 1)), expected, rtol=0.01)
    lamp = {"type": "area", "position": [1, 0, 2], "direction": [-0.5, 0, -1], "size": [1, 1]}
    lit = {"lights": [lamp | {"power": 100}], "environment": None}
    by_lamp, _ = rendered(tmp_path, material, "--strategy", "light", **lit)
    pixels, _ = rendered(tmp_path, material, "--strategy", strategy, **lit)
    np.testing.assert_allclose(pixels.mean((0, 1)), by_lamp.mean((0, 1)), rtol=0.01)


def test_data_have_one_colour_in_every_working_space(tmp_path, merl_file):
    import PyOpenColorIO as ocio
    from support import CONFIG

    pixels, _ = rendered(tmp_path, {"measured": str(merl_file)}, working_space="ACEScg")
    albedo = np.array([told(merl_file)["albedo"][0]["rgb"]], np.float32)
    config = ocio.Config.CreateFromFile(str(CONFIG))
    config.getProcessor("Linear Rec.709", "ACEScg").getDefaultCPUProcessor().applyRGB(albedo)
    np.testing.assert_allclose(pixels.mean((0, 1)), albedo[0], rtol=0.01)
    assert abs(albedo[0, 2] / albedo[0, 0] - 1) > 0.02


@pytest.mark.slow
def test_a_scene_has_the_model_that_is_fitted(tmp_path):
    file = lobe_table(tmp_path)
    material = {"measured": file.name, "as": "blinn"}
    pixels, said = rendered(tmp_path, material)
    raw, _ = rendered(tmp_path, {"measured": file.name})
    np.testing.assert_allclose(pixels.mean((0, 1)), raw.mean((0, 1)), rtol=0.03)
    assert re.search(r"lobe.csv: blinn, error 0\.\d+ %: ks=", said)

    def resolved(material):
        content = scene(materials={"m": material}, **PLANE)
        (tmp_path / "s.json").write_text(json.dumps(content), encoding="utf-8")
        return run("scene", tmp_path / "s.json", "--out", tmp_path / "out")

    assert resolved(material).returncode == 0
    found = json.loads((tmp_path / "out" / "scene.json").read_text())["materials"]["m"]
    assert found["model"] == "blinn" and found["representation"] == "auto"
    fit = json.loads(run("measured", file, "--json", "--models", "blinn", "--no-matte").stdout)
    assert found["parameters"] == fit["fits"][0]["parameters"]
    for bad, expected in (
        ({"measured": file.name}, "material m: measured data are rendered by `brdfc render`"),
        ({"measured": file.name, "as": "bling"}, "materials.m.as: did you mean blinn? expected"),
        ({"measured": file.name, "model": "blinn"}, "materials.m.model"),
        ({"measured": "none.csv"}, "materials.m.measured: "),
        ({"model": "blinn", "as": "ward"}, "materials.m.as"),
        ({"measured": file.name, "representation": "exact"}, 'expected "as" beside it'),
    ):
        done = resolved(bad)
        assert done.returncode == 2 and expected in done.stderr, done.stderr


@pytest.mark.slow
def test_sums_of_lobes_are_told(tmp_path):
    """Of a table of two lobes, two lobes leave next to nothing; without their kind more is left."""
    file = lobe_table(tmp_path, matte=[0.1, 0.05, 0.02])
    done = run("measured", file, "--json", "--lobes", "2")
    assert done.returncode == 0, done.stderr
    # Two searches for two lobes each; the second may be left out.
    steps = [int(k) for k in re.findall(r"^brdfc measured: (\d)/4 ", done.stderr, re.M)]
    assert steps[:2] == [1, 2] and steps == sorted(steps) and steps[-1] == 4
    said = json.loads(done.stdout)
    one, two = said["sums"]
    assert said["fits"] == [] and two["error"] < 0.01 < 0.1 < one["error"]
    assert {lobe["model"] for lobe in two["lobes"]} == {"lambert", "blinn"}
    assert sum(lobe["share"] for lobe in two["lobes"]) == pytest.approx(1)
    rho = next(lobe for lobe in two["lobes"] if lobe["model"] == "lambert")["parameters"]["rho"]
    assert rho == pytest.approx([np.pi * c for c in (0.1, 0.05, 0.02)], rel=0.05)
    without = run("measured", file, "--json", "--lobes", "2", "--from", "lambert,phong,ward")
    assert json.loads(without.stdout)["sums"][-1]["error"] > 2 * two["error"]
    text = run("measured", file, "--lobes", "2").stdout
    assert re.search(r"^ +2 +0\.\d+ % .* blinn", text, re.M), text
    assert re.search(r"% +lambert rho=", text) and "  error  " in text
    for options, expected in (
        (("--lobes", "13"), "--lobes"),
        (("--lobes", "2", "--from", "wart"), "wart has no lobe for a sum, expected all or some of"),
        (("--lobes", "2", "--from", "coupled"), "coupled has no lobe for a sum"),
        (("--from", "ward"), "--lobes"),
    ):
        done = run("measured", file, *options)
        assert done.returncode == 2 and expected in done.stderr, done.stderr


@pytest.mark.long
@pytest.mark.slow
def test_a_scene_has_the_sum_that_is_fitted(tmp_path):
    """In the reference the sum is nearly the data, by every way of sampling, and the resolved scene
    is one that renders the same."""
    file = lobe_table(tmp_path, matte=[0.1, 0.05, 0.02])
    lamp = {"type": "area", "position": [1, 0, 2], "direction": [-0.5, 0, -1], "size": [1, 1]}
    lit = {"lights": [lamp | {"power": 100}], "environment": None}
    raw, _ = rendered(tmp_path, {"measured": file.name}, **lit)
    for material, lobes in (
        ({"measured": file.name, "as": "lobes", "lobes": 2}, 2),
        ({"measured": file.name, "as": "blinn"}, 2),
    ):
        for strategy in ("mis", "brdf", "light"):
            pixels, said = rendered(tmp_path, material, "--strategy", strategy, **lit)
            np.testing.assert_allclose(pixels.mean((0, 1)), raw.mean((0, 1)), rtol=0.02)
        assert re.search(r"lobe.csv: .*, error 0\.\d+ %", said)
        assert not re.search(r"[1-9]\d*\.\d{5}|\.0*[1-9]\d{4}", said), said  # four digits
        done = run("scene", tmp_path / "s.json", "--out", tmp_path / "out")
        assert done.returncode == 0, done.stderr
        found = json.loads((tmp_path / "out" / "scene.json").read_text())["materials"]["m"]
        assert {lobe["model"] for lobe in found["sum"]} == {"lambert", "blinn"}
        assert len(found["sum"]) == lobes and found["representation"] == "auto"
        again, _ = rendered(tmp_path, found, **lit)
        np.testing.assert_allclose(again.mean((0, 1)), pixels.mean((0, 1)), rtol=0.01)


def test_what_is_wrong_in_a_sum_is_said(tmp_path):
    lobe_table(tmp_path)
    for bad, expected in (
        ({"sum": []}, "materials.m.sum: expected 1 to 12 lobes"),
        ({"sum": [{"model": "glas"}]}, "materials.m.sum[0].model: did you mean glass"),
        ({"sum": [{"model": "glass"}]}, "materials.m.sum[0]: lets light through"),
        ({"sum": [{"model": "rough_glass"}]}, "materials.m.sum[0]: lets light through"),
        ({"sum": [{"model": "ward", "parameters": {"e": 2}}]}, "ward has no such parameter"),
        ({"sum": [{"model": "ward", "parameters": {"ks": {"texture": "x.png"}}}]}, "a constant"),
        ({"sum": [{"model": "ward"}], "model": "ward"}, "materials.m.model"),
        ({"measured": "lobe.csv", "as": "blinn", "lobes": 2}, '"as": "lobes" beside it'),
        ({"measured": "lobe.csv", "as": "lobes", "lobes": 13}, "materials.m.lobes"),
    ):
        content = scene(materials={"m": bad}, **PLANE)
        (tmp_path / "s.json").write_text(json.dumps(content), encoding="utf-8")
        done = run("scene", tmp_path / "s.json", "--out", tmp_path / "out")
        assert done.returncode == 2 and expected in done.stderr, done.stderr


def test_a_sum_that_reflects_more_than_it_gets_is_told(tmp_path):
    """Of sums in scene files, as of those that are fitted; ideal mirrors count."""
    white, half = ({"model": "lambert", "parameters": {"rho": rho}} for rho in (0.9, 0.5))
    metal = {"model": "fresnel_conductor"}
    for lobes, expected in (
        ([white, half], "1.4 times seen at 0 degrees"),
        ([half, half], None),
        ([half, metal], "times seen at"),
        ([white], None),
    ):
        content = scene(materials={"m": {"sum": lobes}}, **PLANE)
        (tmp_path / "s.json").write_text(json.dumps(content), encoding="utf-8")
        done = run("scene", tmp_path / "s.json", "--out", tmp_path / "out")
        assert done.returncode == 0, done.stderr
        said = "brdfc: materials.m.sum: the sum reflects more light than it gets: "
        assert (said in done.stderr) == (expected is not None), done.stderr
        assert expected is None or expected in done.stderr


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    out = tmp_path_factory.mktemp("python")
    done = run("python", "--out", out)
    assert done.returncode == 0, done.stderr
    return out


@pytest.mark.slow
def test_the_package_says_what_the_tool_says(tmp_path, package):
    """In a process of its own, without the package of other tests."""
    file = lobe_table(tmp_path)
    script = f"""
import json
import brdfc, numpy as np
data = brdfc.measured({str(file)!r})
wi, wo = np.load({str(tmp_path / "wi.npy")!r}), np.array([0.6, 0, 0.8])
fit = data.fit("blinn", matte=False)
f = brdfc.model("blinn").eval(wi, wo, **fit.parameters)
try:
    brdfc.measured("none.binary")
except ValueError as error:
    refused = str(error)
print(json.dumps([data.format, data.isotropic, data.eval(wi, wo).tolist(), f.tolist(),
    data.albedo(np.cos(np.radians([0, 45]))).tolist(), fit.error, refused,
    [[s.error, [[l.model, l.share] for l in s.lobes]] for s in data.lobes(2, "blinn", "lambert")]]))
"""
    wi, wo = hemisphere(50, 20, 0.1), np.tile([0.6, 0, 0.8], (50, 1))
    np.save(tmp_path / "wi.npy", wi)
    environment = {"PYTHONPATH": str(package), "BRDFC_TOOL": TOOL, "PATH": ""}
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    kind, isotropic, f, of_model, albedo, error, refused, sums = json.loads(done.stdout)
    assert kind == "CSV" and isotropic and error < 0.01
    assert f == pairs(file, wi, wo)[0].tolist()
    np.testing.assert_allclose(of_model, f, rtol=0.1, atol=0.01)
    expected = [v["rgb"] for v in told(file)["albedo"]]
    np.testing.assert_allclose(albedo, [expected[0], expected[3]], rtol=0.01)
    assert refused == "none.binary: expected a file, found none"
    for count, (off, lobes) in enumerate(sums, 1):
        assert len(lobes) == count and off < 0.02 and {m for m, _ in lobes} <= {"blinn", "lambert"}
        assert sum(share for _, share in lobes) == pytest.approx(1)
    assert sums
    for tool, expected in [
        ("", "measured BRDFs are read by the program brdfc"),
        ("/nowhere/brdfc", "the program brdfc, /nowhere/brdfc, can't be run: "),
        ("/bin/echo", "/bin/echo is not the program brdfc: it answers 'measured"),
    ]:
        environment["BRDFC_TOOL"] = tool
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
        assert f"FileNotFoundError: {expected}" in done.stderr, done.stderr


@pytest.mark.slow
def test_the_package_says_what_keeps_a_model_from_coming_closer(tmp_path, package):
    """Facets that face everywhere, and a highlight along a tangent that is turned."""
    wide, brushed = tmp_path / "wide.csv", tmp_path / "brushed.csv"
    angles = range(0, 90, 10)
    ti, pi, to, po = grid(angles, [0], angles, range(0, 181, 10))
    model = ["eval", "microfacet", "ax=1", "ay=1", "distribution=ggx"]
    f = eval_pairs(model, vector(ti, pi), vector(to, po))[:, :3]
    wide.write_text(angle_table(ti, pi, to, po, *f.T), encoding="utf-8")
    ti, pi, to, po = grid(range(0, 90, 15), range(0, 360, 30), range(0, 90, 15), range(0, 360, 30))
    model = ["eval", "ward", "ax=0.2", "ay=0.6"]
    f = eval_pairs(model, vector(ti, pi - 30), vector(to, po - 30))[:, :3]
    brushed.write_text(angle_table(ti, pi, to, po, *f.T), encoding="utf-8")
    script = """
import dataclasses, json, sys, brdfc
fits = [brdfc.measured(f).fit(m) for f, m in zip(sys.argv[1::2], sys.argv[2::2])]
print(json.dumps([dataclasses.asdict(fit) for fit in fits]))
"""
    environment = {"PYTHONPATH": str(package), "BRDFC_TOOL": TOOL, "PATH": ""}
    command = [sys.executable, "-c", script, wide, "cook_torrance", brushed, "ward"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    narrow, straight = json.loads(done.stdout)
    assert narrow["stopped"] == ["m"] and narrow["turned"] is None
    assert straight["stopped"] == []
    assert straight["turned"]["angle"] == pytest.approx(np.radians(-30), abs=0.02)
    assert straight["turned"]["error"] < 0.7 * straight["error"]
    for file, fit in ((wide, narrow), (brushed, straight)):
        said = json.loads(run("measured", file, "--json", "--models", fit["model"]).stdout)
        assert {key: said["fits"][0][key] for key in fit} == fit
