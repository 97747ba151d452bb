// SPDX-License-Identifier: GPL-3.0-or-later
// The lobes of which sums are made: models with all choices made and one colour, over ranges of their numbers.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "core/axis_scale.h"
#include "model/model.h"

namespace brdfc::measured {

struct LobeKind {
  struct Number {
    std::vector<std::string> names;  ///< parameters that have one value
    ScaledRange range;
    int places;  ///< where it is tried before a search
    /// Where a search for narrower highlights ends, beyond the range; nullopt if it ends with the range.
    std::optional<double> narrowest = {};

    /// The value at a place, of which 0 and 1 are the ends of the range.
    double at(double t) const;
    /// The places between which a search takes place.
    double first_place() const { return std::min(0., narrowest ? place(*narrowest) : 0.); }
    double last_place() const { return std::max(1., narrowest ? place(*narrowest) : 1.); }
    double place(double value) const;
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
