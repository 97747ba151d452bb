// SPDX-License-Identifier: GPL-3.0-or-later
// Models as files of BRDF Explorer, Disney's program that plots BRDFs.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::pack {

struct BrdfFiles {
  /// Text by name: MODEL.brdf, or MODEL-OPTION.brdf for each combination of choices.
  std::map<std::string, std::string> texts;
  /// Why models or combinations have no file, a sentence each.
  std::vector<std::string> left_out;
};

/// Files with the formula of f in GLSL. Numbers have the range of their slider. `library`: explorer/library.glsl, whose
/// functions the formulas call. Such a file can't hold a table, nor light that is ideally reflected or passes through.
BrdfFiles brdf_files(const std::vector<const Model*>&, const std::filesystem::path& library);

}  // namespace brdfc::pack
