// SPDX-License-Identifier: GPL-3.0-or-later
// Integrals over directions that a model's own samples guide.
#pragma once

#include <functional>
#include <vector>

#include "core/sequence.h"
#include "measure/cubature.h"
#include "model/model.h"

namespace brdfc::measure {

/// The intervals of the first random number on which sample() uses one lobe, with the second and third number given:
/// ends, increasing from 0 to 1. Empty if the direction changes with the first number everywhere.
std::vector<double> lobe_borders(const Brdf<double>&, const Vec3<double>& wo, const Point2& others);
/// Those intervals if they are the same for all values of the other numbers. Empty if they are not, as in a model that
/// draws a half vector and then reflects or refracts with the probability that Fresnel's equations give for it.
std::vector<double> lobe_borders(const Brdf<double>&, const Vec3<double>& wo);

/// Where in the hemisphere a model's samples fall: cells for a cubature over (theta, phi - phi_o), coordinates in which
/// smooth functions of the direction are smooth up to the pole.
class Guides {
 public:
  /// Draws `each` samples of each lobe of the model for this view.
  Guides(const Brdf<double>&, const Vec3<double>& wo, int each);
  /// theta in [0, pi], phi in [0, 2 pi) from the azimuth of wo; the mirror direction has phi = pi.
  Point2 angles(const Vec3<double>& wi) const;
  /// The direction of these angles.
  Vec3<double> direction_at(double theta, double phi) const;
  /// Cells that cover the hemisphere, or the sphere if the model scatters through: cut at the mirror direction, and
  /// halved until none has more than `most` samples of a lobe.
  std::vector<Rect> cells(std::size_t most) const;
  /// Cells that cover a rectangle that holds many samples.
  std::vector<Rect> cells(const Rect&, std::size_t most) const;

 private:
  const Brdf<double>& brdf_;
  Vec3<double> wo_;
  double sin_o_, theta_o_, cos_phi_, sin_phi_;
  double edge_ = 0;  // angle at which what is let through ends, if the model scatters through; else 0
  std::vector<std::vector<Point2>> lobes_;
};

/// Integral over wi in the upper hemisphere, in solid angle; over the sphere for a guide that scatters through. `guide`
/// says by its samples where to look first, so that a peak is found though it be far narrower than the distance of the
/// rule's nodes. `integrand` writes `components` numbers.
CubatureResult integrate_hemisphere(const Brdf<double>& guide, const Vec3<double>& wo, std::size_t components,
                                    const std::function<void(const Vec3<double>& wi, double*)>& integrand,
                                    const CubatureOptions&, int guides = 512);

}  // namespace brdfc::measure
