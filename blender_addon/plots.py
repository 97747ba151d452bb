# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of what a material's values do, drawn with the model's formulas on NumPy arrays.

A square of three: above, the light that leaves in the plane of incidence, half of a circle; below
a ball under a lamp, and the share of the light that is reflected over the angle of the view. Red,
green and blue are drawn apart, and add up to white. Of Blender nothing is known here but what its
screen shows of a colour.
"""

import functools
from dataclasses import dataclass

import numpy as np

from . import brdfc, color
from .principled import Nearest, nearest_principled

#: Pixels of a side.
SIZE = 320
#: The angle in degrees that light comes from, in the half circle.
INCIDENCE = 45.0
#: Samples of an albedo, and angles of its curve.
_SAMPLES, _VIEWS = 256, 13
_HALF = SIZE // 2
_PAPER, _GRID, _INK = 0.13, 0.28, 0.55


@dataclass(frozen=True)
class Nodes:
    """Blender's own nodes whose lobes are nearest to one, or None."""

    #: The roughness of the Glossy node.
    glossy: float | None = None
    principled: Nearest | None = None


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
def _polar_grid():
    """Radius, 1 at the rim, and angle of the upper half's pixels; the first row is the lowest."""
    x = (np.arange(SIZE) + 0.5) / _HALF - 1
    y = (np.arange(_HALF) + 0.5) / _HALF - 0.03
    x, y = np.meshgrid(x / 0.94, y / 0.94)
    return np.hypot(x, y), np.arctan2(x, y)


@functools.cache
def _pixels_among_angles():
    """Where the angle of each pixel lies among _angles(): the one below, and how far beyond it."""
    angles, (_, angle) = _angles(), _polar_grid()
    below = np.clip(np.searchsorted(angles, angle) - 1, 0, len(angles) - 2)
    share = (angle - angles[below]) / (angles[below + 1] - angles[below])
    return below, np.clip(share, 0, 1)


def _in_pixels(curve):
    """A curve over _angles() at the angles of the pixels."""
    below, share = _pixels_among_angles()
    return curve[below] + share * np.diff(curve)[below]


def _line(curve, dashed=False):
    """How much of each pixel a curve over _angles() covers, 0 to 1, in a line of two pixels; and
    the curve at each."""
    radius, angle = _polar_grid()
    at, slope = _in_pixels(curve), _in_pixels(np.gradient(curve, _angles()))
    off = np.abs(radius - at) / np.sqrt(1 + (slope / np.maximum(radius, 0.02)) ** 2)
    # Steep flanks of a narrow lobe would draw a line beyond its tip.
    ink = np.clip(1.8 - off * _HALF * 0.94, 0, 1) * (radius < curve.max() + 1.5 / _HALF)
    if dashed:  # by the way along the curve, which on flanks is the radius
        along = np.where(np.abs(slope) > radius, radius, radius * angle)
        ink *= along * 16 % 1 < 0.6
    return ink, at


def _polar(model, values):
    radius, angle = _polar_grid()
    picture = np.full((_HALF, SIZE, 3), _PAPER)
    upper = np.abs(angle) <= np.pi / 2
    for ring in (0.25, 0.5, 0.75, 1.0):
        picture[(np.abs(radius - ring) < 0.004) & upper] = _GRID
    light = np.abs(angle + np.radians(INCIDENCE)) * radius < 0.006
    picture[light & (radius < 1)] = _INK
    lobes = slice_of(model, values, _angles())
    mirror = model.mirror(_slice(np.radians(-INCIDENCE)), **values)
    peak = lobes.max()
    near = Nodes()
    if peak > 0:
        # Of a node with an ideal mirror there is no curve.
        node = None if mirror.any() else nearest_principled(lobes, _angles(), INCIDENCE)
        lobes = 0.95 * lobes / peak
        if glossy := nearest_glossy(lobes.mean(axis=1)):
            shade = 0.5 * _line(np.minimum(glossy[1], 1.0))[0]
            picture = np.maximum(picture, (shade * upper)[..., None])
        near = Nodes(glossy[0] if glossy else None, node)
        for c in range(3):
            line, at = _line(lobes[:, c])
            ink = np.maximum(line, 0.35 * (radius < at)) * upper
            picture[..., c] = np.maximum(picture[..., c], ink)
            if node:
                dashes, _ = _line(np.minimum(0.95 * node.curve[:, c] / peak, 1.0), dashed=True)
                picture[..., c] = np.maximum(picture[..., c], 0.85 * dashes * upper)
    # Ideal reflection has no width: a ray as long as its share.
    ray = (np.abs(angle - np.radians(INCIDENCE)) * radius < 0.01)[..., None] & (
        radius[..., None] < 0.95 * mirror
    )
    picture[ray] = 1.0
    return picture, near


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


def draw(model_name, values):
    """The picture of a model with a node's values: (SIZE, SIZE, 4), 0 to 1 as a screen shows it,
    the first row the lowest; and the Nodes whose lobes are nearest.

    Raises ValueError for a model that this extension does not have.
    """
    model = brdfc.model(model_name)
    known = values_in_range(model, values)
    above, near = _polar(model, known)
    below = np.concatenate([_lit_ball(model, known), _albedo(model, known)], axis=1)
    picture = np.ones((SIZE, SIZE, 4))
    picture[..., :3] = np.concatenate([below, above], axis=0)
    return picture, near
