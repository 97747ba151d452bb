// SPDX-License-Identifier: GPL-3.0-or-later
// An identifier for a model's formulas, which tells whether stored results belong to the current ones.
#pragma once

#include <string>

#include "model/model.h"

namespace brdfc::measure {

/// fingerprint() of everything that a model computes, recorded with these parameters fixed and the others open: f, the
/// pdf, samples, ideal reflection and ideal refraction.
std::string formula_of(const Model&, const ParamValues& fixed);

}  // namespace brdfc::measure
