// SPDX-License-Identifier: GPL-3.0-or-later
// One program of the form of nodes for all combinations of a model's choices. What they share is there once; outputs
// are selected by the numbers of the choices. Cycles knows those before it renders, and leaves out what is not
// selected.
#pragma once

#include <vector>

#include "model/choices.h"
#include "trace/program.h"

namespace brdfc::forms {

/// Each combination that agrees with `fixed`, in the order of choice_combinations(): `fixed` with all choices.
std::vector<ParamValues> open_combinations(const ModelInfo&, const ParamValues& fixed);

/// The programs of open_combinations(), with the same outputs, as one of the operations that nodes have. It reads a
/// number by the name of each choice that `fixed` lacks and that makes a difference.
Program selected_by_choices(const ModelInfo&, const ParamValues& fixed, const std::vector<Program>& by_combination);

}  // namespace brdfc::forms
