// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/vec.h"

namespace brdfc::forms {

/// The light of a spot in units of its greatest, from 0 to 1, as in Cycles (kernel/light/spot.h): smoothstep of the
/// cosine of the angle to its axis. `inside`: that cosine minus the one at the edge of its cone. `fade`: the difference
/// of cosines over which it fades, above 0.
template <class T> T spot_falloff(const T& inside, const T& fade) {
  const T t = clamp01(inside / fade);
  return sqr(t) * (T(3) - T(2) * t);
}

}  // namespace brdfc::forms
