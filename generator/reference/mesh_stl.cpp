// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cctype>
#include <cstring>

#include "core/error.h"
#include "core/parse.h"
#include "reference/mesh_file.h"

namespace brdfc::reference {

namespace {

/// The binary format: a header of 80 bytes, the number of triangles, then 50 bytes for each: a normal, three corners,
/// and two bytes of attributes.
constexpr std::size_t kHead = 84, kEach = 50;

MeshFile read_binary(const std::string& bytes, std::size_t count) {
  MeshFile file;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::array<float, 3> p;
      std::memcpy(p.data(), &bytes[kHead + i * kEach + 12 * (k + 1)], sizeof p);
      file.corners.push_back({std::int32_t(file.positions.size()), -1, -1});
      file.positions.push_back(p);
    }
    file.end_face();
  }
  return file;
}

MeshFile read_text(const std::string& name, std::string_view text) {
  MeshFile file;
  int line = 1;
  const auto next = [&] {
    std::size_t i = 0;
    for (; i < text.size() && std::isspace(static_cast<unsigned char>(text[i])); ++i) line += text[i] == '\n';
    text.remove_prefix(i);
    const std::string_view word = text.substr(0, text.find_first_of(" \t\r\n\v\f"));
    text.remove_prefix(word.size());
    return word;
  };
  const auto lower = [](std::string_view word) {
    std::string out(word);
    std::ranges::transform(out, out.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return out;
  };
  bool in_loop = false;
  for (std::string_view word = next(); !word.empty(); word = next()) {
    const std::string key = lower(word);
    if (key == "loop") {
      if (in_loop) input_error("{} line {}: a loop within a loop", name, line);
      in_loop = true;
    } else if (key == "vertex") {
      if (!in_loop) input_error("{} line {}: a vertex outside of a loop", name, line);
      std::array<float, 3> p;
      for (float& x : p) {
        std::string_view number = next();
        const std::string_view all = number;
        if (number.starts_with('+')) number.remove_prefix(1);
        const auto value = parse<double>(number);
        if (!value) input_error("{} line {}: expected three numbers, got '{:.60}'", name, line, all);
        x = float(*value);
      }
      file.corners.push_back({std::int32_t(file.positions.size()), -1, -1});
      file.positions.push_back(p);
    } else if (key == "endloop") {
      if (!in_loop) input_error("{} line {}: the end of a loop that was not begun", name, line);
      in_loop = false;
      file.end_face();
    } else if (key == "solid" || key == "endsolid") {  // a name follows, which may have any words
      text.remove_prefix(std::min(text.find('\n'), text.size()));
    }
  }
  if (in_loop) input_error("{}: the file ends within a facet", name);
  return file;
}

}  // namespace

MeshFile read_stl(const std::filesystem::path& path) {
  const std::string bytes = read_bytes(path);
  std::uint32_t count = 0;
  if (bytes.size() >= kHead) std::memcpy(&count, &bytes[kHead - 4], sizeof count);
  const std::size_t expected = kHead + kEach * std::size_t(count);
  // Binary files may also begin with "solid", and some have bytes after the last triangle.
  const bool text = bytes.starts_with("solid") && bytes.find('\0') == bytes.npos;
  MeshFile file;
  if (bytes.size() >= kHead && (bytes.size() == expected || !text)) {
    if (bytes.size() < expected)
      input_error("{}: {} triangles need {} bytes, the file has {}", path.string(), count, expected, bytes.size());
    file = read_binary(bytes, count);
  } else {
    const std::size_t begin = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
    std::string start = bytes.substr(begin, 5);
    std::ranges::transform(start, start.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    if (start != "solid")
      input_error("{}: not an STL file, which is binary with a head of 84 bytes or begins with \"solid\"",
                  path.string());
    file = read_text(path.string(), bytes);
  }
  file.flat = true;
  return file;
}

}  // namespace brdfc::reference
