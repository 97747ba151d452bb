// SPDX-License-Identifier: GPL-3.0-or-later
// What stands between the program and OpenImageIO. If it is a module, this side of it is a shared library of its own.
// So errors are returned, not thrown: two libraries may hold two copies of an exception's type.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "pictures/pictures.h"

namespace brdfc::pictures {

/// The functions of pictures.h with the same names.
class Library {
 public:
  virtual ~Library() = default;
  virtual std::unique_ptr<Reader> open(const std::filesystem::path&, std::string& reason,
                                       const std::string& format) const = 0;
  virtual std::optional<WriteError> write(const std::filesystem::path&, const Header&, const float*) const = 0;
  virtual std::optional<WriteError> write(const std::filesystem::path&, const Header&, const unsigned char*) const = 0;
};

/// The library in a module, which stays loaded until the program ends. Throws InputError that names the file and says
/// why it can't be loaded.
const Library& load(const std::filesystem::path& module);

}  // namespace brdfc::pictures

/// What the program looks up in the module.
extern "C" const brdfc::pictures::Library* brdfc_pictures_library();
