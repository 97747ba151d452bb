// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/mesh.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <regex>

#include "core/error.h"
#include "reference/image.h"

namespace brdfc::reference {

static_assert(std::endian::native == std::endian::little, "the .npy code writes memory as it is");

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
  header.append(63 - (10 + header.size()) % 64, ' ');  // pads the header: the data start at a multiple of 64 bytes
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
