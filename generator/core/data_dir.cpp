// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/data_dir.h"

#include <cstdlib>

#include "core/error.h"
#include "core/process.h"

namespace brdfc::inline core {
namespace {

namespace fs = std::filesystem;

/// No folder has a file of this name by chance.
constexpr const char* kSign = "blender_addon/blender_manifest.toml";

bool holds_data(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / kSign, ignored);
}

}  // namespace

fs::path data_dir() {
  if (const char* given = std::getenv("BRDFC_DATA"); given && *given) {
    if (!holds_data(given))
      input_error("BRDFC_DATA={}: expected a folder with {}: share/brdfc of an installation, or the sources", given,
                  kSign);
    return given;
  }
  const fs::path program = program_file(), installed = program.parent_path().parent_path() / "share" / "brdfc";
  if (holds_data(installed)) return installed;
  for (fs::path above = program.parent_path(); above != above.parent_path(); above = above.parent_path())
    if (holds_data(above)) return above;
  input_error(
      "the tool's data: expected {} in {} or a folder above {}; the environment variable BRDFC_DATA names another "
      "folder",
      kSign, installed.string(), program.string());
}

}  // namespace brdfc::inline core
