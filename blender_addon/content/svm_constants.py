# SPDX-License-Identifier: GPL-3.0-or-later
"""What lists of operations become for Cycles' SVM to run them in less time.

Up to Blender 5.1 SVM loads a constant for each of a Math node's three sockets that is not linked,
whether the operation takes it or not: a product is two instructions, a sum with a constant three.
So where an operation has a variant of three operands that one takes, with 0, 1 or -1 for the
others, and these are linked to values that Cycles can't know beforehand.
"""

#: Names of the values that stand for constants, and what they are.
VALUES = {"constant_0": 0.0, "constant_1": 1.0, "constant_minus_1": -1.0}
_ZERO, _ONE, _MINUS = VALUES

#: What changes with the shading point, of the inputs of parts. What else they take may be a
#: constant, of which Cycles folds an operation that has no such value.
VARYING = {
    "bend": ("true", "view", "normal", "strand"),
    "draw": ("wo", "u_0", "u_1", "u_2"),
    "lobe": ("value", "u_2"),
    "raise": ("wo",),
    "rest": ("weight", "u", "lost"),
    "value": ("wi", "wo"),
}


def add_values(wiring, unknown):
    """Adds the nodes of VALUES: {name: output}. `unknown`: an output that Cycles can't fold."""
    return {n: wiring.math("MULTIPLY_ADD", unknown, 0.0, v) for n, v in VALUES.items()}


def _with_three(kind, operands):
    """The same operation with three operands, or None."""
    if kind == "MULTIPLY":
        return ["MULTIPLY_ADD", *operands, _ZERO]
    if kind == "ADD":
        # The constant comes last.
        a, b = operands if isinstance(operands[0], str) else reversed(operands)
        return ["MULTIPLY_ADD", a, _ONE, b]
    if kind == "SUBTRACT" and isinstance(operands[1], str):
        return ["MULTIPLY_ADD", operands[1], _MINUS, operands[0]]
    if kind in ("MINIMUM", "MAXIMUM"):
        return [f"SMOOTH_{kind[:3]}", *operands, _ZERO]
    return None


def prepared(name, part):
    """A part of nodes/*.json as it is best for SVM."""
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
