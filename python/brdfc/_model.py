# SPDX-License-Identifier: GPL-3.0-or-later
"""A reflection model: its parameters, and its formulas on arrays."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from numbers import Integral
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._formula import NUMPY

if TYPE_CHECKING:
    from ._arrays import ArrayModel

#: Points that a formula takes at a time: what it holds between two steps then stays in the cache.
BLOCK = 8192

#: What lengths of directions may be off 1 by, and cosines above 1.
ROUNDING = 1e-6

#: A sample that is lost: the direction, the weight and the pdf.
LOST = (0.0, 0.0, 1.0, 0.0, 0.0)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Number:
    """A parameter that is one number, or an array of one a point."""

    name: str
    label: str
    unit: str  #: "" for a pure number
    doc: str
    default: float
    min: float  #: the accepted range, inclusive
    max: float
    soft_min: float  #: the range of a slider
    soft_max: float


@dataclass(frozen=True)
class Color:
    """Three numbers of linear RGB in [0, 1], one for grey, or an array (..., 3)."""

    name: str
    label: str
    doc: str
    default: tuple[float, float, float]
    min: ClassVar[float] = 0.0
    max: ClassVar[float] = 1.0


@dataclass(frozen=True)
class Choice:
    """One of several words."""

    name: str
    label: str
    doc: str
    default: str
    choices: tuple[str, ...]


Parameter = Number | Color | Choice


def meant(name: object, known: Iterable[str]) -> str:
    """ "did you mean ward? ", with the nearest of the known names; "" if none is near."""
    near = difflib.get_close_matches(str(name).lower(), known, 1)
    return f"did you mean {near[0]}? " if near else ""


def real(what: str, value: ArrayLike, expected: str) -> Array:
    """Real numbers as an array. TypeError, naming `what` and `expected`, for what NumPy would turn
    into some: masked arrays without their mask, complex numbers without their imaginary part, text,
    truth values, dates."""
    masked = isinstance(value, np.ma.MaskedArray)
    try:
        array = np.asarray(value)
    except (TypeError, ValueError):  # rows of different lengths
        array = None
    if masked or array is None or array.dtype.kind not in "iuf":
        shown = "a masked array" if masked else repr(value)
        if array is not None and array.ndim and not masked:
            shown = f"an array of {array.dtype.name}"
        raise TypeError(f"{what}: expected {expected}, got {shown}")
    return array.astype(np.float64)


class Sample(NamedTuple):
    """Directions drawn from a model. Where pdf is 0 there is none, and the weight is 0."""

    wi: Array  #: (..., 3), unit vectors
    weight: Array  #: (..., 3), f cos(theta_i) / pdf
    pdf: Array  #: (...), per solid angle


class Formulas(NamedTuple):
    """Functions of a library's functions, of components of directions and of parameters; None for a
    term that is not."""

    eval: Callable[..., Any] | None
    pdf: Callable[..., Any] | None
    sample: Callable[..., Any] | None
    mirror: Callable[..., Any] | None
    transmit: Callable[..., Any] | None
    #: 1 where one of Cycles' closures equals the model, of parameters alone.
    whole: Callable[..., Any] | None
    #: The refractive index inside over the one outside, by channel, of parameters alone; None where
    #: no light crosses the surface.
    iors: Callable[..., Any] | None
    #: The share of the light that is left after a distance inside, of the distance and parameters.
    inside: Callable[..., Any] | None


class Model:
    """A reflection model. Derived classes are made from the formulas in C++, one a model.

    Arrays of directions, parameters and random numbers broadcast against one another. A parameter
    that is left out takes its default. Errors name model and parameter: ValueError for what is out
    of range, TypeError for a name that the model doesn't have or a value of another kind.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    paper: ClassVar[str]
    equations: ClassVar[str]
    doc: ClassVar[str]
    parameters: ClassVar[Mapping[str, Parameter]]
    #: Whether wo may lie below the surface: a boundary of two media.
    two_sided: ClassVar[bool]
    formulas: ClassVar[Mapping[tuple[str, ...], Formulas]]  # by choices, in the order of parameters

    def __repr__(self) -> str:
        return f"brdfc.model({self.name!r})"

    def eval(self, wi: ArrayLike, wo: ArrayLike, **parameters: ArrayLike) -> Array:
        """The BRDF in 1/sr, without the cosine and without ideal reflection and refraction.

        wi, wo: unit vectors (..., 3) to the light and to the viewer; z is the normal.
        Returns (..., 3), linear RGB; 0 where a direction lies below the surface.
        """
        vectors = {"wi": self._directions("wi", wi), "wo": self._directions("wo", wo)}
        (f,) = self._run("eval", vectors, parameters, "c")
        return f

    def pdf(self, wi: ArrayLike, wo: ArrayLike, **parameters: ArrayLike) -> Array:
        """The density of sample() at wi for the same wo, per solid angle.

        wi, wo: unit vectors (..., 3). Returns (...).
        """
        vectors = {"wi": self._directions("wi", wi), "wo": self._directions("wo", wo)}
        (p,) = self._run("pdf", vectors, parameters, "r")
        return p

    def sample(self, wo: ArrayLike, u: ArrayLike, **parameters: ArrayLike) -> Sample:
        """Directions drawn from the model.

        wo: unit vectors (..., 3); u: numbers in [0, 1), (..., 3): choice of lobe, and two for the
        direction. Where wo is below the surface of a model of one side, the sample is (0, 0, 1),
        with weight and pdf 0.
        """
        numbers = self._vectors("u", u)
        if not np.all((numbers >= 0) & (numbers < 1)):
            raise ValueError(f"{self.name}: u: expected numbers in [0, 1)")
        vectors = {"wo": self._directions("wo", wo), "u": numbers}
        x, y, z, weight, pdf = self._run("sample", vectors, parameters, "rrrcr")
        return Sample(np.stack([x, y, z], axis=-1), weight, pdf)

    def mirror(self, wo: ArrayLike, **parameters: ArrayLike) -> Array:
        """The weight of ideal reflection; wo: (..., 3), returns (..., 3)."""
        (weight,) = self._run("mirror", {"wo": self._directions("wo", wo)}, parameters, "c")
        return weight

    def transmit(self, wo: ArrayLike, **parameters: ArrayLike) -> Array:
        """The weight of ideal refraction; wo: (..., 3), returns (..., 3)."""
        (weight,) = self._run("transmit", {"wo": self._directions("wo", wo)}, parameters, "c")
        return weight

    def albedo(
        self,
        cos_theta_o: ArrayLike,
        phi_o: ArrayLike = 0.0,
        *,
        samples: int = 4096,
        **parameters: ArrayLike,
    ) -> Array:
        """The share of the light that a surface reflects, lit from everywhere.

        The integral of f cos(theta_i) over wi, as the mean weight of so many low-discrepancy
        samples, and the weights of ideal reflection and refraction.

        cos_theta_o: cosine (...) between view and normal in (0, 1], negative inside of a model of
        two sides; phi_o: azimuth (...) of the view in radians. Returns (..., 3).
        """
        self._check_samples(samples)
        cosine = real(f"{self.name}: cos_theta_o", cos_theta_o, "numbers")
        phi = real(f"{self.name}: phi_o", phi_o, "numbers")
        if not np.all(np.isfinite(phi)):
            raise ValueError(f"{self.name}: phi_o: expected finite numbers")
        known = np.abs(cosine) <= 1 + ROUNDING
        if not np.all(known & (cosine != 0) & ((cosine > 0) | self.two_sided)):
            least = "[-1, 1], not 0" if self.two_sided else "(0, 1]"
            raise ValueError(f"{self.name}: cos_theta_o: expected numbers in {least}")
        cosine = np.clip(cosine, -1, 1)
        sine = np.sqrt((1 - cosine) * (1 + cosine))
        wo = np.stack(np.broadcast_arrays(sine * np.cos(phi), sine * np.sin(phi), cosine), axis=-1)
        total = self.mirror(wo, **parameters) + self.transmit(wo, **parameters)
        # One more axis, of samples, after those that all share.
        inner = {}
        for name, value in parameters.items():
            if isinstance(self.parameters.get(name), Choice):
                inner[name] = value
                continue
            value = np.asarray(value, np.float64)  # which mirror() has checked
            colour = isinstance(self.parameters.get(name), Color)
            lead = value.ndim - (1 if colour and value.ndim else 0)
            inner[name] = np.expand_dims(value, lead) if lead else value
        return total + self.sample(wo[..., None, :], sequence(samples), **inner).weight.mean(
            axis=-2
        )

    def is_closure(self, parameters: Mapping[str, ArrayLike | None]) -> bool:
        """Whether one of Cycles' closures equals the model at these values, one of each parameter.
        None stands for a value that is not known: if it matters, the answer is False."""
        known = {name: value for name, value in parameters.items() if value is not None}
        choices = (name for name, p in self.parameters.items() if isinstance(p, Choice))
        if any(parameters.get(name, "") is None for name in choices):
            return False
        chosen, values = self._bind(known)
        formula = self.formulas[chosen].whole
        if formula is None:
            return False
        arguments = []
        for name, value in values.items():
            value = value[:, None] if isinstance(self.parameters[name], Color) else value[()]
            arguments.append(value * np.nan if parameters.get(name, 0) is None else value)
        with np.errstate(invalid="ignore"):
            return bool(np.all(np.asarray(formula(NUMPY, *arguments)) > 0))

    def on(self, namespace: ModuleType) -> ArrayModel:
        """The model on arrays of another library: jax.numpy, torch, or one that follows the array
        API standard. Functions of the result can be traced, compiled and differentiated."""
        from ._arrays import ArrayModel

        return ArrayModel(self, namespace)

    # ---- what the methods above share ----------------------------------------------------------

    def _check_samples(self, samples: int) -> None:
        if not isinstance(samples, Integral) or isinstance(samples, bool):
            raise TypeError(f"{self.name}: samples: expected a whole number, got {samples!r}")
        if samples < 1:
            raise ValueError(f"{self.name}: samples: expected a number from 1, got {samples}")

    def _check_vectors(self, name: str, shape: tuple[int, ...]) -> None:
        if not shape or shape[-1] != 3:
            raise ValueError(f"{self.name}: {name}: expected shape (..., 3), got {shape}")

    def _vectors(self, name: str, value: ArrayLike) -> Array:
        array = real(f"{self.name}: {name}", value, "numbers in an array (..., 3)")
        self._check_vectors(name, array.shape)
        return array

    def _directions(self, name: str, value: ArrayLike) -> Array:
        array = self._vectors(name, value)
        x, y, z = array[..., 0], array[..., 1], array[..., 2]
        length = np.sqrt(x * x + y * y + z * z)
        if not np.all(np.abs(length - 1) <= ROUNDING):
            wrong = np.ravel(length)[~(np.abs(np.ravel(length) - 1) <= ROUNDING)][0]
            raise ValueError(
                f"{self.name}: {name}: expected unit vectors, the length of one is {wrong:.9g}"
            )
        return array / length[..., None]

    def _choices(self, given: Mapping[str, ArrayLike]) -> tuple[str, ...]:
        """The words of choices; that the model has what is given is checked as well."""
        for name in given:
            if name not in self.parameters:
                raise TypeError(
                    f"{self.name}: unknown parameter {name!r}: expected one of "
                    f"{', '.join(self.parameters)}"
                )
        choices = []
        for name, p in self.parameters.items():
            if isinstance(p, Choice):
                value = given.get(name, p.default)
                if not isinstance(value, str) or value not in p.choices:
                    raise ValueError(
                        f"{self.name}: {name}: expected one of {', '.join(p.choices)}, "
                        f"got {value!r}"
                    )
                choices.append(value)
        return tuple(choices)

    def _bind(self, given: Mapping[str, ArrayLike]) -> tuple[tuple[str, ...], dict[str, Array]]:
        """Choices, and numbers (...) and colours (..., 3) by name."""
        choices, values = self._choices(given), {}
        for name, p in self.parameters.items():
            if isinstance(p, Choice):
                continue
            value = given.get(name, p.default)
            what = "three numbers or one" if isinstance(p, Color) else "a number"
            array = real(f"{self.name}: {name}", value, what)
            if isinstance(p, Color):
                if array.ndim == 0:
                    array = np.repeat(array, 3)
                self._check_color(name, array.shape)
            inside = (array >= p.min) & (array <= p.max)  # false for NaN
            if not np.all(inside):
                raise ValueError(
                    f"{self.name}: {name}: expected {what} in [{p.min:g}, {p.max:g}], got "
                    f"{array[~inside].flat[0] if array.ndim else array}"
                )
            values[name] = array
        return choices, values

    def _check_color(self, name: str, shape: tuple[int, ...]) -> None:
        if shape[-1] != 3:
            raise ValueError(
                f"{self.name}: {name}: expected three numbers or one, or an array (..., 3), "
                f"got the shape {shape}"
            )

    def _broadcast(
        self, vectors: Mapping[str, tuple[int, ...]], values: Mapping[str, tuple[int, ...]]
    ) -> tuple[int, ...]:
        """The shape that directions (..., 3), numbers (...) and colours (..., 3) of these shapes
        broadcast to, without the 3."""
        leads = [shape[:-1] for shape in vectors.values()]
        for name, shape in values.items():
            leads.append(shape[:-1] if isinstance(self.parameters[name], Color) else shape)
        try:
            return np.broadcast_shapes(*leads)
        except ValueError:
            shapes = {**vectors, **values}
            given = zip(shapes.items(), leads, strict=True)
            # One number or colour broadcasts to anything.
            described = ", ".join(f"{n} {s}" for (n, s), lead in given if lead or n in vectors)
            raise ValueError(f"{self.name}: shapes do not broadcast: {described}") from None

    def _run(
        self,
        what: str,
        vectors: Mapping[str, Array],
        given: Mapping[str, ArrayLike],
        kinds: str,
    ) -> list[Array]:
        """The outputs of a formula, whose kinds are letters: r, a real, or c, a colour."""
        choices, values = self._bind(given)
        formula = getattr(self.formulas[choices], what)
        shape = self._broadcast(
            {name: v.shape for name, v in vectors.items()},
            {name: value.shape for name, value in values.items()},
        )
        size = int(np.prod(shape))
        out = [np.zeros((3, size) if k == "c" else size) for k in kinds]
        if formula is not None:
            arguments = [
                np.broadcast_to(v[..., i], shape).reshape(size)
                for v in vectors.values()
                for i in range(3)
            ]
            for name, value in values.items():
                colour = isinstance(self.parameters[name], Color)
                lead = value.shape[:-1] if colour else value.shape
                if lead:
                    value = np.broadcast_to(value, (*shape, 3) if colour else shape)
                    value = value.reshape(size, 3).T if colour else value.reshape(size)
                else:
                    value = value[:, None] if colour else value[()]
                arguments.append(value)
            # Both arms of a selection are evaluated, and what is not taken may be anything.
            with np.errstate(all="ignore"):
                for first in range(0, size, BLOCK):
                    block = slice(first, first + BLOCK)
                    results = formula(
                        NUMPY,
                        *(
                            a[..., block] if a.shape and a.shape[-1] == size else a
                            for a in arguments
                        ),
                    )
                    for array, result in zip(
                        out, results if len(out) > 1 else (results,), strict=True
                    ):
                        array[..., block] = result
        if what == "sample" and (formula is None or not self.two_sided):
            # Below the surface formulas may have no direction.
            below = np.broadcast_to(vectors["wo"][..., 2] <= 0, shape).reshape(size)
            lost = slice(None) if formula is None else below
            for array, value in zip(out, LOST, strict=True):
                array[..., lost] = value
        for array in out:
            if not np.isfinite(array).all():
                at = int(np.argwhere(~np.isfinite(array))[0][-1])
                where = [np.broadcast_to(v, (*shape, 3)).reshape(-1, 3)[at] for v in vectors]
                raise FloatingPointError(
                    f"{self.name}: {what} is {array[..., at]} at {where} with {dict(given)}"
                )
        return [
            (a.T.reshape(*shape, 3) if k == "c" else a.reshape(shape))
            for a, k in zip(out, kinds, strict=True)
        ]


def sequence(count: int) -> Array:
    """Points (count, 3) that fill [0, 1)^3 evenly: multiples of powers of a root of x^4 = x + 1."""
    root = 1.2207440846057596
    steps = np.array([1 / root, 1 / root**2, 1 / root**3])
    return (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0
