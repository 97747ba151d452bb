// SPDX-License-Identifier: GPL-3.0-or-later
// Scales of table axes and sliders: linear or logarithmic steps, and interpolation on them.
#pragma once

#include <algorithm>
#include <cmath>

namespace brdfc::inline core {

/// The mapping that is applied to a value before a grid is interpolated linearly between two neighbouring knots.
enum class AxisScale {
  Linear,  ///< x
  Log,     ///< log(x), all values > 0
  Log1p,   ///< log(1 + x), all values >= 0
};

/// Maps a value to the scale, and back. T is double, float or Expr.
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

/// A range of values, both ends included, with steps that are even on a scale.
struct ScaledRange {
  AxisScale scale = AxisScale::Linear;
  double low = 0, high = 1;

  /// The value at t in [0, 1]. A t outside that interval gives the value of the nearest end.
  double at(double t) const {
    if (t <= 0) return low;
    if (t >= 1) return high;
    const double first = to_scale(scale, low);
    return std::clamp(from_scale(scale, first + t * (to_scale(scale, high) - first)), low, high);
  }
};

}  // namespace brdfc::inline core
