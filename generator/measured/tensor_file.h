// SPDX-License-Identifier: GPL-3.0-or-later
// The container of RGL's .bsdf files: named arrays of any dimension.
//
// "tensor_file\0", a version of two bytes, the number of fields (uint32), and for each field the length of its name
// (uint16), the name, the number of dimensions (uint16), the type (uint8), the place of its data in the file (uint64)
// and its size along each dimension (uint64).
#pragma once

#include <map>
#include <optional>
#include <set>

#include "measured/binary_file.h"

namespace brdfc::measured {

class TensorFile {
 public:
  struct Field {
    int type;
    std::uint64_t place;
    std::vector<std::size_t> shape;
  };
  /// Reads the list of fields. Throws InputError if it is not one, or if a field's data are not in the file.
  explicit TensorFile(const std::filesystem::path&);

  const std::string& name() const { return file_.name(); }
  bool has(const std::string& field) const { return fields_.count(field) > 0; }
  const std::map<std::string, Field>& fields() const { return fields_; }
  /// The size of a field, which must have this number of dimensions, none of size 0.
  const std::vector<std::size_t>& shape(const std::string& field, std::size_t dimensions) const;
  /// Numbers of 32-bit floating point, which must be finite.
  std::vector<float> numbers(const std::string& field);
  std::vector<std::uint8_t> bytes(const std::string& field);
  [[noreturn]] void fail(const std::string& field, const std::string& expected) const;

 private:
  const Field& field(const std::string&, int type);
  BinaryFile file_;
  std::map<std::string, Field> fields_;
};

}  // namespace brdfc::measured
