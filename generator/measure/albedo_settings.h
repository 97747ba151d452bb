// SPDX-License-Identifier: GPL-3.0-or-later
// Settings that determine an albedo table. All of them are part of the key of a stored table.
#pragma once

#include <cstddef>

namespace brdfc::measure {

struct AlbedoTableSettings {
  std::size_t code = 2;  ///< increase when a change of the code changes the tables
  /// Smallest view cosine on the axis; smaller ones are clamped. They belong to views within 0.06 degrees of the
  /// horizon.
  double min_cos = 1e-3;
  /// Knots are added until the estimated interpolation error of the albedo is below this, or the grid is full.
  double aim_error = 3e-4;
  std::size_t max_points = 6000;     ///< most points of a grid with up to three axes
  std::size_t max_points_4 = 14000;  ///< most points of a grid with four axes
  /// In the search for axes, two albedos count as equal if they differ by less than this and by less than seven times
  /// their own error.
  double same = 1e-4;
  /// Samples for each lobe, at a knot and in the validation of a table. For the models here the measured errors are
  /// about 2e-4 and 2e-5.
  std::size_t grid_samples = 1024, proof_samples = 1 << 13;
  /// Neighbouring knots use the same samples, so that their errors are correlated. This is the uncorrelated share of
  /// the error.
  double profile_noise = 0.05;
  /// Options of the quadrature over directions that validates a table, as in AlbedoOptions.
  double proof_error = 1e-6;
  std::size_t proof_cells = 2000, proof_witnesses = 1 << 15;
  /// Samples for each lobe in the search for coefficients of which one grid serves several choices, and the most by
  /// which two may differ as far as noise explains it.
  std::size_t share_samples = 4096;
  double share_noise = 1e-2;
  /// The most by which noise may explain that a coefficient changes along an axis.
  double axis_noise = 1e-2;
  double max_error = 0.1;   ///< tables with a larger error are refused
  std::size_t corners = 4;  ///< probes near the ends of all ranges at once
};
inline constexpr AlbedoTableSettings kTableSettings;

}  // namespace brdfc::measure
