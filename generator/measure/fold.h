// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of albedos cut down to the parameters that a pack leaves open.
#pragma once

#include "core/cosines.h"
#include "measure/albedo_table.h"

namespace brdfc::measure {

/// The table of a model some of whose parameters are fixed: interpolated at their values, without their axes and
/// colours, terms over the same axes added up, and without terms for combinations of choices that are ruled out. Of the
/// knots over the view's cosine those that `views` lie between. `fixed` holds admissible values of the model's
/// parameters, in their units.
AlbedoTable fold(const AlbedoTable&, const Model&, const ParamValues& fixed, const Cosines& views = {});

}  // namespace brdfc::measure
