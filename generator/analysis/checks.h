// SPDX-License-Identifier: GPL-3.0-or-later
// Tries to prove every property that a model declares, for any registered model, with fixed seeds.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/albedo.h"

namespace brdfc {

/// Outcome of one property of one model over all cases.
struct CheckRow {
  std::string model;
  std::string check;
  std::string expected;  ///< the limit in words, "<= 1 + error"
  int cases = 0;         ///< that were judged
  int skipped = 0;       ///< where quadrature did not converge well enough to judge
  double worst = 0;      ///< value nearest to failing, or beyond
  double limit = 0;      ///< what it is compared with
  bool passed = true;
  std::string where;  ///< parameters and directions of the worst value
};

struct ChiSquare {
  double p = 1;  ///< probability of a statistic at least as large
  double statistic = 0;
  int degrees = 0;        ///< cells after pooling, less one
  bool converged = true;  ///< whether the expected counts are known well enough; if not, the rest is as it stands here
};
/// Compares a histogram of sample() with the integral of pdf() over the same cells, lost samples being one more cell.
/// The cells are drawn around other samples, so that every lobe, however narrow, is cut into several. Cells with fewer
/// than 5 expected samples are pooled. Same seed, same result.
ChiSquare chi_square(const BoundModel&, const Vec3<double>& wo, int samples, std::uint64_t seed);

struct CheckOptions {
  std::uint64_t seed = 1;
  double effort = 1;  ///< scales the numbers of cases, directions and samples
};
/// Rows for one model: what it declares, tried at defaults, random and extreme parameters, and what every model must
/// keep. A property declared absent must visibly be absent somewhere. Throws ValueError where the model gives a value
/// that is NaN, infinite or negative.
std::vector<CheckRow> check_model(const Model&, const CheckOptions& = {});

}  // namespace brdfc
