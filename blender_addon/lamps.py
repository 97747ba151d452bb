# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells shaders where the lamps are: forms that aim closures at lamps read one shared node group.

Its outputs, four vectors a slot, are constants to Cycles. What moves is driven without Python
expressions, so a saved file renders and animates where neither the extension nor scripts may run.
A list that is out of date costs noise and nothing else: forms are right whatever it says.
"""

import math
from dataclasses import dataclass, field
from types import SimpleNamespace

import bpy
import numpy as np
from bpy.app.handlers import persistent
from mathutils import Euler, Matrix, Vector

#: Name of the shared group, and the custom property that tells it from another of that name.
GROUP = "brdfc Lamps"
TAG = "brdfc_lamps"
SLOTS = 8
#: Vectors of a slot, each followed by the slot's number from 1.
PARTS = ("LampPlace", "LampTurn", "LampScale", "LampShape")
EMPTY, BALL, SUN, RECTANGLE, ELLIPSE, SKY_SUN = range(6)

#: Types of Sky Texture that show a sun; NISHITA became two in 5.0.
_SKIES_WITH_SUN = {"NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING"}
#: Irradiance that a sun of a Sky Texture of strength and intensity 1 is ranked by: in
#: daylight it outshines any lamp.
_SKY_SUN_IRRADIANCE = 100.0
#: A lobe covers the whole ball around a mesh, and within it the model and what is seen of the lamp
#: are averaged apart. So a mesh must fill its ball, as a cube does, or look small; a wide one is
#: met by drawn directions anyway. Angular radii in radians.
_FILLS_BALL, _LOOKS_SMALL, _LOOKS_WIDE = 0.5, 0.03, 0.3
_MESHES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}
#: Lamps that shine on something else than the subject still come before none.
_ASIDE = 0.01
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def part_names(count):
    """Names of the outputs of the first slots, which are those of the shaders' inputs."""
    return [f"{part}{slot}" for slot in range(1, count + 1) for part in PARTS]


def too_many(slots):
    """Why a lamp is left out that others outshine."""
    return f"fainter than the {slots} that a material can aim at"


@dataclass(frozen=True)
class Lamp:
    """A lamp of a scene: its slot from 1, or None and why; its irradiance at the subject, which is
    an estimate to rank lamps by."""

    name: str
    slot: int | None
    irradiance: float
    why: str = ""


@dataclass(frozen=True)
class _Driven:
    """A number that Blender keeps current: a channel of an object's transform in the world, or
    a property of a data-block; times a factor."""

    of: bpy.types.ID
    path: str
    factor: float = 1.0

    @property
    def is_channel(self):
        return self.path.startswith(("LOC_", "ROT_", "SCALE_"))


@dataclass
class _Candidate:
    """A lamp, the twelve numbers of its slot, and irradiance(points), (n, 3) to (n,)."""

    name: str
    values: tuple
    irradiance: object
    why: str = ""
    rank: float = 0.0
    #: Of a mesh: the ball around it; see _judge().
    ball: object = None


@dataclass
class _Survey:
    """What a scene holds, and what of it a handler must know to tell a change."""

    candidates: list = field(default_factory=list)
    emission: dict = field(default_factory=dict)  # of materials, by name
    glowing: set = field(default_factory=set)  # names of objects that emit
    instancers: set = field(default_factory=set)  # names of objects that place lamps
    kinds: dict = field(default_factory=dict)  # _kind() of the lamps' transforms, by name
    subject: object = None


# ---- the scene's objects ----


def _rendered(scene, found=None):
    """Objects that the scene's pictures show, of its background sets too."""
    found = {} if found is None else found

    def walk(layer):
        if layer.collection.hide_render:
            return
        if not layer.exclude:
            for item in layer.collection.objects:
                found[item] = None
        for child in layer.children:
            walk(child)

    for layer in [v for v in scene.view_layers if v.use] or scene.view_layers:
        walk(layer.layer_collection)
    if scene.background_set is not None:
        _rendered(scene.background_set, found)
    return found


def _animated(owner):
    data = owner.animation_data
    return data is not None and bool(data.action or data.drivers or data.nla_tracks)


def _luminance(color):
    return float(np.dot(_LUMINANCE, list(color)[:3]))


def _tree(owner):
    """The node tree that shades a light, material or world, or None."""
    return owner.node_tree if getattr(owner, "use_nodes", True) else None


def _output(tree, kind):
    outputs = [n for n in tree.nodes if n.bl_idname == kind]
    fits = [n for n in outputs if getattr(n, "target", "ALL") in {"ALL", "CYCLES"}] or outputs
    return next((n for n in fits if n.is_active_output), fits[0] if fits else None)


def _upstream(socket, seen=None):
    """Every node that a socket hangs on, the nearest first; groups are looked into."""
    seen = [] if seen is None else seen
    for link in socket.links:
        node = link.from_node
        if node in seen:
            continue
        seen.append(node)
        inner = getattr(node, "node_tree", None)
        if inner is not None:
            for end in inner.nodes:
                if end.bl_idname == "NodeGroupOutput":
                    for own in end.inputs:
                        _upstream(own, seen)
        for own in node.inputs:
            if own.is_linked:
                _upstream(own, seen)
    return seen


def _strength(node, color, strength):
    """Luminance that a node emits; what a link controls counts as 1."""
    parts = [node.inputs[name] for name in (color, strength)]
    shade = 1.0 if parts[0].is_linked else _luminance(parts[0].default_value)
    return shade * (1.0 if parts[1].is_linked else parts[1].default_value)


_EMITTERS = {
    "ShaderNodeEmission": ("Color", "Strength"),
    "ShaderNodeBsdfPrincipled": ("Emission Color", "Emission Strength"),
}


def _emission(material):
    """Radiance of a material that light sampling looks for, 0 of most."""
    tree = _tree(material)
    if tree is None or material.cycles.emission_sampling == "NONE":
        return 0.0
    output = _output(tree, "ShaderNodeOutputMaterial")
    if output is None:
        return 0.0
    return sum(
        _strength(node, *_EMITTERS[node.bl_idname])
        for node in _upstream(output.inputs["Surface"])
        if node.bl_idname in _EMITTERS
    )


def _power(light):
    """Energy of a light times its colour; of a dark one that may light up, next to nothing."""
    power = light.energy * _luminance(light.color) * 2.0 ** getattr(light, "exposure", 0.0)
    if tree := _tree(light):
        output = _output(tree, "ShaderNodeOutputLight")
        nodes = _upstream(output.inputs["Surface"]) if output else []
        power *= sum(
            _strength(n, "Color", "Strength") for n in nodes if n.bl_idname == "ShaderNodeEmission"
        )
    if power <= 0 and (_animated(light) or (light.node_tree and _animated(light.node_tree))):
        return 1e-9
    return power


def _hidden(item):
    return item.hide_render and not _animated(item)


# ---- the numbers of a slot ----


def _slot(kind, place=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1), sizes=(0, 0)):
    return (*place, *turn, *scale, float(kind), *sizes)


def _turned(direction):
    """Turn and last component of scale of a lamp that lies in a direction."""
    turn = Vector(direction).to_track_quat("Z", "Y")
    return (turn.x, turn.y, turn.z), turn.w


def _is_sheared(matrix):
    axes = [Vector(c).normalized() for c in matrix.to_3x3().transposed()]
    return max(abs(axes[i].dot(axes[j])) for i, j in ((0, 1), (1, 2), (2, 0))) > 1e-3


def _kind(matrix):
    """What of a transform the drivers are chosen by: whether it mirrors, and is oblique."""
    return matrix.is_negative, _is_sheared(matrix)


def _upright(matrix):
    """A rotation with the lamp's own -z, and its x and y but for signs, which lamps have none of.
    Of an oblique transform the direction is kept."""
    x, _, z = (Vector(c) for c in matrix.to_3x3().transposed())
    z = z.normalized()
    x = (x - z * x.dot(z)).normalized()
    return Matrix((x, z.cross(x), z)).transposed().to_quaternion()


def _placed(item, matrix):
    """Place, turn, and scale of a lamp: driven where `item` is an object, else of the matrix."""
    if item is None or _is_sheared(matrix):
        turn = _upright(matrix)
        scale = matrix.to_scale()
        return (
            tuple(matrix.translation),
            (turn.x, turn.y, turn.z),
            (abs(scale.x), abs(scale.y), turn.w),
        )

    def channels(*names):
        return tuple(_Driven(item, name) for name in names)

    place = channels("LOC_X", "LOC_Y", "LOC_Z")
    turn = channels("ROT_X", "ROT_Y", "ROT_Z")
    scale = channels("SCALE_X", "SCALE_Y", "ROT_W")
    if matrix.is_negative:
        # Blender's quaternion q of a mirrored transform is that of all axes turned round, so that
        # -z would be +z. Half a turn about x, q i, sets that right; signs of x and y don't matter.
        turn = (_Driven(item, "ROT_W"), _Driven(item, "ROT_Z"), _Driven(item, "ROT_Y", -1.0))
        scale = (*scale[:2], _Driven(item, "ROT_X", -1.0))
    return place, turn, scale


def _light_values(light, item, matrix):
    place, turn, scale = _placed(item, matrix)
    if light.type == "SUN":
        return _slot(SUN, place, turn, scale, (_Driven(light, "angle"), 0.0))
    if light.type in {"POINT", "SPOT"}:
        return _slot(BALL, place, turn, scale, (_Driven(light, "shadow_soft_size"), 0.0))
    round_ = light.shape in {"DISK", "ELLIPSE"}
    other = "size_y" if light.shape in {"RECTANGLE", "ELLIPSE"} else "size"
    sizes = _Driven(light, "size"), _Driven(light, other)
    return _slot(ELLIPSE if round_ else RECTANGLE, place, turn, scale, sizes)


def _light_irradiance(light, matrix):
    """Irradiance of a lamp at points that face it; see docs/cycles.md for powers."""
    power = _power(light)
    if light.type == "SUN":
        return lambda points: np.full(len(points), power)
    place, axis = np.array(matrix.translation), -np.array(matrix.col[2].to_3d().normalized())

    def irradiance(points):
        to = points - place
        squared = np.maximum((to**2).sum(-1), 1e-6)
        along = to @ axis / np.sqrt(squared)
        if light.type == "AREA":
            return power / math.pi / squared * np.maximum(along, _ASIDE)
        inside = 1.0
        if light.type == "SPOT":
            inside = np.where(along > math.cos(light.spot_size / 2), 1.0, _ASIDE)
        return power / (4 * math.pi) / squared * inside

    return irradiance


def _is_lamp(light):
    return not (light.type == "AREA" and light.cycles.is_portal) and _power(light) > 0


# ---- meshes that emit ----


def _points(item, materials, depsgraph):
    """Points of an object's faces of some materials, in its own space."""
    own = item.evaluated_get(depsgraph) if depsgraph is not None else item
    mesh = own.data
    if item.type != "MESH" or len(mesh.vertices) == 0 or len(mesh.vertices) > 200000:
        return np.array(own.bound_box)
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3)
    slots = [s.material in materials for s in item.material_slots]
    if all(slots):
        return points
    index = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", index)
    totals = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", totals)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    lit = np.array(slots)[np.clip(index, 0, len(slots) - 1)]
    return points[np.unique(corners[np.repeat(lit, totals)])]


def _mesh(item, materials, matrix, depsgraph):
    """An object that emits, as a ball; None where none of its faces does."""
    points = _points(item, materials, depsgraph)
    if len(points) == 0:
        return None
    low, high = points.min(0), points.max(0)
    centre = Vector((low + high) / 2)
    radius = float(np.sqrt(((points - np.array(centre)) ** 2).sum(-1).max()))
    # Every point lies within the radius times the largest scale of the centre.
    scales = [abs(s) for s in matrix.to_scale()]
    largest = max(range(3), key=lambda i: scales[i])
    place, size = matrix @ centre, radius * scales[largest]
    if centre.length > 1e-4 * radius or _is_sheared(matrix):
        values = _slot(BALL, tuple(place), sizes=(size, 0.0))
    else:
        where = tuple(_Driven(item, f"LOC_{axis}") for axis in "XYZ")
        values = _slot(BALL, where, sizes=(_Driven(item, f"SCALE_{'XYZ'[largest]}", radius), 0.0))
    radiance = sum(materials[m] for m in {s.material for s in item.material_slots} & set(materials))
    middle = np.array(place)

    def irradiance(points):
        squared = ((points - middle) ** 2).sum(-1)
        return radiance * math.pi * size**2 / np.maximum(squared, max(size**2, 1e-12))

    candidate = _Candidate(item.name, values, irradiance)
    extent = min((high - low) * np.array(scales)) / 2
    candidate.ball = SimpleNamespace(
        place=middle, radius=size, fills=size > 0 and extent >= _FILLS_BALL * size
    )
    return candidate


def _judge(candidate, points):
    """Leaves a mesh out that is no ball from where the subject is."""
    ball = candidate.ball
    if ball is None:
        return
    distance = np.sqrt(((points - ball.place) ** 2).sum(-1)).min()
    angle = ball.radius / max(distance, 1e-9)
    if angle > _LOOKS_WIDE:
        candidate.why = "so large or near that it needs no aiming"
    elif angle > _LOOKS_SMALL and not ball.fills:
        candidate.why = "a mesh that is neither round nor small"


# ---- the world ----


def _reroute(socket):
    """The node at the other end of a socket's link, and the socket there."""
    while socket.is_linked:
        link = socket.links[0]
        if link.from_node.bl_idname != "NodeReroute":
            return link.from_node, link.from_socket
        socket = link.from_node.inputs[0]
    return None, None


def _turn_of(node):
    """How the direction of a ray becomes that of a texture, or None where that is not known."""
    matrix = Matrix.Identity(3)
    source, socket = _reroute(node.inputs["Vector"])
    while source is not None and source.bl_idname == "ShaderNodeMapping":
        inputs = source.inputs
        if inputs["Rotation"].is_linked or inputs["Scale"].is_linked:
            return None
        turn = Euler(inputs["Rotation"].default_value).to_matrix()
        scale = Matrix.Diagonal(inputs["Scale"].default_value)
        try:
            step = {
                "POINT": lambda t, s: t @ s,
                "VECTOR": lambda t, s: t @ s,
                "TEXTURE": lambda t, s: (t @ s).inverted(),
                "NORMAL": lambda t, s: t @ s.inverted(),
            }[source.vector_type](turn, scale)
        except ValueError:
            return None
        matrix = matrix @ step
        source, socket = _reroute(inputs["Vector"])
    if source is None or (source.bl_idname, socket.name) in {
        ("ShaderNodeTexCoord", "Generated"),
        ("ShaderNodeNewGeometry", "Position"),
    }:
        return matrix
    return None


def _pixel_directions(u, v):
    """Unit vectors (x, y, z) of an equirectangular picture; docs/cycles.md."""
    phi, theta = (0.5 - u) * 2 * np.pi, (v - 0.5) * np.pi
    flat = np.cos(theta)
    return np.stack([flat * np.cos(phi), flat * np.sin(phi), np.sin(theta)], -1)


def _reduced(luminance, limit):
    """Means of blocks, so that no side is longer than the limit, and how large they are."""
    step = max(1, math.ceil(max(luminance.shape) / limit))
    if step == 1:
        return luminance, 1
    rows, columns = (np.arange(0, n, step) for n in luminance.shape)
    summed = np.add.reduceat(np.add.reduceat(luminance, rows, 0), columns, 1)
    height = np.diff(np.append(rows, luminance.shape[0]))
    width = np.diff(np.append(columns, luminance.shape[1]))
    return summed / np.outer(height, width), step


def bright_spots(luminance, count=SLOTS):
    """The small bright places of an equirectangular picture, (height, width), row 0 at the bottom:
    [(direction, full angle, irradiance)], the brightest first.

    A place has at least 1 % of all light, a radiance of 20 times the mean, and 0.05 sr at most.
    """
    small, step = _reduced(luminance, 1024)
    height, width = small.shape
    u = (np.arange(width) + 0.5) * step / luminance.shape[1]
    v = (np.arange(height) + 0.5) * step / luminance.shape[0]
    directions = _pixel_directions(*np.meshgrid(np.minimum(u, 1), np.minimum(v, 1)))
    pixel = 2 * np.pi / width
    solid = pixel * np.pi / height * np.cos((np.minimum(v, 1) - 0.5) * np.pi)[:, None]
    light = small * solid
    total = light.sum()
    if not total > 0:
        return []
    left, found = small.copy(), []
    for _ in range(4 * count):
        peak = np.unravel_index(left.argmax(), left.shape)
        if left[peak] < 20 * total / (4 * np.pi) or len(found) == count:
            break
        near = directions @ directions[peak] > math.cos(0.25)
        place = near & (left >= 0.1 * left[peak])
        carried = (light * place).sum()
        # What lies around the place is its own glow.
        middle = (directions * (light * place)[..., None]).sum((0, 1))
        middle /= np.linalg.norm(middle)
        wide = np.arccos(np.clip((directions[place] @ middle).min(), -1, 1))
        left[directions @ middle > math.cos(min(wide + 2 * pixel, np.pi))] = 0
        left[place] = 0
        if carried < 0.01 * total or (solid * place).sum() > 0.05:
            continue
        found.append((*_measured(luminance, middle, wide + pixel), carried))
    return sorted(found, key=lambda spot: -spot[2])


def _measured(luminance, direction, wide):
    """Direction and full angle of a spot at the picture's own resolution."""
    height, width = luminance.shape
    theta = math.asin(np.clip(direction[2], -1, 1))
    rows = (np.array([theta - wide, theta + wide]) / np.pi + 0.5) * height
    rows = np.arange(max(math.floor(rows[0]), 0), min(math.ceil(rows[1]) + 1, height))
    part = luminance[rows]
    v = (rows + 0.5) / height
    columns = np.arange(width)
    lean = max(math.cos(theta) - wide, 0.0)
    if lean > wide:  # away from the poles a few columns hold it
        around = (0.5 - math.atan2(direction[1], direction[0]) / (2 * np.pi)) * width
        half = math.ceil(wide / lean / (2 * np.pi) * width) + 1
        columns = np.arange(math.floor(around) - half, math.ceil(around) + half + 1) % width
        part = part[:, columns]
    directions = _pixel_directions(*np.meshgrid((columns + 0.5) / width, v))
    weight = part * np.cos((v - 0.5) * np.pi)[:, None]
    weight = weight * ((directions @ direction > math.cos(wide)) & (part >= 0.1 * part.max()))
    middle = (directions * weight[..., None]).sum((0, 1))
    middle /= np.linalg.norm(middle)
    away = np.arccos(np.clip(directions @ middle, -1, 1)).ravel()
    order = np.argsort(away)
    shares = np.cumsum(weight.ravel()[order])
    radius = away[order][np.searchsorted(shares, 0.95 * shares[-1])]
    return middle, 2 * (radius + np.pi / height)  # and a pixel, for interpolation


#: Spots by image: a large picture takes half a second. Nothing tells when pixels are painted.
_spots = {}


def _image_spots(image):
    key = (image.name_full, image.filepath, tuple(image.size), image.source)
    if key not in _spots:
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        if len(pixels) == 0 or len(pixels) != len(image.pixels):
            return []
        image.pixels.foreach_get(pixels)
        pixels = pixels.reshape(height, width, image.channels)
        luminance = pixels[..., 0]
        if image.channels >= 3:
            luminance = pixels[..., :3] @ _LUMINANCE.astype(np.float32)
        luminance = np.nan_to_num(np.maximum(luminance, 0), posinf=0.0)
        if not image.is_float:  # near enough to sRGB to find what is bright
            luminance = luminance**2.2
        _spots[key] = bright_spots(luminance)
    return _spots[key]


def _sky(world, node, strength):
    """The sun of a Sky Texture."""
    name = f"sun of {node.label or node.name}"
    path = f'node_tree.nodes["{bpy.utils.escape_identifier(node.name)}"].'
    power = _SKY_SUN_IRRADIANCE * strength * node.sun_intensity
    constant = node.id_data != world.node_tree
    elevation, rotation, size = (
        getattr(node, p) if constant else _Driven(world, path + p)
        for p in ("sun_elevation", "sun_rotation", "sun_size")
    )
    values = _slot(SKY_SUN, turn=(elevation, rotation, 0.0), sizes=(size, 0.0))
    candidate = _Candidate(name, values, lambda p: np.full(len(p), power))
    if node.inputs["Vector"].is_linked:
        candidate.why = "its vector is linked, so where it stands is not known"
    return candidate


def _environment(node, strength):
    """The bright spots of an Environment Texture."""
    if node.image is None:
        return
    name = node.image.name
    turn = _turn_of(node) if node.projection == "EQUIRECTANGULAR" else None
    for index, (direction, angle, irradiance) in enumerate(_image_spots(node.image)):
        which = f"{name}, bright spot {index + 1}"
        power = irradiance * strength
        candidate = _Candidate(which, None, lambda p, power=power: np.full(len(p), power))
        back = None
        if turn is not None and abs(turn.determinant()) > 1e-9:
            back = turn.inverted() @ Vector(direction)
        if back is None or back.length < 1e-9:
            candidate.why = "its vector or projection is not one that can be followed"
        else:
            quaternion, w = _turned(back)
            candidate.values = _slot(SUN, turn=quaternion, scale=(1, 1, w), sizes=(angle, 0.0))
        yield candidate


def _world(world):
    tree = _tree(world) if world is not None else None
    if tree is None or world.cycles.sampling_method == "NONE":
        return
    output = _output(tree, "ShaderNodeOutputWorld")
    if output is None:
        return
    seen = []
    for background in _upstream(output.inputs["Surface"]):
        if background.bl_idname not in {"ShaderNodeBackground", "ShaderNodeEmission"}:
            continue
        socket = background.inputs["Strength"]
        strength = 1.0 if socket.is_linked else socket.default_value
        if strength <= 0 and not _animated(tree):
            continue
        for node in _upstream(background.inputs["Color"]):
            if node in seen:
                continue
            seen.append(node)
            if node.bl_idname == "ShaderNodeTexEnvironment":
                yield from _environment(node, strength)
            elif node.bl_idname == "ShaderNodeTexSky":
                if node.sky_type in _SKIES_WITH_SUN and node.sun_disc:
                    yield _sky(world, node, strength)


# ---- lamps that objects place ----


def _places_lamps(item, depth=0):
    """Whether an object places copies of lamps."""

    def lights(collection):
        return collection is not None and any(
            o.type == "LIGHT" or (depth < 4 and _places_lamps(o, depth + 1))
            for o in collection.all_objects
        )

    if item.instance_type == "COLLECTION":
        return lights(item.instance_collection)
    if item.instance_type in {"VERTS", "FACES"}:
        return any(child.type == "LIGHT" for child in item.children)
    for modifier in item.modifiers:
        if modifier.type == "NODES" and modifier.node_group is not None:
            for key in modifier.keys():  # noqa: SIM118 (a modifier is no dict)
                value = modifier[key]
                if isinstance(value, bpy.types.Collection) and lights(value):
                    return True
                if isinstance(value, bpy.types.Object) and value.type == "LIGHT":
                    return True
    return False


def _instances(depsgraph, instancers):
    for instance in depsgraph.object_instances:
        item = instance.object
        if not instance.is_instance or item.type != "LIGHT" or item.hide_render:
            continue
        parent = instance.parent
        if parent is None or parent.original.hide_render or not _is_lamp(item.data):
            continue
        light, matrix = item.data.original, instance.matrix_world.copy()
        yield _Candidate(
            f"{parent.name}/{item.name}",
            _light_values(light, None, matrix),
            _light_irradiance(light, matrix),
        )


# ---- all of it ----


def _subject(scene, meshes, matrices):
    """Points by which lamps are ranked: centres of the four meshes that are nearest to the camera
    and in its view, else of all meshes."""
    if not meshes:
        return np.zeros((1, 3))
    centres = np.array(
        [matrices(o) @ (sum((Vector(c) for c in o.bound_box), Vector()) / 8) for o in meshes]
    )
    camera = scene.camera
    if camera is not None and camera.type == "CAMERA":
        matrix, data = matrices(camera), camera.data
        to = centres - np.array(matrix.translation)
        depth = to @ -np.array(matrix.col[2].to_3d().normalized())
        aside = np.sqrt(np.maximum((to**2).sum(-1) - depth**2, 0))
        # A cone around the frame; what is larger than the frame has its centre elsewhere.
        if data.type == "ORTHO":
            seen = aside < 0.75 * data.ortho_scale
        else:
            seen = aside < 1.5 * math.tan(min(data.angle, 3.0) / 2) * depth
        seen &= depth > 0
        if seen.any():
            order = np.argsort((to**2).sum(-1) + np.where(seen, 0, np.inf))
            return centres[order[: min(4, seen.sum())]]
    return centres.mean(0)[None]


def _look(scene, depsgraph, subject=None):
    """A _Survey of a scene. `subject`: points of an earlier one, which need no looking for."""
    survey = _Survey(subject=subject)

    def matrices(item):
        return item.evaluated_get(depsgraph).matrix_world if depsgraph else item.matrix_world

    survey.emission = {m.name_full: _emission(m) for m in bpy.data.materials}
    emitting = {m: e for m in bpy.data.materials if (e := survey.emission[m.name_full]) > 0}
    meshes = []
    for item in _rendered(scene):
        kind = item.type
        if kind == "LIGHT":
            if not _hidden(item) and _is_lamp(item.data):
                matrix = matrices(item).copy()
                survey.kinds[item.name_full] = _kind(matrix)
                survey.candidates.append(
                    _Candidate(
                        item.name,
                        _light_values(item.data, item, matrix),
                        _light_irradiance(item.data, matrix),
                    )
                )
        elif kind in _MESHES:
            if item.hide_render:
                continue
            glows = emitting and any(s.material in emitting for s in item.material_slots)
            if glows and (made := _mesh(item, emitting, matrices(item).copy(), depsgraph)):
                survey.glowing.add(item.name_full)
                survey.candidates.append(made)
            elif subject is None:
                meshes.append(item)
        if (kind == "EMPTY" or kind == "MESH") and _places_lamps(item):
            survey.instancers.add(item.name_full)
    if survey.instancers and depsgraph:
        survey.candidates += _instances(depsgraph, survey.instancers)
    survey.candidates += _world(scene.world)
    if survey.subject is None:
        survey.subject = _subject(scene, meshes, matrices)
    for candidate in survey.candidates:
        _judge(candidate, survey.subject)
        candidate.rank = float(np.mean(candidate.irradiance(survey.subject)))
    survey.candidates.sort(key=lambda c: (-c.rank, c.name))
    return survey


# ---- the group ----


def _make_group():
    group = bpy.data.node_groups.new(GROUP, "ShaderNodeTree")
    group[TAG] = 1
    group.description = "Where the lamps are: what forms aim at. Kept current by brdfc"
    end = group.nodes.new("NodeGroupOutput")
    end.location = (300, 0)
    for index, name in enumerate(part_names(SLOTS)):
        group.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketVector")
        node = group.nodes.new("ShaderNodeCombineXYZ")
        node.name = node.label = name
        node.hide = True
        node.location = (0, -40 * index)
        group.links.new(node.outputs[0], end.inputs[name])
    return group


def _own_groups():
    return [g for g in bpy.data.node_groups if g.library is None and TAG in g]


def find_group():
    """The shared group of the open file, or None."""
    group = bpy.data.node_groups.get((GROUP, None))
    if group is not None and TAG in group:
        return group
    return next(iter(_own_groups()), None)


def ensure_group():
    """The shared group, made and filled from the window's scene if the file has none."""
    group = find_group()
    if group is None:
        group = _make_group()
        if scene := _current():
            _fill(scene, depsgraph=_depsgraph(scene))
    return group


def remove_unused_group():
    """Takes the shared group out of the file when no shader has it."""
    for group in _own_groups():
        if group.users == 0:
            bpy.data.node_groups.remove(group)


def _one_group():
    """The shared group; copies, which come with appended materials, give way to it."""
    group = find_group()
    for other in _own_groups():
        if other != group:
            other.user_remap(group)
            bpy.data.node_groups.remove(other)
    return group


def _sockets(group):
    """[(socket, data path)] of the numbers of all slots, twelve a slot."""
    found = []
    for name in part_names(SLOTS):
        for index, socket in enumerate(group.nodes[name].inputs):
            found.append((socket, f'nodes["{name}"].inputs[{index}].default_value'))
    return found


def _written(group, sockets):
    """What the group's numbers are now: floats and _Driven; None for a driver of someone else."""
    drivers = {}
    if group.animation_data is not None:
        drivers = {curve.data_path: curve for curve in group.animation_data.drivers}
    values = []
    for socket, path in sockets:
        curve = drivers.get(path)
        values.append(socket.default_value if curve is None else _read(curve))
    return values


def _read(curve):
    driver = curve.driver
    if len(driver.variables) != 1 or not curve.is_valid:
        return None
    variable = driver.variables[0]
    target = variable.targets[0]
    if target.id is None:
        return None
    channel = variable.type == "TRANSFORMS"
    path = target.transform_type if channel else target.data_path
    factor = curve.modifiers[0].coefficients[1] if curve.modifiers else 1.0
    return _Driven(target.id, path, factor)


_ID_TYPES = {bpy.types.Light: "LIGHT", bpy.types.World: "WORLD", bpy.types.Object: "OBJECT"}


def _write(socket, value):
    socket.driver_remove("default_value")
    if not isinstance(value, _Driven):
        socket.default_value = value
        return
    curve = socket.driver_add("default_value")
    curve.driver.type = "AVERAGE"
    variable = curve.driver.variables.new()
    if value.is_channel:
        variable.type = "TRANSFORMS"
        target = variable.targets[0]
        target.id = value.of
        target.transform_type = value.path
        target.transform_space = "WORLD_SPACE"
        target.rotation_mode = "QUATERNION"
    else:
        target = variable.targets[0]
        target.id_type = next(v for k, v in _ID_TYPES.items() if isinstance(value.of, k))
        target.id = value.of
        target.data_path = value.path
    if value.factor != 1.0:
        # 4.5 gives a driver's curve this modifier, later versions two keys on the diagonal.
        modifier = curve.modifiers[0] if curve.modifiers else curve.modifiers.new("GENERATOR")
        modifier.coefficients = (0.0, value.factor)


def _same(a, b):
    if isinstance(a, _Driven) or isinstance(b, _Driven):
        return (
            isinstance(a, _Driven)
            and isinstance(b, _Driven)
            and (a.of, a.path) == (b.of, b.path)
            and math.isclose(a.factor, b.factor, rel_tol=1e-5)
        )
    # Sockets hold single precision.
    return a is not None and b is not None and math.isclose(a, b, rel_tol=1e-5, abs_tol=1e-6)


def _all_same(a, b):
    return all(map(_same, a, b))


def _arranged(chosen, before):
    """The chosen lamps in the order of slots: each stays where it is if the list has it already, so
    that a lamp more or less changes one slot."""
    slots, rest = [None] * SLOTS, []
    for candidate in chosen:
        places = [i for i in range(len(chosen)) if slots[i] is None]
        kept = next((i for i in places if _all_same(candidate.values, before[i])), None)
        if kept is None:
            rest.append(candidate)
        else:
            slots[kept] = candidate
    for candidate in rest:
        slots[slots.index(None)] = candidate
    return slots[: len(chosen)]


def _chosen(survey):
    return [c for c in survey.candidates if not c.why][:SLOTS]


def _listed(survey, chosen=None):
    """[Lamp] of a survey, those that have a slot first."""
    chosen = _chosen(survey) if chosen is None else chosen
    taken = {id(c) for c in chosen}
    return [Lamp(c.name, slot, c.rank) for slot, c in enumerate(chosen, 1)] + [
        Lamp(c.name, None, c.rank, c.why or too_many(SLOTS))
        for c in survey.candidates
        if id(c) not in taken
    ]


#: What the last look at the window's scene found; see _concerns().
_memory = SimpleNamespace(scene=None, survey=_Survey(), lamps=[])
_busy = False
#: The scene of which a picture is being made.
_rendering = None


def _fill(scene, depsgraph, subject=None, keep=True):
    """Brings the shared group, if there is one, up to date; returns [Lamp]. `keep`: lamps stay in
    their slots; else the brightest come first."""
    survey = _look(scene, depsgraph, subject)
    chosen = _chosen(survey)
    if group := _one_group():
        sockets = _sockets(group)
        now = _written(group, sockets)
        size = 3 * len(PARTS)
        before = [now[size * i : size * (i + 1)] for i in range(SLOTS)]
        if keep:
            chosen = _arranged(chosen, before)
        empty = (0.0,) * size
        wanted = [v for c in chosen for v in c.values] + [*empty] * (SLOTS - len(chosen))
        for (socket, _), old, new in zip(sockets, now, wanted, strict=True):
            # Only what changed: shaders are compiled anew otherwise, and handlers called again.
            if not _same(old, new):
                _write(socket, new)
    lamps = _listed(survey, chosen)
    _memory.scene, _memory.survey, _memory.lamps = scene.session_uid, survey, lamps
    return lamps


# ---- who calls it ----


def _current():
    """The scene that the shared group follows: that of the first window."""
    windows = bpy.context.window_manager.windows if bpy.context.window_manager else ()
    return windows[0].scene if len(windows) else bpy.context.scene


def _depsgraph(scene):
    """The evaluated scene, brought up to date."""
    layer = scene.view_layers[0]
    for window in bpy.context.window_manager.windows if bpy.context.window_manager else ():
        if window.scene == scene:
            layer = window.view_layer
            break
    # A window's scene is up to date, and may be in use by the viewport while a picture is made.
    if bpy.app.background or layer.depsgraph is None:
        layer.update()
    return layer.depsgraph


def _quietly(scene, depsgraph=None, **options):
    """_fill() where handlers that it sets off find nothing to do."""
    global _busy
    if _busy:
        return []
    _busy = True
    try:
        return _fill(scene, depsgraph or _depsgraph(scene), **options)
    finally:
        _busy = False


def see(scene):
    """Fills the slots of the shared group from a scene, the brightest lamp first, and looks at
    environment images anew. Returns every lamp of the scene as a Lamp, those with a slot first."""
    _spots.clear()
    return _quietly(scene, keep=False)


def seen(scene):
    """What the last look at a scene found: for panels, which change nothing."""
    if _memory.scene == scene.session_uid:
        return _memory.lamps
    return _listed(_look(scene, scene.view_layers[0].depsgraph))


def count():
    """How many slots the scenes of the open file need."""
    surveys = [_look(scene, _depsgraph(scene)) for scene in bpy.data.scenes]
    return max(len(_chosen(survey)) for survey in surveys)


def _concerns(update, scene):
    """Whether an update of the dependency graph may change what belongs into the slots."""
    item, survey = update.id, _memory.survey
    if isinstance(item, bpy.types.Object):
        if item.type == "LIGHT":
            moved = update.is_updated_transform and not update.is_updated_geometry
            if not moved:
                return True
            # Drivers follow it; what they can't follow or what is ranked needs another look.
            kind = survey.kinds.get(item.original.name_full)
            return (
                _kind(item.matrix_world) != kind
                or (kind is not None and kind[1])
                or item.original.name_full in survey.instancers
                or len(survey.candidates) > SLOTS
            )
        name = item.original.name_full
        if name in survey.glowing or name in survey.instancers:
            return True
        if item.type == "EMPTY":
            return update.is_updated_geometry and item.instance_type != "NONE"
        if update.is_updated_geometry and item.type in _MESHES:
            return any(
                s.material and survey.emission.get(s.material.name_full, 0.0) > 0
                for s in item.material_slots
            )
        return False
    if isinstance(item, bpy.types.Material):
        return _emission(item.original) != survey.emission.get(item.original.name_full, 0.0)
    if isinstance(item, bpy.types.NodeTree):
        # Materials come with an update of their own.
        return scene.world is not None and item.original == scene.world.node_tree
    return isinstance(
        item, bpy.types.Light | bpy.types.World | bpy.types.Scene | bpy.types.Collection
    )


@persistent
def _after_update(scene, depsgraph):
    # The picture of another scene must not lose its lamps to the window's.
    if _busy or _rendering or find_group() is None or scene != _current():
        return
    if _memory.scene != scene.session_uid:
        _quietly(scene, depsgraph)
        return
    updates = list(depsgraph.updates)
    if not any(_concerns(update, scene) for update in updates):
        return
    structural = any(isinstance(u.id, bpy.types.Scene | bpy.types.Collection) for u in updates)
    _quietly(scene, depsgraph, subject=None if structural else _memory.survey.subject)


@persistent
def _after_frame(scene, depsgraph):
    if find_group() is not None and scene.session_uid in {_rendering, _current().session_uid}:
        _quietly(scene, depsgraph)


@persistent
def _before_render(scene, *_):
    global _rendering
    _rendering = scene.session_uid
    if find_group() is not None:
        _quietly(scene)


@persistent
def _now(*_):
    """A file was loaded or is to be saved, an undo or a picture is over."""
    global _rendering
    _rendering = _memory.scene = None
    if find_group() is not None and (scene := _current()):
        _quietly(scene)


_HANDLERS = {
    "depsgraph_update_post": _after_update,
    "frame_change_post": _after_frame,
    "render_init": _before_render,
    "render_pre": _before_render,
    "render_complete": _now,
    "render_cancel": _now,
    "save_pre": _now,
    "load_post": _now,
    "undo_post": _now,
    "redo_post": _now,
}


def register():
    for name, function in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(function)


def unregister():
    for name, function in _HANDLERS.items():
        if function in (handlers := getattr(bpy.app.handlers, name)):
            handlers.remove(function)
