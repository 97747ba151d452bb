// SPDX-License-Identifier: GPL-3.0-or-later
// Estimates how much a model's base reduces noise, before anything is rendered. The closures of a base receive light
// from lamps and sky with little noise; the difference from the model is sampled by drawn directions.
#pragma once

#include "measure/bound_model.h"

namespace brdfc::forms {

/// Results for one view. Variances are those of a single drawn direction, divided by the squared albedo and averaged
/// over the channels.
struct BaseWorth {
  double relative_l1 = 1;  ///< integral of |f cos(theta_i) - base| over that of f cos
  double share = 0;        ///< integral of the base over that of f cos
  /// The factor for the base that would minimize the variance.
  double best_scale = 0;
  double white_drawn = 0,
         white_rest =
             0;  ///< in a white world: if the model draws all of f cos, and if it draws only the rest beside the base
  double sky_drawn = 0,
         sky_rest = 0;  ///< the same under a sky that is nineteen times as bright on one side as on the other
  /// The largest absolute value of the rest divided by its pdf, relative to the albedo: the most that one sample may
  /// contribute.
  double largest = 0;
};

/// Uses `points` directions from a fixed sequence. Throws ValueError if a closure's weight is NaN, infinite or
/// negative.
BaseWorth base_worth(const measure::BoundModel&, const Vec3<double>& wo, int points);

}  // namespace brdfc::forms
