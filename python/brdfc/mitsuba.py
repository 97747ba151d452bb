# SPDX-License-Identifier: GPL-3.0-or-later
"""The models as a BSDF plug-in of Mitsuba 3.

    import brdfc.mitsuba
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    brdfc.mitsuba.register()
    bsdf = mi.load_dict({"type": "brdfc", "model": "ward", "ks": (0.8, 0.6, 0.2), "ax": 0.1})

Parameters are those of brdfc.model("ward"). Numbers and colours may be textures, and are what
mitsuba.traverse() shows. Works in variants with RGB colours: scalar_rgb, llvm_ad_rgb, cuda_ad_rgb.

Mitsuba's si.wi is the viewer and its wo the light; in this package wo is the viewer and wi the
light. Here they are `viewer` and `light`. If a light tracer asks (TransportMode.Importance), si.wi
is where the light comes from.
"""

from __future__ import annotations

from functools import cache, reduce
from operator import or_
from types import SimpleNamespace
from typing import Any

import numpy

from . import model as model_of
from ._arrays import HORIZON, SINGLE_GUARD, Elementwise
from ._formula import NUMPY
from ._model import LOST, Choice, Color, Model
from .models import NAMES

try:
    import drjit as dr
    import mitsuba as mi
except ImportError as error:
    raise ImportError(
        "brdfc.mitsuba needs Mitsuba 3, which is not installed: pip install mitsuba"
    ) from error

Array = Any

#: The name of the plug-in.
PLUGIN = "brdfc"

#: How often an ideal reflection or refraction is sampled at least, and at most, where there is
#: other light to sample, too.
LEAST_CHANCE, MOST_CHANCE = 0.05, 0.95

LUMINANCE = (0.2126, 0.7152, 0.0722)


def register() -> None:
    """Makes the plug-in known to the variant that is set, and to those that are set later."""
    if mi.variant():
        _register(None, mi.variant())
    _register_later()


@cache
def _register_later() -> None:
    mi.detail.add_variant_callback(_register)


@cache
def _registered(variant: str) -> bool:
    fits = "_rgb" in variant and "polarized" not in variant
    mi.register_bsdf(PLUGIN, _plugin() if fits else _refuse)
    return True


def _register(_, variant: str) -> None:
    _registered(variant)


def _refuse(_) -> None:
    raise ValueError(
        f"brdfc: expected a variant with RGB colours, like llvm_ad_rgb, got {mi.variant()}"
    )


class _Jit(Elementwise):
    """What formulas call, on arrays of Dr.Jit. A colour is an array of three."""

    def __init__(self):
        self.Real, self.Color, self.Index = mi.Float, mi.Color3f, mi.UInt32
        self._least = SINGLE_GUARD if mi.Float is mi.Float32 else 0.0
        self._tables = {}
        names = ("abs", "exp", "log", "sin", "cos", "floor", "minimum", "sqrt", "atan")
        self.xp = SimpleNamespace(**{name: getattr(dr, name) for name in names}, where=dr.select)

    def array(self, x):
        return x if dr.is_array_v(x) else self.Real(x)

    def power(self, x, y):
        # At 0, logarithms and their derivatives are infinite.
        x, y = self.array(x), self.array(y)
        power = dr.power(self.where(0.0 < x, x, 1.0), y)
        return self.where(0.0 < x, power, self.where(y == 0.0, 1.0, 0.0))

    # Dr.Jit lacks these two. W. Kahan's expressions, whose rounding cancels, have the values; their
    # derivatives are those of the plain ones.

    def log1p(self, x):
        x = self.array(x)
        bare = dr.detach(x)
        u = 1.0 + bare
        plain = (u == 1.0) | dr.isinf(u)
        exact = dr.log(u) * (bare / dr.select(plain, 1.0, u - 1.0))
        return self._with_slope(dr.select(plain, bare, exact), x, lambda x: dr.log(1.0 + x))

    def expm1(self, x):
        x = self.array(x)
        bare = dr.detach(x)
        u = dr.exp(bare)
        plain = (u == 1.0) | (u == 0.0) | dr.isinf(u)
        exact = (u - 1.0) * (bare / dr.select(plain, 1.0, dr.log(u)))
        value = dr.select(plain, dr.select(u == 1.0, bare, u - 1.0), exact)
        return self._with_slope(value, x, dr.exp)

    def _with_slope(self, value, x, function):
        return dr.replace_grad(value, function(x)) if dr.grad_enabled(x) else value

    def logical_not(self, x):
        return ~x

    def max(self, color, axis):
        return dr.max(color, axis=axis)

    def rgb(self, r, g, b):
        return self.Color(r, g, b)

    def index(self, x):
        # NaN, where a formula does not use it, must not become an index that is out of range.
        return self.Index(self.where(0.0 < x, x, 0.0))

    def entries(self, values, index):
        if id(values) not in self._tables:
            self._tables[id(values)] = self.Real(values.ravel())
        return dr.gather(self.Real, self._tables[id(values)], index)

    # ---- between Mitsuba and the formulas ------------------------------------------------------

    def real(self, x):
        return self.Real(x)

    def color(self, x):
        return self.Color(x)

    def to_real(self, x):
        return mi.Float(x)

    def to_color(self, x):
        return mi.Color3f(x)

    def to_index(self, x):
        return mi.UInt32(x)


class _Scalar:
    """What formulas call in a scalar variant: NumPy on arrays of one number, and (3, 1)."""

    def __init__(self):
        vars(self).update(vars(NUMPY))

    def array(self, x):
        return numpy.atleast_1d(x)

    def real(self, x):
        return numpy.array([float(x)])

    def color(self, x):
        return numpy.array([[float(c)] for c in x])

    def to_real(self, x):
        return float(numpy.ravel(x)[0])

    def to_color(self, x):
        return mi.Color3f(*(float(c) for c in numpy.broadcast_to(x, (3, 1))[:, 0]))

    def to_index(self, x):
        return int(numpy.ravel(x)[0])


@cache
def _functions(variant: str) -> _Jit | _Scalar:
    return _Scalar() if variant.startswith("scalar") else _Jit()


class _Surface:
    """A model with its parameters."""

    def __init__(self, props):
        self.np = _functions(mi.variant())
        self.jit = isinstance(self.np, _Jit)
        if "model" not in props:
            raise ValueError(f"brdfc: model: expected one of {', '.join(NAMES)}, got none")
        self.model: Model = model_of(props["model"])
        given = {name: props[name] for name in props.keys() if name != "model"}
        textures = {name: v for name, v in given.items() if isinstance(v, mi.Texture)}
        plain = {name: self._plain(name, v) for name, v in given.items() if name not in textures}
        for name in textures:
            if name not in self.model.parameters or isinstance(self.model.parameters[name], Choice):
                self.model._choices({name: "a texture"})  # which tells what is wrong
        chosen, values = self.model._bind(plain)
        for name, value in values.items():
            is_color = isinstance(self.model.parameters[name], Color)
            if value.shape != ((3,) if is_color else ()):
                expected = "three numbers or one" if is_color else "a number"
                raise TypeError(
                    f"{self.model.name}: {name}: expected {expected}, got the shape {value.shape}"
                )
        self.choices = dict(
            zip((n for n, p in self._parameters() if isinstance(p, Choice)), chosen, strict=True)
        )
        self.values = {
            name: mi.Color3f(value.tolist()) if value.ndim else mi.Float(float(value))
            for name, value in values.items()
        }
        self.values.update(textures)
        self.formulas = self.model.formulas[chosen]
        #: Whether light crosses the surface, and the view may be on either side.
        self.crosses = self.formulas.iors is not None
        self.scatters = self.formulas.eval is not None
        self.changed()
        self._try()

    def _parameters(self):
        return self.model.parameters.items()

    def _plain(self, name: str, value):
        """A property as the model checks it."""
        if isinstance(value, mi.Object):
            raise TypeError(
                f"{self.model.name}: {name}: expected a value or a texture, got a "
                f"{value.class_name()}"
            )
        if isinstance(value, str | bool | int | float):
            return value
        return numpy.array(value, numpy.float64)

    def _try(self) -> None:
        """Calls all formulas once, which also makes tables before anything is recorded."""
        view = [self.np.real(x) for x in (0.6, 0.0, 0.8)]
        values = [
            self.np.color((0.5,) * 3) if isinstance(p, Color) else self.np.real(p.default)
            for _, p in self._parameters()
            if not isinstance(p, Choice)
        ]
        arguments = {"eval": 2 * view, "pdf": 2 * view, "sample": 2 * view, "iors": []}
        arguments |= {"mirror": view, "transmit": view, "inside": view[:1]}
        for what, vectors in arguments.items():
            try:
                formula = getattr(self.formulas, what)
                if formula is not None:
                    with numpy.errstate(all="ignore"):
                        formula(self.np, *vectors, *values)
            except (AttributeError, TypeError, RuntimeError) as error:
                raise ValueError(
                    f"{self.model.name}: its function {what} does not work in Mitsuba's "
                    f"{mi.variant()}: {error}"
                ) from error

    def changed(self) -> None:
        if self.jit:
            # New values of parameters then need no new kernel.
            dr.make_opaque([v for v in self.values.values() if not isinstance(v, mi.Texture)])

    def flags(self) -> list[int]:
        """Of each component."""
        f = mi.BSDFFlags
        sides = +f.FrontSide | (+f.BackSide if self.crosses else 0)
        textured = any(isinstance(v, mi.Texture) for v in self.values.values())
        sides |= +f.SpatiallyVarying if textured else 0
        kinds = []
        if self.scatters:
            kinds.append(f.GlossyReflection | f.Anisotropic)
            if self.crosses:
                kinds.append(f.GlossyTransmission | f.Anisotropic | f.NonSymmetric)
        if self.formulas.mirror is not None:
            kinds.append(f.DeltaReflection)
        if self.formulas.transmit is not None:
            kinds.append(f.DeltaTransmission | f.NonSymmetric)
        self.kinds = [k & (f.Reflection | f.Transmission) for k in kinds]
        return [int(k) | sides for k in kinds]

    def _enabled(self, ctx, kind) -> bool:
        return any(
            k == int(kind) and ctx.is_enabled(kind, i) for i, k in enumerate(map(int, self.kinds))
        )

    # ---- formulas ------------------------------------------------------------------------------

    def _at(self, si, active) -> list[Array]:
        """Parameters, in the order in which formulas take them."""
        values = []
        for name, p in self._parameters():
            if isinstance(p, Choice):
                continue
            value = self.values[name]
            if isinstance(value, mi.Texture):
                is_color = isinstance(p, Color)
                value = value.eval(si, active) if is_color else value.eval_1(si, active)
            values.append(self.np.color(value) if isinstance(p, Color) else self.np.real(value))
        return values

    def _direction(self, v) -> list[Array]:
        np = self.np
        x, y, z = (np.real(c) for c in (v.x, v.y, v.z))
        length = np.sqrt(x * x + y * y + z * z)
        return [x / length, y / length, z / length]

    def _aside(self, vectors: list[list[Array]]) -> tuple[Array, list[Array]]:
        """Where there is nothing to evaluate, and components that are harmless there: formulas of
        one side may be infinite below the surface, and all along it."""
        np = self.np
        if self.crosses:
            lost = reduce(or_, [v[2] == 0.0 for v in vectors])
        else:
            lost = reduce(or_, [v[2] <= 0.0 for v in vectors])
        up = (0.0, 0.0, 1.0)
        return lost, [np.where(lost, c, x) for v in vectors for c, x in zip(up, v, strict=True)]

    def _index(self, viewer, values) -> Array:
        """The index on the far side over that on the viewer's, by channel."""
        iors = self.np.array(self.formulas.iors(self.np, *values))
        iors = self.np.rgb(1.0, 1.0, 1.0) * iors
        return self.np.where(0.0 < viewer[2], iors, 1.0 / iors)

    def _crossing(self, ctx, viewer, light, values) -> tuple[Array, Array]:
        """Whether light crosses the surface, and by what the value of a scattered energy changes:
        radiance is compressed by the square of the index."""
        np = self.np
        eta = self._index(viewer, values)[1]
        crossing = light[2] * viewer[2] < 0.0
        scale = eta * eta
        if ctx.mode == mi.TransportMode.Radiance:
            scale = 1.0 / scale
        return crossing, np.where(crossing, scale, 1.0)

    def _value(self, ctx, viewer, light, values) -> Array:
        """f |cos(theta)|, of enabled components."""
        np = self.np
        pair = [light, viewer] if ctx.mode == mi.TransportMode.Radiance else [viewer, light]
        lost, arguments = self._aside(pair)
        f = self.formulas.eval(np, *arguments, *values) * np.abs(light[2])
        f = np.where(lost, 0.0, f)
        return f * self._share(ctx, viewer, light, values)

    def _share(self, ctx, viewer, light, values) -> Array:
        """What a value of the formulas is multiplied by: 0 in a component that is not enabled."""
        np, f = self.np, mi.BSDFFlags
        reflects = 1.0 if self._enabled(ctx, f.GlossyReflection) else 0.0
        if not self.crosses:
            return reflects
        refracts = 1.0 if self._enabled(ctx, f.GlossyTransmission) else 0.0
        crossing, scale = self._crossing(ctx, viewer, light, values)
        return np.where(crossing, refracts * scale, reflects)

    def _density(self, viewer, light, values) -> Array:
        lost, arguments = self._aside([light, viewer])
        return self.np.where(lost, 0.0, self.formulas.pdf(self.np, *arguments, *values))

    def _scattered(self, ctx) -> bool:
        f = mi.BSDFFlags
        enabled = self._enabled(ctx, f.GlossyReflection) or self._enabled(ctx, f.GlossyTransmission)
        return self.scatters and enabled

    # ---- ideal reflection and refraction -------------------------------------------------------

    def _ideal(self, ctx, viewer, values) -> tuple[Array, Array, Array, Array] | None:
        """Weights of ideal reflection and refraction, and the probabilities of sampling them; None
        if the model has neither."""
        np, f = self.np, mi.BSDFFlags
        x, y, z = viewer
        lost = z == 0.0 if self.crosses else z <= 0.0
        safe = [x, y, np.where(lost, HORIZON if self.crosses else 1.0, z)]
        weights, some = [], False
        for formula, kind in [
            (self.formulas.mirror, f.DeltaReflection),
            (self.formulas.transmit, f.DeltaTransmission),
        ]:
            if formula is None or not self._enabled(ctx, kind):
                weights.append(np.rgb(0.0, 0.0, 0.0))
                continue
            some = True
            weight = np.rgb(1.0, 1.0, 1.0) * np.array(formula(np, *safe, *values))
            weights.append(weight if self.crosses else np.where(lost, 0.0, weight))
        if not some:
            return None
        reflected, refracted = (self._luminance(w) for w in weights)
        ideal = reflected + refracted
        chance = np.where(0.0 < ideal, 1.0, 0.0)
        if self._scattered(ctx):
            # The weight of a sample in the middle stands for the albedo of the rest.
            _, arguments = self._aside([viewer])
            half = [np.real(0.5)] * 3
            rest = self._luminance(
                np.rgb(1.0, 1.0, 1.0)
                * self._detached(self.formulas.sample(np, *arguments, *half, *values)[3])
            )
            bounded = ideal / np.maximum(ideal + rest, 1e-15)
            bounded = np.minimum(np.maximum(bounded, LEAST_CHANCE), MOST_CHANCE)
            chance = np.where(0.0 < ideal, bounded, 0.0)
        share = np.where(0.0 < ideal, reflected / np.where(0.0 < ideal, ideal, 1.0), 1.0)
        return weights[0], weights[1], chance * share, chance * (1.0 - share)

    def _detached(self, x):
        return dr.detach(x) if self.jit else x

    def _luminance(self, color) -> Array:
        color = self._detached(color)
        return reduce(lambda a, b: a + b, (w * color[i] for i, w in enumerate(LUMINANCE)))

    # ---- what Mitsuba calls --------------------------------------------------------------------

    def eval_pdf(self, ctx, si, wo, active, wanted=("eval", "pdf")) -> list[Array]:
        np = self.np
        if not self._scattered(ctx):
            zero = {"eval": mi.Color3f(0.0), "pdf": mi.Float(0.0)}
            return [zero[what] for what in wanted]
        with numpy.errstate(all="ignore"):
            viewer, light = self._direction(si.wi), self._direction(wo)
            values, out = self._at(si, active), []
            if "eval" in wanted:
                f = self._value(ctx, viewer, light, values)
                out.append(np.to_color(np.where(active, f, 0.0)))
            if "pdf" in wanted:
                pdf = self._density(viewer, light, values)
                if (ideal := self._ideal(ctx, viewer, values)) is not None:
                    pdf = pdf * (1.0 - ideal[2] - ideal[3])
                out.append(np.to_real(np.where(active, pdf, 0.0)))
        return out

    def sample(self, ctx, si, sample1, sample2, active):
        np, flags = self.np, mi.BSDFFlags
        with numpy.errstate(all="ignore"):
            values, viewer = self._at(si, active), self._direction(si.wi)
            u = np.real(sample1)
            ideal = self._ideal(ctx, viewer, values)
            wo, weight = [np.real(x) for x in LOST[:3]], np.rgb(0.0, 0.0, 0.0)
            pdf, eta, kind = np.real(0.0), np.real(1.0), np.real(0.0)
            if self._scattered(ctx):
                remains = 1.0
                if ideal is not None:
                    first = ideal[2] + ideal[3]
                    remains = 1.0 - first
                    u = np.minimum(np.maximum((u - first) / remains, 0.0), 1.0 - 2.0**-24)
                lost, arguments = self._aside([viewer])
                numbers = [u, np.real(sample2.x), np.real(sample2.y)]
                *wo, weight, pdf = (
                    np.where(lost, instead, x)
                    for instead, x in zip(
                        LOST, self.formulas.sample(np, *arguments, *numbers, *values), strict=True
                    )
                )
                there = 0.0 < pdf
                if ctx.mode == mi.TransportMode.Radiance:
                    weight = weight * self._share(ctx, viewer, wo, values)
                else:
                    weight = self._value(ctx, viewer, wo, values) / np.where(there, pdf, 1.0)
                weight = np.where(there, weight, 0.0) / remains
                pdf = pdf * remains
                kind = np.real(int(flags.GlossyReflection))
                if self.crosses:
                    crossing = wo[2] * viewer[2] < 0.0
                    eta = np.where(crossing, self._index(viewer, values)[1], 1.0)
                    kind = np.where(crossing, float(int(flags.GlossyTransmission)), kind)
            if ideal is not None:
                u = np.real(sample1)
                mirror, transmit, reflects, refracts = ideal
                chosen = u < reflects
                up = (-viewer[0], -viewer[1], viewer[2])
                wo = [np.where(chosen, a, b) for a, b in zip(up, wo, strict=True)]
                weight = np.where(chosen, mirror / np.where(chosen, reflects, 1.0), weight)
                pdf = np.where(chosen, reflects, pdf)
                eta = np.where(chosen, 1.0, eta)
                kind = np.where(chosen, float(int(flags.DeltaReflection)), kind)
                if self.formulas.transmit is not None:
                    chosen = (reflects <= u) & (u < reflects + refracts)
                    safe = np.where(chosen, refracts, 1.0)
                    u = (u - reflects) / safe
                    bent, share, bent_eta, odds = self._refracted(ctx, viewer, values, u)
                    wo = [np.where(chosen, a, b) for a, b in zip(bent, wo, strict=True)]
                    weight = np.where(chosen, transmit * share / safe, weight)
                    pdf = np.where(chosen, refracts * odds, pdf)
                    eta = np.where(chosen, bent_eta, eta)
                    kind = np.where(chosen, float(int(flags.DeltaTransmission)), kind)
            if self.formulas.inside is not None:
                # si.t is how far light has come inside.
                inside = viewer[2] < 0.0
                distance = np.where(inside, np.real(si.t), 0.0)
                weight = weight * self.formulas.inside(np, distance, *values)
            there = (0.0 < pdf) & active
            weight, pdf = np.where(there, weight, 0.0), np.where(there, pdf, 0.0)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = mi.Vector3f(*(np.to_real(x) for x in wo))
            bs.pdf, bs.eta = np.to_real(self._detached(pdf)), np.to_real(eta)
            bs.sampled_type = np.to_index(kind)
            component = np.real(0.0)
            for i, k in enumerate(self.kinds):
                component = np.where(kind == float(int(k)), float(i), component)
            bs.sampled_component = np.to_index(component)
            return bs, np.to_color(weight)

    def _refracted(self, ctx, viewer, values, u):
        """The direction of ideal refraction, a factor of the weight, the relative index, and the
        probability. Where the channels' directions differ, u chooses one of the channels."""
        np = self.np
        x, y, z = viewer
        r, g, b = (self._index(viewer, values)[i] for i in range(3))
        parted = self._detached(r != b)
        first, last = u < 1.0 / 3.0, 2.0 / 3.0 <= u
        eta = np.where(parted, np.where(first, r, np.where(last, b, g)), g)
        one = [
            np.where(parted, np.where(picked, 3.0, 0.0), 1.0)
            for picked in (first, np.logical_not(first | last), last)
        ]
        sin2 = (x * x + y * y) / (eta * eta)
        cosine = np.sqrt(np.maximum(1.0 - sin2, 0.0))
        bent = [-x / eta, -y / eta, np.where(0.0 < z, -cosine, cosine)]
        scale = 1.0 / (eta * eta) if ctx.mode == mi.TransportMode.Radiance else 1.0
        return bent, np.rgb(*one) * scale, eta, np.where(parted, 1.0 / 3.0, 1.0)

    def put(self, callback) -> None:
        for name, value in self.values.items():
            callback.put(name, value, mi.ParamFlags.Differentiable)

    def __str__(self) -> str:
        lines = [f'  model = "{self.model.name}"']
        lines += [f'  {name} = "{word}"' for name, word in self.choices.items()]
        lines += [f"  {name} = {value}" for name, value in self.values.items()]
        return "BrdfcBSDF[\n" + ",\n".join(lines) + "\n]"


def _plugin():
    """The plug-in's class in the variant that is set."""

    class BrdfcBSDF(mi.BSDF):
        def __init__(self, props):
            super().__init__(props)
            self.surface = _Surface(props)
            self.m_components = self.surface.flags()
            self.m_flags = reduce(or_, self.m_components)

        def sample(self, ctx, si, sample1, sample2, active=True):
            return self.surface.sample(ctx, si, sample1, sample2, active)

        def eval(self, ctx, si, wo, active=True):
            return self.surface.eval_pdf(ctx, si, wo, active, ("eval",))[0]

        def pdf(self, ctx, si, wo, active=True):
            return self.surface.eval_pdf(ctx, si, wo, active, ("pdf",))[0]

        def eval_pdf(self, ctx, si, wo, active=True):
            return tuple(self.surface.eval_pdf(ctx, si, wo, active))

        def traverse(self, callback):
            self.surface.put(callback)

        def parameters_changed(self, keys=()):
            self.surface.changed()

        def to_string(self):
            return str(self.surface)

        def __repr__(self):
            return str(self.surface)

    return BrdfcBSDF
