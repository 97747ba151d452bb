// SPDX-License-Identifier: GPL-3.0-or-later
// How far recorded statements are from the model, executed in single precision.
#pragma once

#include "forms/form.h"

namespace brdfc::forms {

/// Of closures of a form against the model, with `note`; none has facets or a normal of its own. Of the model's own
/// samples. At random parameters, within `confined`, and directions, always the same. Throws ValueError naming model,
/// parameters, directions and value for a result that is NaN, infinite or negative.
FormError error_of_closures(const Model&, const ParamValues& confined, const RecordClosures&, const std::string& note);
FormError error_of_samples(const Model&);

}  // namespace brdfc::forms
