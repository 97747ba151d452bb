// SPDX-License-Identifier: GPL-3.0-or-later
// Which parameters a model's formulas read.
#pragma once

#include <set>
#include <string>

#include "model/model.h"

namespace brdfc::measure {

/// The names of the numbers and colours that f, ideal reflection and ideal refraction read under these choices.
/// `choices` must contain every choice.
std::set<std::string> read_parameters(const Model&, const ParamValues& choices);

}  // namespace brdfc::measure
