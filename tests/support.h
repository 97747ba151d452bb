// SPDX-License-Identifier: GPL-3.0-or-later
// Helpers that several tests need.
#pragma once

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <system_error>
#include <type_traits>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
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

/// A third of the cases of a test that takes long, another at every commit, which script/test names in BRDFC_CELL.
/// Without it, and in evidence/run, which sets BRDFC_EVIDENCE, all. Of those that `kind` tells apart, a third of each
/// kind and at least one.
template <class Cases, class Kind> auto third_of(const Cases& cases, const Kind& kind) {
  using Case = std::decay_t<decltype(*std::begin(cases))>;
  const char *cell = std::getenv("BRDFC_CELL"), *evidence = std::getenv("BRDFC_EVIDENCE");
  const bool all = !cell || (evidence && std::string(evidence) == "all");
  const std::size_t first = all ? 0 : std::stoull(sha256(cell).substr(0, 8), nullptr, 16) % 6;
  std::map<std::string, std::size_t> count, seen;
  for (const Case& c : cases) ++count[kind(c)];
  std::vector<Case> chosen;
  for (const Case& c : cases) {
    const std::size_t step = all ? 1 : std::min<std::size_t>(3, count[kind(c)]);
    if (seen[kind(c)]++ % step == first % step) chosen.push_back(c);
  }
  return chosen;
}
template <class Cases> auto third_of(const Cases& cases) {
  return third_of(cases, [](const auto&) { return std::string(); });
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
