// SPDX-License-Identifier: GPL-3.0-or-later
// Parameters of `lossless` for a kernel that is drawn as a curve with any number of points.
#pragma once

#include <array>
#include <vector>

#include "model/kernel_lobe.h"
#include "model/model.h"

namespace brdfc::measure {

/// A kernel k(u), linear between its points and constant outside them.
struct KernelCurve {
  std::vector<double> u;  ///< >= 0, increasing, at least one of them > 0
  std::vector<double> k;  ///< > 0, one for each u
};

/// The lobe of the exact curve, without a fit. The distance u of the curve is n |x' - y'|.
KernelLobe<double, FreeKnots<double>> kernel_lobe(const KernelCurve&, double n);

struct KernelFit {
  ParamValues values;  ///< parameters of `lossless`: n, kernel and heights, rounded to six digits
  double kernel = 0;   ///< largest relative difference of the kernels, scaled to 1, at distances that occur
  double l1 = 0;       ///< relative L1 of f cos over all pairs of directions
  double l1_view = 0;  ///< the same over light directions only, for the worst of the views tried
};
/// Minimises the L1 error of the kernel over the square of x' and y'. The errors are those of the rounded values. `n`
/// is in the model's range and not 0.
KernelFit fit_kernel(const KernelCurve&, double n);

}  // namespace brdfc::measure
