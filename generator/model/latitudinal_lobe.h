// SPDX-License-Identifier: GPL-3.0-or-later
// Radziszewski and Alda's latitudinal lobe in closed form.
//
// M. Radziszewski, W. Alda: Family of Energy Conserving Glossy Reflection Models, 2008, eq. 17, times the factor 2 that
// eq. 8 requires. x = cos^2 theta_i, y = cos^2 theta_r.
//
// Stable form: with phi(z) = (1 - e^-z) / z, m = 2 ln cosh n, d = m |x - y| / 2,
//   E = m (x - y)^2 phi(d)^2 / 4 + e^-d [(x + y)/2 phi(m (x + y)/2) + (2 - x - y)/2 phi(m (2 - x - y)/2)],
//   f_theta = 2 (tanh^2 n / m) e^-2d / E^2.
// This is eq. 17 with its denominator written as a sum of non-negative terms, scaled to prevent overflow and underflow
// from n = 0 to 1e8 (the printed form fails at n = 25).
#pragma once

#include "model/sampling.h"

namespace brdfc::inline model {

/// (1 - e^-z) / z for z >= 0.
template <class T> T phi1(const T& z) {
  const T guarded = maximum(z, T(1e-6));
  return select(z < T(1e-6), T(1) - z / T(2) * (T(1) - z / T(3)), -expm1(-guarded) / guarded);
}

/// sinh^2 n for n <= 1; for larger n, sinh^2 1.
template <class T> T sinh2(const T& n) {
  const T sinh = stable_sinh(minimum(n, T(1)));
  return named("sinh2", sinh * sinh);
}

/// m = 2 ln cosh n. For small n it is log1p(sinh^2 n), because the other form would lose all digits.
template <class T> T log_cosh2(const T& n) {
  const T large = maximum(n, T(1));
  return named(
      "m", select(n < T(1), log1p(sinh2(n)), T(2) * (large + log1p(exp(T(-2) * large)) - T(0.69314718055994530942))));
}

/// tanh^2 n / m; 1 at n = 0. For small n it is s / (log1p(s) (1 + s)) with s = sinh^2 n, where the errors of s cancel.
template <class T> T tanh2_over_m(const T& n, const T& m) {
  const T s = maximum(sinh2(n), tiny<T>());
  const T e = expm1(T(-2) * maximum(n, T(1)));
  const T tanh = -e / (T(2) + e);
  return named("tanh2_over_m", select(n < T(1), s / (log1p(s) * (T(1) + s)), tanh * tanh / maximum(m, T(0.5))));
}

/// f_theta between two directions above the surface, for n >= 0. Half of its integral over x is 1.
template <class T> T latitudinal_lobe(const T& n, const Vec3<T>& wi, const Vec3<T>& wr) {
  const T m = log_cosh2(n);
  // (x + y) / 2 and (2 - x - y) / 2. Their sum is 1 even if rounding changes the lengths of the directions.
  const T z2 = wi.z * wi.z + wr.z * wr.z, r2 = sin2_theta(wi) + sin2_theta(wr);
  const T s = named("s", z2 / (z2 + r2)), t = named("t", r2 / (z2 + r2));
  // Computed from the cosines near the horizon and from the sines near the normal, so that small values keep their
  // precision.
  const T x_minus_y =
      select(s < t, (wi.z - wr.z) * (wi.z + wr.z), (wr.x - wi.x) * (wr.x + wi.x) + (wr.y - wi.y) * (wr.y + wi.y));
  const T d = named("d", m * abs(x_minus_y) / T(2));
  const T decay = named("decay", exp(-d));
  const T E = named("E", m * sqr(x_minus_y * phi1(d)) / T(4) + decay * (s * phi1(m * s) + t * phi1(m * t)));
  return named("f_theta", T(2) * tanh2_over_m(n, m) * sqr(decay / E));
}

}  // namespace brdfc::inline model
