// SPDX-License-Identifier: GPL-3.0-or-later
// The closures that a fit's tables stand for, as numbers and as recorded formulas.
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
/// parameter, and the values of its mixed parameters (terms.h), numbers as greys.
template <class T> struct Varied {
  T number = T(0);
  std::map<std::string, Rgb<T>> parameters = {};
  Varied() = default;
  Varied(const T& n) : number(n) {}  // NOLINT: all that most fits need
};

/// From complete values. Throws std::out_of_range for a parameter that they lack.
Varied<double> varied_of(const std::optional<FitAxis>&, const Terms&, const ParamValues&);

/// The closures for a view above the surface. Their weights add up to the albedo. Those with ramps have `share` of
/// theirs and colours that make up for it; not `divided`, the colours still have to be divided by the weight: by its
/// largest channel, with mixed parameters by each. Of numbers, a lower view than kLowestView is taken as described
/// there; a shader that records closures has to turn its normal itself. Over double and Expr.
template <class T> ClosureSum<T> closures(const FitTables&, const Vec3<T>& wo, const Varied<T>&, const T& share = T(1),
                                          bool divided = true);

/// The same by the weights of terms, as Terms::weights() gives them, for a view not below kLowestView. Of numbers.
ClosureSum<double> closures_by_weights(const FitTables&, const Vec3<double>& wo, double number,
                                       const std::vector<Rgb<double>>& weights);

/// f cos(theta_i) of the sum of the closures; directions above the surface. Over double and Expr.
template <class T> Rgb<T> f_cos(const FitTables&, const Vec3<T>& wi, const Vec3<T>& wo, const Varied<T>&);

extern template ClosureSum<double> closures(const FitTables&, const Vec3<double>&, const Varied<double>&, const double&,
                                            bool);
extern template ClosureSum<Expr> closures(const FitTables&, const Vec3<Expr>&, const Varied<Expr>&, const Expr&, bool);
extern template Rgb<double> f_cos(const FitTables&, const Vec3<double>&, const Vec3<double>&, const Varied<double>&);
extern template Rgb<Expr> f_cos(const FitTables&, const Vec3<Expr>&, const Vec3<Expr>&, const Varied<Expr>&);

}  // namespace brdfc::fit
