// SPDX-License-Identifier: GPL-3.0-or-later
// Readers of mesh files. Each format has a reader that fills a MeshFile with the contents of the file, from which
// read_mesh() (mesh.h) makes triangles. All readers throw InputError that names the file.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace brdfc::reference {

/// Polygons as in a file: each corner has separate indices of position, normal and UV.
struct MeshFile {
  /// A corner of a face. -1 means that the file gives no normal or no UV for it.
  struct Corner {
    std::int32_t position = -1, normal = -1, uv = -1;
  };

  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;  ///< any length; 0 or not finite if the file is wrong
  std::vector<std::array<float, 2>> uvs;      ///< v points upwards; not finite if the file is wrong
  std::vector<Corner> corners;                ///< corners of all faces, consecutively
  std::vector<std::size_t> ends;              ///< one per face: the end of its corners
  std::vector<std::int32_t> materials;        ///< one per face: index into material_names, or -1
  std::vector<std::string> material_names;
  bool flat = false;                            ///< faces without normals are flat, even if smooth shading is requested
  std::map<std::string, std::size_t> left_out;  ///< elements that can't be rendered, such as "line", with their number

  /// Ends the face whose corners follow the last end. A face of less than three corners is dropped.
  void end_face(std::int32_t material = -1);
  /// The index of a material name, which is added if it is new.
  std::int32_t material(std::string_view name);
};

/// Wavefront OBJ. tinyobjloader is not used, because it silently reads malformed numbers as 0.
MeshFile read_obj(const std::filesystem::path&);
/// PLY 1.0, text or binary: vertices, and faces or triangle strips. Other elements are skipped.
MeshFile read_ply(const std::filesystem::path&);
/// STL, text or binary. The normals of facets are not read, because they follow from the corners.
MeshFile read_stl(const std::filesystem::path&);
/// glTF 2.0, .gltf or .glb: the default scene with the transforms of its nodes, rotated from y up to z up.
MeshFile read_gltf(const std::filesystem::path&);

/// Reads all bytes of a file.
std::string read_bytes(const std::filesystem::path&);

}  // namespace brdfc::reference
