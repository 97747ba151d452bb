// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the Blender extension: shaders, tables, manifest and the add-on's Python, as a folder and as a zip.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "forms/form.h"
#include "plan/costs.h"
#include "plan/plan.h"

namespace brdfc::pack {

struct Options {
  std::filesystem::path out;               ///< folder for brdfc_shaders/ and the zip, ID-<version>.zip
  std::filesystem::path addon;             ///< folder with the add-on's Python and blender_manifest.toml
  std::filesystem::path python;            ///< folder with the Python package's hand-written files
  std::vector<plan::PlannedModel> models;  ///< what to include of each model
  plan::Costs costs = {};                  ///< shown in the panel
  std::function<void(const std::string& what, int done, int total)> progress;  ///< may be empty
  std::string cut = {};  ///< name of the scene that models are cut to, for an own id (addon.h); empty: not cut
};

/// A line of the table that a build prints.
struct Line {
  std::string model, representation;
  int closures = 0, slots = 0, operations = 0, statements = 0;
  forms::FormError error;
  std::size_t table_floats = 0;
  double table_error = 0;
  std::size_t bytes = 0;         ///< size of the shader's text
  std::size_t albedo_bytes = 0;  ///< size of the text for its Albedo output, if that is a separate shader
  /// The same for a form with nothing left out, `whole_bytes` for both texts together. Equal to the values above if
  /// nothing is left out.
  int whole_closures = 0, whole_operations = 0, whole_statements = 0;
  std::size_t whole_table_floats = 0, whole_bytes = 0;
};

struct Result {
  std::filesystem::path folder, zip;
  std::vector<Line> lines;
};

/// Throws InputError if `out` has a folder with the extension's name that this tool did not write, because build_pack()
/// deletes its contents.
void require_target(const std::filesystem::path& out);

/// Builds beside the target and then renames, so that the target is either complete or untouched. The same models give
/// the same bytes. Throws InputError (paths, names) or ValueError (a model that returns an invalid value).
Result build_pack(const Options&);

}  // namespace brdfc::pack
