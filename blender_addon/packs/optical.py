# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured refractive indices of metals and glass as model parameters, in the working space."""

import math
import os

import bpy

from ..common import color
from ..common.i18n import say
from . import pack

#: Roles of parameters in the manifest: how each follows from a substance, and for which kind of
#: substance: True, only conductors; False, only others.
_ROLES = {
    "index": (lambda s, v: s.index_d, False),
    "dispersion": (lambda s, v: s.dispersion, False),
    "reflectance": (lambda s, v: tuple(v.reflectance), None),
    "tint": (lambda s, v: tuple(v.reflectance), True),
}
for _channel, _letter in enumerate("rgb"):
    _ROLES[f"index_{_letter}"] = (lambda s, v, c=_channel: v.n[c], None)
    _ROLES[f"extinction_{_letter}"] = (lambda s, v, c=_channel: v.k[c], None)
#: The roles that describe absorption inside.
_INSIDE = ("attenuation", "per_length")
#: Names of files of n and k.
ENDINGS = (".csv", ".txt", ".yml", ".yaml", ".spd")


def can_have(model_name):
    """Whether a model has parameters that describe its material."""
    return any("optical" in p for p in pack.model(model_name).parameters.values())


def find(name):
    """Finds a substance of the extension, or reads a file: a table NAME.csv or NAME.txt,
    NAME.yml of refractiveindex.info's database, or a spectrum NAME.eta.spd.

    Raises ValueError that names file, line and what was expected."""
    from ..brdfc import optics  # NumPy's formulas are imported on first use

    if not isinstance(name, str | os.PathLike):
        raise ValueError(
            "expected the name of a substance or a file NAME.csv, NAME.txt, NAME.yml or "
            f"NAME.eta.spd, got {name!r}"
        )
    name = os.path.expanduser(bpy.path.abspath(os.fspath(name)))
    if not name.lower().endswith(ENDINGS):
        return optics.substance(name)
    try:
        return optics.read(name)
    except OSError as error:
        raise ValueError(f"{name}: {error.strerror}") from error


def _absorption(model, substance, metres):
    """Values by role. Raises ValueError if nothing is absorbed, so that a thickness means
    nothing."""
    from ..brdfc import optics

    absorbs = not substance.conductor and substance.absorbs
    if metres is not None:
        low, high = optics.THICKNESSES
        if not low <= metres <= high:
            raise ValueError(
                say(
                    "Expected a thickness from {low} to {high} m, got {thickness}",
                    low=f"{low:g}",
                    high=f"{high:g}",
                    thickness=f"{metres:g}",
                )
            )
        roles = {p.get("optical") for p in model.parameters.values()}
        roles |= set(model.fixed_optical.values())
        if not absorbs or "attenuation" not in roles:
            raise ValueError(
                say(
                    "A thickness says where absorption is exact: {name} absorbs nothing",
                    name=substance.label if not absorbs else model.name,
                )
            )
    if not absorbs:
        return {}
    metres = metres or optics.THICKNESS
    unit = bpy.context.scene.unit_settings.scale_length
    left = substance.attenuation(color.from_xyz, metres)
    return {"attenuation": tuple(left), "per_length": unit / metres}


def _value(role, kind, substance, values, of_inside):
    """The value of a parameter with this role and kind (number or color) for a substance; None if
    the role does not apply to it."""
    if role in _INSIDE:
        return of_inside.get(role)
    value_of, conductors = _ROLES[role]
    if role == "reflectance" and kind == "number":
        value_of, conductors = (lambda s, v: v.luminance), False
    right_kind = conductors in (None, substance.conductor)
    return value_of(substance, values) if right_kind else None


#: Tolerance for comparing a substance with the fixed parameters of a pack that is cut to a scene:
#: Blender 4.5 stores four digits of its working space, the tool more.
_SAME = {"rel_tol": 2e-3, "abs_tol": 2e-4}


def _check_fixed(model, substance, value_of):
    """Raises ValueError if a pack that is cut to a scene has fixed parameters, without sockets, of
    another substance. `value_of`: takes role and kind."""
    other = []
    for name, role in model.fixed_optical.items():
        here = model.fixed[name]
        here = here if isinstance(here, tuple) else (here,)
        value = value_of(role, "number" if len(here) == 1 else "color")
        value = value if value is None or isinstance(value, tuple) else (value,)
        if value is not None and not all(
            math.isclose(a, b, **_SAME) for a, b in zip(value, here, strict=True)
        ):
            other.append(name)
    if other:
        raise ValueError(
            say(
                "This extension was built for one scene: {names} of {model} can't be set to the "
                "values of {substance}; build it again, or use the whole extension",
                names=", ".join(other),
                model=model.label,
                substance=substance.label,
            )
        )


def parameters(model_name, substance, thickness=None):
    """The values of those parameters by name. `thickness`: metres at which absorption is exact.
    Raises ValueError if the model has no parameters for such a substance, if a thickness is given
    but nothing is absorbed, and if this pack has fixed other values."""
    model, values = pack.model(model_name), substance.values(color.from_xyz)
    of_inside = _absorption(model, substance, thickness)

    def value_of(role, kind):
        return _value(role, kind, substance, values, of_inside)

    _check_fixed(model, substance, value_of)
    found = {}
    for name, p in model.parameters.items():
        if "optical" not in p:
            continue
        value = value_of(p["optical"], p["kind"])
        if value is not None:
            single = not isinstance(value, tuple)
            found[name] = (
                min(max(float(value), p["min"]), p["max"]) if single else tuple(map(float, value))
            )
    if not found and not model.fixed_optical:
        if substance.conductor:
            text = say(
                "{model} has no parameter that says which metal it is made of", model=model_name
            )
        else:
            text = say(
                "{model} has no parameter that says which glass or liquid it is made of",
                model=model_name,
            )
        raise ValueError(text)
    return found | _unsaid(model, found)


def _unsaid(model, found):
    """The values of the other parameters that describe a material, so that none remains of an
    earlier substance: nothing is absorbed, and a dielectric has no tint."""
    others = {
        name: p
        for name, p in model.parameters.items()
        if "optical" in p and p["optical"] != "per_length" and name not in found
    }
    absorbs_nothing = (1.0, 1.0, 1.0)
    return {
        name: absorbs_nothing if p["optical"] == "attenuation" else p["default"]
        for name, p in others.items()
    }
