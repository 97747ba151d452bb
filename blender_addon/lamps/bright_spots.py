# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds small bright spots in environment images."""

import math

import numpy as np

from .slots import SLOTS


def _pixel_directions(u, v):
    """Unit vectors (x, y, z) of an equirectangular image; see docs/cycles.md."""
    phi, theta = (0.5 - u) * 2 * np.pi, (v - 0.5) * np.pi
    flat = np.cos(theta)
    return np.stack([flat * np.cos(phi), flat * np.sin(phi), np.sin(theta)], -1)


def _reduced(luminance, limit):
    """Averages blocks of pixels so that no side exceeds the limit; returns the result and the block
    size."""
    step = max(1, math.ceil(max(luminance.shape) / limit))
    if step == 1:
        return luminance, 1
    rows, columns = (np.arange(0, n, step) for n in luminance.shape)
    summed = np.add.reduceat(np.add.reduceat(luminance, rows, 0), columns, 1)
    height = np.diff(np.append(rows, luminance.shape[0]))
    width = np.diff(np.append(columns, luminance.shape[1]))
    return summed / np.outer(height, width), step


def _connected(mask, start):
    """The part of a mask, periodic in its columns, that is connected to a pixel; gaps of a few
    pixels are bridged."""
    block = max(1, mask.shape[1] // 256)
    rows, columns = (np.arange(0, n, block) for n in mask.shape)
    coarse = np.logical_or.reduceat(np.logical_or.reduceat(mask, rows, 0), columns, 1)
    part = np.zeros_like(coarse)
    part[start[0] // block, start[1] // block] = True
    size = 0
    while size < (size := np.count_nonzero(part)):
        part |= np.roll(part, 1, 1) | np.roll(part, -1, 1)
        grown = part.copy()
        grown[1:] |= part[:-1]
        grown[:-1] |= part[1:]
        part = grown & coarse
    whole = part.repeat(block, 0).repeat(block, 1)
    return mask & whole[: mask.shape[0], : mask.shape[1]]


#: Threshold of (fraction of all light) times (radiance over mean radiance) for a spot to get a
#: lobe. This product is about the variance from random rays that hit the spot, in units of the
#: squared total light.
_WORTH = 0.2
#: Largest full angle of a spot: in wider ones the light varies too much, and random rays hit them
#: anyway.
_WIDEST = math.radians(30)


def find(luminance, count=SLOTS):
    """The bright spots of an equirectangular image, (height, width), row 0 at the bottom:
    [(direction, full angle, irradiance)], the brightest first.

    A spot has a peak radiance of at least 3 times the mean, is at most 30 degrees wide, does not
    surround a brighter one, and holds enough of the light to be worth a lobe: 1 % where its
    radiance is 20 times the mean, 4 % at 5 times.
    """
    small, step = _reduced(luminance, 1024)
    height, width = small.shape
    u = (np.arange(width) + 0.5) * step / luminance.shape[1]
    v = (np.arange(height) + 0.5) * step / luminance.shape[0]
    directions = _pixel_directions(*np.meshgrid(np.minimum(u, 1), np.minimum(v, 1)))
    pixel = 2 * np.pi / width
    solid = pixel * np.pi / height * np.cos((np.minimum(v, 1) - 0.5) * np.pi)[:, None]
    light = small * solid
    total = light.sum()
    if not total > 0:
        return []
    mean = total / (4 * np.pi)
    left, found = small.copy(), []
    for _ in range(4 * count):
        peak = np.unravel_index(left.argmax(), left.shape)
        if left[peak] < 3 * mean:
            break
        place = _connected(left >= 0.1 * left[peak], peak)
        middle, angle = _disk(directions[place], light[place], pixel)
        wide = np.arccos(np.clip((directions[place] @ middle).min(), -1, 1))
        # The surroundings of a spot are its own glow.
        left[directions @ middle > math.cos(min(wide + 2 * pixel, np.pi))] = 0
        left[place] = 0
        if wide < 8 * pixel:
            middle, angle = _measured(luminance, middle, wide + pixel)
        share = light[place].sum() / total
        contrast = share * 2 / (1 - math.cos(angle / 2))
        glow = any(middle @ other > math.cos(angle / 2) for other, *_ in found)
        if angle <= _WIDEST and share * contrast >= _WORTH and not glow:
            found.append((middle, angle, share * total))
    return sorted(found, key=lambda spot: -spot[2])[:count]


def _disk(directions, light, pixel):
    """Centre and full angle of the disk that contains 95 % of the light of some pixels."""
    middle = light @ directions
    middle /= np.linalg.norm(middle)
    away = np.arccos(np.clip(directions @ middle, -1, 1))
    order = np.argsort(away)
    shares = np.cumsum(light[order])
    radius = away[order][np.searchsorted(shares, 0.95 * shares[-1])]
    return middle, 2 * (radius + pixel)  # plus a pixel, for interpolation


def _measured(luminance, direction, wide):
    """Direction and full angle of a spot at the full resolution of the image."""
    height, width = luminance.shape
    theta = math.asin(np.clip(direction[2], -1, 1))
    rows = (np.array([theta - wide, theta + wide]) / np.pi + 0.5) * height
    rows = np.arange(max(math.floor(rows[0]), 0), min(math.ceil(rows[1]) + 1, height))
    part = luminance[rows]
    v = (rows + 0.5) / height
    columns = np.arange(width)
    lean = max(math.cos(theta) - wide, 0.0)
    if lean > wide:  # false near the poles, where it spans many columns
        around = (0.5 - math.atan2(direction[1], direction[0]) / (2 * np.pi)) * width
        half = math.ceil(wide / lean / (2 * np.pi) * width) + 1
        columns = np.arange(math.floor(around) - half, math.ceil(around) + half + 1) % width
        part = part[:, columns]
    directions = _pixel_directions(*np.meshgrid((columns + 0.5) / width, v))
    # Only this spot: other pixels may be brighter.
    part = part * (directions @ direction > math.cos(wide))
    place = part >= 0.1 * part.max()
    light = part * np.cos((v - 0.5) * np.pi)[:, None]
    return _disk(directions[place], light[place], np.pi / height)
