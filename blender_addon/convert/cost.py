# SPDX-License-Identifier: GPL-3.0-or-later
"""The render time of what plans convert."""

from ..common.i18n import say
from ..packs import device, pack


def _times(plan, osl):
    """That of a plan's models in units of Blender's Glossy node; None if it was not measured. What
    the models of one node have in common, the node takes too: the models add what exceeds that."""
    models = [part for part in plan.parts if part.model]
    costs = [pack.model(m.model).automatic(m.values, osl).entry["cost"] for m in models]
    return None if None in costs else 1 + sum(cost - 1 for cost in costs)


def cost(plans, scene):
    """A sentence on the render time of the new nodes in Cycles; None if nothing is converted or a
    cost was not measured."""
    osl = not device.lacks_osl(scene)
    found = [_times(plan, osl) for plan in plans if not plan.refusal]
    if scene.render.engine != "CYCLES" or not found or None in found:
        return None
    low, high = f"{min(found):.1f}", f"{max(found):.1f}"
    return say(
        "At equal samples the new nodes take about {times} times as long as a Glossy node",
        times=low if low == high else say("{low} to {high}", low=low, high=high),
    )
