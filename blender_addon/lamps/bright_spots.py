# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the small bright places of an environment picture."""

import math

import numpy as np

from .slots import SLOTS


def _pixel_directions(u, v):
    """Unit vectors (x, y, z) of an equirectangular picture; docs/cycles.md."""
    phi, theta = (0.5 - u) * 2 * np.pi, (v - 0.5) * np.pi
    flat = np.cos(theta)
    return np.stack([flat * np.cos(phi), flat * np.sin(phi), np.sin(theta)], -1)


def _reduced(luminance, limit):
    """Means of blocks, so that no side is longer than the limit, and how large they are."""
    step = max(1, math.ceil(max(luminance.shape) / limit))
    if step == 1:
        return luminance, 1
    rows, columns = (np.arange(0, n, step) for n in luminance.shape)
    summed = np.add.reduceat(np.add.reduceat(luminance, rows, 0), columns, 1)
    height = np.diff(np.append(rows, luminance.shape[0]))
    width = np.diff(np.append(columns, luminance.shape[1]))
    return summed / np.outer(height, width), step


def _connected(mask, start):
    """The part of a mask, whose columns go round, that hangs together with a pixel; gaps of a few
    pixels don't count."""
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


def find(luminance, count=SLOTS):
    """The small bright places of an equirectangular picture, (height, width), row 0 at the bottom:
    [(direction, full angle, irradiance)], the brightest first.

    A place has at least 1 % of all light, a radiance of 20 times the mean, and 0.05 sr at most.
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
    left, found = small.copy(), []
    for _ in range(4 * count):
        peak = np.unravel_index(left.argmax(), left.shape)
        if left[peak] < 20 * total / (4 * np.pi) or len(found) == count:
            break
        place = _connected(left >= 0.1 * left[peak], peak)
        carried = (light * place).sum()
        # What lies around the place is its own glow.
        middle = (directions * (light * place)[..., None]).sum((0, 1))
        middle /= np.linalg.norm(middle)
        wide = np.arccos(np.clip((directions[place] @ middle).min(), -1, 1))
        left[directions @ middle > math.cos(min(wide + 2 * pixel, np.pi))] = 0
        left[place] = 0
        if carried < 0.01 * total or (solid * place).sum() > 0.05:
            continue
        found.append((*_measured(luminance, middle, wide + pixel), carried))
    return sorted(found, key=lambda spot: -spot[2])


def _measured(luminance, direction, wide):
    """Direction and full angle of a spot at the picture's own resolution."""
    height, width = luminance.shape
    theta = math.asin(np.clip(direction[2], -1, 1))
    rows = (np.array([theta - wide, theta + wide]) / np.pi + 0.5) * height
    rows = np.arange(max(math.floor(rows[0]), 0), min(math.ceil(rows[1]) + 1, height))
    part = luminance[rows]
    v = (rows + 0.5) / height
    columns = np.arange(width)
    lean = max(math.cos(theta) - wide, 0.0)
    if lean > wide:  # away from the poles a few columns hold it
        around = (0.5 - math.atan2(direction[1], direction[0]) / (2 * np.pi)) * width
        half = math.ceil(wide / lean / (2 * np.pi) * width) + 1
        columns = np.arange(math.floor(around) - half, math.ceil(around) + half + 1) % width
        part = part[:, columns]
    directions = _pixel_directions(*np.meshgrid((columns + 0.5) / width, v))
    weight = part * np.cos((v - 0.5) * np.pi)[:, None]
    weight = weight * ((directions @ direction > math.cos(wide)) & (part >= 0.1 * part.max()))
    middle = (directions * weight[..., None]).sum((0, 1))
    middle /= np.linalg.norm(middle)
    away = np.arccos(np.clip(directions @ middle, -1, 1)).ravel()
    order = np.argsort(away)
    shares = np.cumsum(weight.ravel()[order])
    radius = away[order][np.searchsorted(shares, 0.95 * shares[-1])]
    return middle, 2 * (radius + np.pi / height)  # and a pixel, for interpolation
