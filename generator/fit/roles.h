// SPDX-License-Identifier: GPL-3.0-or-later
// The role of each parameter of a model when closures are fitted to it.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "fit/terms.h"
#include "model/model.h"

namespace brdfc::fit {

enum class Role {
  Constant,  ///< its value is given; the fit is for this value
  Factor,    ///< f is proportional to it: the closures are fitted for 1 and multiplied by it, so it may vary
  Mixed,     ///< f is a polynomial in it, or nearly so: closures are fitted to its terms and added up, so it may vary
  Axis,      ///< the one number that the fit's tables run over
  Open       ///< none of these: a fit is possible only if its value is given
};

/// The roles of all parameters of a model, given the values of some. They are found by evaluating the model, once.
class Roles {
 public:
  /// `given` has values by name; parameters that it lacks may have any value. Throws InputError for values out of
  /// range.
  Roles(const Model&, ParamValues given);

  /// Throws std::out_of_range for a name that the model does not have.
  Role of(const std::string& parameter) const { return roles_.at(parameter); }
  /// Names of the parameters with this role.
  std::set<std::string> with(Role) const;

  /// Parameters that f is proportional to, whether given or not.
  const std::set<std::string>& proportional() const { return proportional_; }
  /// f as a sum of terms of the mixed parameters.
  const Terms& terms() const { return terms_; }
  /// The parameter that is the axis; nullptr if there is none.
  const ParamInfo* axis() const;

  /// The values that closures are fitted for: those given, and 1 for the factors. The axis and the mixed parameters are
  /// not included. Throws std::logic_error naming a parameter that is open.
  ParamValues fitted() const;
  /// fitted() with the axis set to `number`, if there is an axis.
  ParamValues fitted_at(double number) const;

 private:
  const Model& model_;
  ParamValues given_;
  std::set<std::string> proportional_;
  Terms terms_;
  std::map<std::string, Role> roles_;
};

/// The roles for these values, computed at first use and cached while the program runs.
const Roles& roles_of(const Model&, const ParamValues& given);

/// Reason why closures can't be fitted to a model with these parameters, as a clause; nullopt if they can. `given` is
/// as in Roles.
std::optional<std::string> unfit(const Model&, const ParamValues& given);

/// The values that a fit is made for, and the factor that it is multiplied by.
struct Split {
  ParamValues values;
  Rgb<double> factor;  ///< product of the parameters that are set to 1 in `values`
};
/// `values` with all proportional parameters set to 1. `values` must contain them.
Split without_factors(const Model&, const ParamValues& values);
/// The values by which a fit along an axis is stored, so that one fit serves all colours of a model: each factor is 1,
/// and the parameters that are mixed when only the choices are given are left out.
Split along_axis(const Model&, const ParamValues& values);

}  // namespace brdfc::fit
