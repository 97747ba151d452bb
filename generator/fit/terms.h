// SPDX-License-Identifier: GPL-3.0-or-later
// A model as a sum of terms: what depends on some of its parameters, times f at a few values of them. Closures that are
// fitted to each of these serve whatever the parameters are, be they textured.
//
// Cook and Torrance's f0, with Schlick's Fresnel term, makes two: (1 - f0) f(0) + f0 f(1). Phong's material has three,
// each in proportion to a share and a colour; light that goes to and fro in Oren and Nayar's grooves makes one in
// rho - rho^2 and one in rho^2.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "model/model.h"
#include "trace/expr.h"

namespace brdfc::fit {

/// Parameters that f is proportional to, the other parameters being as they are: colours, and numbers that may be 1.
/// Closures are fitted without them, and take them as factors of their weights, so they need not be known. Those that
/// `known` lacks have their defaults, and numbers the ends of their sliders, too. Who asks for more than this one set
/// takes Roles (roles.h), which keeps it.
std::set<std::string> factors(const Model&, const ParamValues& known);

/// A colour, or a number as a grey one; and back.
Rgb<double> as_rgb(const ParamValue&);
ParamValue as_value(const ParamInfo&, const Rgb<double>&);

/// Places to ask about a model: what `known` lacks at its default, and numbers at both ends of their sliders.
std::vector<ParamValues> places(const Model&, const ParamValues& known);

struct Terms {
  struct Term {
    ParamValues values;  ///< of `parameters`: f is scale times this term there
    double scale = 1;
    /// Where closures that are fitted to the terms are judged: between all of these no mixture is further off than the
    /// worst. As `values`, with 0.02 for 0 where more of a parameter adds to this term: no dielectric reflects less.
    ParamValues judged;
    /// The weight: coefficients by the powers of `parameters`. Not negative for parameters from 0 to 1.
    std::map<std::vector<int>, double> polynomial;
  };
  std::vector<std::string> parameters;  ///< none: f is one term of weight 1
  std::vector<Term> terms = {{}};

  bool has(const std::string& parameter) const;
  /// Of the terms, by channel. Throws std::out_of_range for a parameter that `values` lacks.
  template <class T> std::vector<Rgb<T>> weights(const std::map<std::string, Rgb<T>>& values) const;
};

inline constexpr std::size_t kMaxTerms = 4;

/// By parameters that `known` lacks and that are not among the factors(): those in which f is a polynomial, colours of
/// second degree and numbers of first. They are 0 or 1 in the terms' values, or nearly 0. One term of weight 1 where
/// there are none, or where they would make more than kMaxTerms.
Terms terms_of(const Model&, const ParamValues& known, const std::set<std::string>& factors);

extern template std::vector<Rgb<double>> Terms::weights(const std::map<std::string, Rgb<double>>&) const;
extern template std::vector<Rgb<Expr>> Terms::weights(const std::map<std::string, Rgb<Expr>>&) const;

}  // namespace brdfc::fit
