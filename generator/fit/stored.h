// SPDX-License-Identifier: GPL-3.0-or-later
// The key of a stored fit.
#pragma once

#include "model/model.h"
#include "tables/store.h"

namespace brdfc::fit {

/// The key of the fit for these values, or along the number that they lack. It includes the model's formula, the values
/// (for a fit along a number those of along_axis()), the slider, and all settings.
StoreKey stored_fit(const Model&, const ParamValues& values);

}  // namespace brdfc::fit
