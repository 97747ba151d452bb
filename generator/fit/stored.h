// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit is kept by.
#pragma once

#include "model/model.h"
#include "tables/store.h"

namespace brdfc::fit {

/// The key of the fit for these values, or along the number that they lack: the model's formula, the values, of a fit
/// along a number by along_axis(), the slider, all settings.
StoreKey stored_fit(const Model&, const ParamValues& values);

}  // namespace brdfc::fit
