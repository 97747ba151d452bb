// SPDX-License-Identifier: GPL-3.0-or-later
// The twin of a model that declares its closures (model/stand_in.h): nodes that compute them from the parameters.
#pragma once

#include "forms/measurement.h"
#include "forms/shader.h"

namespace brdfc::forms {

/// `source` is JSON. `parts` has one program, `closures`, whose inputs are the cosine of the view, wo_z, and the
/// parameters that are not fixed, within `bounds`. `closures` lists the kinds of closures and which outputs of the
/// program their inputs are. The model must declare its closures.
Shader write_closures(const Model&, const Setting&);

/// The error of these closures at the fixed values and the defaults of the other parameters, for views along the
/// tangent.
FormError error_of_stand_in(const Model&, const ParamValues& fixed);
/// The errors by view.
std::vector<fit::ViewError> stand_in_errors(const Model&, const ParamValues& values);

}  // namespace brdfc::forms
