// SPDX-License-Identifier: GPL-3.0-or-later
// What a model's base is worth: closures meet lamps and sky with little noise, and what they lack is drawn. It is
// measured before anything is rendered.
#pragma once

#include "measure/bound_model.h"

namespace brdfc::forms {

/// One view. Variances are those of one drawn direction, in squares of the albedo; channels are averaged.
struct BaseWorth {
  double relative_l1 = 1;  ///< integral of |f cos(theta_i) - base| over that of f cos
  double share = 0;        ///< integral of the base over that of f cos
  /// The factor of the base that would leave the least variance.
  double best_scale = 0;
  double white_drawn = 0, white_rest = 0;  ///< in a white world: all of f cos from the model, the rest after the base
  double sky_drawn = 0, sky_rest = 0;      ///< under a sky nineteen times as bright on one side as on the other
  /// The largest magnitude of the rest over its density, over the albedo: what one direction may bring.
  double largest = 0;
};

/// With `points` directions from a fixed sequence. Throws ValueError for a closure's weight that is NaN, infinite or
/// negative.
BaseWorth base_worth(const measure::BoundModel&, const Vec3<double>& wo, int points);

}  // namespace brdfc::forms
