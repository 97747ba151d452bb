// SPDX-License-Identifier: GPL-3.0-or-later
// Chi-square test of sample() against pdf().
#pragma once

#include <cstdint>

#include "measure/bound_model.h"

namespace brdfc::check {

struct ChiSquare {
  double p = 1;  ///< probability of a statistic at least as large
  double statistic = 0;
  int degrees = 0;        ///< cells after pooling, less one
  bool converged = true;  ///< false: expected counts are too uncertain; other members keep their defaults
};
/// Compares a histogram of sample() with the integral of pdf() over the same cells. Lost samples are one more cell. The
/// cells are placed around other samples, so that every lobe, however narrow, is divided into several. Cells with fewer
/// than 5 expected samples are pooled. The same seed gives the same result.
ChiSquare chi_square(const measure::BoundModel&, const Vec3<double>& wo, int samples, std::uint64_t seed);

}  // namespace brdfc::check
