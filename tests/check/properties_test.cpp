// SPDX-License-Identifier: GPL-3.0-or-later
// Properties of every model for random parameters and directions, shrunk to the simplest failing case: reciprocity,
// non-negative values, energy conservation, rotation. RC_PARAMS="seed=... max_success=..." selects other cases.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cstdlib>

#include "measure/albedo.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "support.h"

namespace brdfc::check {
namespace {

// The same cases in every run, unless the user sets others; read when the first property is checked.
const int kSeeded = ::setenv("RC_PARAMS", "seed=1 max_success=150", 0);

constexpr int kSteps = 1 << 16;

/// Parameters within the sliders' ranges; shrinks to the lower ends, the first choice and black.
ParamValues any_parameters(const ModelInfo& info) {
  ParamValues values;
  for (const ParamInfo& p : info.params) {
    const auto fraction = [] { return *rc::gen::inRange(0, kSteps + 1) / double(kSteps); };
    if (p.kind == ParamKind::Number) {
      values[p.name] = p.slider().at(fraction());
    } else if (p.kind == ParamKind::Color) {
      const double r = fraction(), g = fraction(), b = fraction();
      values[p.name] = std::array<double, 3>{r, g, b};
    } else {
      values[p.name] = p.choices[std::size_t(*rc::gen::inRange(0, int(p.choices.size())))];
    }
  }
  return values;
}

/// A direction above the surface; shrinks to the normal.
Vec3<double> any_direction() {
  const double slope = *rc::gen::inRange(0, kSteps) / double(kSteps);
  return direction(1 - slope, 2 * kPi * *rc::gen::inRange(0, kSteps) / kSteps);
}

double apart(const Rgb<double>& a, const Rgb<double>& b) {
  const auto one = [](double x, double y) { return std::abs(x - y) / std::max({x, y, 1e-30}); };
  return std::max({one(a.r, b.r), one(a.g, b.g), one(a.b, b.b)});
}
Rgb<double> narrow(const Rgb<Wide>& c) { return {double(c.r), double(c.g), double(c.b)}; }

class Property : public testing::TestWithParam<std::string> {
 protected:
  const Model& model() const { return find_model(GetParam()); }
  const ModelInfo& info() const { return model().info(); }
};

TEST_P(Property, ReciprocalModelsAre) {
  if (!info().properties.reciprocal) return;
  EXPECT_TRUE(rc::check(GetParam() + ": f(wi, wo) = f(wo, wi)", [&] {
    const ParamValues v = any_parameters(info());
    if (is_compensated(info(), v)) return;
    const auto brdf = model().make_wide(v);
    const Vec3<Wide> wi = Vec3<Wide>::from(any_direction()), wo = Vec3<Wide>::from(any_direction());
    RC_ASSERT(apart(narrow(brdf->eval(wi, wo)), narrow(brdf->eval(wo, wi))) < 1e-9);
  }));
}

TEST_P(Property, ValuesAreFiniteAndNotNegative) {
  EXPECT_TRUE(rc::check(GetParam() + ": f >= 0", [&] {
    const measure::BoundModel b = measure::bind_model(model(), any_parameters(info()));
    const Vec3<double> wi = any_direction(), wo = any_direction();
    measure::require_value(b.brdf->eval(wi, wo), "f", b.label, wi, wo);
    measure::require_value(b.brdf->pdf(wi, wo), "pdf", b.label, wi, wo);
    measure::require_value(b.brdf->mirror(wo), "mirror", b.label, wi, wo);
  }));
}

TEST_P(Property, ConservingModelsGainNothing) {
  if (!info().properties.conserving) return;
  EXPECT_TRUE(rc::check(GetParam() + ": albedo <= 1", [&] {
    const ParamValues v = any_parameters(info());
    if (is_compensated(info(), v)) return;
    const measure::BoundModel b = measure::bind_model(model(), v);
    const Vec3<double> wo = any_direction();
    const measure::SampledAlbedo s = measure::sampled_albedo(*b.brdf, wo.z, std::atan2(wo.y, wo.x), b.label, 2048);
    RC_ASSERT(max_component(s.scattered + b.brdf->mirror(wo)) <=
              1 + 1e-6 + 7 * s.standard_error + table_error(info(), v));
  }));
}

TEST_P(Property, IsotropicModelsDoNotKnowTheTangent) {
  if (!info().properties.isotropic) return;
  EXPECT_TRUE(rc::check(GetParam() + ": f unchanged by a turn", [&] {
    const auto brdf = model().make_wide(any_parameters(info()));
    const Vec3<Wide> wi = Vec3<Wide>::from(any_direction()), wo = Vec3<Wide>::from(any_direction());
    const Wide angle(2 * kPi * *rc::gen::inRange(0, kSteps) / kSteps), c = cos(angle), s = sin(angle);
    RC_ASSERT(apart(narrow(brdf->eval(wi, wo)), narrow(brdf->eval(rotate_z(wi, c, s), rotate_z(wo, c, s)))) < 1e-9);
  }));
}

INSTANTIATE_TEST_SUITE_P(Models, Property, testing::ValuesIn(model_names()),
                         [](const testing::TestParamInfo<std::string>& info) { return info.param; });

TEST(PropertyChecks, FindAFailureAndShrinkIt) {
  // From a certain reflectance on, Lambert's reflector is brighter than 0.1 / pi in red: the simplest case is that
  // value.
  const Model& lambert = find_model("lambert");
  double simplest = 1;
  testing::internal::CaptureStderr();
  const bool held = rc::check("red stays below 0.1 / pi", [&] {
    const ParamValues v = any_parameters(lambert.info());
    const auto brdf = lambert.make_double(v);
    const double f = brdf->eval(any_direction(), any_direction()).r;
    if (f >= 0.1 / kPi) simplest = std::get<std::array<double, 3>>(v.at("rho"))[0];
    RC_ASSERT(f < 0.1 / kPi);
  });
  EXPECT_NE(testing::internal::GetCapturedStderr().find("Falsifiable"), std::string::npos);
  EXPECT_FALSE(held);
  EXPECT_NEAR(simplest, 0.1, 2. / kSteps);
}

}  // namespace
}  // namespace brdfc::check
