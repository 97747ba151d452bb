# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how much of the light that one of Blender's nodes reflects a model sends in other
directions: under point lamps, and under lamps as wide as a window, which hide the exact shape of a
lobe about as much as most pictures do. Independent of bpy; the models' formulas come with the
extension as NumPy code."""

import functools
import itertools
import math

import numpy as np

from . import layer, native_bsdf

#: View cosines at which models are compared, and the number of light directions for each.
VIEWS = (0.95, 0.75, 0.5, 0.25)
DIRECTIONS = 256
#: Standard deviation of the light of a wide lamp, in radians, and the number of such lamps.
LAMP, LAMPS = 0.1, 512
#: While widths are still far apart, one direction in this many suffices to compare them.
_ROUGH_STRIDE = 8
#: Alpha (as in Cycles) of the narrowest lobe by which directions are sampled.
NARROWEST = 5e-4


class Directions:
    """View and light directions by which a node is compared: samples of its lobe and of the cosine,
    with MIS weights for integrals over wi."""

    def __init__(self, native):
        azimuths = (0.3,) if native.stretch == 1 else (0.2, 1.3)
        self.each = np.array(
            [
                (math.sqrt(1 - c * c) * math.cos(a), math.sqrt(1 - c * c) * math.sin(a), c)
                for c in VIEWS
                for a in azimuths
            ]
        )
        i = np.arange(DIRECTIONS)
        u = (0.5 + np.outer(i, (0.8191725134, 0.6710436067))) % 1
        r, phi = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
        flat = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - u[:, 0])], -1)
        alpha = tuple(max(a, NARROWEST) for a in native.alpha)
        h = native_bsdf.draw_facets(u, alpha)
        wi, wo, weight, which = [], [], [], []
        for k, w in enumerate(self.each):
            drawn = 2 * (h @ w)[:, None] * h - w
            # Samples below the surface don't count: lobes reflect nothing to there.
            both = np.concatenate([flat, drawn])
            up = both[:, 2] > 1e-4
            both = both[up]
            here = np.broadcast_to(w, both.shape)
            half = native_bsdf.half(both, here)
            of_lobe = native_bsdf.distribution(half, alpha, False) * half[:, 2]
            of_lobe /= 4 * np.maximum((half * here).sum(-1), 1e-6)
            density = (both[:, 2] / np.pi + of_lobe) / 2
            wi.append(both)
            wo.append(here)
            weight.append(1 / (density * 2 * DIRECTIONS))
            which.append(np.full(len(both), k))
        self.wi, self.wo = np.concatenate(wi), np.concatenate(wo)
        self.weight, self.which = np.concatenate(weight), np.concatenate(which)
        #: First row of each view, and the end of the last.
        self.starts = np.searchsorted(self.which, range(len(self.each) + 1))

    def light(self, f_cos):
        """Integral over the light directions for each view, (k, 3)."""
        weighed = f_cos * self.weight[:, None]
        return np.stack([np.bincount(self.which, weighed[:, c]) for c in range(3)], -1)

    @functools.cached_property
    def _from_lamps(self):
        """The fraction that each lamp has of the light of each direction, (n, LAMPS), and of the
        mirror direction of each view, (k, LAMPS)."""
        i = np.arange(LAMPS) + 0.5
        z, phi = i / LAMPS, i * math.pi * (1 + math.sqrt(5))
        r = np.sqrt(1 - z * z)
        lamps = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)
        mirrored = self.each * (-1, -1, 1)
        parts = []
        for directions in (self.wi, mirrored):
            near = directions.astype(np.float32) @ lamps.T.astype(np.float32)
            near -= 1
            near /= np.float32(LAMP**2)
            # Smaller values are negligible, and denormals would be much slower.
            np.exp(np.maximum(near, np.float32(-30), out=near), out=near)
            near /= near.sum(1, keepdims=True)
            parts.append(near)
        return parts

    def light_of_lamps(self, f_cos, mirror):
        """Light by view and lamp, (k, LAMPS, 3), with mirror reflection of weight `mirror` (k,
        3)."""
        of_lobe, of_mirror = self._from_lamps
        weighed = (f_cos * self.weight[:, None]).astype(np.float32)
        views = [slice(*ends) for ends in itertools.pairwise(self.starts)]
        # einsum does not use BLAS, whose threads stall when other processes keep the cores busy.
        lobes = np.stack([np.einsum("nl,nc->cl", of_lobe[v], weighed[v]) for v in views])
        return lobes.swapaxes(1, 2) + of_mirror[:, :, None] * mirror[:, None]


@functools.lru_cache(maxsize=8)
def _directions(roughness, stretch):
    """Cached, as nodes may share them; each takes about four megabytes."""
    return Directions(native_bsdf.Native("glossy", (1.0, 1.0, 1.0), roughness, stretch))


class Target:
    """A node's reflected light at its Directions."""

    def __init__(self, native):
        self.native, self.at = native, _directions(native.roughness, native.stretch)
        self.f_cos = native_bsdf.f_cos(
            native, self.at.wi, self.at.wo, (self.at.each, self.at.which)
        )
        self.mirror = native_bsdf.mirror(native, self.at.each)
        self.total = self.at.light(self.f_cos) + self.mirror

    @property
    def light(self):
        """The reflected light, averaged over views and channels."""
        return float(self.total.mean())

    def _f_cos(self, model, values, base, scale, which=slice(None)):
        """f cos of a model times `scale` over a Base, or None, at some of the directions."""
        from ..brdfc import model as formulas

        wi, wo = self.at.wi[which], self.at.wo[which]
        f = formulas(model).eval(wi, wo, **values) * scale
        if base:
            left = layer.rest_at(base.rest, self.at.each[:, 2], self.native.roughness)
            below = formulas(base.model).eval(wi, wo, **base.values)
            f = f + below * left[self.at.which[which], None]
        return f * wi[:, 2:]

    def _differences(self, model, values, base, scale):
        """Model minus node: of f cos, and of the mirror reflection's weight."""
        from ..brdfc import model as formulas

        mirror = formulas(model).mirror(self.at.each, **values) * scale
        return self._f_cos(model, values, base, scale) - self.f_cos, mirror - self.mirror

    def _mean(self, differences):
        return float((differences.sum(1) / np.maximum(self.total.sum(1), 1e-9)).mean())

    def misplaced(self, model, values, base=None, scale=1.0):
        """Fraction of the light of point lamps that a model times `scale` over a Base misplaces,
        mean over views and channels."""
        f_cos, mirror = self._differences(model, values, base, scale)
        return self._mean(self.at.light(np.abs(f_cos)) + np.abs(mirror))

    def roughly_misplaced(self, model, values, base=None, scale=1.0):
        """The same from a subset of the directions, in arbitrary units, to compare widths that are
        far apart."""
        few = slice(None, None, _ROUGH_STRIDE)
        off = np.abs(self._f_cos(model, values, base, scale, few) - self.f_cos[few])
        return float((off.sum(1) * self.at.weight[few]).sum())

    def error(self, model, values, base=None, scale=1.0):
        """The same under lamps as wide as windows, from all sides: the error that pictures show."""
        differences = self._differences(model, values, base, scale)
        return self._mean(np.abs(self.at.light_of_lamps(*differences)).sum(1))
