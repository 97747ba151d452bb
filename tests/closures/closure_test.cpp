// SPDX-License-Identifier: GPL-3.0-or-later
// The definitions of Cycles' closures; tests/blender/conformance.py compares them with Cycles.
#include "closures/closure.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/sequence.h"
#include "model/base_terms.h"
#include "model/sampling.h"

namespace brdfc {
namespace {

Vec3<double> at(double degrees, double phi) { return direction(std::cos(degrees * kPi / 180), phi); }

/// The integral of f cos over the hemisphere.
Rgb<double> albedo(const Closure<double>& c, const Vec3<double>& wo) {
  Rgb<double> sum(0.0);
  constexpr int kPoints = 1 << 15;
  Sequence3 points(1);
  for (int i = 0; i < kPoints; ++i) {
    const Vec3<double> u = points.next(), wi = sample_cosine(u.x, u.y);
    if (wi.z > 0) sum += evaluate(c, wi, wo) * (kPi / wi.z / kPoints);
  }
  return sum;
}

Closure<double> rough_matte(double roughness, const Rgb<double>& albedo) {
  Closure<double> c(ClosureKind::OrenNayar, Rgb<double>(1.0));
  c.roughness = roughness;
  c.albedo = albedo;
  return c;
}

TEST(Closure, ASmoothMatteSurfaceIsLamberts) {
  const Vec3<double> wi = at(30, 1), wo = at(70, 4);
  for (const double albedo : {0., 0.5, 1.}) {
    const Rgb<double> f = evaluate(rough_matte(0, Rgb<double>(albedo)), wi, wo);
    EXPECT_NEAR(f.r, albedo * wi.z / kPi, 1e-15);
  }
}

/// Interreflection between facets of albedo 1 returns all the light that single reflection loses.
TEST(Closure, ARoughMatteSurfaceOfWhiteFacetsLosesNoLight) {
  for (const double roughness : {0.1, 0.5, 1.})
    for (const double degrees : {0., 40., 60., 75.}) {
      EXPECT_NEAR(albedo(rough_matte(roughness, Rgb<double>(1.0)), at(degrees, 0.3)).g, 1, 2e-3)
          << roughness << " " << degrees;
      EXPECT_LT(albedo(rough_matte(roughness, Rgb<double>(0.5)), at(degrees, 0.3)).g, 0.5);
    }
}

/// Values of an independent implementation that agrees with Cycles 4.5 and 5.2 to 1e-7.
TEST(Closure, ARoughMatteSurfaceHasTheValuesOfCycles) {
  const Closure<double> c = rough_matte(0.7, Rgb<double>(0.8, 0.5, 0.2));
  const Rgb<double> beside = evaluate(c, at(30, 1), at(70, 1.5)), opposite = evaluate(c, at(50, 0.4), at(75, 3));
  EXPECT_NEAR(beside.r, 0.2567231652999792, 1e-12);
  EXPECT_NEAR(beside.b, 0.06135512621035594, 1e-12);
  EXPECT_NEAR(opposite.r, 0.08112444531293897, 1e-12);
  EXPECT_NEAR(opposite.g, 0.04861150379774029, 1e-12);
}

TEST(Closure, ARoughMatteSurfaceIsReciprocal) {
  const Closure<double> c = rough_matte(0.7, Rgb<double>(0.9, 0.5, 0.1));
  const Vec3<double> a = at(20, 0.2), b = at(80, 2.5);
  const Rgb<double> there = evaluate(c, a, b) / a.z, back = evaluate(c, b, a) / b.z;
  EXPECT_NEAR(there.r, back.r, 1e-14);
  EXPECT_NEAR(there.b, back.b, 1e-14);
}

/// f cos of the model as published, with the exact albedo of facets.
Rgb<double> eon(const Rgb<double>& rho, double r, const Vec3<double>& wi, const Vec3<double>& wo) {
  const double c1 = 0.5 - 2 / (3 * kPi), c2 = 2. / 3 - 28 / (15 * kPi), AF = 1 / (1 + c1 * r), BF = r * AF;
  const auto E = [&](double mu) {
    const double s = std::sqrt(1 - mu * mu);
    return AF + BF / kPi * (s * (std::acos(mu) - s * mu) + 2. / 3 * ((s / mu) * (1 - s * s * s) - s));
  };
  const double s = dot(wi, wo) - wi.z * wo.z, t = s > 0 ? s / std::max(wi.z, wo.z) : s, mean = AF * (1 + c2 * r);
  const Rgb<double> again = rho * rho * mean / (Rgb<double>(1.0) - rho * (1 - mean));
  const Rgb<double> f = rho * (AF * (1 + r * t)) + again * ((1 - E(wo.z)) * (1 - E(wi.z)) / (1 - mean));
  return f * (wi.z / kPi);
}

TEST(Closure, LosslessRoughFacetsAreOneClosure) {
  const Rgb<double> rho(0.95, 0.5, 0.05), ends(1, 0, 1e-9);
  for (const double r : {0.05, 0.3, 1.})
    for (const auto& [wi, wo] : {std::pair{at(30, 1), at(70, 1.5)}, {at(50, 0.4), at(75, 3)}, {at(5, 0), at(85, 2)}}) {
      for (const Rgb<double>& colour : {rho, ends}) {
        const Closure<double> c = lossless_rough_facets(colour, r);
        const Rgb<double> found = evaluate(c, wi, wo), expected = eon(colour, r, wi, wo);
        EXPECT_GE(std::min({c.weight.r, c.weight.g, c.weight.b, c.albedo.r, c.albedo.g, c.albedo.b}), 0);
        EXPECT_LE(std::max({c.weight.r, c.weight.g, c.weight.b, c.albedo.r, c.albedo.g, c.albedo.b}), 1);
        EXPECT_NEAR(found.r, expected.r, 1e-13 * expected.r) << r;
        EXPECT_NEAR(found.g, expected.g, 1e-13 * expected.g) << r;
        EXPECT_NEAR(found.b, expected.b, 1e-13 * expected.b) << r;
      }
      // A closure of this colour and the weight 1 has too little interreflection.
      EXPECT_LT(evaluate(rough_matte(r, rho), wi, wo).g, eon(rho, r, wi, wo).g * (1 - 1e-3 * r));
    }
}

TEST(Closure, RoughFacetsReflectOnce) {
  for (const double ratio : {0., 0.2, 1.}) {
    const Closure<double> c = rough_facets(Rgb<double>(0.5), ratio);
    for (const auto& [wi, wo] : {std::pair{at(30, 1), at(70, 1.5)}, {at(50, 0.4), at(75, 3)}}) {
      const double s = dot(wi, wo) - wi.z * wo.z, t = s > 0 ? s / std::max(wi.z, wo.z) : s;
      EXPECT_NEAR(evaluate(c, wi, wo).g, 0.5 * wi.z / kPi * (1 + ratio * t), 1e-5);
    }
  }
}

/// Compared with the form in Cycles' source, which divides by the cosine.
TEST(Closure, TheLossOfARoughMatteSurfaceKeepsItsDigitsNearTheHorizon) {
  for (const double c : {1., 0.7, 0.2, 1e-2}) {
    const double s = std::sqrt(1 - c * c), theta = std::acos(c);
    const double G = s * (theta - 2. / 3 - s * c) + 2. / 3 * (s / c) * (1 - s * s * s);
    EXPECT_NEAR(matte_loss(c), kPi / 2 - 2. / 3 - G, 1e-12) << c;
  }
  EXPECT_NEAR(matte_loss(1e-12), 1e-12, 1e-15);
  EXPECT_NEAR(matte_loss(1e-4f), 1e-4f, 3e-7f);
}

TEST(Closure, BurleysIsTheFormulaOfTheHalfVector) {
  Closure<double> c(ClosureKind::Burley, Rgb<double>(1.0));
  c.roughness = 0.7;
  const Vec3<double> wi = at(50, 0.4), wo = at(75, 3), h = normalize(wi + wo);
  const double F90 = 0.5 + 2 * c.roughness * dot(wi, h) * dot(wi, h);
  const auto mix = [&](double cosine) { return 1 + (F90 - 1) * std::pow(1 - cosine, 5); };
  EXPECT_NEAR(evaluate(c, wi, wo).g, wi.z / kPi * mix(wi.z) * mix(wo.z), 1e-15);
}

TEST(Closure, VelvetIsTheFormulaOfTheHalfVector) {
  Closure<double> c(ClosureKind::Velvet, Rgb<double>(1.0));
  c.roughness = 0.6;
  const Vec3<double> wi = at(50, 0.4), wo = at(75, 3), h = normalize(wi + wo);
  const double s2 = 1 - h.z * h.z;
  const double D = std::exp(-h.z * h.z / s2 / 0.36) / (kPi * 0.36 * s2 * s2);
  const double G = std::min(1., 2 * h.z * std::min(wi.z, wo.z) / dot(wi, h));
  EXPECT_NEAR(evaluate(c, wi, wo).g, D * G / (4 * wo.z), 1e-14);
  EXPECT_EQ(evaluate(c, wo, wo).g, evaluate(c, wo, wo).g) << "no NaN where the half vector is the view";
  const Vec3<double> normal = at(0, 0);
  EXPECT_EQ(evaluate(c, normal, normal).g, 0);
}

}  // namespace
}  // namespace brdfc
