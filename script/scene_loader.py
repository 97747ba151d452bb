# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a Blender scene from a resolved scene file, which the reference renderer reads as well.

`brdfc scene S.json --out DIR` writes DIR/scene.json, where every shape is a mesh of arrays and
every procedural picture a file. Units and conventions are Blender's: metres, watts, z up.
"""

import json
import math
from importlib import import_module
from pathlib import Path

import bpy
from scene_file import View, build_mesh, camera, light, link, mesh_arrays, transform

#: Representation name of Blender's own Glossy node, with which run times are compared.
GLOSSY = "glossy"


def _image_node(tree, image):
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    node.interpolation, node.extension = "Linear", "REPEAT"
    return node


def _exponents(values):
    """Phong exponents along and across the tangent for Blender's Glossy node."""
    for u, v in (("nu", "nv"), ("e", "e"), ("n", "n")):
        if u in values and v in values:
            return values[u], values[v]
    return 0.0, 0.0


#: Blender's own nodes that can replace a model, by representation: node type, name of the colour.
NATIVE = {
    GLOSSY: ("ShaderNodeBsdfAnisotropic", "Color"),
    "principled": ("ShaderNodeBsdfPrincipled", "Base Color"),
    "metallic": ("ShaderNodeBsdfMetallic", "Base Color"),
}


def _object_tangent(tree, node):
    """The tangent of this project: the object's z axis along the surface."""
    axis = tree.nodes.new("ShaderNodeVectorTransform")
    axis.vector_type, axis.convert_from, axis.convert_to = "VECTOR", "OBJECT", "WORLD"
    axis.inputs["Vector"].default_value = (0, 0, 1)
    tree.links.new(axis.outputs[0], node.inputs["Tangent"])


class SceneLoader:
    """Loads scene files with the materials of one installed extension."""

    def __init__(self, package):
        """`package`: the name of the extension's package. Raises ImportError if it is none of
        brdfc."""
        self.package = package
        self.api = self.module("api")
        self.lamps = self.module("lamps")
        self.color = self.module("common.color")
        self.automatic = self.module("groups.automatic")
        self.nodes = self.module("groups.nodes")
        self.model_nodes = self.module("groups.model_nodes")
        self.pack = self.module("packs.pack")
        self.parameter_values = self.module("packs.parameter_values")

    def module(self, name):
        """A module of the extension."""
        return import_module(f"{self.package}.{name}")

    def _load_image(self, path, space="auto"):
        """Loads an image. `auto`: floats are linear, integers sRGB, as in the reference."""
        image = bpy.data.images.load(str(path), check_existing=True)
        linear = image.is_float if space == "auto" else space == "linear"
        if linear:
            # Data is not converted; the name of that colour space depends on the OpenColorIO
            # configuration.
            image.colorspace_settings.is_data = True
        else:
            self.color.set_srgb(image)
        return image

    def _environment(self, scene, view):
        world = bpy.data.worlds.new("World")
        scene.world = world
        tree = self.nodes.empty_tree(world)
        background = tree.nodes.new("ShaderNodeBackground")
        output = tree.nodes.new("ShaderNodeOutputWorld")
        tree.links.new(background.outputs[0], output.inputs["Surface"])
        background.inputs["Color"].default_value = (0, 0, 0, 1)
        if view is None:
            return
        background.inputs["Strength"].default_value = view.number_or("strength", 1.0)
        if view.has("image"):
            picture = tree.nodes.new("ShaderNodeTexEnvironment")
            picture.image = self._load_image(view.get("image").file_path())
            picture.interpolation = "Linear"
            tree.links.new(picture.outputs["Color"], background.inputs["Color"])
            # As fine as the picture; the automatic choice takes seconds for a map of 4096 x 2048.
            world.cycles.sampling_method = "MANUAL"
            world.cycles.sample_map_resolution = min(max(picture.image.size[0], 256), 4096)
        elif view.has("color"):
            background.inputs["Color"].default_value = (*view.color_or("color", [0.0] * 3), 1.0)
        else:
            raise view.error("an environment with color or image; resolve the scene first")

    def glossy_material(self, name, values):
        """A material of Blender's own Glossy node, as similar to a model's values as possible.

        It is the yardstick for run times: the node that artists have without the extension. An
        exponent n becomes the roughness that matches Ashikhmin and Shirley's distribution,
        (2 / (n + 2))^(1/4).
        """
        color = next((v for v in values.values() if isinstance(v, tuple)), (0.8, 0.8, 0.8))
        exponents = (float(n) if isinstance(n, int | float) else 100.0 for n in _exponents(values))
        alpha = [math.sqrt(2 / (n + 2)) for n in exponents]
        like = {"color": color, "alpha": alpha, "rotation": values.get("rotation", 0.0)}
        return self.native_material(name, GLOSSY, like, "ASHIKHMIN_SHIRLEY")[0]

    def native_material(self, name, kind, fitted, distribution="GGX"):
        """A material of one of Blender's own nodes; returns the material and the node.

        `fitted`: the result of script/native_nodes.py: colour, lobe widths along and across the
        tangent (0 for a mirror), rotation in radians, and for some kinds edge (a colour), ior and
        metallic."""
        material = bpy.data.materials.new(f"{name} ({kind})")
        tree = self.nodes.empty_tree(material)
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

    def _texture(self, view):
        if not isinstance(view.value, dict):
            return self._load_image(view.file_path())
        if not view.has("image"):
            raise view.error("a file or an image; resolve the scene first")
        space = view.get("colorspace").text() if view.has("colorspace") else "auto"
        if space not in {"auto", "linear", "srgb"}:
            raise view.get("colorspace").error("auto, linear or srgb")
        return self._load_image(view.get("image").file_path(), space)

    def _lambert(self, name, view):
        """A material of Blender's Diffuse node, which equals Lambert's model, for packs without
        that."""
        material = bpy.data.materials.new(name)
        tree = self.nodes.empty_tree(material)
        node = tree.nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = (0.8, 0.8, 0.8, 1.0)
        given = view.get("parameters") if view.has("parameters") else None
        for key, parameter in given.items() if given else ():
            if key != "rho":
                raise parameter.error("no parameter but rho")
            if isinstance(parameter.value, dict):
                picture = _image_node(tree, self._texture(parameter.get("texture")))
                tree.links.new(picture.outputs["Color"], node.inputs["Color"])
            else:
                color = given.color_or(key, None)
                if not all(0 <= channel <= 1 for channel in color):
                    raise parameter.error("numbers from 0 to 1")
                node.inputs["Color"].default_value = (*color, 1.0)
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        return material

    def _stack(self, name, view, key, representation):
        """A material of several models, which are added up or lie one over another."""
        if representation is None:
            representation = (
                view.get("representation").text() if view.has("representation") else "auto"
            )
        if representation in NATIVE:
            raise view.error(f"one model, to which Blender's {representation} node can be fitted")
        lobes = []
        for _, lobe in view.get(key).items():
            given = lobe.get("parameters") if lobe.has("parameters") else None
            values = {key: each.value for key, each in given.items()} if given else {}
            lobes.append((lobe.get("model").text(), values))
        try:
            make = self.api.new_sum if key == "sum" else self.api.new_layers
            return make(lobes, representation, name)
        except ValueError as error:
            raise ValueError(f"{view.file}: {view.path}: {error}") from error

    def _material(self, name, view, representation, native):
        for key in ("sum", "layers"):
            if view.has(key):
                return self._stack(name, view, key, representation)
        model = view.get("model").text()
        if (
            model == "lambert"
            and model not in self.pack.model_names()
            and representation not in NATIVE
        ):
            return self._lambert(name, view)
        if model not in self.pack.model_names():
            raise view.get("model").error(
                f"one of {', '.join(self.pack.model_names())}, which this pack has (brdfc build "
                "--scene makes a pack for a scene)"
            )
        values, textures = {}, {}
        if view.has("parameters"):
            for key, parameter in view.get("parameters").items():
                if isinstance(parameter.value, dict):
                    textures[key] = self._texture(parameter.get("texture"))
                else:
                    try:
                        values[key] = self.pack.model(model).check_value(key, parameter.value)
                    except ValueError as error:
                        raise ValueError(f"{view.file}: {parameter.path}: {error}") from error
        schema = self.pack.model(model).parameters
        defaults = self.parameter_values.canonical({n: p["default"] for n, p in schema.items()})
        defaults |= self.pack.model(model).fixed
        if representation is None:
            representation = (
                view.get("representation").text() if view.has("representation") else "auto"
            )
        if representation in NATIVE:
            if representation in (fitted := native.get(name, {})):
                material, node = self.native_material(name, representation, fitted[representation])
            elif representation == GLOSSY:
                material = self.glossy_material(name, defaults | values)
                node = material.node_tree.nodes["Glossy BSDF"]
            else:
                raise view.error(f"a material to which Blender's {representation} node was fitted")
            colors = [k for k, p in schema.items() if p["kind"] == "color"]
            targets = {colors[0]: node.inputs[NATIVE[representation][1]]} if colors else {}
        else:
            try:
                material = self.api.new_material(model, representation, **values)
            except ValueError as error:
                raise ValueError(f"{view.file}: {view.path}: {error}") from error
            node = self.model_nodes.group_nodes(material)[0]
            targets = self.model_nodes.sockets(node)
            unknown = set(textures) - set(targets)
            if unknown:
                raise view.error(f"no texture for {', '.join(sorted(unknown))}")
        material.name = name
        for key, image in textures.items():
            if key in targets:
                picture = _image_node(material.node_tree, image)
                material.node_tree.links.new(picture.outputs["Color"], targets[key])
        return material

    def apply_clean_settings(self, scene, samples=64, seed=1, max_bounces=8, osl=True):
        """Settings under which Cycles computes the light transport integral and nothing else.

        Linear float EXR, box-filtered pixels, CPU, OSL on or off; no filter glossy, clamping,
        denoising, adaptive sampling, light threshold, guiding or approximation.
        """
        cycles = scene.cycles
        if osl:
            self.api.enable_osl(scene)
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
            # To Cycles a lamp that a ray passes is a transparent surface; beyond this limit the
            # ray is lost.
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
        self.color.set_view(view, "Raw")
        view.look, view.exposure, view.gamma = "None", 0.0, 1.0

    def load_scene(self, path, representation=None, name=None, native=None, osl=True):
        """Makes a scene with clean settings from a resolved scene file: the active scene.

        `representation` overrides that of every material: auto, exact, sampled and so on, or
        "glossy", "principled" or "metallic" for Blender's own nodes. `native`: the nodes that
        script/native_nodes.py fitted, by material and node; only "glossy" works without. `osl`:
        whether Open Shading Language is on; without it "auto" is Blender's own nodes. Returns the
        bpy scene. Raises ValueError naming file and key.
        """
        path = Path(path)
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise ValueError(f"{path}: {error.strerror}") from error
        except ValueError as error:
            raise ValueError(f"{path}: not JSON: {error}") from error
        view = View(data, str(path))
        if view.has("working_space"):
            space = view.get("working_space")
            try:
                self.color.set_working_space(space.text())
            except ValueError as error:
                raise ValueError(f"{path}: {space.path}: {error}") from error
        scene = bpy.data.scenes.new(
            name or (view.get("name").text() if view.has("name") else path.stem)
        )
        if bpy.context.window is not None:
            bpy.context.window.scene = scene

        settings = view.get("settings")
        self.apply_clean_settings(
            scene,
            samples=int(settings.number_or("spp", 64)),
            seed=int(settings.number_or("seed", 1)),
            max_bounces=int(settings.number_or("max_bounces", 8)),
            osl=osl,
        )
        scene.render.resolution_x = int(settings.get("width").number())
        scene.render.resolution_y = int(settings.get("height").number())

        camera(scene, view.get("camera"))
        materials = {
            key: self._material(key, entry, representation, native or {})
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
                    mesh = build_mesh(label, **mesh_arrays(shape))
                mesh.materials.append(materials[material])
                of_shape[material] = mesh
            item = link(scene, label, mesh, transform(entry))
            if entry.flag("camera_only"):
                for ray in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
                    setattr(item, f"visible_{ray}", False)
        if view.has("lights"):
            for index, entry in view.get("lights").items():
                light(scene, index, entry)
        self._environment(scene, view.get("environment") if view.has("environment") else None)
        bpy.context.view_layer.update()
        self.automatic.follow(scene)
        if self.lamps.find_group() is not None:
            self.api.see_lamps(scene)
        return scene
