// SPDX-License-Identifier: GPL-3.0-or-later
// The plane of incidence of a view.
#pragma once

#include "core/vec.h"

namespace brdfc::inline model {

/// The direction along the surface towards the mirror side; at normal incidence any such direction.
template <class T> Vec3<T> mirror_side(const Vec3<T>& wo) {
  const T sinTheta = sqrt(sin2_theta(wo));
  const auto oblique = sinTheta > T(1e-6);
  const T scale = T(-1) / select(oblique, sinTheta, T(1));
  return {select(oblique, wo.x * scale, T(1)), select(oblique, wo.y * scale, T(0)), T(0)};
}

}  // namespace brdfc::inline model
