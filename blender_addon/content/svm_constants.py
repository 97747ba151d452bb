# SPDX-License-Identifier: GPL-3.0-or-later
"""Rewrites lists of operations so that Cycles' SVM runs them faster.

Up to Blender 5.1, SVM loads a constant for each of a Math node's three sockets that is not linked,
used or not: a product takes two instructions, a sum with a constant three. So an operation is
replaced by its variant with three operands, if there is one, whose additional operands 0, 1 or -1
are linked to values that Cycles does not recognize as constant.
"""

#: Names and values of the constants.
VALUES = {"constant_0": 0.0, "constant_1": 1.0, "constant_minus_1": -1.0}
_ZERO, _ONE, _MINUS = VALUES

#: Inputs of parts that vary with the shading point. All others may be constant, and Cycles folds
#: operations on constants only.
VARYING = {
    "bend": ("true", "view", "normal", "strand"),
    "draw": ("wo", "u_0", "u_1", "u_2"),
    "lobe": ("value", "u_2"),
    "raise": ("wo",),
    "rest": ("value", "density", "u", "lost"),
    "value": ("wi", "wo"),
}


def add_values(wiring, unknown):
    """Adds nodes for VALUES: {name: output}. `unknown`: an output that Cycles can't fold."""
    return {n: wiring.math("MULTIPLY_ADD", unknown, 0.0, v) for n, v in VALUES.items()}


def _with_three(kind, operands):
    """The same operation with three operands, or None."""
    if kind == "MULTIPLY":
        return ["MULTIPLY_ADD", *operands, _ZERO]
    if kind == "ADD":
        # Puts the constant last.
        a, b = operands if isinstance(operands[0], str) else reversed(operands)
        return ["MULTIPLY_ADD", a, _ONE, b]
    if kind == "SUBTRACT" and isinstance(operands[1], str):
        return ["MULTIPLY_ADD", operands[1], _MINUS, operands[0]]
    if kind in ("MINIMUM", "MAXIMUM"):
        return [f"SMOOTH_{kind[:3]}", *operands, _ZERO]
    return None


def prepared(name, part):
    """A part of nodes/*.json, rewritten for SVM."""
    varies = set(VARYING.get(name, ()))
    operations, taken = [], set()
    for index, (kind, *operands) in enumerate(part["operations"]):
        named = [o for o in operands if isinstance(o, str)]
        if varies.intersection(named):
            varies.add(f"${index}")
        made = _with_three(kind, operands) if varies.issuperset(named) else None
        operations.append(made or [kind, *operands])
        taken.update(o for o in operations[-1] if isinstance(o, str) and o in VALUES)
    inputs = part["inputs"] + [[n, "FLOAT"] for n in VALUES if n in taken]
    return part | {"inputs": inputs, "operations": operations}
