// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/data_dir.h"

#include <cstdlib>
#include <vector>

#include "core/error.h"

namespace brdfc::inline core {
namespace {

namespace fs = std::filesystem;

/// No folder has a file of this name by chance.
constexpr const char* kSign = "blender_addon/blender_manifest.toml";

bool holds_data(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / kSign, ignored);
}

/// The folder of the running program, links followed; empty where the system does not tell.
fs::path program_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path() : program.parent_path();
}

}  // namespace

fs::path data_dir() {
  if (const char* given = std::getenv("BRDFC_DATA"); given && *given) {
    if (!holds_data(given))
      input_error("BRDFC_DATA={}: expected a folder with {}: share/brdfc of an installation, or the sources", given,
                  kSign);
    return given;
  }
  std::vector<fs::path> places;
  if (const fs::path program = program_folder(); !program.empty())
    places.push_back(program.parent_path() / "share" / "brdfc");
  places.push_back(BRDFC_SOURCE_DIR);
  for (const fs::path& place : places)
    if (holds_data(place)) return place;
  std::string tried;
  for (const fs::path& place : places) tried += (tried.empty() ? "" : " or ") + place.string();
  input_error("the tool's data: expected {} in {}; the environment variable BRDFC_DATA names another folder", kSign,
              tried);
}

}  // namespace brdfc::inline core
