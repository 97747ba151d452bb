// SPDX-License-Identifier: GPL-3.0-or-later
// A fit and the sampled residual are the model in expectation.
#include "represent/controlled.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analysis/probes.h"
#include "pack/plan.h"
#include "pack/shader.h"
#include "support.h"

namespace brdfc {
namespace {

using testing::HasSubstr;

struct Row {
  const char* model;
  std::vector<std::string> values;
};
/// One of each family of closures; the first has a fit that is far off at grazing views.
const Row kRows[] = {{"ashikhmin_shirley", {"nu=10", "nv=10"}}, {"ward", {}}, {"phong", {"e=20"}}};

/// Moments of a distribution over directions.
using Moments = std::array<double, 5>;
Moments moments_of(const Vec3<double>& w) { return {1, w.x, w.z, w.x * w.x, w.z * w.z}; }

/// Where the closures give light and the model draws nothing, too: means of the drawn residual against a grid. 45
/// comparisons at 4.5 standard errors: a right form fails once in 3000 seeds, and the seed is fixed.
TEST(Controlled, IsTheModelInExpectation) {
  constexpr int kHeights = 1000, kTurns = 800, kDraws = 100000;
  for (const Row& row : kRows) {
    const Model& m = find_model(row.model);
    const ParamValues values = values_of(m, row.values);
    const Fit& fit = fit_of(m, values);
    const auto brdf = m.make_double(values);
    Random random(5);
    for (const double cosTheta_o : {0.08, 0.4, 0.95}) {
      const Vec3<double> wo = direction(cosTheta_o, 0);
      Moments exact{}, sum{}, squares{};
      double size = 0;
      for (int i = 0; i < kHeights; ++i)
        for (int j = 0; j < kTurns; ++j) {
          const Vec3<double> wi = direction((i + 0.5) / kHeights, 2 * kPi * (j + 0.5) / kTurns);
          const double lack = (brdf->eval(wi, wo).g * wi.z - fit.f_cos(wi, wo).g) * 2 * kPi / (kHeights * kTurns);
          const Moments g = moments_of(wi);
          for (std::size_t k = 0; k < g.size(); ++k) exact[k] += lack * g[k];
          size += std::abs(lack);
        }
      for (int i = 0; i < kDraws; ++i) {
        const Residual<double> r = sample_residual(*brdf, fit, wo, uniform_cube(random));
        const Moments g = moments_of(r.wi);
        for (std::size_t k = 0; k < g.size(); ++k) {
          sum[k] += r.weight.g * g[k] / kDraws;
          squares[k] += sqr(r.weight.g * g[k]) / kDraws;
        }
      }
      for (std::size_t k = 0; k < sum.size(); ++k) {
        const double error = std::sqrt((squares[k] - sqr(sum[k])) / kDraws);
        EXPECT_LT(error, 0.03 * size) << "too noisy to tell";
        EXPECT_NEAR(sum[k], exact[k], 4.5 * error + 0.01 * size)
            << row.model << " moment " << k << " at " << cosTheta_o << ", residual " << size;
      }
    }
  }
}

/// What sample_residual() relies on.
TEST(Controlled, LostDirectionsLieBelowTheSurface) {
  Random random(8);
  for (const auto& [name, m] : models()) {
    const ParamValues values = complete(m->info(), {});
    if (unfit(*m, values)) continue;
    const auto brdf = m->make_double(values);
    for (int i = 0; i < 2000; ++i) {
      const Sample<double> s = brdf->sample(uniform_direction(random), uniform_cube(random));
      EXPECT_EQ(s.pdf > 0, s.wi.z > 0) << name;
    }
  }
}

TEST(Controlled, TheDrawnDirectionTakesItsShareFromTheRamps) {
  Random random(6);
  for (const Row& row : kRows) {
    const Model& m = find_model(row.model);
    const ParamValues values = values_of(m, row.values);
    const Fit& fit = fit_of(m, values);
    const auto brdf = m.make_double(values);
    for (int i = 0; i < 200; ++i) {
      const Vec3<double> wo = uniform_direction(random), wi = uniform_direction(random), u = uniform_cube(random);
      const Controlled<double> c = controlled(*brdf, fit, wo, u);
      const Residual<double> r = sample_residual(*brdf, fit, wo, u);
      EXPECT_NEAR(c.colour.g * c.weight, r.weight.g, 1e-9 + 1e-9 * std::abs(r.weight.g));
      double weights = c.weight, of_fit = 0;
      Rgb<double> f_cos(0.0);
      for (Closure<double> closure : c.closures) {
        EXPECT_GE(closure.weight.g, 0);
        weights += closure.weight.g;
        if (has_ramp(closure.kind)) closure.weight = Rgb<double>(1.0);  // its colours are not divided yet
        f_cos += evaluate(closure, wi, wo);
      }
      for (const Closure<double>& closure : fit.closures(wo)) of_fit += closure.weight.g;
      EXPECT_NEAR(f_cos.g, fit.f_cos(wi, wo).g, 1e-9 * (1 + f_cos.g));
      EXPECT_NEAR(f_cos.g, evaluate(fit.closures(wo), wi, wo).g, 1e-9 * (1 + f_cos.g));
      // More only where facets leave ramps next to nothing.
      EXPECT_GE(weights, of_fit * (1 - 1e-9)) << row.model;
      if (std::string(row.model) == "phong") {
        EXPECT_NEAR(weights, of_fit, 0.11 * of_fit);
      }
    }
  }
}

/// Without the albedo, which takes long to tabulate.
Shader shader_of(const Model& m, const ParamValues& values) {
  AlbedoTable none;
  none.terms.resize(choice_combinations(m.info()).size());
  return write_shader(m, RepresentationKind::Controlled, none, values);
}

TEST(Controlled, ShadersDrawOneDirection) {
  for (const Row& row : kRows) {
    const Model& m = find_model(row.model);
    const ParamValues values = values_of(m, row.values);
    const Shader s = shader_of(m, values);
    EXPECT_LE(s.operations, kMaxOperations) << row.model;
    EXPECT_LE(s.slots, kMaxClosures);
    EXPECT_THAT(s.source, HasSubstr("residual_weight * brdfc_ray_coloured("));
    const RepresentationError e = measure_error(m, RepresentationKind::Controlled, values);
    EXPECT_FALSE(e.relative_l1) << "equal in expectation";
    EXPECT_LT(e.albedo, 1e-3) << row.model;
    EXPECT_THAT(e.note, HasSubstr("of the light off"));
  }
}

TEST(Controlled, IsRefusedWhereItWouldBeTooLong) {
  const Model& m = find_model("ashikhmin_shirley");
  const ParamValues values = values_of(m, {"nu=10", "nv=10", "rs=0.9,0.5,0.1", "rd=0.1,0.4,0.5"});
  try {
    shader_of(m, values);
    FAIL() << "not refused";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("ashikhmin_shirley: the controlled form"));
    EXPECT_THAT(e.what(), HasSubstr("700"));
  }
}

TEST(Controlled, IsPlannedWhereItIsAskedFor) {
  const auto need = [](const char* model, const std::vector<std::string>& text) {
    const Model& m = find_model(model);
    MaterialNeed n;
    n.id = "ball";
    n.model = &m;
    n.values = values_of(m, text);
    n.representation = "controlled";
    return n;
  };
  EXPECT_THAT(plan_scene({need("phong", {"e=20"})})[0].forms, testing::ElementsAre(RepresentationKind::Controlled));
  try {
    plan_scene({need("ward", {"ax=0.1", "ay=0.5"})});
    FAIL() << "not refused";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("material ball: ward has no form 'controlled' here: it is anisotropic"));
  }
}

}  // namespace
}  // namespace brdfc
