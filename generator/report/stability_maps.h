// SPDX-License-Identifier: GPL-3.0-or-later
// Maps of rounding errors: formulas as papers print them beside those of this project, and every model over its first
// parameter.
#pragma once

#include <span>
#include <string>

#include "model/model.h"

namespace brdfc::report {

/// Writes maps of these models as DIR/NAME.png, and DIR/maps.json: their titles and axes, and the colours of errors.
/// `python -m pages.stability DIR` in script/ makes a page of them. Throws InputError that names the path that can't be
/// written.
void write_stability_maps(const std::string& dir, std::span<const Model* const>);

}  // namespace brdfc::report
