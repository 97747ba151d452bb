// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/axis.h"

#include "trace/expr.h"

namespace brdfc::fit {

FitAxis fit_axis(const ParamInfo& p) {
  FitAxis axis{p.name, p.soft_min, p.soft_max, AxisScale::Linear};
  // What a factor of ten changes is looked at by factors.
  if (axis.low > 0 && axis.high > 10 * axis.low)
    axis.scale = AxisScale::Log;
  else if (axis.low >= 0 && axis.high > 10)
    axis.scale = AxisScale::Log1p;
  return axis;
}

double FitAxis::at(double x) const {
  if (x <= 0) return low;
  if (x >= 1) return high;
  return from_scale(scale, to_scale(scale, low) + x * (to_scale(scale, high) - to_scale(scale, low)));
}

template <class T> T FitAxis::place(const T& value) const {
  const double first = to_scale(scale, low), span = to_scale(scale, high) - first;
  return (to_scale(scale, minimum(maximum(value, T(low)), T(high))) - T(first)) * T(1 / span);
}
template double FitAxis::place(const double&) const;
template Expr FitAxis::place(const Expr&) const;

}  // namespace brdfc::fit
