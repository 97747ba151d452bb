# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured BRDFs, by the program `brdfc`: files are read in one place."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from ._model import ROUNDING, real

Array = NDArray[np.float64]
_COLUMNS = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z"


def _tool() -> str:
    found = os.environ.get("BRDFC_TOOL") or shutil.which("brdfc")
    if not found:
        raise FileNotFoundError(
            "measured BRDFs are read by the program brdfc, which is not on the path: "
            "install its wheel (docs/python.md), or name it in the environment variable BRDFC_TOOL"
        )
    return found


def _run(*arguments: str, text: str = "") -> str:
    tool = _tool()
    try:
        done = subprocess.run(
            [tool, "measured", *arguments], input=text, capture_output=True, text=True
        )
    except OSError as error:
        raise FileNotFoundError(f"the program brdfc, {tool}, can't be run: {error}") from None
    if done.returncode:
        raise ValueError(done.stderr.strip().removeprefix("brdfc: "))
    return done.stdout


def _json(*arguments: str):
    text = _run(*arguments, "--json")
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        raise FileNotFoundError(
            f"{_tool()} is not the program brdfc: it answers {text[:60]!r}"
        ) from None


@dataclass(frozen=True)
class Turned:
    """A model that comes close to the data once they are turned about the normal."""

    #: Radians, counted from x to y.
    angle: float
    #: As those of Fit.
    error: float
    parameters: dict[str, float | tuple[float, float, float] | str]
    matte: tuple[float, float, float] | None


@dataclass(frozen=True)
class Fit:
    """A model that comes close to a measured BRDF."""

    model: str
    parameters: dict[str, float | tuple[float, float, float] | str]
    #: Albedo of a Lambert surface beside the model, or None.
    matte: tuple[float, float, float] | None
    #: Share of the light that the model sends in other directions.
    error: float
    #: Share of a white world's light that the model's ideal mirror reflects: no data hold it.
    mirror: float
    #: Parameters whose search ended at the end of their range, beyond which others might be better.
    stopped: tuple[str, ...]
    #: Set where data with a direction would have to be turned for a model that has no rotation, and
    #: it would come much closer then.
    turned: Turned | None


@dataclass(frozen=True)
class Lobe:
    """One of the models whose sum comes close to a measured BRDF."""

    model: str
    parameters: dict[str, float | tuple[float, float, float] | str]
    #: The share of the sum's light that is this one's.
    share: float


@dataclass(frozen=True)
class LobeSum:
    """A sum of models that comes close to a measured BRDF."""

    #: Those that reflect most light first.
    lobes: tuple[Lobe, ...]
    #: Share of the light that the sum sends in other directions.
    error: float


@dataclass(frozen=True)
class Measured:
    """A file with a measured BRDF: MERL, RGL, UTIA, ALTA or Radiance, or a table."""

    path: str
    format: str
    description: str
    isotropic: bool
    #: What was assumed or repaired, and what the data lack, a sentence each.
    notes: tuple[str, ...]

    def _pairs(self, wi, wo) -> Array:
        wi, wo = real("wi", wi, "vectors"), real("wo", wo, "vectors")
        wi, wo = np.broadcast_arrays(wi, wo)
        if wi.ndim == 0 or wi.shape[-1] != 3:
            raise ValueError(f"wi and wo: expected arrays (..., 3), got {wi.shape}")
        rows = np.concatenate([wi.reshape(-1, 3), wo.reshape(-1, 3)], axis=1).tolist()
        text = "\n".join([_COLUMNS, *(",".join(map(repr, row)) for row in rows), ""])
        lines = _run(self.path, "--pairs", text=text).splitlines()[1:]
        found = np.array([line.split(",") for line in lines], float).reshape(-1, 4)
        return found.reshape(*wi.shape[:-1], 4)

    def eval(self, wi, wo) -> Array:
        """The BRDF in 1/sr, linear Rec.709, (..., 3), of unit vectors (..., 3)."""
        return self._pairs(wi, wo)[..., :3]

    def albedo(self, cos_theta_o) -> Array:
        """The share of a white world's light that is reflected, (..., 3), over all azimuths."""
        cosine = real("cos_theta_o", cos_theta_o, "numbers in (0, 1]")
        if not ((cosine > 0.0018) & (cosine <= 1 + ROUNDING)).all():
            raise ValueError("cos_theta_o: expected numbers from 0.0018 to 1")
        cosine = np.minimum(cosine, 1)
        at = ",".join(map(repr, np.degrees(np.arccos(cosine)).ravel().tolist()))
        told = _json(self.path, "--models", "none", "--at", at)
        return np.array([view["rgb"] for view in told["albedo"]]).reshape(*cosine.shape, 3)

    def fits(self, *models: str, matte: bool = True) -> list[Fit]:
        """The models fitted to it, all if none is named, the nearest first. `matte`: light of a
        Lambert surface may be added to those that have none."""
        options = ["--models", ",".join(models) or "all", *([] if matte else ["--no-matte"])]
        return [
            Fit(
                f["model"],
                _values(f),
                _plain(f["matte"]),
                f["error"],
                f["mirror"],
                tuple(f["stopped"]),
                _turned(f["turned"]) if f["turned"] else None,
            )
            for f in _json(self.path, *options)["fits"]
        ]

    def fit(self, model: str, *, matte: bool = True) -> Fit:
        """One model fitted to it."""
        return self.fits(model, matte=matte)[0]

    def lobes(self, most: int = 4, *models: str) -> list[LobeSum]:
        """Sums of 1, 2, ... at most `most` lobes (1 to 12) fitted to it, each nearer than the one
        before: of all models that have a lobe, or of those named."""
        options = ["--from", ",".join(models)] if models else []
        told = _json(self.path, "--models", "none", "--lobes", str(most), *options)
        return [
            LobeSum(
                tuple(Lobe(e["model"], _values(e), e["share"]) for e in found["lobes"]),
                found["error"],
            )
            for found in told["sums"]
        ]


def _plain(value):
    return tuple(value) if isinstance(value, list) else value


def _values(entry):
    return {name: _plain(value) for name, value in entry["parameters"].items()}


def _turned(entry) -> Turned:
    return Turned(entry["angle"], entry["error"], _values(entry), _plain(entry["matte"]))


def measured(path: str | PathLike[str]) -> Measured:
    """Reads a file. ValueError that says what is wrong with it; FileNotFoundError without the
    program brdfc."""
    told = _json(os.fspath(path), "--models", "none")
    return Measured(
        os.fspath(path),
        told["format"],
        told["description"],
        told["isotropic"],
        (*told["notes"], *told["lacks"]),
    )
