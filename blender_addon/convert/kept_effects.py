# SPDX-License-Identifier: GPL-3.0-or-later
"""Effects of a Principled node that no model has, and that stay Blender's own: over the models
(coat and sheen), beneath their highlight (subsurface scattering) or beside them (transmission)."""

from dataclasses import dataclass

from ..common.i18n import Sentence, say
from ..nearest import layer
from .node_values import Refused, f0_of, is_plastic, roughnesses_of

#: Effects that lie over all others, and the sockets whose links a conversion keeps.
UPPER_SOCKETS = {
    "Sheen": ("Sheen Weight",),
    "Coat": ("Coat Weight", "Coat Roughness", "Coat Normal"),
}
SUBSURFACE, TRANSMISSION = "Subsurface Weight", "Transmission Weight"
#: The sockets of subsurface scattering, some of which a node has with one *Method* only; and the
#: other ones on which it depends. The same of transmission.
SUBSURFACE_SOCKETS = (
    *(SUBSURFACE, "Subsurface Radius", "Subsurface Scale", "Subsurface IOR"),
    "Subsurface Anisotropy",
)
SUBSURFACE_SHARED = ("Base Color", "Roughness")
TRANSMISSION_SHARED = (
    *("Base Color", "Roughness", "IOR", "Specular IOR Level", "Specular Tint"),
    *("Anisotropic", "Anisotropic Rotation"),
)
#: The weights of effects, which count even while they are 0; and how the names of sockets begin
#: that have no effect then.
_WEIGHTS = {SUBSURFACE, TRANSMISSION, *(f"{name} Weight" for name in UPPER_SOCKETS)}
_OF_EFFECTS = ("Weight", "Subsurface ", "Coat ", "Sheen ", "Thin Film IOR")


@dataclass(frozen=True)
class Upper:
    """An effect of a Principled node that stays, over the models that replace the others."""

    #: Of UPPER_SOCKETS.
    name: str
    #: The light that it leaves to what lies below, where it covers all: a polynomial as of
    #: layer.rest().
    rest: tuple
    #: The largest channel of its tint.
    top: float = 1.0

    @property
    def weight(self):
        """The name of the socket of its weight."""
        return f"{self.name} Weight"

    @property
    def roughness(self):
        """The name of the socket of its roughness."""
        return f"{self.name} Roughness"


def effective_sockets(node, kept):
    """The sockets of a convertible node that do something, or would if they had another value.
    `kept`: the sockets of effects that stay Blender's own."""
    return [
        socket
        for socket in node.inputs
        if socket.enabled
        and (
            socket.name in _WEIGHTS
            or socket.name in kept
            or not socket.name.startswith(_OF_EFFECTS)
        )
    ]


def _has(inputs, weight):
    """Whether an effect shows, of which a socket is the weight."""
    return weight in inputs and (inputs.follows(weight) or inputs.constant(weight) > 0)


def uppers_of(inputs):
    """The Uppers of a Principled node."""
    makers = {"Sheen Weight": _sheen, "Coat Weight": _coat}
    return tuple(upper(inputs) for weight, upper in makers.items() if _has(inputs, weight))


def _coat(inputs):
    # No node gives a shader a colour.
    if inputs.value("Coat Tint", (1.0, 1.0, 1.0)) != (1, 1, 1):
        raise Refused(say("it has {what}", what=Sentence("Coat Tint")))
    ior = max(inputs.value("Coat IOR"), 1.0)
    roughnesses = roughnesses_of(inputs, "Coat Roughness")
    f0 = ((ior - 1) / (ior + 1)) ** 2
    one = roughnesses[0] if len(roughnesses) == 1 else None
    return Upper("Coat", layer.below_coat(f0, one))


def _sheen(inputs):
    top = max(*inputs.value("Sheen Tint"), 0.0)
    roughness = min(max(inputs.value("Sheen Roughness"), 0.0), 1.0)
    return Upper("Sheen", layer.below_sheen(roughness), top)


def subsurface_of(inputs):
    """The IOR at which Cycles has light enter for the subsurface scattering of a Principled node;
    0 if the node has none."""
    if not is_plastic(inputs) or not _has(inputs, SUBSURFACE):
        return 0.0
    inputs.value("Specular IOR Level")  # says that it is linked
    root = f0_of(inputs) ** 0.5
    return (1 + root) / (1 - root)


def transmits(inputs):
    """Whether a Principled node lets part of the light through, as glass does."""
    if not is_plastic(inputs) or not _has(inputs, TRANSMISSION):
        return False
    if not inputs.follows(TRANSMISSION) and inputs.constant(TRANSMISSION) >= 1:
        raise Refused(say("it has {what}", what=Sentence("Transmission")))
    return True
