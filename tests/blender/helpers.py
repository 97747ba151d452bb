# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes and pictures for tests."""

import contextlib
import csv
import inspect
import io
import json
import os
import subprocess
import sys
import tempfile
import zipfile
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np


def _models():
    """Entries of the manifest; the fixtures report if it is missing."""
    path = os.environ.get("BRDFC_EXTENSION_ZIP", "")
    if not Path(path).is_file():
        return {}
    with zipfile.ZipFile(path) as archive:
        return json.loads(archive.read("manifest.json"))["models"]


#: Models whose albedo no table can hold.
WITHOUT_ALBEDO = {m for m, e in _models().items() if e["scatter"] and e.get("albedo") is None}


def with_every_model(form, *cases):
    """Cases (model, values), plus the default values of each model with the form that has no case.

    So new models are measured without changing the tests. `form` None: any form.
    """
    models = _models()
    if not models:
        return list(cases)
    have_form = [m for m, e in models.items() if form is None or form in e["representations"]]
    covered = {model for model, _ in cases}
    present = [case for case in cases if case[0] in have_form]
    return present + [(model, {}) for model in have_form if model not in covered]


class Batch:
    """Measures all cases of a test in one render, when the first of them asks for its result.

    Only cases that this run of pytest selected are measured. If making the material of a case
    raises an exception, only that case fails.
    """

    def __init__(self):
        self.results = {}

    def result(self, request, measure):
        """The result of `measure(cases)` for the case of the running test. There is one batch for
        each combination of the test's other parameters."""

        def key(item):
            others = {k: v for k, v in item.callspec.params.items() if k not in ("model", "values")}
            return item.originalname, tuple(sorted((k, repr(v)) for k, v in others.items()))

        def case(item):
            return item.callspec.params["model"], item.callspec.params["values"]

        mine = key(request.node)
        if mine not in self.results:
            items = [i for i in request.session.items if hasattr(i, "callspec")]
            cases = [case(i) for i in items if key(i) == mine]
            self.results[mine] = list(zip(cases, measure(cases), strict=True))
        wanted = case(request.node)
        result = next(r for c, r in self.results[mine] if c == wanted)
        if isinstance(result, Exception):
            raise result
        return result


def materials_of(extension, form, cases):
    """A material for each case, or the exception that was raised when making it."""
    made = []
    for model, values in cases:
        try:
            made.append(extension.api.new_material(model, form, **values))
        except Exception as error:  # fails this case alone
            made.append(error)
    return made


def render(scene):
    """Renders the scene; returns (height, width, 4) float64, row 0 at the bottom."""
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode = "OPEN_EXR", "RGBA"
    settings.color_depth, settings.exr_codec = "32", "NONE"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True, scene=scene.name)
        return read_picture(path)


@contextlib.contextmanager
def compiled_once(scene):
    """Pictures that are rendered inside it, of the same objects with the same materials, share the
    compiled shaders: compiling takes longer than a small picture."""
    scene.render.use_persistent_data = True
    try:
        yield
    finally:
        # Nothing but a picture with other settings frees what Cycles keeps.
        scene.render.use_persistent_data = False


def open_image_io():
    """The OpenImageIO module in Blender."""
    import sys

    root = Path(bpy.utils.resource_path("LOCAL"))
    sys.path += [str(p) for p in root.glob("python/lib/python3.*/site-packages")]
    import OpenImageIO

    return OpenImageIO


#: The equivalent, for Blender as a module, of `blender --background FILE --engine CYCLES
#: --render-output PICTURE --render-frame FRAME` on a machine of a farm, with Blender's factory
#: settings.
FACTORY_RENDER = """
import sys
import bpy
blend, frame, folder = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.open_mainfile(filepath=blend)
assert not [a for a in bpy.context.preferences.addons if "brdfc" in a.module]
assert not [m for m in sys.modules if "brdfc" in m]
assert not bpy.app.autoexec_fail
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.render.filepath = folder + "/####"
scene.frame_start = scene.frame_end = int(frame)
bpy.ops.render.render(animation=True)
"""


def render_without_the_extension(blend, frame, folder):
    """Renders a frame of a saved file in a separate Blender without the extension."""
    log_without_the_extension(blend, folder, frame)
    return read_picture(folder / f"{frame:04}.exr")


def log_without_the_extension(blend, folder, frame=1):
    """What Cycles says while it renders a frame of a saved file in a separate Blender."""
    environment = os.environ | {
        "BLENDER_USER_RESOURCES": str(folder / "nothing"),
        "GLOG_v": "3",
        "GLOG_logtostderr": "1",
    }
    done = subprocess.run(
        [sys.executable, "-c", FACTORY_RENDER, blend, str(frame), folder],
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stderr


def render_passes(scene):
    """Renders the scene; returns every pass by name, (height, width, channels), row 0 at the
    bottom.

    Blender does not expose the pixels of a multilayer file; the OpenImageIO in it does.
    """
    oiio = open_image_io()
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # 5.0 on
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    settings.color_depth, settings.exr_codec = "32", "NONE"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True, scene=scene.name)
        image = oiio.ImageBuf(str(path))
        passes = {}
        for part in range(image.nsubimages):
            image = oiio.ImageBuf(str(path), part, 0)
            pixels = image.get_pixels(oiio.FLOAT)[::-1].astype(np.float64)
            for index, channel in enumerate(image.spec().channelnames):
                *_, name, letter = channel.split(".")
                passes.setdefault(name, {})[letter] = pixels[..., index]
        order = "RXUGYVBZA"
        return {
            name: np.stack([c[k] for k in sorted(c, key=lambda k: order.find(k))], -1)
            for name, c in passes.items()
        }


def read_picture(path):
    """Pixels of an EXR, unconverted; (height, width, 4), row 0 at the bottom."""
    image = bpy.data.images.load(str(path))
    try:
        image.colorspace_settings.name = "Non-Color"
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(image.size[1], image.size[0], 4).astype(np.float64)
    finally:
        bpy.data.images.remove(image)


def empty_tree(owner):
    """The node tree of a new material or world, emptied."""
    if owner.node_tree is None:
        owner.use_nodes = True  # deprecated in 5.0, where the tree exists from the start
    owner.node_tree.nodes.clear()
    return owner.node_tree


def show_albedo(material, node):
    """Leads the output Albedo of a model's node to the surface of its material, by an Emission
    node."""
    tree = material.node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(node.outputs["Albedo"], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])


def node_material(kind, **inputs):
    """A material of one of Blender's own nodes."""
    material = bpy.data.materials.new(kind)
    tree = empty_tree(material)
    node = tree.nodes.new(kind)
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


#: Pixels of three degrees: the lights of tests vary over ten degrees or more.
MAP_WIDTH = 128


def add_world(scene, strength=1.0):
    """Adds a white world; returns its node tree and the Background node."""
    world = bpy.data.worlds.new("World")
    scene.world = world
    # If the light varies, Cycles evaluates it once for each pixel of a map, 1024 x 512 by default,
    # which takes two seconds in Open Shading Language: longer than most pictures.
    world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", MAP_WIDTH
    tree = empty_tree(world)
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    background.inputs["Strength"].default_value = strength
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    return tree, background


def add_camera(scene, location=(0, -6, 0), rotation=(np.pi / 2, 0, 0), orthographic=None):
    data = bpy.data.cameras.new("Camera")
    if orthographic:
        data.type, data.ortho_scale = "ORTHO", orthographic
    scene.camera = bpy.data.objects.new("Camera", data)
    scene.camera.location, scene.camera.rotation_euler = location, rotation
    scene.collection.objects.link(scene.camera)
    return data


def add_balls_of_other_shaders(scene, api):
    """Materials that exporters see without the extension's help: a Principled node, "plain", and
    the same under a coat, "coated", both with a roughness of 0.25."""
    for name in ("plain", "coated"):
        principled = node_material("ShaderNodeBsdfPrincipled", Roughness=0.25, Metallic=1.0)
        principled.name = name
        add_sphere(scene, principled, segments=8)
    api.add_coat(bpy.data.materials["coated"])


def constant(tree, value):
    """The output of a new node: of a number, or of a color that may have any value."""
    if isinstance(value, tuple):
        node = tree.nodes.new("ShaderNodeCombineColor")
        for socket, channel in zip(node.inputs, value, strict=True):
            socket.default_value = channel
    else:
        node = tree.nodes.new("ShaderNodeValue")
        node.outputs[0].default_value = value
    return node.outputs[0]


def add_lamp(scene, kind="POINT", name="Lamp", location=(0, 0, 4), turn=(0, 0, 0), **settings):
    """Adds a lamp; `settings` are properties of its data, `turn` its Euler angles."""
    data = bpy.data.lights.new(name, kind)
    for key, value in settings.items():
        setattr(data, key, value)
    item = bpy.data.objects.new(name, data)
    item.location, item.rotation_euler = location, turn
    scene.collection.objects.link(item)
    return item


def add_sphere(scene, material, segments=32):
    import bmesh

    mesh = bpy.data.meshes.new("Sphere")
    build = bmesh.new()
    bmesh.ops.create_uvsphere(build, u_segments=segments, v_segments=segments // 2, radius=1)
    build.to_mesh(mesh)
    build.free()
    mesh.shade_smooth()
    mesh.materials.append(material)
    ball = bpy.data.objects.new("Sphere", mesh)
    scene.collection.objects.link(ball)
    return ball


def bend(mesh, normals):
    """Sets the shading normal of each face of the mesh to (x, y, z)."""
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    corners = [polygon.loop_total for polygon in mesh.polygons]
    mesh.normals_split_custom_set(np.repeat(normals, corners, axis=0).tolist())


def sphere_scene(scene, material, size=16, samples=16):
    """Adds a sphere in a white world that fills most of a small picture."""
    add_sphere(scene, material)
    add_camera(scene)
    add_world(scene)
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.cycles.samples = samples


def script_material(extension, name, source, surface="BSDF"):
    """A material of an OSL source whose output `surface` is connected."""
    text = bpy.data.texts.new(f"{name}.osl")
    text.write(source)
    material = bpy.data.materials.new(name)
    tree = empty_tree(material)
    script = tree.nodes.new("ShaderNodeScript")
    script.mode = "INTERNAL"
    import_module(f"{extension.package}.content.compiler").compile_script(script, text, name)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(script.outputs[surface], output.inputs["Surface"])
    material.cycles.use_bump_map_correction = False
    return material


def read_csv(text):
    """Columns of a CSV with a header line: (names, array of shape (rows, columns))."""
    names = next(csv.reader(io.StringIO(text)))
    return names, np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1, ndmin=2)


def to_csv(names, rows):
    # Formats whole rows of Python numbers: formatting takes longer than the tool's computation.
    line = ",".join(["%.17g"] * len(names))
    lines = [line % tuple(row) for row in np.asarray(rows, np.float64).tolist()]
    return "\n".join([",".join(names), *lines]) + "\n"


def arguments(values):
    """Parameters in the tool's notation."""
    return [
        f"{name}={','.join(map(str, v)) if isinstance(v, tuple | list) else v}"
        for name, v in values.items()
    ]


def pairs_csv(wi, wo):
    """Pairs of directions, each of shape (n, 3), in the tool's format."""
    header = ("wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z")
    return to_csv(header, np.hstack([wi, wo]))


def evaluate(tool, model, values, wi, wo):
    """f of the model, (n, 3), for directions of shape (n, 3) in the local frame."""
    text = tool("eval", model, *arguments(values), stdin=pairs_csv(wi, wo))
    return read_csv(text)[1][:, :3]


def albedo_and_mirror(tool, model, values, cosines, phi=0.0, error=1e-5):
    """Directional albedo of the model by quadrature, and the weight of its mirror term, which the
    albedo includes; (n, 3) each. `error`: below what pictures show; a hundredth of it takes up to
    ten times as long."""
    stdin = to_csv(("cos_theta_o",), np.reshape(cosines, (-1, 1)))
    options = ("--phi", repr(float(phi)), "--error", repr(error))
    text = tool("albedo", model, *arguments(values), *options, stdin=stdin)
    rows = read_csv(text)[1]
    return rows[:, 1:4], rows[:, 4:7]


def albedo(tool, model, values, cosines, phi=0.0, error=1e-5):
    """Directional albedo of the model by quadrature, (n, 3)."""
    return albedo_and_mirror(tool, model, values, cosines, phi, error)[0]


def draw(tool, model, values, wo, count):
    """Directions sampled from the model in double precision, each with its contribution to the
    integral of f cos."""
    # Additive recurrence based on the plastic number's analogue in three dimensions: low
    # discrepancy.
    root = 1.2207440846057596
    u = (0.5 + np.outer(np.arange(count), [1 / root, 1 / root**2, 1 / root**3])) % 1.0
    header = ("wo_x", "wo_y", "wo_z", "u1", "u2", "u3")
    stdin = to_csv(header, np.hstack([np.broadcast_to(wo, (count, 3)), u]))
    rows = read_csv(tool("sample", model, *arguments(values), stdin=stdin))[1]
    return rows[:, :3], rows[:, 3:6] / count


def counts():
    """The number of data-blocks of each kind that the extension makes."""
    return {
        kind: len(getattr(bpy.data, kind))
        for kind in ("materials", "node_groups", "texts", "images")
    }


def modules_of_operators(extension):
    """The modules that define operators, one file per subject."""
    prefix = f"{extension.operators.__name__}."
    return [module for name, module in sys.modules.items() if name.startswith(prefix)]


class Stand:
    """Replaces an operator; records what it reports."""

    def __init__(self, operator):
        self.reports, self.kind = [], operator

    def report(self, kind, text):
        self.reports.append((kind, text))

    def __getattr__(self, name):
        found = getattr(self.kind, name)
        return found.__get__(self) if inspect.isfunction(found) else found


class Layout:
    """Replaces a UILayout; records what is drawn, and the names of disabled operators."""

    def __init__(self, log=None, greyed=None, enabled=True):
        self.log = log if log is not None else []
        self.greyed = greyed if greyed is not None else set()
        self.alert = self.use_property_split = False
        self.enabled = enabled

    def label(self, text="", **_):
        self.log.append(text)

    def _sub(self, **_):
        return Layout(self.log, self.greyed, self.enabled)

    row = column = box = grid_flow = _sub

    def separator(self, **_):
        pass

    def template_icon(self, icon_value, scale):
        self.log.append(f"picture {scale:g}")

    def menu(self, name, **_):
        self.log.append(f"menu {name}")

    def operator(self, name, text="", **_):
        self.log.append(f"operator {name} {text}")
        if not self.enabled:
            self.greyed.add(name)
        return SimpleNamespace()

    def operator_menu_enum(self, name, choice, text="", **_):
        return self.operator(name, text)

    def prop(self, data, name, text="", **_):
        self.log.append(f"value {text}: {getattr(data, name)}")
