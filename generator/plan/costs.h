// SPDX-License-Identifier: GPL-3.0-or-later
// What rendering with a form costs, as script/bench measured it.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "forms/form.h"
#include "model/model.h"

namespace brdfc::plan {

/// CPU time of forms with their model's default parameters, sampled ones with one direction, at equal samples and in
/// units of Blender's Glossy node.
class Costs {
 public:
  /// None is known.
  Costs() = default;
  /// The table of script/bench, its further columns ignored; without a file none is known. Throws InputError naming
  /// file, line, column and what was expected.
  explicit Costs(const std::filesystem::path&);

  /// Of a form of a model; nothing where it was not measured.
  std::optional<double> of(const Model&, const forms::Form&) const;

 private:
  std::map<std::pair<std::string, std::string>, double> costs_;  // by model and form
};

}  // namespace brdfc::plan
