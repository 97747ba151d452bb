// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit along a number is kept by.
#pragma once

#include "model/model.h"
#include "tables/store.h"

namespace brdfc::fit {

/// The key of the fit along the number that `values` lack: the model's formula, along_axis() of the values, the slider,
/// all settings.
StoreKey stored_fit(const Model&, const ParamValues& values);

}  // namespace brdfc::fit
