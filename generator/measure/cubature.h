// SPDX-License-Identifier: GPL-3.0-or-later
// Globally adaptive cubature over rectangles, for integrands with several components and peaks of any width.
#pragma once

#include <functional>
#include <vector>

#include "core/sequence.h"

namespace brdfc::measure {

/// From x0 to x1 and from y0 to y1; the unit square unless told.
struct Rect {
  double x0 = 0, x1 = 1, y0 = 0, y1 = 1;
};

/// Writes the components of the integrand at (x, y).
using Integrand2 = std::function<void(double x, double y, double* out)>;

/// When integrate() stops.
struct CubatureOptions {
  double absolute = 1e-8;  ///< stop when every component's error estimate is below this
  double relative = 0;     ///< or below this times its value
  int max_cells = 20000;   ///< or when there are so many cells; the estimate then says what was reached
};

struct CubatureResult {
  std::vector<double> value;  ///< the integral of each component
  std::vector<double> error;  ///< estimate per component, usually far above the true error
  int cells = 0;              ///< into which the domain was cut in the end
  bool converged = false;     ///< the errors are as small as asked for
};

/// Genz and Malik's rule of degree 7 with its embedded rule of degree 5, 17 points a cell; the cell with the
/// largest error is halved across the direction with the largest fourth difference, until the sum is small enough.
CubatureResult integrate(const Integrand2&, std::size_t components, const std::vector<Rect>& cells,
                         const CubatureOptions&);

/// Halves a rectangle until no part has more than `most` of the points, so that a rule with few nodes can't step over
/// the places where they crowd. Points outside are ignored. Parts cover the rectangle.
std::vector<Rect> partition(const Rect&, const std::vector<Point2>& points, std::size_t most);

}  // namespace brdfc::measure
