// SPDX-License-Identifier: GPL-3.0-or-later
// Mesh files: a reader for each format fills a MeshFile with what the file says, and read_mesh() (mesh.h) makes
// triangles of it. All readers throw InputError that names the file.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace brdfc::reference {

/// Polygons as a file states them: corners index into positions, normals and UVs of their own.
struct MeshFile {
  /// A corner of a face; -1: the file states no normal, or no UV, for it.
  struct Corner {
    std::int32_t position = -1, normal = -1, uv = -1;
  };

  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;  ///< of any length; 0 or not finite where the file is wrong
  std::vector<std::array<float, 2>> uvs;      ///< v upwards; not finite where the file is wrong
  std::vector<Corner> corners;                ///< of all faces, one after the other
  std::vector<std::size_t> ends;              ///< one a face: the end of its corners
  std::vector<std::int32_t> materials;        ///< one a face: index into material_names, or -1
  std::vector<std::string> material_names;
  bool flat = false;                            ///< faces without normals are flat, even if smooth ones are asked for
  std::map<std::string, std::size_t> left_out;  ///< what can't be rendered, such as "line", and how many

  /// Ends the face that was begun with the last end; less than three corners are left out.
  void end_face(std::int32_t material = -1);
  /// The index of a material's name, which is added if it is new.
  std::int32_t material(std::string_view name);
};

/// Wavefront OBJ. Not by tinyobjloader, which takes what is not a number for 0 without a word.
MeshFile read_obj(const std::filesystem::path&);
/// PLY 1.0, text or binary: vertices, and faces or triangle strips; other elements are skipped.
MeshFile read_ply(const std::filesystem::path&);
/// STL, text or binary. What it states of a facet's normal follows from its corners, and is not read.
MeshFile read_stl(const std::filesystem::path&);
/// glTF 2.0, .gltf or .glb: the default scene with its nodes' transforms, turned from y up to z up.
MeshFile read_gltf(const std::filesystem::path&);

/// The bytes of a file.
std::string read_bytes(const std::filesystem::path&);

}  // namespace brdfc::reference
