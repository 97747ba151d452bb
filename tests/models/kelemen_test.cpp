// SPDX-License-Identifier: GPL-3.0-or-later
// What generator/models/kelemen.cpp states of its energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "measure/albedo.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "model/model.h"

namespace brdfc {
namespace {

TEST(Kelemen, LosesAPercentOfTheLightAndGainsNone) {
  measure::Random random(3);
  double of_facets = 0, of_clear = 0, most = 0;
  constexpr int kCases = 16;
  for (int i = 0; i < kCases; ++i) {
    const double m = i % 2 == 0 ? std::pow(10, -3 * measure::uniform(random)) : 0.03 + 0.97 * measure::uniform(random);
    const double reach = 4 * m * measure::uniform(random);  // views that facets of the slope m hide, and others
    const double c = i % 4 < 2 ? std::min(reach, 1.) : measure::uniform(random);
    for (const double f0 : {0., 1.}) {
      const measure::BoundModel bound = measure::bind_model(find_model("kelemen"), {{"m", m}, {"f0", f0}, {"rm", 1.}});
      const measure::Albedo a = measure::albedo(*bound.brdf, c, 0, bound.label, {.absolute = 1e-5});
      const double lost = 1 - a.scattered.g;
      EXPECT_GE(lost, -a.error) << bound.label << " cosine " << c;
      (f0 == 1 ? of_facets : of_clear) += lost / kCases;
      most = std::max(most, lost);
    }
  }
  EXPECT_LE(most, 0.0215);
  EXPECT_LE(of_facets, 0.006);
  EXPECT_LE(of_clear, 0.0115);
  std::printf("f0 = 1: %.4f, f0 = 0: %.4f, most %.4f\n", of_facets, of_clear, most);
}

TEST(Kelemen, FacetsReflectNoMoreThanThoseOfCavities) {
  measure::Random random(4);
  for (const double m : {0.02, 0.2, 1.}) {
    const measure::BoundModel ours = measure::bind_model(find_model("kelemen"), {{"m", m}, {"f0", 1.}, {"rm", 0.}});
    const measure::BoundModel cavities = measure::bind_model(find_model("cook_torrance"), {{"m", m}, {"f0", 1.}});
    for (int i = 0; i < 2000; ++i) {
      const Vec3<double> wi = measure::uniform_direction(random), wo = measure::uniform_direction(random);
      ASSERT_LE(ours.brdf->eval(wi, wo).g, cavities.brdf->eval(wi, wo).g * (1 + 1e-9)) << ours.label;
    }
  }
}

}  // namespace
}  // namespace brdfc
