# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the Principled node nearest to a material. Independent of bpy.

The node has no coat, sheen and the like: only roughness, metallic, IOR and base colour, or all of
the transmission. The first three are searched on a grid; the colour follows by least squares. Nodes
are evaluated by the formulas of native_bsdf.py, and the error is that of these formulas. A rough
node is fitted to a curve in the plane of incidence. A smooth node, which has ideal mirror
reflection, is fitted to albedos over the view angle.
"""

import dataclasses
import functools
import itertools
from dataclasses import dataclass

import numpy as np

from . import native_bsdf
from .native_bsdf import Native

#: The search grid. Roughness is refined between grid points.
_ROUGHNESS = np.geomspace(1, 0.03, 28)
_METALLIC = np.linspace(0, 1, 5)
#: The first IOR is that of a node whose IOR is unknown, as for a metal.
_IOR = np.array([1.5, 1.0, 1.2, 1.35, 1.8, 2.4, 3.5])
_F0 = ((_IOR - 1) / (_IOR + 1)) ** 2

#: Fraction of a curve's square that a partly metallic node, or another IOR, must improve the fit
#: by.
_PLAIN = 2e-5


@dataclass(frozen=True)
class Nearest:
    roughness: float
    metallic: float
    ior: float
    color: tuple
    #: f cos of the node over the angles of the curve, (N, 3).
    curve: np.ndarray
    #: Fraction of the light from INCIDENCE that the node misplaces.
    error: float
    #: Whether the base transmits: the input Transmission is 1. Each time light passes, it is
    #: multiplied by the root of the base colour.
    transmission: bool = False
    #: Fractions (3,) of light from INCIDENCE that are ideally reflected and refracted.
    mirror: tuple = (0.0, 0.0, 0.0)
    refracted: tuple = (0.0, 0.0, 0.0)

    @property
    def native(self):
        """With the colour that light gets which passes the surface once, if the base transmits."""
        color = tuple(np.sqrt(self.color)) if self.transmission else self.color
        return _native(self.roughness, self.metallic, self.ior, color)


#: The node that reflects nothing, which no search finds.
BLACK = Nearest(1.0, 0.0, 1.0, (0.0, 0.0, 0.0), np.zeros((0, 3)), 0.0)


@dataclass(frozen=True)
class Shares:
    """Fractions of the light from some views that are ideally reflected, scattered, and ideally
    refracted: (..., 3) each."""

    mirror: np.ndarray
    scattered: np.ndarray
    refracted: np.ndarray


def _native(roughness, metallic, ior, color):
    f0 = ((ior - 1) / (ior + 1)) ** 2
    return Native("principled", color, roughness, metallic=metallic, f0=f0)


def node_slice(native, wi, wo):
    """f cos of a node for one direction wo (3,) and directions wi (N, 3)."""
    views = wo[None], np.zeros(len(wi), int)
    return native_bsdf.f_cos(native, wi, np.broadcast_to(wo, wi.shape), views)


def misplaced(found, curve, area):
    """Fraction of the area of a curve (N, 3) that another curve misplaces; `area`: weight of each
    angle."""
    return float((area @ np.abs(found - curve)).sum() / (area @ curve).sum())


class Search:
    """Fits nodes to curves over directions wi (N, 3) in the plane of wo, sorted by angle."""

    def __init__(self, wi, wo, angles):
        self.wi, self.wo = wi, wo
        self.area = np.gradient(angles)
        half = native_bsdf.half(wi, wo)
        cosine = half @ wo
        self._base = np.maximum(wi[:, 2], 0) / np.pi
        self._edge = (1 - np.clip(cosine, 0, 1)) ** 5
        self._fresnel = np.stack([native_bsdf.dielectric(f0, cosine) for f0 in _F0])
        # Albedos of microfacets: reflecting everything, from wo and on average; and with each IOR's
        # Fresnel reflectance.
        knots = np.linspace(_ROUGHNESS[-1], 1, 12)
        seen, mean, taken = [], [], []
        for r in knots:
            alpha = (r * r, r * r)
            seen.append(native_bsdf.facet_albedo(wo[None], alpha, False)[0])
            mean.append(native_bsdf.mean_facet_albedo(alpha))
            taken.append(
                native_bsdf.facet_albedo(
                    wo[None],
                    alpha,
                    False,
                    lambda c: np.stack([native_bsdf.dielectric(f0, c) for f0 in _F0], -1),
                )[0]
            )
        seen, mean = np.array(seen)[:, None], np.array(mean)[:, None]
        average = np.array([native_bsdf.mean_dielectric(f0) for f0 in _F0])
        self._gloss = native_bsdf.multiple_scattering_factor(average, mean, seen)
        self._albedos = knots, np.concatenate([seen, mean, taken * self._gloss], 1)
        self._coarse = self._parts(_ROUGHNESS)

    def _parts(self, roughness):
        """For each roughness: the curves that a node is a linear combination of, as rows, weighted
        by the square roots of the angles' areas; their scalar products; and albedos (from wo,
        average, for each IOR)."""
        wo = np.broadcast_to(self.wo, self.wi.shape)
        knots, albedos = self._albedos
        rows = []
        for r in roughness:
            lobe = native_bsdf.facets(self.wi, wo, (r * r, r * r))
            metal = np.stack([(1 - self._edge) * lobe, self._edge * lobe])
            gloss = [np.interp(r, knots, column) for column in self._gloss.T]
            fresnel = np.array(gloss)[:, None] * self._fresnel
            rows.append(np.concatenate([self._base[None], metal, fresnel * lobe]))
        rows = np.stack(rows) * np.sqrt(self.area)
        found = np.stack([np.interp(roughness, knots, column) for column in albedos.T], -1)
        return roughness, rows, rows @ rows.transpose(0, 2, 1), found

    def _around(self, roughness, factor, count):
        """_parts() for `count` values from roughness times factor to roughness over factor."""
        grid = roughness * np.geomspace(factor, 1 / factor, count)
        return self._parts(np.clip(grid, _ROUGHNESS[-1], _ROUGHNESS[0]))

    def _best(self, parts, curve, metallic, which):
        """The roughness, metallic, index of IOR and colour with the least squared error, among
        `metallic` and the indices `which` into _F0."""
        roughness, rows, products, albedos = parts
        onto = rows @ (curve * np.sqrt(self.area)[:, None])  # (roughness, rows, 3)
        # Axes: roughness, IOR, metallic, channel.
        seen, mean = (albedos[:, i, None, None, None] for i in (0, 1))
        taken = albedos[:, 2:][:, which, None, None]
        m = metallic[None, None, :, None]
        matte = (1 - m) * (1 - taken)

        def product(i, j):
            """Scalar product of two rows; row 3 stands for the dielectric highlight of each IOR."""
            if i != 3 and j != 3:
                return products[:, i, j, None, None, None]
            at = 3 + which
            if i == j:
                return products[:, at, at, None, None]
            return products[:, at, i if j == 3 else j, None, None]

        def along(i):
            return onto[:, 3 + which, None] if i == 3 else onto[:, i, None, None]

        def dot(a, b):
            return sum(x * y * product(i, j) for i, x in a.items() for j, y in b.items())

        # The node is color * slope + rest. Multiple scattering depends on the colour: three
        # iterations.
        color = np.full((1, 1, 1, 3), 0.8)
        for _ in range(3):
            more = native_bsdf.multiple_scattering_factor(
                native_bsdf.mean_schlick(color), mean, seen
            )
            slope, rest = {0: matte, 1: m * more}, {2: m * more, 3: 1 - m}
            square = dot(slope, slope)
            with_curve = sum(x * along(i) for i, x in slope.items()) - dot(slope, rest)
            color = np.clip(with_curve / np.maximum(square, 1e-30), 0, 1)
        node = {i: color * slope.get(i, 0) + rest.get(i, 0) for i in range(4)}
        off = dot(node, node) - 2 * sum(x * along(i) for i, x in node.items())
        off = off.sum(-1)
        # A curve in one plane fits many nodes nearly as well. Among those a plain node is
        # preferred.
        plain = 4 * m[..., 0] * (1 - m[..., 0]) + (which != 0)[None, :, None]
        off = off + _PLAIN * np.sum(curve**2 * self.area[:, None]) * plain
        r, f, k = np.unravel_index(np.argmin(off), off.shape)
        return float(roughness[r]), float(metallic[k]), int(which[f]), color[r, f, k]

    def nearest(self, curve):
        """The Nearest node to a curve (N, 3), which must not be 0 everywhere."""
        every, metallic = np.arange(len(_F0)), _METALLIC
        r, m, _, _ = self._best(self._coarse, curve, metallic, every)
        metallic = np.unique(np.clip(m + np.linspace(-0.25, 0.25, 11), 0, 1))
        step = (_ROUGHNESS[0] / _ROUGHNESS[1]) ** 2
        r, m, index, _ = self._best(self._around(r, step, 25), curve, metallic, every)
        finest = self._around(r, step ** (1 / 12), 9)
        r, m, index, color = self._best(finest, curve, np.array([m]), np.array([index]))
        return self._node(curve, r, m, float(_IOR[index]), color)

    def like(self, near, curve):
        """The Nearest node to a curve among those that differ from `near` in the base colour."""
        parts = self._parts(np.array([near.roughness]))
        which = np.array([int(np.argmin(np.abs(_IOR - near.ior)))])
        color = self._best(parts, curve, np.array([near.metallic]), which)[-1]
        return self._node(curve, near.roughness, near.metallic, near.ior, color)

    def _node(self, curve, roughness, metallic, ior, color):
        color = tuple(float(c) for c in color)
        found = node_slice(_native(roughness, metallic, ior, color), self.wi, self.wo)
        error = misplaced(found, curve, self.area)
        return Nearest(roughness, metallic, ior, color, found, error)


@functools.cache
def _search(incidence, angles):
    theta = np.frombuffer(angles)
    light = np.radians(incidence)
    wi = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1)
    return Search(wi, np.array([-np.sin(light), 0.0, np.cos(light)]), theta)


def nearest_principled(curve, angles, incidence):
    """The rough node Nearest to f cos (N, 3) at these angles, in radians, for light from the angle
    -incidence, in degrees; None for a curve that is 0."""
    if not curve.any():
        return None
    return _search(incidence, angles.tobytes()).nearest(curve)


#: The search grid of smooth nodes, refined between its points.
_SMOOTH_IOR = np.concatenate([[1.5], np.linspace(1, 4, 61)])
_SMOOTH_METALLIC = np.linspace(0, 1, 21)


def _smooth_best(shares, cosines, metallic, ior, through):
    """The metallic, IOR and colour with the least squared error over the hemisphere."""
    m, eta = metallic[None, :, None], ior[:, None, None]
    taken = native_bsdf.dielectric(((eta - 1) / (eta + 1)) ** 2, cosines)
    edge = (1 - cosines) ** 5
    # Both albedos of the node are color * slope + rest; axes: IOR, metallic, view.
    slopes = [m * (1 - edge) + 0 * taken, (1 - m) * (1 - taken)]
    rests = [(1 - m) * taken + m * edge, 0 * m * taken]
    wanted = [shares.mirror, shares.refracted if through else shares.scattered]
    weights = cosines * np.sqrt(1 - cosines**2)
    terms = list(zip(slopes, rests, wanted, strict=True))
    along = sum((weights * a) @ b - ((weights * a) * r).sum(-1)[..., None] for a, r, b in terms)
    square = sum((weights * a * a).sum(-1) for a, _, _ in terms)
    color = np.clip(along / np.maximum(square, 1e-30)[..., None], 0, 1)
    found = [a[..., None] * color[..., None, :] + r[..., None] for a, r, _ in terms]
    off = sum((weights @ (f - b) ** 2).sum(-1) for f, b in zip(found, wanted, strict=True))
    f, k = np.unravel_index(np.argmin(off), off.shape)
    return float(metallic[k]), float(ior[f]), color[f, k]


def _smooth(shares, cosines, through):
    """The same for the smooth node whose Shares (V, 3) at these view cosines come nearest."""
    metallic = np.zeros(1) if through else _SMOOTH_METALLIC
    m, eta, _ = _smooth_best(shares, cosines, metallic, _SMOOTH_IOR, through)
    if not through:
        metallic = np.unique(np.clip(m + np.linspace(-0.05, 0.05, 21), 0, 1))
    ior = np.maximum(eta + np.concatenate([[0], np.linspace(-0.05, 0.05, 41)]), 1)
    return _smooth_best(shares, cosines, metallic, ior, through)


def _smooth_node(curve, search, cosines, shares, here, near=None):
    """The smooth Nearest node, or that with the metallic and IOR of `near`; its error is a fraction
    of all light, from 0 to 2."""
    through = bool(shares.refracted.any())
    if near:
        given = np.array([near.metallic]), np.array([near.ior])
        metallic, ior, color = _smooth_best(shares, cosines, *given, through)
    else:
        metallic, ior, color = _smooth(shares, cosines, through)
    native = _native(0.0, metallic, ior, tuple(map(float, color)))
    each = search.wo[None]
    mirror = native_bsdf.mirror(native, each)[0]
    base = (1 - metallic) * (1 - native_bsdf.view_terms(native, each).taken) * color
    refracted, scattered = (base, 0 * base) if through else (0 * base, base)
    found = np.zeros_like(curve) if through else node_slice(native, search.wi, search.wo)
    off = np.abs(mirror - here.mirror).sum() + np.abs(refracted - here.refracted).sum()
    if curve.any():
        off += here.scattered.sum() * misplaced(found, curve, search.area)
    else:
        off += scattered.sum()
    arrows = tuple(mirror.tolist()), tuple(refracted.tolist())
    color = tuple(map(float, color**2 if through else color))
    return Nearest(0.0, metallic, ior, color, found, float(off), through, *arrows)


#: Angles, in radians, and directions of light below the surface in the plane of incidence.
BELOW = np.linspace(-np.pi / 2, np.pi / 2, 723)[1:-1]
FROM_BELOW = np.stack([np.sin(BELOW), 0 * BELOW, -np.cos(BELOW)], -1)
#: The search grid of rough nodes that transmit, around which finer ones follow.
_FROSTED_ROUGHNESS, _FROSTED_IOR = np.geomspace(1, 0.03, 16), np.linspace(1.05, 2.55, 16)


def _frosted(curve, below, search, near=None):
    """The rough Nearest node that transmits, or that with the roughness and IOR of `near`; `below`:
    as in nearest()."""
    wi = np.concatenate([search.wi, FROM_BELOW])
    area = np.concatenate([search.area, np.gradient(BELOW)])
    wanted, above = np.concatenate([curve, below]), len(search.wi)

    def found(roughness, ior):
        alpha, f0 = (roughness**2,) * 2, ((ior - 1) / (ior + 1)) ** 2
        cosine = native_bsdf.half(search.wi, search.wo) @ search.wo
        wo = np.broadcast_to(search.wo, wi.shape)
        gloss = native_bsdf.dielectric(f0, cosine) * native_bsdf.facets(
            search.wi, wo[:above], alpha
        )
        through = native_bsdf.refracting_facets(FROM_BELOW, wo[above:], alpha, ior)
        square = max(float((area[above:] * through) @ through), 1e-30)
        tint = np.clip((area[above:] * through) @ below / square, 0, 1)
        return tint, np.concatenate([np.stack([gloss] * 3, -1), through[:, None] * tint])

    def off(node):
        return float((area @ (found(*node)[1] - wanted) ** 2).sum())

    def search_all():
        grid = itertools.product(_FROSTED_ROUGHNESS, _FROSTED_IOR)
        roughness, ior = min(grid, key=off)
        for width in (1.0, 0.2):
            around = (
                roughness * np.geomspace(1.25, 0.8, 9) ** width,
                ior + width * np.linspace(-0.1, 0.1, 9),
            )
            grid = itertools.product(np.clip(around[0], 0.02, 1), np.maximum(around[1], 1.0))
            roughness, ior = min(grid, key=off)
        return roughness, ior

    roughness, ior = (near.roughness, near.ior) if near else search_all()
    tint, node = found(roughness, ior)
    color = tuple(map(float, tint**2))
    error = misplaced(node, wanted, area)
    return Nearest(float(roughness), 0.0, float(ior), color, node[:above], error, True)


def nearest(curve, angles, incidence, cosines, shares, here, below):
    """The node Nearest to a material; None if it reflects nothing.

    `curve`: f cos (N, 3) of the material at `angles`, in radians, for light from the angle
    -incidence, in degrees. `below`: the same FROM_BELOW. `shares`: its Shares at the view
    `cosines`; `here`: at the angle of incidence."""
    search = _search(incidence, angles.tobytes())
    if below.any():
        return _frosted(curve, below, search)
    rough = nearest_principled(curve, angles, incidence)
    if not _ideal(here) > 0:
        return rough
    found = _of_all_light(_smooth_node(curve, search, cosines, shares, here), here)
    if rough:
        rough = _without_mirror(rough, here)
        found = min(found, rough, key=lambda node: node.error)
    return found


def like(near, curve, angles, incidence, cosines, shares, here, below):
    """The node Nearest to a material among those that differ from `near`, which nearest() found for
    a material that differs in its colours, in the base colour; other arguments as those of
    nearest()."""
    search = _search(incidence, angles.tobytes())
    if near.roughness == 0:
        return _of_all_light(_smooth_node(curve, search, cosines, shares, here, near), here)
    if near.transmission:
        return _frosted(curve, below, search, near)
    return _without_mirror(search.like(near, curve), here)


def _ideal(here):
    return float(here.mirror.sum() + here.refracted.sum())


def _of_all_light(node, here):
    """A smooth node whose error is a fraction of the light from here that is reflected."""
    return dataclasses.replace(node, error=node.error / (_ideal(here) + here.scattered.sum()))


def _without_mirror(node, here):
    """A rough node beside a material with ideal reflection, all of which it lacks."""
    off = _ideal(here) + float(here.scattered.sum()) * node.error
    return dataclasses.replace(node, error=off / (_ideal(here) + float(here.scattered.sum())))
