// SPDX-License-Identifier: GPL-3.0-or-later
// Combinations of a model's choices: what is recorded, tabulated or tested is so once for each.
#pragma once

#include <vector>

#include "model/model.h"

namespace brdfc::inline model {

/// One combination of the model's choices.
using Choices = std::vector<int>;
/// Every combination, in the order of an odometer whose last wheel turns fastest.
std::vector<Choices> choice_combinations(const ModelInfo&);
/// Adds the combination to the fixed values.
ParamValues with_choices(const ModelInfo&, const Choices&, ParamValues values = {});
/// Whether the combination has the choices that are among the fixed values.
bool admits(const ModelInfo&, const Choices&, const ParamValues& fixed);

}  // namespace brdfc::inline model
