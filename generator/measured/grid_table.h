// SPDX-License-Identifier: GPL-3.0-or-later
// A BRDF on a grid of angles, linear in between.
#pragma once

#include <vector>

#include "measured/measurement.h"

namespace brdfc::measured {

/// Degrees of a radian.
inline constexpr double kDegrees = 180 / kPi;

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

/// Values over four angles, of which the last runs fastest; NaN where nothing was measured.
class Grid {
 public:
  std::vector<std::array<float, 3>> values;

 protected:
  /// The mean of the up to 16 values around a place, by their weights; 0 if none was measured.
  Rgb<double> at(const std::array<const AngleAxis*, 4>&, const std::array<double, 4>& degrees) const;
};

/// Values over theta_i, phi_i, theta_o and phi_o, of which the last runs fastest. With one value of phi_i the table is
/// isotropic: phi_o then counts from phi_i.
class GridTable final : public Table, public Grid {
 public:
  AngleAxis theta_i, phi_i, theta_o, phi_o;
  bool mirrored = false;  ///< phi_o covers half a circle, and the other half is its mirror image

  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override;
};

/// Values over theta_h, phi_h, theta_d and phi_d, of which the last runs fastest: angles of the half vector, and of the
/// view about it. With one value of phi_h the table is isotropic.
class HalfGridTable final : public Table, public Grid {
 public:
  /// How much of a circle phi_d covers: the rest follows by reciprocity, and by reflection at the plane of the normal
  /// and the half vector.
  enum class Azimuths { Circle, Half, Quarter };
  AngleAxis theta_h, phi_h, theta_d, phi_d;
  Azimuths azimuths = Azimuths::Half;

  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override;
};

}  // namespace brdfc::measured
