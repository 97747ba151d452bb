# SPDX-License-Identifier: GPL-3.0-or-later
"""The models on arrays of JAX, PyTorch, and libraries that follow the array API standard."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from functools import cache, reduce
from types import ModuleType
from typing import Any

import numpy as np

from ._formula import multilinear
from ._model import LOST, Choice, Color, Model, Sample, real, sequence

Array = Any

#: The least that a guard of a division lets through in single precision, where derivatives divide
#: by its square.
SINGLE_GUARD = 1e-18

#: The cosine that stands for 0 at a boundary of two media.
HORIZON = 1e-20


@cache
def _foreign(xp: ModuleType) -> tuple[type, ...]:
    """NumPy's arrays, where those of the library are others: they are numbers like lists."""
    return () if isinstance(xp.asarray(0.0), np.ndarray) else (np.ndarray, np.generic)


def _own(xp: ModuleType, x) -> bool:
    """Whether it is an array of the library."""
    return hasattr(x, "shape") and hasattr(x, "dtype") and not isinstance(x, _foreign(xp))


class Elementwise:
    """What formulas call for each element alone, of a library's functions `xp`.

    A derivative that is infinite where a formula does not use the value becomes NaN in reverse mode
    (0 * inf). So roots have a derivative of 0 at and below 0.
    """

    xp: Any
    #: The least that a guard lets through.
    _least = 0.0

    def array(self, x) -> Array:
        """Of the library, and of its floating-point type."""
        raise NotImplementedError

    def __getattr__(self, name: str):
        """The functions that all libraries have alike: abs, cos, exp, ..."""
        return getattr(self.xp, name)

    def arctan(self, x):
        return (getattr(self.xp, "atan", None) or self.xp.arctan)(x)

    def sqrt(self, x):
        return self._root(self.xp.sqrt, x, 0.0 < x)

    def cbrt(self, x):
        # The standard has none, and autograd no derivative of NumPy's.
        def root(x):
            size = self.power(self.abs(x), 1 / 3)
            return self.where(x < 0.0, -size, size)

        return self._root(root, x, x != 0.0)

    def _root(self, root, x, smooth):
        return self.where(smooth, root(self.where(smooth, x, 1.0)), x * 0.0)

    def power(self, x, y):
        power = getattr(self.xp, "pow", None) or self.xp.power
        return power(self.array(x), self.array(y))

    def maximum(self, x, y):
        # Formulas state the bound second. Where both are equal, as at the default of a parameter,
        # the slope is that of what is bounded, and not the mean that libraries' maximum() has.
        x, y = self._guard(x), self._guard(y)
        return self.where(x >= y, x, y)

    def minimum(self, x, y):
        return self.xp.minimum(self.array(x), self.array(y))

    def _guard(self, x):
        """A bound as an array; one that keeps a divisor from 0 is raised in single precision."""
        if isinstance(x, float) and x > 0.0:
            x = max(x, self._least)
        return self.array(x)

    def clip(self, x, low, high):
        # Unlike that of the libraries it has the derivative of x at the ends, too: the cosine of a
        # direction along the normal is one.
        return self.where(x < low, low, self.where(high < x, high, x))

    def where(self, condition, x, y):
        return self.xp.where(condition, self.array(x), self.array(y))

    def lookup(self, values, *coordinates):
        return multilinear(self, values, coordinates)


class Functions(Elementwise):
    """What formulas call, with arrays of one type on one device."""

    #: The dimensions of what is not constant: a colour is (3, ...), and (3, 1, ...) if it is.
    rank = 0

    def __init__(self, xp: ModuleType, arrays: list[Array]):
        """For these arrays of the library, which decide on type and device."""
        self.xp = xp
        self.device = {}
        # JAX places constants where they are used, and what it traces is on no device.
        if arrays and hasattr(arrays[0], "device") and not xp.__name__.startswith("jax"):
            self.device = {"device": arrays[0].device}
        floating = [x.dtype for x in arrays if self._is_floating(x.dtype)]
        promote = getattr(xp, "promote_types", xp.result_type)
        self.dtype = reduce(promote, floating) if floating else xp.asarray(0.0).dtype
        bits = xp.finfo(self.dtype).bits
        if bits < 32:
            raise TypeError(f"expected single or double precision, got arrays of {self.dtype}")
        self._least = SINGLE_GUARD if bits == 32 else 0.0

    def _is_floating(self, dtype) -> bool:
        """Whether numbers of the type are floating-point, else they are whole. TypeError for
        others."""
        if hasattr(dtype, "is_floating_point"):  # PyTorch's
            floating = dtype.is_floating_point
            whole = not floating and not dtype.is_complex and dtype != self.xp.bool
        elif hasattr(self.xp, "isdtype"):
            floating = self.xp.isdtype(dtype, "real floating")
            whole = self.xp.isdtype(dtype, "integral")
        else:
            floating, whole = dtype.kind == "f", dtype.kind in "iu"
        if not floating and not whole:
            raise TypeError(f"expected real numbers, got an array of {dtype}")
        return floating

    def array(self, x) -> Array:
        if not _own(self.xp, x):
            return self.xp.asarray(x, dtype=self.dtype, **self.device)
        return x if x.dtype == self.dtype else self._cast(x, self.dtype)

    def _cast(self, x, dtype) -> Array:
        if hasattr(self.xp, "astype"):
            return self.xp.astype(x, dtype)
        return x.to(dtype) if hasattr(x, "to") else x.astype(dtype)

    # ---- of colours and tables -----------------------------------------------------------------

    def max(self, color, axis):
        largest = getattr(self.xp, "amax", None) or self.xp.max
        return largest(color, axis=axis)

    def rgb(self, r, g, b):
        return self.stack([self.array(x) for x in (r, g, b)], (1,) * self.rank)

    def stack(self, arrays, shape):
        """Along a new first axis, broadcast to the shape at least."""
        shape = np.broadcast_shapes(shape, *(tuple(x.shape) for x in arrays))
        return self.xp.stack([self.broadcast(x, shape) for x in arrays])

    def broadcast(self, x, shape):
        # autograd's takes as many dimensions as it gives.
        missing = len(shape) - x.ndim
        x = self.xp.reshape(x, (1,) * missing + tuple(x.shape)) if missing else x
        return self.xp.broadcast_to(x, shape)

    def index(self, x):
        # NaN, where a formula does not use it, must not become an index that is out of range.
        whole = self.xp.int64 if hasattr(x, "to") else self.xp.int32
        return self._cast(self.where(0.0 < x, x, 0.0), whole)

    def entries(self, values, index):
        flat = self.xp.asarray(values.ravel(), dtype=self.dtype, **self.device)
        return self.xp.reshape(self.xp.take(flat, self.xp.reshape(index, (-1,))), index.shape)


class ArrayModel:
    """A model on arrays of another library, by Model.on(): the same functions, of the same shapes.

    Names, choices and shapes are checked. Values are not, because what is traced has none: out of
    range, or of vectors that are far from unit length, anything may come. The arrays decide on type
    and device; lists, numbers and NumPy's arrays take theirs. Without any, they are the library's
    own.
    """

    def __init__(self, model: Model, namespace: ModuleType):
        for name in ("asarray", "where", "maximum", "expm1", "finfo"):
            if not hasattr(namespace, name):
                raise TypeError(
                    f"{model.name}: on: expected a namespace of arrays, like jax.numpy or torch, "
                    f"got {namespace!r}"
                )
        self.model, self.namespace = model, namespace

    def __repr__(self) -> str:
        return f"{self.model!r}.on({self.namespace.__name__})"

    def eval(self, wi: Array, wo: Array, **parameters: Array) -> Array:
        """The BRDF in 1/sr, (..., 3): see Model.eval."""
        (f,) = self._run("eval", {"wi": wi, "wo": wo}, parameters, "c")
        return f

    def pdf(self, wi: Array, wo: Array, **parameters: Array) -> Array:
        """The density of sample() at wi for the same wo, (...): see Model.pdf."""
        (p,) = self._run("pdf", {"wi": wi, "wo": wo}, parameters, "r")
        return p

    def sample(self, wo: Array, u: Array, **parameters: Array) -> Sample:
        """Directions drawn from the model: see Model.sample."""
        x, y, z, weight, pdf = self._run("sample", {"wo": wo, "u": u}, parameters, "rrrcr")
        return Sample(self.namespace.moveaxis(self.namespace.stack([x, y, z]), 0, -1), weight, pdf)

    def mirror(self, wo: Array, **parameters: Array) -> Array:
        """The weight of ideal reflection, (..., 3)."""
        (weight,) = self._run("mirror", {"wo": wo}, parameters, "c")
        return weight

    def transmit(self, wo: Array, **parameters: Array) -> Array:
        """The weight of ideal refraction, (..., 3)."""
        (weight,) = self._run("transmit", {"wo": wo}, parameters, "c")
        return weight

    def albedo(
        self, cos_theta_o: Array, phi_o: Array = 0.0, *, samples: int = 4096, **parameters: Array
    ) -> Array:
        """The share of the light that a surface reflects, (..., 3): see Model.albedo."""
        self.model._check_samples(samples)
        self.model._choices(parameters)
        np, (cosine, phi), values = self._arrays(
            {"cos_theta_o": cos_theta_o, "phi_o": phi_o}, parameters
        )
        xp = self.namespace
        # Rounding may have made a cosine of 1 larger.
        sine = np.sqrt(np.maximum((1.0 - cosine) * (1.0 + cosine), 0.0 * cosine))
        wo = xp.moveaxis(np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], ()), 0, -1)
        given = {**parameters, **values}
        # One more axis, of samples, after those that all share.
        inner = dict(given)
        for name, value in values.items():
            lead = value.ndim - isinstance(self.model.parameters[name], Color)
            if lead > 0:
                inner[name] = xp.reshape(value, (*value.shape[:lead], 1, *value.shape[lead:]))
        weight = self.sample(wo[..., None, :], sequence(samples), **inner).weight
        total = self.mirror(wo, **given) + self.transmit(wo, **given)
        return total + xp.mean(weight, axis=-2)

    # ---- what the methods above share ----------------------------------------------------------

    def _arrays(
        self, leading: Mapping[str, Array], given: Mapping[str, Array]
    ) -> tuple[Functions, list[Array], dict[str, Array]]:
        """Functions for what was given, and all of it as arrays."""
        expected = {name: "numbers" for name in leading}
        parameters = {}
        for name, p in self.model.parameters.items():
            if name in given and not isinstance(p, Choice):
                expected[name] = "three numbers or one" if isinstance(p, Color) else "a number"
                parameters[name] = given[name]
        given = {**leading, **parameters}
        own = {name: x for name, x in given.items() if _own(self.namespace, x)}
        try:
            np = Functions(self.namespace, list(own.values()))
        except TypeError as error:
            raise TypeError(f"{self.model.name}: {error}") from None
        arrays = {}
        for name, x in given.items():
            if name not in own:
                x = real(f"{self.model.name}: {name}", x, expected[name])
            arrays[name] = np.array(x)
        return np, [arrays[name] for name in leading], {name: arrays[name] for name in parameters}

    def _run(
        self, what: str, vectors: Mapping[str, Array], given: Mapping[str, Array], kinds: str
    ) -> list[Array]:
        """The outputs of a formula, whose kinds are letters: r, a real, or c, a colour."""
        model, xp = self.model, self.namespace
        formula = getattr(model.formulas[model._choices(given)], what)
        np, directions, passed = self._arrays(vectors, given)
        for name, x in zip(vectors, directions, strict=True):
            model._check_vectors(name, tuple(x.shape))
        values = {}
        for name, p in model.parameters.items():
            if isinstance(p, Choice):
                continue
            value = passed[name] if name in passed else np.array(p.default)
            if isinstance(p, Color):
                if value.ndim == 0:
                    value = np.broadcast(value, (3,))
                model._check_color(name, tuple(value.shape))
            values[name] = value
        shapes = {name: tuple(value.shape) for name, value in values.items()}
        given_shapes = [tuple(v.shape) for v in directions]
        shape = model._broadcast(dict(zip(vectors, given_shapes, strict=True)), shapes)
        np.rank = len(shape)
        whole = {"r": shape, "c": (3, *shape)}
        if formula is None:
            results = [np.array(x) for x in (LOST if what == "sample" else [0.0] * len(kinds))]
        else:
            arguments, below = [], []
            for name, v in zip(vectors, directions, strict=True):
                components = [np.broadcast(v[..., i], shape) for i in range(3)]
                if name != "u":
                    x, y, z = components
                    length = np.sqrt(x * x + y * y + z * z)
                    z = z / length
                    below.append(z <= 0.0)
                    if what in ("mirror", "transmit"):  # boundaries divide by 0 on the horizon
                        z = np.where(z == 0.0, HORIZON, z)
                    components = [x / length, y / length, z]
                arguments += components
            # Lobes of one side are 0 below the surface; parts of their formulas are infinite there.
            one_sided = not model.two_sided and what in ("eval", "pdf", "sample")
            lost = reduce(operator.or_, below) if one_sided else None
            if lost is not None:
                for i in range(3 * len(below)):
                    arguments[i] = np.where(lost, 1.0 if i % 3 == 2 else 0.0, arguments[i])
            for name, value in values.items():
                if not isinstance(model.parameters[name], Color):
                    arguments.append(np.broadcast(value, shape) if value.ndim else value)
                elif value.ndim > 1:
                    arguments.append(xp.moveaxis(np.broadcast(value, (*shape, 3)), -1, 0))
                else:
                    arguments.append(xp.reshape(value, (3,) + (1,) * len(shape)))
            results = formula(np, *arguments)
            results = results if len(kinds) > 1 else (results,)
            if lost is not None:
                instead = LOST if what == "sample" else (0.0,)
                results = [
                    np.where(lost, value, r) for value, r in zip(instead, results, strict=True)
                ]
        out = []
        for result, kind in zip(results, kinds, strict=True):
            array = np.broadcast(np.array(result), whole[kind])
            out.append(xp.moveaxis(array, 0, -1) if kind == "c" else array)
        return out
