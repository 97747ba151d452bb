// SPDX-License-Identifier: GPL-3.0-or-later
// The lobe cos^e alpha about an axis, for exponents from 0 to 1e8.
//
// With q = |a - b|^2 / 2 = 1 - cos alpha for unit vectors, the power is computed as exp(e log1p(-q)). Rounding changes
// only the last digits of q, while a power of the dot product has lost all digits at e = 1e7. Near a right angle 1 - q
// cancels and the dot product does not, so there the logarithm of the dot product is used. For the same reason sampling
// computes 1 - cos alpha = -expm1(log1p(-u) / (e + 1)).
#pragma once

#include "model/model.h"

namespace brdfc::inline model {

/// cos^e alpha of the angle between unit vectors; 0 beyond a right angle.
template <class T> T power_lobe(const T& e, const Vec3<T>& a, const Vec3<T>& b) {
  const Vec3<T> d = a - b;
  const T q = named("one_minus_cos", dot(d, d) / T(2));
  const T cosAlpha = named("cosAlpha", dot(a, b));
  const T near_axis = log1p(-minimum(q, T(0.5))), near_edge = log(maximum(cosAlpha, tiny<T>()));
  const T log_cos = select(q < T(0.5), near_axis, near_edge);
  return named("lobe", select(cosAlpha > T(0), exp(e * log_cos), T(0)));
}

/// The same about the normal, computed from 1 - cos^2 alpha, for h above the surface.
template <class T> T polar_power(const T& e, const Vec3<T>& h) {
  const T s2 = named("sin2_h", sin2_theta(h));
  const T near_pole = T(0.5) * log1p(-minimum(s2, T(0.75))), near_horizon = log(maximum(h.z, tiny<T>()));
  return exp(e * select(s2 < T(0.5), near_pole, near_horizon));
}

/// The pdf of sample_power_lobe().
template <class T> T power_lobe_pdf(const T& e, const Vec3<T>& axis, const Vec3<T>& w) {
  return (e + T(1)) / (T(2) * pi<T>()) * power_lobe(e, axis, w);
}

/// A direction about the z axis, sampled with a pdf proportional to cos^e alpha.
template <class T> Vec3<T> sample_power_lobe(const T& e, const T& u1, const T& u2) {
  const T one_minus_cos = named("one_minus_cosAlpha", -expm1(log1p(-u1) / (e + T(1))));
  const T sinAlpha = named("sinAlpha", sqrt(one_minus_cos * (T(2) - one_minus_cos)));
  const T phi = named("phi", T(2) * pi<T>() * u2);
  return {sinAlpha * cos(phi), sinAlpha * sin(phi), T(1) - one_minus_cos};
}

}  // namespace brdfc::inline model
