// SPDX-License-Identifier: GPL-3.0-or-later
// The closures that a fit's tables describe, as numbers and as recorded formulas.
#pragma once

#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "closures/closure.h"
#include "fit/fit_tables.h"
#include "trace/expr.h"

namespace brdfc::fit {

/// What the closures of a fit depend on besides the view: the value of its axis, if it has one, in units of the
/// parameter; and the values of its mixed parameters (terms.h), with numbers as greys.
template <class T> struct Varied {
  T number = T(0);
  std::map<std::string, Rgb<T>> parameters = {};
  Varied() = default;
  Varied(const T& n) : number(n) {}  // NOLINT: all that most fits need
};

/// Takes the values from complete values. Throws std::out_of_range for a parameter that they lack.
Varied<double> varied_of(const std::optional<FitAxis>&, const Terms&, const ParamValues&);

/// The closures for a view above the surface. Their weights add up to the albedo. The weight of closures with ramps is
/// multiplied by `share`, and their colours are divided by it. If `divided` is false, the caller has to divide the
/// colours by the weight: by its largest channel, or with mixed parameters by each channel. With T = double, a view
/// below kLowestView is handled as described there; a shader that records closures has to turn its normal itself. T is
/// double or Expr.
template <class T> ClosureSum<T> closures(const FitTables&, const Vec3<T>& wo, const Varied<T>&, const T& share = T(1),
                                          bool divided = true);

/// The same for given weights of the terms, as Terms::weights() returns them, and a view that is not below kLowestView.
ClosureSum<double> closures_by_weights(const FitTables&, const Vec3<double>& wo, double number,
                                       const std::vector<Rgb<double>>& weights);

/// f cos(theta_i) of the sum of the closures, for directions above the surface. T is double or Expr.
template <class T> Rgb<T> f_cos(const FitTables&, const Vec3<T>& wi, const Vec3<T>& wo, const Varied<T>&);

extern template ClosureSum<double> closures(const FitTables&, const Vec3<double>&, const Varied<double>&, const double&,
                                            bool);
extern template ClosureSum<Expr> closures(const FitTables&, const Vec3<Expr>&, const Varied<Expr>&, const Expr&, bool);
extern template Rgb<double> f_cos(const FitTables&, const Vec3<double>&, const Vec3<double>&, const Varied<double>&);
extern template Rgb<Expr> f_cos(const FitTables&, const Vec3<Expr>&, const Vec3<Expr>&, const Varied<Expr>&);

}  // namespace brdfc::fit
