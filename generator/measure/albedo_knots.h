// SPDX-License-Identifier: GPL-3.0-or-later
// Where the knots of a grid of albedos stand.
#pragma once

#include <vector>

#include "measure/albedo_polynomial.h"

namespace brdfc::measure {

/// Knots on these axes, indices of coordinates, so that linear interpolation of the monomials errs about equally
/// everywhere: their density follows the square root of the second derivative met on lines through the probes. The
/// first probe is at the defaults, the next AlbedoTableSettings::corners are near the ends of ranges.
std::vector<TableAxis> place_knots(const AlbedoPolynomial&, const ParamValues& combination,
                                   const std::vector<std::size_t>& axes, const std::vector<Monomial>&,
                                   const std::vector<Position>& probes);

}  // namespace brdfc::measure
