// SPDX-License-Identifier: GPL-3.0-or-later
// Ranges of view angles.
#pragma once

#include <algorithm>

namespace brdfc::inline core {

/// A range of cosines of the angle between shading normal and viewer. By default it contains all views.
struct Cosines {
  double low = 0, high = 1;

  bool all() const { return low <= 0 && high >= 1; }
  bool has(const Cosines& c) const { return low <= c.low && high >= c.high; }
  void add(const Cosines& c) {
    low = std::min(low, c.low);
    high = std::max(high, c.high);
  }
};

}  // namespace brdfc::inline core
