// SPDX-License-Identifier: GPL-3.0-or-later
// Which models and materials have a form.
#pragma once

#include <optional>
#include <string>

#include "fit/roles.h"
#include "model/model.h"

namespace brdfc::forms {

class Availability {
 public:
  /// When a form is taken for a material that leaves its form open.
  enum class When {
    Always,        ///< wherever the model has it, unless a form that comes before it in forms() is taken
    WithinBudget,  ///< where a budget names an error and off_by() keeps it, or a time
    Asked          ///< never
  };
  virtual ~Availability() = default;

  virtual When when() const { return When::Always; }
  /// Whether a pack of everything has it of this model.
  virtual bool in_whole_pack(const Model&) const = 0;
  /// Whether it is made for given values, all but those of parameters whose role it serves.
  virtual bool made_of_fit() const { return false; }
  /// Whether its closures may be the base of a form that aims at lamps: AimedBase::Fitted.
  virtual bool gives_base() const { return false; }
  /// Whether parameters of this role may be anything.
  virtual bool serves(fit::Role) const { return true; }
  /// The values that it is confined to, beside those that are fixed.
  virtual ParamValues values(const Model&, const ParamValues& /*fixed*/) const { return {}; }
  /// Why a model with these values does not have it, as the rest of a sentence; nothing if it has.
  virtual std::optional<std::string> why_not(const Model&, const ParamValues& /*fixed*/) const { return {}; }
};

}  // namespace brdfc::forms
