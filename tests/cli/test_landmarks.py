# SPDX-License-Identifier: GPL-3.0-or-later
"""Suffern's turned rays on docs/gallery/landmarks.md: compared with quadrature, and the effect of
turning."""

import landmarks
import numpy as np
import pytest
from mpmath import mp
from support import ROOT, TOOL

PAGE = (ROOT / "docs" / "gallery" / "landmarks.md").read_text(encoding="utf-8")


def quadrature(degrees, e):
    """Fraction of cos^e about r that is below the surface. On the circle at an angle alpha from r,
    the points below are those whose cosine of the azimuth is below -cot(alpha) cot(theta)."""
    theta = mp.radians(degrees)

    def density(alpha):
        part = mp.acos(min(mp.cot(alpha) * mp.cot(theta), mp.one)) / mp.pi
        return (e + 1) * mp.cos(alpha) ** e * mp.sin(alpha) * part

    # From where the circle first reaches below, in steps that resolve the narrow peak of a sharp
    # lobe.
    start = mp.pi / 2 - theta
    width = 1 / mp.sqrt(e)
    steps = [start + k * width for k in (0, 1, 2, 4, 8) if start + k * width < mp.pi / 2]
    return float(mp.quad(density, [*steps, mp.pi / 2]))


def test_quadrature_is_the_closed_form_where_there_is_one():
    for degrees in (45, 80, 89):
        expected = (1 - np.cos(np.radians(degrees))) / 2
        assert quadrature(degrees, 1) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("degrees", "e"), [(45, 10), (80, 1), (85, 100), (89, 1000)])
def test_shares_below_the_surface_are_those_of_quadrature(degrees, e):
    """65536 Hammersley points have an error of less than 0.0003."""
    found = landmarks.share_below(TOOL, degrees, e)
    assert found == pytest.approx(quadrature(degrees, e), abs=3e-4)


def test_the_page_has_the_shares_of_quadrature():
    """To the last printed digit, plus or minus one."""
    for e in landmarks.EXPONENTS:
        (row,) = (line for line in PAGE.splitlines() if line.startswith(f"| {e} |") and "%" in line)
        printed = [float(cell.split()[0]) for cell in row.split("|")[2:-1]]
        expected = [100 * quadrature(v, e) for v in landmarks.SHARE_VIEWS]
        np.testing.assert_allclose(printed, expected, atol=0.1, err_msg=row)


@pytest.mark.parametrize("pattern", landmarks.PATTERNS)
def test_rays_below_are_turned_through_the_mirror_direction(pattern):
    drawn, turned, below = landmarks.turned_rays(TOOL, 85, pattern)
    expected = quadrature(85, 1)
    spread = 3 * np.sqrt(expected * (1 - expected) / landmarks.RAYS)
    assert below.mean() == pytest.approx(expected, abs=spread)
    np.testing.assert_allclose(turned[~below], drawn[~below], atol=1e-12)
    np.testing.assert_allclose(turned[below], -drawn[below], atol=1e-12)
    # Above the horizon, which is half an ellipse on the disk.
    x, y = turned.T
    assert (y > -np.cos(np.radians(85)) * np.sqrt(1 - x * x)).all()
    before, after = (np.median(landmarks.to_nearest(p, below)) for p in (drawn, turned))
    assert f"| {pattern} | {below.sum()} | {before:.3f} | {after:.3f} |" in PAGE
    if pattern == "regular":
        assert landmarks.to_nearest(turned, below).max() < 1e-12, "each is traced twice"
    elif pattern == "hammersley":
        assert before > 0.08 and after < 0.005, "nearly so"
    else:
        assert 0.5 < after / before < 0.8, "as many as before on half the disk"
