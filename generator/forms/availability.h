// SPDX-License-Identifier: GPL-3.0-or-later
// Decides which models and materials a form exists for.
#pragma once

#include <optional>
#include <string>

#include "fit/roles.h"
#include "model/model.h"

namespace brdfc::forms {

class Availability {
 public:
  /// When a form is chosen for a material that does not name one.
  enum class When {
    Always,        ///< whenever it exists, unless an earlier form in forms() was chosen
    WithinBudget,  ///< if a budget limits the time, or limits the error and off_by() is within the limit
    Asked          ///< never: only on request
  };
  virtual ~Availability() = default;

  virtual When when() const { return When::Always; }
  /// True if a pack of all models contains this form of the model.
  virtual bool in_whole_pack(const Model&) const = 0;
  /// True if the form is made of a fit. It then exists only for given values of all parameters, except those whose role
  /// it serves().
  virtual bool made_of_fit() const { return false; }
  /// True if its closures may be the base of an aimed form (AimedBase::Fitted).
  virtual bool gives_base() const { return false; }
  /// True if parameters of this role need no fixed value.
  virtual bool serves(const Model&, fit::Role) const { return true; }
  /// Values that the form requires in addition to the fixed ones.
  virtual ParamValues values(const Model&, const ParamValues& /*fixed*/) const { return {}; }
  /// The reason, as a clause, why the form does not exist for a model with these values; nullopt if it exists.
  virtual std::optional<std::string> why_not(const Model&, const ParamValues& /*fixed*/) const { return {}; }
};

}  // namespace brdfc::forms
