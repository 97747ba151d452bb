# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files as written by other programs, for tests of the readers."""

import base64
import json
import math
import struct

import numpy as np


def sphere(radius, segments, rings):
    """Vertices (n, 3) and triangles (m, 3), 2 * segments * (rings - 1) of them."""
    vertices = [(0, 0, -radius)]
    for ring in range(1, rings):
        polar = math.pi * ring / rings
        for segment in range(segments):
            around = 2 * math.pi * segment / segments
            vertices.append(
                (
                    radius * math.sin(polar) * math.cos(around),
                    radius * math.sin(polar) * math.sin(around),
                    -radius * math.cos(polar),
                )
            )
    vertices.append((0, 0, radius))
    triangles = []
    for segment in range(segments):
        after = (segment + 1) % segments
        triangles.append((0, 1 + after, 1 + segment))
        for ring in range(rings - 2):
            a, b = 1 + ring * segments + segment, 1 + ring * segments + after
            triangles += [(a, b, b + segments), (a, b + segments, a + segments)]
        last = 1 + (rings - 2) * segments
        triangles.append((last + segment, last + after, len(vertices) - 1))
    return np.array(vertices), np.array(triangles)


def obj(vertices, faces):
    """As scanners write it: only positions."""
    lines = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    return "\n".join(lines) + "\n"


def ply(vertices, faces, order="<", extra=True):
    """Binary, with properties of other programs: colour, quality, flags."""
    name = {"<": "binary_little_endian", ">": "binary_big_endian", "": "ascii"}[order]
    head = f"ply\nformat {name} 1.0\ncomment VCGLIB generated\nelement vertex {len(vertices)}\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    if extra:
        head += "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        head += "property double quality\n"
    head += f"element face {len(faces)}\n"
    if extra:
        head += "property int flags\n"
    head += "property list uchar int vertex_indices\nend_header\n"
    if not order:
        rows = [f"{x:.9g} {y:.9g} {z:.9g}" + " 1 2 3 0.5" * extra for x, y, z in vertices]
        rows += ["7 " * extra + f"{len(f)} " + " ".join(map(str, f)) for f in faces]
        return (head + "\n".join(rows) + "\n").encode()
    body = b"".join(
        struct.pack(order + "fff", *v) + (struct.pack(order + "BBBd", 1, 2, 3, 0.5) * extra)
        for v in vertices
    )
    body += b"".join(
        struct.pack(order + "i", 7) * extra + struct.pack(f"{order}B{len(f)}i", len(f), *f)
        for f in faces
    )
    return head.encode() + body


def stl(vertices, triangles, normal=(0, 0, 0), head=b"solid exported by a CAD program"):
    """Binary, with the normals 0 0 0 that many CAD programs write."""
    data = head.ljust(80, b" ") + struct.pack("<I", len(triangles))
    for triangle in triangles:
        corners = np.asarray(vertices)[list(triangle)].ravel()
        data += struct.pack("<12fH", *normal, *corners, 0)
    return data


def stl_text(vertices, triangles, normal="0 0 0"):
    lines = ["solid part 1 of 2"]
    for triangle in triangles:
        lines += [f"  facet normal {normal}", "    outer loop"]
        lines += ["      vertex {:.6e} {:.6e} {:.6e}".format(*vertices[i]) for i in triangle]
        lines += ["    endloop", "  endfacet"]
    return "\n".join([*lines, "endsolid part 1 of 2"]) + "\n"


class Gltf:
    """A file with one buffer, to which data is appended."""

    FLOAT, UINT, USHORT, UBYTE, SHORT = 5126, 5125, 5123, 5121, 5122
    TYPES = {5126: "<f4", 5125: "<u4", 5123: "<u2", 5121: "<u1", 5122: "<i2"}

    def __init__(self):
        self.bytes = b""
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}
        for key in ("nodes", "meshes", "accessors", "bufferViews", "buffers"):
            self.json[key] = []

    def accessor(self, array, component, **more):
        array = np.asarray(array)
        kind = "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}"
        data = array.astype(self.TYPES[component]).tobytes()
        self.bytes += bytes(-len(self.bytes) % 4)
        view = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)}
        self.bytes += data
        self.json["bufferViews"].append(view)
        one = {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": component}
        self.json["accessors"].append({**one, "count": len(array), "type": kind, **more})
        return len(self.json["accessors"]) - 1

    def mesh(self, *primitives):
        self.json["meshes"].append({"primitives": list(primitives)})
        return len(self.json["meshes"]) - 1

    def node(self, root=True, **content):
        self.json["nodes"].append(content)
        if root:
            self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)
        return len(self.json["nodes"]) - 1

    def text(self, uri=None):
        """.gltf: with the buffer embedded, or in a separate file."""
        uri = uri or "data:application/octet-stream;base64," + base64.b64encode(self.bytes).decode()
        self.json["buffers"] = [{"uri": uri, "byteLength": len(self.bytes)}]
        return json.dumps(self.json)

    def binary(self):
        """.glb."""
        self.json["buffers"] = [{"byteLength": len(self.bytes)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        data = self.bytes + bytes(-len(self.bytes) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
