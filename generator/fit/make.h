// SPDX-License-Identifier: GPL-3.0-or-later
// Making a fit: which family of closures, which knots along the axis, and what errors are left.
#pragma once

#include "fit/fit_tables.h"
#include "model/model.h"

namespace brdfc::fit {

/// The fit for `values`, which may lack mixed parameters, and one number: then it is along that number. Takes seconds,
/// along a number about a minute. Throws ValueError where the model gives a value that is NaN, infinite or negative.
FitTables make_fit(const Model&, const ParamValues& values);

/// What is fitted at a place of the axis that need not be a knot, as a fit that is the same along the whole axis: what
/// the fit would be there with a knot more. `values` are those that the fit was made for.
FitTables make_knot(const FitTables&, const Model&, const ParamValues& values, double place);

}  // namespace brdfc::fit
