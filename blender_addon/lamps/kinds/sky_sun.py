# SPDX-License-Identifier: GPL-3.0-or-later
"""The suns of Sky Textures."""

import numpy as np

from ...common.i18n import say
from .. import slots
from .kind import Kind

#: Types of Sky Texture that show a sun; NISHITA was split in two in 5.0.
_SKIES_WITH_SUN = {"NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING"}
#: Irradiance by which the sun of a Sky Texture of strength and intensity 1 is ranked: in daylight
#: it outshines any lamp.
_IRRADIANCE = 100.0


class SkySun(Kind):
    nodes = frozenset({"ShaderNodeTexSky"})

    def of_node(self, shown, strength):
        """The dependency graph knows node sockets but not other properties: drivers of these would
        print errors and miss changes, so handlers keep them up to date."""
        node = shown.node
        if node.sky_type not in _SKIES_WITH_SUN or not node.sun_disc:
            return
        power = _IRRADIANCE * strength * node.sun_intensity
        turn = (node.sun_elevation, node.sun_rotation, 0.0)
        yield slots.Candidate(
            say("sun of {node}", node=node.label or node.name),
            slots.numbers(slots.SKY_SUN, turn=turn, sizes=(node.sun_size, 0.0)),
            lambda points: np.full(len(points), power),
            slots.angular_size_distant(node.sun_size),
        )
