# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as written by other programs: every triangle of the file is read, and each omission or
assumption is reported in a line."""

import json

import numpy as np
import pytest
from mesh_files import Gltf, obj, ply, sphere, stl, stl_text
from support import run, scene

MILLIMETRE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]) / 1000
#: A radius of 5 cm: areas of about 1e-7 square metres.
BALL, TRIANGLES = sphere(0.05, 60, 30)
QUAD = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)


def read(folder, name, content, material=None, **shape):
    """The arrays of a mesh file as the tool passes them to Blender, and its messages."""
    if content is not None:
        if isinstance(content, str):
            content = content.encode()
        (folder / name).write_bytes(content)
    objects = [{"name": "o", "shape": {"type": "mesh", "file": name, **shape}, "material": "m"}]
    more = {"materials": {"m": material}} if material else {}
    (folder / "s.json").write_text(json.dumps(scene(objects=objects, **more)), encoding="utf-8")
    done = run("scene", folder / "s.json", "--out", folder / "out")
    assert done.returncode == 0, done.stderr
    resolved = json.loads((folder / "out" / "scene.json").read_text())["objects"][0]["shape"]
    arrays = {k: np.load(folder / "out" / v) for k, v in resolved.items() if k != "type"}
    lines = done.stderr.splitlines()[:-1]
    assert all(line.startswith("brdfc: ") for line in lines)
    return arrays, [line.removeprefix(f"brdfc: {folder / name}: ") for line in lines]


def refused(folder, name, content, *words):
    (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    objects = [{"name": "o", "shape": {"type": "mesh", "file": name}, "material": "m"}]
    (folder / "s.json").write_text(json.dumps(scene(objects=objects)), encoding="utf-8")
    done = run("scene", folder / "s.json", "--out", folder / "out")
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    for word in ("objects[0].shape.file: ", name, *words):
        assert word in done.stderr, done.stderr


def flat(mesh):
    corners = mesh["vertices"][mesh["triangles"]].astype(float)
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


BALLS = {
    "a.obj": obj(BALL, TRIANGLES),
    "little.ply": ply(BALL, TRIANGLES, "<"),
    "big.ply": ply(BALL, TRIANGLES, ">"),
    "text.ply": ply(BALL, TRIANGLES, ""),
    "plain.ply": ply(BALL, TRIANGLES, "<", extra=False),
    "binary.stl": stl(BALL, TRIANGLES),
    "trailing.stl": stl(BALL, TRIANGLES) + b"\0" * 7,
    "text.stl": stl_text(BALL, TRIANGLES),
}


@pytest.mark.parametrize("name", BALLS)
def test_small_triangles_stay(name, tmp_path):
    """Areas below 1e-6 are common in scans measured in metres."""
    mesh, said = read(tmp_path, name, BALLS[name])
    assert said == [f"{len(TRIANGLES)} triangles"] and len(mesh["triangles"]) == len(TRIANGLES)
    size = np.linalg.norm(flat(mesh), axis=1)
    assert size.min() > 0 and size.sum() / 2 == pytest.approx(4 * np.pi * 0.05**2, rel=0.01)
    if name.endswith(".stl"):
        assert "normals" not in mesh
    else:
        # Normals averaged by angle point away from the centre.
        outwards = mesh["vertices"] / np.linalg.norm(mesh["vertices"], axis=1)[:, None]
        assert len(mesh["vertices"]) == len(BALL)
        assert (mesh["normals"] * outwards).sum(1).min() > 0.9998


@pytest.mark.parametrize("name", ["q.obj", "q.ply"])
def test_a_quad_of_a_millimetre_is_two_triangles(name, tmp_path):
    content = obj(MILLIMETRE, [range(4)]) if name == "q.obj" else ply(MILLIMETRE, [range(4)], "")
    mesh, said = read(tmp_path, name, content)
    assert said == ["2 triangles"]
    np.testing.assert_allclose(mesh["normals"], [[0, 0, 1]] * 4)


def test_a_polygon_that_is_not_convex_keeps_its_outline(tmp_path):
    """An L with six corners, rotated and tilted; its area is that of its triangles."""
    corners = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], float)
    for start in range(6):
        turned = np.roll(corners, start, axis=0)
        tilted = np.column_stack([turned[:, 1], turned[:, 0], 0.5 * turned[:, 0]])
        mesh, said = read(tmp_path, "l.obj", obj(tilted, [range(6)]))
        assert said == ["4 triangles"]
        normals = flat(mesh)
        assert np.linalg.norm(normals, axis=1).sum() / 2 == pytest.approx(3 * np.sqrt(1.25))
        assert (normals @ normals[0] > 0).all()


@pytest.mark.parametrize(
    "text",
    [
        "v .0 +.0 -.0\nv 1. .0e1 0\nv 0 .001 0\nf 1 2 3\n",
        "v 0 0 0 1 0.5 0.5 0.5\r\nv 1 0 0 1 0 0\r\nv 0 .001 0\r\nf 1 2 3\r\n",
        "f 1 2 3\nv 0 0 0 # first\n v 1 0 0\n\tv 0 0.1e-2 0\n",
        "v 0 0 0\nv 1 0 0\nv 0 .001 0\no a\ng b c\ns off\nf -3 \\\n -2 -1\n",
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 .001 0\nvn -1.#IND 0 0\nvt 0\nf 1/1/1 2/1/1 3/1/1\n",
    ],
)
def test_numbers_and_lines_of_obj(text, tmp_path):
    mesh, said = read(tmp_path, "a.obj", text, smooth=False)
    assert said[0] == "1 triangle"
    np.testing.assert_allclose(mesh["vertices"], [(0, 0, 0), (1, 0, 0), (0, 0.001, 0)], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.obj", "v 0 0 0\nv 1,5 0 0\n", "a.obj line 2: expected 3 numbers, got '1,5'"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "line 4: the face uses vertex 4"),
        ("a.obj", "v 0 0 0\nf 1 -2 1\n", "line 2: the corner '-2' goes back before the first"),
        ("a.obj", "v 0 0 0\nf a b c\n", "line 2: expected a corner as 1, 1/2, 1//3 or 1/2/3"),
        ("a.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 1 is not finite"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n", "got 2 points and 1 line"),
        ("a.ply", ply(QUAD, [], ""), "expected at least one triangle, got 4 points"),
        ("a.ply", ply(QUAD, [(0, 1, 4)], "<"), "a face uses vertex 4, expected 0 to 3"),
        ("a.ply", ply(QUAD, [(0, 1, 2)], "<")[:-3], "the file ends before its last face"),
        ("a.ply", ply(QUAD, [(0, 1, 2)], "").replace(b"float y", b"float w"), "x, y and z"),
        ("a.stl", stl(QUAD, [(0, 1, 2)])[:-3], "1 triangles need 134 bytes, the file has 131"),
        ("a.stl", "facet", "not an STL file"),
        ("a.stl", stl_text(QUAD, [(0, 1, 2)])[:-40], "the file ends within a facet"),
        ("a.gltf", "{}", "asset"),
        ("a.glb", b"glTF", "not a binary glTF file"),
        ("a.fbx", "", "expected a mesh file that ends in .obj, .ply, .stl, .gltf or .glb"),
    ],
)
def test_what_is_wrong_is_said_in_words_of_ours(name, text, words, tmp_path):
    refused(tmp_path, name, text, words)


@pytest.mark.parametrize("name", ["a.obj", "a.ply", "binary.stl", "text.stl", "a.glb"])
def test_normals_of_length_0_are_those_of_the_facet(name, tmp_path):
    if name == "a.obj":
        text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 0\nf 1//1 2//1 3//1\nf 1//1 4//1 2//1\n"
    elif name == "a.ply":
        text = ply([*QUAD[:3], (0, 0, 1)], [(0, 1, 2), (0, 3, 1)], "", extra=False).decode()
        text = text.replace("property float z\n", "property float z\n" + 3 * "property float n_\n")
        for axis in "xyz":
            text = text.replace("n_", "n" + axis, 1)
        head, body = text.split("end_header\n")
        rows = body.split("\n")
        text = head + "end_header\n" + "\n".join([r + " 0 0 0" for r in rows[:4]] + rows[4:])
    elif name == "a.glb":
        g = Gltf()
        attributes = {
            "POSITION": g.accessor(QUAD[:3], g.FLOAT),
            "NORMAL": g.accessor(np.zeros((3, 3)), g.FLOAT),
        }
        g.node(mesh=g.mesh({"attributes": attributes}))
        text = g.binary()
    else:
        write = stl if name == "binary.stl" else stl_text
        text = write([*QUAD[:3], (0, 0, 1)], [(0, 1, 2), (0, 3, 1)])
    mesh, said = read(tmp_path, name, text)
    count = len(mesh["triangles"])
    if name.endswith(".stl"):
        assert said == ["2 triangles"] and "normals" not in mesh
        return
    what = "1 triangle" if count == 1 else "2 triangles"
    assert said == [
        what,
        f"{what} with normals of length 0 in the file, shaded flat at these corners",
    ]
    of_facets = flat(mesh) / np.linalg.norm(flat(mesh), axis=1)[:, None]
    for k in range(3):
        np.testing.assert_allclose(mesh["normals"][mesh["triangles"][:, k]], of_facets, atol=1e-6)


TEXTURED = {
    "model": "lambert",
    "parameters": {
        "rho": {"texture": {"procedural": "checker", "a": [1, 0, 0], "b": [0, 0, 1], "cells": 2}}
    },
}


def test_a_texture_without_uvs_is_said(tmp_path):
    half = obj(QUAD, []) + "vt .25 .25\nvt .5 .5\nf 1/1 2/2 3/1\nf 1 3 4\n"
    mesh, said = read(tmp_path, "half.obj", half, material=TEXTURED)
    where = "where textures show the colour of their lower left corner"
    assert said == ["2 triangles", f"1 triangle without UVs, {where}"]
    assert sorted(map(tuple, mesh["uvs"])) == [(0, 0)] * 3 + [(0.25, 0.25)] * 2 + [(0.5, 0.5)]
    mesh, said = read(tmp_path, "none.obj", obj(QUAD, [range(4)]), material=TEXTURED)
    assert said[0] == "2 triangles" and "uvs" not in mesh
    assert "objects[0]: the mesh has no UVs" in said[1] and '"m"' in said[1]
    assert read(tmp_path, "none.obj", None)[1] == ["2 triangles"]  # no texture, no message


def test_materials_of_a_file_are_said_and_can_be_chosen(tmp_path):
    text = obj(QUAD, []) + "f 1 2 3\nusemtl dark red\nf 1 2 4\nusemtl blue.001\nf 1 3 4\nf 2 3 4\n"
    mesh, said = read(tmp_path, "a.obj", text)
    assert said[0] == "4 triangles" and said[1].startswith(
        "3 materials in the file (dark red, blue.001 and one without a name), all shown as"
    )
    mesh, said = read(tmp_path, "a.obj", None, of_material="blue.001")
    assert said == ["2 triangles of the material 'blue.001', of 4 in all"]
    assert len(mesh["triangles"]) == 2
    content = scene(
        objects=[
            {
                "name": "o",
                "shape": {"type": "mesh", "file": "a.obj", "of_material": "x"},
                "material": "m",
            }
        ]
    )
    (tmp_path / "s.json").write_text(json.dumps(content), encoding="utf-8")
    done = run("scene", tmp_path / "s.json", "--out", tmp_path / "out")
    assert done.returncode == 2 and "expected one of dark red, blue.001" in done.stderr


def test_what_is_left_out_is_counted(tmp_path):
    text = (
        obj([*QUAD, (2, 0, 0)], [(0, 1, 2), (0, 1, 4), (0, 0, 1), (0, 1)]) + "l 1 2\nl 1 3\np 1\n"
    )
    mesh, said = read(tmp_path, "a.obj", text)
    assert len(mesh["triangles"]) == 1
    assert said == [
        "3 triangles; left out: 2 triangles without area, 1 face of less than three corners, "
        "2 lines, 1 point"
    ]


def test_ply_of_strips_and_of_uvs_by_corner(tmp_path):
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    head += "property float z\n"
    rows = "".join("{:g} {:g} {:g}\n".format(*p) for p in QUAD[[0, 1, 3, 2]])
    strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    mesh, said = read(tmp_path, "a.ply", head + strips + rows + "8 0 1 2 3 -1 0 2 1\n")
    assert said == ["3 triangles"] and (flat(mesh)[:, 2] == [1, 1, -1]).all()
    faces = "element face 1\nproperty list uchar int vertex_index\n"
    faces += "property list uchar float texcoord\nend_header\n"
    mesh, said = read(tmp_path, "b.ply", head + faces + rows + "3 0 1 3 6 .1 .2 .3 .4 .5 .6\n")
    assert said == ["1 triangle"]
    np.testing.assert_allclose(mesh["uvs"], [(0.1, 0.2), (0.3, 0.4), (0.5, 0.6)])


def furniture():
    """Two primitives and points in a mesh with two instances, the second one mirrored, with
    children, quantised positions, and normals under non-uniform scaling."""
    g = Gltf()
    slope = QUAD @ np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1)]) + np.outer(QUAD[:, 0], (0, 0, 1))
    index = g.accessor([0, 1, 2, 0, 2, 3], g.UBYTE)
    normal = np.array([-1, 0, 1]) / np.sqrt(2)
    full = {
        "POSITION": g.accessor(slope, g.FLOAT),
        "NORMAL": g.accessor(np.tile(normal, (4, 1)), g.FLOAT),
        "TEXCOORD_0": g.accessor(QUAD[:, :2] * 65535, g.USHORT, normalized=True),
    }
    small = {"POSITION": g.accessor(QUAD * 32767, g.SHORT, normalized=True)}
    g.json["materials"] = [{"name": "wood"}, {"name": "steel"}]
    mesh = g.mesh(
        {"attributes": full, "indices": index, "material": 0},
        {"attributes": small, "mode": 6, "material": 1},
        {"attributes": small, "mode": 0},
    )
    g.node(mesh=mesh)
    child = g.node(False, mesh=mesh, translation=[0, 10, 0])
    g.node(children=[child], scale=[-1, 2, 1], rotation=[0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    return g


@pytest.mark.parametrize("name", ["a.glb", "a.gltf", "beside.gltf"])
def test_gltf(name, tmp_path):
    g = furniture()
    if name == "beside.gltf":
        (tmp_path / "my data.bin").write_bytes(g.bytes)
    content = g.binary() if name == "a.glb" else g.text("my%20data.bin" if name[0] == "b" else None)
    mesh, said = read(tmp_path, name, content)
    assert said[0] == "8 triangles; left out: 2 sets of points" and len(mesh["triangles"]) == 8
    assert said[1].startswith("4 triangles without UVs") and "2 materials in the file" in said[2]
    corners = mesh["vertices"][mesh["triangles"]]
    # y up becomes z up: the quad in the plane z = 0 of the file is upright, and faces -y.
    np.testing.assert_allclose(corners[2].min(0), [0, 0, 0], atol=1e-6)
    np.testing.assert_allclose(flat(mesh)[2], [0, -1, 0], atol=1e-6)
    # The second one is 20 to the side: moved by 10, scaled by 2 along y, rotated by 90 degrees.
    np.testing.assert_allclose(corners[6:].reshape(-1, 3).min(0), [-22, 0, -1], atol=1e-5)
    # The file's normals are those of its faces, mirrored or not; v is counted from below.
    normals, facets = mesh["normals"][mesh["triangles"][:, 0]], flat(mesh)
    np.testing.assert_allclose(normals, facets / np.linalg.norm(facets, axis=1)[:, None], atol=1e-6)
    np.testing.assert_allclose(mesh["uvs"][mesh["triangles"][0]], [(0, 1), (1, 1), (1, 0)])
    assert len(read(tmp_path, name, None, of_material="steel")[0]["triangles"]) == 4


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda j: j.update(extensionsUsed=["KHR_draco_mesh_compression"]), "compressed by Draco"),
        (lambda j: j.update(extensionsUsed=["EXT_meshopt_compression"]), "by meshoptimizer"),
        (lambda j: j.update(extensionsRequired=["X_y"]), "requires the extension X_y"),
        (lambda j: j.update(scene=3), "scene: expected one of 1 scenes, got 3"),
        (lambda j: j["nodes"][1].update(children=[1]), "node 1 is used twice in the tree"),
        (lambda j: j["nodes"][0].update(mesh=9), "nodes[0].mesh: expected one of 1 meshes"),
        (lambda j: j["accessors"][1].update(count=90), "90 elements do not fit into"),
        (lambda j: j["accessors"][1].update(type="VEC2"), "accessors[1].type: expected VEC3"),
        (lambda j: j["bufferViews"][1].update(byteLength=9000), "bytes from 8 on, of a buffer of"),
        (lambda j: j["asset"].update(version="1.0"), "asset.version: expected glTF 2.0"),
    ],
)
def test_gltf_that_can_not_be_read(change, words, tmp_path):
    g = furniture()
    text = json.loads(g.text())
    change(text)
    refused(tmp_path, "a.gltf", json.dumps(text), words)


def test_spheres_of_many_sizes_share_a_mesh(tmp_path):
    """Beyond the limit of triangles that are copied, spheres that differ only in their radius are
    one mesh, which is scaled."""
    shapes = [{"type": "sphere", "segments": 1536, "radius": r} for r in (0.5, 0.75, 0.25, 3)]
    places = [{}, {}, {"transform": {"scale": [1, 2, 3]}}, {}]
    objects = [
        {"name": f"o{i}", "shape": shape, "material": "m", **place}
        for i, (shape, place) in enumerate(zip(shapes, places, strict=True))
    ]
    (tmp_path / "s.json").write_text(json.dumps(scene(objects=objects)), encoding="utf-8")
    done = run("scene", tmp_path / "s.json", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out" / "scene.json").read_text(encoding="utf-8"))["objects"]
    assert len({o["shape"]["vertices"] for o in found}) == 2
    for item, (size, scale) in zip(
        found, ((0.5, [1, 1, 1]), (0.75, [1, 1, 1]), (0.25, [1, 2, 3]), (3, [1, 1, 1])), strict=True
    ):
        largest = np.abs(np.load(tmp_path / "out" / item["shape"]["vertices"])).max(0)
        np.testing.assert_allclose(
            largest * item["transform"]["scale"], size * np.array(scale), rtol=1e-6
        )


def test_sizes_of_shared_spheres_are_checked(tmp_path):
    objects = [
        {"name": f"o{i}", "shape": {"type": "sphere", "segments": 1536} | more, "material": "m"}
        for i, more in enumerate(({}, {"radius": -1}))
    ]
    (tmp_path / "s.json").write_text(json.dumps(scene(objects=objects)), encoding="utf-8")
    done = run("scene", tmp_path / "s.json", "--out", tmp_path / "out")
    assert done.returncode == 2 and "objects[1].shape.radius: expected a number" in done.stderr
