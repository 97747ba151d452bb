# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of a conversion, from the light and the error of its models, which are pairs of numbers
for each colour and roughness of the node."""

import itertools

import numpy as np

from ..nearest import layer

#: Errors of nodes that reflect less, such as a black Glossy node, say nothing.
_NO_LIGHT = 1e-4
#: View cosines over which errors are averaged.
_VIEWS = np.linspace(0.95, 0.25, 8)


def errors_of(found):
    """Of (light, error) of each colour and roughness the errors, except where there is next to no
    light."""
    return [error for light, error in found if light > _NO_LIGHT] or [0.0]


def taken_by(uppers, inputs):
    """The light that a node's Uppers keep from what lies below, at their smallest and their largest
    weights."""
    left = np.ones(2)
    for upper in uppers:
        weights = np.clip(inputs.ends(upper.weight), 0, 1)
        rough = 0.0 if len(upper.rest[0]) == 1 else inputs.ends(upper.roughness)[0]
        whole = 1 - float(layer.rest_at(upper.rest, _VIEWS, rough).mean())
        left *= np.clip(1 - weights * upper.top * whole, 0, 1)
    return tuple(dict.fromkeys(float(1 - share) for share in left))


def _with_native(found, shares):
    """(light, error) of each pair, for each of these shares of the light that stay Blender's own
    instead of that of the models."""
    for light, error in found:
        for share in shares:
            left = (1 - share) * light
            yield left + share, left * error / max(left + share, 1e-9)


def errors_below(found, taken):
    """The errors of what lies below Uppers, which stay Blender's own, as shares of the light of
    both. `taken`: as taken_by() finds it."""
    return errors_of(_with_native(found, taken))


def beside(found, shares):
    """The (light, error) of each colour and roughness, where these shares of it give way to
    Blender's own glass, which loses no light."""
    return [list(_with_native(of_color, dict.fromkeys(shares))) for of_color in found]


def all_found(fit):
    """(light, error) of all colours and roughnesses of a fit."""
    return list(itertools.chain(*fit.found))


def of_mixture(share, plain, metal):
    """(light, error) of a mixture of two parts, given those of each."""
    lights = (1 - share) * plain[0], share * metal[0]
    off = lights[0] * plain[1] + lights[1] * metal[1]
    return sum(lights), off / max(sum(lights), 1e-9)
