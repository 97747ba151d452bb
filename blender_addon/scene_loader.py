# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a Blender scene from a resolved scene file, which the reference renderer reads as well.

`brdfc scene S.json --out DIR` writes DIR/scene.json, where every shape is a mesh of arrays and
every procedural picture a file. Units and conventions are Blender's: metres, watts, z up.
"""

import json
import math
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

from . import api, automatic, color, lamps, nodes, pack

#: Representation name of Blender's own Glossy node, with which run times are compared.
GLOSSY = "glossy"


class _View:
    """A JSON value that knows its file and key, for error messages."""

    def __init__(self, value, file, path=""):
        self.value, self.file, self.path = value, file, path

    def error(self, expected):
        where = self.path or "the top level"
        return ValueError(f"{self.file}: {where}: expected {expected}, got {self.value!r:.80}")

    def _child(self, key):
        path = f"{self.path}.{key}" if self.path else str(key)
        return _View(self.value[key], self.file, path)

    def has(self, key):
        return isinstance(self.value, dict) and self.value.get(key) is not None

    def get(self, key):
        if not isinstance(self.value, dict):
            raise self.error("an object")
        if key not in self.value:
            raise self.error(f"an object with {key!r}")
        return self._child(key)

    def items(self):
        if isinstance(self.value, dict):
            return [(key, self._child(key)) for key in self.value]
        if isinstance(self.value, list):
            return [(index, self._child(index)) for index in range(len(self.value))]
        raise self.error("an object or a list")

    def number(self):
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.error("a number")
        return float(self.value)

    def text(self):
        if not isinstance(self.value, str):
            raise self.error("a text")
        return self.value

    def numbers(self, count):
        if not isinstance(self.value, list) or len(self.value) != count:
            raise self.error(f"{count} numbers")
        return [v.number() for _, v in self.items()]

    def vector(self):
        return Vector(self.numbers(3))

    def number_or(self, key, default):
        return self.get(key).number() if self.has(key) else default

    def flag(self, key):
        if not self.has(key):
            return False
        view = self.get(key)
        if not isinstance(view.value, bool):
            raise view.error("true or false")
        return view.value

    def color_or(self, key, default):
        if not self.has(key):
            return default
        view = self.get(key)
        return view.numbers(3) if isinstance(view.value, list) else [view.number()] * 3

    def file_path(self):
        path = Path(self.file).parent / self.text()
        if not path.is_file():
            raise ValueError(f"{self.file}: {self.path}: file {path} does not exist")
        return path


def _array(view, columns):
    path = view.file_path()
    try:
        data = np.load(path, allow_pickle=False)
    except ValueError as error:
        raise ValueError(f"{view.file}: {view.path}: {path}: {error}") from error
    if data.ndim != 2 or data.shape[1] != columns or not np.isfinite(data).all():
        raise ValueError(
            f"{view.file}: {view.path}: {path}: expected finite numbers of shape (n, {columns}), "
            f"got {data.shape}"
        )
    return data


def build_mesh(name, vertices, triangles, normals=None, uvs=None):
    """Mesh datablock from arrays: (n, 3) float, (m, 3) int, and per vertex (n, 3) and (n, 2).

    Normals are stored in single precision, unchanged. Without them the triangles are flat.
    """
    triangles = np.ascontiguousarray(triangles, np.int32)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.full(len(triangles), normals is not None))
    if uvs is not None:
        layer = mesh.uv_layers.new(name="UVMap")
        layer.uv.foreach_set("vector", np.ascontiguousarray(uvs, np.float32)[triangles].ravel())
    mesh.update(calc_edges=True)
    if normals is not None:
        # Blender's other way to store custom normals would round them to 16 bits.
        attribute = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
        attribute.data.foreach_set("vector", np.ascontiguousarray(normals, np.float32).ravel())
        mesh.update()
    return mesh


def _mesh_arrays(shape):
    """The arguments of build_mesh(), from the files that a shape names."""
    if shape.get("type").text() != "mesh" or not shape.has("vertices"):
        raise shape.error("a mesh of arrays; resolve the scene first")
    vertices = _array(shape.get("vertices"), 3)
    triangles = _array(shape.get("triangles"), 3)
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise shape.get("triangles").error(f"indices from 0 to {len(vertices) - 1}")
    extra = {
        key: _array(shape.get(key), columns) if shape.has(key) else None
        for key, columns in (("normals", 3), ("uvs", 2))
    }
    for key, array in extra.items():
        if array is not None and len(array) != len(vertices):
            raise shape.get(key).error(f"{len(vertices)} rows, one a vertex")
    return {"vertices": vertices, "triangles": triangles, **extra}


def _transform(view):
    if not view.has("transform"):
        return Matrix.Identity(4)
    view = view.get("transform")
    translate = view.get("translate").vector() if view.has("translate") else Vector()
    degrees = view.get("rotate_degrees").numbers(3) if view.has("rotate_degrees") else [0] * 3
    scale = view.color_or("scale", [1.0] * 3)  # a single number, or three
    rotation = Euler([math.radians(d) for d in degrees], "XYZ").to_matrix().to_4x4()
    return Matrix.Translation(translate) @ rotation @ Matrix.Diagonal((*scale, 1.0))


def _link(scene, name, data, matrix):
    item = bpy.data.objects.new(name, data)
    item.matrix_world = matrix
    scene.collection.objects.link(item)
    return item


def _aimed(position, direction, up=None):
    """Matrix of an object that looks along its own -z."""
    back = -direction.normalized()
    up = up if up is not None else Vector((0, 0, 1))
    if back.cross(up).length < 1e-6 * up.length:
        up = Vector((0, 1, 0)) if abs(back.y) < 0.9 else Vector((1, 0, 0))
    right = up.cross(back).normalized()
    matrix = Matrix((right, back.cross(right), back)).transposed().to_4x4()
    matrix.translation = position
    return matrix


def _camera(scene, view):
    data = bpy.data.cameras.new("Camera")
    data.sensor_fit = "VERTICAL"
    kind = view.get("type").text()
    if kind == "perspective":
        data.type, data.angle = "PERSP", math.radians(view.get("fov_y_degrees").number())
    elif kind == "orthographic":
        data.type, data.ortho_scale = "ORTHO", view.get("height").number()
    else:
        raise view.get("type").error("perspective or orthographic")
    position = view.get("position").vector()
    direction = view.get("look_at").vector() - position
    if direction.length == 0:
        raise view.get("look_at").error("another point than the camera's position")
    # In effect no clipping: the reference renderer has none.
    data.clip_start, data.clip_end = 1e-4, 1e6
    up = view.get("up").vector() if view.has("up") else None
    scene.camera = _link(scene, "Camera", data, _aimed(position, direction, up))


def _light(scene, index, view):
    kind = view.get("type").text()
    types = {"point": "POINT", "sun": "SUN", "area": "AREA", "disk": "AREA"}
    if kind not in types:
        raise view.get("type").error(f"one of {', '.join(types)}")
    data = bpy.data.lights.new(f"{kind}{index}", types[kind])
    data.use_shadow = True
    data.color = view.color_or("color", [1.0] * 3)
    position, direction = Vector(), Vector((0, 0, -1))
    if kind != "sun":
        position = view.get("position").vector()
        data.energy = view.get("power").number()
    if kind != "point":
        direction = view.get("direction").vector()
    if kind == "point":
        data.shadow_soft_size = view.number_or("radius", 0.0)
        data.use_soft_falloff = False  # a spherical light; Blender would soften it
    elif kind == "sun":
        data.energy = view.get("irradiance").number()
        data.angle = math.radians(view.number_or("angle_degrees", 0.0))
    else:
        size = view.get("size")
        sizes = size.numbers(2) if isinstance(size.value, list) else [size.number()] * 2
        data.shape = "RECTANGLE" if kind == "area" else "ELLIPSE"  # sizes are diameters
        data.size, data.size_y = sizes
    up = view.get("up").vector() if view.has("up") else None
    lamp = _link(scene, f"{kind}{index}", data, _aimed(position, direction, up))
    lamp.visible_camera = view.flag("camera_visible")


def _load_image(path, space="auto"):
    """Loads an image. `auto`: floats are linear, integers sRGB, as in the reference renderer."""
    image = bpy.data.images.load(str(path), check_existing=True)
    linear = image.is_float if space == "auto" else space == "linear"
    if linear:
        # Data is not converted; the name of that colour space depends on the OpenColorIO
        # configuration.
        image.colorspace_settings.is_data = True
    else:
        color.set_srgb(image)
    return image


def _image_node(tree, image):
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    node.interpolation, node.extension = "Linear", "REPEAT"
    return node


def _environment(scene, view):
    world = bpy.data.worlds.new("World")
    scene.world = world
    tree = nodes.empty_tree(world)
    background = tree.nodes.new("ShaderNodeBackground")
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    if view is None:
        return
    background.inputs["Strength"].default_value = view.number_or("strength", 1.0)
    if view.has("image"):
        picture = tree.nodes.new("ShaderNodeTexEnvironment")
        picture.image = _load_image(view.get("image").file_path())
        picture.interpolation = "Linear"
        tree.links.new(picture.outputs["Color"], background.inputs["Color"])
        # As fine as the picture; the automatic choice takes seconds for a map of 4096 x 2048.
        world.cycles.sampling_method = "MANUAL"
        world.cycles.sample_map_resolution = min(max(picture.image.size[0], 256), 4096)
    elif view.has("color"):
        background.inputs["Color"].default_value = (*view.color_or("color", [0.0] * 3), 1.0)
    else:
        raise view.error("an environment with color or image; resolve the scene first")


def _exponents(values):
    """Phong exponents along and across the tangent for Blender's Glossy node."""
    for u, v in (("nu", "nv"), ("e", "e"), ("n", "n")):
        if u in values and v in values:
            return values[u], values[v]
    return 0.0, 0.0


def glossy_material(name, values):
    """A material of Blender's own Glossy node, as similar to a model's values as possible.

    It is the yardstick for run times: the node that artists have without the extension. An exponent
    n becomes the roughness that matches Ashikhmin and Shirley's distribution, (2 / (n + 2))^(1/4).
    """
    color = next((v for v in values.values() if isinstance(v, tuple)), (0.8, 0.8, 0.8))
    exponents = (float(n) if isinstance(n, int | float) else 100.0 for n in _exponents(values))
    alpha = [math.sqrt(2 / (n + 2)) for n in exponents]
    like = {"color": color, "alpha": alpha, "rotation": values.get("rotation", 0.0)}
    return native_material(name, GLOSSY, like, "ASHIKHMIN_SHIRLEY")[0]


#: Blender's own nodes that can replace a model, by representation: node type, name of the colour.
NATIVE = {
    GLOSSY: ("ShaderNodeBsdfAnisotropic", "Color"),
    "principled": ("ShaderNodeBsdfPrincipled", "Base Color"),
    "metallic": ("ShaderNodeBsdfMetallic", "Base Color"),
}


def native_material(name, kind, fitted, distribution="GGX"):
    """A material of one of Blender's own nodes; returns the material and the node.

    `fitted`: the result of script/native_nodes.py: colour, lobe widths along and across the tangent
    (0 for a mirror), rotation in radians, and for some kinds edge (a colour), ior and metallic."""
    material = bpy.data.materials.new(f"{name} ({kind})")
    tree = nodes.empty_tree(material)
    bsdf, color = NATIVE[kind]
    node = tree.nodes.new(bsdf)
    node.distribution = distribution
    node.inputs[color].default_value = (*fitted["color"], 1.0)
    if "edge" in fitted:
        node.inputs["Edge Tint"].default_value = (*fitted["edge"], 1.0)
    if "ior" in fitted:
        node.inputs["IOR"].default_value = fitted["ior"]
        node.inputs["Metallic"].default_value = fitted["metallic"]
    ax, ay = fitted["alpha"]
    turns = fitted["rotation"] / (2 * math.pi)
    node.inputs["Roughness"].default_value = (ax * ay) ** 0.25
    if ax != ay and kind == GLOSSY:
        # In Cycles: ax = r^2 (1 - a), ay = r^2 / (1 - a) for a > 0, and the reverse for a < 0.
        ratio = math.sqrt(ax / ay)
        node.inputs["Anisotropy"].default_value = 1 - ratio if ratio <= 1 else 1 / ratio - 1
        node.inputs["Rotation"].default_value = turns
    elif ax != ay:
        # In Cycles: ay = (1 - 0.9 a) ax; the lobe is always wider along the tangent.
        if ax < ay:
            ax, ay, turns = ay, ax, turns + 0.25
        of = "Anisotropic" if kind == "principled" else "Anisotropy"
        node.inputs[of].default_value = (1 - ay / ax) / 0.9
        of = "Anisotropic Rotation" if kind == "principled" else "Rotation"
        node.inputs[of].default_value = turns % 1
    if ax != ay:
        _object_tangent(tree, node)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material, node


def _object_tangent(tree, node):
    """The tangent of this project: the object's z axis along the surface."""
    axis = tree.nodes.new("ShaderNodeVectorTransform")
    axis.vector_type, axis.convert_from, axis.convert_to = "VECTOR", "OBJECT", "WORLD"
    axis.inputs["Vector"].default_value = (0, 0, 1)
    tree.links.new(axis.outputs[0], node.inputs["Tangent"])


def _texture(view):
    if not isinstance(view.value, dict):
        return _load_image(view.file_path())
    if not view.has("image"):
        raise view.error("a file or an image; resolve the scene first")
    space = view.get("colorspace").text() if view.has("colorspace") else "auto"
    if space not in {"auto", "linear", "srgb"}:
        raise view.get("colorspace").error("auto, linear or srgb")
    return _load_image(view.get("image").file_path(), space)


def _lambert(name, view):
    """A material of Blender's Diffuse node, which equals Lambert's model, for packs without
    that."""
    material = bpy.data.materials.new(name)
    tree = nodes.empty_tree(material)
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    node.inputs["Color"].default_value = (0.8, 0.8, 0.8, 1.0)
    given = view.get("parameters") if view.has("parameters") else None
    for key, parameter in given.items() if given else ():
        if key != "rho":
            raise parameter.error("no parameter but rho")
        if isinstance(parameter.value, dict):
            picture = _image_node(tree, _texture(parameter.get("texture")))
            tree.links.new(picture.outputs["Color"], node.inputs["Color"])
        else:
            color = given.color_or(key, None)
            if not all(0 <= channel <= 1 for channel in color):
                raise parameter.error("numbers from 0 to 1")
            node.inputs["Color"].default_value = (*color, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def _material(name, view, representation, native):
    model = view.get("model").text()
    if model == "lambert" and model not in pack.model_names() and representation not in NATIVE:
        return _lambert(name, view)
    if model not in pack.model_names():
        raise view.get("model").error(
            f"one of {', '.join(pack.model_names())}, which this pack has (brdfc build --scene "
            "makes a pack for a scene)"
        )
    values, textures = {}, {}
    if view.has("parameters"):
        for key, parameter in view.get("parameters").items():
            if isinstance(parameter.value, dict):
                textures[key] = _texture(parameter.get("texture"))
            else:
                try:
                    values[key] = pack.check_value(model, key, parameter.value)
                except ValueError as error:
                    raise ValueError(f"{view.file}: {parameter.path}: {error}") from error
    defaults = pack.canonical({p["name"]: p["default"] for p in pack.parameters(model).values()})
    defaults |= pack.fixed(model)
    if representation is None:
        representation = view.get("representation").text() if view.has("representation") else "auto"
    if representation in NATIVE:
        if representation in (fitted := native.get(name, {})):
            material, node = native_material(name, representation, fitted[representation])
        elif representation == GLOSSY:
            material = glossy_material(name, defaults | values)
            node = material.node_tree.nodes["Glossy BSDF"]
        else:
            raise view.error(f"a material to which Blender's {representation} node was fitted")
        colors = [k for k, p in pack.parameters(model).items() if p["kind"] == "color"]
        targets = {colors[0]: node.inputs[NATIVE[representation][1]]} if colors else {}
    else:
        try:
            material = api.new_material(model, representation, **values)
        except ValueError as error:
            raise ValueError(f"{view.file}: {view.path}: {error}") from error
        node = nodes.group_nodes(material)[0]
        targets = nodes.sockets(node)
        unknown = set(textures) - set(targets)
        if unknown:
            raise view.error(f"no texture for {', '.join(sorted(unknown))}")
    material.name = name
    for key, image in textures.items():
        if key in targets:
            picture = _image_node(material.node_tree, image)
            material.node_tree.links.new(picture.outputs["Color"], targets[key])
    return material


def apply_clean_settings(scene, samples=64, seed=1, max_bounces=8, osl=True):
    """Settings under which Cycles computes the light transport integral and nothing else.

    Linear float EXR, box-filtered pixels, CPU, OSL on or off; no filter glossy, clamping,
    denoising, adaptive sampling, light threshold, guiding or approximation.
    """
    cycles = scene.cycles
    if osl:
        api.enable_osl(scene)
    else:
        scene.render.engine, cycles.shading_system = "CYCLES", False
    settings = {
        "device": "CPU",
        "samples": samples,
        "seed": seed,
        "use_animated_seed": False,
        "use_adaptive_sampling": False,
        "use_denoising": False,
        "time_limit": 0.0,
        "pixel_filter_type": "BOX",
        "blur_glossy": 0.0,
        "caustics_reflective": True,
        "caustics_refractive": True,
        "sample_clamp_direct": 0.0,
        "sample_clamp_indirect": 0.0,
        "light_sampling_threshold": 0.0,
        "use_fast_gi": False,
        "use_guiding": False,
        "max_bounces": max_bounces,
        "diffuse_bounces": max_bounces,
        "glossy_bounces": max_bounces,
        "transmission_bounces": max_bounces,
        # To Cycles a lamp that a ray passes is a transparent surface; beyond this limit the ray is
        # lost.
        "transparent_max_bounces": 1024,
        "min_light_bounces": 0,
        "min_transparent_bounces": 0,
        "film_exposure": 1.0,
        "auto_scrambling_distance": False,
        "scrambling_distance": 1.0,
    }
    for name, value in settings.items():
        setattr(cycles, name, value)
    render = scene.render
    render.use_motion_blur = False
    render.use_simplify = False
    render.dither_intensity = 0
    render.film_transparent = False
    render.use_compositing = render.use_sequencer = False
    render.resolution_percentage = 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode = "RGBA"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "ZIP"
    view = scene.view_settings
    color.set_view(view, "Raw")
    view.look, view.exposure, view.gamma = "None", 0.0, 1.0


def load_scene(path, representation=None, name=None, native=None, osl=True):
    """Makes a scene with clean settings from a resolved scene file, and makes it the active one.

    `representation` overrides that of every material: auto, exact, sampled and so on, or "glossy",
    "principled" or "metallic" for Blender's own nodes. `native`: the nodes that
    script/native_nodes.py fitted, by material and node; only "glossy" works without. `osl`: whether
    Open Shading Language is on; without it "auto" is Blender's own nodes. Returns the bpy scene.
    Raises ValueError naming file and key.
    """
    path = Path(path)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise ValueError(f"{path}: not JSON: {error}") from error
    view = _View(data, str(path))
    if view.has("working_space"):
        space = view.get("working_space")
        try:
            color.set_working_space(space.text())
        except ValueError as error:
            raise ValueError(f"{path}: {space.path}: {error}") from error
    scene = bpy.data.scenes.new(
        name or (view.get("name").text() if view.has("name") else path.stem)
    )
    if bpy.context.window is not None:
        bpy.context.window.scene = scene

    settings = view.get("settings")
    apply_clean_settings(
        scene,
        samples=int(settings.number_or("spp", 64)),
        seed=int(settings.number_or("seed", 1)),
        max_bounces=int(settings.number_or("max_bounces", 8)),
        osl=osl,
    )
    scene.render.resolution_x = int(settings.get("width").number())
    scene.render.resolution_y = int(settings.get("height").number())

    _camera(scene, view.get("camera"))
    materials = {
        key: _material(key, entry, representation, native or {})
        for key, entry in view.get("materials").items()
    }
    # Objects of equal shape and material share a mesh, so that Cycles stores it once.
    meshes = {}
    for index, entry in view.get("objects").items():
        shape = entry.get("shape")
        label = entry.get("name").text() if entry.has("name") else f"object{index}"
        material = entry.get("material").text()
        if material not in materials:
            raise entry.get("material").error(f"one of {', '.join(materials)}")
        of_shape = meshes.setdefault(json.dumps(shape.value, sort_keys=True), {})
        mesh = of_shape.get(material)
        if mesh is None:
            if of_shape:
                mesh = next(iter(of_shape.values())).copy()
                mesh.name = label
                mesh.materials.clear()
            else:
                mesh = build_mesh(label, **_mesh_arrays(shape))
            mesh.materials.append(materials[material])
            of_shape[material] = mesh
        item = _link(scene, label, mesh, _transform(entry))
        if entry.flag("camera_only"):
            for ray in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
                setattr(item, f"visible_{ray}", False)
    if view.has("lights"):
        for index, entry in view.get("lights").items():
            _light(scene, index, entry)
    _environment(scene, view.get("environment") if view.has("environment") else None)
    bpy.context.view_layer.update()
    automatic.follow(scene)
    if lamps.find_group() is not None:
        api.see_lamps(scene)
    return scene
