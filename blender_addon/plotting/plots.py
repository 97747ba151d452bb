# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws plots of a material's values, by the model's formulas on NumPy arrays.

A picture has three parts, one above the other: a polar plot of the light that leaves in the plane
of incidence (a half circle, or a full one if light is transmitted); balls under a lamp; and the
albedo over the view angle. Red, green and blue are separate curves, whose sum is white. The model
is drawn as a solid line, the material's form as a dotted one where it differs, and the nearest
Principled node as a dashed one. The only use of Blender here is its conversion of colours to the
screen's.
"""

import dataclasses
import functools
from dataclasses import dataclass

import numpy as np

from .. import brdfc
from ..brdfc._model import sequence
from ..common import color
from ..nearest import native_bsdf
from ..nearest.principled import Nearest, Shares, misplaced
from . import reflected

#: Sizes in pixels: width of the picture, diameter of a ball, height of the legend's lines below it.
SIZE, BALL, KEY = 324, 108, 10
#: Rows of a picture, from the lowest up.
CURVES, BALLS, ABOVE = slice(0, 104), slice(104, 222), slice(222, 384)
#: Numbers of samples of a form's three sampling techniques.
_FORM_SAMPLES = 128, 128, 256
_HALF = SIZE // 2
_PAPER, _GRID, _INK = 0.13, 0.28, 0.55
#: Colour of a form's dotted curve: no sum of red, green and blue curves has it.
_DOTS = np.array([1.0, 0.35, 0.75])
#: Period of dashes and dots in pixels, and the fraction of it that is drawn.
_DASHED, _DOTTED = (9.4, 0.6), (6.8, 0.42)
#: Distance in pixels between a model's arrow and the node's.
_ASIDE = 5.0


@dataclass(frozen=True)
class Legend:
    """What a picture shows besides the model's own light; None for what it does not show."""

    #: The nearest of Blender's own nodes: the roughness of the Glossy node, and the Principled one.
    glossy: float | None = None
    principled: Nearest | None = None
    #: Fraction of the light in the half circle that the material's form misplaces.
    form: float | None = None
    #: Fractions (r, g, b) of light from INCIDENCE that are ideally reflected and refracted.
    mirror: tuple | None = None
    refracted: tuple | None = None


def glossy_slice(alpha, theta):
    """f cos (N,) of Blender's white Glossy node, for light from INCIDENCE, at angles theta: the GGX
    distribution with this alpha, which is the roughness squared, without multiple scattering."""
    light = reflected.in_plane(np.radians(-reflected.INCIDENCE))
    return native_bsdf.facets(reflected.in_plane(theta), light, (alpha, alpha))


@functools.cache
def _glossy_slices():
    """Roughness values of the Glossy node, and the slice of each."""
    roughness = np.linspace(0.05, 1, 39)
    return roughness, np.stack([glossy_slice(r * r, reflected.angles()) for r in roughness])


def nearest_glossy(curve):
    """The roughness of the Glossy node whose slice comes nearest in shape to a curve over
    angles(), and that slice, scaled to fit; nothing for a curve that is 0."""
    if not curve.any():
        return None
    roughness, slices = _glossy_slices()
    heights = slices @ curve / np.sum(slices * slices, axis=1)
    best = int(np.argmin(np.sum((heights[:, None] * slices - curve) ** 2, axis=1)))
    return float(roughness[best]), heights[best] * slices[best]


@functools.cache
def _polar_grid(whole=False):
    """Polar coordinates of the pixels of the upper half, lowest row first: the radius (1 at the
    rim) and the angle; then the radius in pixels. `whole`: of the full circle."""
    unit, middle = (0.47 * _HALF, 0.5 * _HALF) if whole else (0.94 * _HALF, 0.03 * _HALF)
    x, y = np.meshgrid(np.arange(SIZE) + 0.5 - _HALF, np.arange(_HALF) + 0.5 - middle)
    return np.hypot(x, y) / unit, np.arctan2(x, y), unit


@functools.cache
def _pixels_among_angles(whole):
    """Positions of the pixels' angles among angles(): the index below, and the fraction beyond
    it."""
    angles, (_, angle, _) = reflected.angles(), _polar_grid(whole)
    below = np.clip(np.searchsorted(angles, angle) - 1, 0, len(angles) - 2)
    share = (angle - angles[below]) / (angles[below + 1] - angles[below])
    return below, np.clip(share, 0, 1)


def _in_pixels(curve, whole):
    """Interpolates a curve over angles() to the angles of the pixels."""
    below, share = _pixels_among_angles(whole)
    return curve[below] + share * np.diff(curve)[below]


def _line(curve, dash=None, whole=False):
    """The coverage of each pixel, 0 to 1, by a curve over angles() drawn two pixels wide. `dash`:
    period in pixels, and the fraction of it that is drawn."""
    radius, angle, unit = _polar_grid(whole)
    at, slope = _in_pixels(curve, whole), _in_pixels(np.gradient(curve, reflected.angles()), whole)
    off = np.abs(radius - at) / np.sqrt(1 + (slope / np.maximum(radius, 0.02)) ** 2)
    # Without this limit, the steep flanks of a narrow lobe would extend the line beyond its tip.
    tip = curve.max() + 1.4 / unit
    ink = np.clip(1.8 - off * unit, 0, 1) * (radius < tip) * (np.abs(angle) <= np.pi / 2)
    if dash:  # by the length of the curve: on flanks, the radius
        steps = np.hypot(
            np.diff(curve), 0.5 * (curve[1:] + curve[:-1]) * np.diff(reflected.angles())
        )
        way = _in_pixels(np.concatenate([[0], np.cumsum(steps)]), whole)
        along = np.where(np.abs(slope) > radius, radius, way)
        ink *= along * unit % dash[0] < dash[0] * dash[1]
    return ink


def _draw_curves(picture, line, own, form, node):
    """Draws curves (N, 3) of the model, and of its form and the Principled node unless None."""
    for c in range(3):
        np.maximum(picture[..., c], line(own[:, c]), out=picture[..., c])
        if node is not None:
            dashes = 0.85 * line(node[:, c], _DASHED)
            np.maximum(picture[..., c], dashes, out=picture[..., c])
    if form is not None:
        for channel in np.unique(form, axis=1).T:
            dots = line(channel, _DOTTED)
            on = dots > 0
            picture[on] += dots[on][:, None] * (_DOTS - picture[on])


def _draw_arrow(picture, direction, shares, whole, aside=0):
    """An arrow from the centre to the rim, whose brightness is each channel's share. `aside`:
    offset in pixels, for a dashed arrow without a head."""
    radius, angle, unit = _polar_grid(whole)
    along, across = radius * np.cos(angle - direction), radius * np.sin(angle - direction)
    along, across = along * unit, np.abs(across * unit - aside)
    drawn = (along > 0) & (along % _DASHED[0] < _DASHED[0] * _DASHED[1] if aside else True)
    if not aside:
        head = np.clip(0.45 * (unit - along) + 0.5 - across, 0, 1) * (along > unit - 11)
        shaft = np.clip(1.2 - across, 0, 1) * (along < unit - 10)
        arrow = _INK * np.maximum(head, shaft) * drawn
        np.maximum(picture, arrow[..., None], out=picture)
    for c, share in enumerate(shares):
        ink = np.clip(2 - across, 0, 1) * drawn * (along < share * unit)
        np.maximum(picture[..., c], ink, out=picture[..., c])


def _complete(model, values):
    return {name: p.default for name, p in model.parameters.items()} | values


def _refraction(ior):
    """The angle, from the upper normal, of the light refracted below the surface."""
    return np.pi - np.arcsin(np.clip(np.sin(np.radians(reflected.INCIDENCE)) / ior, 0, 1))


def _draw_lobes(picture, own, form, node, whole):
    """Draws curves of the scattered light relative to the model's peak; returns what the legend
    says."""
    radius, angle, _ = _polar_grid(whole)
    peak = own.max()
    if not peak > 0:
        return {}
    over_peak = 0.95 / peak * own
    glossy = nearest_glossy(over_peak.mean(axis=1))
    if glossy:
        shade = 0.5 * _line(np.minimum(glossy[1], 1.0), whole=whole)
        np.maximum(picture, shade[..., None], out=picture)
    for c in range(3):
        within = (radius < _in_pixels(over_peak[:, c], whole)) & (np.abs(angle) <= np.pi / 2)
        np.maximum(picture[..., c], 0.35 * within, out=picture[..., c])
    others = (None if c is None else np.clip(0.95 / peak * c, 0, 1) for c in (form, node))
    _draw_curves(picture, functools.partial(_line, whole=whole), over_peak, *others)
    off = None if form is None else misplaced(form, own, np.gradient(reflected.angles()))
    return {"glossy": glossy[0] if glossy else None, "form": off}


def _polar(found, ior):
    here, near = found.here, found.near
    whole = bool(here.refracted.any())
    radius, angle, unit = _polar_grid(whole)
    picture = np.full((_HALF, SIZE, 3), _PAPER)
    for ring in (0.25, 0.5, 0.75, 1.0):
        on = np.abs(radius - ring) * unit < 0.6
        picture[on if whole else on & (np.abs(angle) <= np.pi / 2)] = _GRID
    if whole:  # the surface
        picture[_HALF // 2, np.abs(np.arange(SIZE) + 0.5 - _HALF) < unit] = _INK
    from_light = np.abs(angle + np.radians(reflected.INCIDENCE)) * radius * unit < 0.9
    picture[from_light & (radius < 1)] = _INK
    said = _draw_lobes(picture, *found.slices, whole)
    # Ideal reflection and refraction have no width, and are drawn as arrows.
    if here.mirror.any():
        _draw_arrow(picture, np.radians(reflected.INCIDENCE), here.mirror, whole)
        said["mirror"] = tuple(here.mirror.tolist())
    if whole:
        _draw_arrow(picture, _refraction(ior), here.refracted, whole)
        said["refracted"] = tuple(here.refracted.tolist())
    if near and any(near.mirror):
        _draw_arrow(picture, np.radians(reflected.INCIDENCE), near.mirror, whole, _ASIDE)
    if whole and near and near.transmission:
        _draw_arrow(picture, _refraction(near.ior), near.refracted, whole, _ASIDE)
    return picture, Legend(principled=near, **said)


@functools.cache
def _ball():
    """Mask of the ball, and for each of its pixels the surface frame, the normal last; the first
    axis is the object's Z axis along the surface, as in the shaders."""
    x = ((np.arange(BALL) + 0.5) / BALL * 2 - 1) / 0.92
    x, y = np.meshgrid(x, x)
    on = x * x + y * y < 1
    n = np.stack([x[on], y[on], np.sqrt(1 - x[on] ** 2 - y[on] ** 2)], axis=-1)
    up = np.array([0.0, 1.0, 0.0])
    t = up - n * (n @ up)[:, None]
    t = t / np.maximum(np.linalg.norm(t, axis=-1, keepdims=True), 1e-9)
    frame = np.stack([t, np.cross(n, t), n], axis=-2)
    # The lamp is at the upper left; the viewer far away in front.
    lamp = np.array([-0.45, 0.6, 0.66])
    lamp = lamp / np.linalg.norm(lamp)
    wi, wo = frame @ lamp, frame @ np.array([0.0, 0.0, 1.0])
    wi, wo = (w / np.linalg.norm(w, axis=-1, keepdims=True) for w in (wi, wo))
    mirrored = 2 * n * n[:, 2:] - np.array([0.0, 0.0, 1.0])
    sky = np.clip(0.5 + mirrored[:, 1:2], 0, 1) * 0.8
    return on, wi, wo, sky


def ball_light(scattered, mirror):
    """Light from a ball to the viewer: linear RGB of the pixels of _ball().

    The lamp gives a white diffuse surface that faces it a radiance of 1; ideal mirrors reflect a
    sky. `scattered`: f cos of these pixels, `mirror`: their weight of ideal mirror reflection."""
    _, wi, _, sky = _ball()
    return np.pi * scattered * (wi[:, 2:] > 0) + mirror * sky


@functools.cache
def _rings():
    """The ball's pixels in groups of eight with the same view angle: their indices among those of
    _ball(), (k, 8), and wi (k, 8, 3) and wo (k, 3) in a frame whose xz plane contains the
    viewer."""
    on, wi, wo, _ = _ball()
    number = np.zeros(on.shape, int)
    number[on] = np.arange(on.sum())
    half = BALL // 2
    x, y = np.nonzero(np.tril(on[half:, half:]))
    mates = [(a, b) for p, q in ((x, y), (y, x)) for a in (p, ~p) for b in (q, ~q)]
    index = np.stack([number[half + a, half + b] for a, b in mates], axis=-1)
    wi, wo = wi[index], wo[index]
    sine = np.hypot(wo[..., 0], wo[..., 1])
    c, s = wo[..., 0] / sine, wo[..., 1] / sine
    turned = [c * wi[..., 0] + s * wi[..., 1], c * wi[..., 1] - s * wi[..., 0], wi[..., 2]]
    viewer = np.stack([sine, 0 * sine, wo[..., 2]], axis=-1)
    return index, np.stack(turned, axis=-1), viewer[:, 0]


def tone_map(linear):
    """Maps linear light to the screen: 1 becomes 0.8, and brighter light never quite white."""
    return color.to_screen(1 - np.exp(-linear))


def _balls(lights):
    """Balls of the model, its form and the Principled node, side by side, unless None; below each
    the line style of its curve."""
    picture = np.full((BALL + KEY, SIZE, 3), _PAPER)
    keys = (np.ones(3), 1.0, 1.0), (_DOTS, *_DOTTED), (np.full(3, 0.85), *_DASHED)
    shown = [(light, key) for light, key in zip(lights, keys, strict=True) if light is not None]
    on, stroke = _ball()[0], np.arange(BALL // 2)
    for i, (light, (ink, step, part)) in enumerate(shown):
        left = (2 * i + 1) * SIZE // (2 * len(shown)) - BALL // 2
        picture[KEY:, left : left + BALL][on] = tone_map(light)
        drawn = left + BALL // 4 + stroke[stroke % step < step * part]
        picture[KEY // 2 : KEY // 2 + 2, drawn] = ink
    return picture


@functools.cache
def _numbers():
    """Random numbers for three sampling techniques: model, microfacets, cosine."""
    return np.split(sequence(sum(_FORM_SAMPLES)), np.cumsum(_FORM_SAMPLES)[:2])


def _form_excess(model, values, scattered, width):
    """How much more light a form scatters than the model, as a fraction of the incident light,
    (VIEWS, 3). `scattered`: the form's f cos for wi (VIEWS, n, 3).

    Estimated by MIS of three techniques: the model's sampling, GGX microfacets of alpha `width`,
    and the cosine. The noise vanishes where the two scatter the same."""
    wo, (u, of_h, of_z) = reflected.directions()[:, None], _numbers()
    drawn = model.sample(wo, u, **values)
    h = native_bsdf.draw_facets(of_h[:, 1:], (width, width))
    mirrored = 2 * (wo * h).sum(-1, keepdims=True) * h - wo
    r, phi = np.sqrt(of_z[:, 1]), 2 * np.pi * of_z[:, 2]
    matte = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - r * r)], axis=-1)
    matte = np.broadcast_to(matte, (reflected.VIEWS, *matte.shape))
    wi = np.concatenate([drawn.wi, mirrored, matte], axis=1)
    lit = wi[..., 2] > 1e-6
    lit[:, : len(u)] &= drawn.pdf > 0
    wi = np.where(lit[..., None], wi, [0.0, 0.0, 1.0])
    wi = wi / np.linalg.norm(wi, axis=-1, keepdims=True)
    h = native_bsdf.half(wi, wo)
    facets = native_bsdf.distribution(h, (width, width), False) * h[..., 2]
    facets = facets / (4 * np.maximum((wo * h).sum(-1), 1e-9))
    densities = model.pdf(wi, wo, **values), facets, wi[..., 2] / np.pi
    density = sum(n * p for n, p in zip(_FORM_SAMPLES, densities, strict=True))
    more = scattered(wi) - model.eval(wi, wo, **values) * wi[..., 2:]
    return (more * (lit / density)[..., None]).sum(axis=1)


def _albedo(own, form, node):
    """Albedo over the view angle from 0 to 90 degrees, of the model, its form and the Principled
    node; the upper line is 1, all of the light."""
    height, margin, top = CURVES.stop - CURVES.start, 8, 1.15
    picture = np.full((height, SIZE, 3), _PAPER)
    across, along = SIZE - 2 * margin, height - 2 * margin
    rows, columns = np.arange(height)[:, None], np.arange(margin, margin + across)
    for share, ink in ((0.0, _INK), (0.5, _GRID), (1.0, _INK)):
        picture[margin + round(share / top * along), margin : margin + across] = ink
    picture[margin : margin + along, margin] = _INK

    def line(curve, dash=None):
        at = np.interp((columns - margin) * 90 / across, reflected.degrees(), curve)
        at = margin + np.clip(at, 0, top) / top * along
        slope = np.gradient(at)
        ink = np.clip(1.5 - np.abs(rows - at) / np.sqrt(1 + slope**2), 0, 1)
        if dash:
            ink *= np.cumsum(np.hypot(1, slope)) % dash[0] < dash[0] * dash[1]
        return ink

    _draw_curves(picture[:, margin : margin + across], line, own, form, node)
    return picture


@dataclass(frozen=True)
class Light:
    """The reflected light: of the model, of its form and of the nearest Principled node; None for
    what is not drawn."""

    #: f cos over angles(), (N, 3), for light from INCIDENCE.
    slices: tuple
    #: Albedos at VIEWS angles, (VIEWS, 3), including ideal reflection and refraction.
    albedos: tuple
    #: Results of ball_light().
    balls: tuple
    #: The model's Shares for light from INCIDENCE.
    here: Shares
    near: Nearest | None


def _of_form(model, values, form, shares, width):
    """A form's scattered light in the plane of incidence, its albedo, and its ball. As all fitted
    forms are isotropic, one view for each ring of the ball spares most of the work."""
    index, lights, viewers = _rings()
    wo = np.concatenate(
        [reflected.in_plane(np.radians([-reflected.INCIDENCE])), reflected.directions(), viewers]
    )
    lobes = form(_complete(model, values), wo)
    one, views, rings = slice(0, 1), slice(1, 1 + reflected.VIEWS), slice(1 + reflected.VIEWS, None)
    curve = lobes.scattered(reflected.in_plane(reflected.angles())[None], one)[0]
    excess = _form_excess(model, values, lambda wi: lobes.scattered(wi, views), width)
    ball = np.empty((2, len(_ball()[1]), 3))
    ball[0, index] = lobes.scattered(lights, rings)
    ball[1, index] = lobes.ideal(rings)[:, None]
    return curve, shares.scattered + excess + lobes.ideal(views), ball_light(*ball)


def _of_node(near):
    """The same for a Principled node."""
    native, wo = near.native, reflected.directions()
    terms = native_bsdf.view_terms(native, wo)
    _, wi, viewers, _ = _ball()
    # np.interp needs increasing cosines, but they decrease from view to view.
    columns = terms.taken, *terms.gloss.T, *terms.metal.T
    taken, *rest = (np.interp(viewers[:, 2], reflected.views()[::-1], x[::-1]) for x in columns)
    gloss, metal = np.stack(rest[:3], axis=-1), np.stack(rest[3:], axis=-1)
    of_view = native_bsdf.ViewTerms(taken, gloss, metal)
    # What the base lets through does not light the ball.
    lit = dataclasses.replace(native, color=(0.0, 0.0, 0.0)) if near.transmission else native
    f_cos = native_bsdf.f_cos_of_view(lit, wi, viewers, of_view)
    ball = ball_light(f_cos, native_bsdf.mirror(native, viewers))
    return near.curve, native_bsdf.albedo(native, wo, terms), ball


def light(model, values, form=None):
    """The Light of a model at values_in_range(), and of `form` as in draw()."""
    whole = reflected.of_model(model, values)
    near = whole.nearest()
    _, wi, viewers, _ = _ball()
    f_cos, lit = np.zeros_like(wi), wi[:, 2] > 0
    f_cos[lit] = model.eval(wi[lit], viewers[lit], **values) * wi[lit, 2:]
    own = whole.curve, whole.albedo, ball_light(f_cos, model.mirror(viewers, **values))
    width = max(near.roughness**2, 0.01) if near else 1.0
    formed = _of_form(model, values, form, whole.shares, width) if form else (None,) * 3
    node = _of_node(near) if near else (None,) * 3
    return Light(*zip(own, formed, node, strict=True), whole.here, near)


def draw(model_name, values, form=None):
    """Draws the picture for a node's values.

    Returns an array (rows, SIZE, 4) of screen colours from 0 to 1, lowest row first, and its
    Legend. `form`: for a form that differs from its model, a function that returns its
    shader_text.Lobes, given complete values and viewers (k, 3). Raises ValueError for a model that
    this extension lacks, and what `form` raises.
    """
    model = brdfc.model(model_name)
    known = reflected.values_in_range(model, values)
    found = light(model, known, form)
    above, legend = _polar(found, _complete(model, known).get("ior", 1.0))
    picture = np.ones((ABOVE.stop, SIZE, 4))
    picture[CURVES, :, :3] = _albedo(*found.albedos)
    picture[BALLS, :, :3] = _balls(found.balls)
    picture[ABOVE, :, :3] = above
    return picture, legend
