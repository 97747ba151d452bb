# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of parameters: their canonical form, comparison and display. Independent of bpy."""

import math
from numbers import Real


def equal_in_float32(value, only):
    """Whether two values of a parameter are equal in single precision, which sockets have."""
    if isinstance(only, str) or value is None:
        return value == only
    pairs = zip(value, only, strict=True) if isinstance(only, tuple) else [(value, only)]
    return all(math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-9) for a, b in pairs)


def choice_label(identifier):
    """Display text of an identifier."""
    return identifier.replace("_", " ").capitalize()


def value_text(value):
    """Display text of a parameter's value."""
    if isinstance(value, str):
        return choice_label(value)
    if isinstance(value, tuple):
        return f"({', '.join(f'{v:g}' for v in value)})"
    return f"{value:g}"


def unused_parameters(schema, values):
    """Parameters that differ from their default though no formula reads them under these choices:
    {name: a choice that causes it}. The value of a linked parameter is None."""
    found = {}
    for name, parameter in schema.items():
        value, needs = values.get(name), parameter.get("needs", {})
        if needs and not equal_in_float32(value, canonical(parameter)["default"]):
            for choice, needed in needs.items():
                if choice in schema and values.get(choice) not in (None, *needed):
                    found[name] = choice
    return found


def canonical(found):
    """Converts parameter values from JSON to the form of Model.check_value()."""
    return {name: tuple(v) if isinstance(v, list) else v for name, v in found.items()}


def is_number(value):
    return isinstance(value, Real) and not isinstance(value, bool)


def checked_number(what, value, low, high):
    """The value as a float. Raises ValueError, which says `what`, unless it is a number from low to
    high."""
    if not is_number(value):
        raise ValueError(f"{what}: expected a number from {low:g} to {high:g}, got {value!r}")
    try:
        value = float(value)
    except OverflowError:  # an integer of more than 308 digits
        value = math.inf if value > 0 else -math.inf
    if not math.isfinite(value) or not low <= value <= high:
        raise ValueError(f"{what}: expected a number from {low:g} to {high:g}, got {value:g}")
    return value
