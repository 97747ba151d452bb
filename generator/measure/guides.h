// SPDX-License-Identifier: GPL-3.0-or-later
// Integrals over directions, guided by the model's own samples.
#pragma once

#include <functional>
#include <vector>

#include "core/sequence.h"
#include "measure/cubature.h"
#include "model/model.h"

namespace brdfc::measure {

/// The intervals of the first random number in which sample() uses the same lobe, for given second and third numbers.
/// Returns their ends, increasing from 0 to 1; empty if the direction changes everywhere with the first number.
std::vector<double> lobe_borders(const Brdf<double>&, const Vec3<double>& wo, const Point2& others);
/// The same intervals, if they do not depend on the second and third number; empty if they do. They do, for example, in
/// a model that samples a half vector and then reflects or refracts with the probability of Fresnel's equations.
std::vector<double> lobe_borders(const Brdf<double>&, const Vec3<double>& wo);

/// Distribution of a model's samples over the hemisphere, as cells for a cubature over (theta, phi - phi_o). In these
/// coordinates a function that is smooth in the direction is smooth up to the pole.
class Guides {
 public:
  /// Draws `each` samples of each lobe for this view.
  Guides(const Brdf<double>&, const Vec3<double>& wo, int each);
  /// The angles of a direction: theta in [0, pi], and phi in [0, 2 pi) from the azimuth of wo. The mirror direction has
  /// phi = pi.
  Point2 angles(const Vec3<double>& wi) const;
  /// The direction with these angles.
  Vec3<double> direction_at(double theta, double phi) const;
  /// Cells that cover the hemisphere, or the sphere if the model scatters through. They are divided at the mirror
  /// direction, and halved until none has more than `most` samples of a lobe.
  std::vector<Rect> cells(std::size_t most) const;
  /// Cells that cover a rectangle with many samples in it.
  std::vector<Rect> cells(const Rect&, std::size_t most) const;

 private:
  const Brdf<double>& brdf_;
  Vec3<double> wo_;
  double sin_o_, theta_o_, cos_phi_, sin_phi_;
  double edge_ = 0;  // theta at which transmitted light ends, if the model scatters through; else 0
  std::vector<std::vector<Point2>> lobes_;
};

/// Integral over wi in the upper hemisphere, in solid angle, or over the sphere if the guide scatters through. The
/// samples of `guide` say where to look first, so that peaks are found even if they are far narrower than the distance
/// between the rule's nodes. `integrand` writes `components` numbers.
CubatureResult integrate_hemisphere(const Brdf<double>& guide, const Vec3<double>& wo, std::size_t components,
                                    const std::function<void(const Vec3<double>& wi, double*)>& integrand,
                                    const CubatureOptions&, int guides = 512);

}  // namespace brdfc::measure
