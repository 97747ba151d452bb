// SPDX-License-Identifier: GPL-3.0-or-later
// What forms share that are made of closures fitted to a model (fit/fit.h, fit/twin.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "forms/form.h"

namespace brdfc::forms {

/// Means over the errors, which are in double precision: what single precision adds is rounding. `what` names what was
/// fitted, `axis` is what the errors run over.
FormError error_of_fit(const std::vector<fit::ViewError>&, const std::string& what,
                       const std::optional<fit::FitAxis>& axis = {});

/// Defaults for what no fit leaves open. Where more than one number would be open, that which the model declares for an
/// axis alone stays so.
ParamValues values_of_fit(const Model&, const ParamValues& fixed);

}  // namespace brdfc::forms
