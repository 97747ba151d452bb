// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/data_dir.h"

#include <cstdlib>

#include "core/error.h"
#include "core/process.h"

namespace brdfc::inline core {
namespace {

namespace fs = std::filesystem;

/// A file that marks the data folder. No other folder has a file of this name by accident.
constexpr const char* kSign = "blender_addon/blender_manifest.toml";

bool holds_data(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / kSign, ignored);
}

}  // namespace

fs::path data_dir(const fs::path& needed) {
  const std::string missing = (needed.empty() ? fs::path(kSign) : needed).generic_string();
  if (const char* given = std::getenv("BRDFC_DATA"); given && *given) {
    if (!holds_data(given))
      input_error(
          "{} is needed: expected the tool's data in BRDFC_DATA={}: share/brdfc of an installation, or the sources",
          missing, given);
    return given;
  }
  const fs::path program = program_file(), installed = program.parent_path().parent_path() / "share" / "brdfc";
  if (holds_data(installed)) return installed;
  for (fs::path above = program.parent_path(); above != above.parent_path(); above = above.parent_path())
    if (holds_data(above)) return above;
  input_error(
      "{} is needed, and the tool's data were not found: looked for in {} and in the folders above {}; the environment "
      "variable BRDFC_DATA names another folder",
      missing, installed.string(), program.string());
}

fs::path data_path(const fs::path& needed) { return data_dir(needed) / needed; }

std::optional<fs::path> cache_dir() {
  if (const char* given = std::getenv("BRDFC_CACHE")) return *given ? std::optional<fs::path>(given) : std::nullopt;
  if (const char* base = std::getenv("XDG_CACHE_HOME"); base && fs::path(base).is_absolute())
    return fs::path(base) / "brdfc";
  if (const char* home = std::getenv("HOME"); home && *home) return fs::path(home) / ".cache" / "brdfc";
  return std::nullopt;
}

}  // namespace brdfc::inline core
