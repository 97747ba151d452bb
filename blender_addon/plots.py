# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of what a material's values do, drawn with the model's formulas on NumPy arrays.

A square of three: above, the light that leaves in the plane of incidence, half of a circle, or all
of it where light is let through; below a ball under a lamp, and the share of the light that is
reflected over the angle of the view. Red, green and blue are drawn apart, and add up to white. Of
Blender nothing is known here but what its screen shows of a colour.
"""

import functools
from dataclasses import dataclass

import numpy as np

from . import brdfc, color
from .principled import Nearest, misplaced, nearest_principled

#: Pixels of a side.
SIZE = 320
#: The angle in degrees that light comes from, in the half circle.
INCIDENCE = 45.0
#: Samples of an albedo, and angles of its curve.
_SAMPLES, _VIEWS = 256, 13
_HALF = SIZE // 2
_PAPER, _GRID, _INK = 0.13, 0.28, 0.55
#: Dots of a form's curve: no colour that curves of red, green and blue add up to.
_DOTS = np.array([1.0, 0.35, 0.75])


@dataclass(frozen=True)
class Legend:
    """What a picture shows beside the model's own lobes; None for what it does not."""

    #: Blender's own nodes whose lobes are nearest: the roughness of the Glossy node, and
    glossy: float | None = None
    principled: Nearest | None = None
    #: Part of the half circle's light that the material's form sends elsewhere.
    form: float | None = None
    #: Shares (r, g, b) of light from INCIDENCE that are ideally reflected and refracted.
    mirror: tuple | None = None
    refracted: tuple | None = None


def values_in_range(model, values):
    """Values as a node has them, whose last digit may lie beyond a range: sockets are floats. What
    is None, as linked, or of no parameter is left out."""
    known = {}
    for name, parameter in model.parameters.items():
        value = values.get(name)
        if value is None:
            continue
        if isinstance(parameter, brdfc.Choice):
            known[name] = value
        else:
            known[name] = np.clip(np.asarray(value, float), parameter.min, parameter.max)
    return known


def _slice(theta):
    return np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=-1)


def slice_of(model, values, theta):
    """f cos for light from INCIDENCE at these angles, positive where it is reflected to: (N, 3)."""
    light = _slice(np.radians(-INCIDENCE))
    return model.eval(_slice(theta), light, **values) * np.cos(theta)[:, None]


def glossy_slice(alpha, theta):
    """The same of Blender's Glossy node, white, with GGX's distribution of that width: (N,).

    B. Walter et al.: Microfacet Models for Refraction through Rough Surfaces, EGSR 2007, eqs. 20,
    33 and 34, without the light of further reflections. Width is the node's roughness squared.
    """
    light, out = _slice(np.radians(-INCIDENCE)), _slice(theta)
    half = light + out
    half = half / np.linalg.norm(half, axis=-1, keepdims=True)
    a2 = alpha * alpha
    cos2 = half[:, 2] ** 2
    d = a2 / (np.pi * (cos2 * (a2 - 1) + 1) ** 2)

    def shadow(z):
        return 2 / (1 + np.sqrt(1 + a2 * (1 / np.maximum(z * z, 1e-12) - 1)))

    return d * shadow(light[2]) * shadow(out[:, 2]) / (4 * light[2])


@functools.cache
def _glossy_slices():
    """Roughnesses of the Glossy node, and their slices."""
    roughness = np.linspace(0.05, 1, 39)
    return roughness, np.stack([glossy_slice(r * r, _angles()) for r in roughness])


def nearest_glossy(curve):
    """The roughness of the Glossy node whose slice has the shape nearest to a curve over _angles(),
    and that slice, as high as fits best; nothing for a curve that is 0."""
    if not curve.any():
        return None
    roughness, slices = _glossy_slices()
    heights = slices @ curve / np.sum(slices * slices, axis=1)
    best = int(np.argmin(np.sum((heights[:, None] * slices - curve) ** 2, axis=1)))
    return float(roughness[best]), heights[best] * slices[best]


@functools.cache
def _angles():
    """Angles of the half circle, densest about the mirror direction, where lobes are narrow."""
    even = np.linspace(-np.pi / 2, np.pi / 2, 361)
    near = np.radians(INCIDENCE) + np.geomspace(1e-4, 0.2, 60)[:, None] * np.array([-1, 1])
    return np.unique(np.concatenate([even, near.ravel(), [np.radians(INCIDENCE)]]))


@functools.cache
def _polar_grid(whole=False):
    """Of the upper half's pixels the radius, 1 at the rim, and the angle; the first row is the
    lowest. Then pixels of a radius. `whole`: a circle, not the upper half of one."""
    unit, middle = (0.47 * _HALF, 0.5 * _HALF) if whole else (0.94 * _HALF, 0.03 * _HALF)
    x, y = np.meshgrid(np.arange(SIZE) + 0.5 - _HALF, np.arange(_HALF) + 0.5 - middle)
    return np.hypot(x, y) / unit, np.arctan2(x, y), unit


@functools.cache
def _pixels_among_angles(whole):
    """Where the angle of each pixel lies among _angles(): the one below, and how far beyond it."""
    angles, (_, angle, _) = _angles(), _polar_grid(whole)
    below = np.clip(np.searchsorted(angles, angle) - 1, 0, len(angles) - 2)
    share = (angle - angles[below]) / (angles[below + 1] - angles[below])
    return below, np.clip(share, 0, 1)


def _in_pixels(curve, whole):
    """A curve over _angles() at the angles of the pixels."""
    below, share = _pixels_among_angles(whole)
    return curve[below] + share * np.diff(curve)[below]


def _line(curve, whole, dash=None):
    """How much of each pixel a curve over _angles() covers, 0 to 1, in a line of two pixels; and
    the curve at each. `dash`: how many dashes a radius has, and which part of them is drawn."""
    radius, angle, unit = _polar_grid(whole)
    at, slope = _in_pixels(curve, whole), _in_pixels(np.gradient(curve, _angles()), whole)
    off = np.abs(radius - at) / np.sqrt(1 + (slope / np.maximum(radius, 0.02)) ** 2)
    # Steep flanks of a narrow lobe would draw a line beyond its tip.
    tip = curve.max() + 1.4 / unit
    ink = np.clip(1.8 - off * unit, 0, 1) * (radius < tip) * (np.abs(angle) <= np.pi / 2)
    if dash:  # by the way along the curve, which on flanks is the radius
        steps = np.hypot(np.diff(curve), 0.5 * (curve[1:] + curve[:-1]) * np.diff(_angles()))
        way = _in_pixels(np.concatenate([[0], np.cumsum(steps)]), whole)
        along = np.where(np.abs(slope) > radius, radius, way)
        ink *= along * dash[0] % 1 < dash[1]
    return ink, at


def _draw_arrow(picture, direction, shares, whole):
    """An arrow from the middle to the rim, bright as far as the share of each channel."""
    radius, angle, unit = _polar_grid(whole)
    along, across = radius * np.cos(angle - direction), np.abs(radius * np.sin(angle - direction))
    along, across = along * unit, across * unit
    head = np.clip(0.45 * (unit - along) + 0.5 - across, 0, 1) * (along > unit - 11)
    shaft = np.clip(1.2 - across, 0, 1) * (along < unit - 10)
    arrow = _INK * np.maximum(head, shaft) * (along > 0)
    np.maximum(picture, arrow[..., None], out=picture)
    for c, share in enumerate(shares):
        ink = np.clip(2 - across, 0, 1) * (along > 0) * (along < share * unit)
        np.maximum(picture[..., c], ink, out=picture[..., c])


def _complete(model, values):
    return {name: p.default for name, p in model.parameters.items()} | values


def _refraction(model, values):
    """The angle from the upper normal of light that goes on below, by the parameter `ior`."""
    sine = np.sin(np.radians(INCIDENCE)) / _complete(model, values).get("ior", 1.0)
    return np.pi - np.arcsin(np.clip(sine, 0, 1))


def _draw_lobes(picture, model, values, form, whole):
    """Draws what is scattered, over its peak: the model's lobes, the form's and the nearest nodes';
    returns what the legend says of them."""
    radius, angle, _ = _polar_grid(whole)
    lobes = slice_of(model, values, _angles())
    peak = lobes.max()
    if not peak > 0:
        return {}
    light = _slice(np.radians(-INCIDENCE))
    # Of a node with an ideal mirror there is no curve.
    mirror = model.mirror(light, **values).any()
    node = None if mirror else nearest_principled(lobes, _angles(), INCIDENCE)
    glossy = nearest_glossy(0.95 / peak * lobes.mean(axis=1))
    if glossy:
        shade = 0.5 * _line(np.minimum(glossy[1], 1.0), whole)[0]
        np.maximum(picture, shade[..., None], out=picture)
    said = {"glossy": glossy[0] if glossy else None, "principled": node}
    for c in range(3):
        line, at = _line(0.95 / peak * lobes[:, c], whole)
        ink = np.maximum(line, 0.35 * (radius < at) * (np.abs(angle) <= np.pi / 2))
        np.maximum(picture[..., c], ink, out=picture[..., c])
        if node:
            dashes, _ = _line(np.minimum(0.95 / peak * node.curve[:, c], 1.0), whole, (16, 0.6))
            np.maximum(picture[..., c], 0.85 * dashes, out=picture[..., c])
    if form:
        curve = form(_complete(model, values), _slice(_angles()), light)
        said["form"] = misplaced(curve, lobes, np.gradient(_angles()))
        for channel in np.unique(np.clip(0.95 / peak * curve, 0, 1), axis=1).T:
            dots, _ = _line(channel, whole, (22, 0.42))
            on = dots > 0
            picture[on] += dots[on][:, None] * (_DOTS - picture[on])
    return said


def _polar(model, values, form):
    light = _slice(np.radians(-INCIDENCE))
    mirror, refracted = model.mirror(light, **values), model.transmit(light, **values)
    whole = bool(refracted.any())
    radius, angle, unit = _polar_grid(whole)
    picture = np.full((_HALF, SIZE, 3), _PAPER)
    for ring in (0.25, 0.5, 0.75, 1.0):
        on = np.abs(radius - ring) * unit < 0.6
        picture[on if whole else on & (np.abs(angle) <= np.pi / 2)] = _GRID
    if whole:  # the surface
        picture[_HALF // 2, np.abs(np.arange(SIZE) + 0.5 - _HALF) < unit] = _INK
    from_light = np.abs(angle + np.radians(INCIDENCE)) * radius * unit < 0.9
    picture[from_light & (radius < 1)] = _INK
    said = _draw_lobes(picture, model, values, form, whole)
    # What has no width is an arrow.
    if mirror.any():
        _draw_arrow(picture, np.radians(INCIDENCE), mirror, whole)
        said["mirror"] = tuple(mirror.tolist())
    if refracted.any():
        _draw_arrow(picture, _refraction(model, values), refracted, whole)
        said["refracted"] = tuple(refracted.tolist())
    return picture, Legend(**said)


@functools.cache
def _ball():
    """Where the ball is, and in each pixel of it the frame of its surface, its third axis last; the
    first is the object's Z axis along the surface, as the shaders have it."""
    x = ((np.arange(_HALF) + 0.5) / _HALF * 2 - 1) / 0.92
    x, y = np.meshgrid(x, x)
    on = x * x + y * y < 1
    n = np.stack([x[on], y[on], np.sqrt(1 - x[on] ** 2 - y[on] ** 2)], axis=-1)
    up = np.array([0.0, 1.0, 0.0])
    t = up - n * (n @ up)[:, None]
    t = t / np.maximum(np.linalg.norm(t, axis=-1, keepdims=True), 1e-9)
    frame = np.stack([t, np.cross(n, t), n], axis=-2)
    # From the upper left, and the viewer far away in front.
    lamp = np.array([-0.45, 0.6, 0.66])
    lamp = lamp / np.linalg.norm(lamp)
    wi, wo = frame @ lamp, frame @ np.array([0.0, 0.0, 1.0])
    wi, wo = (w / np.linalg.norm(w, axis=-1, keepdims=True) for w in (wi, wo))
    mirrored = 2 * n * n[:, 2:] - np.array([0.0, 0.0, 1.0])
    sky = np.clip(0.5 + mirrored[:, 1:2], 0, 1) * 0.8
    return on, wi, wo, sky


def ball_light(model, values):
    """What a ball sends to the viewer, of a lamp that gives a white matte surface that faces it 1,
    and of a sky in what reflects like a mirror: linear RGB of the pixels of _ball()."""
    _, wi, wo, sky = _ball()
    light = model.eval(wi, wo, **values) * (np.pi * np.maximum(wi[:, 2:], 0))
    return light + model.mirror(wo, **values) * sky


def displayed(linear):
    """Linear light as a screen has it; 1 becomes 0.8, what is brighter never quite white."""
    return color.to_screen(1 - np.exp(-linear))


def _lit_ball(model, values):
    on = _ball()[0]
    picture = np.full((_HALF, _HALF, 3), _PAPER)
    picture[on] = displayed(ball_light(model, values))
    return picture


@functools.cache
def _views():
    return np.cos(np.radians(np.linspace(0, 88, _VIEWS)))


def albedo_curve(model, values):
    """The share of light that is reflected, at _VIEWS angles from 0 to 88 degrees: (_VIEWS, 3)."""
    return model.albedo(_views(), samples=_SAMPLES, **values)


def _albedo(model, values):
    """Over the view angle, 0 to 90 degrees; the line is 1, all of the light."""
    picture = np.full((_HALF, _HALF, 3), _PAPER)
    margin, top = 10, 1.25
    across, along = _HALF - 2 * margin, _HALF - 2 * margin
    rows = np.arange(_HALF)[:, None]
    columns = np.arange(margin, margin + across)
    for share, ink in ((0.0, _INK), (0.5, _GRID), (1.0, _INK)):
        picture[margin + round(share / top * along), margin : margin + across] = ink
    picture[margin : margin + along, margin] = _INK
    degrees = np.linspace(0, 88, _VIEWS)
    curve = albedo_curve(model, values)
    for c in range(3):
        height = np.interp((columns - margin) * 90 / across, degrees, curve[:, c])
        height = margin + np.minimum(height, top) / top * along
        steep = np.sqrt(1 + np.gradient(height) ** 2)
        ink = np.clip(1.5 - np.abs(rows - height) / steep, 0, 1)
        part = picture[:, margin : margin + across, c]
        np.maximum(part, ink, out=part)
    return picture


def draw(model_name, values, form=None):
    """The picture of a model with a node's values: (SIZE, SIZE, 4), 0 to 1 as a screen shows it,
    the first row the lowest; and its Legend. `form`: f cos of a form that reflects other light, as
    a function of complete values, wi (N, 3) and wo (3,).

    Raises ValueError for a model that this extension does not have, and what `form` raises.
    """
    model = brdfc.model(model_name)
    known = values_in_range(model, values)
    above, legend = _polar(model, known, form)
    below = np.concatenate([_lit_ball(model, known), _albedo(model, known)], axis=1)
    picture = np.ones((SIZE, SIZE, 4))
    picture[..., :3] = np.concatenate([below, above], axis=0)
    return picture, legend
