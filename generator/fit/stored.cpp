// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/stored.h"

#include "fit/axis.h"
#include "fit/roles.h"
#include "fit/settings.h"
#include "measure/formula.h"

namespace brdfc::fit {

StoreKey stored_fit(const Model& model, const ParamValues& given) {
  const ParamValues values = along_axis(model, given).values;
  StoreKey key("fits", model.info().name);
  key.add("values", format_values(model.info(), values));
  key.add("axis", text_of(fit_axis(*roles_of(model, values).axis())));
  key.add("formula", measure::formula_of(model, values));
  return key.add_settings(kSettings).add_settings(kViewSettings);
}

}  // namespace brdfc::fit
