// SPDX-License-Identifier: GPL-3.0-or-later
// Formulas of the half vector that several models share.
#pragma once

#include "model/sampling.h"

namespace brdfc::inline model {

/// The unit half vector; its cosine to both directions, o.h = i.h = |wi + wo| / 2; and 1 - o.h, computed from |wi -
/// wo|^2 = 4 (1 - (o.h)^2).
template <class T> struct HalfVector {
  Vec3<T> h;
  T oh, one_minus_oh;

  HalfVector(const Vec3<T>& wi, const Vec3<T>& wo) {
    const Vec3<T> sum = sum_of_units(wi, wo), apart = difference_of_units(wi, wo);
    const T len = maximum(length(sum), tiny<T>());
    h = sum / len;
    oh = named("oh", len / T(2));
    one_minus_oh = named("one_minus_oh", dot(apart, apart) / (T(4) * (T(1) + oh)));
  }
};

/// The slopes of a microfacet with the normal h: tan theta_h times cosine and sine of its azimuth. Slopes are limited
/// to 10^7: beyond it Gaussian distributions are 0, and the limit keeps fourth powers of the slope finite in single
/// precision.
template <class T> struct Slopes {
  T x, y;

  explicit Slopes(const Vec3<T>& h) {
    const auto capped = [&](const T& s) { return minimum(maximum(s / maximum(h.z, tiny<T>()), T(-1e7)), T(1e7)); };
    x = named("slope_x", capped(h.x));
    y = named("slope_y", capped(h.y));
  }
  /// 1 / (n.h)^2.
  T inverse_cos2() const { return T(1) + x * x + y * y; }
};

/// A microfacet normal with slopes sampled from the Gaussian exp(-(x/ax)^2 - (y/ay)^2) / (pi ax ay). u1 = 1 would give
/// an infinite slope; the limit of 100 is beyond the logarithm of the smallest possible 1 - u1.
template <class T> Vec3<T> sample_gaussian_slopes(const T& ax, const T& ay, const T& u1, const T& u2) {
  const T r = named("r", sqrt(minimum(-log1p(-u1), T(100))));
  const T phi = named("phi", T(2) * pi<T>() * u2);
  const T x = ax * r * cos(phi), y = ay * r * sin(phi);
  const T cosTheta = named("cosTheta_h", T(1) / sqrt(T(1) + x * x + y * y));
  return {x * cosTheta, y * cosTheta, cosTheta};
}

}  // namespace brdfc::inline model
