// SPDX-License-Identifier: GPL-3.0-or-later
// The diffuse term of B. Burley: Physically Based Shading at Disney, SIGGRAPH 2012 course, section 5.3.
#pragma once

#include "model/sampling.h"

namespace brdfc::inline model {

/// f of a white surface, times pi. With k = 1 - F_D90 = 1/2 - r (1 + wi.wo) both factors are 1 - k s, and no half
/// vector is needed.
template <class T> T burley_diffuse(const T& roughness, const Vec3<T>& wi, const Vec3<T>& wo) {
  const T k = named("k", T(0.5) - roughness * (T(1) + dot(wi, wo)));
  return (T(1) - k * schlick_weight(wi.z)) * (T(1) - k * schlick_weight(wo.z));
}

/// Nowhere more than burley_diffuse(), for any light. The largest k is that of a light opposite to the viewer at the
/// horizon, K = 1/2 - r (1 - sin theta_o), so f >= rho / pi (1 - K) (1 - K s_o). Only close to the horizon is f as
/// small as that. With K^(2/3) / 8 more in place of the first factor, what is too bright is at most 5e-5 of the light.
template <class T> T least_burley_diffuse(const T& roughness, const Vec3<T>& wo) {
  const T zo = clamp01(wo.z),
          most = named("most", maximum(T(0.5) - roughness * sqr(zo) / (T(1) + sqrt(sin2_theta(wo))), T(0)));
  const T more = minimum(sqr(cbrt(most)) / T(8), most);
  return (T(1) - most + more) * (T(1) - most * schlick_weight(zo));
}

}  // namespace brdfc::inline model
