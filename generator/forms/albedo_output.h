// SPDX-License-Identifier: GPL-3.0-or-later
// Statements that look up a model's albedo.
#pragma once

#include "measure/albedo_table.h"
#include "model/model.h"
#include "print/statement.h"

namespace brdfc::forms {

/// Statements that assign Albedo, from wo_z and the parameters that are not fixed. Throws InputError if the table has
/// more axes than OSL look-ups support, or more numbers than an array may hold.
print::Statements albedo_output(const ModelInfo&, const measure::AlbedoTable&, const ParamValues& fixed);

}  // namespace brdfc::forms
