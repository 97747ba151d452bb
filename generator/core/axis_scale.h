// SPDX-License-Identifier: GPL-3.0-or-later
// How numbers are stepped through and interpolated: by differences, or by factors.
#pragma once

#include <algorithm>
#include <cmath>

namespace brdfc::inline core {

/// How a value is mapped before a grid is interpolated linearly between two neighbouring knots.
enum class AxisScale {
  Linear,  ///< x
  Log,     ///< log(x), all values > 0
  Log1p,   ///< log(1 + x), all values >= 0
};

/// From a value to its place on the scale, and back. Over double, float and Expr.
template <class T> T to_scale(AxisScale scale, const T& x) {
  using std::log;
  return scale == AxisScale::Log ? log(x) : scale == AxisScale::Log1p ? log(T(1) + x) : x;
}
inline double from_scale(AxisScale scale, double x) {
  return scale == AxisScale::Log ? std::exp(x) : scale == AxisScale::Log1p ? std::expm1(x) : x;
}

/// "linear", "log" or "log1p".
inline const char* name_of(AxisScale scale) {
  return scale == AxisScale::Linear ? "linear" : scale == AxisScale::Log ? "log" : "log1p";
}

/// Values from `low` to `high`, both included, that are stepped through evenly on a scale.
struct ScaledRange {
  AxisScale scale = AxisScale::Linear;
  double low = 0, high = 1;

  /// The value at t in [0, 1]; beyond them that of the end.
  double at(double t) const {
    if (t <= 0) return low;
    if (t >= 1) return high;
    const double first = to_scale(scale, low);
    return std::clamp(from_scale(scale, first + t * (to_scale(scale, high) - first)), low, high);
  }
};

}  // namespace brdfc::inline core
