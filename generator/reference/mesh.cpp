// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/mesh.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "core/error.h"
#include "core/scalar.h"
#include "reference/image.h"

namespace brdfc::reference {

static_assert(std::endian::native == std::endian::little, "the .npy code writes memory as it is");

namespace {

/// Refuses a PLY file whose header is damaged or promises more than the file holds: there the importer loops for ever.
void check_ply_header(const std::filesystem::path& path) {
  static const std::set<std::string> types{"char", "uchar", "short", "ushort", "int",   "uint",   "float",   "double",
                                           "int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"};
  const double size = double(std::filesystem::file_size(path));
  std::ifstream in(path, std::ios::binary);
  bool format = false, element = false;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream text(line.substr(0, 4096));
    std::vector<std::string> words{std::istream_iterator<std::string>(text), {}};
    const std::string first = words.empty() ? std::string() : words[0];
    bool good = false;
    if (number == 1) {
      good = line == "ply" || line == "ply\r";
    } else if (first == "comment" || first == "obj_info") {
      good = true;
    } else if (first == "format") {
      good = !format && words.size() == 3 && words[2] == "1.0" &&
             (words[1] == "ascii" || words[1] == "binary_little_endian" || words[1] == "binary_big_endian");
      format = true;
    } else if (first == "element") {
      // An element without a byte of its own would not end the file however many there are.
      good = words.size() == 3 && !words[2].empty() && words[2].size() < 16 &&
             words[2].find_first_not_of("0123456789") == std::string::npos && std::stod(words[2]) <= size;
      element = true;
    } else if (first == "property") {
      const bool list = words.size() > 1 && words[1] == "list";
      good = element && words.size() == (list ? 5 : 3) && types.count(words[list ? 2 : 1]) &&
             (!list || types.count(words[3]));
    } else if (first == "end_header") {
      if (format && element && words.size() == 1) return;
    }
    if (!good) input_error("{}: line {} does not belong in the header of a PLY file", path.string(), number);
  }
  input_error("{}: a PLY file whose header does not end", path.string());
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& path, bool smooth) {
  if (!std::filesystem::is_regular_file(path)) input_error("{}: no such mesh file", path.string());
  const std::string type = ending(path);
  // The importer knows some fifty formats more, many of them poorly guarded against damaged files.
  if (type != ".obj" && type != ".ply" && type != ".stl")
    input_error("{}: expected a mesh file that ends in .obj, .ply or .stl", path.string());
  if (type == ".ply") check_ply_header(path);
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // Triangles without area reflect nothing, and have no normal.
  importer.SetPropertyInteger(AI_CONFIG_PP_FD_REMOVE, 1);
  const unsigned steps = aiProcess_Triangulate | aiProcess_FindDegenerates | aiProcess_SortByPType |
                         aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices |
                         (smooth ? aiProcess_GenSmoothNormals : 0u);
  const aiScene* scene = importer.ReadFile(path.string(), aiProcess_ValidateDataStructure);
  // The other steps end the program where a face has no corner.
  for (unsigned m = 0; scene && m < scene->mNumMeshes; ++m)
    for (unsigned i = 0; i < scene->mMeshes[m]->mNumFaces; ++i)
      if (scene->mMeshes[m]->mFaces[i].mNumIndices == 0)
        input_error("{}: face {} of mesh {} has no corners", path.string(), i, m);
  if (scene) scene = importer.ApplyPostProcessing(steps);
  if (!scene) input_error("{}: not a mesh that can be read ({})", path.string(), importer.GetErrorString());
  Mesh mesh;
  bool all_uvs = true;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) all_uvs &= scene->mMeshes[m]->HasTextureCoords(0);
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    // Vertices that no triangle uses may lack a normal.
    std::vector<bool> used(part.mNumVertices, false);
    for (unsigned i = 0; i < part.mNumFaces; ++i)
      for (unsigned k = 0; k < part.mFaces[i].mNumIndices; ++k) used.at(part.mFaces[i].mIndices[k]) = true;
    std::vector<std::size_t> index(part.mNumVertices, 0);
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
      if (!used[i]) continue;
      index[i] = mesh.vertices.size();
      const aiVector3D& p = part.mVertices[i];
      mesh.vertices.push_back({p.x, p.y, p.z});
      if (smooth) {
        const aiVector3D& n = part.mNormals[i];
        mesh.normals.push_back({n.x, n.y, n.z});
      }
      if (all_uvs) mesh.uvs.push_back({part.mTextureCoords[0][i].x, part.mTextureCoords[0][i].y});
    }
    for (unsigned i = 0; i < part.mNumFaces; ++i) {
      const aiFace& face = part.mFaces[i];
      const auto corner = [&](int k) { return std::int32_t(index[face.mIndices[k]]); };
      if (face.mNumIndices == 3) mesh.triangles.push_back({corner(0), corner(1), corner(2)});
    }
  }
  check_mesh(mesh, path.string());
  return mesh;
}

void check_mesh(const Mesh& mesh, const std::string& name) {
  const std::size_t n = mesh.vertices.size();
  if (n == 0 || mesh.triangles.empty()) input_error("{}: expected at least one triangle", name);
  if (!mesh.normals.empty() && mesh.normals.size() != n)
    input_error("{}: {} normals for {} vertices", name, mesh.normals.size(), n);
  if (!mesh.uvs.empty() && mesh.uvs.size() != n) input_error("{}: {} uvs for {} vertices", name, mesh.uvs.size(), n);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::int32_t v : mesh.triangles[i])
      if (v < 0 || std::size_t(v) >= n) input_error("{}: triangle {} uses vertex {} of {}", name, i, v, n);
  const auto check = [&](const auto& list, const char* what) {
    for (std::size_t i = 0; i < list.size(); ++i)
      for (const float x : list[i])
        if (!std::isfinite(x)) input_error("{}: {} {} is not finite", name, what, i);
  };
  check(mesh.vertices, "vertex");
  check(mesh.normals, "normal");
  check(mesh.uvs, "uv");
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    const auto& v = mesh.normals[i];
    if (v[0] == 0 && v[1] == 0 && v[2] == 0) input_error("{}: normal {} has length 0", name, i);
  }
}

namespace {

template <class T> const char* npy_type();
template <> const char* npy_type<float>() { return "<f4"; }
template <> const char* npy_type<std::int32_t>() { return "<i4"; }

constexpr char kMagic[] = "\x93NUMPY\x01\x00";

}  // namespace

template <class T>
void write_npy(const std::filesystem::path& path, const T* data, std::size_t rows, std::size_t columns) {
  std::string header =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}, {}), }}", npy_type<T>(), rows, columns);
  header.append(63 - (10 + header.size()) % 64, ' ');  // the data start at a multiple of 64 bytes
  header += '\n';
  write_beside(path, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    const std::uint16_t length = std::uint16_t(header.size());
    out.write(kMagic, 8);
    out.write(reinterpret_cast<const char*>(&length), 2);
    out << header;
    out.write(reinterpret_cast<const char*>(data), std::streamsize(rows * columns * sizeof(T)));
    out.close();
    if (!out) input_error("{}: can't write", path.string());
  });
}

template <class T> std::vector<T> read_npy(const std::filesystem::path& path, std::size_t columns) {
  const std::string name = path.string();
  if (!std::filesystem::is_regular_file(path)) input_error("{}: no such file", name);
  const std::string expected = fmt::format("expected a C-ordered array of {} of shape (n, {})", npy_type<T>(), columns);
  std::ifstream in(path, std::ios::binary);
  char magic[8];
  std::uint16_t length = 0;
  in.read(magic, 8);
  in.read(reinterpret_cast<char*>(&length), 2);
  if (!in || std::memcmp(magic, kMagic, 8) != 0) input_error("{}: not a .npy file of version 1.0, {}", name, expected);
  std::string header(length, ' ');
  in.read(header.data(), length);
  static const std::regex form(
      R"(\{'descr': '(.*)', 'fortran_order': (True|False), 'shape': \((\d{1,9}), (\d{1,9})\), \}\s*)");
  std::smatch match;
  if (!in || !std::regex_match(header, match, form) || match[1] != npy_type<T>() || match[2] != "False" ||
      std::stoul(match[4]) != columns)
    input_error("{}: {}", name, expected);
  const std::size_t rows = std::stoul(match[3]);
  const std::size_t bytes = rows * columns * sizeof(T);
  if (std::filesystem::file_size(path) != 10 + length + bytes)
    input_error("{}: {} rows need {} bytes of data, the file has {}", name, rows, bytes,
                std::filesystem::file_size(path) - 10 - length);
  std::vector<T> data(rows * columns);
  in.read(reinterpret_cast<char*>(data.data()), std::streamsize(bytes));
  if (!in) input_error("{}: can't read this file", name);
  return data;
}

template void write_npy<float>(const std::filesystem::path&, const float*, std::size_t, std::size_t);
template void write_npy<std::int32_t>(const std::filesystem::path&, const std::int32_t*, std::size_t, std::size_t);
template std::vector<float> read_npy<float>(const std::filesystem::path&, std::size_t);
template std::vector<std::int32_t> read_npy<std::int32_t>(const std::filesystem::path&, std::size_t);

}  // namespace brdfc::reference
