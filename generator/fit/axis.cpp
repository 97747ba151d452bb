// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/axis.h"

#include <fmt/format.h>

#include "trace/expr.h"

namespace brdfc::fit {

FitAxis fit_axis(const ParamInfo& p) {
  const ScaledRange slider = p.slider();
  return {p.name, slider.low, slider.high, slider.scale};
}

std::string text_of(const FitAxis& axis) {
  return fmt::format("{} {} {} {}", axis.parameter, axis.low, axis.high, name_of(axis.scale));
}

double FitAxis::at(double x) const { return ScaledRange{scale, low, high}.at(x); }

template <class T> T FitAxis::place(const T& value) const {
  const double first = to_scale(scale, low), span = to_scale(scale, high) - first;
  return (to_scale(scale, minimum(maximum(value, T(low)), T(high))) - T(first)) * T(1 / span);
}
template double FitAxis::place(const double&) const;
template Expr FitAxis::place(const Expr&) const;

}  // namespace brdfc::fit
