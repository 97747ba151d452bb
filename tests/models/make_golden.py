# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes golden.csv: values of an implementation that shares no code with the generator.

The formulas are typed in from the papers as printed (with the errata in the models' headers) and
evaluated by mpmath with as many digits as they need; albedos are integrated by mpmath. Run it after
adding a model:  python3 tests/models/make_golden.py [MODEL...]
If models are named, the rows of the others stay as they are.

A row's tolerance is the error that rounding the inputs to double precision can cause (measured here
by changing each input by half a unit in the last place), times a small factor, plus a floor.
"""

import csv
import functools
import itertools
import math
import random
import sys
from pathlib import Path

import mpmath as mp
import numpy as np

OUT = Path(__file__).with_name("golden.csv")
FLOOR = 1e-14
ROUNDINGS = 16  # number of such rounding errors that a formula may accumulate


normalise = True


def vec(w):
    v = [mp.mpf(c) for c in w]
    n = mp.sqrt(sum(c * c for c in v)) if normalise else 1
    return [c / n for c in v]


def unit(v):
    n = mp.sqrt(sum(c * c for c in v))
    return [c / n for c in v]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


# ---- Lambert -----------------------------------------------------------------------------------


def lambert_f(p, wi, wo):
    return [c / mp.pi for c in p["rho"]]


def lambert_pdf(p, wi, wo):
    return vec(wi)[2] / mp.pi


# ---- Minnaert 1941 -----------------------------------------------------------------------------


def minnaert_cos(p, cos):
    """The cosine, for k < 1 bounded from below by 1 / 20."""
    return mp.sqrt(cos**2 + (1 - cos**2) / 400) if p["k"] < 1 else cos


def minnaert_f(p, wi, wo):
    k = mp.mpf(p["k"])
    darker = (minnaert_cos(p, vec(wi)[2]) * minnaert_cos(p, vec(wo)[2])) ** (k - 1)
    return [c * (k + 1) / (2 * mp.pi) * darker for c in p["rho"]]


def minnaert_pdf(p, wi, wo):
    k = mp.mpf(p["k"])
    return (k + 1) / (2 * mp.pi) * vec(wi)[2] ** k


def minnaert_albedo(p, cos_o):
    k, seen = mp.mpf(p["k"]), minnaert_cos(p, mp.mpf(cos_o))
    half = mp.quad(lambda c: c * minnaert_cos(p, c) ** (k - 1), [0, 0.02, 0.05, 0.1, 0.3, 1])
    return [c * (k + 1) * seen ** (k - 1) * half for c in p["rho"]]


# ---- Ashikhmin and Shirley, eqs. 5, 10, 11, 12, 14, 15; eq. 18 inverted ------------------------


def as_half(wi, wo):
    k1, k2 = vec(wi), vec(wo)
    return k1, k2, unit([a + b for a, b in zip(k1, k2, strict=True)])


def as_ph(p, h):
    hn = h[2]
    u = [mp.cos(p["rotation"]), mp.sin(p["rotation"])]
    hu = h[0] * u[0] + h[1] * u[1]
    hv = -h[0] * u[1] + h[1] * u[0]
    sin2 = 1 - hn**2
    exponent = 0 if sin2 < mp.mpf(10) ** -30 else (p["nu"] * hu**2 + p["nv"] * hv**2) / sin2
    return mp.sqrt((p["nu"] + 1) * (p["nv"] + 1)) / (2 * mp.pi) * hn**exponent


def as_f(p, wi, wo):
    k1, k2, h = as_half(wi, wo)
    hk = dot(h, k1)
    out = []
    for rs, rd in zip(p["rs"], p["rd"], strict=True):
        f = mp.mpf(0)
        if p["part"] != "diffuse":
            fresnel = rs + (1 - rs) * (1 - hk) ** 5
            f += as_ph(p, h) / (4 * hk * max(k1[2], k2[2])) * fresnel
        if p["part"] != "specular" and p.get("diffuse") == "tabulated":
            exponents = float(p["nu"]), float(p["nv"])
            rest = [as_rest(float(k[2]), as_azimuth(p, k), *exponents, rs) for k in (k1, k2)]
            f += rd * rest[0] * rest[1] / (mp.pi * as_rest_mean(*exponents, rs))
        elif p["part"] != "specular":
            fade = [1 - (1 - k[2] / 2) ** 5 for k in (k1, k2)]
            f += 28 * rd / (23 * mp.pi) * (1 - rs) * fade[0] * fade[1]
        out.append(f)
    return out


def as_azimuth(p, k):
    return math.atan2(k[1], k[0]) - float(p["rotation"])


def gauss(n, a, b):
    x, w = np.polynomial.legendre.leggauss(n)
    return (b - a) / 2 * x + (a + b) / 2, (b - a) / 2 * w


@functools.cache
def as_rest(cos_o, phi_o, nu, nv, rs):
    """1 - R(k) of eq. 12, integrated over half vectors, for exponents that are not large."""
    theta, weight = gauss(300, 0, math.pi / 2)
    theta, weight = theta[:, None], weight[:, None]
    phi = 2 * math.pi * (np.arange(360) + 0.5) / 360
    s, hn = np.sin(theta), np.cos(theta)
    kh = math.sqrt(1 - cos_o**2) * s * np.cos(phi - phi_o) + cos_o * hn
    cos_i = 2 * kh * hn - cos_o
    p_h = np.sqrt((nu + 1) * (nv + 1)) / (2 * np.pi)
    p_h = p_h * hn ** (nu * np.cos(phi) ** 2 + nv * np.sin(phi) ** 2)
    fresnel = rs + (1 - rs) * (1 - np.clip(kh, 0, 1)) ** 5
    kept = np.where((kh > 0) & (cos_i > 0), cos_i / np.maximum(cos_i, cos_o), 0)
    return 1 - float(np.sum(weight * s * p_h * fresnel * kept)) * 2 * math.pi / 360


@functools.cache
def as_rest_mean(nu, nv, rs):
    x, w = gauss(12, 0, 1)
    azimuths = [math.pi / 2 * (i + 0.5) / 6 for i in range(6)]
    rest = [sum(as_rest(c, a, nu, nv, rs) for a in azimuths) / 6 for c in x]
    return float(np.sum(2 * w * x * rest))


def as_pdf(p, wi, wo):
    """For a single part: the probabilities in "both" are the sampler's choice, not the paper's."""
    k1, k2, h = as_half(wi, wo)
    if p["part"] == "specular":
        return as_ph(p, h) / (4 * dot(h, k2))
    if p["part"] == "diffuse":
        return k1[2] / mp.pi
    return None


def as_albedo(p, cos_o):
    """Specular part, rotation 0, view in the x-z plane; integrated over half vectors, where p_h is
    smooth."""
    fp, rs, nu, nv = mp.fp, p["rs"][0], p["nu"], p["nv"]
    sin_o = math.sqrt(1 - cos_o**2)

    def integrand(t, phi):
        # d omega_i = 4 (k.h) d omega_h, so
        # f cos_i d omega_i = p_h F cos_i / max(cos_i, cos_o) d omega_h.
        hn, s, c = math.cos(t), math.sin(t), math.cos(phi)
        kh = sin_o * s * c + cos_o * hn
        cos_i = 2 * kh * hn - cos_o
        if kh <= 0 or cos_i <= 0:
            return 0.0
        p_h = math.sqrt((nu + 1) * (nv + 1)) / (2 * math.pi) * hn ** (nu * c**2 + nv * (1 - c**2))
        return p_h * (rs + (1 - rs) * (1 - kh) ** 5) * cos_i / max(cos_i, cos_o) * s

    def ring(phi):
        # cos_i / cos_o = cos 2t + a sin 2t = r cos(2t - s): the support ends where it is 0, and
        # max() has a kink where it is 1. Between these, the integrand is smooth in theta_h = t; the
        # lobe's width requires cuts as well.
        a = sin_o * math.cos(phi) / cos_o
        r, s = math.hypot(1, a), math.atan(a)
        width = 6 / math.sqrt(max(nu, nv) + 1)
        cuts = {0.0, math.pi / 2, width / 4, width / 2, width}
        for level in (0, 1):
            for sign in (-1, 1):
                cuts.add((s + sign * math.acos(level / r)) / 2 % math.pi)
        inside = sorted(c for c in cuts if 0 <= c <= math.pi / 2)
        ends = [c for c, d in zip(inside, [-1.0, *inside], strict=False) if c - d > 1e-9]
        return fp.quad(lambda t: integrand(t, phi), ends, maxdegree=4)

    a = 2 * fp.quad(ring, [math.pi * k / 8 for k in range(9)], maxdegree=4)
    return [a, a, a]


# ---- Shirley, Smits, Hu and Lafortune, eqs. 1 and 5 with k mended ------------------------------


def coupled_f(p, wi, wo):
    k1, k2 = vec(wi), vec(wo)
    k = 21 * (1 - p["r0"]) / (20 * mp.pi)
    return [k * rm * (1 - (1 - k1[2]) ** 5) * (1 - (1 - k2[2]) ** 5) for rm in p["rm"]]


def coupled_pdf(p, wi, wo):
    """Eq. 6 differentiated: proportional to (1 - (1 - c)^5) c."""
    c = vec(wi)[2]
    return 21 / (20 * mp.pi) * (1 - (1 - c) ** 5) * c


def coupled_albedo(p, cos_o):
    rf = p["r0"] + (1 - p["r0"]) * (1 - mp.mpf(cos_o)) ** 5
    return [rf + rm * (1 - rf) for rm in p["rm"]]


def full_fresnel(r0, c):
    """Unpolarised reflectance by Snell's law and the Fresnel equations, with the index for R_0."""
    s = mp.sqrt(mp.mpf(r0))
    eta = (1 + s) / (1 - s)
    cos_t = mp.sqrt(1 - (1 - c * c) / eta**2)
    rs = (c - eta * cos_t) / (c + eta * cos_t)
    rp = (eta * c - cos_t) / (eta * c + cos_t)
    return (rs**2 + rp**2) / 2


@functools.cache
def mean_transmission(r0):
    """2 integral of (1 - R_f) c dc."""
    with mp.workdps(30):
        ends = [0, mp.mpf("1e-4"), mp.mpf("1e-2"), mp.mpf("0.1"), mp.mpf("0.5"), 1]
        return mp.quad(lambda c: 2 * (1 - full_fresnel(r0, c)) * c, ends)


def coupled_full_f(p, wi, wo):
    if isinstance(p["r0"], mp.mpf):
        mean = mean_transmission(float(p["r0"]))  # smooth in R_0, so rounding changes nothing
    else:
        mean = mean_transmission(p["r0"])
    through = [1 - full_fresnel(p["r0"], vec(w)[2]) for w in (wi, wo)]
    return [rm * through[0] * through[1] / (mp.pi * mean) for rm in p["rm"]]


def coupled_full_albedo(p, cos_o):
    rf = full_fresnel(p["r0"], mp.mpf(cos_o))
    return [rf + rm * (1 - rf) for rm in p["rm"]]


def by_fresnel(schlick_, full):
    return lambda p, *w: (full if p.get("fresnel") == "dielectric" else schlick_)(p, *w)


# ---- Suffern, eqs. 25.1, 25.2 and 25.7 ---------------------------------------------------------


def cos_alpha(wi, wo):
    k1, k2 = vec(wi), vec(wo)
    return k1, k2, dot(k1, [-k2[0], -k2[1], k2[2]])


def gr_pdf(p, wi, wo):
    k1, k2, c = cos_alpha(wi, wo)
    if c <= 0:
        return mp.mpf(0)
    density = (p["e"] + 1) / (2 * mp.pi) * c ** p["e"]
    # The ray that is rotated to k1 originally goes to 2 (r.k1) r - k1.
    folded = p["below"] == "mirror" and 2 * c * k2[2] - k1[2] < 0
    return density * (2 if folded else 1)


def gr_f(p, wi, wo):
    return [p["kr"] * c * gr_pdf(p, wi, wo) / vec(wi)[2] for c in p["cr"]]


def lobe_above(e, cos_o, cosine):
    """Integral of cos^e alpha, optionally times the cosine, over the part of the lobe above the
    surface.

    On a circle about r the cosine is a + b cos(phi), which is positive on an arc known for each
    alpha.
    """
    cos_o, e = mp.mpf(cos_o), mp.mpf(e)
    sin_o = mp.sqrt(1 - cos_o**2)

    def ring(alpha):
        a, b = mp.cos(alpha) * cos_o, mp.sin(alpha) * sin_o
        half = mp.pi if a >= b else mp.acos(-a / b)
        arc = 2 * (a * half + b * mp.sin(half)) if cosine else 2 * half
        return mp.cos(alpha) ** e * mp.sin(alpha) * arc

    whole = mp.acos(sin_o) if sin_o < 1 else mp.mpf(0)  # rings up to here are complete
    width = min(mp.pi / 2, 8 / mp.sqrt(e))
    cuts = sorted({mp.mpf(0), width / 3, width, whole, mp.pi / 2})
    return mp.quad(ring, cuts)


def gr_albedo(p, cos_o):
    kept = mp.mpf(1)
    if p["below"] == "lose":
        kept = (p["e"] + 1) / (2 * mp.pi) * lobe_above(p["e"], cos_o, cosine=False)
    return [p["kr"] * c * kept for c in p["cr"]]


def gs_c(p):
    e = mp.mpf(p["e"])
    scales = {"book": 1, "estimator": (e + 1) / (2 * mp.pi), "conserving": (e + 2) / (2 * mp.pi)}
    return scales[p["normalisation"]] * p["ks"]


def gs_f(p, wi, wo):
    _, _, c = cos_alpha(wi, wo)
    return [gs_c(p) * cs * (c ** p["e"] if c > 0 else 0) for cs in p["cs"]]


def gs_pdf(p, wi, wo):
    return gr_pdf({"e": p["e"], "below": "lose"}, wi, wo)


def gs_albedo(p, cos_o):
    return [gs_c(p) * cs * lobe_above(p["e"], cos_o, cosine=True) for cs in p["cs"]]


def pm_parts(p):
    """The material's highlight and reflection as in the models of those names."""
    specular = {"ks": p["ks"], "cs": p["cs"], "e": p["es"], "normalisation": "book"}
    return specular, {"kr": p["kr"], "cr": p["cr"], "e": p["e"], "below": "mirror"}


def pm_f(p, wi, wo):
    specular, reflection = pm_parts(p)
    matte = [p["kd"] * c / mp.pi for c in p["cd"]]
    parts = matte, gs_f(specular, wi, wo), gr_f(reflection, wi, wo)
    return [sum(c) for c in zip(*parts, strict=True)]


def pm_pdf(p, wi, wo):
    """For a single term: the probabilities of the terms are the sampler's choice."""
    specular, reflection = pm_parts(p)
    of_terms = {"kd": lambert_pdf, "ks": gs_pdf, "kr": gr_pdf}
    terms = [k for k in of_terms if p[k] > 0]
    if len(terms) > 1:
        return None
    return of_terms[terms[0]]({"kd": p, "ks": specular, "kr": reflection}[terms[0]], wi, wo)


def pm_albedo(p, cos_o):
    specular, reflection = pm_parts(p)
    matte = [p["kd"] * c for c in p["cd"]]
    parts = matte, gs_albedo(specular, cos_o), gr_albedo(reflection, cos_o)
    return [sum(c) for c in zip(*parts, strict=True)]


# ---- The three models that Shirley, Smits, Hu and Lafortune compare with, their section 5 ------


def schlick(p, c):
    return p["r0"] + (1 - mp.mpf(p["r0"])) * (1 - c) ** 5


def s91_f(p, wi, wo):
    return [rd * (1 - schlick(p, vec(wo)[2])) / mp.pi for rd in p["rd"]]


def s91_albedo(p, cos_o):
    r = schlick(p, mp.mpf(cos_o))
    return [r + rd * (1 - r) for rd in p["rd"]]


def sd_f(p, wi, wo):
    half = mp.acos(dot(vec(wi), vec(wo))) / 2
    return [rd * (1 - schlick(p, mp.cos(half))) / mp.pi for rd in p["rd"]]


def sd_albedo(p, cos_o):
    fp, sin_o = mp.fp, math.sqrt(1 - cos_o**2)

    def integrand(t, phi):
        cos_angle = math.sin(t) * math.cos(phi) * sin_o + math.cos(t) * cos_o
        cos_half = math.sqrt(max(0.0, (1 + cos_angle) / 2))
        r = p["r0"] + (1 - p["r0"]) * (1 - cos_half) ** 5
        return (1 - r) * math.cos(t) * math.sin(t) / math.pi

    ends = [math.pi * k / 4 for k in range(5)]
    matte = 2 * fp.quad(
        lambda phi: fp.quad(
            lambda t: integrand(t, phi), [0, math.pi / 4, math.pi / 2], maxdegree=4
        ),
        ends,
        maxdegree=4,
    )
    mirror = p["r0"] + (1 - p["r0"]) * (1 - cos_o) ** 5
    return [mirror + rd * matte for rd in p["rd"]]


# ---- Radziszewski and Alda, eqs. 17 to 19, factor 2 and nbar mended -----------------------------


def ra_digits(n):
    return 50 if n == 0 or n >= 1 else 60 + int(-6 * math.log10(n))


def ra_f(p, wi, wo):
    n = p["n"]
    mp.mp.dps = ra_digits(n)
    n = mp.mpf(n)
    ki, ko = vec(wi), vec(wo)
    factor = mp.mpf(1)
    if p["around"] == "refraction":
        # Snell's law maps directions inside (z < 0) to the outside.
        if ki[2] * ko[2] >= 0:
            return [mp.mpf(0)] * 3  # pairs beyond the critical angle are not tested
        if ki[2] < 0:
            factor = mp.mpf(p["ior"]) ** 2
        carried = []
        for k in (ki, ko):
            scale = mp.mpf(p["ior"]) if k[2] < 0 else mp.mpf(1)
            x, y = scale * k[0], scale * k[1]
            if x * x + y * y >= 1:
                return [mp.mpf(0)] * 3
            carried.append([x, y, mp.sqrt(1 - x * x - y * y)])
        ki, ko = carried
    kr = ko if p["around"] == "retro" else [-ko[0], -ko[1], ko[2]]
    si, sr = mp.sqrt(ki[0] ** 2 + ki[1] ** 2), mp.sqrt(kr[0] ** 2 + kr[1] ** 2)
    x, y = ki[2] ** 2, kr[2] ** 2
    n_theta = p["n_theta"] if p["proportion"] == "custom" else n
    n_theta = mp.mpf(n_theta)
    if p["proportion"] == "paper":
        n_phi = mp.mpf("0.75") * n * mp.sqrt(n * si * sr)
    else:
        n_phi = n if p["proportion"] == "equal" else mp.mpf(p["n_phi"])
    if n_theta == 0:
        f_theta = mp.mpf(2)
    else:
        m = 2 * mp.log(mp.cosh(n_theta))
        # tanh^2 n = 1 - e^-m, so that the printed denominator is this difference of exponentials.
        d = mp.exp(-m * x) + mp.exp(-m * y) - mp.exp(-m * (x + y)) - mp.exp(-m)
        f_theta = 2 * m * mp.tanh(n_theta) ** 2 * mp.exp(-m * (x + y)) / d**2
    nbar = n_phi * si * sr
    if si == 0 or sr == 0:
        cos_dphi = mp.mpf(1)
    else:
        cos_dphi = (ki[0] * kr[0] + ki[1] * kr[1]) / (si * sr)
    p5 = sum(mp.mpf(c) * nbar**k for k, c in enumerate((1, 5, 15, 25, "21.875", "7.875")))
    f_phi = (2 * nbar + 1) ** mp.mpf("5.5") / (2 * mp.pi * p5)
    f_phi /= (nbar * (1 - cos_dphi) + 1) ** 6
    if p["part"] == "latitudinal":
        f = f_theta / (2 * mp.pi)
    elif p["part"] == "longitudinal":
        f = 2 * f_phi
    else:
        f = f_theta * f_phi
    return [factor * f * c for c in p["tint"]]


def ra_pdf(p, wi, wo):
    """The cosine-weighted lobe."""
    white = dict(p, tint=(1, 1, 1))
    return ra_f(white, wi, wo)[0] * abs(vec(wi)[2])


# ---- The same paper's construction, eqs. 9 to 13, from a kernel, by numerical integrals ----------


HEIGHTS = ["h0", "h1", "h2", "h3"]


def kernel(name, heights, u):
    u = abs(u)
    if name == "table":
        i = min(int(u), 3)
        return heights[3] if i == 3 else heights[i] + (heights[i + 1] - heights[i]) * (u - i)
    return mp.exp(-u) if name == "exponential" else mp.sech(u) ** 2


@functools.cache
def lossless_place(name, heights, n, x):
    """x' whose marginal is x, the marginal's density there, and the kernel's integral over the
    square."""
    # Cuts at the peak, at a curve's knots, and where it has decayed.
    peak = [s * w / n for s in (-1, 1) for w in (1, 2, 3, 4, 5, 12, 30, 60)] + [0]

    def integral(of, low, high, *cuts):
        ends = {low, high, *peak, *cuts}
        return mp.quad(of, sorted(e for e in ends if low <= e <= high))

    def density(t):
        return integral(lambda d: kernel(name, heights, n * d), -t, 1 - t)

    def mass(t):
        """Integral over the strip below t: by the difference d, weighted by the length of the line
        on which it is d."""
        return integral(
            lambda d: kernel(name, heights, n * d) * (min(t, 1 - d) - max(0, -d)),
            -t,
            mp.mpf(1),
            1 - t,
        )

    whole = mass(mp.mpf(1))
    # Newton's method in a bracket, as the density is known.
    low, high, at = mp.mpf(0), mp.mpf(1), x
    for _ in range(60):
        error = mass(at) / whole - x
        low, high = (at, high) if error < 0 else (low, at)
        step = error * whole / density(at)
        at = at - step if low < at - step < high else (low + high) / 2
        if abs(step) < mp.mpf(10) ** -20:
            break
    return at, density(at), whole


def lossless_f(p, wi, wo):
    ki, ko = vec(wi), vec(wo)
    if p["n"] == 0:
        return [c / mp.pi for c in p["tint"]]
    mp.mp.dps, n = 24, mp.mpf(p["n"])
    heights = tuple(mp.mpf(p[k]) for k in HEIGHTS) if p["kernel"] == "table" else ()
    shape = p["kernel"], heights
    a, ma, whole = lossless_place(*shape, n, ki[2] ** 2)
    b, mb, _ = lossless_place(*shape, n, ko[2] ** 2)
    f_theta = 2 * kernel(*shape, n * (a - b)) * whole / (ma * mb)
    return [f_theta / (2 * mp.pi) * c for c in p["tint"]]


def lossless_pdf(p, wi, wo):
    return lossless_f({**p, "tint": (1, 1, 1)}, wi, wo)[0] * vec(wi)[2]


# ---- Fresnel's equations by complex numbers ------------------------------------------------------


def fresnel(c, eta):
    """Mean reflectance of both polarisations for a complex relative index."""
    c = mp.mpf(c)
    root = mp.sqrt(eta**2 - 1 + c**2)
    rs, rp = (c - root) / (c + root), (eta**2 * c - root) / (eta**2 * c + root)
    return (abs(rs) ** 2 + abs(rp) ** 2) / 2


def dielectric_albedo(p, cos_o):
    """A boundary absorbs nothing: what is not reflected is transmitted, but for tints."""
    white = (1, 1, 1)
    kept = p.get("reflected", white), p.get("refracted", white)
    if kept == (white, white):
        return [mp.mpf(1)] * 3
    mirror = fresnel(cos_o, mp.mpf(p["ior"]))
    return [mirror * a + (1 - mirror) * b for a, b in zip(*kept, strict=True)]


def conductor_albedo(p, cos_o):
    return [fresnel(cos_o, mp.mpc(p[f"n_{c}"], p[f"k_{c}"])) for c in "rgb"]


# ---- Lobes around the mirror direction: Phong, modified Phong, max-Phong ------------------------


def mirror_cosine(wi, wo):
    ki, ko = vec(wi), vec(wo)
    return max(ki[2] * ko[2] - ki[0] * ko[0] - ki[1] * ko[1], mp.mpf(0))


def phong_lobe(p, wi, wo):
    c = mirror_cosine(wi, wo)
    return c ** p["e"] if c > 0 else mp.mpf(0)


def phong_f(p, wi, wo):
    return [k * phong_lobe(p, wi, wo) / vec(wi)[2] for k in p["ks"]]


def modified_phong_f(p, wi, wo):
    return [k * (mp.mpf(p["e"]) + 2) / (2 * mp.pi) * phong_lobe(p, wi, wo) for k in p["ks"]]


def max_phong_f(p, wi, wo):
    larger = max(vec(wi)[2], vec(wo)[2])
    return [k * phong_pdf(p, wi, wo) / larger for k in p["ks"]]


def phong_pdf(p, wi, wo):
    return (mp.mpf(p["e"]) + 1) / (2 * mp.pi) * phong_lobe(p, wi, wo)


def lobe_albedo(e, axis_cos, ring, breaks=()):
    """Integral over directions above the horizon of cos^e alpha times a function of cos theta_i.

    ring(up, side, a) is that function's integral over the circle at alpha, where cos theta_i = up +
    side cos b, for |b| < a."""
    c, s = mp.mpf(axis_cos), mp.sqrt(1 - mp.mpf(axis_cos) ** 2)

    def circle(t):
        up, side = mp.cos(t) * c, mp.sin(t) * s
        if up >= side:
            a = mp.pi
        else:
            a = mp.acos(-up / side)
        return mp.sin(t) * mp.cos(t) ** e * ring(up, side, a)

    width = 4 / mp.sqrt(e + 1)
    cuts = {mp.mpf(0), mp.pi / 2, mp.asin(c), *breaks}
    cuts |= {k * width for k in (0.25, 0.5, 1, 2)}
    return mp.quad(circle, sorted(t for t in cuts if 0 <= t <= mp.pi / 2))


def phong_albedo(p, cos_o):
    a = lobe_albedo(p["e"], cos_o, lambda up, side, a: 2 * a)
    return [k * a for k in p["ks"]]


def modified_phong_albedo(p, cos_o):
    def ring(up, side, a):
        return 2 * (up * a + side * mp.sin(a))

    e = p["e"]
    a = (e + 2) / (2 * mp.pi) * lobe_albedo(e, cos_o, ring)
    return [k * a for k in p["ks"]]


def max_phong_albedo(p, cos_o):
    """The integral of min(1, cos theta_i / cos theta_o)."""
    o = mp.mpf(cos_o)

    def ring(up, side, a):
        if side == 0:
            return 2 * a * min(mp.mpf(1), up / o)
        b = mp.acos(min(max((o - up) / side, mp.mpf(-1)), mp.mpf(1)))
        b = min(b, a)
        return 2 * (b + (up * (a - b) + side * (mp.sin(a) - mp.sin(b))) / o)

    e = p["e"]
    double = 2 * mp.acos(o)
    kink = [double] if double < mp.pi / 2 else []
    a = (e + 1) / (2 * mp.pi) * lobe_albedo(e, cos_o, ring, kink)
    return [k * a for k in p["ks"]]


# ---- Blinn; Cook and Torrance ------------------------------------------------------------------


def half(wi, wo):
    ki, ko = vec(wi), vec(wo)
    h = unit([a + b for a, b in zip(ki, ko, strict=True)])
    return ki, ko, h, dot(h, ko)


def cavity(hn, oh, ni, no):
    return min(1, 2 * hn * ni / oh, 2 * hn * no / oh)


def blinn_d(p, hn):
    e = mp.mpf(p["e"])
    return (e + 2) / (2 * mp.pi) * hn**e


# Mitsuba 3.9's Beckmann distribution agrees with beckmann_d, and its anisotropic version with
# ward_gaussian, to single precision (1.5e-6).
def beckmann_d(p, hn):
    m2 = mp.mpf(p["m"]) ** 2
    return mp.exp(-(1 - hn**2) / hn**2 / m2) / (mp.pi * m2 * hn**4)


def facet_f(d, fresnel):
    def f(p, wi, wo):
        ki, ko, h, oh = half(wi, wo)
        g = cavity(h[2], oh, ki[2], ko[2])
        shape = d(p, h[2]) * g / (4 * ki[2] * ko[2])
        return [c * shape for c in fresnel(p, oh)]

    return f


def facet_pdf(d):
    """Half vectors sampled from D (n.h), then reflection."""

    def pdf(p, wi, wo):
        _, _, h, oh = half(wi, wo)
        return d(p, h[2]) * h[2] / (4 * oh)

    return pdf


def blinn_fresnel(p, oh):
    return p["ks"]


def schlick_fresnel(name):
    return lambda p, oh: [r + (1 - r) * (1 - oh) ** 5 for r in p[name]]


def half_albedo(density, width, knots=lambda p: ((), (), ())):
    """Albedo by integration over half vectors, with Gauss-Legendre panels refined around the lobe
    and around kinks: density(p, hn, oh, ni, no, phi) is f cos_i d omega_i / d omega_h. `knots` has
    further kinks: at these theta_h, o.h and n.i."""

    def albedo(p, cos_o):
        sin_o = math.sqrt(1 - cos_o**2)
        wide = width(p)
        kinks_t, kinks_oh, kinks_ni = knots(p)

        def ring(phi):
            c = math.cos(phi)

            def at(t):
                hn, s = math.cos(t), math.sin(t)
                oh = sin_o * s * c + cos_o * hn
                return hn, oh, 2 * oh * hn - cos_o, s

            def levels(t):
                hn, oh, ni, _ = at(t)
                plain = ni, ni - cos_o, 2 * hn * ni - oh, 2 * hn * cos_o - oh
                return *plain, *(oh - x for x in kinks_oh), *(ni - x for x in kinks_ni)

            # Roots of the conditions at which the integrand has a kink or ends.
            grid = [k * math.pi / 2 / 256 for k in range(257)]
            values = [levels(t) for t in grid]
            cuts = {0.0, math.pi / 2, *(k * wide for k in (0.5, 1, 2, 4, 8)), *kinks_t}
            for j in range(len(values[0])):
                for a, b, va, vb in zip(grid, grid[1:], values, values[1:], strict=False):
                    if va[j] * vb[j] < 0:
                        for _ in range(48):
                            m = (a + b) / 2
                            if levels(m)[j] * va[j] > 0:
                                a = m
                            else:
                                b = m
                        cuts.add(a)
                        # Near the horizon there may be a root at which all derivatives are
                        # unbounded.
                        cuts |= {a + d * 10.0**-k for k in (1, 2, 3, 4) for d in (-1, 1) if j == 0}
            ends = sorted(t for t in cuts if 0 <= t <= math.pi / 2)
            total = 0.0
            for a, b in zip(ends, ends[1:], strict=False):
                for x, w in GAUSS:
                    t = a + (b - a) * x
                    hn, oh, ni, s = at(t)
                    if oh > 0 and ni > 0:
                        total += w * (b - a) * s * density(p, hn, oh, ni, cos_o, phi)
            return total

        panels = 96
        total = 0.0
        for i in range(panels):
            for x, w in GAUSS:
                total += w * math.pi / panels * ring((i + x) * math.pi / panels)
        return 2 * total

    return albedo


def gauss_legendre(n):
    """Nodes and weights on [0, 1]."""
    out = []
    for k in range(n):
        x = mp.cos(mp.pi * (k + 0.75) / (n + 0.5))
        for _ in range(8):  # Newton's method
            d = n * (x * mp.legendre(n, x) - mp.legendre(n - 1, x)) / (x * x - 1)
            x -= mp.legendre(n, x) / d
        out.append((float((1 + x) / 2), float(1 / ((1 - x * x) * d * d))))
    return out


GAUSS = gauss_legendre(12)


def facet_albedo(d, fresnel, width):
    def one(p, hn, oh, ni, no, phi):
        return d(p, hn) * cavity(hn, oh, ni, no) * oh / no * fresnel(p, oh)[0]

    return lambda p, c: [half_albedo(one, width)(p, c)] * 3


def blinn_d_fp(p, hn):
    return (p["e"] + 2) / (2 * math.pi) * hn ** p["e"]


def beckmann_d_fp(p, hn):
    m2 = p["m"] ** 2
    return math.exp(-(1 - hn**2) / hn**2 / m2) / (math.pi * m2 * hn**4)


# ---- Kelemen and Szirmay-Kalos 2001, eq. 3 and the matte term of sec. 2.2 ----------------------

#: The model's fit of the light that the facets leave, as it is printed in kelemen.cpp.
KELEMEN_NARROW = (
    (0.9405, 0.1647, -0.0597),
    (-0.716, -0.3393, -0.4891),
    (-0.4514, 0.4124, 0.5612),
    (-0.119, 0.5486, 0.8408),
    (0.7393, 0.2967, -0.0368),
)
KELEMEN_WIDE = (0.0929, 1.1378, -0.2484)
KELEMEN_SOFT = (
    (0.7353, -0.1328, 0.0581, -0.0509),
    (-0.0977, -0.1302, 0.0148, 0.0032),
    (0.0509, -0.1062, -0.045, 0.0944),
    (0.0591, -0.0706, -0.0982, 0.0811),
)
KELEMEN_MEAN_LOSS = (0.777, -0.1358, -0.5334, 0.4383, 0.7772, -0.9694, -0.3448, 0.4958)
KELEMEN_MEAN_SOFT = (0.8551, -0.2829, -0.2088, 0.0664, 0.0627, -0.0177)


def kelemen_rest(p, w):
    """The two parts of 1 - a: that of F = 1, and that which has the factor 1 - f0."""
    m, cos, sin = mp.mpf(p["m"]), mp.mpf(w[2]), mp.sqrt(mp.mpf(w[0]) ** 2 + mp.mpf(w[1]) ** 2)
    tan, c = sin / cos, mp.mpf
    v, u = 1 / (1 + 2 * m * tan), cos / (cos + m * sin**2)
    z = (1 + m) * cos / (cos + m)
    peak = m**2 * (1 - mp.exp(-1 / m**2))

    def sum2(rows, x):
        powers = [
            (2 * x - 1) ** i * (2 * m - 1) ** j for i, r in enumerate(rows) for j in range(len(r))
        ]
        return sum(
            c(repr(k)) * q for k, q in zip((k for r in rows for k in r), powers, strict=True)
        )

    L = v ** c("0.85") * (1 - v) ** 2 * sum2(KELEMEN_NARROW, v)
    L += peak * u * sum(c(repr(k)) * u**i for i, k in enumerate(KELEMEN_WIDE))
    mean_cos = cos
    if m * tan > 0 and (y := 1 / (2 * m * tan)) < 30:
        erfc = 2 / mp.sqrt(mp.pi) * mp.exp(-(y**2)) / (y + mp.sqrt(y**2 + 4 / mp.pi))
        mean_cos = cos * (1 - erfc / 2 + mp.exp(-(y**2)) / (2 * y * mp.sqrt(mp.pi)))
    facing = mean_cos / mp.sqrt(1 + m**2)
    return L, (1 - (1 - facing) ** 5) * sum2(KELEMEN_SOFT, z)


def kelemen_mean(p):
    m = mp.mpf(p["m"])

    def series(k, x):
        return sum(mp.mpf(repr(c)) * (2 * x - 1) ** i for i, c in enumerate(k))

    return m**2 * (1 - mp.log(m)) * series(KELEMEN_MEAN_LOSS, mp.cbrt(m)), series(
        KELEMEN_MEAN_SOFT, mp.sqrt(m)
    )


def kelemen_left(p, parts):
    return [parts[0] + (1 - mp.mpf(f)) * parts[1] for f in p["f0"]]


def kelemen_f(p, wi, wo):
    ki, ko, h, oh = half(wi, wo)
    i, o = (kelemen_left(p, kelemen_rest(p, k)) for k in (ki, ko))
    mean = kelemen_left(p, kelemen_mean(p))
    facets = beckmann_d(p, h[2]) / (2 * (1 + dot(ki, ko)))
    return [
        f * facets + r * a * b / (mp.pi * c)
        for f, r, a, b, c in zip(schlick_fresnel("f0")(p, oh), p["rm"], i, o, mean, strict=True)
    ]


def kelemen_pdf(p, wi, wo):
    """Visible normals of V-cavities, or Lambert's cosine."""
    ki, ko, h, oh = half(wi, wo)
    left = kelemen_left(p, kelemen_rest(p, ko))
    glossy = max(mp.mpf("1.01") - x for x in left)
    share = glossy / (glossy + max(x * r for x, r in zip(left, p["rm"], strict=True)))
    seen = min(1, 2 * h[2] * ko[2] / oh) * beckmann_d(p, h[2]) / (4 * ko[2])
    return share * seen + (1 - share) * ki[2] / mp.pi


def kelemen_albedo(p, cos_o):
    def one(p, hn, oh, ni, no, phi):
        return beckmann_d_fp(p, hn) * ni / oh * (p["f0"][0] + (1 - p["f0"][0]) * (1 - oh) ** 5)

    def left(cos):
        cos = mp.mpf(cos)
        return kelemen_left(p, kelemen_rest(p, (mp.sqrt((1 - cos) * (1 + cos)), 0, cos)))[0]

    # The cosine is x^4: what is left is steep at the horizon.
    mean = mp.quad(lambda x: 8 * x**7 * left(x**4), mp.linspace(0, 1, 9))
    matte = p["rm"][0] * left(cos_o) * mean / kelemen_left(p, kelemen_mean(p))[0]
    return [half_albedo(one, lambda p: p["m"])(p, cos_o) + matte] * 3


# ---- Edwards et al. 2006, with the lump of BRDF Explorer's edwards06.brdf ----------------------


def edwards_point(wi, wo):
    """A point of the unit disk as a complex number: the slopes of the half vector, scaled and moved
    for the view."""
    ki, ko = vec(wi), vec(wo)
    x, y = (ko[2] * (a + b) / (ki[2] + ko[2]) - b for a, b in zip(ki[:2], ko[:2], strict=True))
    return mp.mpc(x, y)


def edwards_pdf(p, wi, wo):
    """The lump, carried to the disk by the automorphism that moves the point of the mirror
    direction to the centre."""
    _, ko, h, oh = half(wi, wo)
    e, u, at = mp.mpf(p["e"]), edwards_point(wi, wo), -mp.mpc(ko[0], ko[1])
    below = 1 - mp.conj(at) * u
    moved, stretched = (u - at) / below, (1 - abs(at) ** 2) / below**2
    density = (e + 1) / mp.pi * (1 - abs(moved) ** 2) ** e * abs(stretched) ** 2
    return density * ko[2] ** 2 / (4 * h[2] ** 3 * oh)


def edwards_f(p, wi, wo):
    return [c * edwards_pdf(p, wi, wo) / vec(wi)[2] for c in p["rho"]]


# ---- Microfacets: Walter et al. 2007, Heitz 2014 -----------------------------------------------


def micro_d(p, h):
    ax, ay = mp.mpf(p["ax"]), mp.mpf(p["ay"])
    slope2 = ((h[0] / ax) ** 2 + (h[1] / ay) ** 2) / h[2] ** 2
    if p["distribution"] != "beckmann":
        return 1 / (mp.pi * ax * ay * h[2] ** 4 * (1 + slope2) ** 2)
    return mp.exp(-slope2) / (mp.pi * ax * ay * h[2] ** 4)


def micro_lambda(p, w):
    """Heitz's eqs. 72 and 68; for Beckmann's Walter's rational fit of sec. 5.2."""
    across = mp.sqrt((mp.mpf(p["ax"]) * w[0]) ** 2 + (mp.mpf(p["ay"]) * w[1]) ** 2)
    if across == 0:
        return 0
    a = w[2] / across
    if p["distribution"] != "beckmann":
        return (mp.sqrt(1 + 1 / a**2) - 1) / 2
    c = [mp.mpf(x) for x in ("1.259", "0.396", "3.535", "2.181")]
    return (1 - c[0] * a + c[1] * a**2) / (c[2] * a + c[3] * a**2) if a < mp.mpf("1.6") else 0


def micro_fresnel(p, oh):
    def schlick(r, c):
        return r + (1 - r) * (1 - c) ** 5

    weaker = oh * (1 - oh) ** 6 / (mp.mpf(1) / 7 * (mp.mpf(6) / 7) ** 6)
    return [
        schlick(r, oh) * (1 - (1 - t) * weaker) for r, t in zip(p["f0"], p["tint"], strict=True)
    ]


def micro_f(p, wi, wo):
    ki, ko, h, oh = half(wi, wo)
    i, o = micro_lambda(p, ki), micro_lambda(p, ko)
    g = {
        "smith_correlated": 1 / (1 + i + o),
        "smith_separable": 1 / ((1 + i) * (1 + o)),
        "v_cavity": cavity(h[2], oh, ki[2], ko[2]),
    }[p["masking"]]
    shape = micro_d(p, h) * g / (4 * ki[2] * ko[2])
    if p["distribution"] != "multiscatter_ggx":
        return [c * shape for c in micro_fresnel(p, oh)]
    lost = micro_lost(p, ko[2])
    more = [1 + mp.mpf(c) * lost / (1 - lost) for c in p["again"]]
    return [c * m * shape for c, m in zip(micro_fresnel(p, oh), more, strict=True)]


#: The model's fit of the light that single reflection loses, by powers of the height and the width.
MICRO_LOST = (
    (0.71753, 0.87757, 0.27211, -0.14623, 0.01419, 0.04226, -0.03416, -0.01468, 0.01455),
    (0.46063, 0.27899, 0.09673, -0.03409, -0.12826, -0.03108, 0.06197, -0.01006),
    (0.41162, 0.54141, 0.05548, -0.00918, 0.06144, -0.1257, 0.09608),
    (0.54289, 0.90128, 0.20428, -0.8006, -0.29042, 0.30556),
    (0.60854, 0.77858, 0.93307, -0.06118, -0.95463),
    (-1.06112, 0.89166, 1.35493, 0.16223),
    (-1.9358, 1.12287, 1.29002),
    (1.18473, 0.903),
    (1.65487,),
)


def micro_lost(p, cos_o):
    alpha = mp.sqrt(mp.mpf(p["ax"]) * mp.mpf(p["ay"]))
    m = mp.mpf(cos_o) / (cos_o + alpha)
    x, y = 2 * mp.sqrt(m) - 1, 2 * alpha - 1
    terms = [c * x**i * y**j for i, row in enumerate(MICRO_LOST) for j, c in enumerate(row)]
    return m ** mp.mpf("0.75") * (1 - m) * sum(terms)


def micro_pdf(p, wi, wo):
    """Visible normals, Heitz's eq. 16, of Smith's or of V-cavities, then reflection."""
    _, ko, h, oh = half(wi, wo)
    smith = p["distribution"] != "beckmann" and p["masking"] != "v_cavity"
    g1 = 1 / (1 + micro_lambda(p, ko)) if smith else min(1, 2 * h[2] * ko[2] / oh)
    return micro_d(p, h) * g1 * oh / ko[2] / (4 * oh)


def micro_albedo(p, cos_o):
    """View in the x-z plane; integrated over half vectors."""

    def at(w):
        s = (p["ax"] * w[0]) ** 2 + (p["ay"] * w[1]) ** 2
        a = w[2] / math.sqrt(max(s, 1e-300))
        if p["distribution"] != "beckmann":
            return (math.sqrt(1 + 1 / a**2) - 1) / 2
        fit = (1 - 1.259 * a + 0.396 * a**2) / (3.535 * a + 2.181 * a**2)
        return fit if a < 1.6 else 0

    wo = (math.sqrt(1 - cos_o**2), 0, cos_o)

    def one(p, hn, oh, ni, no, phi):
        sin = math.sqrt(1 - hn**2)
        h = (sin * math.cos(phi), sin * math.sin(phi), hn)
        slope2 = ((h[0] / p["ax"]) ** 2 + (h[1] / p["ay"]) ** 2) / hn**2
        d = 1 / (1 + slope2) ** 2 if p["distribution"] != "beckmann" else math.exp(-slope2)
        d /= math.pi * p["ax"] * p["ay"] * hn**4
        wi = [2 * oh * a - b for a, b in zip(h, wo, strict=True)]
        g = {
            "smith_correlated": lambda: 1 / (1 + at(wi) + at(wo)),
            "smith_separable": lambda: 1 / ((1 + at(wi)) * (1 + at(wo))),
            "v_cavity": lambda: cavity(hn, oh, ni, no),
        }[p["masking"]]()
        return d * g * oh / no * float(micro_fresnel(p, oh)[0])

    found, more = half_albedo(one, lambda p: min(p["ax"], p["ay"]))(p, cos_o), 1
    if p["distribution"] == "multiscatter_ggx":
        lost = float(micro_lost(p, cos_o))
        more = 1 + p["again"][0] * lost / (1 - lost)
    return [found * more] * 3


# ---- Microfacets of other shapes: Burley 2012, Holzschuch and Pacanowski 2017 -------------------


def shaped_d(p, hn, maths=mp, number=mp.mpf):
    a, g = number(p["alpha"]), number(p["gamma"])
    if p["distribution"] == "blinn_phong":
        e = 2 / a**2 - 2
        return (e + 2) / (2 * maths.pi) * hn**e
    if p["distribution"] == "exponential":
        slope = maths.sqrt(1 - hn**2) / hn
        return maths.exp(-slope / a) / (2 * maths.pi * a**2 * hn**4)
    if a == 1:
        return 1 / maths.pi + 0 * hn  # the limit
    if g == 1:
        c = (a**2 - 1) / (maths.pi * maths.log(a**2))
    else:
        c = (g - 1) * (a**2 - 1) / (maths.pi * (1 - a ** (2 - 2 * g)))
    return c / (1 + (a**2 - 1) * hn**2) ** g


def shaped_g(p, hn, oh, ni, no):
    return {
        "v_cavity": lambda: cavity(hn, oh, ni, no),
        "kelemen": lambda: ni * no / oh**2,
        "ashikhmin_premoze": lambda: ni * no / (ni + no - ni * no),
        "neumann": lambda: ni * no / max(ni, no),
    }[p["masking"]]()


def shaped_f(p, wi, wo):
    ki, ko, h, oh = half(wi, wo)
    shape = shaped_d(p, h[2]) * shaped_g(p, h[2], oh, ki[2], ko[2]) / (4 * ki[2] * ko[2])
    return [c * shape for c in schlick_fresnel("f0")(p, oh)]


def shaped_pdf(p, wi, wo):
    """D G_1 / (4 (n.o)) with the masking of V-cavities."""
    _, ko, h, oh = half(wi, wo)
    return shaped_d(p, h[2]) * min(1, 2 * h[2] * ko[2] / oh) / (4 * ko[2])


def shaped_albedo(p, cos_o):
    def one(p, hn, oh, ni, no, phi):
        d = shaped_d(p, hn, math, float)
        return d * shaped_g(p, hn, oh, ni, no) * oh / no * schlick_fresnel("f0")(p, oh)[0]

    return [half_albedo(one, lambda p: p["alpha"])(p, cos_o)] * 3


# ---- Belcour and Barla, with the model's Gaussians ---------------------------------------------

#: Centres and width in 1 / um, and weights by working space and channel.
FILM_CENTRES = [mp.mpf("1.9761") + mp.mpf("0.1110") * j for j in range(-3, 4)]
FILM_WIDTH = mp.mpf("0.0710")
FILM_WEIGHTS = {
    "rec709": (
        ("1.2946", "0.2709", "-0.3731", "-0.2209", "-0.0675", "0.0401", "0.0559"),
        ("-0.1315", "0.4122", "0.6014", "0.1877", "0.0344", "-0.0587", "-0.0455"),
        ("-0.0074", "-0.0609", "-0.0569", "0.0019", "0.2030", "0.6306", "0.2897"),
    ),
    "rec2020": (
        ("0.7686", "0.3031", "-0.0385", "-0.0768", "-0.0223", "0.0332", "0.0327"),
        ("-0.0316", "0.3970", "0.5265", "0.1575", "0.0293", "-0.0440", "-0.0347"),
        ("0.0030", "-0.0138", "-0.0041", "0.0146", "0.1837", "0.5602", "0.2564"),
    ),
    "acescg": (
        ("0.7487", "0.3032", "-0.0273", "-0.0717", "-0.0201", "0.0346", "0.0326"),
        ("-0.0298", "0.3959", "0.5241", "0.1566", "0.0295", "-0.0425", "-0.0338"),
        ("0.0059", "-0.0022", "0.0087", "0.0175", "0.1790", "0.5429", "0.2482"),
    ),
}


def film_fresnel(p, c):
    """The paper's series, its eq. 7, as 2 (C_0 + sum C_m cos) of both polarisations; from m = 3 on
    with the ratio of Gaussians' transforms."""
    n2, sin2 = mp.mpf(p["film_ior"]), 1 - c**2
    q2 = mp.sqrt(n2**2 - sin2)
    turn = 4 * mp.pi * q2 * mp.mpf(p["thickness"]) / 1000
    spaces = FILM_WEIGHTS[p["space"]]

    def transform(weights, m):
        decay = mp.exp(-((m * turn * FILM_WIDTH) ** 2) / 2)
        phases = [mp.expj(m * turn * v) for v in FILM_CENTRES]
        return decay * sum(mp.mpf(w) * x for w, x in zip(weights, phases, strict=True))

    ones = [mp.expj(turn * v) * mp.exp(-5 * (turn * FILM_WIDTH) ** 2 / 2) for v in FILM_CENTRES]
    ratios = [ones[0], (ones[1] + ones[3]) / 2, (ones[4] + ones[6]) / 2]
    out = []
    for channel, (weights, ratio) in enumerate(zip(spaces, ratios, strict=True)):
        name = "rgb"[channel]
        n3 = mp.mpc(p[f"n_{name}"], p[f"k_{name}"])
        q3 = mp.sqrt(n3**2 - sin2)
        total = 0
        for e1, e2, e3 in ((1, 1, 1), (1, n2**2, n3**2)):
            a, b, g = c / e1, q2 / e2, q3 / e3
            r12, r23 = (a - b) / (a + b), (b - g) / (b + g)
            big1, big2, through = r12**2, abs(r23) ** 2, 1 - r12**2
            star = through**2 * big2 / (1 - big1 * big2)
            rho = -r12 * r23
            first, second = transform(weights, 1), transform(weights, 2)
            series = rho * first + rho**2 * second / (1 - rho * ratio)
            total += big1 + star + 2 * (star - through) * series.real
        out.append(min(max(total / 2, 0), 1))
    return out


def film_f(p, wi, wo):
    ki, ko, h, oh = half(wi, wo)
    p = {**p, "distribution": "ggx"}
    shape = micro_d(p, h) / (1 + micro_lambda(p, ki) + micro_lambda(p, ko)) / (4 * ki[2] * ko[2])
    return [c * shape for c in film_fresnel(p, oh)]


def film_pdf(p, wi, wo):
    return micro_pdf({**p, "distribution": "ggx", "masking": "smith_correlated"}, wi, wo)


def film_albedo(p, cos_o):
    """View in the x-z plane; integrated over half vectors. F is interpolated between Chebyshev's
    nodes, as it is smooth in the cosine."""
    with mp.workdps(16):
        degree = 60
        nodes = [0.5 - 0.5 * math.cos(math.pi * k / degree) for k in range(degree + 1)]
        curve = [[float(c) for c in film_fresnel(p, mp.mpf(max(x, 1e-9)))] for x in nodes]
    signs = [(-1) ** k * (0.5 if k in (0, degree) else 1.0) for k in range(degree + 1)]

    def reflectance(oh, channel):
        parts = [s / (oh - x or 1e-18) for s, x in zip(signs, nodes, strict=True)]
        return sum(w * f[channel] for w, f in zip(parts, curve, strict=True)) / sum(parts)

    def at(w):
        return (math.sqrt(1 + ((p["ax"] * w[0]) ** 2 + (p["ay"] * w[1]) ** 2) / w[2] ** 2) - 1) / 2

    wo = (math.sqrt(1 - cos_o**2), 0, cos_o)

    def light(channel):
        def one(p, hn, oh, ni, no, phi):
            sin = math.sqrt(1 - hn**2)
            h = (sin * math.cos(phi), sin * math.sin(phi), hn)
            slope2 = ((h[0] / p["ax"]) ** 2 + (h[1] / p["ay"]) ** 2) / hn**2
            d = 1 / (1 + slope2) ** 2 / (math.pi * p["ax"] * p["ay"] * hn**4)
            wi = [2 * oh * a - b for a, b in zip(h, wo, strict=True)]
            return d / (1 + at(wi) + at(wo)) * oh / no * reflectance(oh, channel)

        return half_albedo(one, lambda p: min(p["ax"], p["ay"]))(p, cos_o)

    return [light(channel) for channel in range(3)]


#: Water or plastic below the film.
FILM_CLEAR = {"n_r": 1.33, "n_g": 1.33, "n_b": 1.33, "k_r": 0, "k_g": 0, "k_b": 0}


# ---- Ward, in three normalisations -------------------------------------------------------------


def ward_gaussian(p, h):
    ax, ay = mp.mpf(p["ax"]), mp.mpf(p["ay"])
    exponent = ((h[0] / ax) ** 2 + (h[1] / ay) ** 2) / h[2] ** 2
    return mp.exp(-exponent) / (4 * mp.pi * ax * ay)


def ward_f(p, wi, wo):
    ki, ko, h, oh = half(wi, wo)
    norm = {
        "bounded": oh**2 * h[2] ** 4,
        "duer": ki[2] * ko[2],
        "ward": mp.sqrt(ki[2] * ko[2]),
    }[p["normalisation"]]
    return [k * ward_gaussian(p, h) / norm for k in p["ks"]]


def ward_pdf(p, wi, wo):
    _, _, h, oh = half(wi, wo)
    return ward_gaussian(p, h) / (oh * h[2] ** 3)


def ward_albedo(p, cos_o):
    """View in the x-z plane; integrated over half vectors."""

    def one(p, hn, oh, ni, no, phi):
        s2 = (1 - hn**2) / hn**2
        q = (math.cos(phi) / p["ax"]) ** 2 + (math.sin(phi) / p["ay"]) ** 2
        g = math.exp(-s2 * q) / (math.pi * p["ax"] * p["ay"])
        norm = {"bounded": oh**2 * hn**4, "duer": ni * no, "ward": math.sqrt(ni * no)}
        return g / norm[p["normalisation"]] * ni * oh

    a = half_albedo(one, lambda p: min(p["ax"], p["ay"]))(p, cos_o)
    return [k * a for k in p["ks"]]


# ---- Rough glass: Walter et al. 2007, eqs. 13, 16, 20, 21 ----------------------------------------


def glass_indices(p, wo):
    """The indices on the side of the viewer and on the other one."""
    off = mp.mpf(p["ior"]) - 1
    least = mp.mpf("0.001")
    inside = 1 + (off if abs(off) > least else (-least if off < 0 else least))
    return (1, inside) if wo[2] > 0 else (inside, 1)


def glass_parts(p, wi, wo):
    """The share of Fresnel's equations, the Jacobian, h, o.h and the tint; None where the facet's
    sides are not those of the surface."""
    i, o = vec(wi), vec(wo)
    near, far = glass_indices(p, o)
    if i[2] * o[2] > 0:
        h, tint = unit([a + b for a, b in zip(i, o, strict=True)]), "reflected"
    else:
        h, tint = unit([-(near * a + far * b) for a, b in zip(o, i, strict=True)]), "refracted"
    h = [c * (-1 if h[2] * o[2] < 0 else 1) for c in h]  # on the viewer's side
    oh, ih = dot(o, h), dot(i, h)
    if oh <= 0 or (ih > 0) != (i[2] * o[2] > 0):
        return None
    eta = far / mp.mpf(near)
    total = eta**2 - 1 + oh**2 <= 0
    mirror = mp.mpf(1) if total else fresnel(oh, eta)
    if tint == "reflected":
        return mirror, 1 / (4 * oh), h, oh, p[tint]
    return 1 - mirror, far**2 * abs(ih) / (near * oh + far * ih) ** 2, h, oh, p[tint]


def glass_masking(p, i, o):
    a, b = (micro_lambda(p, [w[0], w[1], abs(w[2])]) for w in (i, o))
    return 1 / (1 + a + b) if p["masking"] == "smith_correlated" else 1 / ((1 + a) * (1 + b))


def glass_f(p, wi, wo):
    p = {**p, "ax": p["alpha"], "ay": p["alpha"]}
    i, o = vec(wi), vec(wo)
    found = glass_parts(p, wi, wo)
    if not found:
        return [mp.mpf(0)] * 3
    share, jacobian, h, oh, tint = found
    f = share * jacobian * micro_d(p, h) * glass_masking(p, i, o) * oh / abs(i[2] * o[2])
    return [f * c for c in tint]


def glass_pdf(p, wi, wo):
    """Visible normals of Smith's, for Beckmann of V-cavities; the event with its probability."""
    p = {**p, "ax": p["alpha"], "ay": p["alpha"]}
    o = vec(wo)
    found = glass_parts(p, wi, wo)
    if not found:
        return mp.mpf(0)
    share, jacobian, h, oh, _ = found
    up = abs(o[2])
    smith = p["distribution"] == "ggx"
    g1 = 1 / (1 + micro_lambda(p, [o[0], o[1], up])) if smith else min(1, 2 * abs(h[2]) * up / oh)
    return share * jacobian * micro_d(p, h) * g1 * oh / up


def glass_albedo(p, cos_o):
    """The error falls with the square of the number of steps."""
    coarse, fine = (glass_sums(p, cos_o, steps) for steps in (1000, 2000))
    return [(4 * b - a) / 3 for a, b in zip(coarse, fine, strict=True)]


def glass_sums(p, cos_o, steps):
    """Integrated over half vectors by their polar angle about the view, on which the Fresnel
    equations depend, and azimuth: by midpoints in numbers that are denser where roots begin."""
    near, far = (float(n) for n in glass_indices(p, (0, 0, cos_o)))
    n, up, alpha = far / near, abs(cos_o), p["alpha"]
    across = math.sqrt(1 - up * up)
    t = (np.arange(steps) + 0.5) / steps
    place, density = t * t * (3 - 2 * t), 6 * t * (1 - t) / steps

    def smith(z):
        t2 = alpha**2 * (1 / z**2 - 1)
        if p["distribution"] == "ggx":
            return (np.sqrt(1 + t2) - 1) / 2
        a = 1 / np.sqrt(np.maximum(t2, 1e-300))
        fit = (1 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a)
        return np.where(a < 1.6, fit, 0)

    def leaving(z):
        """G where the light leaves on its side at this height, else 0."""
        b, c = smith(np.where(z > 0, z, 1)), smith(up)
        both = 1 / (1 + b + c) if p["masking"] == "smith_correlated" else 1 / ((1 + b) * (1 + c))
        return np.where(z > 0, both, 0)

    # Total reflection ends at the first of these; below the second, not all azimuths are upward.
    critical = math.sqrt(max(1 - n * n, 0))
    ends = sorted({0.0, critical, across, 1.0})
    back = on = 0.0
    for a, b in zip(ends, ends[1:], strict=False):
        c = (a + (b - a) * place)[:, None]
        sine = np.sqrt(1 - c * c)
        last = np.arccos(np.clip(-c * up / np.maximum(sine * across, 1e-300), -1, 1))
        hz = c * up + sine * across * np.cos(last * place)
        slope2 = (1 / np.maximum(hz, 1e-300) ** 2 - 1) / alpha**2
        d = 1 / (math.pi * alpha**2 * hz**4)
        d = d / (1 + slope2) ** 2 if p["distribution"] == "ggx" else d * np.exp(-slope2)
        facets = 2 * (b - a) * density[:, None] * last * density * d * c / up
        g2 = n * n - 1 + c * c
        g = np.sqrt(np.maximum(g2, 0))
        mirror = ((c - g) / (c + g)) ** 2 + ((n * n * c - g) / (n * n * c + g)) ** 2
        mirror = np.where(g2 > 0, mirror / 2, 1)
        back += float(np.sum(facets * mirror * leaving(2 * c * hz - up)))
        on += float(np.sum(facets * (1 - mirror) * leaving((up - (c - g) * hz) / n)))
    return [r * back + t * on for r, t in zip(p["reflected"], p["refracted"], strict=True)]


def glass_pair(p, wi, wo, rng):
    """Two pairs of three are of light that passes; the facet is near the surface's slope."""
    if rng.random() < 1 / 3:
        side = rng.choice((-1, 1))
        return tuple(c * s for c, s in zip(wi, (1, 1, side), strict=True)), tuple(
            c * s for c, s in zip(wo, (1, 1, side), strict=True)
        )
    wo = (*wo[:2], wo[2] * rng.choice((-1, 1)))
    near, far = (float(n) for n in glass_indices(p, wo))
    side = math.copysign(1, wo[2])
    h = [2 * p["alpha"] * wi[0], 2 * p["alpha"] * wi[1], side]
    size = math.sqrt(sum(c * c for c in h))
    h = [c / size for c in h]
    oh = sum(a * b for a, b in zip(h, wo, strict=True))
    n = far / near
    if oh <= 0 or n * n - 1 + oh * oh <= 0:
        return (*wi[:2], wi[2] * side), wo
    g = math.sqrt(n * n - 1 + oh * oh)
    wi = [(a * (oh - g) - b) / n for a, b in zip(h, wo, strict=True)]
    size = math.sqrt(sum(c * c for c in wi))
    return tuple(c / size for c in wi), wo


# ---- Curves of microfacet factors --------------------------------------------------------------

D_KNOTS = (0, 0.3, 0.6, 0.9, 1.25, 1.65, 2.1, 2.6, 3.2, 4, 5, 6.5, 8.5, 11)
F_KNOTS = (0, 0.05, 0.2, 0.4, 0.6, 0.8, 1)
G_KNOTS = (0, 1, 2, 3, 4)


def log_curve(knots, heights, x, log):
    """exp of the polygon through the logarithms of the heights, constant beyond the ends."""
    logs = [log(h + type(h)(1e-30)) for h in heights]
    if x <= knots[0]:
        return logs[0]
    for a, b, left, right in zip(knots, knots[1:], logs, logs[1:], strict=False):
        if x < b:
            return left + (right - left) * (x - a) / (b - a)
    return logs[-1]


def factor_heights(p, stem, count, channel, number):
    return [number(p[f"{stem}{k}"][channel]) for k in range(count)]


def factor_product(p, s2, oh, cosines, channel, maths, number):
    """d F G G, and the remaining factors of the highlight but 1 / (pi a_x a_y cos^4 theta_h)."""
    shadowing = [number(1)] + [number(p[f"g{k}"]) for k in (1, 2, 3, 4)]
    d = log_curve(
        D_KNOTS, factor_heights(p, "d", 14, channel, number), maths.log(1 + s2), maths.log
    )
    f = log_curve(F_KNOTS, factor_heights(p, "f", 7, channel, number), 1 - oh, maths.log)
    g = sum(
        log_curve(G_KNOTS, shadowing, -maths.log(c) / maths.log(number(2)), maths.log)
        for c in cosines
    )
    heights = [max(c, number(1) / 16) for c in cosines]
    return (
        maths.exp(d + f + g) * number(p["strength"]) / (1 + s2) ** 2 / (4 * heights[0] * heights[1])
    )


def factor_lobe(p, slopes, heights, oh, number):
    """q - 1, and the remaining factor of the highlight but 1 / (4 cos cos): `slopes` are those of
    the half vector, `heights` the cosines to the normal."""
    e, w, ax, ay = (number(p[name]) for name in ("widening", "heights", "ax", "ay"))
    m, facing = (heights[0] + heights[1]) / 2, max(1 - 2 * w, 0) * min(max(1 - e / 2, 0), 1)
    sz = (heights[0] - heights[1]) / (2 * m)
    along = (slopes[0] / ax) ** 2 + (slopes[1] / ay) ** 2
    s2 = m**e * ((1 - w) * along + w * sz**2 / (ax * ay))
    return s2, (oh / m) ** (4 * facing) / (number(math.pi if number is float else mp.pi) * ax * ay)


def factors_matte(p, cosine, number):
    return 1 - number(p["rim"]) * (1 - cosine) ** 2


def factors_f(p, wi, wo):
    ki, ko, h, oh = half(wi, wo)
    s2, scale = factor_lobe(p, (h[0] / h[2], h[1] / h[2]), (ki[2], ko[2]), oh, mp.mpf)
    matte = factors_matte(p, ki[2], mp.mpf) * factors_matte(p, ko[2], mp.mpf) / mp.pi
    return [
        mp.mpf(p["rho"][c]) * matte
        + scale * factor_product(p, s2, oh, (ki[2], ko[2]), c, mp, mp.mpf)
        for c in range(3)
    ]


def factors_form(p, ko):
    """The quadratic form of slopes by which half vectors are sampled, a matrix."""
    e, view, ax, ay = (mp.mpf(p[name]) for name in ("widening", "heights", "ax", "ay"))
    slope = 1 - view
    z2 = ko[2] ** 2 + 4 * ((ax * ko[0]) ** 2 + (ay * ko[1]) ** 2) + mp.mpf("1e-8")
    level = mp.mpf("0.3") * view * z2 / (z2 + ko[0] ** 2 + ko[1] ** 2)
    n = z2 ** (e / 2)
    along = n * view / (z2 * ax * ay)
    return mp.matrix(
        [
            [n * slope / ax**2 + level + along * ko[0] ** 2, along * ko[0] * ko[1]],
            [along * ko[0] * ko[1], n * slope / ay**2 + level + along * ko[1] ** 2],
        ]
    )


def factors_pdf(p, wi, wo):
    """The pdf of ln q is a product of powers of q, which are integrated one after another."""
    ki, ko, h, oh = half(wi, wo)
    largest = [mp.mpf(max(p[f"d{k}"])) for k in range(14)]
    # A knot of the sampled curve is as high as those next to it that are left out.
    kept = (0, 1, 3, 5, 7, 9, 11, 13)
    knots = [D_KNOTS[k] for k in kept]
    beside = [
        [i for i in (k - 1, k, k + 1) if i == k or i in range(14) and i not in kept] for k in kept
    ]
    largest = [max(largest[i] for i in near) for near in beside]

    def density(x):
        return mp.exp(log_curve(knots, largest, x, mp.log) - x)

    ends = [density(mp.mpf(x)) for x in knots]
    total = ends[-1]
    for x, y, left, right in zip(knots, knots[1:], ends, ends[1:], strict=False):
        power = mp.log(right / left)
        total += (y - x) * (left if power == 0 else (right - left) / power)
    mirrored = max(
        mp.exp(log_curve(F_KNOTS, factor_heights(p, "f", 7, c, mp.mpf), 1 - ko[2], mp.log))
        for c in range(3)
    )
    form = factors_form(p, ko)
    root = mp.sqrt(mp.det(form))
    highlight = p["strength"] * total * mirrored / (mp.mpf(p["ax"]) * mp.mpf(p["ay"]) * root)
    matte = max(mp.mpf(c) for c in p["rho"]) * factors_matte(p, ko[2], mp.mpf)
    e, w = mp.mpf(p["widening"]), mp.mpf(p["heights"])
    even = mp.mpf("0.2") * min(abs(e) + 4 * w, 1) + mp.mpf("0.5") * max(2 * w - 1, 0)
    share = (1 - even) * highlight / (highlight + matte)
    slopes = mp.matrix([h[0] / h[2], h[1] / h[2]])
    s2 = (slopes.T * form * slopes)[0]
    p_h = density(mp.log(1 + s2)) / total / (1 + s2) * root / (mp.pi * h[2] ** 3)
    others = even / (2 * mp.pi) + (1 - share - even) * ki[2] / mp.pi
    return share * p_h / (4 * oh) + others


def factors_albedo(p, cos_o):
    """With equal channels of all heights, and equal roughnesses."""

    def one(p, hn, oh, ni, no, phi):
        slope = math.sqrt(max(1 - hn**2, 0)) / hn
        slopes = slope * math.cos(phi), slope * math.sin(phi)
        s2, scale = factor_lobe(p, slopes, (ni, no), oh, float)
        return factor_product(p, s2, oh, (ni, no), 0, math, float) * scale * ni * 4 * oh

    def knots(p):
        slopes = [p["ax"] * math.sqrt(math.expm1(x)) for x in D_KNOTS]
        return [math.atan(s) for s in slopes], [1 - x for x in F_KNOTS], [0.5**k for k in G_KNOTS]

    a = half_albedo(one, lambda p: min(p["ax"], p["ay"]), knots)(p, cos_o)
    matte = factors_matte(p, cos_o, float) * (1 - p["rim"] / 6)
    return [c * matte + a for c in p["rho"]]


# ---- Schlick -----------------------------------------------------------------------------------


def schlick_shares(p):
    s = mp.mpf(p["rough"])
    b = 4 * s * (1 - s)
    return (0, b, 1 - b) if s < 0.5 else (1 - b, b, 0)


def schlick_parts(p, h):
    """Z(t) and A(w)."""
    s, iso, t = mp.mpf(p["rough"]), mp.mpf(p["p"]), h[2]
    z = s / (1 + s * t**2 - t**2) ** 2
    w2 = h[0] ** 2 / (h[0] ** 2 + h[1] ** 2)
    return z, mp.sqrt(iso / (iso**2 - iso**2 * w2 + w2))


def schlick_g(p, v):
    s = mp.mpf(p["rough"])
    return v / (s - s * v + v)


def schlick_f(p, wi, wo):
    ki, ko, h, oh = half(wi, wo)
    a, b, _ = schlick_shares(p)
    z, aw = schlick_parts(p, h)
    g = schlick_g(p, ki[2]) * schlick_g(p, ko[2])
    shape = a / mp.pi + b * g * z * aw / (4 * mp.pi * ki[2] * ko[2])
    return [c * shape for c in schlick_fresnel("r")(p, oh)]


def schlick_pdf(p, wi, wo):
    """For the glossy lobe alone: half vectors by Z; azimuths by the mean of a uniform pdf and that
    of a scaled circle."""
    a, _, _ = schlick_shares(p)
    if a:
        return None
    _, _, h, oh = half(wi, wo)
    z, _ = schlick_parts(p, h)
    iso = mp.mpf(p["p"])
    w2 = h[0] ** 2 / (h[0] ** 2 + h[1] ** 2)
    squeezed = iso / (iso**2 * (1 - w2) + w2)
    return z * h[2] / mp.pi * (1 + squeezed) / 2 / (4 * oh)


def schlick_albedo(p, cos_o):
    """View in the x-z plane."""
    s, iso, r = p["rough"], p["p"], p["r"][0]
    a, b, c = (float(x) for x in schlick_shares(p))

    def one(p, hn, oh, ni, no, phi):
        z = s / (1 + s * hn**2 - hn**2) ** 2
        w2 = math.cos(phi) ** 2
        aw = math.sqrt(iso / (iso**2 * (1 - w2) + w2))
        g = 1 / (s - s * ni + ni) / (s - s * no + no)
        fresnel = r + (1 - r) * (1 - oh) ** 5
        return fresnel * (a / math.pi + b / (4 * math.pi) * g * z * aw) * ni * 4 * oh

    mirror = c * (r + (1 - r) * (1 - cos_o) ** 5)
    return [half_albedo(one, lambda p: math.sqrt(s))(p, cos_o) + mirror] * 3


# ---- Oren and Nayar ----------------------------------------------------------------------------


def oren_nayar_terms(p, ti, to, c, lib):
    """The factors of rho / pi and rho^2 / pi as printed: formulas of angles."""
    s2 = p["sigma"] * p["sigma"]
    al, be = max(ti, to), min(ti, to)
    c1 = 1 - 0.5 * s2 / (s2 + 0.33)
    k = s2 / (s2 + 0.09)
    if p["form"] == "qualitative":
        return c1 + 0.45 * k * max(c, 0) * lib.sin(al) * lib.tan(be), 0 * c
    c2 = 0.45 * k * (lib.sin(al) - (0 if c >= 0 else (2 * be / lib.pi) ** 3))
    c3 = 0.125 * k * (4 * al * be / lib.pi**2) ** 2
    l1 = c1 + c * c2 * lib.tan(be) + (1 - abs(c)) * c3 * lib.tan((al + be) / 2)
    return l1, 0.17 * s2 / (s2 + 0.13) * (1 - c * (2 * be / lib.pi) ** 2)


def oren_nayar_f(p, wi, wo):
    ki, ko = vec(wi), vec(wo)
    si, so = mp.hypot(ki[0], ki[1]), mp.hypot(ko[0], ko[1])
    c = (ki[0] * ko[0] + ki[1] * ko[1]) / (si * so) if si * so > 0 else mp.mpf(1)
    p = dict(p, sigma=mp.mpf(p["sigma"]))
    l1, l2 = oren_nayar_terms(p, mp.atan2(si, ki[2]), mp.atan2(so, ko[2]), c, mp)
    return [r * l1 / mp.pi + mp.mpf(r) ** 2 * l2 / mp.pi for r in p["rho"]]


def oren_nayar_albedo(p, cos_o):
    to = math.acos(cos_o)
    direct = again = 0.0
    cuts = [0.0, to / 2, to, (to + math.pi / 2) / 2, math.pi / 2]
    for a, b in zip(cuts, cuts[1:], strict=False):
        for x, w in GAUSS if b > a else ():
            ti = a + (b - a) * x
            for half_pi in (0, 1):  # the kink of |c| at a right angle
                for y, v in GAUSS:
                    phi = (half_pi + y) * math.pi / 2
                    weight = w * (b - a) * v * math.pi * math.sin(ti) * math.cos(ti) / math.pi
                    l1, l2 = oren_nayar_terms(p, ti, to, math.cos(phi), math)
                    direct += weight * l1
                    again += weight * l2
    return [r * direct + r * r * again for r in p["rho"]]


# ---- Charlie: Estevez and Kulla, 2017 ----------------------------------------------------------

CHARLIE = [
    ("25.3245", "21.5473"),
    ("3.32435", "3.82987"),
    ("0.16801", "0.19823"),
    ("-1.27393", "-1.97760"),
    ("-4.85967", "-4.32054"),
]


def charlie_lambda(r, c, lib):
    w = (1 - r) ** 2
    k = [w * lib.mpf(at_0) + (1 - w) * lib.mpf(at_1) for at_0, at_1 in CHARLIE]

    def fitted(x):
        return k[0] / (1 + k[1] * x ** k[2]) + k[3] * x + k[4]

    half = lib.mpf(1) / 2
    return lib.exp(fitted(c) if c < half else 2 * fitted(half) - fitted(1 - c))


def charlie_value(p, ci, co, sin2, lib):
    r = lib.mpf(p["r"])
    d = (2 + 1 / r) * lib.sqrt(sin2) ** (1 / r) / (2 * lib.pi)
    li, lo = charlie_lambda(r, ci, lib), charlie_lambda(r, co, lib)
    if p["terminator"] == "soft":
        li = li ** (1 + 2 * (1 - ci) ** 8)
    return d / (1 + li + lo) / (4 * ci * co)


def charlie_f(p, wi, wo):
    k1, k2, h = as_half(wi, wo)
    f = charlie_value(p, k1[2], k2[2], h[0] ** 2 + h[1] ** 2, mp)
    return [c * f for c in p["tint"]]


def charlie_back(p, wo):
    """What samples have as their density's power, and the horizontal direction to the viewer."""
    s = mp.sqrt(wo[0] ** 2 + wo[1] ** 2)
    r = mp.mpf(p["r"])
    return s * (mp.mpf(1) / 2 - r / 4 + mp.mpf("0.4") * wo[2] / r), s


def charlie_pdf(p, wi, wo):
    wi, wo = vec(wi), vec(wo)
    n, s = charlie_back(p, wo)
    most, least = mp.mpf("2.2"), mp.mpf("0.2")
    x = (wi[0] * wo[0] + wi[1] * wo[1]) / s
    return (n + 1) * (x + most - 1) ** n / (most ** (n + 1) - least ** (n + 1)) / mp.pi


def ends(n=60):
    """Nodes within 0 and 1 for integrands that are singular there: tanh-sinh quadrature."""
    h = 3.2 / n
    t = np.arange(-n, n + 1) * h
    x = 1 / (1 + np.exp(-np.pi * np.sinh(t)))
    return x, h * np.pi * np.cosh(t) * x * (1 - x)


def charlie_albedo(p, cos_o):
    """Integrated over the polar angle's cosine and the azimuth. D has an edge in the mirror
    direction, L is steep at the horizon and at the normal."""
    total, so = 0.0, math.sqrt(1 - cos_o**2)
    nodes, weights = ends()
    edges = sorted({0, cos_o, 0.5, 1})
    for low, high in itertools.pairwise(edges):
        for x, w in zip(low + (high - low) * nodes, (high - low) * weights, strict=True):
            for y, v in zip(nodes, weights, strict=True):
                s = math.sqrt(1 - x * x) * so * math.cos(math.pi * y)
                hz2 = (x + cos_o) ** 2 / (2 * (1 + s + x * cos_o))
                f = charlie_value(p, mp.fp.mpf(x), mp.fp.mpf(cos_o), max(1 - hz2, 0.0), mp.fp)
                total += w * v * 2 * math.pi * x * f
    return [c * total for c in p["tint"]]


# ---- Disney: Burley, 2012, with the constants of BRDF Explorer's disney.brdf ---------------------


DISNEY_NUMBERS = (
    *("metallic", "roughness", "subsurface", "specular", "specular_tint", "anisotropic", "sheen"),
    *("sheen_tint", "clearcoat", "clearcoat_gloss"),
)


class NumPy:
    """NumPy with the names that mpmath has."""

    pi, sqrt, log, mpf = math.pi, staticmethod(np.sqrt), staticmethod(np.log), float


def disney_terms(p, color, zi, zo, ii, oo, h, oh, lib):
    """f of one channel. `ii` and `oo`: (x, y) of both directions; `h`: the half vector."""
    s, v = {k: lib.mpf(p[k]) for k in DISNEY_NUMBERS}, lib.mpf
    lum = v("0.3") * v(p["base_color"][0]) + v("0.6") * v(p["base_color"][1])
    lum += v("0.1") * v(p["base_color"][2])

    def mix(a, b, t):
        return a * (1 - t) + b * t

    def schlick(c):
        return (1 - c) ** 5

    def smith(c, a):
        return 1 / (c + lib.sqrt(a * a + c * c - a * a * c * c))

    tint = color / lum if lum > 0 else v(1)
    spec0 = mix(
        s["specular"] * v("0.08") * mix(v(1), tint, s["specular_tint"]), color, s["metallic"]
    )
    fl, fv, fh = schlick(zi), schlick(zo), schlick(oh)
    fd90 = v("0.5") + 2 * oh * oh * s["roughness"]
    fd = mix(v(1), fd90, fl) * mix(v(1), fd90, fv)
    fss90 = oh * oh * s["roughness"]
    fss = mix(v(1), fss90, fl) * mix(v(1), fss90, fv)
    ss = v("1.25") * (fss * (1 / (zi + zo) - v("0.5")) + v("0.5"))
    aspect = lib.sqrt(1 - s["anisotropic"] * v("0.9"))
    ax, ay = (max(v("0.001"), s["roughness"] ** 2 * k) for k in (1 / aspect, aspect))
    ds = 1 / (lib.pi * ax * ay * ((h[0] / ax) ** 2 + (h[1] / ay) ** 2 + h[2] ** 2) ** 2)
    if p["masking"] == "remapped":
        a = (s["roughness"] * v("0.5") + v("0.5")) ** 2
        gs = smith(zi, a) * smith(zo, a)
    else:
        gs = 1
        for c, (x, y) in ((zi, ii), (zo, oo)):
            gs /= c + lib.sqrt((x * ax) ** 2 + (y * ay) ** 2 + c * c)
    a2 = mix(v("0.1"), v("0.001"), s["clearcoat_gloss"]) ** 2
    dr = (a2 - 1) / (lib.pi * lib.log(a2) * (1 + (a2 - 1) * h[2] ** 2))
    fr = mix(v("0.04"), v(1), fh)
    gr = smith(zi, v("0.25")) * smith(zo, v("0.25"))
    rim = fh * s["sheen"] * mix(v(1), tint, s["sheen_tint"])
    matte = (mix(fd, ss, s["subsurface"]) * color / lib.pi + rim) * (1 - s["metallic"])
    return matte + gs * mix(spec0, v(1), fh) * ds + v("0.25") * s["clearcoat"] * gr * fr * dr


def disney_f(p, wi, wo):
    k1, k2, h = as_half(wi, wo)
    return [
        disney_terms(p, mp.mpf(c), k1[2], k2[2], k1[:2], k2[:2], h, dot(h, k1), mp)
        for c in p["base_color"]
    ]


def disney_pdf(p, wi, wo):
    k1, k2, h = as_half(wi, wo)
    s = {k: mp.mpf(p[k]) for k in DISNEY_NUMBERS}
    lum = sum(mp.mpf(a) * c for a, c in zip(("0.3", "0.6", "0.1"), p["base_color"], strict=True))
    spec0 = max(
        (1 - s["metallic"])
        * s["specular"]
        * mp.mpf("0.08")
        * (1 + s["specular_tint"] * (c / lum - 1))
        + s["metallic"] * c
        for c in map(mp.mpf, p["base_color"])
    )
    fresnel = (1 - k2[2]) ** 5
    below = (max(p["base_color"]) + s["sheen"] / 10) * (1 - s["metallic"]) + mp.mpf("0.02")
    high = (spec0 + (1 - spec0) * fresnel) * (1 - s["roughness"] / 2)
    coat = s["clearcoat"] * (mp.mpf("0.02") + mp.mpf("0.2") * fresnel)
    total = below + high + coat
    aspect = mp.sqrt(1 - s["anisotropic"] * mp.mpf("0.9"))
    ax, ay = (max(mp.mpf("0.001"), s["roughness"] ** 2 * k) for k in (1 / aspect, aspect))
    ds = 1 / (mp.pi * ax * ay * ((h[0] / ax) ** 2 + (h[1] / ay) ** 2 + h[2] ** 2) ** 2)
    # D G1 / (4 (n.o)), with G1 = 2 (n.o) / ((n.o) + sqrt(...)).
    visible = ds / (2 * (k2[2] + mp.sqrt((k2[0] * ax) ** 2 + (k2[1] * ay) ** 2 + k2[2] ** 2)))
    a2 = (mp.mpf("0.1") + s["clearcoat_gloss"] * (mp.mpf("0.001") - mp.mpf("0.1"))) ** 2
    dr = (a2 - 1) / (mp.pi * mp.log(a2) * (1 + (a2 - 1) * h[2] ** 2))
    return (below * k1[2] / mp.pi + high * visible + coat * dr * h[2] / (4 * dot(h, k1))) / total


def disney_albedo(p, cos_o):
    """Without anisotropy; for lobes that these nodes resolve."""
    nodes, weights = ends(120)
    so, total = math.sqrt(1 - cos_o**2), [0.0] * 3
    for low, high in itertools.pairwise(sorted({0, cos_o, 1})):
        x = (low + (high - low) * nodes)[:, None]
        si = np.sqrt(1 - x * x)
        phi = math.pi * nodes
        cosine = si * so * np.cos(phi) + x * cos_o
        length = np.sqrt(2 + 2 * cosine)
        h = ((si * np.cos(phi) + so) / length, si * np.sin(phi) / length, (x + cos_o) / length)
        ii = (si * np.cos(phi), si * np.sin(phi))
        for i, color in enumerate(p["base_color"]):
            f = disney_terms(p, color, x, cos_o, ii, (so, 0.0), h, length / 2, NumPy)
            total[i] += (high - low) * 2 * math.pi * float(weights @ (x * f) @ weights)
    return total


# ---- Hapke: 1981, with H of 2002 and the two lobes of the book's second edition -----------------


def hapke_henyey_greenstein(b, x):
    return (1 - b * b) / (1 - 2 * b * x + b * b) ** 1.5


def hapke_h(w, x, lib):
    y = lib.sqrt(1 - w)
    r0 = (1 - y) / (1 + y)
    return 1 / (1 - w * x * (r0 + (1 - 2 * r0 * x) / 2 * lib.log((1 + x) / x)))


def hapke_value(p, w, ci, co, cos_g, lib):
    b, c, b0, h = (p[k] for k in ("b", "c", "b0", "h"))
    back, on = hapke_henyey_greenstein(b, cos_g), hapke_henyey_greenstein(b, -cos_g)
    surge = b0 / (1 + lib.sqrt((1 - cos_g) / (1 + cos_g)) / h)
    scattered = (1 + surge) * ((1 + c) / 2 * back + (1 - c) / 2 * on)
    if p["scattering"] == "multiple":
        scattered += hapke_h(w, ci, lib) * hapke_h(w, co, lib) - 1
    return w / (4 * lib.pi) * scattered / (ci + co)


def hapke_f(p, wi, wo):
    k1, k2 = vec(wi), vec(wo)
    p = {k: mp.mpf(v) if isinstance(v, (int, float)) else v for k, v in p.items()}
    return [hapke_value(p, mp.mpf(w), k1[2], k2[2], dot(k1, k2), mp) for w in p["w"]]


def hapke_pdf(p, wi, wo):
    """Lobes about both directions of the view's line, folded at the horizon, and a density between
    uniform and cosine."""
    k1, k2 = vec(wi), vec(wo)
    b, c = mp.mpf(p["b"]), mp.mpf(p["c"])
    low = 1 - k2[2]
    back, on = b * (1 + c) * 2 / 5, b * (1 - c) * 2 / 5 * low**4
    lobes = 0
    for x in (dot(k1, k2), dot([k1[0], k1[1], -k1[2]], k2)):
        lobes += back * hapke_henyey_greenstein(b, x) + on * hapke_henyey_greenstein(b, -x)
    level = mp.mpf("0.05") + mp.mpf("0.7") * low**3
    rest = (level + 2 * (1 - level) * k1[2]) / (2 * mp.pi)
    return lobes / (4 * mp.pi) + (1 - back - on) * rest


def hapke_albedo(p, cos_o):
    """The surge has a cusp where the light is at the viewer."""
    nodes, weights = ends()
    so, total = math.sqrt(1 - cos_o**2), [0.0] * 3
    for low, high in itertools.pairwise(sorted({0, cos_o, 1})):
        x = (low + (high - low) * nodes)[:, None]
        cos_g = np.minimum(np.sqrt(1 - x * x) * so * np.cos(math.pi * nodes) + x * cos_o, 1)
        for i, w in enumerate(p["w"]):
            f = hapke_value(p, w, x, cos_o, cos_g, np)
            total[i] += (high - low) * 2 * math.pi * float(weights @ (x * f) @ weights)
    return total


# ---- EON: Portsmouth, Kutz and Hill, 2025 ------------------------------------------------------


def eon_albedo_white(c, r, lib):
    """The albedo of white facets without interreflection, and A."""
    a = 1 / (1 + (lib.mpf(1) / 2 - 2 / (3 * lib.pi)) * r)
    s = lib.sqrt(1 - c * c)
    g = s * (lib.acos(c) - s * c) + lib.mpf(2) / 3 * (s / c * (1 - s**3) - s)
    return a + r * a / lib.pi * g, a


def eon_again(rho, r, a, lib):
    """rho_ms and the mean albedo of white facets."""
    mean = a * (1 + (lib.mpf(2) / 3 - 28 / (15 * lib.pi)) * r)
    return rho**2 * mean / (1 - rho * (1 - mean)), mean


def eon_f(p, wi, wo):
    ki, ko = vec(wi), vec(wo)
    r = mp.mpf(p["r"])
    s = ki[0] * ko[0] + ki[1] * ko[1]
    t = max(ki[2], ko[2]) if s > 0 else 1
    (ei, a), (eo, _) = (eon_albedo_white(k[2], r, mp) for k in (ki, ko))
    out = []
    for rho in p["rho"]:
        ms, mean = eon_again(mp.mpf(rho), r, a, mp)
        lost = (1 - ei) * (1 - eo) / (1 - mean) if r > 0 else 0
        out.append((rho * a * (1 + r * s / t) + ms * lost) / mp.pi)
    return out


def eon_albedo(p, cos_o):
    e, a = eon_albedo_white(mp.mpf(cos_o), mp.mpf(p["r"]), mp)
    return [rho * e + eon_again(mp.mpf(rho), p["r"], a, mp)[0] * (1 - e) for rho in p["rho"]]


def eon_pdf(p, wi, wo):
    """The generator's own mixture."""
    c, level = vec(wi)[2], 0.6 * mp.mpf(p["r"]) * (1 - vec(wo)[2]) ** 3
    return (1 - level) * c / mp.pi + level / (2 * mp.pi)


# ---- Disney's diffuse term: Burley, 2012, section 5.3 ------------------------------------------


def disney_diffuse_f(p, wi, wo):
    ki, ko, h = as_half(wi, wo)
    f90 = mp.mpf(1) / 2 + 2 * mp.mpf(p["r"]) * dot(ki, h) ** 2
    pair = [1 + (f90 - 1) * (1 - k[2]) ** 5 for k in (ki, ko)]
    return [rho * pair[0] * pair[1] / mp.pi for rho in p["rho"]]


def disney_diffuse_pdf(p, wi, wo):
    return vec(wi)[2] / mp.pi


def disney_diffuse_albedo(p, cos_o):
    """cos^2 of the angle to the half vector is (1 + wi.wo) / 2, so f is a quadratic polynomial in
    the azimuth's cosine, whose square is 1/2 on average; what is left is one in the height."""
    co, r = mp.mpf(cos_o), mp.mpf(p["r"])
    so5 = (1 - co) ** 5

    def of(x):
        middle, swing = r * (1 + x * co) - mp.mpf(1) / 2, r**2 * (1 - x**2) * (1 - co**2)
        si5 = (1 - x) ** 5
        return 2 * x * (1 + (si5 + so5) * middle + si5 * so5 * (middle**2 + swing / 2))

    total = mp.quad(of, [0, 1])
    return [rho * total for rho in p["rho"]]


# ---- Lafortune ---------------------------------------------------------------------------------


def lafortune_f(p, wi, wo):
    ki, ko = vec(wi), vec(wo)
    bracket = p["cxy"] * (ki[0] * ko[0] + ki[1] * ko[1]) + p["cz"] * ki[2] * ko[2]
    e = mp.mpf(p["e"])
    lobe = bracket**e if bracket > 0 else mp.mpf(0)
    return [k * (e + 2) / (2 * mp.pi) * lobe for k in p["ks"]]


def lafortune_axis(p, ko):
    return [p["cxy"] * ko[0], p["cxy"] * ko[1], p["cz"] * ko[2]]


def lafortune_pdf(p, wi, wo):
    ki, axis = vec(wi), unit(lafortune_axis(p, vec(wo)))
    e = mp.mpf(p["e"])
    c = dot(ki, axis)
    return (e + 1) / (2 * mp.pi) * (c**e if c > 0 else mp.mpf(0))


def lafortune_albedo(p, cos_o):
    """A modified Phong lobe about another axis, times |w|^e."""
    w = lafortune_axis(p, [mp.sqrt(1 - mp.mpf(cos_o) ** 2), mp.mpf(0), mp.mpf(cos_o)])
    size = mp.sqrt(dot(w, w))
    a = modified_phong_albedo({"e": p["e"], "ks": (1, 1, 1)}, w[2] / size)[0]
    return [k * a * size ** p["e"] for k in p["ks"]]


PHONG_CASES = [
    {"e": 0},
    {"e": 1.5, "ks": (1, 1, 1)},
    {"e": 20, "ks": (0.1, 0.5, 1)},
    {"e": 300},
    {"e": 10000},
    {"e": 1e6},
    {"e": 1e8},
]
MODELS = {
    "lambert": dict(
        f=lambert_f,
        pdf=lambert_pdf,
        albedo=lambda p, c: p["rho"],
        defaults={"rho": (0.8, 0.8, 0.8)},
        cases=[{"rho": (1, 1, 1)}, {"rho": (0.2, 0.5, 0.9)}],
        cosines=[1, 0.3],
    ),
    "minnaert": dict(
        f=minnaert_f,
        pdf=minnaert_pdf,
        albedo=minnaert_albedo,
        defaults={"rho": (0.8, 0.8, 0.8), "k": 1.5},
        cases=[{}, {"k": 0.5, "rho": (1, 1, 1)}, {"k": 0.7, "rho": (0.2, 0.5, 0.9)}, {"k": 9}],
        cosines=[1, 0.3, 0.05],
    ),
    "ashikhmin_shirley": dict(
        f=as_f,
        pdf=as_pdf,
        albedo=as_albedo,
        defaults={
            "rs": (0.05, 0.05, 0.05),
            "rd": (0.5, 0.5, 0.5),
            "nu": 100,
            "nv": 100,
            "rotation": 0,
            "part": "both",
        },
        cases=[
            {},
            {"rs": (0.05, 0.2, 0.9), "rd": (1, 0.5, 0.1), "nu": 10, "nv": 1000, "rotation": 0.7},
            {"part": "diffuse", "rd": (1, 0.3, 0), "rs": (0, 0.05, 1)},
            {"part": "specular", "rs": (1, 1, 1), "nu": 0, "nv": 0},
            {"part": "specular", "rs": (1, 0.5, 0.04), "nu": 3, "nv": 40, "rotation": -2},
            {"part": "specular", "rs": (1, 1, 1), "nu": 10000, "nv": 10000},
            {"part": "specular", "rs": (0.5, 0.5, 0.5), "nu": 1e6, "nv": 1e6},
            {"part": "specular", "rs": (0.5, 0.5, 0.5), "nu": 1e8, "nv": 1e4, "rotation": 1},
            {"diffuse": "tabulated", "rs": (0.05, 0.5, 1), "rd": (1, 1, 1), "nu": 10, "nv": 10},
            {"diffuse": "tabulated", "part": "diffuse", "nu": 4, "nv": 90, "rotation": 0.7},
        ],
        # Interpolation in the model's tables, of 1 - R for either direction.
        floor=lambda p: 0.04 if p.get("diffuse") == "tabulated" else 0,
        albedo_cases=[
            {"part": "specular", "rs": (1, 1, 1), "nu": 10, "nv": 10},
            {"part": "specular", "rs": (0.05, 0.05, 0.05), "nu": 10, "nv": 10},
            {"part": "specular", "rs": (1, 1, 1), "nu": 4, "nv": 30},
            {"part": "specular", "rs": (0.3, 0.3, 0.3), "nu": 400, "nv": 400},
        ],
        cosines=[1, 0.5, math.cos(math.radians(80)), 0.09],
    ),
    "coupled": dict(
        f=by_fresnel(coupled_f, coupled_full_f),
        pdf=coupled_pdf,
        albedo=by_fresnel(coupled_albedo, coupled_full_albedo),
        defaults={"r0": 0.05, "rm": (0.8, 0.8, 0.8)},
        cases=[
            {},
            {"r0": 0.5, "rm": (1, 0.5, 0.1)},
            {"r0": 0, "rm": (1, 1, 1)},
            {"fresnel": "dielectric"},
            {"fresnel": "dielectric", "r0": 0.3, "rm": (1, 0.5, 0.1)},
            {"fresnel": "dielectric", "r0": 0.99},
        ],
        # Interpolation in the model's table of the constant.
        floor=lambda p: 4e-7 if p.get("fresnel") == "dielectric" else 0,
        cosines=[1, 0.5, 0.1, 0.01],
    ),
    "glossy_reflector": dict(
        f=gr_f,
        pdf=gr_pdf,
        albedo=gr_albedo,
        defaults={"kr": 0.9, "cr": (1, 1, 1), "e": 100, "below": "mirror"},
        cases=[
            {},
            {"e": 1, "kr": 1},
            {"e": 1, "kr": 1, "below": "lose"},
            {"e": 5, "cr": (0.9, 0.5, 0.1)},
            {"e": 25, "below": "lose"},
            {"e": 1e5},
            {"e": 1e7, "kr": 1},
        ],
        albedo_cases=[
            {"e": 1, "kr": 1},
            {"e": 25, "kr": 1},
            *({"e": e, "kr": 1, "below": "lose"} for e in (1, 5, 100, 1e4)),
        ],
        cosines=[1, 0.5, 0.1, 0.01],
    ),
    "glossy_specular": dict(
        f=gs_f,
        pdf=gs_pdf,
        albedo=gs_albedo,
        defaults={"ks": 0.65, "cs": (1, 1, 1), "e": 25, "normalisation": "book"},
        cases=[
            {},
            {"e": 1, "ks": 1},
            {"e": 7, "normalisation": "estimator", "cs": (0.9, 0.5, 0.1)},
            {"e": 1000, "normalisation": "conserving", "ks": 1},
            {"e": 1e5},
            {"e": 1e7, "normalisation": "conserving"},
        ],
        albedo_cases=[
            {"e": 1, "ks": 1},
            {},
            {"e": 7, "normalisation": "estimator", "ks": 1},
            {"e": 1000, "normalisation": "conserving", "ks": 1},
        ],
        cosines=[1, 0.5, 0.1, 0.01],
    ),
    "phong_material": dict(
        f=pm_f,
        pdf=pm_pdf,
        albedo=pm_albedo,
        defaults={
            "kd": 0.4,
            "cd": (1, 1, 0.3),
            "ks": 0.2,
            "cs": (1, 1, 1),
            "es": 25,
            "kr": 0.4,
            "cr": (1, 1, 0.3),
            "e": 100,
        },
        cases=[
            {},
            {"kd": 1, "ks": 0, "kr": 0},
            {"kd": 0, "kr": 0, "es": 1000},
            {"kd": 0, "ks": 0, "e": 1, "kr": 1},
            {"ks": 1, "es": 3, "e": 1e5, "cs": (0.1, 0.5, 1)},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "lambertian_specular": dict(
        f=lambda p, wi, wo: [c / mp.pi for c in p["rd"]],
        pdf=lambert_pdf,
        albedo=lambda p, c: [rd + mp.mpf(p["rs"]) for rd in p["rd"]],
        defaults={"rs": 0.05, "rd": (0.8, 0.8, 0.8)},
        cases=[{}, {"rs": 0.5, "rd": (0.2, 0.5, 0.9)}],
        cosines=[1, 0.3],
    ),
    "shirley_1991": dict(
        f=s91_f,
        pdf=lambert_pdf,
        albedo=s91_albedo,
        defaults={"r0": 0.05, "rd": (0.8, 0.8, 0.8)},
        cases=[{}, {"r0": 0.5, "rd": (1, 0.5, 0.1)}, {"r0": 0, "rd": (1, 1, 1)}],
        cosines=[1, 0.5, 0.1, 0.01],
    ),
    "schlick_double": dict(
        f=sd_f,
        pdf=lambert_pdf,
        albedo=sd_albedo,
        defaults={"r0": 0.05, "rd": (0.8, 0.8, 0.8)},
        cases=[{}, {"r0": 0.5, "rd": (1, 0.5, 0.1)}, {"r0": 0, "rd": (1, 1, 1)}],
        cosines=[1, 0.5, 0.1, 0.01],
    ),
    "radziszewski_alda": dict(
        f=ra_f,
        pdf=ra_pdf,
        albedo=lambda p, c: p["tint"],
        defaults={
            "n": 4,
            "n_theta": 4,
            "n_phi": 4,
            "proportion": "paper",
            "part": "product",
            "around": "reflection",
            "ior": 1.5,
            "tint": (1, 1, 1),
        },
        cases=[
            *({"n": n} for n in (0, 1e-300, 1e-3, 0.5, 1, 4, 25, 50, 1e3, 1e6, 1e8)),
            {"n": 2, "proportion": "equal", "tint": (0.9, 0.5, 0.1)},
            {"n_theta": 7, "n_phi": 0.3, "proportion": "custom"},
            {"n_theta": 0, "n_phi": 100, "proportion": "custom"},
            {"n": 3, "part": "latitudinal"},
            {"n": 30, "part": "longitudinal"},
            {"n": 4, "around": "retro"},
            {"n": 1e4, "around": "retro"},
            {"n": 4, "around": "refraction"},
            {"n": 40, "around": "refraction", "ior": 1.1},
            {"n": 2, "around": "refraction", "ior": 2.4, "proportion": "equal"},
        ],
        albedo_cases=[{"n": n} for n in (0, 1e-300, 1e-3, 0.5, 1, 4, 25, 50, 1e3, 1e6, 1e8)]
        + [{"n": 4, "around": a} for a in ("retro", "refraction")],
        cosines=[1, 0.5, 0.05],
    ),
    "lossless": dict(
        f=lossless_f,
        pdf=lossless_pdf,
        albedo=lambda p, c: p["tint"],
        defaults={"kernel": "sech2", "n": 4, "tint": (1, 1, 1)}
        | dict(zip(HEIGHTS, (1, 0.6, 0.2, 0.1), strict=True)),
        cases=[
            {},
            {"n": 0.3, "tint": (0.9, 0.5, 0.1)},
            {"n": 25},
            {"kernel": "exponential", "n": 0.3},
            {"kernel": "exponential", "n": 8},
            {"kernel": "table", "n": 7, "h1": 0.9, "h3": 0.3},
        ],
        cosines=[1, 0.5, 0.05],
        # Numerical integrals.
        floor=lambda p: 1e-12,
    ),
    "fresnel_dielectric": dict(
        albedo=dielectric_albedo,
        defaults={"ior": 1.5},
        cases=[
            {},
            {"ior": 2.4},
            {"ior": 0.75},
            {"refracted": (0.9, 0.5, 0), "reflected": (0.2, 0.5, 1)},
        ],
        cosines=[1, 0.5, 0.1, 0.001],
    ),
    "glass": dict(
        albedo=dielectric_albedo,
        defaults={"ior": 1.5, "attenuation": (0.5, 0.9, 0.7), "density": 1},
        cases=[{}, {"attenuation": (0, 0, 1), "density": 100}],
        cosines=[1, 0.1],
    ),
    "fresnel_conductor": dict(
        albedo=conductor_albedo,
        defaults={f"n_{c}": n for c, n in zip("rgb", (0.2, 0.9, 1.1), strict=True)}
        | {f"k_{c}": k for c, k in zip("rgb", (3.9, 2.4, 2.2), strict=True)},
        cases=[
            {},
            {"n_r": 1.5, "k_r": 0, "n_g": 0.001, "k_g": 100, "n_b": 100, "k_b": 0},
            {"n_r": 0.5, "k_r": 1e-9, "n_g": 1.0001, "k_g": 0, "k_b": 1e-4},
        ],
        cosines=[1, 0.5, 0.1, 0.001],
    ),
    "phong": dict(
        f=phong_f,
        pdf=phong_pdf,
        albedo=phong_albedo,
        defaults={"ks": (0.5, 0.5, 0.5), "e": 20},
        cases=PHONG_CASES,
        albedo_cases=PHONG_CASES[1:5],
        cosines=[1, 0.5, 0.05],
    ),
    "modified_phong": dict(
        f=modified_phong_f,
        pdf=phong_pdf,
        albedo=modified_phong_albedo,
        defaults={"ks": (0.5, 0.5, 0.5), "e": 20},
        cases=PHONG_CASES,
        albedo_cases=PHONG_CASES[1:5],
        cosines=[1, 0.5, 0.05],
    ),
    "max_phong": dict(
        f=max_phong_f,
        pdf=phong_pdf,
        albedo=max_phong_albedo,
        defaults={"ks": (0.5, 0.5, 0.5), "e": 20},
        cases=PHONG_CASES,
        albedo_cases=PHONG_CASES[1:5],
        cosines=[1, 0.5, 0.05],
    ),
    "blinn": dict(
        f=facet_f(blinn_d, blinn_fresnel),
        pdf=facet_pdf(blinn_d),
        albedo=facet_albedo(blinn_d_fp, lambda p, oh: p["ks"], lambda p: 1 / math.sqrt(p["e"] + 2)),
        defaults={"ks": (0.5, 0.5, 0.5), "e": 50},
        cases=PHONG_CASES,
        albedo_cases=[{"e": 0}, {"e": 30, "ks": (1, 1, 1)}, {"e": 3000, "ks": (1, 1, 1)}],
        cosines=[1, 0.5, 0.1],
    ),
    "cook_torrance": dict(
        f=facet_f(beckmann_d, schlick_fresnel("f0")),
        pdf=facet_pdf(beckmann_d),
        albedo=facet_albedo(beckmann_d_fp, schlick_fresnel("f0"), lambda p: p["m"]),
        defaults={"f0": (0.9, 0.6, 0.3), "m": 0.3},
        cases=[{}, {"m": 1}, {"m": 0.05, "f0": (0, 0.04, 1)}, {"m": 1e-3}, {"m": 1e-4}],
        albedo_cases=[
            {"m": 1, "f0": (1, 1, 1)},
            {"m": 0.3, "f0": (0.04, 0.04, 0.04)},
            {"m": 0.05, "f0": (1, 1, 1)},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "kelemen": dict(
        f=kelemen_f,
        pdf=kelemen_pdf,
        albedo=kelemen_albedo,
        defaults={"f0": (0.05, 0.05, 0.05), "rm": (0.8, 0.8, 0.8), "m": 0.3},
        cases=[
            {},
            {"m": 1, "f0": (1, 1, 1), "rm": (1, 1, 1)},
            {"m": 0.05, "f0": (0, 0.04, 1), "rm": (0.1, 0.5, 1)},
            {"m": 1e-3, "rm": (1, 1, 1)},
        ],
        albedo_cases=[
            {"m": 1, "f0": (1, 1, 1), "rm": (0, 0, 0)},
            {"m": 0.3, "rm": (1, 1, 1)},
            {"m": 0.05, "f0": (0.5, 0.5, 0.5), "rm": (1, 1, 1)},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "edwards": dict(
        f=edwards_f,
        pdf=edwards_pdf,
        albedo=lambda p, cos_o: p["rho"],
        defaults={"rho": (0.5, 0.5, 0.5), "e": 20},
        cases=[
            {},
            {"e": 1, "rho": (1, 1, 1)},
            {"e": 3.5, "rho": (0.1, 0.5, 1)},
            {"e": 3000},
            {"e": 1e7},
        ],
        albedo_cases=[{"e": 1, "rho": (1, 1, 1)}, {}, {"e": 3000, "rho": (0.1, 0.5, 1)}],
        cosines=[1, 0.5, 0.05],
    ),
    "microfacet": dict(
        f=micro_f,
        pdf=micro_pdf,
        albedo=micro_albedo,
        defaults={
            "f0": (0.9, 0.6, 0.3),
            "tint": (1, 1, 1),
            "again": (1, 1, 1),
            "ax": 0.3,
            "ay": 0.3,
            "distribution": "ggx",
            "masking": "smith_correlated",
        },
        cases=[
            {},
            {"ax": 0.02, "ay": 0.5, "tint": (0.7, 0.3, 0)},
            {"ax": 1, "ay": 1, "masking": "smith_separable", "f0": (0, 0.04, 1)},
            {"ax": 0.4, "ay": 0.1, "masking": "v_cavity"},
            {"distribution": "beckmann", "ax": 0.1, "ay": 0.6},
            {"distribution": "beckmann", "masking": "smith_separable", "ax": 1, "ay": 1},
            {"distribution": "beckmann", "masking": "v_cavity"},
            {"ax": 1e-4, "ay": 1e-4},
            {"distribution": "beckmann", "ax": 1e-4, "ay": 1},
            {"distribution": "multiscatter_ggx", "ax": 0.5, "ay": 0.5},
            {"distribution": "multiscatter_ggx", "ax": 0.01, "ay": 1, "again": (0, 0.3, 0.7)},
        ],
        albedo_cases=[
            {"ax": 0.5, "ay": 0.5, "f0": (1, 1, 1)},
            {"ax": 0.2, "ay": 0.6, "f0": (0.5, 0.5, 0.5), "tint": (0.5, 0.5, 0.5)},
            {"f0": (1, 1, 1), "masking": "smith_separable"},
            {"f0": (1, 1, 1), "masking": "v_cavity"},
            {"f0": (1, 1, 1), "distribution": "beckmann", "ax": 1, "ay": 1},
            {"f0": (1, 1, 1), "distribution": "multiscatter_ggx", "ax": 0.7, "ay": 0.7},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "shaped_facets": dict(
        f=shaped_f,
        pdf=shaped_pdf,
        albedo=shaped_albedo,
        defaults={
            "f0": (0.9, 0.6, 0.3),
            "alpha": 0.1,
            "gamma": 1.5,
            "distribution": "gtr",
            "masking": "v_cavity",
        },
        cases=[
            {},
            {"gamma": 1, "alpha": 0.02, "masking": "kelemen"},
            {"gamma": 10, "alpha": 0.7, "masking": "ashikhmin_premoze"},
            {"gamma": 1, "alpha": 1, "f0": (0, 0.04, 1)},
            {"gamma": 1.0000001, "alpha": 0.9999999, "masking": "neumann"},
            {"gamma": 2, "alpha": 1e-4, "masking": "ashikhmin_premoze"},
            {"distribution": "blinn_phong", "alpha": 0.4, "masking": "kelemen"},
            {"distribution": "blinn_phong", "alpha": 1, "masking": "neumann"},
            {"distribution": "blinn_phong", "alpha": 1e-3},
            {"distribution": "exponential", "masking": "ashikhmin_premoze"},
            {"distribution": "exponential", "alpha": 1, "masking": "kelemen"},
            {"distribution": "exponential", "alpha": 0.01, "f0": (0, 0.04, 1)},
        ],
        albedo_cases=[
            {"alpha": 0.3, "f0": (1, 1, 1)},
            {"alpha": 0.3, "gamma": 1, "f0": (1, 1, 1), "masking": "kelemen"},
            {"alpha": 0.3, "gamma": 3, "f0": (0.5, 0.5, 0.5), "masking": "ashikhmin_premoze"},
            {"alpha": 0.3, "f0": (1, 1, 1), "masking": "neumann"},
            {"distribution": "blinn_phong", "alpha": 0.5, "f0": (1, 1, 1), "masking": "kelemen"},
            {"distribution": "exponential", "alpha": 0.2, "f0": (1, 1, 1)},
            {"distribution": "exponential", "alpha": 0.6, "f0": (1, 1, 1), "masking": "neumann"},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "thin_film": dict(
        f=film_f,
        pdf=film_pdf,
        albedo=film_albedo,
        defaults={
            "thickness": 300,
            "film_ior": 1.5,
            "ax": 0.1,
            "ay": 0.1,
            "n_r": 2.74,
            "n_g": 2.51,
            "n_b": 2.24,
            "k_r": 3.84,
            "k_g": 3.4,
            "k_b": 3.01,
            "space": "rec709",
        },
        cases=[
            {},
            {"thickness": 120, "film_ior": 2.4, "ax": 0.02, "ay": 0.5},
            {
                "thickness": 550,
                "film_ior": 1.33,
                "space": "rec2020",
                "ax": 1,
                "ay": 1,
                **FILM_CLEAR,
            },
            {"thickness": 0, "film_ior": 3, "space": "acescg", "n_r": 0.2, "k_g": 0},
            {"thickness": 900, "film_ior": 1, "n_r": 100, "k_r": 0, "n_g": 0.001},
            {"thickness": 268, "film_ior": 2.3, "ax": 0.4, "ay": 0.4, **FILM_CLEAR},
            {"thickness": 10000, "film_ior": 5, "ax": 1e-4, "ay": 1e-4},
        ],
        albedo_cases=[
            {"ax": 0.5, "ay": 0.5},
            {"thickness": 550, "film_ior": 1.33, "ax": 0.3, "ay": 1, "space": "rec2020"},
        ],
        cosines=[1, 0.4],
    ),
    "rough_glass": dict(
        f=glass_f,
        pdf=glass_pdf,
        albedo=glass_albedo,
        pair=glass_pair,
        defaults={
            "alpha": 0.1,
            "ior": 1.5,
            "distribution": "ggx",
            "masking": "smith_correlated",
            "refracted": (1, 1, 1),
            "reflected": (1, 1, 1),
        },
        cases=[
            {},
            {"alpha": 0.5, "ior": 1.33, "refracted": (0.9, 0.5, 0), "reflected": (0.2, 0.5, 1)},
            {"alpha": 1, "masking": "smith_separable", "ior": 2.4},
            {"distribution": "beckmann", "alpha": 0.3},
            {"distribution": "beckmann", "masking": "smith_separable", "alpha": 1, "ior": 0.75},
            {"ior": 1.01},
            {"ior": 1, "alpha": 0.5},
            {"alpha": 1e-3},
            {"distribution": "beckmann", "alpha": 1e-3, "ior": 0.1},
        ],
        albedo_cases=[
            {},
            {"alpha": 0.5, "ior": 1.33, "refracted": (0.9, 0.5, 0), "reflected": (0.2, 0.5, 1)},
            {"alpha": 1, "masking": "smith_separable"},
            {"distribution": "beckmann", "alpha": 0.5},
            {"distribution": "beckmann", "masking": "smith_separable", "alpha": 1, "ior": 0.75},
        ],
        cosines=[1, 0.5, 0.1, -0.9, -0.5],
    ),
    "ward": dict(
        f=ward_f,
        pdf=ward_pdf,
        albedo=ward_albedo,
        defaults={"ks": (0.5, 0.5, 0.5), "ax": 0.15, "ay": 0.15, "normalisation": "bounded"},
        cases=[
            {},
            {"ax": 0.02, "ay": 0.5, "ks": (1, 0.5, 0.1)},
            {"ax": 1, "ay": 1, "normalisation": "duer"},
            {"ax": 0.3, "ay": 0.1, "normalisation": "ward"},
            {"ax": 1e-4, "ay": 1e-4},
            {"ax": 1e-4, "ay": 1, "normalisation": "duer"},
        ],
        albedo_cases=[
            {"ks": (1, 1, 1)},
            {"ax": 0.5, "ay": 0.5, "ks": (1, 1, 1), "normalisation": "ward"},
            {"ax": 0.2, "ay": 0.4, "ks": (1, 1, 1), "normalisation": "duer"},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "factors": dict(
        f=factors_f,
        pdf=factors_pdf,
        albedo=factors_albedo,
        defaults={
            "rho": (0.1, 0.03, 0.02),
            "rim": 0,
            "strength": 1,
            "ax": 0.2,
            "ay": 0.2,
            "widening": 0,
            "heights": 0,
        }
        | {f"d{k}": (1, 1, 1) for k in range(14)}
        | {f"f{k}": (0.05 + 0.95 * x**5,) * 3 for k, x in enumerate(F_KNOTS)}
        | dict(zip(("g1", "g2", "g3", "g4"), (0.97, 0.88, 0.7, 0.45), strict=True)),
        cases=[
            {},
            {
                "ax": 0.05,
                "ay": 0.4,
                "d1": (0.9, 0.5, 0.1),
                "d3": (0.2, 0.3, 0.1),
                "f2": (1, 0, 0.5),
            },
            {"d0": (0.01, 0.01, 0.01), "d6": (0.3, 0.2, 0.1), "g1": 0.5, "g2": 1, "rho": (0, 0, 0)},
            {"ax": 1, "ay": 1, "strength": 1e3, "d13": (1e-6, 1e-3, 0)},
            {"ax": 1e-4, "ay": 1e-4},
            {
                "widening": 2,
                "heights": 0.5,
                "ax": 0.05,
                "ay": 0.1,
                "d5": (0.5, 0.3, 0.1),
                "rim": 1,
            },
            {"widening": 4, "heights": 1, "rho": (0.3, 0.2, 0.1), "rim": 0.5},
            {"widening": 1.2, "heights": 0.3, "ax": 0.4, "ay": 0.1, "d9": (0.1, 0.1, 0.1)},
            {"widening": -2, "ax": 0.3, "ay": 0.3, "d13": (1e-3, 1e-3, 1e-3)},
            {"widening": 2, "ax": 0.1, "ay": 0.2, "d3": (0.3, 0.5, 0.2)},
        ],
        albedo_cases=[
            {},
            {"ax": 0.4, "ay": 0.4, "d2": (0.3, 0.3, 0.3), "g4": 0.2, "strength": 2, "rim": 0.7},
            {"ax": 0.4, "ay": 0.4, "widening": 2, "heights": 0.5},
            {"ax": 0.4, "ay": 0.4, "widening": 2},
        ],
        cosines=[1, 0.5, 0.1],
        # Logarithms as large as 70 are added, whose rounding errors are those of a number near 70.
        floor=lambda p: 1e-12,
    ),
    "schlick": dict(
        f=schlick_f,
        pdf=schlick_pdf,
        albedo=schlick_albedo,
        defaults={"r": (0.8, 0.8, 0.8), "p": 1, "rough": 0.2},
        cases=[
            {},
            {"rough": 0.7, "p": 0.3, "r": (0, 0.5, 1)},
            {"rough": 1},
            {"rough": 0.01, "p": 0.1},
            {"rough": 1e-8},
        ],
        albedo_cases=[
            {"rough": 0.3, "r": (1, 1, 1)},
            {"rough": 0.8, "p": 0.4, "r": (0.5, 0.5, 0.5)},
            {"rough": 0.05, "r": (0, 0, 0)},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "oren_nayar": dict(
        f=oren_nayar_f,
        pdf=lambda p, wi, wo: vec(wi)[2] / mp.pi,
        albedo=oren_nayar_albedo,
        defaults={"rho": (0.8, 0.8, 0.8), "sigma": 0.3, "form": "full"},
        cases=[
            {},
            {"sigma": 0.66, "rho": (1, 0.5, 0.1)},
            {"sigma": 1e-4},
            {"form": "qualitative"},
            {"form": "qualitative", "sigma": 0.6},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "charlie": dict(
        f=charlie_f,
        pdf=charlie_pdf,
        albedo=charlie_albedo,
        defaults={"tint": (0.8, 0.8, 0.8), "r": 0.3, "terminator": "plain"},
        cases=[
            {},
            {"r": 0.1, "tint": (1, 0.5, 0.1)},
            {"r": 1},
            {"terminator": "soft"},
            {"r": 0.1, "terminator": "soft"},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "hapke": dict(
        f=hapke_f,
        pdf=hapke_pdf,
        albedo=hapke_albedo,
        defaults={
            "w": (0.8, 0.8, 0.8),
            "b": 0.3,
            "c": 0.4,
            "b0": 0.8,
            "h": 0.06,
            "scattering": "multiple",
        },
        cases=[
            {},
            {"b": 0, "b0": 0, "scattering": "single"},
            {"w": (1, 0.5, 1e-6), "b": 0.7, "c": -0.6, "b0": 0},
            {"w": (0.3, 0.2, 0.1), "b": 0.5, "c": 1, "b0": 2, "h": 0.5, "scattering": "single"},
        ],
        cosines=[1, 0.5, 0.1, 0.01],
    ),
    "eon": dict(
        f=eon_f,
        pdf=eon_pdf,
        albedo=eon_albedo,
        defaults={"rho": (0.8, 0.8, 0.8), "r": 0.5},
        cases=[
            {},
            {"r": 1, "rho": (1, 0.5, 0.1)},
            {"r": 1e-4},
            {"r": 0, "rho": (0.9, 0.2, 1e-6)},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "disney": dict(
        f=disney_f,
        pdf=disney_pdf,
        albedo=disney_albedo,
        defaults={
            "base_color": (0.8, 0.8, 0.8),
            "metallic": 0,
            "roughness": 0.5,
            "subsurface": 0,
            "specular": 0.5,
            "specular_tint": 0,
            "anisotropic": 0,
            "sheen": 0,
            "sheen_tint": 0.5,
            "clearcoat": 0,
            "clearcoat_gloss": 1,
            "masking": "remapped",
        },
        cases=[
            {},
            {"metallic": 1, "roughness": 0.2, "anisotropic": 0.8, "base_color": (0.9, 0.5, 0.1)},
            {
                **{"base_color": (0.5, 0.1, 0.02), "subsurface": 0.7, "specular_tint": 0.6},
                **{"sheen": 0.8, "sheen_tint": 0.3, "clearcoat": 0.5, "clearcoat_gloss": 0.2},
            },
            {"masking": "facets", "roughness": 0.8, "anisotropic": 0.5, "specular": 1},
        ],
        albedo_cases=[
            {},
            {"metallic": 0.5, "roughness": 0.8, "base_color": (0.9, 0.5, 0.1)},
            {"subsurface": 0.7, "sheen": 1, "roughness": 0.9, "masking": "facets"},
        ],
        cosines=[1, 0.5, 0.1],
    ),
    "disney_diffuse": dict(
        f=disney_diffuse_f,
        pdf=disney_diffuse_pdf,
        albedo=disney_diffuse_albedo,
        defaults={"rho": (0.8, 0.8, 0.8), "r": 0.5},
        cases=[{}, {"r": 1, "rho": (1, 0.5, 0.1)}, {"r": 0, "rho": (0.9, 0.2, 1e-6)}],
        cosines=[1, 0.5, 0.1, 0.01],
    ),
    "lafortune": dict(
        f=lafortune_f,
        pdf=lafortune_pdf,
        albedo=lafortune_albedo,
        defaults={"cxy": -1, "cz": 0.8, "e": 10, "ks": (0.5, 0.5, 0.5)},
        cases=[
            {},
            {"cxy": 1, "cz": 1, "e": 100, "ks": (1, 0.5, 0.1)},
            {"cxy": -1, "cz": 1, "e": 300},
            {"cxy": -0.7, "cz": 0.9, "e": 3},
            {"cxy": 0, "cz": 1, "e": 1.5},
        ],
        cosines=[1, 0.5, 0.1],
    ),
}


def direction(theta, phi):
    return (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))


def pairs(rng):
    """Anywhere; near the mirror direction at several distances; near the normal; near grazing
    angles."""
    out = []
    for _ in range(3):
        out.append([direction(rng.uniform(0, 1.5), rng.uniform(0, 6.28)) for _ in range(2)])
    for distance in (1e-1, 1e-3, 1e-5):
        theta, phi = rng.uniform(0.3, 1.2), rng.uniform(0, 6.28)
        wi = direction(
            theta + rng.uniform(-1, 1) * distance, phi + math.pi + rng.uniform(-1, 1) * distance
        )
        out.append([wi, direction(theta, phi)])
    out.append([(0.0, 0.0, 1.0), direction(1e-3, 1.0)])
    out.append([direction(1.57, 2.0), direction(1.2, 5.0)])
    return out


def values(function, p, wi, wo):
    mp.mp.dps = 60
    r = function(p, wi, wo)
    return r if r is None or isinstance(r, (list, tuple)) else [r, r, r]


def tolerance(function, p, wi, wo, base):
    """The sum of the relative changes of the result when each input changes by half a unit in the
    last place.

    Vectors with rounded components have a length only close to 1. Formulas that are equal on the
    sphere may then differ, which is included.
    """
    global normalise
    ulp = mp.mpf(2) ** -53
    total = mp.mpf(0)
    moves = [("wi", i) for i in range(3)] + [("wo", i) for i in range(3)]
    unused = {"ior"} if p.get("around") in ("reflection", "retro") else set()
    if p.get("kernel") in ("sech2", "exponential"):
        unused = set(HEIGHTS)
    moves += [(k, None) for k, v in p.items() if isinstance(v, (int, float)) and k not in unused]
    for what, i in moves:
        q, a, b = dict(p), [mp.mpf(c) for c in wi], [mp.mpf(c) for c in wo]
        if what == "wi":
            a[i] *= 1 + ulp
        elif what == "wo":
            b[i] *= 1 + ulp
        else:
            q[what] = mp.mpf(q[what]) * (1 + ulp)
        for normalise in (False, True):  # noqa: B007, a switch of this module
            moved = values(function, q, a, b)
            total += max(
                abs(m - v) / v if v > 0 else abs(m) for m, v in zip(moved, base, strict=True)
            )
    return float(FLOOR + ROUNDINGS * total)


def text(p):
    def one(v):
        return ":".join(repr(c) for c in v) if isinstance(v, tuple) else str(v)

    return " ".join(f"{k}={one(v)}" for k, v in p.items())


def main():
    chosen = sys.argv[1:] or list(MODELS)
    rows = []
    if OUT.exists():
        with OUT.open(newline="") as f:
            rows = [row for row in list(csv.reader(f))[1:] if row[0] not in chosen]
    for name in chosen:
        m = MODELS[name]
        rng = random.Random(name)
        for case in m["cases"]:
            p = {**m["defaults"], **case}
            # A model without f has only delta terms.
            for wi, wo in pairs(rng) if "f" in m else []:
                if p.get("around") == "refraction":
                    wi = (wi[0] / p["ior"], wi[1] / p["ior"])
                    wi = (*wi, -math.sqrt(1 - wi[0] ** 2 - wi[1] ** 2))
                    if rng.random() < 0.5:
                        wi, wo = wo, wi
                elif p.get("around") == "retro":
                    wo = (-wo[0], -wo[1], wo[2])
                elif "pair" in m:
                    wi, wo = m["pair"](p, wi, wo, rng)
                for kind in ("f", "pdf"):
                    v = values(m[kind], p, wi, wo)
                    # Values below the normal range of double precision can't be compared.
                    if v is None or max(v) < mp.mpf("1e-290"):
                        continue
                    t = tolerance(m[kind], p, wi, wo, v)
                    if t > 1e-3:
                        continue  # meaningless: the inputs' rounding determines the value
                    if kind == "f" and "floor" in m:
                        t += m["floor"](p)
                    rows.append(
                        [name, text(case), kind, *map(repr, wi), *map(repr, wo)]
                        + [mp.nstr(c, 17) for c in v]
                        + [f"{t:.2e}"]
                    )
        for case in m.get("albedo_cases", m["cases"]):
            p = {**m["defaults"], **case}
            for c in m["cosines"]:
                mp.mp.dps = 30
                a = m["albedo"](p, c)
                wo = (math.sqrt(1 - c * c), 0.0, c)
                rows.append(
                    [name, text(case), "albedo", "", "", "", *map(repr, wo)]
                    + [mp.nstr(mp.mpf(v), 12) for v in a]
                    + ["1e-06"]
                )
        print(name, len(rows))
    rows.sort(key=lambda row: row[0])  # stable: the order within a model stays
    with OUT.open("w", newline="") as f:
        w = csv.writer(f, lineterminator="\n")
        w.writerow("model parameters kind wi_x wi_y wi_z wo_x wo_y wo_z r g b tolerance".split())
        w.writerows(rows)


if __name__ == "__main__":
    main()
