// SPDX-License-Identifier: GPL-3.0-or-later
// From how far aside the materials of a scene can be seen.
#pragma once

#include <vector>

#include "core/cosines.h"
#include "reference/scene.h"

namespace brdfc::reference {

/// For each material bounds on what it is shaded at, certain but for rounding. Less than all only where camera rays
/// alone are shaded: with max_bounces 0, or where the whole scene is convex, so that what was scattered meets nothing;
/// and where no material lets light through, for such rays Cycles does not count.
std::vector<Cosines> seen_cosines(const Scene&);

}  // namespace brdfc::reference
