// SPDX-License-Identifier: GPL-3.0-or-later
// What each parameter of a model is to closures that are fitted to the model.
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
  Constant,  ///< its value is given, and the fit is for this value
  Factor,    ///< f is proportional to it: closures are fitted for 1 and multiplied by it, so it may be anything
  Mixed,     ///< f is a polynomial of it: closures are fitted to its terms and added up, so it may be anything
  Axis,      ///< the one number that the fit's tables run over
  Open       ///< none of these: there is no fit unless its value is given
};

/// The roles of all parameters of a model of which some values are given. Decided by evaluating the model, once.
class Roles {
 public:
  /// `given`: values by name; the parameters that it lacks may be anything. Throws InputError for values out of range.
  Roles(const Model&, ParamValues given);

  /// Throws std::out_of_range for a name that the model does not have.
  Role of(const std::string& parameter) const { return roles_.at(parameter); }
  /// Names of the parameters with this role.
  std::set<std::string> with(Role) const;

  /// Parameters that f is proportional to, given or not.
  const std::set<std::string>& proportional() const { return proportional_; }
  /// f by the mixed parameters.
  const Terms& terms() const { return terms_; }
  /// The parameter that is the axis; nullptr without one.
  const ParamInfo* axis() const;

  /// The values that closures are fitted for: those given, and 1 for the factors. What it lacks is the axis and what is
  /// mixed. Throws std::logic_error naming a parameter that is open.
  ParamValues fitted() const;
  /// fitted() with `number` for the axis, if there is one.
  ParamValues fitted_at(double number) const;

 private:
  const Model& model_;
  ParamValues given_;
  std::set<std::string> proportional_;
  Terms terms_;
  std::map<std::string, Role> roles_;
};

/// Those of these values, decided at first use and kept while the program runs.
const Roles& roles_of(const Model&, const ParamValues& given);

/// Why closures can't be fitted to a model with these parameters, as the rest of a sentence; nothing if they can.
/// `given` as in Roles.
std::optional<std::string> unfit(const Model&, const ParamValues& given);

/// The values that a fit is made for, and what multiplies it then.
struct Split {
  ParamValues values;
  Rgb<double> factor;  ///< product of what `values` have 1 for
};
/// `values`, in which all proportional parameters are, with 1 for each.
Split without_factors(const Model&, const ParamValues& values);
/// What a fit along an axis is kept by, so that one serves all colours of a model: without the parameters that are
/// mixed where no number is given, with 1 for each factor.
Split along_axis(const Model&, const ParamValues& values);

}  // namespace brdfc::fit
