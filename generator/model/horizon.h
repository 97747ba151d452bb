// SPDX-License-Identifier: GPL-3.0-or-later
// The one convention for views below the shading normal's horizon, shared by the shaders and the reference.
#pragma once

#include "core/vec.h"

namespace brdfc::inline model {

/// Interpolated or bent normals can turn away from a viewer who still sees the surface. Such a view is moved to
/// just above the horizon, in the same azimuth, so that silhouettes get the grazing colour and not black.
inline constexpr double kMinCosTheta = 1e-4;

template <class T> Vec3<T> raise_to_horizon(const Vec3<T>& wo) {
  const T sinTheta = sqrt(maximum(sin2_theta(wo), tiny<T>()));
  const T low = T(kMinCosTheta);
  const T shrink = sqrt(T(1) - low * low) / sinTheta;
  const auto below = wo.z < low;
  return {named("x_o", select(below, wo.x * shrink, wo.x)), named("y_o", select(below, wo.y * shrink, wo.y)),
          named("cosTheta_o", select(below, low, wo.z))};
}

}  // namespace brdfc::inline model
