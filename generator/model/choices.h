// SPDX-License-Identifier: GPL-3.0-or-later
// Combinations of a model's choices. Recording, tabulation and tests are done once for each combination.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::inline model {

/// One combination of the model's choices: an index into ParamInfo::choices for each Choice parameter, in schema order.
using Choices = std::vector<int>;
/// All combinations, in the order of an odometer: the last choice varies fastest. A model without choices has one,
/// which is empty.
std::vector<Choices> choice_combinations(const ModelInfo&);
/// The identifiers of the combination's options, in schema order.
std::vector<std::string> options_of(const ModelInfo&, const Choices&);
/// `values` with the choices of the combination.
ParamValues with_choices(const ModelInfo&, const Choices&, ParamValues values = {});
/// True if the combination agrees with the choices in `fixed`; other values in `fixed` are ignored.
bool admits(const ModelInfo&, const Choices&, const ParamValues& fixed);

}  // namespace brdfc::inline model
