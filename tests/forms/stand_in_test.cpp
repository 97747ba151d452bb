// SPDX-License-Identifier: GPL-3.0-or-later
// Closures that models declare in place of a fitted twin.
#include "model/stand_in.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forms/closure_nodes.h"
#include "forms/form.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "support.h"

namespace brdfc::forms {
namespace {

TEST(StandIn, HasWeightsAndWidthsThatNodesAccept) {
  std::size_t seen = 0;
  for (const auto& [name, m] : models()) {
    const StandIn* of = stand_in(*m);
    if (!of) continue;
    std::vector<ParamValues> cases = measure::slider_cases(m->info(), 200, 7);
    for (const bool sliders : {true, false})
      for (const ParamValues& values : measure::end_cases(m->info(), sliders)) cases.push_back(values);
    for (const ParamValues& values : cases)
      for (const double height : {0.0, 1e-6, 0.01, 0.3, 0.99, 1.0}) {
        const Vec3<double> wo = direction(height, 0);
        for (const Closure<double>& c : of->bound(m->info(), values, wo)) {
          measure::require_value(c.weight, "weight", name, c.normal, wo);
          EXPECT_TRUE(!has_facets(c.kind) || (c.alpha > 0 && c.alpha <= 1)) << name << " " << c.alpha;
          ++seen;
        }
      }
  }
  EXPECT_GT(seen, 1000u);
}

/// The only differences from GGX are Smith's shadowing, and the Fresnel term beside the mirror direction.
TEST(StandIn, OfCurvesThatAreGgxIsGgx) {
  const Model& m = find_model("factors");
  for (const double a : {0.02, 0.1, 0.3})
    for (const fit::ViewError& view :
         stand_in_errors(m, values_of(m, {fmt::format("ax={0}", a), fmt::format("ay={0}", a)})))
      EXPECT_TRUE(view.cos_theta_o < 0.9 || view.relative_l1 < 0.02) << a << " " << view.cos_theta_o;
}

TEST(StandIn, AlbedoOfFacetsIsThatOfTheClosure) {
  for (const double alpha : {0.05, 0.3, 0.7, 1.0})
    for (const double height : {0.1, 0.4, 0.8, 1.0}) {
      const Vec3<double> wo = direction(height, 0);
      // Over half vectors, whose density is D (n.h): slopes at equal steps of their distribution.
      constexpr int kSteps = 200;
      double albedo = 0;
      for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
          const double u = (i + 0.5) / kSteps, slope = alpha * std::sqrt(u / (1 - u)), phi = kPi * (j + 0.5) / kSteps;
          const Vec3<double> h = normalize(Vec3<double>{slope * std::cos(phi), slope * std::sin(phi), 1});
          const double oh = dot(wo, h);
          const Vec3<double> wi = h * (2 * oh) - wo;
          if (!(oh > 0 && wi.z > 0)) continue;
          const double D = kInvPi * sqr(1 - u) / (sqr(alpha) * sqr(sqr(h.z)));
          albedo += microfacet(ClosureKind::Ggx, alpha, alpha, wi, wo) * 4 * oh / (D * h.z) / sqr(kSteps);
        }
      EXPECT_NEAR(facet_albedo(alpha, height), albedo, height < 0.2 ? 0.07 : 0.03) << alpha << " " << height;
    }
}

/// A fit's values are not the defaults, so the extension must not state the error that the form has at these.
TEST(StandIn, StatesTheErrorOfItsValuesOnly) {
  const Model& m = find_model("factors");
  const Form& twin = *form("twin");
  EXPECT_TRUE(twin.values(m, {}).empty());
  const FormError any = twin.error(m, {}), half = twin.error(m, {{{"ax", 0.4}, {"ay", 0.4}}});
  EXPECT_EQ(any.at.size(), m.info().params.size());
  EXPECT_EQ(std::get<double>(any.at.at("ax")), 0.2);
  EXPECT_EQ(half.at.size(), m.info().params.size() - 2);
  EXPECT_NE(any.relative_l1, half.relative_l1);
  EXPECT_TRUE(form("twin")->error(find_model("phong"), {twin.values(find_model("phong"), {})}).at.empty());
}

}  // namespace
}  // namespace brdfc::forms
