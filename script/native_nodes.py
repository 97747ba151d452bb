#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits Blender's own nodes to the models of scenes, as users would use them instead.

Writes JSON: {SCENE: {"key": ..., "materials": {MATERIAL: {NODE: parameters}}}} for the nodes
glossy, principled and metallic, which scene_loader.native_material builds. Transmissive materials
are left out. Existing fits for the same scenes and program are kept.

A fit minimises the squared error of f cos(theta_i) over light directions, with equal weight for
each view. The nodes' lobe is `brdfc closure ggx`, their Fresnel term `brdfc albedo
fresnel_dielectric`; tests/blender/test_native_nodes.py tests that Cycles interprets the parameters
likewise. If the specular part of a model is an ideal mirror, the node gets roughness 0.
"""

import argparse
import csv
import hashlib
import io
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np

NODES = ("glossy", "principled", "metallic")
#: Narrower lobes get roughness 0.
LEAST_ALPHA = 2e-3
#: Largest ratio of the lobe's widths that a node's Anisotropic input reaches.
STRETCH = {"glossy": 1e4, "principled": 10.0, "metallic": 10.0}
VIEWS = (0.9, 0.6, 0.35, 0.15)
DIRECTIONS = 128
#: Cosine at which the Edge Tint of the Metallic node acts (82 degrees).
EDGE = 1 / 7


class Tool:
    """Runs the program brdfc and reads its tables."""

    def __init__(self, path):
        self.path = path

    def ask(self, *arguments, stdin):
        """The table that brdfc prints for these arguments."""
        command = [str(self.path), *arguments]
        done = subprocess.run(command, input=stdin, capture_output=True, text=True)
        if done.returncode:
            raise ValueError(done.stderr.strip())
        return done.stdout

    def table(self, arguments, header, rows):
        rows = np.reshape(rows, (-1, len(header))).tolist()
        text = "\n".join([",".join(header), *(",".join(map(repr, r)) for r in rows)])
        printed = self.ask(*arguments, stdin=text + "\n")
        names = next(csv.reader(io.StringIO(printed)))
        return names, np.loadtxt(io.StringIO(printed), delimiter=",", skiprows=1, ndmin=2)

    def list(self):
        done = subprocess.run([str(self.path), "list", "--json"], capture_output=True, check=True)
        return {m["name"]: m for m in json.loads(done.stdout)}


PAIRS = ("wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z")


def arguments_of(values):
    return [
        f"{k}={','.join(map(str, v)) if isinstance(v, list | tuple) else v}"
        for k, v in values.items()
    ]


# ---- the nodes --------------------------------------------------------------------------------


class Fresnel:
    """The reflectance of a dielectric boundary by cosine and index, interpolated in a table."""

    COSINES, INDICES = np.linspace(0, 1, 257) ** 2, 1 + 3 * np.linspace(0, 1, 33) ** 1.5

    def __init__(self, tool):
        rows = []
        for ior in self.INDICES.tolist():
            arguments = ["albedo", "fresnel_dielectric", f"ior={ior!r}"]
            names, found = tool.table(arguments, ("cos_theta_o",), self.COSINES[1:])
            rows.append([1 if ior > 1 else 0, *found[:, names.index("mirror_r")]])
        self.rows = np.array(rows)

    def __call__(self, ior, cosine):
        upper = int(np.clip(np.searchsorted(self.INDICES, ior), 1, len(self.INDICES) - 1))
        low, high = self.INDICES[upper - 1 : upper + 1]
        share = (ior - low) / (high - low)
        row = (1 - share) * self.rows[upper - 1] + share * self.rows[upper]
        return np.interp(cosine, self.COSINES, row)


class Lobe:
    """The lobe that all three nodes share, for pairs of directions, and the terms of its albedo
    with a Fresnel factor. `alpha` (0, 0) is an ideal mirror."""

    def __init__(self, tool, alpha, wi, wo):
        self.wi, self.wo, self.cosine = wi, wo, half_cosine(wi, wo)
        self.is_mirror = alpha[0] == 0
        self.f_cos = np.zeros(len(wi))
        if self.is_mirror or not len(wi):
            return
        views, self.view = np.unique(wo, axis=0, return_inverse=True)
        self.view = self.view.ravel()
        i = np.arange(128) + 0.5
        u, phi = i / 128, 2 * math.pi * ((i * 0.6180339887498949) % 1)
        t = np.sqrt(u / (1 - u))
        h = np.stack([alpha[0] * t * np.cos(phi), alpha[1] * t * np.sin(phi), np.ones_like(t)], -1)
        h /= np.linalg.norm(h, axis=-1, keepdims=True)
        # The pdf of these half vectors, per solid angle.
        density = 1 / (math.pi * alpha[0] * alpha[1] * h[:, 2] ** 3 * (1 + t * t) ** 2)
        self.drawn = np.maximum(views @ h.T, 0)  # (views, samples)
        drawn_wi = 2 * self.drawn[..., None] * h - views[:, None]
        kept = (self.drawn > 0) & (drawn_wi[..., 2] > 0)
        drawn_wo = np.broadcast_to(views[:, None], drawn_wi.shape)
        rows = np.hstack([np.vstack([wi, drawn_wi[kept]]), np.vstack([wo, drawn_wo[kept]])])
        arguments = ["closure", "ggx", f"alpha_x={alpha[0]!r}", f"alpha_y={alpha[1]!r}"]
        f = tool.table(arguments, PAIRS, rows)[1][:, 0]
        self.f_cos = f[: len(wi)]
        self.share = np.zeros(self.drawn.shape)
        self.share[kept] = f[len(wi) :]
        self.share *= 4 * self.drawn / density / len(u)

    def albedo(self, fresnel, ior):
        """The albedo of the lobe, for each pair's view."""
        if self.is_mirror:
            return fresnel(ior, self.wo[:, 2])
        return (self.share * fresnel(ior, self.drawn)).sum(1)[self.view]


def conductor(color, edge, cosine):
    """Schlick's reflectance with the Metallic node's edge tint, (n, 3)."""
    color, edge = np.asarray(color), np.asarray(edge)
    c = np.clip(cosine, 0, 1)[:, None]

    def schlick(x):
        return color + (1 - color) * (1 - x) ** 5

    lost = schlick(EDGE) * (1 - edge) * c * (1 - c) ** 6 / (EDGE * (1 - EDGE) ** 6)
    return np.clip(schlick(c) - lost, 0, 1)


def half_cosine(wi, wo):
    h = wi + wo
    return np.sum(wo * h, -1) / np.maximum(np.linalg.norm(h, axis=-1), 1e-12)


def f_cos(fresnel, node, p, lobe):
    """f cos of a node with these parameters, without an ideal mirror, (n, 3)."""
    color = np.asarray(p["color"])
    if node == "glossy":
        return color * lobe.f_cos[:, None]
    if node == "metallic":
        return conductor(color, p["edge"], lobe.cosine) * lobe.f_cos[:, None]
    base = (1 - lobe.albedo(fresnel, p["ior"])) * lobe.wi[:, 2] / math.pi
    plastic = color * base[:, None] + (lobe.f_cos * fresnel(p["ior"], lobe.cosine))[:, None]
    metal = conductor(color, np.ones(3), lobe.cosine) * lobe.f_cos[:, None]
    return (1 - p["metallic"]) * plastic + p["metallic"] * metal


def mirror(fresnel, node, p, cosine):
    """The weight of the ideal mirror that a node has at roughness 0, (n, 3)."""
    if p["alpha"][0] > 0:
        return np.zeros((len(cosine), 3))
    if node == "glossy":
        return np.broadcast_to(p["color"], (len(cosine), 3))
    if node == "metallic":
        return conductor(p["color"], p["edge"], cosine)
    plastic, metal = fresnel(p["ior"], cosine), conductor(p["color"], np.ones(3), cosine)
    return (1 - p["metallic"]) * plastic[:, None] + p["metallic"] * metal


# ---- a model's values -------------------------------------------------------------------------


class Target:
    """f cos of a model at directions in its lobes, and the weight of its mirror by view."""

    def __init__(self, tool, info, values):
        self.tool, self.lobes, name = tool, {}, info["name"]
        arguments = [name, *arguments_of(values)]
        azimuths = (0.3,) if info["properties"]["isotropic"] else (0.2, 1.3)
        self.isotropic = info["properties"]["isotropic"]
        views = np.array(
            [
                (math.sqrt(1 - c * c) * math.cos(a), math.sqrt(1 - c * c) * math.sin(a), c)
                for c in VIEWS
                for a in azimuths
            ]
        )
        cosines = views[:, 2:]
        names, rows = tool.table(["albedo", *arguments], ("cos_theta_o",), cosines)
        columns = [[names.index(f"{kind}_{c}") for c in "rgb"] for kind in ("albedo", "mirror")]
        albedo, self.mirror = rows[:, columns[0]], rows[:, columns[1]]
        self.views, scattered = views, (albedo - self.mirror).mean()
        self.transmits = not info["scatter"] and scattered > 1e-6
        self.is_mirror = self.mirror.mean() > 1e-6
        self.mostly_mirror = self.mirror.mean() > scattered
        self.wi = self.wo = np.zeros((0, 3))
        self.f = np.zeros((0, 3))
        self.weight = self.scale = np.zeros(0)
        if not info["scatter"] or self.transmits:
            return
        wi, wo, weight, f = [], [], [], []
        for w in views:
            pair = self._directions(arguments, w)
            if pair is None:
                self.transmits = True
                return
            here = np.broadcast_to(w, pair.shape)
            values_ = tool.table(["eval", *arguments], PAIRS, np.hstack([pair, here]))[1]
            density = (values_[:, 3] + pair[:, 2] / math.pi) / 2
            wi.append(pair)
            wo.append(here)
            f.append(values_[:, :3] * pair[:, 2:])
            weight.append(1 / (density * len(pair)))
        self.wi, self.wo, self.f = (np.concatenate(x) for x in (wi, wo, f))
        self.weight = np.concatenate(weight)
        # All views have the same weight.
        count = len(self.f) // len(views)
        norm = (self.f**2 * self.weight[:, None]).reshape(len(views), count, 3).sum((1, 2))
        self.scale = np.repeat(1 / np.sqrt(np.maximum(norm, 1e-12)), count)

    def _directions(self, arguments, w):
        """Samples half of the directions from the model and half with a cosine pdf. Returns None if
        the model transmits light."""
        n = DIRECTIONS // 2
        i = np.arange(n)
        u = (0.5 + np.outer(i, (0.8191725134, 0.6710436067, 0.5497004779))) % 1
        header = ("wo_x", "wo_y", "wo_z", "u1", "u2", "u3")
        rows = np.hstack([np.broadcast_to(w, (n, 3)), u])
        drawn = self.tool.table(["sample", *arguments], header, rows)[1]
        kept = drawn[drawn[:, 6] > 0, :3]
        if (kept[:, 2] < 0).any():
            return None
        r, phi = np.sqrt(u[:, 0]), 2 * math.pi * u[:, 1]
        cosine = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - u[:, 0])], -1)
        return np.concatenate([kept[kept[:, 2] > 1e-4], cosine, cosine])[: 2 * n]

    def lobe(self, alpha):
        key = tuple(alpha)
        if key not in self.lobes:
            self.lobes[key] = Lobe(self.tool, alpha, self.wi, self.wo)
        return self.lobes[key]

    def residual(self, fresnel, node, p):
        off = f_cos(fresnel, node, p, self.lobe(p["alpha"])) - self.f
        off = (off * (np.sqrt(self.weight) * self.scale)[:, None]).ravel()
        if not (self.is_mirror and p["alpha"][0] == 0):
            return off
        delta = mirror(fresnel, node, p, self.views[:, 2]) - self.mirror
        return np.concatenate([off, delta.ravel()])

    def relative_l1(self, fresnel, node, p):
        """The sum of |f - g| cos divided by that of f cos; mirrors count with their weights."""
        off = np.abs(f_cos(fresnel, node, p, self.lobe(p["alpha"])) - self.f)
        delta = np.abs(mirror(fresnel, node, p, self.views[:, 2]) - self.mirror).sum()
        weight = self.weight[:, None]
        total = (self.f * weight).sum() + self.mirror.sum()
        return float(((off * weight).sum() + delta) / total)


def fit_rest(fresnel, target, node, alpha):
    """Cost and parameters of the best fit with a lobe of this width."""
    from scipy.optimize import least_squares

    start, high = [0.5] * 3, [1.0] * 3
    low = [0.0] * 3
    if node == "principled":
        start, low, high = [*start, 1.45, 0.5], [*low, 1.0, 0.0], [*high, 4.0, 1.0]
    if node == "metallic":
        start, low, high = [*start, 0.9, 0.9, 0.9], low * 2, high * 2

    def parameters(x):
        p = {"color": list(map(float, x[:3])), "alpha": list(alpha)}
        if node == "principled":
            p["ior"], p["metallic"] = float(x[3]), float(x[4])
        if node == "metallic":
            p["edge"] = list(map(float, x[3:]))
        return p

    found = least_squares(
        lambda x: target.residual(fresnel, node, parameters(x)), start, bounds=(low, high)
    )
    return found.cost, parameters(found.x)


def fit(fresnel, target, node):
    """The parameters of a node, with the remaining relative L1 error."""
    from scipy.optimize import minimize, minimize_scalar

    tried = {}

    def cost(size, stretch=0.0):
        limit = math.log(STRETCH[node])
        half = math.exp(min(max(stretch, -limit), limit) / 2)
        size = math.exp(min(max(size, math.log(LEAST_ALPHA)), 0.0))
        # Limited to what the closure accepts, and to lobes that Cycles does not replace by a
        # mirror.
        alpha = tuple(float(min(max(a, LEAST_ALPHA), 1)) for a in (size * half, size / half))
        if alpha not in tried:
            tried[alpha] = fit_rest(fresnel, target, node, alpha)
        return tried[alpha][0]

    if target.is_mirror if node == "principled" else target.mostly_mirror:
        tried[0.0, 0.0] = fit_rest(fresnel, target, node, (0.0, 0.0))
    else:
        sizes = np.linspace(math.log(LEAST_ALPHA), 0, 7)
        stretches = (0.0,) if target.isotropic else (-2.0, 0.0, 2.0)
        scanned = min((cost(a, q), a, q) for a in sizes for q in stretches)
        step = sizes[1] - sizes[0]
        if target.isotropic:
            minimize_scalar(
                cost,
                bounds=(scanned[1] - step, scanned[1] + step),
                method="bounded",
                options={"maxiter": 8},
            )
        else:
            first = np.array(scanned[1:])
            simplex = [first, first + (step / 2, 0), first + (0, 1.0)]
            options = {"initial_simplex": simplex, "maxfev": 20}
            minimize(lambda x: cost(*x), first, method="Nelder-Mead", options=options)
    _, p = min(tried.values(), key=lambda t: t[0])
    return p | {"relative_l1": target.relative_l1(fresnel, node, p)}


def fit_scene(tool, fresnel, models, scene):
    """The fits by material and node, without materials to which these nodes can't be fitted."""
    out = {}
    for name, material in scene["materials"].items():
        values = material.get("parameters", {})
        values = {k: v for k, v in values.items() if not isinstance(v, dict)}
        rotation = values.pop("rotation", 0.0)
        target = Target(tool, models[material["model"]], values)
        if target.transmits:
            continue
        out[name] = {node: fit(fresnel, target, node) | {"rotation": rotation} for node in NODES}
        errors = ", ".join(f"{n} {p['relative_l1']:.1%}" for n, p in out[name].items())
        print(f"    {scene['name']}, {name}: {errors}", file=sys.stderr, flush=True)
    return out


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="+", type=Path, help="scenes/NAME.json")
    parser.add_argument("--tool", required=True, type=Path, help="the program brdfc")
    parser.add_argument("--out", required=True, type=Path, help="file to write")
    options = parser.parse_args()
    tool = Tool(options.tool)
    models, fresnel = tool.list(), Fresnel(tool)
    kept = json.loads(options.out.read_text("utf-8")) if options.out.exists() else {}
    programs = options.tool.read_bytes() + Path(__file__).read_bytes()
    out = {}
    for path in options.scenes:
        try:
            text = path.read_bytes()
            key = hashlib.sha256(programs + text).hexdigest()
            if kept.get(path.stem, {}).get("key") == key:
                out[path.stem] = kept[path.stem]
                continue
            fitted = fit_scene(tool, fresnel, models, json.loads(text))
        except (OSError, ValueError, KeyError) as error:
            sys.exit(f"native_nodes: {path}: {error}")
        out[path.stem] = {"key": key, "materials": fitted}
    options.out.write_text(json.dumps(out, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
