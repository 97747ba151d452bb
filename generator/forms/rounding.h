// SPDX-License-Identifier: GPL-3.0-or-later
// How far rounding takes recorded statements from the model, executed in single precision.
#pragma once

#include "forms/form.h"

namespace brdfc::forms {

/// Of closures that equal the model, and of the model's own samples. At random parameters, within `confined`, and
/// directions, always the same. Throws ValueError naming model, parameters, directions and value for a result that is
/// NaN, infinite or negative.
FormError rounding_of_closures(const Model&, const ParamValues& confined);
FormError rounding_of_samples(const Model&);

}  // namespace brdfc::forms
