# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates Cycles' Diffuse, Glossy and Principled nodes on NumPy arrays. Independent of bpy.

Directions are unit vectors (..., 3) in a frame whose z axis is the normal: wi points to the light,
wo to the viewer. The formulas are those of Cycles 4.5 to 5.2 (kernel/closure/bsdf_microfacet.h,
bsdf_oren_nayar.h); tests/blender/test_convert.py compares them with its renders.
"""

import functools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

#: Gauss-Legendre cosines and weights for means over the hemisphere, weighted by 2 mu.
_MU, _SHARE = np.polynomial.legendre.leggauss(8)
_MU = (_MU + 1) / 2
_SHARE = _SHARE * _MU


#: Cosine of 82 degrees, where an edge tint counts most.
TINTED = 1 / 7
#: The reflectance at normal incidence of an interface with an IOR of 1,000.
_MOST_F0 = 0.996
#: A node with a smaller roughness is an ideal mirror.
SMOOTH = 1e-3


@dataclass(frozen=True)
class Native:
    """A node with its values. `kind`: diffuse, glossy or principled. Colours are (r, g, b) and may
    exceed 1; Cycles then reflects more light than arrives."""

    kind: str
    color: tuple
    roughness: float = 0.0
    #: Ratio of the lobe's width along the tangent to its width across it.
    stretch: float = 1.0
    beckmann: bool = False
    #: Whether the distribution is Multiscatter GGX, which adds interreflection between microfacets.
    multiscatter: bool = True
    metallic: float = 0.0
    #: Reflectance of the dielectric interface at normal incidence.
    f0: float = 0.04
    #: Roughness of the diffuse base of a Principled node.
    diffuse_roughness: float = 0.0
    #: Specular Tint of a Principled node: a factor of a metal's reflectance at 82 degrees, and of a
    #: dielectric's at normal incidence.
    tint: tuple = (1.0, 1.0, 1.0)

    @property
    def alpha(self):
        """Along and across the tangent. Cycles clamps both."""
        width = self.roughness**2
        return min(width * self.stretch**0.5, 1.0), min(width / self.stretch**0.5, 1.0)

    @property
    def mean_alpha(self):
        """The equal roughnesses by which Cycles looks up albedos."""
        mean = (self.alpha[0] * self.alpha[1]) ** 0.5
        return mean, mean

    @property
    def is_matte(self):
        """Whether it has no highlight."""
        plastic = self.kind == "principled" and self.metallic == 0
        return self.kind == "diffuse" or plastic and self.f0 == 0

    @property
    def is_mirror(self):
        return self.kind != "diffuse" and self.roughness < SMOOTH


def dielectric(f0, cosine):
    """Fresnel reflectance of a dielectric with reflectance f0 at normal incidence."""
    # The largest IOR that Blender's nodes take is 1,000.
    root = np.minimum(f0, _MOST_F0) ** 0.5
    eta = (1 + root) / (1 - root)
    c = np.clip(cosine, 0, 1)
    g = np.sqrt(np.maximum(eta**2 - 1 + c**2, 0))
    # Without refraction (IOR 1) at grazing angles both terms are 0.
    a = (g - c) / np.maximum(g + c, 1e-12)
    b = (c * (g + c) - 1) / np.maximum(c * (g - c) + 1, 1e-12)
    return 0.5 * a**2 * (1 + b**2)


def mean_dielectric(f0):
    """The cosine-weighted mean of dielectric() over the hemisphere."""
    return float((dielectric(f0, _MU) * _SHARE).sum())


def tinted_dielectric(reflectance, f0, tint):
    """A reflectance of dielectric() or mean_dielectric() where that at normal incidence has a tint:
    (..., n) for n tints."""
    tinted, real = f0 * np.asarray(tint, np.float64), np.minimum(f0, _MOST_F0)
    # With an IOR above 3.7 the reflectance first falls from normal incidence on; Cycles' does not.
    share = np.maximum((np.asarray(reflectance)[..., None] - real) / (1 - real), 0)
    return tinted + (1 - tinted) * share


def gloss_fresnel(native, cosine):
    """Reflectance (..., 3) of the interface of a Principled node."""
    return tinted_dielectric(dielectric(native.f0, cosine), native.f0, native.tint)


def mean_gloss_fresnel(native):
    """The cosine-weighted mean of gloss_fresnel() over the hemisphere."""
    return tinted_dielectric(mean_dielectric(native.f0), native.f0, native.tint)


def _clamp_to_one(color):
    """Cycles clamps the colour of metal microfacets and of multiple scattering to 1."""
    return np.minimum(color, 1)


def schlick(color, cosine):
    color = _clamp_to_one(color)
    return color + (1 - color) * (1 - np.clip(cosine, 0, 1)[..., None]) ** 5


def mean_schlick(color):
    """The cosine-weighted mean of schlick() over the hemisphere."""
    return (20 * _clamp_to_one(color) + 1) / 21


def _edge_loss(native):
    """The factor of cos (1 - cos)^6 that a metal's Specular Tint takes from schlick()."""
    strongest = TINTED * (1 - TINTED) ** 6
    return (1 - _clamp_to_one(native.tint)) * schlick(native.color, np.array(TINTED)) / strongest


def flat_tint(color):
    """The edge tint with which `microfacet` reflects the same at 82 degrees as at normal
    incidence."""
    found = _clamp_to_one(color) / schlick(color, np.array(TINTED))
    return tuple(float(c) for c in found)


def metal_fresnel(native, cosine):
    """Reflectance of a metal: Schlick's with an edge tint, after Kutz et al. 2021."""
    c = np.clip(cosine, 0, 1)[..., None]
    return np.clip(schlick(native.color, cosine) - _edge_loss(native) * c * (1 - c) ** 6, 0, 1)


def mean_metal_fresnel(native):
    """The cosine-weighted mean of metal_fresnel(), as Cycles computes it."""
    return np.clip(mean_schlick(native.color) - _edge_loss(native) / 126, 0, 1)


def _shadow(w, alpha, beckmann):
    """Smith's Lambda of directions."""
    return _shadow_of(w[..., 0], w[..., 1], w[..., 2], alpha, beckmann)


def _shadow_of(x, y, z, alpha, beckmann):
    """The same, given coordinates."""
    slope = ((alpha[0] * x) ** 2 + (alpha[1] * y) ** 2) / z**2
    if not beckmann:
        return (np.sqrt(1 + slope) - 1) / 2
    a = 1 / np.sqrt(np.maximum(slope, 1e-14))
    return np.where(a < 1.6, (1 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a), 0)


def distribution(h, alpha, beckmann):
    """Microfacet normal distribution D(h), per solid angle and projected area."""
    t = (h[..., 0] / alpha[0]) ** 2 + (h[..., 1] / alpha[1]) ** 2
    z2 = np.maximum(h[..., 2], 1e-9) ** 2
    if beckmann:
        return np.exp(-t / z2) / (np.pi * alpha[0] * alpha[1] * z2**2)
    return 1 / (np.pi * alpha[0] * alpha[1] * (t + z2) ** 2)


def half(wi, wo):
    h = wi + wo
    return h / np.maximum(np.linalg.norm(h, axis=-1, keepdims=True), 1e-12)


def facets(wi, wo, alpha, beckmann=False):
    """f cos(theta_i) of microfacets with a reflectance of 1."""
    shadow = 1 + _shadow(wi, alpha, beckmann) + _shadow(wo, alpha, beckmann)
    return distribution(half(wi, wo), alpha, beckmann) / (4 * wo[..., 2] * shadow)


def refracting_facets(wi, wo, alpha, ior):
    """f |cos(theta_i)| of GGX facets for light from below, wi.z < 0, in a medium with this relative
    IOR; as Cycles evaluates them. Walter et al. 2007, eq. 21, with masking whose heights are
    correlated; f counts energy, as models do."""
    h = -(wo + ior * wi)
    length = np.linalg.norm(h, axis=-1)
    h = h * (np.sign(h[..., 2]) / np.maximum(length, 1e-12))[..., None]
    of_o, of_i = (h * wo).sum(-1), (h * wi).sum(-1)
    passes = (of_o > 0) & (of_i < 0)
    left = 1 - dielectric(((ior - 1) / (ior + 1)) ** 2, of_o)
    shadow = 1 + _shadow(wi, alpha, False) + _shadow(wo, alpha, False)
    jacobian = ior**2 * of_o * -of_i / np.maximum(length, 1e-12) ** 2
    return passes * left * distribution(h, alpha, False) * jacobian / (wo[..., 2] * shadow)


def draw_facets(u, alpha, beckmann=False):
    """Samples microfacet normals (n, 3) in proportion to D(h) cos, from numbers u (n, 2)."""
    r = np.sqrt(-np.log1p(-u[:, 0])) if beckmann else np.sqrt(u[:, 0] / (1 - u[:, 0]))
    phi = 2 * np.pi * u[:, 1]
    h = np.stack([alpha[0] * r * np.cos(phi), alpha[1] * r * np.sin(phi), np.ones_like(r)], -1)
    return h / np.linalg.norm(h, axis=-1, keepdims=True)


@functools.cache
def _numbers(count):
    i = np.arange(count) + 0.5
    return np.stack([i / count, (i * 0.6180339887498949) % 1], -1)


@functools.lru_cache(maxsize=4)
def _drawn_facets(views, alpha, beckmann):
    """Cosines of views (n, 3), as bytes, to sampled microfacets, and weights of these for means:
    (n, samples) each. Cached, as several albedos of one surface are asked for in turn."""
    wo = np.frombuffer(views).reshape(-1, 3)
    h = draw_facets(_numbers(2048), alpha, beckmann)
    # Coordinate by coordinate, which takes half the time.
    (x, y, z), (hx, hy, hz) = wo.T[:, :, None], h.T
    cosine = np.maximum(x * hx + y * hy + z * hz, 0)
    twice = 2 * cosine
    up = twice * hz - z
    lit = (cosine > 0) & (up > 1e-6)
    up = np.where(lit, up, 1)
    of_light = _shadow_of(twice * hx - x, twice * hy - y, up, alpha, beckmann)
    shadow = 1 + of_light + _shadow(wo, alpha, beckmann)[:, None]
    return cosine, np.where(lit, cosine / (z * hz * shadow), 0)


def facet_albedo(wo, alpha, beckmann, reflectance=None):
    """Directional albedo, seen from wo (n, 3), of microfacets without interreflection: (n,) if they
    reflect everything; (n, ...) if `reflectance` gives their reflectance by the cosine."""
    cosine, weight = _drawn_facets(np.ascontiguousarray(wo, float).tobytes(), alpha, beckmann)
    if reflectance is None:
        return weight.mean(1)
    return np.einsum("ns,ns...->n...", weight, reflectance(cosine)) / weight.shape[1]


@functools.lru_cache(maxsize=64)
def mean_facet_albedo(alpha):
    """The cosine-weighted mean of the GGX facet_albedo() over all views. Cached, as every width
    that a candidate is tried with asks for it."""
    views = np.stack([np.sqrt(1 - _MU**2), np.zeros(len(_MU)), _MU], -1)
    return (facet_albedo(views, alpha, False) * _SHARE).sum()


def interreflection(average, mean):
    """The share of the light that microfacets would reflect again which they do reflect. `average`:
    mean reflectance of a microfacet. `mean`: albedo of microfacets that reflect everything,
    averaged over views."""
    return average * mean / (1 - average * (1 - mean))


def multiple_scattering_factor(average, mean, seen):
    """The factor by which multiple scattering between microfacets raises the albedo. `seen`: as
    `mean`, from the viewer."""
    return 1 + interreflection(average, mean) * (1 - seen) / seen


def facet_law(native):
    """The slope and offset, (3,) each, of the mean reflectance of a node's microfacets in its
    colour: those of the metal, if it is one."""
    if native.kind == "glossy":
        return np.ones(3), np.zeros(3)
    if native.metallic == 0:
        return np.zeros(3), mean_gloss_fresnel(native)
    black, white = (mean_metal_fresnel(replace(native, color=c)) for c in ((0.0,) * 3, (1.0,) * 3))
    return white - black, black


def again(native):
    """The interreflection() of a node with Multiscatter GGX, as a colour."""
    slope, offset = facet_law(native)
    average = slope * _clamp_to_one(native.color) + offset
    found = interreflection(average, mean_facet_albedo(native.mean_alpha))
    return tuple(float(c) for c in np.clip(found, 0, 1))


def _multiscatter(wo, native, average):
    """The factor (n, 3) of multiple scattering; `average`: mean reflectance of a microfacet."""
    if not native.multiscatter or native.beckmann:
        return np.ones((len(wo), 3))
    average = np.broadcast_to(average, 3)
    seen = facet_albedo(wo, native.mean_alpha, False)[:, None]
    return multiple_scattering_factor(average, mean_facet_albedo(native.mean_alpha), seen)


def _oren_nayar_G(cosine):
    """The same as bsdf_oren_nayar_G() of Cycles."""
    c = np.clip(cosine, 1e-6, 1)
    s, theta = np.sqrt(1 - c * c), np.arccos(c)
    return s * (theta - 2 / 3 - s * c) + 2 / 3 * (s / c) * (1 - s**3)


def matte(wi, wo, color, roughness):
    """f cos(theta_i) of Cycles' rough diffuse surface (Oren-Nayar), (n, 3)."""
    color = np.asarray(color, np.float64)
    nl, nv = wi[..., 2], wo[..., 2]
    a = 1 / (np.pi + roughness * (np.pi / 2 - 2 / 3))
    b = roughness * a
    if b == 0:
        return color * nl[..., None] / np.pi
    t = (wi * wo).sum(-1) - nl * nv
    t = np.where(t > 0, t / np.maximum(np.maximum(nl, nv), 1e-9), t)
    mean = a * np.pi + (2 * np.pi - 5.6) / 3 * b
    # Only this term clamps the colour. With OSL on, all terms do; but new files have OSL off.
    held = _clamp_to_one(color)
    again = held**2 * (mean / (1 - mean)) / (1 - held * (1 - mean)) / np.pi
    lost = (1 - a * np.pi - b * _oren_nayar_G(nv)) * (1 - a * np.pi - b * _oren_nayar_G(nl))
    # The second term already contains the colour; Cycles multiplies both terms by it nevertheless.
    return nl[..., None] * ((a + b * t)[..., None] + again * lost[..., None]) * color


class ViewTerms(NamedTuple):
    """The quantities of Glossy and Principled that depend on the view alone, for each view."""

    #: Fraction of light that the dielectric interface keeps from the base, (k,): that of the
    #: channel of which it keeps most.
    taken: np.ndarray
    #: Factors of multiple scattering between microfacets of the interface and of metal, (k, 3).
    gloss: np.ndarray
    metal: np.ndarray

    def of(self, which):
        """The same for directions, given the index of each one's view."""
        return ViewTerms(*(each[which] for each in self))


def view_terms(native, each):
    """The ViewTerms of views (k, 3)."""
    none = ViewTerms(np.zeros(len(each)), *np.ones((2, len(each), 3)))
    if native.is_mirror:
        return none._replace(taken=gloss_fresnel(native, each[:, 2]).max(-1))
    color = np.asarray(native.color, np.float64)
    if native.kind == "glossy":
        return none._replace(metal=_multiscatter(each, native, color))
    terms = none
    if native.metallic < 1:
        taken = facet_albedo(each, native.mean_alpha, False, lambda c: gloss_fresnel(native, c))
        if native.multiscatter:
            gloss = _multiscatter(each, native, mean_gloss_fresnel(native))
            terms = terms._replace(taken=(taken * gloss).max(-1), gloss=gloss)
        else:
            # Cycles keeps from the base what facets would reflect if they hid no light.
            whole = facet_albedo(each, native.mean_alpha, False)
            terms = terms._replace(taken=taken.max(-1) / whole)
    if native.metallic > 0:
        terms = terms._replace(metal=_multiscatter(each, native, mean_metal_fresnel(native)))
    return terms


def f_cos(native, wi, wo, views):
    """f cos(theta_i), (n, 3), without ideal mirror reflection. `views`: the distinct wo (k, 3), and
    for each direction the index of its wo, (n,), as numpy.unique() returns them."""
    if native.kind == "diffuse":
        return matte(wi, wo, native.color, native.roughness)
    each, which = views
    return f_cos_of_view(native, wi, wo, view_terms(native, each).of(which))


def f_cos_of_view(native, wi, wo, terms):
    """The same for Glossy and Principled, given the ViewTerms of each wo."""
    lobe = np.zeros(len(wi)) if native.is_mirror else facets(wi, wo, native.alpha, native.beckmann)
    lobe = lobe[:, None]
    color = np.asarray(native.color, np.float64)
    if native.kind == "glossy":
        return color * lobe * terms.metal
    cosine = (wo * half(wi, wo)).sum(-1)
    base = matte(wi, wo, color, native.diffuse_roughness) * (1 - terms.taken)[:, None]
    plastic = base + lobe * gloss_fresnel(native, cosine) * terms.gloss
    metal = lobe * metal_fresnel(native, cosine) * terms.metal
    return (1 - native.metallic) * plastic + native.metallic * metal


def albedo(native, each, terms):
    """Directional albedo (k, 3) of a Principled node with a smooth base, including ideal mirror
    reflection, given the ViewTerms of views (k, 3)."""
    color = np.asarray(native.color, np.float64)
    seen, metal = terms.taken, 0.0
    if native.is_mirror:
        metal = metal_fresnel(native, each[:, 2])
    else:
        if native.metallic < 1 and not native.multiscatter:
            seen = seen * facet_albedo(each, native.alpha, False)
        if native.metallic > 0:
            metal = facet_albedo(each, native.alpha, False, lambda c: metal_fresnel(native, c))
            metal = metal * terms.metal
    plastic = seen[:, None] + color * (1 - terms.taken)[:, None]
    return (1 - native.metallic) * plastic + native.metallic * metal


def mirror(native, wo):
    """Weight of the ideal mirror reflection of a node without roughness, (n, 3)."""
    if not native.is_mirror:
        return np.zeros((len(wo), 3))
    if native.kind == "glossy":
        return np.broadcast_to(np.asarray(native.color, np.float64), (len(wo), 3))
    plastic = gloss_fresnel(native, wo[:, 2])
    return (1 - native.metallic) * plastic + native.metallic * metal_fresnel(native, wo[:, 2])
