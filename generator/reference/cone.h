// SPDX-License-Identifier: GPL-3.0-or-later
// Helpers for unit vectors: normalisation, orthonormal bases, and directions in a cone.
#pragma once

#include <algorithm>

#include "core/vec.h"

namespace brdfc::reference {

/// Normalises with one division instead of three.
inline Vec3<double> unit(const Vec3<double>& v) { return v * (1 / length(v)); }

/// Two unit vectors that form an orthonormal basis with n (Duff et al., JCGT 6(1), 2017).
inline void basis(const Vec3<double>& n, Vec3<double>& a, Vec3<double>& b) {
  const double sign = std::copysign(1.0, n.z);
  const double s = -1 / (sign + n.z), t = n.x * n.y * s;
  a = {1 + sign * n.x * n.x * s, sign * t, -sign * n.x};
  b = {t, sign + n.y * n.y * s, -n.y};
}

/// A uniform direction in the cone about n, for random numbers in [0, 1). The cone is given by 1 - cos of its half
/// angle, which may be tiny; 2 is the whole sphere.
inline Vec3<double> sample_cone(const Vec3<double>& n, double one_minus_cos, double u1, double u2) {
  const double h = u1 * one_minus_cos;  // 1 - cos(theta)
  const double sin_theta = sqrt(std::max(h * (2 - h), 0.0)), phi = 2 * kPi * u2;
  Vec3<double> a, b;
  basis(n, a, b);
  return unit(a * (sin_theta * cos(phi)) + b * (sin_theta * sin(phi)) + n * (1 - h));
}

/// 1 - cos of an angle, from its squared sine.
inline double one_minus_cos_from_sin2(double sin2) { return sin2 / (1 + sqrt(std::max(1 - sin2, 0.0))); }

}  // namespace brdfc::reference
