// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/tensor_file.h"

#include <cmath>

namespace brdfc::measured {
namespace {

/// By the number that stands for a type in the file.
struct Type {
  const char* name;
  std::size_t bytes;
};
constexpr Type kTypes[] = {{"none", 0},  {"uint8", 1},  {"int8", 1},  {"uint16", 2},  {"int16", 2},   {"uint32", 4},
                           {"int32", 4}, {"uint64", 8}, {"int64", 8}, {"float16", 2}, {"float32", 4}, {"float64", 8}};
constexpr int kUint8 = 1, kFloat32 = 10;

std::string printable(const std::string& text) {
  std::string out;
  for (const char c : text) out += c >= ' ' && c < 127 ? c : '?';
  return out;
}

}  // namespace

TensorFile::TensorFile(const std::filesystem::path& path) : file_(path) {
  const std::string magic("tensor_file\0", 12);
  if (file_.size() < 18 || file_.text(12, "header") != magic)
    input_error("{}: expected a tensor file, which starts with \"tensor_file\"", name());
  const auto version = file_.numbers<std::uint8_t>(2, "version");
  if (version[0] != 1) input_error("{}: version: expected 1.0, got {}.{}", name(), int(version[0]), int(version[1]));
  const auto count = file_.number<std::uint32_t>("number of fields");
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string what = fmt::format("field {} of {}", i + 1, count);
    const std::string field = printable(file_.text(file_.number<std::uint16_t>(what), what));
    const std::size_t dimensions = file_.number<std::uint16_t>(field);
    Field f{};
    f.type = file_.number<std::uint8_t>(field);
    f.place = file_.number<std::uint64_t>(field);
    if (f.type < 1 || f.type >= int(std::size(kTypes)))
      input_error("{}: {}: expected a type from 1 to {}, got {}", name(), field, std::size(kTypes) - 1, f.type);
    std::uint64_t entries = 1;
    const std::uint64_t room = f.place <= file_.size() ? (file_.size() - f.place) / kTypes[f.type].bytes : 0;
    for (const std::uint64_t size : file_.numbers<std::uint64_t>(dimensions, field)) {
      if (size > 0 && entries > room / size)
        input_error("{}: {}: expected its data inside the file, which has {} bytes: truncated?", name(), field,
                    file_.size());
      entries *= size;
      f.shape.push_back(std::size_t(size));
    }
    if (f.place > file_.size() || entries > room)
      input_error("{}: {}: expected its data inside the file, which has {} bytes: truncated?", name(), field,
                  file_.size());
    if (!fields_.emplace(field, std::move(f)).second) input_error("{}: {}: expected each field once", name(), field);
  }
}

void TensorFile::fail(const std::string& field, const std::string& expected) const {
  input_error("{}: {}: expected {}", name(), field, expected);
}

const std::vector<std::size_t>& TensorFile::shape(const std::string& field, std::size_t dimensions) const {
  if (!has(field)) fail(field, "this field, found none of the name");
  const std::vector<std::size_t>& shape = fields_.at(field).shape;
  if (shape.size() != dimensions) fail(field, fmt::format("{} dimensions, got {}", dimensions, shape.size()));
  for (const std::size_t size : shape)
    if (size == 0) fail(field, "data, got a size of 0");
  return shape;
}

const TensorFile::Field& TensorFile::field(const std::string& field, int type) {
  if (!has(field)) fail(field, "this field, found none of the name");
  const Field& f = fields_.at(field);
  if (f.type != type) fail(field, fmt::format("numbers of type {}, got {}", kTypes[type].name, kTypes[f.type].name));
  return f;
}

std::vector<float> TensorFile::numbers(const std::string& name) {
  const Field& f = field(name, kFloat32);
  std::size_t count = 1;
  for (const std::size_t size : f.shape) count *= size;
  file_.seek(f.place);
  std::vector<float> out = file_.numbers<float>(count, name);
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite(out[i])) fail(name, fmt::format("finite numbers, got {} at {}", out[i], i));
  return out;
}

std::vector<std::uint8_t> TensorFile::bytes(const std::string& name) {
  const Field& f = field(name, kUint8);
  std::size_t count = 1;
  for (const std::size_t size : f.shape) count *= size;
  file_.seek(f.place);
  return file_.numbers<std::uint8_t>(count, name);
}

}  // namespace brdfc::measured
