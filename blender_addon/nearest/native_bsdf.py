# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles' own Diffuse, Glossy and Principled nodes reflect, on NumPy arrays. No bpy in here.

Directions are unit vectors (..., 3) in a frame whose z axis is the normal: wi to the light, wo to
the viewer. Formulas are those of Cycles 4.5 to 5.2 (kernel/closure/bsdf_microfacet.h,
bsdf_oren_nayar.h); tests/blender/test_convert.py holds them to what it renders.
"""

from dataclasses import dataclass

import numpy as np

#: Cosines and weights of a mean over the hemisphere, of 2 mu d mu.
_MU, _SHARE = np.polynomial.legendre.leggauss(8)
_MU = (_MU + 1) / 2
_SHARE = _SHARE * _MU


@dataclass(frozen=True)
class Native:
    """A node with its values. `kind`: diffuse, glossy or principled; colours are (r, g, b), which
    may be above 1, where Cycles reflects more than there is."""

    kind: str
    color: tuple
    roughness: float = 0.0
    #: Ratio of the lobe's width along the tangent to that across it.
    stretch: float = 1.0
    beckmann: bool = False
    #: Whether light that facets send to and fro comes out at last: the distribution Multiscatter.
    multiscatter: bool = True
    metallic: float = 0.0
    #: Reflectance of the dielectric, seen along the normal.
    f0: float = 0.04
    #: Of the Principled node's base.
    diffuse_roughness: float = 0.0

    @property
    def alpha(self):
        width = self.roughness**2
        return width * self.stretch**0.5, width / self.stretch**0.5

    @property
    def is_mirror(self):
        return self.kind != "diffuse" and self.roughness < 1e-3


def dielectric(f0, cosine):
    """Fresnel's reflectance where that along the normal is f0."""
    eta = (1 + f0**0.5) / (1 - f0**0.5)
    c = np.clip(cosine, 0, 1)
    g = np.sqrt(np.maximum(eta**2 - 1 + c**2, 0))
    # Along the surface of what refracts nothing both are 0.
    a = (g - c) / np.maximum(g + c, 1e-12)
    b = (c * (g + c) - 1) / np.maximum(c * (g - c) + 1, 1e-12)
    return 0.5 * a**2 * (1 + b**2)


def _of_facets(color):
    """The colour of a metal's facets, and of the light between grooves, Cycles holds to 1."""
    return np.minimum(color, 1)


def schlick(color, cosine):
    color = _of_facets(color)
    return color + (1 - color) * (1 - np.clip(cosine, 0, 1)[..., None]) ** 5


def mean_schlick(color):
    """The mean of schlick() over all angles, by their cosines."""
    return (20 * _of_facets(color) + 1) / 21


def _shadow(w, alpha, beckmann):
    """Smith's Lambda."""
    slope = ((alpha[0] * w[..., 0]) ** 2 + (alpha[1] * w[..., 1]) ** 2) / w[..., 2] ** 2
    if not beckmann:
        return (np.sqrt(1 + slope) - 1) / 2
    a = 1 / np.sqrt(np.maximum(slope, 1e-14))
    return np.where(a < 1.6, (1 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a), 0)


def distribution(h, alpha, beckmann):
    """Of facets' normals, per solid angle and projected area."""
    t = (h[..., 0] / alpha[0]) ** 2 + (h[..., 1] / alpha[1]) ** 2
    z2 = np.maximum(h[..., 2], 1e-9) ** 2
    if beckmann:
        return np.exp(-t / z2) / (np.pi * alpha[0] * alpha[1] * z2**2)
    return 1 / (np.pi * alpha[0] * alpha[1] * (t + z2) ** 2)


def half(wi, wo):
    h = wi + wo
    return h / np.maximum(np.linalg.norm(h, axis=-1, keepdims=True), 1e-12)


def facets(wi, wo, alpha, beckmann=False):
    """f cos(theta_i) of facets that reflect all."""
    shadow = 1 + _shadow(wi, alpha, beckmann) + _shadow(wo, alpha, beckmann)
    return distribution(half(wi, wo), alpha, beckmann) / (4 * wo[..., 2] * shadow)


def draw_facets(u, alpha, beckmann=False):
    """Normals (n, 3) of facets, in proportion to distribution() cos, for numbers u (n, 2)."""
    r = np.sqrt(-np.log1p(-u[:, 0])) if beckmann else np.sqrt(u[:, 0] / (1 - u[:, 0]))
    phi = 2 * np.pi * u[:, 1]
    h = np.stack([alpha[0] * r * np.cos(phi), alpha[1] * r * np.sin(phi), np.ones_like(r)], -1)
    return h / np.linalg.norm(h, axis=-1, keepdims=True)


def _numbers(count):
    i = np.arange(count) + 0.5
    return np.stack([i / count, (i * 0.6180339887498949) % 1], -1)


def facet_albedo(wo, alpha, beckmann, reflectance=None):
    """Share of the light that facets reflect, seen from wo (n, 3), and of what they take up on the
    way nothing: (n,) or, as `reflectance` of the cosine at the facet has it, (n, ...)."""
    h = draw_facets(_numbers(2048), alpha, beckmann)[None]
    w = wo[:, None]
    cosine = np.maximum((w * h).sum(-1), 0)
    wi = 2 * cosine[..., None] * h - w
    lit = (cosine > 0) & (wi[..., 2] > 1e-6)
    wi = np.where(lit[..., None], wi, [0.0, 0.0, 1.0])
    shadow = 1 + _shadow(wi, alpha, beckmann) + _shadow(w, alpha, beckmann)
    weight = np.where(lit, cosine / (w[..., 2] * h[..., 2] * shadow), 0)
    if reflectance is None:
        return weight.mean(1)
    color = reflectance(cosine)
    return (weight.reshape(*weight.shape, *[1] * (color.ndim - 2)) * color).mean(1)


def mean_facet_albedo(alpha):
    """The mean over all views, by their cosines, of facet_albedo() of GGX."""
    views = np.stack([np.sqrt(1 - _MU**2), np.zeros(len(_MU)), _MU], -1)
    return (facet_albedo(views, alpha, False) * _SHARE).sum()


def sent_to_and_fro(average, mean, seen):
    """What light between facets adds, as a factor. `average`: mean reflectance of a facet; `mean`
    and `seen`: albedo of facets that reflect all, on average and from the viewer."""
    return 1 + average * mean / (1 - average * (1 - mean)) * (1 - seen) / seen


def _multiscatter(wo, native, average):
    """What to and fro between facets adds, as a factor (n, 3); `average`: mean reflectance."""
    if not native.multiscatter or native.beckmann:
        return np.ones((len(wo), 3))
    seen = facet_albedo(wo, native.alpha, False)[:, None]
    return sent_to_and_fro(np.asarray(average), mean_facet_albedo(native.alpha), seen)


def _grooves(cosine):
    c = np.clip(cosine, 1e-6, 1)
    s, theta = np.sqrt(1 - c * c), np.arccos(c)
    return s * (theta - 2 / 3 - s * c) + 2 / 3 * (s / c) * (1 - s**3)


def matte(wi, wo, color, roughness):
    """f cos(theta_i) of Cycles' rough matte surface, (n, 3)."""
    color = np.asarray(color, np.float64)
    nl, nv = wi[..., 2], wo[..., 2]
    a = 1 / (np.pi + roughness * (np.pi / 2 - 2 / 3))
    b = roughness * a
    if b == 0:
        return color * nl[..., None] / np.pi
    t = (wi * wo).sum(-1) - nl * nv
    t = np.where(t > 0, t / np.maximum(np.maximum(nl, nv), 1e-9), t)
    mean = a * np.pi + (2 * np.pi - 5.6) / 3 * b
    # Under OSL a Diffuse node's colour is held to 1 as a whole; files are made without.
    held = _of_facets(color)
    again = held**2 * (mean / (1 - mean)) / (1 - held * (1 - mean)) / np.pi
    lost = (1 - a * np.pi - b * _grooves(nv)) * (1 - a * np.pi - b * _grooves(nl))
    # The second term has the colour in it already; Cycles multiplies both by it.
    return nl[..., None] * ((a + b * t)[..., None] + again * lost[..., None]) * color


def by_view(native, each):
    """What the view alone decides, for each (k, 3) of Glossy and Principled: the share of the light
    that a dielectric takes from its base (k,), and what to and fro between facets of metal adds, as
    a factor (k, 3)."""
    if native.is_mirror:
        return dielectric(native.f0, each[:, 2]), np.ones((len(each), 3))
    color = np.asarray(native.color, np.float64)
    if native.kind == "glossy":
        return np.zeros(len(each)), _multiscatter(each, native, color)
    taken, scale = np.zeros(len(each)), np.ones((len(each), 3))
    if native.metallic < 1:
        taken = facet_albedo(each, native.alpha, False, lambda c: dielectric(native.f0, c))
    if native.metallic > 0:
        scale = _multiscatter(each, native, mean_schlick(color))
    return taken, scale


def f_cos(native, wi, wo, views):
    """f cos(theta_i), (n, 3), without an ideal mirror's part. `views`: the different wo (k, 3) and
    which of them each is, (n,), as numpy.unique() gives them."""
    if native.kind == "diffuse":
        return matte(wi, wo, native.color, native.roughness)
    each, which = views
    taken, scale = by_view(native, each)
    return f_cos_of_view(native, wi, wo, taken[which], scale[which])


def f_cos_of_view(native, wi, wo, taken, scale):
    """The same of Glossy and Principled, with by_view() of each wo."""
    lobe = np.zeros(len(wi)) if native.is_mirror else facets(wi, wo, native.alpha, native.beckmann)
    lobe = lobe[:, None]
    color = np.asarray(native.color, np.float64)
    if native.kind == "glossy":
        return color * lobe * scale
    cosine = (wo * half(wi, wo)).sum(-1)
    base = matte(wi, wo, color, native.diffuse_roughness) * (1 - taken)[:, None]
    plastic = base + lobe * dielectric(native.f0, cosine)[:, None]
    metal = lobe * schlick(color, cosine) * scale
    return (1 - native.metallic) * plastic + native.metallic * metal


def albedo(native, each, taken, scale):
    """Share of the light, (k, 3), that a Principled node with a smooth base reflects, and with an
    ideal mirror; by_view() of each (k, 3) is known."""
    color = np.asarray(native.color, np.float64)
    plastic, metal = taken[:, None] + color * (1 - taken)[:, None], 0.0
    if native.is_mirror:
        metal = schlick(color, each[:, 2])
    elif native.metallic > 0:
        metal = facet_albedo(each, native.alpha, False, lambda c: schlick(color, c)) * scale
    return (1 - native.metallic) * plastic + native.metallic * metal


def mirror(native, wo):
    """Weight of the ideal mirror that a node without roughness has, (n, 3)."""
    if not native.is_mirror:
        return np.zeros((len(wo), 3))
    if native.kind == "glossy":
        return np.broadcast_to(np.asarray(native.color, np.float64), (len(wo), 3))
    plastic = dielectric(native.f0, wo[:, 2])[:, None]
    return (1 - native.metallic) * plastic + native.metallic * schlick(native.color, wo[:, 2])
