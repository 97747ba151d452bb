// SPDX-License-Identifier: GPL-3.0-or-later
// A model's formulas as one thing: to tell whether two are the same, and what is kept of one belongs to it.
#pragma once

#include <string>

#include "model/model.h"

namespace brdfc::measure {

/// fingerprint() of all that a model computes, recorded with these parameters fixed and the others open: f, the
/// probability density and samples, ideal reflection and refraction.
std::string formula_of(const Model&, const ParamValues& fixed);

}  // namespace brdfc::measure
