// SPDX-License-Identifier: GPL-3.0-or-later
// Placement of the knots of an albedo grid.
#pragma once

#include <vector>

#include "measure/albedo_polynomial.h"

namespace brdfc::measure {

/// Places knots on these axes (indices of coordinates) so that linear interpolation of the monomials has about the same
/// error everywhere. The density of knots is proportional to the square root of the second derivative along lines
/// through the probes. The first probe is at the defaults, and the next AlbedoTableSettings::corners probes are near
/// the ends of ranges.
std::vector<TableAxis> place_knots(const AlbedoPolynomial&, const ParamValues& combination,
                                   const std::vector<std::size_t>& axes, const std::vector<Monomial>&,
                                   const std::vector<Position>& probes);

}  // namespace brdfc::measure
