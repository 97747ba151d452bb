// SPDX-License-Identifier: GPL-3.0-or-later
// Measures the error of recorded programs, executed in single precision, against the model.
#pragma once

#include "forms/form.h"

namespace brdfc::forms {

/// The error of a form's closures against the model, and of the model's own samples. The closures must have neither
/// microfacets nor normals of their own; `note` becomes part of the result. Parameters (within `confined`) and
/// directions are random, but the same in every run. Throws ValueError with model, parameters, directions and value for
/// a result that is NaN, infinite or negative.
FormError error_of_closures(const Model&, const ParamValues& confined, const RecordClosures&, const std::string& note);
FormError error_of_samples(const Model&);

}  // namespace brdfc::forms
