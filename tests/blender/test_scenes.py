# SPDX-License-Identifier: GPL-3.0-or-later
"""The loader of resolved scenes, and the renderer script."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
from helpers import open_image_io, read_picture, render

DRIVER = Path(__file__).parents[2] / "script" / "render_scene.py"
SCENES = Path(__file__).parents[2] / "scenes"


def quad(size):
    h = size / 2
    return (
        np.float32([[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]]),
        np.int32([[0, 1, 2], [0, 2, 3]]),
        np.float32([[0, 0], [1, 0], [1, 1], [0, 1]]),
    )


def sphere(segments=64, rings=32):
    phi, theta = np.meshgrid(
        np.linspace(0, 2 * np.pi, segments + 1), np.linspace(np.pi, 0, rings + 1)
    )
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    index = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    a, b, c, d = (
        i.ravel() for i in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1])
    )
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    vertices = points.reshape(-1, 3).astype(np.float32)
    # At the poles, one triangle of each pair has no area.
    corners = vertices[triangles]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return vertices, triangles[area > 1e-7].astype(np.int32)


@pytest.fixture
def scene_file(tmp_path):
    """Writes a resolved scene and returns its path. Keywords replace parts of a lit white floor."""
    vertices, triangles, uvs = quad(20)
    np.save(tmp_path / "floor_v.npy", vertices)
    np.save(tmp_path / "floor_t.npy", triangles)
    np.save(tmp_path / "floor_uv.npy", uvs)
    vertices, triangles = sphere()
    np.save(tmp_path / "ball_v.npy", vertices)
    np.save(tmp_path / "ball_t.npy", triangles)

    def write(**parts):
        data = {
            "name": "floor",
            "settings": {"width": 9, "height": 9, "spp": 16, "seed": 3, "max_bounces": 0},
            "camera": {
                "type": "perspective",
                "position": [0, 0, 4],
                "look_at": [0, 0, 0],
                "up": [0, 1, 0],
                "fov_y_degrees": 1,
            },
            "materials": {
                "white": {"model": "lambert", "parameters": {"rho": 0.5}, "representation": "auto"}
            },
            "objects": [floor()],
            "lights": [],
            "environment": {"color": [0, 0, 0], "strength": 1},
        }
        path = tmp_path / "scene.json"
        path.write_text(json.dumps(data | parts))
        return path

    return write


def floor(**more):
    return {
        "name": "floor",
        "shape": {
            "type": "mesh",
            "vertices": "floor_v.npy",
            "triangles": "floor_t.npy",
            "uvs": "floor_uv.npy",
        },
        "transform": {"translate": [0, 0, 0], "rotate_degrees": [0, 0, 0], "scale": [1, 1, 1]},
        "material": "white",
    } | more


def ball(**more):
    shape = {
        "type": "mesh",
        "vertices": "ball_v.npy",
        "normals": "ball_v.npy",
        "triangles": "ball_t.npy",
    }
    return {"name": "ball", "shape": shape, "material": "white"} | more


# Radiance of a Lambertian floor with reflectance 1/2 straight below each lamp, by the conventions.
POWER, HEIGHT = 100.0, 5.0
LAMPS = {
    "point": (
        {"type": "point", "position": [0, 0, HEIGHT], "power": POWER, "radius": 0},
        POWER / (4 * math.pi) / HEIGHT**2,
    ),
    "sphere": (
        {"type": "point", "position": [0, 0, HEIGHT], "power": POWER, "radius": 0.5},
        POWER / (4 * math.pi) / HEIGHT**2,
    ),
    "sun": ({"type": "sun", "direction": [0, 0, -1], "irradiance": 2.0, "angle_degrees": 0}, 2.0),
    "sun of 20 degrees": (
        {"type": "sun", "direction": [0, 0, -1], "irradiance": 2.0, "angle_degrees": 20},
        2.0,
    ),
    "oblique sun": (
        {"type": "sun", "direction": [1, 0, -1], "irradiance": 2.0, "angle_degrees": 0},
        2.0 * math.sqrt(0.5),
    ),
    "disk": (
        # Radiance P / (pi A); irradiance pi L sin^2 of the half angle.
        {"type": "disk", "position": [0, 0, 5], "direction": [0, 0, -1], "size": 2, "power": POWER},
        POWER / math.pi * 1 / (5**2 + 1**2),
    ),
    "small area": (
        {
            "type": "area",
            "position": [0, 0, 5],
            "direction": [0, 0, -1],
            "up": [0, 1, 0],
            "size": [0.02, 0.04],
            "power": POWER,
        },
        POWER / math.pi / HEIGHT**2,
    ),
}


@pytest.mark.parametrize("lamp", LAMPS)
def test_lamps_have_their_units(extension, empty, scene_file, lamp):
    light, irradiance = LAMPS[lamp]
    scene = extension.scene_loader.load_scene(
        scene_file(
            lights=[light], settings={"width": 9, "height": 9, "spp": 1024, "max_bounces": 0}
        )
    )
    found = render(scene)[..., :3].mean()
    assert found == pytest.approx(0.5 / math.pi * irradiance, rel=2e-3)


def test_lamp_colour_and_camera_visibility(extension, empty, scene_file):
    lamp = {"type": "sun", "direction": [0, 0, -1], "irradiance": 1, "color": [1, 0.5, 0.25]}
    picture = render(extension.scene_loader.load_scene(scene_file(lights=[lamp])))
    assert picture[4, 4, :3] == pytest.approx(np.array([1, 0.5, 0.25]) * 0.5 / math.pi, rel=1e-5)

    up = {"type": "perspective", "position": [0, 0, 0.1], "look_at": [0, 0, 1], "up": [0, 1, 0]}
    lamp = {"type": "disk", "position": [0, 0, 5], "direction": [0, 0, -1], "size": 2, "power": 1}
    for visible in (False, True):
        path = scene_file(
            lights=[lamp | {"camera_visible": visible}], camera=up | {"fov_y_degrees": 1}
        )
        centre = render(extension.scene_loader.load_scene(path))[4, 4, 0]
        assert centre == pytest.approx(1 / math.pi / math.pi if visible else 0, rel=1e-5)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize(("width", "height"), [(64, 32), (32, 64)])
def test_camera_frames_the_same_height(extension, empty, scene_file, kind, width, height):
    """A square of side 2 at a distance of 5 fills half the picture's height."""
    vertices, triangles, _ = quad(2)
    path = scene_file()
    np.save(path.parent / "floor_v.npy", vertices)
    np.save(path.parent / "floor_t.npy", triangles)
    camera = {"type": kind, "position": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1]}
    if kind == "perspective":
        camera["fov_y_degrees"] = math.degrees(2 * math.atan(2 / 5))
    else:
        camera["height"] = 4
    path = scene_file(
        camera=camera,
        objects=[floor(transform={"rotate_degrees": [90, 0, 0]})],
        lights=[{"type": "sun", "direction": [0, 1, 0], "irradiance": 1}],
        settings={"width": width, "height": height, "spp": 16, "max_bounces": 0},
    )
    lit = render(extension.scene_loader.load_scene(path))[..., 0] > 0.05
    rows, columns = np.flatnonzero(lit.any(1)), np.flatnonzero(lit.any(0))
    assert (rows[0], rows[-1]) == (height // 4, height - height // 4 - 1)
    side = height // 2
    assert (columns[0], columns[-1]) == ((width - side) // 2, (width + side) // 2 - 1)


def test_transform_scales_then_turns_then_moves(extension, empty, scene_file):
    transform = {"translate": [1, 2, 3], "rotate_degrees": [30, 40, 50], "scale": [1, 2, 3]}
    scene = extension.scene_loader.load_scene(scene_file(objects=[floor(transform=transform)]))
    found = np.array(scene.objects["floor"].matrix_world)

    def turn(axis, degrees):
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        i, j = [k for k in range(3) if k != axis]
        matrix = np.eye(3)
        sign = -1 if axis == 1 else 1
        matrix[i, i] = matrix[j, j] = c
        matrix[i, j], matrix[j, i] = -s * sign, s * sign
        return matrix

    expected = turn(2, 50) @ turn(1, 40) @ turn(0, 30) @ np.diag([1, 2, 3])
    assert np.allclose(found[:3, :3], expected, atol=1e-6)
    assert np.allclose(found[:3, 3], [1, 2, 3])


def test_normals_are_kept_in_single_precision(extension, empty, scene_file):
    scene = extension.scene_loader.load_scene(scene_file(objects=[ball()]))
    mesh = scene.objects["ball"].data
    normals = np.empty(3 * len(mesh.loops), np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    vertices, triangles = sphere()
    assert np.array_equal(corners.reshape(-1, 3), triangles)
    assert np.abs(normals.reshape(-1, 3) - vertices[corners]).max() < 1e-6


def test_equal_shapes_of_one_material_share_a_mesh(extension, empty, scene_file):
    def at(index, **more):
        transform = {"translate": [index, 0, 1], "rotate_degrees": [0, 0, 0], "scale": [1, 1, 1]}
        return ball() | {"name": f"ball{index}", "transform": transform} | more

    white = {"model": "lambert", "parameters": {"rho": 0.5}, "representation": "auto"}
    path = scene_file(
        objects=[floor(), at(0), at(1), at(2, material="black"), at(3, material="black")],
        materials={"white": white, "black": white | {"parameters": {"rho": 0}}},
        settings={"width": 32, "height": 8, "spp": 16, "max_bounces": 0},
        camera={"type": "orthographic", "position": [1.5, 0, 9], "look_at": [1.5, 0, 0]}
        | {"up": [0, 1, 0], "height": 1},
        environment={"color": [1, 1, 1], "strength": 1},
    )
    scene = extension.scene_loader.load_scene(path)
    meshes = [scene.objects[f"ball{index}"].data for index in range(4)]
    assert meshes[0] == meshes[1] and meshes[2] == meshes[3] and meshes[0] != meshes[2]
    assert [m.materials[0].name for m in meshes] == ["white", "white", "black", "black"]
    # The copy has the normals of the first.
    normals = np.empty((2, 3 * len(meshes[0].loops)), np.float32)
    for mesh, into in zip(meshes[::2], normals, strict=True):
        mesh.corner_normals.foreach_get("vector", into)
    assert np.array_equal(normals[0], normals[1])
    row = render(scene)[4, :, 0]
    assert row[4] == pytest.approx(0.5, rel=0.1) and row[12] == pytest.approx(0.5, rel=0.1)
    assert row[20] == row[28] == 0


def test_camera_only_objects_do_not_meet_other_rays(extension, empty, scene_file):
    world = {"color": [1, 1, 1], "strength": 1}
    settings = {"width": 9, "height": 9, "spp": 64, "max_bounces": 1}
    roof = floor(name="roof", transform={"translate": [0, 0, 5]})
    for camera_only in (False, True):
        path = scene_file(
            objects=[floor(), roof | {"camera_only": camera_only}],
            environment=world,
            settings=settings,
        )
        picture = render(extension.scene_loader.load_scene(path))
        if camera_only:
            assert picture[4, 4, 0] == pytest.approx(0.5, rel=1e-4)
        else:
            assert picture[4, 4, 0] < 0.3


def write_exr(path, pixels):
    """Writes a float EXR from (height, width, 3), row 0 at the bottom."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("new", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    rgba = np.concatenate([pixels, np.ones((height, width, 1))], -1).astype(np.float32)
    image.pixels.foreach_set(rgba.ravel())
    image.file_format = "OPEN_EXR"
    image.filepath_raw = str(path)
    image.save()
    bpy.data.images.remove(image)


def test_environment_picture_has_blenders_orientation(extension, empty, scene_file, tmp_path):
    """u = 1/2 - atan2(y, x) / (2 pi): +x in the middle, +y a quarter to the left; v upwards."""
    pixels = np.zeros((64, 128, 3))
    pixels[32:, :, 2] = 1  # above the horizon: blue
    pixels[:, 63:65, 0] = 1  # +x: red
    pixels[:, 31:33, 1] = 1  # +y: green
    write_exr(tmp_path / "sky.exr", pixels)
    for look_at, expected in (
        ([1, 0, 0.1], (2, 0, 2)),
        ([0, 1, 0.1], (0, 2, 2)),
        ([0, 1, -0.1], (0, 2, 0)),
        ([-1, 0, 0.1], (0, 0, 2)),
        ([0, -1, -0.1], (0, 0, 0)),
    ):
        camera = {"type": "perspective", "position": [0, 0, 0], "look_at": look_at, "up": [0, 0, 1]}
        path = scene_file(
            objects=[floor(transform={"translate": [0, 0, -1e4]})],
            camera=camera | {"fov_y_degrees": 0.5},
            environment={"image": "sky.exr", "strength": 2},
            settings={"width": 1, "height": 1, "spp": 1, "max_bounces": 0},
        )
        assert render(extension.scene_loader.load_scene(path))[0, 0, :3] == pytest.approx(expected)


def test_textures_follow_uv(extension, empty, scene_file, tmp_path):
    pixels = np.zeros((4, 4, 3))
    pixels[:2, :2] = 0.25  # u, v < 1/2
    pixels[2:, 2:] = 1.0
    write_exr(tmp_path / "map.exr", pixels)
    texture = {"texture": {"image": "map.exr", "colorspace": "linear"}}
    path = scene_file(
        materials={"white": {"model": "lambert", "parameters": {"rho": texture}}},
        camera={
            "type": "orthographic",
            "position": [0, 0, 9],
            "look_at": [0, 0, 0],
            "up": [0, 1, 0],
            "height": 20,
        },
        lights=[{"type": "sun", "direction": [0, 0, -1], "irradiance": math.pi}],
        settings={"width": 8, "height": 8, "spp": 4, "max_bounces": 0},
    )
    picture = render(extension.scene_loader.load_scene(path))[..., 0]
    assert picture[2, 2] == pytest.approx(0.25, rel=1e-4)
    assert picture[5, 5] == pytest.approx(1.0, rel=1e-4)
    assert picture[2, 5] == picture[5, 2] == 0


def test_clean_settings_are_in_force(extension, empty, scene_file):
    scene = extension.scene_loader.load_scene(scene_file())
    assert bpy.context.scene == scene
    cycles = scene.cycles
    assert (cycles.samples, cycles.seed, cycles.max_bounces) == (16, 3, 0)
    assert cycles.shading_system and cycles.device == "CPU"
    assert cycles.caustics_reflective and cycles.pixel_filter_type == "BOX"
    assert cycles.blur_glossy == cycles.light_sampling_threshold == 0
    assert cycles.sample_clamp_indirect == cycles.sample_clamp_direct == 0
    assert not (cycles.use_denoising or cycles.use_adaptive_sampling or cycles.use_guiding)
    settings = scene.render.image_settings
    assert (settings.file_format, settings.color_depth) == ("OPEN_EXR", "32")


def test_representation_can_be_overridden(extension, empty, scene_file):
    sun = [{"type": "sun", "direction": [0, 0, -1], "irradiance": 1}]

    def material(representation):
        scene = extension.scene_loader.load_scene(scene_file(lights=sun), representation)
        return next(o for o in scene.objects if o.type == "MESH").active_material

    forms = {
        form: extension.model_nodes.identity(extension.model_nodes.group_nodes(material(form))[0])[
            1
        ]
        for form in (None, "auto", "exact", "sampled")
    }
    assert forms == {None: "exact", "auto": "exact", "exact": "exact", "sampled": "sampled"}
    nodes = material("glossy").node_tree.nodes
    assert any(n.bl_idname == "ShaderNodeBsdfAnisotropic" for n in nodes)


def test_a_matte_floor_needs_no_shader(extension, empty, scene_file, monkeypatch):
    """A pack of one model, such as a user's own, can load a scene with a floor: Blender's Diffuse
    node equals Lambert's model."""
    sun = [{"type": "sun", "direction": [0.3, 0, -1], "irradiance": math.pi}]
    materials = {"white": {"model": "lambert", "parameters": {"rho": [0.2, 0.5, 0.8]}}}
    path = scene_file(lights=sun, materials=materials)
    before = render(extension.scene_loader.load_scene(path))
    monkeypatch.setattr(extension.pack, "model_names", lambda: ["mine"])
    scene = extension.scene_loader.load_scene(path)
    (material,) = {s.material for o in scene.objects for s in o.material_slots}
    assert not extension.model_nodes.group_nodes(material)
    assert render(scene) == pytest.approx(before, rel=1e-4)
    for wrong, message in (
        ({"rho": 2}, r"materials\.white\.parameters\.rho: expected numbers from 0 to 1, got 2"),
        ({"rd": 0.5}, r"materials\.white\.parameters\.rd: expected no parameter but rho"),
    ):
        path = scene_file(materials={"white": {"model": "lambert", "parameters": wrong}})
        with pytest.raises(ValueError, match=message):
            extension.scene_loader.load_scene(path)
    path = scene_file(materials={"white": {"model": "phong"}})
    with pytest.raises(ValueError, match="expected one of mine.*brdfc build --scene makes"):
        extension.scene_loader.load_scene(path)


def test_glossy_comparison_has_the_same_axes(extension, empty, scene_file):
    """The anisotropic highlight of Blender's node has the same orientation as the model's."""
    values = {"nu": 20.0, "nv": 2000.0, "rs": 1.0, "part": "specular"}
    camera = {"type": "perspective", "position": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1]}
    path = scene_file(
        materials={"white": {"model": "ashikhmin_shirley", "parameters": values}},
        objects=[ball()],
        camera=camera | {"fov_y_degrees": 25},
        environment={"color": [0, 0, 0], "strength": 1},
        lights=[
            {
                "type": "disk",
                "position": [0, -8, 0],
                "direction": [0, 1, 0],
                "size": 3,
                "power": 1e3,
            }
        ],
        settings={"width": 32, "height": 32, "spp": 256, "max_bounces": 1},
    )
    pictures = {}
    for form in ("auto", "glossy"):
        pictures[form] = render(extension.scene_loader.load_scene(path, form))[..., 0]
    weights = {form: p / p.sum() for form, p in pictures.items()}
    y, x = np.mgrid[:32, :32] - 15.5
    for form, w in weights.items():
        print(form, (w * x * x).sum(), (w * y * y).sum())
    for axis in (x, y):
        spread = {form: (w * axis * axis).sum() for form, w in weights.items()}
        assert spread["glossy"] == pytest.approx(spread["auto"], rel=0.25)
    assert (weights["auto"] * y * y).sum() > 3 * (weights["auto"] * x * x).sum()


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"camera": {"type": "fisheye"}}, r"scene\.json: camera\.type: expected perspective or"),
        ({"camera": {"type": "perspective"}}, r"camera: expected an object with 'fov_y_degrees'"),
        ({"materials": {"white": {}}}, r"materials\.white: expected an object with 'model'"),
        (
            {"materials": {"white": {"model": "lambert", "parameters": {"rho": 2}}}},
            r"materials\.white\.parameters\.rho: lambert\.rho \(r\): expected .* got 2",
        ),
        (
            {"materials": {"white": {"model": "gloss", "parameters": {}}}},
            r"materials\.white\.model: expected one of .*lambert.*'gloss'",
        ),
        (
            {
                "materials": {
                    "white": {"model": "lambert", "parameters": {"rho": {"texture": "x.exr"}}}
                }
            },
            r"parameters\.rho\.texture: file .*x\.exr does not exist",
        ),
        ({"objects": [floor(material="red")]}, r"objects\.0\.material: expected one of white"),
        (
            {"objects": [floor(shape={"type": "sphere"})]},
            r"objects\.0\.shape: expected a mesh of arrays",
        ),
        (
            {
                "objects": [
                    floor(shape={"type": "mesh", "vertices": "no.npy", "triangles": "t.npy"})
                ]
            },
            r"objects\.0\.shape\.vertices: file .*no\.npy does not exist",
        ),
        ({"lights": [{"type": "laser"}]}, r"lights\.0\.type: expected one of point, sun"),
        (
            {"lights": [{"type": "point", "position": [0, 0, 1], "power": "much"}]},
            r"lights\.0\.power: expected a number, got 'much'",
        ),
        (
            {"environment": {"procedural": "sky"}},
            r"environment: expected .*resolve the scene first",
        ),
    ],
)
def test_malformed_scene_names_file_and_key(extension, empty, scene_file, parts, message):
    with pytest.raises(ValueError, match=message):
        extension.scene_loader.load_scene(scene_file(**parts))


# The driver


def drive(extension_zip, *arguments):
    environment = {k: v for k, v in os.environ.items() if k != "BLENDER_USER_RESOURCES"}
    return subprocess.run(
        [sys.executable, DRIVER, "--extension", extension_zip, *map(str, arguments)],
        capture_output=True,
        text=True,
        env=environment,
    )


def test_driver_renders_and_reports(extension, extension_zip, empty, scene_file, tmp_path):
    sun = [{"type": "sun", "direction": [0, 0, -1], "irradiance": math.pi}]
    path = scene_file(lights=sun)
    jobs = [
        {"scene": str(path), "out": str(tmp_path / "out" / f"{form}.exr"), "representation": form}
        for form in ("exact", "glossy")
    ]
    jobs[0] |= {"repeat": 2, "spp": 8, "seed": 7, "name": "first"}
    jobs[1]["timed"] = False
    (tmp_path / "jobs.json").write_text(json.dumps(jobs))
    done = drive(extension_zip, "--jobs", tmp_path / "jobs.json")
    assert done.returncode == 0, done.stderr
    records = json.loads(done.stdout)
    assert [r["representation"] for r in records] == ["exact", "glossy"]
    assert [len(r["repeats"]) for r in records] == [2, 1]
    assert records[0]["name"] == "first"
    for record in records:
        assert record["blender"] == bpy.app.version_string
        assert record["cpu_seconds"] > 0
    assert records[0]["sampling_cpu_seconds"] >= 0 and "sampling_cpu_seconds" not in records[1]
    assert [r["settings"]["spp"] for r in records] == [8, 16]
    assert [r["settings"]["seed"] for r in records] == [7, 3]
    (form,) = records[0]["materials"]["white"]
    assert (form["model"], form["representation"], form["closures"]) == ("lambert", "exact", 1)
    picture = read_picture(tmp_path / "out" / "exact.exr")
    assert picture[..., :3] == pytest.approx(0.5, rel=1e-5)
    assert not list((tmp_path / "out").glob(".*"))
    assert "[3/3]" in done.stderr


@pytest.mark.long
@pytest.mark.slow
def test_pictures_of_two_seeds_share_no_sample(extension_zip, empty, tool, tmp_path):
    """The first sample goes through the pixel's centre; with it, a form that samples directions
    would use the same ones in both pictures: a correlation of 0.84. Without it, two pictures of a
    sphere have 0.03 to 0.12."""
    content = json.loads((SCENES / "room-coupled.json").read_text())
    content["settings"] |= {"width": 64, "height": 64, "spp": 1}
    source = tmp_path / "s.json"
    source.write_text(json.dumps(content))
    tool("scene", source, "--out", tmp_path)
    pictures = [tmp_path / f"{seed}.exr" for seed in (1, 2)]
    jobs = [
        {"scene": str(tmp_path / "scene.json"), "out": str(out), "representation": "sampled"}
        | {"seed": int(out.stem)}
        for out in pictures
    ]
    (tmp_path / "jobs.json").write_text(json.dumps(jobs))
    done = drive(extension_zip, "--jobs", tmp_path / "jobs.json")
    assert done.returncode == 0, done.stderr
    one, two = (read_picture(p)[..., 0].ravel() for p in pictures)
    assert np.corrcoef(one, two)[0, 1] < 0.4


@pytest.mark.long
@pytest.mark.slow
def test_a_scenes_working_space_is_that_of_its_pictures(extension_zip, empty, tool, tmp_path):
    """Gold, which is outside Rec.709, and a texture look as in the reference; then a scene that
    names no space is in the space that Blender starts with."""
    write_exr(tmp_path / "green.exr", np.broadcast_to([0.18, 0.4, 0.05], (2, 2, 3)))
    texture = {"texture": {"image": "green.exr", "colorspace": "Linear Rec.709"}}
    content = {
        "name": "s",
        "settings": {"width": 32, "height": 32, "spp": 1024, "max_bounces": 3},
        "camera": {
            "type": "perspective",
            "position": [0, -6, 3],
            "look_at": [0, 0, 0.7],
            "fov_y_degrees": 30,
        },
        "materials": {
            "green": {"model": "lambert", "parameters": {"rho": texture}},
            "gold": {"model": "fresnel_conductor", "optical": "gold"},
        },
        "objects": [
            {"name": "floor", "shape": {"type": "quad", "size": [40, 40]}, "material": "green"},
            {"name": "ball", "shape": {"type": "sphere"}, "material": "gold"},
        ],
        "environment": {"color": [1, 1, 1]},
    }
    spaces = ("Linear Rec.709", "Linear Rec.2020", "ACEScg", None)
    jobs, pairs = [], []
    for space in spaces:
        folder = tmp_path / str(space)
        source = tmp_path / f"{space}.json"
        named = {} if space is None else {"working_space": space}
        source.write_text(json.dumps(content | named))
        tool("scene", source, "--out", folder)
        pairs.append((folder / "blender.exr", folder / "reference.exr"))
        jobs.append({"scene": str(folder / "scene.json"), "out": str(pairs[-1][0]), "timed": False})
        tool("render", source, "--out", pairs[-1][1], "--spp", "4096")
    (tmp_path / "jobs.json").write_text(json.dumps(jobs))
    done = drive(extension_zip, "--jobs", tmp_path / "jobs.json")
    if not hasattr(bpy.data, "colorspace"):
        assert done.returncode == 2
        expected = (
            "scene.json: working_space: expected 'Linear Rec.709', the working space of Blender"
        )
        assert expected in done.stderr and "'Linear Rec.2020' needs Blender 5.0" in done.stderr
        assert pairs[0][0].exists(), "its own is none that it lacks"
        return
    assert done.returncode == 0, done.stderr
    oiio = open_image_io()
    pixels = [
        [oiio.ImageBuf(str(p)).get_pixels()[..., :3].mean((0, 1), float) for p in pair]
        for pair in pairs
    ]
    for blender, reference in pixels:
        np.testing.assert_allclose(blender, reference, rtol=2e-3)
    np.testing.assert_array_equal(pixels[3][0], pixels[0][0])
    # The space in the files equals the scene's; otherwise compare would convert.
    off = [json.loads(tool("compare", *pair, "--json"))["bias"] for pair in pairs]
    assert np.abs(off).max() < 1e-3
    assert all(np.abs(pixels[i][0] - pixels[0][0]).max() > 0.02 for i in (1, 2))


def test_a_working_space_that_there_is_not_is_an_error(extension, empty, scene_file):
    expected = (
        "scene.json: working_space: expected one of Linear Rec.709, Linear Rec.2020, ACEScg, got"
    )
    if not hasattr(bpy.data, "colorspace"):
        expected = "scene.json: working_space: expected 'Linear Rec.709'"
    with pytest.raises(ValueError, match=expected):
        extension.scene_loader.load_scene(scene_file(working_space="Rec.77"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "expected --scene and --out, or --jobs"),
        (["--scene", "no.json", "--out", "x.exr"], "no.json: No such file"),
        (["--jobs", "no.json"], "no.json"),
    ],
)
def test_driver_refuses_bad_input(extension_zip, tmp_path, arguments, message):
    done = drive(extension_zip, *arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("render_scene: ") and message in done.stderr
    assert len(done.stderr.splitlines()) == 1
