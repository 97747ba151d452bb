// SPDX-License-Identifier: GPL-3.0-or-later
// Linear fits with bounds that minimise absolute deviations.
#pragma once

#include <Eigen/Dense>

namespace brdfc::measured {

/// Rounds of least squares for a result that is kept, and for one that is compared with others.
inline constexpr int kDeviationRounds = 24, kFewRounds = 10;

/// The x in [0, high] that minimise the sum of weight |target - columns x|: least squares with weights that follow the
/// deviations. A deviation below a floor counts as the floor, which is `scale`, the mean of the data, in the first
/// round and falls from round to round.
Eigen::VectorXd least_deviations(const Eigen::MatrixXd& columns, const Eigen::VectorXd& target,
                                 const Eigen::VectorXd& weight, double scale, const Eigen::VectorXd& high,
                                 int rounds = kDeviationRounds);

}  // namespace brdfc::measured
