// SPDX-License-Identifier: GPL-3.0-or-later
// The directional albedo of a model as tables over the view cosine and the parameters that it depends on.
//
// In each channel the albedo is a polynomial in the colour parameters, of degree one or two in each. The coefficients
// are tabulated. With C the channel of the colours:
//
//   albedo_C = sum over terms of  grid(cos_theta_o, numbers)_C * product of the term's colours_C
//
// Tabulation verifies that the albedo has this form. A coefficient usually depends on few of the numbers, and is often
// the same for several choices. A grid therefore has only the axes that matter, and is shared by all combinations of
// choices with the same values.
#pragma once

#include <string>
#include <vector>

#include "core/axis_scale.h"
#include "model/model.h"
#include "tables/table.h"

namespace brdfc::measure {

/// A term of the polynomial in the colours.
struct AlbedoTerm {
  bool mirror = false;              ///< true: weight of ideal reflection; false: scattered light
  std::vector<std::string> colors;  ///< Color parameters that multiply it, twice for a square; empty for a constant
  int grid = 0;                     ///< index into AlbedoTable::grids
};

struct AlbedoTable {
  std::string model;
  /// Coefficients over cos_theta_o and Number parameters. If a grid has the axis cos_theta_o, it is the first. The
  /// error of a grid is the largest |interpolated - quadrature| at random points off the grid, divided by the value
  /// where that is above 1.
  std::vector<Table> grids;
  std::vector<std::string> choices;  ///< the Choice parameters in schema order
  std::vector<int> choice_sizes;     ///< number of identifiers of each choice
  /// The terms for every combination of choices, at index ((c0 * size1) + c1) * size2 + c2 ..., where c is the index of
  /// each choice. A model without choices has one entry. A combination that is black has no terms.
  std::vector<std::vector<AlbedoTerm>> terms;
  double error = 0;       ///< the same for the whole albedo at random points, with random colours
  double quadrature = 0;  ///< largest error estimate of the quadrature
  double anisotropy = 0;  ///< largest |albedo at one azimuth - azimuthal average|; 0 if azimuth does not matter
  std::string doc;        ///< description of the table for people

  /// The terms for complete or partial values. Missing values take their defaults.
  const std::vector<AlbedoTerm>& terms_for(const Model&, const ParamValues&) const;
  /// Number of floats in all grids.
  std::size_t size() const;
};

/// The interpolated albedo, including the mirror. Throws InputError for inadmissible parameters.
Rgb<double> lookup(const AlbedoTable&, const Model&, const ParamValues&, double cos_theta_o);

}  // namespace brdfc::measure
