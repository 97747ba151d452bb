// SPDX-License-Identifier: GPL-3.0-or-later
// Triangle meshes and their files. Shapes and files become triangles once, so that both renderers see the same ones.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace brdfc::reference {

/// Object space. The corners of a triangle are anticlockwise seen from the front.
struct Mesh {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<float, 3>> normals;  ///< one a vertex, unit length; empty: flat
  std::vector<std::array<float, 2>> uvs;      ///< one a vertex; empty: none
  std::vector<std::array<std::int32_t, 3>> triangles;
};

/// An OBJ, PLY, STL or glTF file (.gltf, .glb). `smooth`: normals of the file, or averaged where an OBJ or PLY file has
/// none; otherwise flat. `of_material`: only the faces of that material of the file, if it is not empty. To `notes` are
/// added lines that start with the file's name: how many triangles it has, what of the file is left out or assumed.
/// Throws InputError naming the file.
Mesh read_mesh(const std::filesystem::path& path, bool smooth, const std::string& of_material = {},
               std::vector<std::string>* notes = nullptr);

/// NumPy's format 1.0, C order, little endian: float32 or int32 of shape (rows, columns).
template <class T>
void write_npy(const std::filesystem::path& path, const T* data, std::size_t rows, std::size_t columns);
/// Throws InputError naming the file, the shape that was expected and what was found.
template <class T> std::vector<T> read_npy(const std::filesystem::path& path, std::size_t columns);

/// Checks indices, counts and that all is finite; throws InputError that starts with `name`.
void check_mesh(const Mesh& mesh, const std::string& name);

}  // namespace brdfc::reference
