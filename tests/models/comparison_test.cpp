// SPDX-License-Identifier: GPL-3.0-or-later
// The flaws of the classic models, as described by the papers on their successors, each as a number. A model without
// its flaw would not be that model. Albedos were integrated by make_golden.py.
#include <gtest/gtest.h>

#include <boost/math/special_functions/ellint_1.hpp>

#include "measure/albedo.h"
#include "measure/bound_model.h"
#include "model/sampling.h"

namespace brdfc {
namespace {

measure::BoundModel bind(const char* model, const std::vector<std::string>& values) {
  const Model& m = find_model(model);
  return measure::bind_model(m, parse_values(m.info(), values));
}

double degrees(double angle) { return angle * kPi / 180; }

/// A direction in the plane of incidence; negative angles are on the side opposite to the viewer.
Vec3<double> in_plane(double angle) { return {std::sin(angle), 0, std::cos(angle)}; }

double f(const measure::BoundModel& b, const Vec3<double>& wi, const Vec3<double>& wo) {
  return b.brdf->eval(wi, wo).g;
}

/// The albedo at a polar angle in degrees.
double albedo_at_degrees(const measure::BoundModel& b, double angle) {
  return measure::albedo(*b.brdf, std::cos(degrees(angle))).total().g;
}

/// The difference of f's slopes on both sides of `angle`, as wi moves in the plane of incidence, relative to f.
double slope_jump(const measure::BoundModel& b, double angle, const Vec3<double>& wo) {
  const double h = 1e-4;
  const auto at = [&](double offset) { return f(b, in_plane(angle + offset), wo); };
  // Second-order differences on each side.
  const double right = (-3 * at(0) + 4 * at(h) - at(2 * h)) / (2 * h);
  const double left = (3 * at(0) - 4 * at(-h) + at(-2 * h)) / (2 * h);
  return std::abs(right - left) / at(0);
}

TEST(Phong, IsNotReciprocalAndGainsOrLosesWithTheExponent) {
  const measure::BoundModel b = bind("phong", {"ks=1", "e=20"});
  const Vec3<double> high = in_plane(degrees(-20)), low = in_plane(degrees(70));
  EXPECT_NEAR(f(b, low, high) / f(b, high, low), std::cos(degrees(20)) / std::cos(degrees(70)), 1e-12);
  EXPECT_NEAR(albedo_at_degrees(b, 0), 2 * kPi / 21, 1e-8);
  EXPECT_NEAR(albedo_at_degrees(b, 85), 0.195597, 1e-6);  // a third of the lobe is below the horizon
  EXPECT_NEAR(albedo_at_degrees(bind("phong", {"ks=1", "e=1"}), 0), kPi, 1e-7);
  EXPECT_NEAR(albedo_at_degrees(bind("phong", {"ks=1", "e=10000"}), 0), 2 * kPi / 10001, 1e-8);
}

TEST(Phong, LobesLeaveBlackPatches) {
  const Vec3<double> wo = in_plane(degrees(50)), beyond = in_plane(degrees(41)), before = in_plane(degrees(39));
  for (const char* model : {"phong", "modified_phong", "max_phong"}) {
    const measure::BoundModel b = bind(model, {"e=1"});
    EXPECT_EQ(f(b, beyond, wo), 0) << model;
    EXPECT_GT(f(b, before, wo), 0) << model;
  }
  EXPECT_GT(f(bind("blinn", {"e=1"}), beyond, wo), 0.01);
  EXPECT_GT(f(bind("radziszewski_alda", {"n=1"}), beyond, wo), 0.01);
}

TEST(ModifiedPhong, DarkensWithTheCosine) {
  const measure::BoundModel wide = bind("modified_phong", {"ks=1", "e=20"}),
                            narrow = bind("modified_phong", {"ks=1", "e=1e8"});
  EXPECT_NEAR(albedo_at_degrees(wide, 0), 1, 1e-8);
  EXPECT_NEAR(albedo_at_degrees(wide, 85), 0.138293, 1e-6);
  for (const double angle : {0., 60., 85.})
    EXPECT_NEAR(albedo_at_degrees(narrow, angle), std::cos(degrees(angle)), 1e-6);
}

TEST(MaxPhong, HasAHighlightOfOneBrightnessAndAnEdge) {
  const measure::BoundModel b = bind("max_phong", {"ks=1", "e=20"});
  for (const double angle : {0., 45., 85.})
    EXPECT_NEAR(f(b, in_plane(degrees(-angle)), in_plane(degrees(angle))) * std::cos(degrees(angle)), 21 / (2 * kPi),
                1e-12);
  EXPECT_NEAR(albedo_at_degrees(b, 0), 21. / 22, 1e-8);
  EXPECT_NEAR(albedo_at_degrees(b, 85), 0.576011, 1e-6);
  EXPECT_NEAR(albedo_at_degrees(bind("max_phong", {"ks=1", "e=10000"}), 85), 0.954356, 1e-6);
  // d/d theta_i of 1 / max(): 0 on the side where wo is higher, tan theta on the other.
  EXPECT_NEAR(slope_jump(b, degrees(-50), in_plane(degrees(50))), std::tan(degrees(50)), 1e-3);
  EXPECT_LT(slope_jump(bind("modified_phong", {"ks=1", "e=20"}), degrees(-50), in_plane(degrees(50))), 1e-3);
}

TEST(Cavities, HaveAnEdgeWhereFacetsBeginToBlock) {
  // Finds by bisection where the smaller of the blocking terms in G reaches 1.
  const Vec3<double> wo = in_plane(degrees(50));
  const auto blocked = [&](double angle) {
    const Vec3<double> wi = in_plane(angle), h = normalize(wi + wo);
    return 2 * h.z * minimum(wi.z, wo.z) / dot(wo, h) - 1;
  };
  double lo = degrees(-85), hi = degrees(-50);  // blocked, free
  ASSERT_LT(blocked(lo), 0);
  ASSERT_GT(blocked(hi), 0);
  for (int i = 0; i < 60; ++i) (blocked((lo + hi) / 2) < 0 ? lo : hi) = (lo + hi) / 2;
  const measure::BoundModel blinn = bind("blinn", {"ks=1", "e=20"}), cook = bind("cook_torrance", {"f0=1", "m=0.3"});
  EXPECT_GT(slope_jump(blinn, lo, wo), 0.5);
  EXPECT_GT(slope_jump(cook, lo, wo), 0.5);
  EXPECT_LT(slope_jump(blinn, lo + 0.05, wo), 1e-3);
  EXPECT_LT(slope_jump(bind("radziszewski_alda", {"n=4"}), lo, wo), 1e-3);
}

TEST(Cavities, LoseLittleAndGainNothing) {
  EXPECT_NEAR(albedo_at_degrees(bind("blinn", {"ks=1", "e=50"}), 60), 0.966078, 1e-6);
  EXPECT_NEAR(albedo_at_degrees(bind("cook_torrance", {"f0=1", "m=0.3"}), 60), 0.924766, 1e-6);
  EXPECT_NEAR(albedo_at_degrees(bind("cook_torrance", {"f0=1", "m=0.3"}), 85), 0.970237, 1e-6);
}

TEST(Ward, OnlyTheBoundedNormalisationKeepsWithinOne) {
  const auto at = [](const char* normalisation, double cos_theta) {
    const measure::BoundModel b =
        bind("ward", {"ks=1", "ax=0.3", "ay=0.3", std::string("normalisation=") + normalisation});
    return measure::albedo(*b.brdf, cos_theta).total().g;
  };
  EXPECT_NEAR(at("bounded", 0.5), 0.818595, 1e-6);
  EXPECT_NEAR(at("bounded", 0.001), 0.989784, 1e-5);
  EXPECT_NEAR(at("ward", 0.5), 0.422328, 1e-6);  // half of the light is lost at 60 degrees
  EXPECT_NEAR(at("ward", 0.1), 0.232096, 1e-6);
  EXPECT_NEAR(at("ward", 0.001), 1.363675, 1e-5);  // and gained near the horizon
  EXPECT_NEAR(at("duer", 0.1), 1.160863, 1e-6);
  EXPECT_NEAR(at("duer", 0.01), 7.164212, 1e-5);
}

TEST(Schlick, AnisotropyCostsLight) {
  const auto scattered = [](const char* p) {
    return measure::albedo(*bind("schlick", {"r=1", "rough=0.25", p}).brdf, 1).scattered.g;
  };
  const double p = 0.1, kept = 2 / kPi * std::sqrt(p) * boost::math::ellint_1(std::sqrt(1 - p * p));
  EXPECT_NEAR(kept, 0.744, 5e-4);
  EXPECT_NEAR(scattered("p=0.1") / scattered("p=1"), kept, 1e-6);
}

TEST(OrenNayar, GainsAtGrazingAnglesAndBarelyStaysPositive) {
  const auto at = [](const char* form, const char* sigma) {
    return measure::albedo(*bind("oren_nayar", {"rho=1", form, sigma}).brdf, 0.02).total().g;
  };
  EXPECT_NEAR(at("form=full", "sigma=0.3"), 1.043471, 2e-6);
  EXPECT_NEAR(at("form=qualitative", "sigma=0.2"), 1.014282, 2e-6);
  // Both directions grazing and opposite: the remainder of Lambert's 1 at the end of the accepted range.
  const measure::BoundModel b = bind("oren_nayar", {"rho=1e-6", "sigma=0.66"});
  const double left = f(b, in_plane(degrees(-89.999)), in_plane(degrees(89.999))) * kPi / 1e-6;
  EXPECT_GT(left, 0);
  EXPECT_LT(left, 0.004);
}

TEST(Lafortune, ContainsTheModifiedPhongModelAndARetroreflector) {
  const measure::BoundModel b = bind("lafortune", {"cxy=-1", "cz=1", "e=30"}), phong = bind("modified_phong", {"e=30"});
  const measure::BoundModel back = bind("lafortune", {"cxy=1", "cz=1", "e=30"});
  for (const double angle : {-80., -30., 5., 40.}) {
    const Vec3<double> wi = in_plane(degrees(angle)), wo = in_plane(degrees(50));
    EXPECT_NEAR(f(b, wi, wo), f(phong, wi, wo), 1e-12);
    EXPECT_NEAR(f(back, reflect(wi), wo), f(phong, wi, wo), 1e-12);
  }
}

}  // namespace
}  // namespace brdfc
