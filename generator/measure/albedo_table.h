// SPDX-License-Identifier: GPL-3.0-or-later
// Directional albedo of a model as tables over the view cosine and the parameters it depends on.
//
// Per channel the albedo is a polynomial in the colour parameters, of degree one or two in each, whose coefficients
// are tabulated. With C the channel of the colours:
//
//   albedo_C = sum over terms of  grid(cos_theta_o, numbers)_C * product of the term's colours_C
//
// That the albedo has this form is verified while tabulating, never assumed. A coefficient depends on few of
// the numbers as a rule, and is often the same for several choices: a grid has only the axes that matter and
// is shared between the combinations of choices that agree on it.
#pragma once

#include <string>
#include <vector>

#include "core/axis_scale.h"
#include "model/model.h"
#include "tables/table.h"

namespace brdfc::measure {

/// A coefficient of the polynomial in the colours.
struct AlbedoTerm {
  bool mirror = false;              ///< weight of ideal reflection; otherwise scattered light
  std::vector<std::string> colors;  ///< Color parameters multiplied with it, twice for a square; empty for a constant
  int grid = 0;                     ///< index into AlbedoTable::grids
};

struct AlbedoTable {
  std::string model;
  /// Coefficients, over cos_theta_o, which comes first if a grid has it, and Number parameters. The error of each is
  /// the largest |interpolated - quadrature| at random points off the grid, of the value itself where that is more
  /// than 1.
  std::vector<Table> grids;
  std::vector<std::string> choices;  ///< the Choice parameters in schema order
  std::vector<int> choice_sizes;     ///< how many identifiers each has
  /// The terms of every combination of choices, at index ((c0 * size1) + c1) * size2 + c2 ... with c the index
  /// of each choice; one entry for a model without choices. A black combination has no terms.
  std::vector<std::vector<AlbedoTerm>> terms;
  double error = 0;       ///< the same of the whole albedo at random points, colours included
  double quadrature = 0;  ///< largest error estimate of the quadrature met
  double anisotropy = 0;  ///< largest |albedo at one azimuth - azimuthal average| met; 0 if it does not depend on it
  std::string doc;        ///< what the table holds, for people

  /// The terms for complete or partial values; what is missing takes its default.
  const std::vector<AlbedoTerm>& terms_for(const Model&, const ParamValues&) const;
  /// All floats of all grids.
  std::size_t size() const;
};

/// Albedo, mirror included, by interpolation. Throws InputError for inadmissible parameters.
Rgb<double> lookup(const AlbedoTable&, const Model&, const ParamValues&, double cos_theta_o);

}  // namespace brdfc::measure
