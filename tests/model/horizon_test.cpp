// SPDX-License-Identifier: GPL-3.0-or-later
// Shading normals that differ from the geometric normal.
#include "model/horizon.h"

#include <gtest/gtest.h>

#include <random>

namespace brdfc {
namespace {

using Vector = Vec3<double>;

Vector unit(const Vector& v) { return v / length(v); }

/// A random direction on the side of the z axis.
Vector any_above(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return unit({uniform(random), uniform(random), std::abs(uniform(random))});
}

TEST(Horizon, ABentNormalBringsTheMirrorDirectionJustAboveTheSurface) {
  std::mt19937 random(7);
  const Vector geometric = {0, 0, 1};
  int bent = 0;
  for (int i = 0; i < 100000; ++i) {
    const Vector wo = any_above(random), n = any_above(random);
    if (!(mirror_rise(geometric, wo, n) < 0)) continue;
    ++bent;
    const Vector now = bent_normal(geometric, wo, n);
    const Vector mirrored = now * (2 * dot(now, wo)) - wo;
    ASSERT_NEAR(length(now), 1, 1e-12);
    ASSERT_NEAR(dot(mirrored, geometric), least_mirror_rise(wo.z), 1e-9) << "view " << wo.z;
    ASSERT_GT(dot(now, wo), 0) << "the viewer sees it";
    // Between both normals, in their plane.
    ASSERT_NEAR(dot(cross(geometric, n), now), 0, 1e-9);
    ASSERT_GE(dot(now, geometric), dot(n, geometric) - 1e-9);
    ASSERT_GE(dot(now, n), dot(n, geometric) - 1e-9);
  }
  EXPECT_GT(bent, 20000);
}

TEST(Horizon, NothingIsBentWhereNormalsAgree) {
  std::mt19937 random(8);
  for (int i = 0; i < 1000; ++i) {
    const Vector n = any_above(random), wo = any_above(random);
    if (dot(n, wo) > 1e-6) {
      EXPECT_GE(mirror_rise(n, wo, n), 0);
    }
  }
}

}  // namespace
}  // namespace brdfc
