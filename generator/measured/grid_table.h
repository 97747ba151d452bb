// SPDX-License-Identifier: GPL-3.0-or-later
// A BRDF on a grid of angles, linear in between.
#pragma once

#include <vector>

#include "measured/measurement.h"

namespace brdfc::measured {

/// Angles in degrees, increasing.
struct AngleAxis {
  enum class Ends {
    Constant,  ///< the value at an end holds beyond it
    Circle,    ///< the first value follows the last one after 360 degrees
  };
  std::vector<double> at;
  Ends ends = Ends::Constant;

  struct Between {
    std::size_t first, second;
    double weight;  ///< of the second
  };
  Between locate(double degrees) const;
};

/// Values over theta_i, phi_i, theta_o and phi_o, of which the last runs fastest. With one value of phi_i the table is
/// isotropic: phi_o then counts from phi_i.
class GridTable final : public Table {
 public:
  AngleAxis theta_i, phi_i, theta_o, phi_o;
  bool mirrored = false;  ///< phi_o covers half a circle, and the other half is its mirror image
  std::vector<std::array<float, 3>> values;

  std::size_t entry(std::size_t ti, std::size_t pi, std::size_t to, std::size_t po) const {
    return ((ti * phi_i.at.size() + pi) * theta_o.at.size() + to) * phi_o.at.size() + po;
  }
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override;
};

}  // namespace brdfc::measured
