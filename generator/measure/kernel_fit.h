// SPDX-License-Identifier: GPL-3.0-or-later
// The parameters of `lossless` that come nearest to a kernel drawn with any number of points.
#pragma once

#include <array>
#include <vector>

#include "model/kernel_lobe.h"
#include "model/model.h"

namespace brdfc::measure {

/// A kernel k(u), linear between its points and constant outside them.
struct KernelCurve {
  std::vector<double> u;  ///< >= 0, increasing, at least one of them > 0
  std::vector<double> k;  ///< > 0, as many
};

/// The lobe of the curve itself, not of a fit to it. The curve's distance u is n |x' - y'|.
KernelLobe<double, FreeKnots<double>> kernel_lobe(const KernelCurve&, double n);

struct KernelFit {
  ParamValues values;  ///< of `lossless`: n, kernel and heights, rounded to six digits
  double kernel = 0;   ///< largest relative difference of the kernel at a distance that occurs, both at most 1
  double l1 = 0;       ///< relative L1 of f cos over all pairs of directions
  double l1_view = 0;  ///< the same over the light directions, for the worst of the views looked at
};
/// Least L1 of the kernel over the square of x' and y'; the errors are those of the rounded values. `n` lies in the
/// model's range and is not 0.
KernelFit fit_kernel(const KernelCurve&, double n);

}  // namespace brdfc::measure
