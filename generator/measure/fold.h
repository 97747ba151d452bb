// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of albedos cut down to what is not known yet.
#pragma once

#include "core/cosines.h"
#include "measure/albedo_table.h"

namespace brdfc::measure {

/// The table of a model some of whose parameters are fixed: interpolated at their values, without their axes and
/// colours, terms over the same axes added up, and empty for combinations of choices that are ruled out. Of the knots
/// over the view those that these `views` lie between.
AlbedoTable fold(const AlbedoTable&, const Model&, const ParamValues& fixed, const Cosines& views = {});

}  // namespace brdfc::measure
