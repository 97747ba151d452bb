// SPDX-License-Identifier: GPL-3.0-or-later
// expm1 and log1p by exp and log, for languages that lack them. A series replaces the cancelling difference near 0.
#pragma once

#include "core/scalar.h"

namespace brdfc::inline core {

/// e^x - 1 to 1e-7. exp_x is e^x.
template <class T> T series_expm1(const T& x, const T& exp_x) {
  // A selection may multiply the branch that is not taken by 0, so the series has to be finite everywhere.
  const T y = minimum(maximum(x, T(-0.5)), T(0.5));
  const T sum =
      y * (T(1) +
           y * (T(1 / 2.) + y * (T(1 / 6.) + y * (T(1 / 24.) + y * (T(1 / 120.) + y * (T(1 / 720.) + y / T(5040)))))));
  return select(abs(x) < T(0.4), sum, exp_x - T(1));
}

/// log(1 + x) to 1e-7. log_1_x is the logarithm of 1 + x. The series is log1p(x) = 2 artanh(z), z = x / (2 + x).
template <class T> T series_log1p(const T& x, const T& log_1_x) {
  const T z = x / (T(2) + x), z2 = z * z;
  const T sum =
      T(2) * z * (T(1) + z2 * (T(1 / 3.) + z2 * (T(1 / 5.) + z2 * (T(1 / 7.) + z2 * (T(1 / 9.) + z2 / T(11))))));
  return select(abs(x) < T(0.4), sum, log_1_x);
}

}  // namespace brdfc::inline core
