// SPDX-License-Identifier: GPL-3.0-or-later
// Triangle meshes and mesh files. Shapes and files are converted to triangles once, so that both renderers get the same
// ones.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace brdfc::reference {

/// A mesh in object space. Seen from the front, the corners of a triangle are anticlockwise.
struct Mesh {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<float, 3>> normals;  ///< one per vertex, unit length; empty: flat shading
  std::vector<std::array<float, 2>> uvs;      ///< one per vertex; empty: none
  std::vector<std::array<std::int32_t, 3>> triangles;
};

/// Reads an OBJ, PLY, STL or glTF file (.gltf, .glb). `smooth`: use the normals of the file, or averaged ones where an
/// OBJ or PLY file has none; otherwise shading is flat. `of_material`: if not empty, read only the faces with that
/// material. Lines that start with the file's name are added to `notes`: the number of triangles, and what was left out
/// or assumed. Throws InputError that names the file.
Mesh read_mesh(const std::filesystem::path& path, bool smooth, const std::string& of_material = {},
               std::vector<std::string>* notes = nullptr);

/// Writes NumPy's format 1.0, in C order and little endian: float32 or int32 of shape (rows, columns).
template <class T>
void write_npy(const std::filesystem::path& path, const T* data, std::size_t rows, std::size_t columns);
/// Reads such a file. Throws InputError that names the file, the expected shape and what was found.
template <class T> std::vector<T> read_npy(const std::filesystem::path& path, std::size_t columns);

/// Checks indices and counts, and that all numbers are finite. Throws InputError that starts with `name`.
void check_mesh(const Mesh& mesh, const std::string& name);

}  // namespace brdfc::reference
