// SPDX-License-Identifier: GPL-3.0-or-later
// Combinations of a model's choices: what is recorded, tabulated or tested is so once for each.
#pragma once

#include <vector>

#include "model/model.h"

namespace brdfc::inline model {

/// One combination of the model's choices: an index into ParamInfo::choices for each Choice parameter, in schema order.
using Choices = std::vector<int>;
/// Every combination, in the order of an odometer whose last wheel turns fastest; an empty one of a model without
/// choices.
std::vector<Choices> choice_combinations(const ModelInfo&);
/// `values` with the identifiers of the combination.
ParamValues with_choices(const ModelInfo&, const Choices&, ParamValues values = {});
/// Whether the combination agrees with the choices that are among `fixed`; what else is in it does not count.
bool admits(const ModelInfo&, const Choices&, const ParamValues& fixed);

}  // namespace brdfc::inline model
