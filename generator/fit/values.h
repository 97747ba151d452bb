// SPDX-License-Identifier: GPL-3.0-or-later
// Which of a model's parameters a fit needs to know, and which it leaves open.
//
// A fit is made for a ParamValues whose missing keys are what stays open: mixed parameters (terms.h), and at most one
// Number, the fit's axis. Factors (terms.h) are set to 1 in it, and multiply the closures afterwards.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "fit/terms.h"
#include "model/model.h"

namespace brdfc::fit {

/// Why closures can't be fitted to a model with these parameters, as the rest of a sentence; nothing if they can.
/// `values` may lack an axis and mixed parameters.
std::optional<std::string> unfit(const Model&, const ParamValues& values);

/// The Number that a fit for `values` runs over: the parameter that they lack besides mixed ones; null if they lack no
/// other. Throws std::logic_error if they lack two, or one that is no number.
const ParamInfo* open_number(const Model&, const ParamValues& values);

/// `values` with 1 for every factor that they lack. Throws like open_number().
ParamValues without_factors(const Model&, const ParamValues& values);
/// `values` with 1 in the place of every factor that they have, and the product of what was there.
std::pair<ParamValues, Rgb<double>> split_factors(const Model&, ParamValues values);

/// The values that a fit along an axis is kept by, so that one serves all colours of a model: `values` with 1 for each
/// factor, and without parameters that are mixed when all are open.
ParamValues along_axis(const Model&, const ParamValues& values);
/// along_axis(), and the product of the factors that `values` have.
std::pair<ParamValues, Rgb<double>> split_along_axis(const Model&, const ParamValues& values);

/// `values` with `number` for open_number(), if there is one; mixed parameters stay away.
ParamValues with_number(const Model&, const ParamValues& values, double number);

}  // namespace brdfc::fit
