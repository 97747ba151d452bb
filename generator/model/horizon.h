// SPDX-License-Identifier: GPL-3.0-or-later
// Conventions for shading normals that differ from the geometric normal, shared by the shaders and the reference.
#pragma once

#include "core/vec.h"

namespace brdfc::inline model {

/// Interpolated normals and bump maps can turn away from a viewer who still sees the surface. Such a view direction is
/// moved to just above the horizon, at the same azimuth, so that silhouettes get the colour of grazing views and are
/// not black.
inline constexpr double kMinCosTheta = 1e-4;

template <class T> Vec3<T> raise_to_horizon(const Vec3<T>& wo) {
  const T sinTheta = sqrt(maximum(sin2_theta(wo), tiny<T>()));
  const T low = T(kMinCosTheta);
  const T shrink = sqrt(T(1) - low * low) / sinTheta;
  const auto below = wo.z < low;
  return {named("x_o", select(below, wo.x * shrink, wo.x)), named("y_o", select(below, wo.y * shrink, wo.y)),
          named("cosTheta_o", select(below, low, wo.z))};
}

/// The largest height, as a cosine, above the true surface to which bent_normal() raises the mirror direction.
inline constexpr double kMirrorRise = 0.01;

/// That height for a view with this cosine.
template <class T> T least_mirror_rise(const T& cos_o) { return minimum(T(0.9) * cos_o, T(kMirrorRise)); }

/// The height of the mirror direction about a shading normal above the true surface, as a cosine, minus the height to
/// which bent_normal() raises it. If it is negative, the normal has to be bent. All directions are unit vectors; wo is
/// on the side of `geometric`, the true normal.
template <class T> T mirror_rise(const Vec3<T>& geometric, const Vec3<T>& wo, const Vec3<T>& normal) {
  return T(2) * dot(normal, wo) * dot(normal, geometric) - dot(wo, geometric) - least_mirror_rise(dot(wo, geometric));
}

/// The shading normal, rotated towards the true normal until the mirror direction about it is just above the surface.
/// Otherwise a mirror, and much of a narrow lobe, would reflect below the surface, where light is lost: low-polygon
/// meshes with smooth shading would be black there. To be used only if mirror_rise() is negative. This is Cycles' Bump
/// Map Correction (kernel/closure/bsdf_util.h, ensure_valid_specular_reflection); the derivation is there.
template <class T> Vec3<T> bent_normal(const Vec3<T>& geometric, const Vec3<T>& wo, const Vec3<T>& normal) {
  // Coordinates in the plane of both normals: z along the true one, x towards the other.
  const Vec3<T> across = normal - geometric * dot(normal, geometric);
  const Vec3<T> x_axis = across / maximum(length(across), tiny<T>());
  const T x = dot(wo, x_axis), z = maximum(dot(wo, geometric), T(0)), least = least_mirror_rise(z);
  // The square of the bent normal's z is a root of 4 a z^4 - 2 b z^2 + c = 0. Both roots are written without
  // cancellation.
  const T a = maximum(sqr(x) + sqr(z), tiny<T>()), b = T(2) * (a + z * least), c = sqr(least + z);
  const T both = b + sqrt(maximum(sqr(b) - T(4) * a * c, T(0)));
  const T z2 = minimum(select(x < T(0), both / (T(4) * a), c / maximum(both, tiny<T>())), T(1));
  return x_axis * sqrt(T(1) - z2) + geometric * sqrt(z2);
}

}  // namespace brdfc::inline model
