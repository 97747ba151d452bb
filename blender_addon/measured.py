# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured BRDFs: the models that come close to a file that the program reads.

The program brdfc reads the file and fits the models.
"""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from .common.i18n import say
from .common.jobs import Job
from .common.program import ToolJob
from .packs import pack

#: What stands for the sum of lobes where a model is asked for.
SUM = "lobes"

#: Endings of the files that the program reads: MERL, RGL, UTIA, ALTA, Radiance, and tables.
ENDINGS = (".binary", ".bsdf", ".bin", ".alta", ".dat", ".xml", ".csv")


class MeasuredError(RuntimeError):
    """The program brdfc is missing, or refused the file."""


@dataclass(frozen=True)
class Turned:
    """A model that comes close to the data once they are turned about the normal."""

    #: Radians, counted from x to y.
    angle: float
    #: As those of Fit.
    error: float
    parameters: dict
    matte: tuple | None

    @classmethod
    def of_json(cls, entry):
        return cls(entry["angle"], entry["error"], _values(entry), _color(entry["matte"]))


@dataclass(frozen=True)
class Fit:
    """A model fitted to a measured BRDF."""

    model: str
    parameters: dict
    #: Albedo, (r, g, b), of a Lambert surface whose light is added to the model's; None: no such.
    matte: tuple | None
    #: The part of the light that goes in other directions than was measured.
    error: float
    #: The share of a white world's light that the model's ideal mirror reflects: no data hold it.
    mirror: float
    #: Parameters whose search ended at the end of their range, beyond which others might be better.
    stopped: tuple
    #: Set where data with a direction would have to be turned for a model that has no rotation, and
    #: it would come much closer then.
    turned: Turned | None

    @classmethod
    def of_json(cls, entry):
        return cls(
            entry["model"],
            _values(entry),
            _color(entry["matte"]),
            entry["error"],
            entry["mirror"],
            tuple(entry["stopped"]),
            Turned.of_json(entry["turned"]) if entry["turned"] else None,
        )

    @property
    def used(self):
        """What a material gets, whose tangent can be turned instead of the data: Turned or Fit."""
        return self.turned or self

    def remarks(self):
        """What `stopped` and `turned` tell of the material, a sentence each."""
        said = []
        if self.stopped and not self.turned:
            known = pack.model(self.model).parameters
            # This extension may have been built without some of them.
            labels = (known.get(name, {}).get("label", name) for name in self.stopped)
            said.append(
                say(
                    "The fit stopped at the end of the range of {parameters}: values beyond it "
                    "might come closer",
                    parameters=", ".join(labels),
                )
            )
        if self.turned:
            said.append(
                say(
                    "The tangent is turned by {angle} degrees, as the model has no rotation",
                    angle=f"{-math.degrees(self.turned.angle):.1f}",
                )
            )
        return said


@dataclass(frozen=True)
class Lobe:
    """One of the models whose sum is fitted to a measured BRDF."""

    model: str
    parameters: dict
    #: The part of the sum's light that is its.
    share: float


@dataclass(frozen=True)
class LobeSum:
    """A sum of models fitted to a measured BRDF."""

    #: Of Lobe, those that reflect most first.
    lobes: tuple
    #: The part of the light that goes in other directions than was measured.
    error: float


@dataclass(frozen=True)
class Measured:
    """A file with a measured BRDF."""

    path: Path
    #: Who publishes such files, and the grid of angles; the program's words, which are English.
    format: str
    grid: str
    isotropic: bool
    #: What was assumed or repaired, and what the data lack, one sentence each, in English.
    notes: tuple
    #: The models of this extension, the one that comes closest first; empty if none was asked for.
    fits: tuple
    #: Sums of 1, 2, ... lobes, each with a smaller error than the one before; empty for black data.
    sums: tuple = ()
    #: The program's own words, of which of_json() makes the rest.
    told: dict = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def of_json(cls, path, told):
        """What `brdfc measured --json` prints. Raises MeasuredError without any fit."""
        fits = tuple(
            Fit.of_json(entry) for entry in told["fits"] if entry["model"] in pack.model_names()
        )
        sums = tuple(
            LobeSum(
                tuple(Lobe(e["model"], _values(e), e["share"]) for e in entry["lobes"]),
                entry["error"],
            )
            for entry in told.get("sums", ())
            if all(lobe["model"] in pack.model_names() for lobe in entry["lobes"])
        )
        # The program ranks models without turning them.
        if any(fit.turned for fit in fits):
            fits = tuple(sorted(fits, key=lambda fit: fit.used.error + fit.mirror))
        if not fits and not sums:
            raise MeasuredError(say("This extension has no model that scatters light"))
        return cls(
            Path(path),
            told["format"],
            told["grid"],
            told["isotropic"],
            (*told["notes"], *told["lacks"]),
            fits,
            sums,
            told,
        )

    def lobe_sum(self):
        """The sum that comes closest. Raises ValueError if there is none."""
        if not self.sums:
            raise ValueError(say("The data are black, so no lobes were found"))
        return self.sums[-1]

    def fit(self, model=None):
        """The fit of a model, or the closest one. Raises ValueError."""
        for fit in self.fits:
            if model in (None, fit.model):
                return fit
        known = ", ".join(fit.model for fit in self.fits)
        raise ValueError(
            say("Expected one of the models {models}, got {got!r}", models=known, got=model)
        )


def check_model(model, representation):
    """Raises ValueError unless a material can be made of a fit of this model, or of SUM, or of the
    closest one, if it is None."""
    names = pack.model_names()
    if model is not None and model not in (*names, SUM):
        known = ", ".join([*names, SUM])
        raise ValueError(
            say("Expected one of the models {models}, got {got!r}", models=known, got=model)
        )
    if model in names:
        pack.model(model).resolve(representation)


def fitting_of(path, model):
    """Fits no more to a file than a material of this model needs, as in check_model()."""
    models = {None: "all", SUM: "none"}.get(model, model)
    return Fitting(path, models, sums=model == SUM)


class Fitting(ToolJob):
    """Runs the program brdfc to make a Measured of a file, while Blender stays usable."""

    failure, command = MeasuredError, "measured"

    def __init__(self, path, models="all", sums=True):
        """`models`: one of them, "all" or "none". `sums`: whether sums of lobes are fitted, too.
        Raises MeasuredError."""
        if not path:
            raise MeasuredError(say("Expected a file with a measured BRDF, got none"))
        self._path = Path(bpy.path.abspath(str(path)))
        if self._path.is_dir():
            raise MeasuredError(
                say("{file} is a folder: New Measured Library reads all files in one", file=path)
            )
        if not self._path.is_file():
            raise MeasuredError(say("There is no file {file}", file=path))
        super().__init__()
        self._open_folder("brdfc-measured-")
        lobes = ("--lobes", str(most_lobes("fitted"))) if sums else ()
        self._run(self._path.resolve(), "--json", "--models", models, *lobes)

    def _ended(self, status):
        try:
            if status != 0:
                raise MeasuredError(
                    say(
                        "{file} can't be read as a measured material",
                        file=self._path.name,
                        more=self._last_words(status),
                    )
                )
            told = json.loads(self._said.read_text(encoding="utf-8"))
            return Measured.of_json(self._path, told)
        except (ValueError, KeyError, TypeError) as bad:
            more = f"{self._program}: {bad!r}"
            raise MeasuredError(
                say("The program brdfc is of another version than this extension", more=more)
            ) from bad
        finally:
            self._folder.cleanup()


class Fittings(Job):
    """Runs a Fitting of one file after the other; a file that is refused does not end the others.
    The result is a Measured by path, and the errors by path."""

    def __init__(self, paths, start):
        """`start(path)` returns the Fitting of a file. A path that is given twice counts once."""
        self.paths, self._start = list(dict.fromkeys(paths)), start
        self._found, self._refusals, self._fitting = {}, {}, None

    @property
    def done(self):
        """The number of files that were fitted or refused."""
        return len(self._found) + len(self._refusals)

    def step(self):
        done = self.done
        if done == len(self.paths):
            self.result = self._found, self._refusals
            return None
        return (done + self._go_on(self.paths[done])) / len(self.paths)

    def _go_on(self, path):
        """Goes on with a file; returns the part of its work that is done."""
        try:
            if self._fitting is None:
                self._fitting = self._start(path)
            share = self._fitting.step()
            if share is not None:
                return share
            self._found[path] = self._fitting.result
        except MeasuredError as error:
            self._refusals[path] = error
        self._fitting = None
        return 1

    def cancel(self):
        if self._fitting is not None:
            self._fitting.cancel()


def most_lobes(kind):
    """The largest number of lobes in a sum: "most" in any, "fitted" in one that is fitted."""
    return pack.manifest()["lobes"][kind]


def _color(entry):
    return tuple(entry) if entry else None


def _values(entry):
    return {k: tuple(v) if isinstance(v, list) else v for k, v in entry["parameters"].items()}


def as_pairs(lobes):
    """A model's name and its parameters for each lobe of a sum. Raises ValueError."""
    pairs = [
        (lobe.model, lobe.parameters) if isinstance(lobe, Lobe) else lobe
        for lobe in (lobes if isinstance(lobes, list | tuple) else ())
    ]
    if not pairs or not all(
        isinstance(pair, list | tuple) and [type(x) for x in pair] == [str, dict] for pair in pairs
    ):
        raise ValueError(
            say(
                "Expected a list of lobes, each a model and a dictionary of its parameters, got "
                "{given!r}",
                given=lobes,
            )
        )
    most = most_lobes("most")
    if len(pairs) > most:
        raise ValueError(
            say("Expected at most {most} lobes, got {count}", most=most, count=len(pairs))
        )
    for model, values in pairs:
        if pack.model(model).lets_light_through(values):
            raise ValueError(
                say("{model!r} lets light through: expected models that reflect", model=model)
            )
    return pairs
