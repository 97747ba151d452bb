// SPDX-License-Identifier: GPL-3.0-or-later
// Makes a fit: chooses the family of closures and the knots along the axis, and measures the errors.
#pragma once

#include "fit/fit_tables.h"
#include "model/model.h"

namespace brdfc::fit {

/// The fit for `values`, which may lack mixed parameters and one number; the fit then runs along that number. Takes
/// seconds, or about a minute along a number. Throws ValueError if the model returns a value that is NaN, infinite or
/// negative.
FitTables make_fit(const Model&, const ParamValues& values);

/// A fit made at a single place on the axis, which need not be a knot, and used for the whole axis. It shows what the
/// fit would be there if it had a knot at that place. `values` are those that the fit was made for.
FitTables make_knot(const FitTables&, const Model&, const ParamValues& values, double place);

}  // namespace brdfc::fit
