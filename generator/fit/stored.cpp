// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/stored.h"

#include "fit/axis.h"
#include "fit/roles.h"
#include "fit/settings.h"
#include "measure/formula.h"

namespace brdfc::fit {

StoreKey stored_fit(const Model& model, const ParamValues& given) {
  const bool along = roles_of(model, given).axis() != nullptr;
  const ParamValues values = along ? along_axis(model, given).values : given;
  // A separate folder: there may be many fits of values, and fits along a number take a minute to make.
  StoreKey key(along ? "fits" : "fits_of_values", model.info().name);
  key.add("values", format_values(model.info(), values));
  key.add("axis", along ? text_of(fit_axis(*roles_of(model, values).axis())) : "none");
  key.add("formula", measure::formula_of(model, values));
  return key.add_settings(kSettings).add_settings(kViewSettings);
}

}  // namespace brdfc::fit
