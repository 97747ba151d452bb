// SPDX-License-Identifier: GPL-3.0-or-later
// Statements of OSL that look a model's albedo up.
#pragma once

#include <string>

#include "measure/albedo_table.h"
#include "model/model.h"

namespace brdfc::forms {

/// They assign Albedo, from wo_z and the parameters that are not fixed. Throws InputError if the table has more axes
/// than OSL look-ups exist for, or more numbers than an array holds.
std::string albedo_text(const ModelInfo&, const measure::AlbedoTable&, const ParamValues& fixed);

}  // namespace brdfc::forms
