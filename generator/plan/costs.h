// SPDX-License-Identifier: GPL-3.0-or-later
// The render cost of forms, as evidence/bench measured it.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "forms/form.h"
#include "model/model.h"

namespace brdfc::plan {

/// CPU times of forms with their model's default parameters (sampled forms with one direction), at equal samples, in
/// units of Blender's Glossy node.
class Costs {
 public:
  /// No costs are known.
  Costs() = default;
  /// Reads the table of evidence/bench, ignoring further columns. If there is no file, no costs are known. Throws
  /// InputError naming file, line, column and what was expected.
  explicit Costs(const std::filesystem::path&);

  /// The cost of a form of a model; nullopt if it was not measured.
  std::optional<double> of(const Model&, const forms::Form&) const;

 private:
  std::map<std::pair<std::string, std::string>, double> costs_;  // by model and form
};

}  // namespace brdfc::plan
