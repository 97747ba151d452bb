# SPDX-License-Identifier: GPL-3.0-or-later
"""Metals, glass and liquids by their measured refractive index n + i k over the wavelength, and
what stands for them in three channels.

    import PyOpenColorIO
    from brdfc import optics

    gold = optics.substance("gold")           # or optics.read("FILE.csv")
    gold.xyz()                                # seen from above, under D65
    values = gold.values(to_rgb)              # n, k and reflectance by channel

Spectra are seen by the CIE's standard observer of 1931 under D65. X, Y and Z are those over a
perfect reflector's, which are 1, 1, 1. `to_rgb` makes linear RGB of arrays (3,) of them, with
OpenColorIO for instance. Data and formulas are printed from those of the reference renderer.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from . import _optics
from ._formula import NUMPY
from ._model import meant, real
from ._optical_file import read_file

#: Metres after which absorption is exact where none are stated, and their range.
THICKNESS, THICKNESSES = _optics.THICKNESS, _optics.THICKNESSES

Array = NDArray[np.float64]
ToRgb = Callable[[Array], Array]


def _one(what, value, expected):
    """One real number."""
    array = real(what, value, expected)
    if array.ndim:
        raise TypeError(f"{what}: expected {expected}, got an array")
    return float(array)


@dataclass(frozen=True)
class Curve:
    """Numbers over increasing wavelengths in nm."""

    nm: tuple[float, ...]
    values: tuple[float, ...]

    def at(self, nm) -> Array:
        """Linear in between, constant beyond the ends; 0 of an empty one."""
        if not self.nm:
            return np.zeros_like(np.asarray(nm, float))
        return np.interp(nm, self.nm, self.values)


@dataclass(frozen=True)
class Values:
    """What a substance is in a working space: by channel n, k and the reflectance from above."""

    n: Array
    k: Array
    reflectance: Array  #: in [0, 1]
    unclipped: Array  #: the same where the colour lies outside of the working space
    luminance: float  #: Y of it


@dataclass(frozen=True)
class Substance:
    """A metal, a glass, a liquid."""

    name: str
    label: str
    source: str  #: who measured it; may be empty
    n: Curve
    k: Curve  #: empty where none is given
    notes: tuple[str, ...] = ()  #: of a file: what was assumed, or left out of it

    def _mean(self, formula):
        nm = _optics.WAVELENGTHS
        shape = nm.shape
        found = formula(self.n.at(nm), self.k.at(nm))
        several = isinstance(found, tuple)
        means = [
            np.broadcast_to(f, shape) @ _optics.WEIGHTS for f in (found if several else (found,))
        ]
        return means if several else means[0]

    def xyz(self, cosine: float = 1.0) -> Array:
        """X, Y and Z of what is reflected, unpolarised, at an angle of that cosine in (0, 1]."""
        if not 0 < _one(f"{self.name}: cosine", cosine, "a number in (0, 1]") <= 1:
            raise ValueError(f"{self.name}: cosine: expected a number in (0, 1], got {cosine}")
        return self._mean(lambda n, k: _optics.reflectance(NUMPY, cosine, n, k))

    @property
    def absorbs(self) -> bool:
        """Whether light is absorbed inside: k is given, and not 0 all over the visible."""
        return bool(self._mean(lambda n, k: k)[1] > 0)

    def transmittance(self, metres: float) -> Array:
        """X, Y and Z of what is left of light after that many metres inside, by Beer's law."""
        if not 0 <= _one(f"{self.name}: metres", metres, "a number from 0") < math.inf:
            raise ValueError(f"{self.name}: metres: expected a number from 0, got {metres}")
        nm = _optics.WAVELENGTHS
        left = _optics.transmittance(NUMPY, nm, self.k.at(nm), float(metres))
        return np.broadcast_to(left, nm.shape) @ _optics.WEIGHTS

    def attenuation(self, to_rgb: ToRgb, metres: float = THICKNESS) -> Array:
        """The same by channel, as glass of a density of one over these metres has it. Over other
        distances it takes powers of that, which is off where a channel's wavelengths are absorbed
        unlike: `brdfc optical` says how far."""
        return np.clip(np.asarray(to_rgb(self.transmittance(metres)), float), _optics.DARKEST, 1)

    @property
    def conductor(self) -> bool:
        """Whether its mean k, as the eye weighs it, is that of a metal."""
        return bool(self._mean(lambda n, k: k)[1] >= _optics.CONDUCTOR)

    @property
    def index_d(self) -> float:
        """n at the Fraunhofer line d, 587.56 nm."""
        return float(self.n.at(_optics.LINE_D))

    @property
    def abbe(self) -> float:
        """Abbe's number (n_d - 1) / (n_F - n_C); infinite without dispersion."""
        spread = float(self.n.at(_optics.LINE_F) - self.n.at(_optics.LINE_C))
        return (self.index_d - 1) / spread if spread else math.inf

    @property
    def dispersion(self) -> float:
        """20 over Abbe's number, as the parameter `dispersion` of glass has it."""
        return _optics.DISPERSION / self.abbe

    def values(self, to_rgb: ToRgb) -> Values:
        """What stands for it in three channels; see generator/model/optical.h."""
        xyz = self.xyz()
        amplitude = self._mean(lambda n, k: _optics.normal_amplitude(NUMPY, n, k))
        means = (xyz, *amplitude, self.xyz(_optics.GRAZING))
        rgb = [np.asarray(to_rgb(m), float) for m in means]
        n, k = _optics.nearest_index(NUMPY, *rgb)
        return Values(n, k, np.clip(rgb[0], 0, 1), rgb[0], float(xyz[1]))


def substances() -> dict[str, Substance]:
    """Those whose measurements are in the package, by name."""
    found = {}
    for name, (label, source, *curves) in _optics.SUBSTANCES.items():
        n_nm, n, k_nm, k = curves
        found[name] = Substance(name, label, source, Curve(n_nm, n), Curve(k_nm, k))
    return found


def substance(name: str) -> Substance:
    """One of them. ValueError, listing the names, if there is none."""
    known = substances()
    if name not in known:
        raise ValueError(f"{meant(name, known)}expected one of {', '.join(known)}, got {name!r}")
    return known[name]


def _counted(count, one, several):
    return one if count == 1 else several.format(count)


class _Cleaner:
    """What is said of a file on the way from its rows to a curve."""

    def __init__(self, path):
        self.path, self.notes = path, []

    def note(self, text):
        self.notes.append(f"{self.path}: {text}")

    def in_nanometres(self, rows, in_um):
        """Whether wavelengths whose unit nobody states are nanometres."""
        large = not in_um
        for wavelength, _, line in rows:
            if not wavelength > 0:
                got = f"got {wavelength:g}"
                raise ValueError(f"{self.path} line {line}: expected a wavelength above 0, {got}")
            large = large and wavelength >= _optics.NANOMETRES
        if large:
            self.note("wavelengths of 100 and more are taken for nanometres")
        return large

    def curve(self, rows, letter, nanometres):
        rows = [(w * (1 if nanometres else 1000), value, line) for w, value, line in rows]
        rows = sorted(self._without_bad(rows, letter), key=lambda row: row[0])
        values: dict[float, list[float]] = {}
        for wavelength, value, _ in rows:
            values.setdefault(wavelength, []).append(value)
        twice = [w for w, several in values.items() if len(several) > 1]
        if twice:
            what = _counted(
                len(twice),
                f"1 wavelength of {letter} stands",
                f"{{}} wavelengths of {letter} stand",
            )
            self.note(f"{what} twice, the first {twice[0] / 1000:g} µm: the mean is taken")
        curve = Curve(tuple(values), tuple(sum(v) / len(v) for v in values.values()))
        return self._spanning(curve, letter)

    def _without_bad(self, rows, letter):
        kept, dropped, negative = [], 0, []
        low, high = _optics.SEEN
        interval = f"{'(' if letter == 'n' else '['}0, {_optics.MAX_INDEX:g}]"
        for wavelength, value, line in rows:
            if letter == "k" and -_optics.NOISE_OF_K <= value < 0:
                negative.append(value)
                value = 0.0
            if (value > 0 if letter == "n" else value >= 0) and value <= _optics.MAX_INDEX:
                kept.append((wavelength, value, line))
            elif low <= wavelength <= high:
                raise ValueError(
                    f"{self.path} line {line}: expected {letter} in {interval}, got {value:g}"
                )
            else:
                dropped += 1
        if negative:
            what = _counted(len(negative), "1 value of k is", "{} values of k are")
            self.note(f"{what} below 0, the least {min(negative):g}: taken for 0")
        if dropped:
            what = _counted(dropped, "1 value", "{} values")
            self.note(f"{what} of {letter} outside of {interval} and of the visible: left out")
        return kept

    def _spanning(self, curve, letter):
        if not curve.nm:
            return curve
        front, back = curve.nm[0], curve.nm[-1]
        span = f"{front / 1000:g} to {back / 1000:g}"
        if letter == "k" and (front > _optics.SEEN[1] or back < _optics.SEEN[0]):
            self.note(f"k from {span} µm, outside of the visible: left out")
            return Curve((), ())
        low, high = _optics.NEEDED
        if front > low or back < high:
            needed = f"{low / 1000:g} to {high / 1000:g}"
            raise ValueError(f"{self.path}: expected {letter} from {needed} µm, got {span}")
        if front > _optics.EXPECTED[0] or back < _optics.EXPECTED[1]:
            self.note(f"{letter} from {span} µm: taken for constant beyond")
        return curve


def read(path: str | PathLike[str]) -> Substance:
    """Reads a table as refractiveindex.info exports it: a line wl,n, rows of a wavelength in
    micrometres and n, then the same of wl,k, which may be missing; or wl,n,k. Commas, tabs or
    semicolons separate the fields, and a header may state the unit, as in "Wavelength (nm)";
    where none does, wavelengths of 100 and more are nanometres. Lines that start with # are
    skipped; the first is the label, the second the source. Rows may come in any order, and of a
    wavelength that stands twice the mean is taken.

    Reads also a file of that site's database (YAML), with tables or with any of its formulas; and
    a spectrum of n, NAME.eta.spd, with that of k in NAME.k.spd beside it: pairs of a wavelength in
    nanometres and a value, as pbrt and Mitsuba have them. Text is UTF-8, or UTF-16 with a
    byte-order mark. What was assumed is said in `notes`.

    Raises OSError, and ValueError naming file, line and what was expected.
    """
    path = Path(path)
    label, source, found, in_um = read_file(path)
    cleaner = _Cleaner(path)
    nanometres = cleaner.in_nanometres(found["n"] + found["k"], in_um)
    curves = [cleaner.curve(rows, letter, nanometres) for letter, rows in found.items()]
    if not curves[0].nm:
        raise ValueError(f"{path}: expected n in the visible, found none")
    return Substance(str(path), label or path.stem, source, *curves, tuple(cleaner.notes))
