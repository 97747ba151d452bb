# SPDX-License-Identifier: GPL-3.0-or-later
"""The twelve numbers that describe a lamp in a slot of the shared group; some may be driven."""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector

from ..common.i18n import say

#: Number of lamps in the shared group.
SLOTS = 8
_ENOUGH = (2, 4, SLOTS)
#: Names of a slot's vectors, to which the slot's number, from 1, is appended.
PARTS = ("LampPlace", "LampTurn", "LampScale", "LampShape")
#: Shapes of lamps, as numbered in the shaders (osl/brdfc.osl.in, brdfc_lamp). What the number in a
#: slot is above a whole one belongs to the kinds that have that shape (kinds/).
EMPTY, BALL, SUN, RECTANGLE, ELLIPSE, SKY_SUN = range(6)
#: The number of the shape of a rectangle or an ellipse is increased by CODE times the number of
#: cones that it may have less one, and by CODE squared times the number of its cluster, if there
#: are others in it: lamps of a cluster never overlap. Formula Nodes read both
#: (content/formula_lamps.py), other shaders skip them.
CODE = 8.0
#: Most cones of a flat lamp. Formula Nodes have a closure for each, and compute the model for it.
MOST_CONES = 4
#: Index of that number in a slot.
_SHAPE = 9


def part_names(count):
    """Names of the outputs for the first `count` slots, which are also the shaders' inputs."""
    return [f"{part}{slot}" for slot in range(1, count + 1) for part in PARTS]


class Budget(NamedTuple):
    """What shaders leave for lamps at a shading point: closures, and numbers that Cycles keeps at a
    time without Open Shading Language. Each cone of a lamp takes a closure."""

    closures: int
    numbers: float = math.inf

    #: Numbers that a lamp takes, and those that its cones add if it has several.
    LAMP, CONES = 12.6, 18.0

    def lamps(self):
        """For how many lamps it suffices."""
        return max(min(self.closures, int(min(self.numbers / self.LAMP, SLOTS)), SLOTS), 0)

    def cones(self, wanted):
        """How many cones lamps get that want so many; the first ones come first."""
        closures = self.closures - len(wanted)
        numbers = self.numbers - self.LAMP * len(wanted)
        found = []
        for count in wanted:
            more = max(min(count - 1, closures), 0) if numbers >= self.CONES else 0
            closures, numbers = closures - more, numbers - self.CONES * (more > 0)
            found.append(1 + more)
        return found


class Room(NamedTuple):
    """What the nodes of a material have room for."""

    lamps: int
    cones: int  # of each lamp

    def joined(self, other):
        """Room for what either has room for."""
        return Room(*map(max, self, other))


#: Room for all lamps that the shared group can have.
WHOLE = Room(SLOTS, MOST_CONES)


def room_for(shapes):
    """The room that nodes get for lamps with these shapes in their slots, of which None is unknown.
    There are few sizes, so that nodes are seldom made again."""
    cones = [MOST_CONES if shape is None else _code_of(shape) % int(CODE) + 1 for shape in shapes]
    lamps = next(size for size in _ENOUGH if size >= len(shapes))
    return Room(lamps, MOST_CONES if any(count > 1 for count in cones) else 1)


def by_slot(parts):
    """Splits a list in the order of part_names() into one list per slot."""
    return [parts[i : i + len(PARTS)] for i in range(0, len(parts), len(PARTS))]


#: Why a lamp that random rays hit is left out.
NO_NEED = say("so large or near that random rays hit it often")


def too_many(slots):
    """Why a lamp is left out when others are brighter."""
    if not slots:
        return say("no room for it")
    return say("fainter than the {count} that a material has room for", count=slots)


def elsewhere(library):
    """Why a material that is linked from another file aims at no lamp of this one."""
    return say(
        "the material is linked from {file} and uses the lamps of that file", file=library.filepath
    )


@dataclass(frozen=True)
class Lamp:
    """A lamp of a scene: its slot from 1, or None and the reason; its estimated irradiance at the
    subject, by which lamps are ranked; whether it has no size; whether random rays hit it, so that
    it is visible even without a slot; and whether its transform makes another shape of it than
    Cycles' light sampling assumes."""

    name: str
    slot: int | None
    irradiance: float
    why: str = ""
    sizeless: bool = False
    met: bool = True
    distorted: bool = False


@dataclass(frozen=True)
class Driven:
    """A number that Blender keeps up to date: a world-space transform channel of an object, or a
    property of a data-block, times a factor, plus a constant."""

    of: bpy.types.ID
    path: str
    factor: float = 1.0
    added: float = 0.0

    @property
    def is_channel(self):
        return self.path.startswith(("LOC_", "ROT_", "SCALE_"))


@dataclass(frozen=True)
class Sheet:
    """A flat lamp in world space: its centre, its axes as rows, the last of which is the normal,
    its two sizes, and whether it keeps its place without the extension. It shines against its
    normal."""

    centre: np.ndarray
    axes: np.ndarray
    sizes: tuple
    stays: bool

    def cones(self):
        """How many cones it should have (generator/forms/node_cones.h)."""
        return MOST_CONES if min(self.sizes) > 0 else 1

    def never_overlaps(self, other):
        """Whether no ray from a point on which both shine meets both. None does if neither lamp has
        a part behind the other's plane, like panels of a ceiling, or softboxes that face a subject
        between them: the ray is behind the plane of a lamp once it has met it."""
        least = 1e-4 * max(*self.sizes, *other.sizes)
        if self._depth_of(other) > least or other._depth_of(self) > least:
            return False
        return self.axes[2] @ other.axes[2] < 1 - 1e-6 or self._is_beside(other, least)

    def _depth_of(self, other):
        """How far a rectangle about the other lamp reaches behind the plane of this one."""
        reach = np.abs(other.axes[:2] @ self.axes[2]) @ np.array(other.sizes) / 2
        return (other.centre - self.centre) @ self.axes[2] + reach

    def _is_beside(self, other, least):
        """Whether a lamp in the same plane lies beside this one, in the directions of its axes."""
        away = (other.centre - self.centre) @ self.axes.T
        cosines = np.abs(other.axes[:2] @ self.axes[:2].T)
        gaps = np.abs(away[:2]) - (np.array(self.sizes) + np.array(other.sizes) @ cosines) / 2
        return bool(gaps.max() > -least)


@dataclass
class Candidate:
    """A lamp with the twelve numbers of its slot; irradiance(points), (n, 3) to (n,); and
    angular_size(points), the tangent of its angular radius seen from there."""

    name: str
    values: tuple
    irradiance: object
    angular_size: object
    why: str = ""
    rank: float = 0.0
    width: int = 0  # doublings of its angular radius
    sizeless: bool = False
    met: bool = True  # random rays hit it
    uneven: bool = False  # its emission is not uniform
    distorted: bool = False  # see Lamp
    sheet: Sheet | None = None  # of a flat lamp
    #: If they depend on the subject, judge(points) sets the values and `why`, given its points,
    #: (n, 3).
    judge: object = None


def angular_size_at(place, radius):
    """angular_size() of a lamp with this position and radius."""
    middle = np.array(place)

    def angular_size(points):
        return radius / np.maximum(np.sqrt(((points - middle) ** 2).sum(-1)), 1e-9)

    return angular_size


def angular_size_distant(angle):
    """angular_size() of a distant lamp with this full angle."""
    return lambda points: np.full(len(points), math.tan(angle / 2))


def numbers(shape, place=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1), sizes=(0, 0)):
    """The twelve numbers of a slot, in the order of PARTS. The shape may be Driven."""
    return (*place, *turn, *scale, shape if isinstance(shape, Driven) else float(shape), *sizes)


def _with_shape(values, shape):
    return (*values[:_SHAPE], shape, *values[_SHAPE + 1 :])


def coded(values, cones, cluster):
    """The numbers of a flat lamp that may have this number of cones, in a cluster with this number:
    0 if it is alone."""
    shape, added = values[_SHAPE], CODE * (cones - 1 + CODE * cluster)
    if isinstance(shape, Driven):
        shape = replace(shape, added=shape.added + added)
    else:
        shape += added
    return _with_shape(values, shape)


def _code_of(shape):
    number = shape.added if isinstance(shape, Driven) else shape
    return 0 if number is None else math.floor(number / CODE)


def decoded(values):
    """coded() undone."""
    code = _code_of(values[_SHAPE])
    return coded(values, 1 - code, 0) if code else values


def _now(value):
    """What a number of a slot is at the moment."""
    if not isinstance(value, Driven):
        return value
    if not value.is_channel:
        found = value.of.path_resolve(value.path)
    else:
        channel, axis = value.path.split("_")
        matrix = value.of.matrix_world
        parts = dict(zip(("LOC", "ROT", "SCALE"), matrix.decompose(), strict=True))
        found = getattr(parts[channel], axis.lower())
    return found * value.factor + value.added


def _as_seen(values):
    """What shaders read of a slot, given its numbers without a code: equal for lamps of equal shape
    at one place, whatever objects they are."""
    found = np.array([_now(value) for value in values], float)
    place, (x, y, z), scale, shape = found.reshape(4, 3)
    turn = np.array(Quaternion((scale[2], x, y, z)).to_matrix())
    kind = int(shape[0] + 0.5)
    if kind == SKY_SUN:
        return np.concatenate([(x, y), shape])
    if kind == SUN:
        return np.concatenate([turn[:, 2], shape[:2]])
    if kind == BALL:
        # A ball without a cone looks the same however it is turned.
        axis = turn[:, 2] if shape[2] > 0 or scale[1] > 0 else np.zeros(3)
        return np.concatenate([place, axis, [scale[1] > 0], shape])
    # The sides of a flat lamp have no direction.
    sides = np.abs([shape[1] * scale[0], shape[2] * scale[1]])
    return np.concatenate([place, turn[:, 2], np.abs(turn[:, 0]), sides, [shape[0], shape[1] < 0]])


def while_rendered(values, item):
    """The numbers of a lamp that are those of an empty slot in frames in which the object is not
    rendered. Beyond that, nothing changes the shape's number while the extension does not run."""
    shape = _now(values[_SHAPE])
    return _with_shape(values, Driven(item, "hide_render", EMPTY - shape, shape))


def is_same_lamp(a, b):
    """Whether the numbers of two slots are of lamps that look the same: of the same object, or of
    another one at the same place."""
    if None in a or None in b:
        return False
    one, other = _as_seen(a), _as_seen(b)
    return one.shape == other.shape and np.allclose(one, other, rtol=1e-4, atol=1e-4)


def turned(direction):
    """Turn, and last component of scale, of a distant lamp in this direction."""
    turn = Vector(direction).to_track_quat("Z", "Y")
    return (turn.x, turn.y, turn.z), turn.w


def is_sheared(matrix):
    """Whether the axes of a transform are not perpendicular."""
    axes = [Vector(c).normalized() for c in matrix.to_3x3().transposed()]
    return max(abs(axes[i].dot(axes[j])) for i, j in ((0, 1), (1, 2), (2, 0))) > 1e-3


def is_stretched(matrix):
    """Whether a transform scales its axes differently."""
    scales = [abs(s) for s in matrix.to_scale()]
    return max(scales) > 1.01 * min(scales)


def transform_kind(matrix):
    """The properties of a transform on which drivers and lobes depend: mirrored, sheared, unevenly
    scaled."""
    return matrix.is_negative, is_sheared(matrix), is_stretched(matrix)


def _upright(matrix):
    """A rotation with the lamp's own -z; its x and y may be negated, as lamps are symmetric. For a
    sheared transform the direction is kept."""
    x, _, z = (Vector(c) for c in matrix.to_3x3().transposed())
    z = z.normalized()
    x = (x - z * x.dot(z)).normalized()
    return Matrix((x, z.cross(x), z)).transposed().to_quaternion()


def placed(item, matrix):
    """Place, turn and scale of a lamp: driven if `item` is an object, otherwise from the matrix."""
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
        # For a mirrored transform, Blender's quaternion q has all axes reversed, so that -z would
        # be +z. A half turn about x, q i, corrects this; the signs of x and y don't matter.
        turn = (Driven(item, "ROT_W"), Driven(item, "ROT_Z"), Driven(item, "ROT_Y", -1.0))
        scale = (*scale[:2], Driven(item, "ROT_X", -1.0))
    return place, turn, scale
