// SPDX-License-Identifier: GPL-3.0-or-later
// What generator/models/edwards.cpp states of its lump and of its energy.
#include <gtest/gtest.h>

#include <cmath>

#include "core/vec.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "model/model.h"

namespace brdfc {
namespace {

measure::BoundModel edwards(double e) { return measure::bind_model(find_model("edwards"), {{"e", e}, {"rho", 1.}}); }

/// BRDF Explorer's edwards06.brdf with R = 1, from its definition: the lump about the disk's centre.
double lump_about_centre(double e, const Vec3<double>& wi, const Vec3<double>& wo) {
  const Vec3<double> sum = wi + wo, h = normalize(sum);
  const double x = wo.z * sum.x / sum.z, y = wo.z * sum.y / sum.z;
  const double lump = (e + 1) / kPi * std::pow(1 - x * x - y * y, e);
  return lump * wo.z * wo.z / (4 * wi.z * dot(wi, h) * std::pow(h.z, 3));
}

TEST(Edwards, IsTheLumpOfBrdfExplorerAtNormalIncidence) {
  measure::Random random(1);
  for (const double e : {1., 20., 300.}) {
    const measure::BoundModel bound = edwards(e);
    for (int i = 0; i < 300; ++i) {
      const Vec3<double> wi = measure::uniform_direction(random), wo = {0, 0, 1};
      const double expected = lump_about_centre(e, wi, wo);
      ASSERT_NEAR(bound.brdf->eval(wi, wo).g, expected, 1e-11 * expected + 1e-300) << bound.label;
    }
  }
}

/// The light that leaves, of light from a direction with this cosine, by the midpoint rule. Azimuths are close together
/// about the mirror direction.
double leaves(double e, double cosine) {
  const measure::BoundModel bound = edwards(e);
  const Vec3<double> wi = {std::sqrt(1 - cosine * cosine), 0, cosine};
  double sum = 0;
  constexpr int kSide = 500;
  for (int i = 0; i < kSide * kSide; ++i) {
    const double theta = kPi / 2 * (i / kSide + 0.5) / kSide, q = (i % kSide + 0.5) / kSide, phi = kPi * (1 - q * q);
    const Vec3<double> wo = {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
    // Both halves; the widths of a step in theta and in phi.
    sum += 2 * bound.brdf->eval(wi, wo).g * wo.z * std::sin(theta) * (kPi / 2 / kSide) * (2 * kPi * q / kSide);
  }
  return sum;
}

TEST(Edwards, SendsMoreLightThanArrivesFromGrazingLamps) {
  EXPECT_NEAR(leaves(20, 1), 0.78368, 1e-4);
  EXPECT_NEAR(leaves(20, 0.15), 1.30757, 1e-3);
  EXPECT_NEAR(leaves(1, 1), 0.27106, 1e-4);
  EXPECT_NEAR(leaves(1, 0.15), 5.0462, 1e-3);
  EXPECT_NEAR(leaves(100, 1), 0.94441, 1e-4);
  EXPECT_NEAR(leaves(100, 0.3), 1.04921, 1e-3);
}

}  // namespace
}  // namespace brdfc
