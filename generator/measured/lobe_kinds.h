// SPDX-License-Identifier: GPL-3.0-or-later
// The lobes of which sums are made: models with all choices made and one colour, over ranges of their numbers.
#pragma once

#include <string>
#include <vector>

#include "core/axis_scale.h"
#include "measured/search_range.h"
#include "model/model.h"

namespace brdfc::measured {

struct LobeKind {
  struct Number {
    std::vector<std::string> names;  ///< parameters that have one value
    ScaledRange range;
    int places;  ///< where it is tried before a search
    SearchRange search = SearchRange(range);
  };
  const Model* model;
  ParamValues values;  ///< complete
  std::string color;   ///< f grows with it
  std::vector<Number> numbers;
  /// False if some device renders it by an approximation (docs/nodes.md).
  bool everywhere = true;
};

/// The lobes of the models with these names, for data that are isotropic or not; of all that have some if there are no
/// names. Throws InputError for a model that has none.
std::vector<LobeKind> lobe_kinds(const std::vector<std::string>& names, bool isotropic);

}  // namespace brdfc::measured
