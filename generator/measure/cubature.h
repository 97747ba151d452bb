// SPDX-License-Identifier: GPL-3.0-or-later
// Globally adaptive cubature over rectangles, for integrands with several components and with peaks of any width.
#pragma once

#include <functional>
#include <vector>

#include "core/sequence.h"

namespace brdfc::measure {

/// A rectangle from x0 to x1 and from y0 to y1; by default the unit square.
struct Rect {
  double x0 = 0, x1 = 1, y0 = 0, y1 = 1;
};

/// Writes the components of the integrand at (x, y).
using Integrand2 = std::function<void(double x, double y, double* out)>;

/// Stopping criteria of integrate().
struct CubatureOptions {
  double absolute = 1e-8;  ///< stop if every component's error estimate is below this
  double relative = 0;     ///< or below this factor times its value
  int max_cells = 20000;   ///< or if there are this many cells; the error estimate then tells what was reached
};

struct CubatureResult {
  std::vector<double> value;  ///< the integral of each component
  std::vector<double> error;  ///< estimated error of each component, usually far above the true one
  int cells = 0;              ///< final number of cells
  bool converged = false;     ///< whether the errors are as small as requested
};

/// Integrates with Genz and Malik's rule of degree 7 and its embedded rule of degree 5, with 17 points in each cell.
/// The cell with the largest error is halved across the direction of the largest fourth difference, until the sum of
/// errors is small enough.
CubatureResult integrate(const Integrand2&, std::size_t components, const std::vector<Rect>& cells,
                         const CubatureOptions&);

/// Halves a rectangle until no part has more than `most` of the points. A rule with few nodes then can't miss the
/// places where points are dense. Points outside are ignored. The parts cover the rectangle.
std::vector<Rect> partition(const Rect&, const std::vector<Point2>& points, std::size_t most);

}  // namespace brdfc::measure
