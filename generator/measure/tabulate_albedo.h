// SPDX-License-Identifier: GPL-3.0-or-later
// Computes an albedo table: which grids it needs, their values, and the validation against quadrature.
#pragma once

#include "measure/albedo_table.h"
#include "model/model.h"

namespace brdfc::measure {

/// Tabulates the whole admissible range of every parameter, which takes up to a minute. Throws ValueError that names
/// model, parameters, directions and value for a value that is NaN, infinite or negative, or if the albedo does not
/// have the form described in albedo_table.h.
AlbedoTable tabulate_albedo(const Model&);

}  // namespace brdfc::measure
