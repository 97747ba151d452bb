# SPDX-License-Identifier: GPL-3.0-or-later
"""The glossy layer of a dielectric Principled node: what it leaves to the base beneath, and its
Fresnel term. Independent of bpy."""

import functools
from dataclasses import replace

import numpy as np

from . import native_bsdf
from .sheen_albedo import ALBEDOS, COSINES, ROUGHNESSES

#: View cosines and roughnesses to which the polynomials are fitted. Nearer to the horizon a surface
#: fills few pixels.
_COSINES = np.linspace(0.03, 1, 33)
_VIEWS = np.stack([np.sqrt(1 - _COSINES**2), 0 * _COSINES, _COSINES], -1)
_ROUGHNESSES = np.linspace(0.1, 1, 10)
#: Degrees in 1 - cos and in a roughness that varies. With 5 and 4 the albedo is off by at most
#: 0.02, and by 0.006 at cosines from 0.2 and roughnesses from 0.2.
_DEGREE, _DEGREE_ROUGHNESS = 5, 4


@functools.lru_cache(maxsize=64)
def rest(f0, tint, multiscatter, roughness=None):
    """The light that the layer leaves to its base, seen from a view, as Cycles computes it: a
    polynomial. Returns ((c00, c01, ...), (c10, ...), ...), the coefficients of (1 - cos)^i
    roughness^j. `tint`: the largest channel of the tint of f0. `roughness`: the only one that
    matters; None: all of them."""
    plastic = native_bsdf.Native("principled", (1.0, 1.0, 1.0), f0=f0, multiscatter=multiscatter)
    plastic = replace(plastic, tint=(tint,))  # the only channel that matters
    return _of_roughness(
        lambda node: native_bsdf.view_terms(node, _VIEWS).taken, plastic, roughness
    )


@functools.lru_cache(maxsize=64)
def below_coat(f0, roughness=None):
    """The same for the coat of a Principled node, of which Cycles takes the albedo as it is."""

    def taken(node):
        if node.is_mirror:
            return native_bsdf.gloss_fresnel(node, _COSINES).max(-1)
        return native_bsdf.facet_albedo(
            _VIEWS, node.mean_alpha, False, lambda c: native_bsdf.gloss_fresnel(node, c)
        ).max(-1)

    coat = native_bsdf.Native("principled", (0.0, 0.0, 0.0), f0=f0)
    return _of_roughness(taken, coat, roughness)


def below_sheen(roughness):
    """The same for the sheen of a Principled node, of one roughness."""
    row = [np.interp(roughness, ROUGHNESSES, column) for column in ALBEDOS.T]
    return _polynomial(1 - np.interp(_COSINES, COSINES, row)[None], np.array([roughness]), 0)


def _of_roughness(taken, native, roughness):
    """The polynomial for 1 - taken(native) at a roughness, or at all."""
    roughnesses = _ROUGHNESSES if roughness is None else np.array([roughness])
    left = 1 - np.stack([taken(replace(native, roughness=r)) for r in roughnesses])
    return _polynomial(left, roughnesses, _DEGREE_ROUGHNESS if roughness is None else 0)


def _polynomial(left, widths, degree):
    """The polynomial of this degree in a number for `left`, a row for each of `widths`, the values
    of that number, and a column for each of _COSINES."""
    of_view = (1 - _COSINES)[:, None] ** np.arange(_DEGREE + 1)
    of_width = widths[:, None] ** np.arange(degree + 1)
    terms = of_view[None, :, :, None] * of_width[:, None, None, :]
    terms = terms.reshape(left.size, -1)
    # Relative errors of the base's light, except where there is hardly any.
    weight = 1 / (left.ravel() + 0.1)
    found = np.linalg.lstsq(terms * weight[:, None], left.ravel() * weight, rcond=None)[0]
    rows = found.reshape(_DEGREE + 1, -1)
    return tuple(tuple(float(c) for c in row) for row in rows)


#: Degree in a share that varies.
_DEGREE_SHARE = 4


@functools.lru_cache(maxsize=64)
def rest_of_share(native, at, least):
    """The same for at(native, share), where the share varies from 0 to 1: coefficients of
    (1 - cos)^i share^j. `least`: the lowest share but 0 to which it is fitted."""
    shares = np.concatenate([[0.0], np.linspace(least, 1, 12)])
    native = replace(native, color=(1.0, 1.0, 1.0), tint=(max(native.tint),))
    nodes = [at(native, share) for share in shares]
    left = 1 - np.stack([native_bsdf.view_terms(node, _VIEWS).taken for node in nodes])
    return _polynomial(left, shares, _DEGREE_SHARE)


@functools.cache
def mean_albedo():
    """The cosine-weighted mean albedo of GGX microfacets that reflect everything: coefficients of
    roughness^j, which are 0.002 off at most."""
    r = np.linspace(0.02, 1, 30)
    found = np.polyfit(r, [native_bsdf.mean_facet_albedo((x * x, x * x)) for x in r], 5)
    return tuple(float(c) for c in found[::-1])


def rest_at(coefficients, cosine, roughness):
    """The polynomial of rest() at view cosines, from 0 to 1, as the nodes of a plan compute it."""
    x, sum_ = 1 - np.clip(cosine, 0, 1), 0.0
    for row in reversed(coefficients):
        sum_ = sum_ * x + np.polyval(row[::-1], roughness)
    return np.clip(sum_, 0, 1)


@functools.lru_cache(maxsize=64)
def schlick_like(f0, tint=1.0):
    """The reflectance and the tint of `microfacet` whose Fresnel term is nearest to that of a
    dielectric with a tint: its relative error is the smallest, on average over cosines from 0.2."""
    c = np.linspace(0.2, 1, 33)
    wanted = native_bsdf.tinted_dielectric(native_bsdf.dielectric(f0, c), f0, (tint,))[:, 0]
    f0s = np.minimum(f0 * tint * np.linspace(0.7, 1.3, 61), 1)[:, None, None]
    tints = np.linspace(0, 1, 101)[:, None]
    tinted = native_bsdf.TINTED
    strongest = c * (1 - c) ** 6 / (tinted * (1 - tinted) ** 6)
    found = (f0s + (1 - f0s) * (1 - c) ** 5) * (1 - (1 - tints) * strongest)
    # A tint of 0 reflects nothing at normal incidence.
    off = (np.abs(found - wanted) / (wanted + 1e-3)).mean(-1)
    i, j = np.unravel_index(np.argmin(off), off.shape)
    # Without a tint the model is one of Blender's nodes, which is quicker.
    if off[:, -1].min() < 1.02 * off[i, j]:
        i, j = int(np.argmin(off[:, -1])), -1
    return float(f0s[i, 0, 0]), float(tints[j, 0])
