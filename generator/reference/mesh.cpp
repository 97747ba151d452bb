// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/mesh.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <string_view>

#include "core/error.h"
#include "core/parse.h"
#include "core/write_beside.h"

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

/// A header is this, the numbers of rows and columns with a comma between them, the end, and white space.
template <class T> std::string header_start() {
  return fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': (", npy_type<T>());
}
constexpr const char* kHeaderEnd = "), }";

/// The number of rows of an array with this many columns; nullopt if the header is another one.
template <class T> std::optional<std::size_t> rows_stated(std::string_view header, std::size_t columns) {
  const std::string start = header_start<T>(), end = fmt::format(", {}{}", columns, kHeaderEnd);
  header = header.substr(0, header.find_last_not_of(" \t\n\r\v\f") + 1);
  if (!header.starts_with(start) || !header.ends_with(end) || header.size() < start.size() + end.size()) return {};
  header.remove_prefix(start.size());
  header.remove_suffix(end.size());
  return header.size() <= 9 ? parse<std::size_t>(header) : std::nullopt;
}

}  // namespace

template <class T>
void write_npy(const std::filesystem::path& path, const T* data, std::size_t rows, std::size_t columns) {
  std::string header = fmt::format("{}{}, {}{}", header_start<T>(), rows, columns, kHeaderEnd);
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
  const std::optional<std::size_t> stated = rows_stated<T>(header, columns);
  if (!in || !stated) input_error("{}: {}", name, expected);
  const std::size_t rows = *stated;
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
