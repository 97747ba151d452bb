# SPDX-License-Identifier: GPL-3.0-or-later
"""What a slot of the shared group holds of a lamp: twelve numbers, some of them driven."""

import math
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..common.i18n import say

#: How many lamps the shared group holds.
SLOTS = 8
#: Vectors of a slot, each followed by the slot's number from 1.
PARTS = ("LampPlace", "LampTurn", "LampScale", "LampShape")
#: What a slot may hold, in the numbers of the shaders (osl/brdfc.osl.in, brdfc_lamp).
EMPTY, BALL, SUN, RECTANGLE, ELLIPSE, SKY_SUN = range(6)


def part_names(count):
    """Names of the outputs of the first slots, which are those of the shaders' inputs."""
    return [f"{part}{slot}" for slot in range(1, count + 1) for part in PARTS]


def by_slot(parts):
    """What part_names() has in one list, a list for each slot."""
    return [parts[i : i + len(PARTS)] for i in range(0, len(parts), len(PARTS))]


#: Why a lamp is left out that drawn directions meet.
NO_NEED = say("so large or near that random rays meet it often")


def too_many(slots):
    """Why a lamp is left out that others outshine."""
    if not slots:
        return say("no room for it")
    return say("fainter than the {count} that a material has room for", count=slots)


def elsewhere(library):
    """Why a material that is linked from another file aims at no lamp of this one."""
    return say(
        "the material is linked from {file} and knows the lamps of that file", file=library.filepath
    )


@dataclass(frozen=True)
class Lamp:
    """A lamp of a scene: its slot from 1, or None and why; its irradiance at the subject, which is
    an estimate to rank lamps by; whether it has no size; whether drawn directions meet it, so that
    more than slots show it."""

    name: str
    slot: int | None
    irradiance: float
    why: str = ""
    sizeless: bool = False
    met: bool = True


@dataclass(frozen=True)
class Driven:
    """A number that Blender keeps current: a channel of an object's transform in the world, or
    a property of a data-block; times a factor, and something added."""

    of: bpy.types.ID
    path: str
    factor: float = 1.0
    added: float = 0.0

    @property
    def is_channel(self):
        return self.path.startswith(("LOC_", "ROT_", "SCALE_"))


@dataclass
class Candidate:
    """A lamp, the twelve numbers of its slot, irradiance(points), (n, 3) to (n,), and likewise
    looks(points), the tangent of its angular radius."""

    name: str
    values: tuple
    irradiance: object
    looks: object
    why: str = ""
    rank: float = 0.0
    width: int = 0  # doublings of its angular radius
    sizeless: bool = False
    met: bool = True  # drawn directions meet it
    uneven: bool = False  # its light is not the same all over it
    #: Of a mesh: judge(points) sets values and `why` for a subject at these points, (n, 3).
    judge: object = None


def looks_like(place, radius):
    """looks() of what has a place and a radius."""
    middle = np.array(place)

    def looks(points):
        return radius / np.maximum(np.sqrt(((points - middle) ** 2).sum(-1)), 1e-9)

    return looks


def looks_alike(angle):
    """looks() of what lies in a direction and has this full angle."""
    return lambda points: np.full(len(points), math.tan(angle / 2))


def numbers(kind, place=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1), sizes=(0, 0)):
    """The twelve numbers of a slot, in the order of PARTS. A kind may be a Driven one."""
    return (*place, *turn, *scale, kind if isinstance(kind, Driven) else float(kind), *sizes)


def turned(direction):
    """Turn and last component of scale of a lamp that lies in a direction."""
    turn = Vector(direction).to_track_quat("Z", "Y")
    return (turn.x, turn.y, turn.z), turn.w


def is_sheared(matrix):
    """Whether the axes of a transform are not perpendicular."""
    axes = [Vector(c).normalized() for c in matrix.to_3x3().transposed()]
    return max(abs(axes[i].dot(axes[j])) for i, j in ((0, 1), (1, 2), (2, 0))) > 1e-3


def is_stretched(matrix):
    """Whether a transform scales axes unlike."""
    scales = [abs(s) for s in matrix.to_scale()]
    return max(scales) > 1.01 * min(scales)


def transform_kind(matrix):
    """What of a transform the drivers and lobes are chosen by: whether it mirrors, is oblique, and
    scales axes unlike."""
    return matrix.is_negative, is_sheared(matrix), is_stretched(matrix)


def _upright(matrix):
    """A rotation with the lamp's own -z, and its x and y but for signs, which lamps have none of.
    Of an oblique transform the direction is kept."""
    x, _, z = (Vector(c) for c in matrix.to_3x3().transposed())
    z = z.normalized()
    x = (x - z * x.dot(z)).normalized()
    return Matrix((x, z.cross(x), z)).transposed().to_quaternion()


def placed(item, matrix):
    """Place, turn, and scale of a lamp: driven where `item` is an object, else of the matrix."""
    if item is None or is_sheared(matrix):
        turn = _upright(matrix)
        scale = matrix.to_scale()
        return (
            tuple(matrix.translation),
            (turn.x, turn.y, turn.z),
            (abs(scale.x), abs(scale.y), turn.w),
        )

    def channels(*names):
        return tuple(Driven(item, name) for name in names)

    place = channels("LOC_X", "LOC_Y", "LOC_Z")
    turn = channels("ROT_X", "ROT_Y", "ROT_Z")
    scale = channels("SCALE_X", "SCALE_Y", "ROT_W")
    if matrix.is_negative:
        # Blender's quaternion q of a mirrored transform is that of all axes turned round, so that
        # -z would be +z. Half a turn about x, q i, sets that right; signs of x and y don't matter.
        turn = (Driven(item, "ROT_W"), Driven(item, "ROT_Z"), Driven(item, "ROT_Y", -1.0))
        scale = (*scale[:2], Driven(item, "ROT_X", -1.0))
    return place, turn, scale
