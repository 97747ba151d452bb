# SPDX-License-Identifier: GPL-3.0-or-later
"""Published reflection models on NumPy arrays, in double precision.

    import brdfc

    ward = brdfc.model("ward")
    f = ward.eval(wi, wo, ax=0.1)  # (N, 3), of directions (N, 3)
    help(ward)                     # equation, paper, parameters

Directions are unit vectors that leave the surface, in a frame whose z axis is the normal: wi points
to the light, wo to the viewer. The formulas are traced from those that the Blender extension's
shaders and the reference renderer are made of.
"""

from __future__ import annotations

import importlib

from . import optics
from ._measured import Fit, Measured, measured
from ._model import Choice, Color, Model, Number, Parameter, Sample, meant
from ._version import __version__
from .models import NAMES

__all__ = [
    "Choice",
    "Color",
    "Fit",
    "Measured",
    "Model",
    "Number",
    "Parameter",
    "Sample",
    "__version__",
    "measured",
    "model",
    "models",
    "optics",
]


def models() -> tuple[str, ...]:
    """The names of all models, in alphabetical order."""
    return NAMES


def model(name: str) -> Model:
    """The model of that name, loaded when it is first asked for. ValueError if there is none."""
    if name not in NAMES:
        near = meant(name, NAMES)
        raise ValueError(f"unknown model {name!r}: {near}expected one of {', '.join(NAMES)}")
    return importlib.import_module(f".models.{name}", __name__).MODEL
