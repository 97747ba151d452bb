// SPDX-License-Identifier: GPL-3.0-or-later
// View angles at which the materials of a scene can be seen.
#pragma once

#include <vector>

#include "core/cosines.h"
#include "reference/scene.h"

namespace brdfc::reference {

/// For each material, bounds for the cosine at which it is shaded. They are certain up to rounding. They are narrower
/// than all views only if two conditions hold. Only camera rays are shaded: max_bounces is 0, or the whole scene is
/// convex, so that scattered light meets nothing. And no material lets light through, because Cycles does not count
/// such rays.
std::vector<Cosines> seen_cosines(const Scene&);

}  // namespace brdfc::reference
