// SPDX-License-Identifier: GPL-3.0-or-later
// The ways to ask a bound model for the same thing.
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "support.h"

namespace brdfc {
namespace {

class EveryModelBound : public testing::TestWithParam<std::string> {};

Vec3<double> any_direction(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0, 1);
  return direction(std::max(u(random), 1e-6), 2 * kPi * u(random));
}

TEST_P(EveryModelBound, EvaluatesAsOneAfterTheOther) {
  const Model& m = find_model(GetParam());
  const auto brdf = m.make_double(values_of(m, {}));
  std::mt19937_64 random(1);
  for (int i = 0; i < 500; ++i) {
    Vec3<double> wi = any_direction(random);
    if (m.two_sided() && i % 2) wi.z = -wi.z;
    const Vec3<double> wo = any_direction(random);
    const Evaluation<double> both = brdf->evaluate(wi, wo);
    const Rgb<double> f = brdf->eval(wi, wo);
    ASSERT_EQ(both.f.r, f.r);
    ASSERT_EQ(both.f.g, f.g);
    ASSERT_EQ(both.f.b, f.b);
    ASSERT_EQ(both.pdf, brdf->pdf(wi, wo));
  }
}

/// A parameter that is assigned later is as good as one that was there from the start.
TEST_P(EveryModelBound, TakesParametersAnew) {
  const Model& m = find_model(GetParam());
  std::mt19937_64 random(2);
  for (const ParamInfo& p : m.info().params) {
    if (p.kind == ParamKind::Choice) continue;
    const double x = p.soft_min + 0.3 * (p.soft_max - p.soft_min);
    ParamValues values = values_of(m, {});
    if (p.kind == ParamKind::Number)
      values[p.name] = x;
    else
      values[p.name] = std::array<double, 3>{x, x / 2, x / 3};
    const auto expected = m.make_double(values), brdf = m.make_double(values_of(m, {}));
    brdf->assign("no such parameter", {7, 7, 7});
    brdf->assign(p.name, {x, x / 2, x / 3});
    for (int i = 0; i < 20; ++i) {
      const Vec3<double> wi = any_direction(random), wo = any_direction(random);
      ASSERT_EQ(brdf->eval(wi, wo).g, expected->eval(wi, wo).g) << p.name;
      ASSERT_EQ(brdf->mirror(wo).g, expected->mirror(wo).g) << p.name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Models, EveryModelBound, testing::ValuesIn(model_names()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace brdfc
