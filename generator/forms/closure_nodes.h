// SPDX-License-Identifier: GPL-3.0-or-later
// The twin of a model that declares its closures (model/stand_in.h): nodes that compute them from the parameters.
#pragma once

#include "forms/measurement.h"
#include "forms/shader.h"

namespace brdfc::forms {

/// `source` is JSON. `parts` has one program, `closures`, whose inputs are the cosine of the view, wo_z, and the
/// parameters that are not fixed, within `bounds`. `closures` lists the kinds of closures and which outputs of the
/// program their inputs are; the output `albedo` is what they reflect. The model must declare its closures.
Shader write_closures(const Model&, const Setting&);

/// The part of the light that white GGX facets reflect, without interreflection, for a view with this cosine. Fitted to
/// quadrature, with an error of 0.009 in the root mean square, and of 0.07 for smooth facets at grazing views.
template <class T> T facet_albedo(const T& alpha, const T& cosTheta) {
  // By power of alpha, from 1, and of y.
  constexpr double kLoss[4][3] = {
      {-0.841, 7.2213, -6.6398}, {2.9395, -18.213, 13.4096}, {-3.0452, 17.8659, -4.5577}, {1.013, -4.8826, -3.7776}};
  const T y = cosTheta / maximum(cosTheta + alpha, tiny<T>());
  T loss(0);
  for (int i = 3; i >= 0; --i) loss = alpha * (loss + (T(kLoss[i][0]) + y * (T(kLoss[i][1]) + y * T(kLoss[i][2]))));
  return clamp01(T(1) - loss);
}

/// The error of these closures at the fixed values and the defaults of the other parameters, for views along the
/// tangent.
FormError error_of_stand_in(const Model&, const ParamValues& fixed);
/// The errors by view.
std::vector<fit::ViewError> stand_in_errors(const Model&, const ParamValues& values);

}  // namespace brdfc::forms
