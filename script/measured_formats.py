# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes measured BRDFs in the formats of databases. docs/measured.md says what the tool reads."""

import struct

import numpy as np

MERL = (90, 90, 180)
MERL_SCALES = np.array([1, 1.15, 1.66]) / 1500


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def direction(theta, phi):
    """Unit vectors of angles in radians."""
    theta, phi = np.broadcast_arrays(theta, phi)
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)], -1)


def merl_directions():
    """wi, wo (90 * 90 * 180, 3) in the middle of each cell, of half vectors with azimuth 0."""
    h, d, p = ((np.arange(n) + 0.5) / n for n in MERL)
    th, td, pd = (
        a.ravel() for a in np.meshgrid(h**2 * np.pi / 2, d * np.pi / 2, p * np.pi, indexing="ij")
    )
    x, y, z = np.sin(td) * np.cos(pd), np.sin(td) * np.sin(pd), np.cos(td)
    wi = np.stack([np.cos(th) * x + np.sin(th) * z, y, np.cos(th) * z - np.sin(th) * x], -1)
    half = np.stack([np.sin(th), 0 * th, np.cos(th)], -1)
    return wi, 2 * (wi * half).sum(-1, keepdims=True) * half - wi


def above(wi, wo):
    """Whether both directions (N, 3) are above the surface, (N, 1)."""
    return (wi[:, 2:] > 0) & (wo[:, 2:] > 0)


def merl(f):
    """`f` has a row of r, g, b for each pair of merl_directions()."""
    planes = (np.asarray(f, float) / MERL_SCALES).T
    return struct.pack("<3i", *MERL) + np.ascontiguousarray(planes, "<f8").tobytes()


def tensor(fields, magic=b"tensor_file\0", version=(1, 0)):
    """The container of .bsdf files; a field is an array of uint8, float32 or float64."""
    kinds = {"uint8": 1, "float32": 10, "float64": 11}
    head = 18 + sum(2 + len(name) + 2 + 1 + 8 + 8 * a.ndim for name, a in fields.items())
    listed, data = b"", b""
    for name, a in fields.items():
        listed += struct.pack("<H", len(name)) + name.encode()
        listed += struct.pack("<HBQ", a.ndim, kinds[a.dtype.name], head + len(data))
        listed += struct.pack(f"<{a.ndim}Q", *a.shape)
        data += np.ascontiguousarray(a).tobytes()
    return magic + bytes(version) + struct.pack("<I", len(fields)) + listed + data
