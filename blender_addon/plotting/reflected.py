# SPDX-License-Identifier: GPL-3.0-or-later
"""The light that a material reflects, by the model's formulas on NumPy arrays: of one model, of a
sum or mix, and of one over another. Independent of bpy."""

import functools
from dataclasses import dataclass

import numpy as np

from .. import brdfc
from ..nearest.principled import FROM_BELOW, Shares, like, nearest

#: The angle of the incident light in the plane of incidence, in degrees.
INCIDENCE = 45.0
#: Number of view angles of the albedo, and of samples for each.
VIEWS, _SAMPLES = 13, 256


def values_in_range(model, values):
    """Clamps a node's values to their ranges: sockets are floats, so the last digit may be outside.
    Drops values that are None (linked) and those that belong to no parameter."""
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


def in_plane(theta):
    """Directions in the plane of incidence."""
    return np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=-1)


@functools.cache
def angles():
    """Angles of the half circle, densest around the mirror direction, where lobes are narrow."""
    even = np.linspace(-np.pi / 2, np.pi / 2, 361)
    near = np.radians(INCIDENCE) + np.geomspace(1e-4, 0.2, 60)[:, None] * np.array([-1, 1])
    return np.unique(np.concatenate([even, near.ravel(), [np.radians(INCIDENCE)]]))


def degrees():
    """View angles of the albedo."""
    return np.linspace(0, 88, VIEWS)


@functools.cache
def views():
    """Their cosines."""
    return np.cos(np.radians(degrees()))


def directions():
    """The directions of the views, on the light's side."""
    return in_plane(-np.arccos(views()))


def slice_of(model, values, theta):
    """f cos for light from INCIDENCE, towards these angles (positive on the side of the mirror
    direction): (N, 3)."""
    light = in_plane(np.radians(-INCIDENCE))
    return model.eval(in_plane(theta), light, **values) * np.cos(theta)[:, None]


@dataclass(frozen=True)
class Reflected:
    """What a material reflects; sums, and products with a factor between 0 and 1."""

    #: f cos over angles(), (N, 3), for light from INCIDENCE.
    curve: np.ndarray
    #: f |cos| FROM_BELOW, (M, 3), towards the direction of that light.
    below: np.ndarray
    #: Its Shares at the views, (VIEWS, 3) each, and for light from INCIDENCE.
    shares: Shares
    here: Shares

    @property
    def albedo(self):
        """At the views, (VIEWS, 3), including ideal reflection and refraction."""
        return self.shares.mirror + self.shares.scattered + self.shares.refracted

    def nearest(self):
        """The Principled node Nearest to it; None if it reflects nothing."""
        return nearest(*self._given)

    def like(self, near):
        """The same among nodes that differ from a Nearest one in the base colour."""
        return like(near, *self._given)

    @property
    def _given(self):
        return self.curve, angles(), INCIDENCE, views(), self.shares, self.here, self.below

    def __add__(self, other):
        def both(a, b):
            return Shares(a.mirror + b.mirror, a.scattered + b.scattered, a.refracted + b.refracted)

        return Reflected(
            self.curve + other.curve,
            self.below + other.below,
            both(self.shares, other.shares),
            both(self.here, other.here),
        )

    def __rmul__(self, factor):
        return self._weakened(factor, factor)

    def _weakened(self, at_views, here):
        def times(shares, by):
            return Shares(shares.mirror * by, shares.scattered * by, shares.refracted * by)

        shares = times(self.shares, at_views), times(self.here, here)
        return Reflected(self.curve * here, self.below * here, *shares)

    def over(self, below):
        """Both, of which the lower one gets what this one leaves: 1 minus the largest channel of
        its albedo for the view."""
        here = self.here.mirror + self.here.scattered + self.here.refracted
        left = 1 - self.albedo.max(1, keepdims=True)
        return self + below._weakened(np.maximum(left, 0), max(0.0, 1 - here.max()))


def of_model(model, values):
    """What a model reflects with values_in_range()."""
    wo, here = directions(), in_plane(np.radians(-INCIDENCE))
    albedo = model.albedo(views(), samples=_SAMPLES, **values)
    mirror, refracted = model.mirror(wo, **values), model.transmit(wo, **values)
    shares = Shares(mirror, np.maximum(albedo - mirror - refracted, 0), refracted)
    scattered = np.array([np.interp(INCIDENCE, degrees(), c) for c in shares.scattered.T])
    here = Shares(model.mirror(here, **values), scattered, model.transmit(here, **values))
    light = in_plane(np.radians(-INCIDENCE))
    below = model.eval(FROM_BELOW, light, **values) * -FROM_BELOW[:, 2:]
    return Reflected(slice_of(model, values, angles()), below, shares, here)


def nothing():
    """Of a black material."""

    def none(*shape):
        return Shares(*np.zeros((3, *shape, 3)))

    black = np.zeros((len(angles()), 3)), np.zeros((len(FROM_BELOW), 3))
    return Reflected(*black, none(VIEWS), none())
