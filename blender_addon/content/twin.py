# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the twin of a model: Blender's own nodes, controlled by tables over the view angle and a
slider.

A twin runs where Open Shading Language does not: EEVEE, any GPU, render farms. The tool fits its
tables and writes them to the extension's twins/*.json; the wiring of the nodes is here.
"""

import hashlib
import math

import bpy
import numpy as np

from ..packs import energy
from .wiring import DISTRIBUTIONS, Wiring


class _Curves:
    """Tables with a single row, over the view angle: a curve node each."""

    def __init__(self, wiring, cos_theta):
        self.wiring, self.cos_theta = wiring, cos_theta

    def look_up(self, rows):
        return self.wiring.curve(self.cos_theta, rows[0])


#: The custom property of the images below: a hash of their pixels.
TABLE = "brdfc_table"


def hash_of(image):
    """A hash of an image's pixels."""
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return hashlib.sha256(pixels.tobytes()).hexdigest()[:16]


class Picture:
    """Tables with several rows: a data image with the rows above one another and red, green and
    blue side by side, which every engine interpolates linearly between pixels."""

    def __init__(self, wiring, tables, cos_theta, name):
        """`name`: of the image."""
        self.wiring = wiring
        count, width = len(tables[0]), len(tables[0][0])
        height = count * math.ceil(len(tables) / 3)
        pixels = np.ones((height, width, 4), np.float32)
        self.where = {}
        for i, rows in enumerate(tables):
            band, channel = divmod(i, 3)
            pixels[band * count : (band + 1) * count, :, channel] = rows
            self.where[id(rows)] = band, channel
        self.image = bpy.data.images.new(name, width, height, float_buffer=True, is_data=True)
        self.image.use_half_precision = False
        self.image.alpha_mode = "NONE"
        self.image.pixels.foreach_set(pixels.ravel())
        self.image.pack()
        self.image[TABLE] = hash_of(self.image)
        # From the centre of the first pixel to the centre of the last.
        self.u = wiring.math("MULTIPLY_ADD", cos_theta, (width - 1) / width, 0.5 / width)
        self.count, self.height = count, height

    def at(self, place, skipped=0.0):
        """The tables at a place between the first row and the last, an output from 0 to 1.
        `skipped`: the rows above those of the first tables, an output or a number."""
        v = self.wiring.math("MULTIPLY_ADD", place, float(self.count - 1), skipped)
        return _Place(self, self.wiring.math("MULTIPLY", v, 1 / self.height))


class _Place:
    """Tables of a picture at one place."""

    def __init__(self, picture, v):
        self.picture, self.v, self.bands = picture, v, {}

    def look_up(self, rows):
        picture, w = self.picture, self.picture.wiring
        band, channel = picture.where[id(rows)]
        if band not in self.bands:
            first = (0.5 + band * picture.count) / picture.height
            at = w.node("ShaderNodeCombineXYZ")
            w.give(at.inputs["X"], picture.u)
            w.give(at.inputs["Y"], w.math("ADD", self.v, first))
            texture = w.node("ShaderNodeTexImage", interpolation="Linear", extension="EXTEND")
            texture.image = picture.image
            w.give(texture.inputs["Vector"], at.outputs["Vector"])
            parts = w.node("ShaderNodeSeparateColor")
            w.give(parts.inputs["Color"], texture.outputs["Color"])
            self.bands[band] = parts.outputs
        return self.bands[band][channel]


def _tables(data):
    """All tables, each a list of rows."""
    for closure in data["closures"]:
        yield from (closure[key] for key in ("lean", "roughness", "spread") if key in closure)
        for channels in closure["weight"]:
            yield from channels
    for channels in data["albedo"]:
        yield from channels


def place_on_axis(w, axis, value):
    """Position of a number on its slider, from 0 to 1 on the slider's scale."""
    scale = {
        "linear": lambda x: x,
        "log": lambda x: w.math("LOGARITHM", x, math.e),
        "log1p": lambda x: w.math("LOGARITHM", w.math("ADD", x, 1.0), math.e),
    }[axis["scale"]]
    low, high = (energy.SCALES[axis["scale"]](axis[end]) for end in ("low", "high"))
    inside = w.math("MINIMUM", w.math("MAXIMUM", value, axis["low"]), axis["high"])
    return w.math("MULTIPLY", w.math("SUBTRACT", scale(inside), low), 1 / (high - low))


def _polynomial(w, terms, colours):
    """A sum of terms [factor, powers of the colours]."""
    total = None
    for times, powers in terms:
        part = (abs(times),) * 3
        for colour, power in zip(colours, powers, strict=True):
            for _ in range(power):
                part = w.vector("MULTIPLY", colour, part)
        if total is None:
            total = part if times > 0 else w.vector("SCALE", part, scale=-1.0)
        else:
            total = w.vector("ADD" if times > 0 else "SUBTRACT", total, part)
    return total


class Looked:
    """Colours looked up in tables, by term and channel."""

    def __init__(self, wiring, tables):
        self.wiring, self.tables = wiring, tables

    def colour(self, terms, weights):
        w, parts = self.wiring, []
        for channels, weight in zip(terms, weights, strict=True):
            if len(channels) == 1:
                parts.append(w.vector("SCALE", weight, scale=self.tables.look_up(channels[0])))
                continue
            combined = w.node("ShaderNodeCombineXYZ")
            for socket, rows in zip(combined.inputs, channels, strict=True):
                w.give(socket, self.tables.look_up(rows))
            parts.append(w.vector("MULTIPLY", combined.outputs["Vector"], weight))
        total = parts[0]
        for part in parts[1:]:
            total = w.vector("ADD", total, part)
        return total


def wire(tree, data, normal, parameters, name):
    """Builds the nodes of a twin; returns the outputs for its BSDF and its albedo.

    `data`: contents of twins/*.json. `normal`: an output that is 0 where the surface's own normal
    is meant. `parameters`: outputs by name; those that `data` does not name multiply everything but
    ideal mirror reflection. `name`: of the image for tables that depend on a slider.
    """
    w = Wiring(tree)
    axis, mixed = data["axis"], [parameters[n] for n in data["mixed"]]
    known = [*data["mixed"], *([axis["parameter"]] if axis else [])]
    factors = [output for n, output in parameters.items() if n not in known]
    normal = w.bent_or_own(normal)
    viewer = w.node("ShaderNodeNewGeometry").outputs["Incoming"]
    cos_theta = w.vector("DOT_PRODUCT", normal, viewer, output="Value")
    across = w.vector("CROSS_PRODUCT", normal, viewer)
    place = place_on_axis(w, axis, parameters[axis["parameter"]]) if axis else None
    if axis:
        tables = Picture(w, list(_tables(data)), cos_theta, name).at(place)
    else:
        tables = _Curves(w, cos_theta)
    looked = Looked(w, tables)
    tint = tuple(data["tint"])
    for factor in factors:
        tint = w.vector("MULTIPLY", factor, tint)
    weights = [w.vector("MULTIPLY", tint, _polynomial(w, t, mixed)) for t in data["terms"]]
    of_mirror = [_polynomial(w, t, mixed) for t in data["mirror_terms"]]
    albedo = looked.colour(data["albedo"], weights)
    shaders = []
    for closure in data["closures"]:
        kind = closure["kind"]
        if kind == "mirror":
            colour = looked.colour(closure["weight"], of_mirror)
            albedo = w.vector("ADD", albedo, colour)
            shaders.append(w.bsdf(kind, colour, normal))
            continue
        colour = looked.colour(closure["weight"], weights)
        if kind not in DISTRIBUTIONS:
            shaders.append(w.bsdf(kind, colour, normal))
            continue
        half = w.vector("SCALE", colour, scale=0.5)
        lean = tables.look_up(closure["lean"])
        roughness = tables.look_up(closure["roughness"])
        upright = w.vector("SCALE", normal, scale=w.math("SUBTRACT", 1.0, lean))
        middle = w.vector("ADD", upright, w.vector("SCALE", viewer, scale=lean))
        aside = w.vector("SCALE", across, scale=tables.look_up(closure["spread"]))
        for operation in ("ADD", "SUBTRACT"):
            facet_normal = w.vector("NORMALIZE", w.vector(operation, middle, aside))
            shaders.append(w.bsdf(kind, half, facet_normal, roughness))
    bsdf = w.sum(shaders)
    w.place_nodes()
    return bsdf, albedo
