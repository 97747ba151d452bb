// SPDX-License-Identifier: GPL-3.0-or-later
// Albedo tables, reduced to the parameters that a pack leaves open.
#pragma once

#include "core/cosines.h"
#include "measure/albedo_table.h"

namespace brdfc::measure {

/// The table of a model with some parameters fixed. It is interpolated at their values and no longer has their axes and
/// colours. Terms over the same axes are added, and terms for excluded combinations of choices are removed. On the axis
/// of the view cosine the knots remain that enclose `views`. `fixed` contains admissible values of the model's
/// parameters, in their units.
AlbedoTable fold(const AlbedoTable&, const Model&, const ParamValues& fixed, const Cosines& views = {});

}  // namespace brdfc::measure
