// SPDX-License-Identifier: GPL-3.0-or-later
// A pack cut to a scene holds what its materials need, and computes the same.
#include "pack/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pack/shader.h"

namespace brdfc {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

MaterialNeed need(const std::string& id, const std::string& model, const std::vector<std::string>& values,
                  const std::string& representation = "auto") {
  const Model& m = find_model(model);
  return {id, &m, parse_values(m.info(), values), {}, representation, kDefaultLobes};
}

TEST(Plan, EverythingIsEveryModelInEveryForm) {
  const auto plan = plan_models({});
  EXPECT_EQ(plan.size(), models().size());
  for (const PlannedModel& p : plan) {
    EXPECT_EQ(p.forms, representations(*p.model));
    EXPECT_TRUE(p.fixed.empty() && p.reasons.empty());
    EXPECT_EQ(p.max_lobes, kMaxLobes);
  }
  EXPECT_THROW(plan_models({"nonesuch"}), InputError);
}

TEST(Plan, FixesWhatIsConstantInAllMaterialsOfAModel) {
  auto textured = need("c", "coupled", {"r0=0.1", "rm=0.5"});
  textured.textured.insert("rm");
  const auto plan = plan_scene({need("b", "coupled", {"r0=0.1", "rm=0.5"}), textured, need("a", "lambert", {"rho=1"})});
  ASSERT_EQ(plan.size(), 2u);
  EXPECT_EQ(plan[0].model->info().name, "coupled");
  EXPECT_THAT(plan[0].materials, ElementsAre("b", "c"));
  EXPECT_EQ(plan[0].fixed.count("r0"), 1u);
  EXPECT_EQ(plan[0].fixed.count("rm"), 0u) << "it varies over a surface";
  EXPECT_THAT(plan[0].forms, ElementsAre(RepresentationKind::Exact));
  EXPECT_EQ(plan[1].fixed.count("rho"), 1u);

  const auto two = plan_scene({need("a", "lambert", {"rho=1"}), need("b", "lambert", {"rho=0.5"}, "sampled")});
  EXPECT_TRUE(two[0].fixed.empty()) << "two values";
  EXPECT_THAT(two[0].forms, ElementsAre(RepresentationKind::Exact, RepresentationKind::Sampled));
  EXPECT_EQ(two[0].max_lobes, 1);
}

TEST(Plan, NamesTheMaterialWhoseFormDoesNotExist) {
  try {
    plan_scene({need("shiny", "radziszewski_alda", {}, "exact")});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("material shiny"));
  }
}

TEST(Plan, FitsWhereTheErrorIsAllowed) {
  const auto forms = [](const std::vector<MaterialNeed>& needs, double error) {
    return plan_scene(needs, {error, false})[0].forms;
  };
  const auto fitted = ElementsAre(RepresentationKind::Fitted), sampled = ElementsAre(RepresentationKind::Sampled);
  EXPECT_THAT(forms({need("a", "phong", {"e=20"})}, 0.03), fitted);
  EXPECT_THAT(forms({need("a", "phong", {"e=20"})}, 0.001), sampled);
  EXPECT_THAT(plan_scene({need("a", "phong", {"e=20"})})[0].forms, sampled) << "not unasked";
  EXPECT_THAT(plan_scene({need("a", "phong", {"e=20"}, "fitted")})[0].forms, fitted);
  EXPECT_THAT(forms({need("a", "coupled", {})}, 0.5), ElementsAre(RepresentationKind::Exact));

  const std::vector<MaterialNeed> two = {need("a", "lafortune", {"cz=0.5", "e=20"}),
                                         need("b", "lafortune", {"cz=0.6", "e=30"})};
  EXPECT_THAT(forms(two, 0.5), sampled);
  EXPECT_THAT(plan_scene(two, {0.5, false})[0].reasons,
              testing::Contains("form fitted: a and b have other values of cz; a and b have other values of e"));
  try {
    plan_scene({two[0], need("b", "lafortune", {"cz=0.6", "e=30"}, "fitted")});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("material b"));
    EXPECT_THAT(e.what(), HasSubstr("a and b have other values of cz; a and b have other values of e"));
  }
  try {
    plan_scene({need("a", "phong", {"e=20"}), need("b", "phong", {"e=3000"}, "fitted")});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("is 3000 on b, where a fit runs from 1 to 1000"));
  }
  EXPECT_THAT(forms({need("a", "phong", {"e=20"}, "sampled")}, 0.5), sampled);
  EXPECT_THAT(plan_scene({need("a", "phong", {"e=20"}, "sampled")}, {0.5, true})[0].forms,
              ElementsAre(RepresentationKind::Sampled, RepresentationKind::Fitted));
  auto textured = need("c", "phong", {"e=20", "ks=0.1"});
  textured.textured.insert("ks");
  const auto plan = plan_scene({need("a", "phong", {"e=20"}), textured}, {0.03, false, true});
  EXPECT_THAT(plan[0].forms, ElementsAre(RepresentationKind::Fitted, RepresentationKind::Twin)) << "ks multiplies f";
  EXPECT_EQ(plan[0].fixed.count("ks"), 0u);
}

/// One number that varies is an axis of a fit's tables, and there is no twin then.
TEST(Plan, FitsAlongANumber) {
  auto textured = need("b", "coupled", {"r0=0.1"}, "fitted");
  textured.textured.insert("r0");
  const std::vector<MaterialNeed> needs = {need("a", "coupled", {"r0=0.05"}, "fitted"), textured};
  const PlannedModel plan = plan_scene(needs, {{}, false, true})[0];
  EXPECT_THAT(plan.forms, ElementsAre(RepresentationKind::Fitted));
  EXPECT_EQ(plan.fixed.count("r0"), 0u);
  EXPECT_THAT(plan.reasons, testing::Contains("form twin: r0 varies over b"));
  EXPECT_THROW(plan_scene({need("a", "coupled", {"r0=0.05"}, "twin"), textured}), InputError);
  textured.textured = {"fresnel"};
  EXPECT_THROW(plan_scene({textured}), InputError) << "a choice is no axis";
}

TEST(Plan, FoldedTablesInterpolateToTheSame) {
  const Model& m = find_model("coupled");
  const AlbedoTable whole = tabulate_albedo(m);
  for (const std::vector<std::string>& fixed_text :
       {std::vector<std::string>{"r0=0.137"}, {"rm=0.9,0.5,0.1"}, {"r0=0.137", "rm=0.9,0.5,0.1"}}) {
    const ParamValues all = parse_values(m.info(), {"r0=0.137", "rm=0.9,0.5,0.1"});
    ParamValues fixed;
    for (const std::string& t : fixed_text) fixed[t.substr(0, 2)] = all.at(t.substr(0, 2));
    const AlbedoTable cut = fold(whole, m, fixed);
    EXPECT_LE(cut.size(), 3 * whole.size());
    for (const AlbedoGrid& g : cut.grids)
      for (const TableAxis& a : g.axes) EXPECT_EQ(fixed.count(a.name), 0u);
    for (const double c : {0.01, 0.3, 0.77, 1.0}) {
      const Rgb<double> want = lookup(whole, m, all, c), got = lookup(cut, m, all, c);
      EXPECT_NEAR(got.r, want.r, 1e-6) << fixed_text[0];
      EXPECT_NEAR(got.g, want.g, 1e-6);
      EXPECT_NEAR(got.b, want.b, 1e-6);
    }
  }
}

TEST(Plan, AShaderOfOneDirectionHasNoLobes) {
  const Model& m = find_model("radziszewski_alda");
  const AlbedoTable table = tabulate_albedo(m);
  const Shader one = write_shader(m, RepresentationKind::Sampled, table, {}, 1),
               all = write_shader(m, RepresentationKind::Sampled, table);
  EXPECT_EQ(one.closures, 1);
  EXPECT_FALSE(one.lobes);
  EXPECT_THAT(one.source, Not(HasSubstr("Lobes")));
  EXPECT_LT(one.source.size(), all.source.size());
}

}  // namespace
}  // namespace brdfc
