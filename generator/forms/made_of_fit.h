// SPDX-License-Identifier: GPL-3.0-or-later
// Shared by the forms that are made of closures fitted to a model (fit/fit.h, fit/twin.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "forms/form.h"

namespace brdfc::forms {

/// Averages the errors of the views. They are computed in double precision; single precision adds only rounding. `what`
/// says what the errors are of, `axis` is the parameter that the errors run over.
FormError error_of_fit(const std::vector<fit::ViewError>&, const std::string& what,
                       const std::optional<fit::FitAxis>& axis = {});

/// Default values for all parameters that the fit does not leave open. If the fit could leave several numbers open,
/// only the one that the model declares as its fit axis stays open.
ParamValues values_of_fit(const Model&, const ParamValues& fixed);

}  // namespace brdfc::forms
