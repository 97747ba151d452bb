// SPDX-License-Identifier: GPL-3.0-or-later
// Statements that look a model's albedo up.
#pragma once

#include "measure/albedo_table.h"
#include "model/model.h"
#include "print/statement.h"

namespace brdfc::forms {

/// They assign Albedo, from wo_z and the parameters that are not fixed. Throws InputError if the table has more axes
/// than OSL look-ups exist for, or more numbers than an array holds.
print::Statements albedo_output(const ModelInfo&, const measure::AlbedoTable&, const ParamValues& fixed);

}  // namespace brdfc::forms
