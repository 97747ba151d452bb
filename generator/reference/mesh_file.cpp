// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <tuple>
#include <unordered_map>

#include "core/error.h"
#include "core/text.h"
#include "core/vec.h"
#include "reference/image.h"
#include "reference/mesh.h"

namespace brdfc::reference {

namespace fs = std::filesystem;

namespace {

using Vector = Vec3<double>;
using Corner = MeshFile::Corner;

template <class T, std::size_t N> bool is_finite(const std::array<T, N>& a) {
  return std::ranges::all_of(a, [](T x) { return std::isfinite(x); });
}

Vector vertex_of(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }

struct Triangle {
  std::array<Corner, 3> corners;
  std::size_t face;
  Vector normal;  ///< the cross product of two sides; its length is twice the area
};

/// The corners of a polygon in its plane, anticlockwise.
using Outline = std::vector<std::array<double, 2>>;

/// Twice the signed area of a triangle of an outline, positive if it is anticlockwise.
double turn(const Outline& p, std::size_t a, std::size_t b, std::size_t c) {
  return (p[b][0] - p[a][0]) * (p[c][1] - p[a][1]) - (p[b][1] - p[a][1]) * (p[c][0] - p[a][0]);
}

/// Triangulates a simple polygon of n corners into n - 2 triangles by ear clipping. A polygon that crosses itself has
/// no interior, but gives n - 2 triangles as well.
std::vector<std::array<std::size_t, 3>> cut(const Outline& p) {
  std::vector<std::size_t> left(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) left[i] = i;
  std::vector<std::array<std::size_t, 3>> triangles;
  bool convex = true;
  for (std::size_t i = 0; i < p.size(); ++i) convex = convex && turn(p, i, (i + 1) % p.size(), (i + 2) % p.size()) >= 0;
  if (convex) {
    for (std::size_t i = 1; i + 1 < p.size(); ++i) triangles.push_back({0, i, i + 1});
    return triangles;
  }
  while (left.size() > 3) {
    const std::size_t n = left.size();
    const auto is_ear = [&](std::size_t i) {
      const std::size_t a = left[(i + n - 1) % n], b = left[i], c = left[(i + 1) % n];
      if (!(turn(p, a, b, c) > 0)) return false;
      return std::ranges::none_of(left, [&](std::size_t q) {
        if (p[q] == p[a] || p[q] == p[b] || p[q] == p[c]) return false;
        return turn(p, a, b, q) >= 0 && turn(p, b, c, q) >= 0 && turn(p, c, a, q) >= 0;
      });
    };
    std::size_t ear = 0;
    while (ear < n && !is_ear(ear)) ++ear;
    if (ear == n) ear = 0;
    triangles.push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
    left.erase(left.begin() + std::ptrdiff_t(ear));
  }
  triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

/// The triangles of all faces in the file's order: n - 2 for a face with n corners.
std::vector<Triangle> triangulate(const MeshFile& file) {
  std::vector<Triangle> out;
  const auto at = [&](const Corner& c) { return vertex_of(file.positions[std::size_t(c.position)]); };
  for (std::size_t face = 0, begin = 0; face < file.ends.size(); begin = file.ends[face++]) {
    const std::size_t n = file.ends[face] - begin;
    const Corner* corners = &file.corners[begin];
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      const Vector p = at(corners[a]);
      out.push_back({{corners[a], corners[b], corners[c]}, face, cross(at(corners[b]) - p, at(corners[c]) - p)});
    };
    if (n == 3) {
      add(0, 1, 2);
      continue;
    }
    // Newell's method gives the normal of the plane that fits best. The polygon is projected along the largest axis of
    // that normal.
    Vector normal{0, 0, 0};
    for (std::size_t i = 1; i + 1 < n; ++i)
      normal = normal + cross(at(corners[i]) - at(corners[0]), at(corners[i + 1]) - at(corners[0]));
    const std::array<double, 3> size{std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)};
    const auto axis = std::size_t(std::ranges::max_element(size) - size.begin());
    const bool turned = std::array<double, 3>{normal.x, normal.y, normal.z}[axis] < 0;
    Outline outline(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto& p = file.positions[std::size_t(corners[i].position)];
      outline[i] = {p[(axis + 1) % 3], p[(axis + 2) % 3]};
      if (turned) std::swap(outline[i][0], outline[i][1]);
    }
    for (const auto& [a, b, c] : cut(outline)) add(a, b, c);
  }
  return out;
}

struct PositionHash {
  std::size_t operator()(const std::array<float, 3>& p) const {
    std::size_t h = 0;
    for (const float x : p) h = h * 0x9e3779b97f4a7c15u + std::hash<float>()(x);
    return h ^ h >> 32;
  }
};

/// Smooth normals: at each vertex position the mean of the normals of the adjoining triangles, weighted by their
/// angles, as Blender's Shade Smooth computes it; 0 if they cancel.
class AveragedNormals {
 public:
  AveragedNormals(const MeshFile& file, const std::vector<Triangle>& triangles) : place_(file.positions.size()) {
    std::unordered_map<std::array<float, 3>, std::size_t, PositionHash> places;
    for (std::size_t i = 0; i < file.positions.size(); ++i)
      place_[i] = places.try_emplace(file.positions[i], places.size()).first->second;
    sums_.assign(places.size(), Vector{0, 0, 0});
    for (const Triangle& t : triangles) {
      const double size = length(t.normal);
      if (size == 0) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto at = [&](std::size_t i) {
          return vertex_of(file.positions[std::size_t(t.corners[(k + i) % 3].position)]);
        };
        const Vector a = at(1) - at(0), b = at(2) - at(0);
        Vector& sum = sums_[place_[std::size_t(t.corners[k].position)]];
        sum = sum + t.normal * (std::atan2(size, dot(a, b)) / size);
      }
    }
  }
  std::size_t place(std::int32_t position) const { return place_[std::size_t(position)]; }
  Vector at(std::int32_t position) const { return sums_[place(position)]; }

 private:
  std::vector<std::size_t> place_;
  std::vector<Vector> sums_;
};

/// Makes vertices from corners; equal corners share a vertex.
class Vertices {
 public:
  Vertices(const MeshFile& file, Mesh& mesh, bool with_normals, bool with_uvs)
      : file_(file), mesh_(mesh), with_normals_(with_normals), with_uvs_(with_uvs) {}

  /// `normal` must not be zero. `key` must be the same for equal normals at that position.
  std::int32_t add(const Corner& corner, std::int64_t key, const Vector& normal) {
    const auto [found, is_new] =
        known_.try_emplace({corner.position, corner.uv, with_normals_ ? key : 0}, mesh_.vertices.size());
    if (is_new) {
      mesh_.vertices.push_back(file_.positions[std::size_t(corner.position)]);
      if (with_normals_) {
        const Vector n = normalize(normal);
        mesh_.normals.push_back({float(n.x), float(n.y), float(n.z)});
      }
      if (with_uvs_)
        mesh_.uvs.push_back(corner.uv < 0 ? std::array<float, 2>{0, 0} : file_.uvs[std::size_t(corner.uv)]);
    }
    return std::int32_t(found->second);
  }

 private:
  using Key = std::tuple<std::int32_t, std::int32_t, std::int64_t>;
  struct Hash {
    std::size_t operator()(const Key& k) const {
      std::uint64_t h = std::uint64_t(std::get<0>(k)) * 0x9e3779b97f4a7c15u;
      h = (h ^ std::uint64_t(std::get<1>(k))) * 0xbf58476d1ce4e5b9u;
      h = (h ^ std::uint64_t(std::get<2>(k))) * 0x94d049bb133111ebu;
      return h ^ h >> 29;
    }
  };
  const MeshFile& file_;
  Mesh& mesh_;
  bool with_normals_, with_uvs_;
  std::unordered_map<Key, std::size_t, Hash> known_;
};

MeshFile read_mesh_file(const fs::path& path) {
  if (!fs::is_regular_file(path)) input_error("{}: no such mesh file", path.string());
  const std::string type = ending(path);
  if (type == ".obj") return read_obj(path);
  if (type == ".ply") return read_ply(path);
  if (type == ".stl") return read_stl(path);
  if (type == ".gltf" || type == ".glb") return read_gltf(path);
  input_error("{}: expected a mesh file that ends in .obj, .ply, .stl, .gltf or .glb", path.string());
}

/// A count with a noun, "1 face of no area" or "2 faces of no area": the first word gets the plural ending.
std::string counted(std::size_t count, std::string_view what) {
  const std::string_view word = what.substr(0, what.find_first_of(" ,"));
  return fmt::format("{} {}{}{}", count, word, count == 1 ? "" : "s", what.substr(word.size()));
}

}  // namespace

void MeshFile::end_face(std::int32_t material) {
  const std::size_t begin = ends.empty() ? 0 : ends.back();
  if (corners.size() - begin < 3) {
    corners.resize(begin);
    ++left_out["face of less than three corners"];
    return;
  }
  ends.push_back(corners.size());
  materials.push_back(material);
}

std::int32_t MeshFile::material(std::string_view name) {
  const auto found = std::ranges::find(material_names, name);
  if (found == material_names.end()) material_names.emplace_back(name);
  return std::int32_t(std::ranges::find(material_names, name) - material_names.begin());
}

std::string read_bytes(const fs::path& path) {
  std::string bytes(fs::file_size(path), '\0');
  std::ifstream in(path, std::ios::binary);
  in.read(bytes.data(), std::streamsize(bytes.size()));
  if (!in) input_error("{}: can't read this file", path.string());
  return bytes;
}

Mesh read_mesh(const fs::path& path, bool smooth, const std::string& of_material, std::vector<std::string>* notes) {
  const MeshFile file = read_mesh_file(path);
  const std::string name = path.string();
  const auto note = [&](const std::string& text) {
    if (notes) notes->push_back(name + ": " + text);
  };
  std::vector<std::string> others;
  for (const auto& [what, count] : file.left_out) others.push_back(counted(count, what));
  if (file.ends.empty())
    input_error("{}: expected at least one triangle, got {}{}{}", name, counted(file.positions.size(), "point"),
                others.empty() ? "" : " and ", join(others, " and "));
  std::vector<bool> of_faces(file.material_names.size(), false);
  bool unnamed = false;
  for (const std::int32_t m : file.materials) m < 0 ? unnamed = true : of_faces[std::size_t(m)] = true;
  std::vector<std::string> used;
  for (std::size_t m = 0; m < of_faces.size(); ++m)
    if (of_faces[m]) used.push_back(file.material_names[m]);
  if (!of_material.empty() && !std::ranges::count(used, of_material))
    input_error(
        "{}: no face has the material '{}', expected {}", name, of_material,
        used.empty() ? "no \"of_material\", for the file names none" : fmt::format("one of {}", join(used, ", ")));

  const std::vector<Triangle> all = triangulate(file);
  const auto taken = [&](const Triangle& t) {
    const std::int32_t m = file.materials[t.face];
    return of_material.empty() || (m >= 0 && file.material_names[std::size_t(m)] == of_material);
  };
  const auto usable_normal = [&](const Corner& c) {
    const auto& n = file.normals[std::size_t(c.normal)];
    return is_finite(n) && n != std::array<float, 3>{0, 0, 0};
  };
  const auto usable_uv = [&](const Corner& c) { return c.uv >= 0 && is_finite(file.uvs[std::size_t(c.uv)]); };
  const bool with_normals =
      smooth && (!file.flat || std::ranges::any_of(file.corners, [](const Corner& c) { return c.normal >= 0; }));
  const bool with_uvs = std::ranges::any_of(file.corners, usable_uv);
  std::optional<AveragedNormals> averaged;
  if (with_normals) averaged.emplace(file, all);

  Mesh mesh;
  Vertices vertices(file, mesh, with_normals, with_uvs);
  std::size_t count = 0, without_area = 0, without_uvs = 0, bad_normals = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Triangle& t = all[i];
    if (!taken(t)) continue;
    ++count;
    for (const Corner& c : t.corners)
      if (!is_finite(file.positions[std::size_t(c.position)]))
        input_error("{}: vertex {} is not finite", name, c.position + 1);
    // Triangles without an area reflect nothing and have no normal.
    if (length(t.normal) == 0) {
      ++without_area;
      continue;
    }
    std::array<std::int32_t, 3> triangle;
    bool lacks_uvs = false, bad_normal = false;
    for (std::size_t k = 0; k < 3; ++k) {
      Corner c = t.corners[k];
      if (!usable_uv(c)) c.uv = -1, lacks_uvs = true;
      // Keys below 0 belong to flat facets, those from 0 on to the file's normals, and those after them to smooth
      // normals.
      std::int64_t key = -1 - std::int64_t(i);
      Vector normal = t.normal;
      if (with_normals && c.normal >= 0) {
        if (usable_normal(c))
          key = c.normal, normal = vertex_of(file.normals[std::size_t(c.normal)]);
        else
          bad_normal = true;
      } else if (with_normals && !file.flat && length(averaged->at(c.position)) > 0) {
        key = std::int64_t(file.normals.size() + averaged->place(c.position)), normal = averaged->at(c.position);
      }
      triangle[k] = vertices.add(c, key, normal);
    }
    mesh.triangles.push_back(triangle);
    without_uvs += lacks_uvs;
    bad_normals += bad_normal;
  }

  std::string summary = counted(count, "triangle");
  if (!of_material.empty()) summary += fmt::format(" of the material '{}', of {} in all", of_material, all.size());
  if (without_area) others.insert(others.begin(), counted(without_area, "triangle without area"));
  if (!others.empty()) summary += fmt::format("; left out: {}", join(others, ", "));
  note(summary);
  if (mesh.triangles.empty()) input_error("{}: expected at least one triangle, got {}", name, summary);
  if (bad_normals)
    note(counted(bad_normals, "triangle with normals") + " of length 0 in the file, shaded flat at these corners");
  if (with_uvs && without_uvs)
    note(counted(without_uvs, "triangle without UVs") + ", where textures show the colour of their lower left corner");
  const std::size_t materials = used.size() + (unnamed ? 1 : 0);
  if (of_material.empty() && materials > 1)
    note(
        fmt::format("{} materials in the file ({}{}), all shown as the object's one; \"of_material\" in the shape "
                    "takes the faces of one of them",
                    materials, join(used, ", "), unnamed ? " and one without a name" : ""));
  check_mesh(mesh, name);
  return mesh;
}

}  // namespace brdfc::reference
