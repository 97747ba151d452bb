// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers that decide what a table of albedos becomes. A table that is kept is known by all of them.
#pragma once

#include <cstddef>

namespace brdfc::measure {

struct AlbedoTableSettings {
  std::size_t code = 1;  ///< to be raised when the code changes so that tables become others
  /// Least cosine of the view; below it the end of the axis serves: a view direction within 0.06 degrees of the
  /// horizon.
  double min_cos = 1e-3;
  /// Knots are added until the interpolation's estimated error, of the albedo, is below this, or the grid is full.
  double aim_error = 3e-4;
  std::size_t max_points = 6000;     ///< of a grid with up to three axes
  std::size_t max_points_4 = 14000;  ///< of one with four
  /// Two albedos that differ by less, and by less than seven times their own error, count as equal while axes are
  /// sought.
  double same = 1e-4;
  /// Samples a lobe: of a knot, and where a table is proved. Measured on the models here, errors are about 2e-4 and
  /// 2e-5.
  std::size_t grid_samples = 1024, proof_samples = 1 << 13;
  /// Neighbouring knots use the same samples, so that their errors go together: this share of them does not.
  double profile_noise = 0.05;
  /// Of the quadrature over directions that proves a table, as in AlbedoOptions.
  double proof_error = 1e-6;
  std::size_t proof_cells = 2000, proof_witnesses = 1 << 15;
  std::size_t corners = 4;  ///< probes near the ends of all ranges at once
};
inline constexpr AlbedoTableSettings kTableSettings;

}  // namespace brdfc::measure
