// SPDX-License-Identifier: GPL-3.0-or-later
// A model as a sum of terms: each is f at fixed values of some parameters, with a weight that depends on these
// parameters. Closures that are fitted to each term serve all values of the parameters, also textures.
//
// Examples: Cook and Torrance's f0 with Schlick's Fresnel approximation gives two terms, (1 - f0) f(0) + f0 f(1).
// Phong's material has three, each proportional to a share and a colour. Interreflection in Oren and Nayar's grooves
// gives one in rho - rho^2 and one in rho^2. If all interreflection counts, f is a rational function of rho, and the
// weights are polynomials that come close.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "model/model.h"
#include "trace/expr.h"

namespace brdfc::fit {

/// The parameters that f is proportional to, for given values of the others: colours, and numbers that may be 1.
/// Closures are fitted without them and take them as factors of their weights, so their values need not be known.
/// Parameters that `known` lacks are tried at their defaults, and numbers also at the ends of their sliders. To ask for
/// more than this one set use Roles (roles.h), which stores the result.
std::set<std::string> factors(const Model&, const ParamValues& known);

/// Converts a colour, or a number to grey; and back.
Rgb<double> as_rgb(const ParamValue&);
ParamValue as_value(const ParamInfo&, const Rgb<double>&);

/// Parameter values at which to examine a model: parameters that `known` lacks at their defaults, and numbers at both
/// ends of their sliders.
std::vector<ParamValues> places(const Model&, const ParamValues& known);

struct Terms {
  struct Term {
    ParamValues values;  ///< of `parameters`: with these values f is scale times this term
    double scale = 1;
    /// The values of `parameters` at which closures fitted to this term are tested. No sum of terms has a larger error
    /// than the worst of them. The same as `values`, except that 0 becomes 0.02 for a parameter that adds
    /// to this term, because no dielectric reflects less.
    ParamValues judged;
    /// The weight as a polynomial: coefficients by the powers of `parameters`. It is not negative for parameters from 0
    /// to 1.
    std::map<std::vector<int>, double> polynomial;
  };
  std::vector<std::string> parameters;  ///< if empty, f is one term of weight 1
  std::vector<Term> terms = {{}};
  /// If f is only nearly the sum of its terms: the values of `parameters` where the sum is furthest off.
  std::optional<ParamValues> furthest = {};

  /// All values of `parameters` at which closures fitted to the terms are tested.
  std::vector<ParamValues> judged() const;
  bool has(const std::string& parameter) const;
  /// The weights of the terms, by channel. Throws std::out_of_range for a parameter that `values` lacks.
  template <class T> std::vector<Rgb<T>> weights(const std::map<std::string, Rgb<T>>& values) const;
};

inline constexpr std::size_t kMaxTerms = 4;
/// The largest share of the light by which the sum of terms may be off.
inline constexpr double kNearlyThere = 0.005;

/// The terms in the parameters that `known` lacks, that are not among `factors`, and in which f is a polynomial:
/// colours up to the second degree, numbers up to the first. In the terms' values these parameters are 0, 1 or nearly
/// 0. If there are none, but f vanishes with a single colour and is nearly a polynomial of it, it has a linear term and
/// one of the second and third degree. Returns one term of weight 1 if there are no such parameters, or if there would
/// be more than kMaxTerms terms.
Terms terms_of(const Model&, const ParamValues& known, const std::set<std::string>& factors);

extern template std::vector<Rgb<double>> Terms::weights(const std::map<std::string, Rgb<double>>&) const;
extern template std::vector<Rgb<Expr>> Terms::weights(const std::map<std::string, Rgb<Expr>>&) const;

}  // namespace brdfc::fit
