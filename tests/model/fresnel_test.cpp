// SPDX-License-Identifier: GPL-3.0-or-later
// The Fresnel equations compared with their textbook form. golden.csv has values of arbitrary precision.
#include "model/fresnel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <complex>

namespace brdfc {
namespace {

/// The textbook form with complex numbers, in long double.
double textbook_conductor(double c, double n, double k) {
  using C = std::complex<long double>;
  const C eta(n, k), cosine(c), root = std::sqrt(eta * eta - C(1) + cosine * cosine);
  const C rs = (cosine - root) / (cosine + root), rp = (eta * eta * cosine - root) / (eta * eta * cosine + root);
  return double((std::norm(rs) + std::norm(rp)) / 2);
}

TEST(Fresnel, ConductorEqualsTheComplexFormula) {
  for (const double n : {0.04, 0.5, 1., 1.5, 4., 50.})
    for (const double k : {0., 1e-6, 0.3, 2., 7., 60.})
      for (int i = 1; i <= 50; ++i) {
        const double c = i / 50., expected = textbook_conductor(c, n, k);
        EXPECT_NEAR(fresnel_conductor(c, (1 - c) * (1 + c), n, k), expected, 1e-13 + 1e-9 * expected)
            << c << " " << n << " " << k;
      }
}

TEST(Fresnel, DielectricEqualsTheConductorWithoutAbsorptionAndLosesNothing) {
  for (const double eta : {0.4, 1 / 1.5, 0.999999, 1., 1.000001, 1.33, 1.5, 2.4})
    for (int i = 1; i <= 50; ++i) {
      const double c = i / 50., s2 = (1 - c) * (1 + c);
      const Dielectric<double> f = fresnel_dielectric(c, s2, eta);
      EXPECT_NEAR(f.reflected, textbook_conductor(c, eta, 0), 1e-12) << c << " " << eta;
      EXPECT_NEAR(f.reflected + f.refracted, 1, 1e-14) << c << " " << eta;
    }
  EXPECT_NEAR(fresnel_dielectric(1., 0., 1.5).reflected, 0.04, 1e-16);
  const double brewster = std::atan(1.5);
  EXPECT_NEAR(fresnel_dielectric(std::cos(brewster), sqr(std::sin(brewster)), 1.5).reflected,
              0.5 * sqr(std::sin(std::atan(1.5) - std::atan(1 / 1.5))), 1e-15);
  EXPECT_EQ(fresnel_dielectric(0.6, 0.64, 1 / 1.5).reflected, 1);  // beyond the critical angle
  EXPECT_EQ(fresnel_dielectric(0.6, 0.64, 1 / 1.5).refracted, 0);
}

TEST(Fresnel, SchlicksErrorForDielectricsIsAsTheyReport) {
  // Compared with the full equations over all angles; the approximation was made for these parameters.
  const auto error = [](double eta) {
    const double r0 = sqr((eta - 1) / (eta + 1));
    double worst = 0;
    for (int j = 1; j <= 1000; ++j) {
      const double c = j / 1000., s2 = (1 - c) * (1 + c);
      worst = std::max(worst, std::abs(r0 + (1 - r0) * std::pow(1 - c, 5) - fresnel_dielectric(c, s2, eta).reflected));
    }
    return worst;
  };
  std::printf("largest error of Schlick's formula: water %.4f, glass %.4f, diamond %.4f\n", error(1.33), error(1.5),
              error(2.42));
  EXPECT_LT(error(1.5), 0.04);
  EXPECT_GT(error(1.5), 0.005);
}

}  // namespace
}  // namespace brdfc
