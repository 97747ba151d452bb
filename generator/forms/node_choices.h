// SPDX-License-Identifier: GPL-3.0-or-later
// Merges the programs for all combinations of a model's choices into one program for the form made of nodes. Shared
// parts are written once, and the numbers of the choices select outputs. Cycles knows these numbers before rendering,
// and removes what is not selected.
#pragma once

#include <vector>

#include "model/choices.h"
#include "trace/program.h"

namespace brdfc::forms {

/// All combinations of choices that agree with `fixed`, in the order of choice_combinations(). Each is `fixed` with all
/// choices added.
std::vector<ParamValues> open_combinations(const ModelInfo&, const ParamValues& fixed);

/// Merges the programs of open_combinations(), which must have the same outputs, into one program that uses only
/// operations available as nodes. It has an input named after each choice that is not in `fixed` and that makes a
/// difference.
Program selected_by_choices(const ModelInfo&, const ParamValues& fixed, const std::vector<Program>& by_combination);

}  // namespace brdfc::forms
