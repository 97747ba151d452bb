// SPDX-License-Identifier: GPL-3.0-or-later
// Importance sampling of a table: half vectors by a distribution that is tabulated from it, and a cosine lobe.
#pragma once

#include <vector>

#include "measured/measurement.h"
#include "model/model.h"

namespace brdfc::measured {

/// Tabulates how bright half vectors are on average over difference angles, and samples these. Near normal incidence
/// the pdf is close to f cos; at other views it is a good guess, and the cosine lobe covers what it misses.
class HalfVectors final : public Sampler {
 public:
  HalfVectors(const Table&, bool isotropic);
  double pdf(const Vec3<double>& wi, const Vec3<double>& wo) const override;
  Sample<double> sample(const Vec3<double>& wo, const Vec3<double>& u) const override;

 private:
  double facet_pdf(const Vec3<double>& h) const;
  std::size_t thetas_, phis_;
  std::vector<double> density_;       ///< of half vectors per solid angle, over theta and phi
  std::vector<double> rows_, cells_;  ///< cumulative: over theta, and over phi in each row
  double matte_ = 0.5;
};

}  // namespace brdfc::measured
