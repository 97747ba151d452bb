# SPDX-License-Identifier: GPL-3.0-or-later
"""Metals and glass of measured refractive index as parameters of a model, in the working space."""

import math
import os

import bpy

from ..common import color
from ..common.i18n import say
from . import pack

#: Roles of parameters in the manifest, and the values of a substance that they take, for what kind:
#: True, conductors alone; False, all others alone.
_ROLES = {
    "index": (lambda s, v: s.index_d, False),
    "dispersion": (lambda s, v: s.dispersion, False),
    "reflectance": (lambda s, v: tuple(v.reflectance), None),
    "tint": (lambda s, v: tuple(v.reflectance), True),
}
for _channel, _letter in enumerate("rgb"):
    _ROLES[f"index_{_letter}"] = (lambda s, v, c=_channel: v.n[c], None)
    _ROLES[f"extinction_{_letter}"] = (lambda s, v, c=_channel: v.k[c], None)
#: Of those, what absorbs inside takes.
_INSIDE = ("attenuation", "per_length")


def can_have(model_name):
    """Whether a model has parameters that say what its surface is made of."""
    return any("optical" in p for p in pack.parameters(model_name).values())


def find(name):
    """A substance of the extension, or of a file NAME.csv as refractiveindex.info exports it.

    Raises ValueError that names file, line and what was expected."""
    from ..brdfc import optics  # NumPy's formulas, when they are first needed

    if not isinstance(name, str | os.PathLike):
        raise ValueError(f"expected the name of a substance or a file NAME.csv, got {name!r}")
    name = os.fspath(name)
    if not name.endswith(".csv"):
        return optics.substance(name)
    try:
        return optics.read(name)
    except OSError as error:
        raise ValueError(f"{name}: {error.strerror}") from error


def _absorption(model_name, substance, metres):
    """Values by role; ValueError where there is nothing that a thickness could say."""
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
        roles = {p.get("optical") for p in pack.parameters(model_name).values()}
        roles |= set(pack.fixed_optical(model_name).values())
        if not absorbs or "attenuation" not in roles:
            raise ValueError(
                say(
                    "A thickness says where absorption is exact: {name} absorbs nothing",
                    name=substance.label if not absorbs else model_name,
                )
            )
    if not absorbs:
        return {}
    metres = metres or optics.THICKNESS
    unit = bpy.context.scene.unit_settings.scale_length
    left = substance.attenuation(color.from_xyz, metres)
    return {"attenuation": tuple(left), "per_length": unit / metres}


def _value(role, kind, substance, values, of_inside):
    """What a parameter of a role and a kind, number or color, is of a substance; None where it says
    nothing of such a one."""
    if role in _INSIDE:
        return of_inside.get(role)
    value_of, conductors = _ROLES[role]
    if role == "reflectance" and kind == "number":
        value_of, conductors = (lambda s, v: v.luminance), False
    right_kind = conductors in (None, substance.conductor)
    return value_of(substance, values) if right_kind else None


#: How far a number of a pack that is cut to a scene may be from a substance's to be the same one:
#: Blender 4.5 has four digits of its working space, the tool more.
_SAME = {"rel_tol": 2e-3, "abs_tol": 2e-4}


def _check_fixed(model_name, substance, value_of):
    """Raises ValueError where a pack that is cut to a scene has parameters of another substance and
    no socket for them. `value_of` a role and a kind."""
    fixed = pack.fixed(model_name)
    other = []
    for name, role in pack.fixed_optical(model_name).items():
        here = fixed[name] if isinstance(fixed[name], tuple) else (fixed[name],)
        value = value_of(role, "number" if len(here) == 1 else "color")
        value = value if value is None or isinstance(value, tuple) else (value,)
        if value is not None and not all(
            math.isclose(a, b, **_SAME) for a, b in zip(value, here, strict=True)
        ):
            other.append(name)
    if other:
        raise ValueError(
            say(
                "This extension was built for one scene: {names} of {model} can't be those of "
                "{substance}; build it again, or take the whole extension",
                names=", ".join(other),
                model=pack.model(model_name)["label"],
                substance=substance.label,
            )
        )


def parameters(model_name, substance, thickness=None):
    """The values of those parameters, by name. `thickness`: the metres after which absorption is
    exact. Raises ValueError where the model has none for such a substance, or one is given where
    nothing is absorbed, and where this extension has other values of them alone."""
    values = substance.values(color.from_xyz)
    of_inside = _absorption(model_name, substance, thickness)

    def value_of(role, kind):
        return _value(role, kind, substance, values, of_inside)

    _check_fixed(model_name, substance, value_of)
    found = {}
    for name, p in pack.parameters(model_name).items():
        if "optical" not in p:
            continue
        value = value_of(p["optical"], p["kind"])
        if value is not None:
            single = not isinstance(value, tuple)
            found[name] = (
                min(max(float(value), p["min"]), p["max"]) if single else tuple(map(float, value))
            )
    if not found and not pack.fixed_optical(model_name):
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
    return found
