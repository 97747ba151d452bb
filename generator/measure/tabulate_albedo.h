// SPDX-License-Identifier: GPL-3.0-or-later
// Making a table of albedos: which grids it needs, what they hold, and the proof that they tell the truth.
#pragma once

#include "measure/albedo_table.h"
#include "model/model.h"

namespace brdfc::measure {

/// Tabulates the whole admissible range of every parameter; takes up to a minute. Throws ValueError (naming model,
/// parameters, directions and value) for a value that is NaN, infinite or negative, or when the albedo is not of the
/// form in albedo_table.h.
AlbedoTable tabulate_albedo(const Model&);

}  // namespace brdfc::measure
