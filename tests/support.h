// SPDX-License-Identifier: GPL-3.0-or-later
// Helpers that several tests need.
#pragma once

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "core/error.h"
#include "model/model.h"

namespace brdfc {

/// All parameters of a model: those in `text` as name=value, the others at their defaults.
inline ParamValues values_of(const Model& m, const std::vector<std::string>& text) {
  return complete(m.info(), parse_values(m.info(), text));
}

/// The names of all registered models.
inline std::vector<std::string> model_names() {
  std::vector<std::string> names;
  for (const auto& [name, model] : models()) names.push_back(name);
  return names;
}

/// The message of the exception that f throws.
template <class F> std::string message(const F& f) {
  try {
    f();
  } catch (const ValueError& e) {
    return e.what();
  }
  return "no ValueError";
}

/// A new folder, which is deleted with this object.
class TempFolder {
 public:
  TempFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "brdfc-test-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::system_error(errno, std::generic_category(), name);
    path_ = name;
  }
  ~TempFolder() { std::filesystem::remove_all(path_); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace brdfc
