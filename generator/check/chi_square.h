// SPDX-License-Identifier: GPL-3.0-or-later
// Do samples fall as often as their density says?
#pragma once

#include <cstdint>

#include "measure/bound_model.h"

namespace brdfc::check {

struct ChiSquare {
  double p = 1;  ///< probability of a statistic at least as large
  double statistic = 0;
  int degrees = 0;        ///< cells after pooling, less one
  bool converged = true;  ///< whether the expected counts are known well enough; if not, the rest is as it stands here
};
/// Compares a histogram of sample() with the integral of pdf() over the same cells, lost samples being one more cell.
/// The cells are drawn around other samples, so that every lobe, however narrow, is cut into several. Cells with fewer
/// than 5 expected samples are pooled. Same seed, same result.
ChiSquare chi_square(const measure::BoundModel&, const Vec3<double>& wo, int samples, std::uint64_t seed);

}  // namespace brdfc::check
