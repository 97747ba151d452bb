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
  std::filesystem::path out;               ///< folder that receives brdfc_shaders/ and the zip, ID-<version>.zip
  std::filesystem::path addon;             ///< folder with the add-on's Python and blender_manifest.toml
  std::filesystem::path python;            ///< folder with what the Python package has by hand
  std::vector<plan::PlannedModel> models;  ///< what of each model
  plan::Costs costs = {};                  ///< for the panel
  std::function<void(const std::string& what, int done, int total)> progress;  ///< may be empty
  std::string cut = {};  ///< name of what the models are cut to, for an id of its own (addon.h); empty: nothing
};

/// A line of the table that a build prints.
struct Line {
  std::string model, representation;
  int closures = 0, slots = 0, operations = 0, statements = 0;
  forms::FormError error;
  std::size_t table_floats = 0;
  double table_error = 0;
  std::size_t bytes = 0;         ///< of the shader's text
  std::size_t albedo_bytes = 0;  ///< of that of its Albedo output, where that is a shader of its own
  /// The same with nothing left out, bytes of both texts together; equal where nothing is.
  int whole_closures = 0, whole_operations = 0, whole_statements = 0;
  std::size_t whole_table_floats = 0, whole_bytes = 0;
};

struct Result {
  std::filesystem::path folder, zip;
  std::vector<Line> lines;
};

/// Throws InputError if `out` has a folder of the extension's name that this tool did not write: build_pack() deletes
/// what is in it.
void require_target(const std::filesystem::path& out);

/// Builds beside the target and renames, so that a target is whole or untouched. The same models give the same
/// bytes. Throws InputError (paths, names) or ValueError (a model that gives a bad value).
Result build_pack(const Options&);

}  // namespace brdfc::pack
