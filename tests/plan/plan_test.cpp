// SPDX-License-Identifier: GPL-3.0-or-later
// A pack cut to a scene contains what its materials need, and computes the same.
#include "plan/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "forms/aimed.h"
#include "forms/form.h"
#include "measure/fold.h"
#include "measure/stored_albedo.h"

namespace brdfc::plan {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

MaterialNeed need(const std::string& id, const std::string& model, const std::vector<std::string>& values,
                  const std::string& representation = "auto") {
  const Model& m = find_model(model);
  return {id, &m, parse_values(m.info(), values), {}, representation};
}

Costs costs(const std::string& rows) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "brdfc-plan-costs.csv";
  std::ofstream(file) << "model,form,cost\n" << rows;
  return Costs(file);
}

std::string why(const PlannedModel& plan, const forms::Form* form) {
  for (const FormChoice& c : plan.choices)
    if (c.form == form) return c.why;
  return "not considered";
}

TEST(Plan, EverythingIsEveryModelInEveryForm) {
  const auto plan = plan_models({});
  EXPECT_EQ(plan.size(), models().size());
  for (const PlannedModel& p : plan) {
    EXPECT_EQ(p.forms, forms::forms_of(*p.model));
    EXPECT_TRUE(p.fixed.empty() && p.reasons.empty());
  }
  EXPECT_THROW(plan_models({"nonesuch"}), InputError);
}

TEST(Plan, SaysWhatLampsWithoutASizeMakeOfAForm) {
  Budget budget;
  const std::vector<MaterialNeed> open = {need("a", "phong", {"e=20"})}, drawn = {need("a", "phong", {}, "sampled")},
                                  exact = {need("a", "lambert", {})};
  EXPECT_EQ(why(plan_scene(open, budget)[0], forms::form("aimed")), "a: the form is left open");
  budget.sizeless = {"lights[1]", "lights[4]"};
  EXPECT_EQ(why(plan_scene(open, budget)[0], forms::form("aimed")),
            "a: the form is left open; lights[1], lights[4] without a size shines as on Blender's own nodes");
  budget.lamps = 12;
  EXPECT_THAT(
      why(plan_scene(open, budget)[0], forms::form("aimed")),
      HasSubstr("shines as on Blender's own nodes while among the 8 of up to 12 lamps that are aimed at, else as "
                "rare bright dots"));
  budget.lamps = 0;
  EXPECT_THAT(why(plan_scene(open, budget)[0], forms::form("aimed")), HasSubstr("shines as rare bright dots"));
  EXPECT_THAT(why(plan_scene(drawn, budget)[0], forms::form("sampled")),
              HasSubstr("lights[1], lights[4] without a size shines as rare bright dots"));
  const PlannedModel matte = plan_scene(exact, budget)[0];
  for (const FormChoice& c : matte.choices) EXPECT_THAT(c.why, Not(HasSubstr("without a size")));
}

TEST(Plan, HasASlotForEveryLampAndNoMore) {
  const std::vector<MaterialNeed> needs = {need("a", "phong", {"e=20"})};
  const auto reasons = [&](std::optional<int> lamps) {
    Budget budget;
    budget.lamps = lamps;
    const PlannedModel plan = plan_scene(needs, budget)[0];
    EXPECT_EQ(plan.max_lamps, std::min(lamps.value_or(forms::kMaxLamps), forms::kMaxLamps));
    return plan.reasons;
  };
  EXPECT_THAT(reasons(0), testing::Contains("slots for lamps: the scene has none"));
  EXPECT_THAT(reasons(3), testing::Contains("slots for more than 3 lamps: the scene has no more"));
  for (const std::optional<int> all : {std::optional<int>(), std::optional<int>(8), std::optional<int>(20)})
    EXPECT_THAT(reasons(all), Not(testing::Contains(HasSubstr("slots for lamps"))));

  const Model& m = find_model("phong");
  const measure::AlbedoTable table = measure::albedo_table_of(m);
  const auto shader = [&](int lamps) { return forms::form("aimed")->write(m, table, {{}, {}, lamps}); };
  for (const char* part : {"Lamp", "lamp_", "lobe_weight", "covered"})
    EXPECT_THAT(shader(0).source, Not(HasSubstr(part))) << "nothing is left of what lamps take";
  const int without = 5 * slots(ClosureKind::GlossyToon) + slots(ClosureKind::PhongRamp);
  EXPECT_EQ(shader(0).slots, without);
  EXPECT_THAT(shader(3).source, HasSubstr("LampShape3"));
  EXPECT_THAT(shader(3).source, Not(HasSubstr("LampShape4")));
  EXPECT_EQ(shader(3).slots, without + 3 * slots(ClosureKind::PhongRamp));
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
  EXPECT_THAT(plan[0].forms, ElementsAre(forms::form("exact")));
  EXPECT_EQ(plan[1].fixed.count("rho"), 1u);

  const auto two = plan_scene({need("a", "lambert", {"rho=1"}), need("b", "lambert", {"rho=0.5"}, "sampled")});
  EXPECT_TRUE(two[0].fixed.empty()) << "two values";
  EXPECT_THAT(two[0].forms, ElementsAre(forms::form("exact"), forms::form("sampled")));
}

TEST(Plan, NamesTheMaterialWhoseFormDoesNotExist) {
  try {
    plan_scene({need("shiny", "radziszewski_alda", {}, "exact")});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("material shiny"));
  }
}

TEST(Plan, NodesComeBesideFormsThatAreLeftOpen) {
  const forms::Form *const nodes = forms::form("nodes"), *const aimed = forms::form("aimed");
  Budget budget;
  budget.nodes = true;
  const auto forms = [&](const std::vector<MaterialNeed>& needs) { return plan_scene(needs, budget)[0].forms; };
  EXPECT_THAT(forms({need("a", "phong", {"e=20"})}), ElementsAre(aimed, nodes));
  EXPECT_THAT(forms({need("a", "phong", {"e=20"}, "aimed")}), ElementsAre(aimed)) << "asked for by name";
  EXPECT_THAT(forms({need("a", "ward", {"normalisation=duer"})}), ElementsAre(aimed, nodes)) << "any choice";
  const MaterialNeed without = need("a", "ashikhmin_shirley", {"diffuse=tabulated"});
  EXPECT_THAT(forms({without}), ElementsAre(aimed)) << "a choice that nodes lack";
  EXPECT_THAT(forms({without, need("b", "ashikhmin_shirley", {})}), ElementsAre(aimed, nodes));
  EXPECT_THAT(plan_scene({need("a", "phong", {"e=20"})})[0].forms, ElementsAre(aimed)) << "not unasked";
}

TEST(Plan, FitsWhereTheErrorIsAllowed) {
  const auto forms = [](const std::vector<MaterialNeed>& needs, double error) {
    return plan_scene(needs, {error, false})[0].forms;
  };
  const auto fitted = ElementsAre(forms::form("fitted")), sampled = ElementsAre(forms::form("sampled")),
             aimed = ElementsAre(forms::form("aimed"));
  EXPECT_THAT(forms({need("a", "phong", {"e=20"})}, 0.03), fitted);
  EXPECT_THAT(forms({need("a", "phong", {"e=20"})}, 0.001), aimed);
  EXPECT_THAT(plan_scene({need("a", "phong", {"e=20"})})[0].forms, aimed) << "not unasked";
  EXPECT_THAT(plan_scene({need("a", "phong", {"e=20"}, "fitted")})[0].forms, fitted);
  EXPECT_THAT(forms({need("a", "coupled", {})}, 0.5), ElementsAre(forms::form("exact")));

  const std::vector<MaterialNeed> two = {need("a", "lafortune", {"cz=0.5", "e=20"}),
                                         need("b", "lafortune", {"cz=0.6", "e=30"})};
  EXPECT_THAT(forms(two, 0.5), aimed);
  EXPECT_EQ(why(plan_scene(two, {0.5, false})[0], forms::form("fitted")),
            "a and b have other values of cz; a and b have other values of e");
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
              ElementsAre(forms::form("sampled"), forms::form("fitted")));
  auto textured = need("c", "phong", {"e=20", "ks=0.1"});
  textured.textured.insert("ks");
  const auto plan = plan_scene({need("a", "phong", {"e=20"}), textured}, {0.03, false, true});
  EXPECT_THAT(plan[0].forms, ElementsAre(forms::form("fitted"), forms::form("twin"))) << "ks multiplies f";
  EXPECT_EQ(plan[0].fixed.count("ks"), 0u);
}

/// A single number that varies becomes the axis of the tables of fits and twins.
TEST(Plan, FitsAlongANumber) {
  auto textured = need("b", "oren_nayar", {"sigma=0.1"}, "fitted");
  textured.textured.insert("sigma");
  const std::vector<MaterialNeed> needs = {need("a", "oren_nayar", {"sigma=0.05"}, "fitted"), textured};
  const PlannedModel plan = plan_scene(needs, {{}, false, true})[0];
  EXPECT_THAT(plan.forms, ElementsAre(forms::form("fitted"), forms::form("twin")));
  EXPECT_EQ(plan.fixed.count("sigma"), 0u);
  textured.textured = {"form"};
  EXPECT_THROW(plan_scene({textured}), InputError) << "a choice is no axis";
  textured.representation = "auto";
  EXPECT_EQ(why(plan_scene({textured}, {{}, false, true})[0], forms::form("twin")), "form varies over b");
}

/// In addition to a number, parameters in which f is a polynomial may vary, in fits and twins.
TEST(Plan, FitsWhatThereAreTermsBy) {
  auto textured = need("b", "cook_torrance", {"m=0.4"});
  textured.textured.insert("f0");
  const std::vector<MaterialNeed> needs = {need("a", "cook_torrance", {"f0=0.04", "m=0.2"}), textured};
  const PlannedModel plan = plan_scene(needs, {0.2, false, true})[0];
  EXPECT_THAT(plan.forms, ElementsAre(forms::form("fitted"), forms::form("twin")));
  EXPECT_TRUE(plan.fixed.empty());
  EXPECT_THAT(plan_scene(needs, {0.02, false})[0].forms, ElementsAre(forms::form("aimed")));

  // The weights of its terms may vary, as they add up; its exponents are two numbers.
  const auto phong = [](const char* id, const char* value) { return need(id, "phong_material", {value}, "fitted"); };
  EXPECT_THAT(plan_scene({phong("a", "kd=0.1"), phong("b", "kd=0.3")})[0].forms, ElementsAre(forms::form("fitted")));
  EXPECT_THROW(plan_scene({phong("a", "es=10"), phong("b", "e=20")}), InputError);
  EXPECT_THROW(plan_scene({need("a", "phong_material", {"es=10"}, "twin"), phong("b", "e=20")}), InputError);
}

const forms::Form *const kExact = forms::form("exact"), *const kAimed = forms::form("aimed"),
                         *const kSampled = forms::form("sampled"), *const kFitted = forms::form("fitted");

TEST(Plan, KeepsATimeWithTheLeastErrorThatIsAllowed) {
  const std::vector<MaterialNeed> phong = {need("a", "phong", {"e=20"})}, coupled = {need("a", "coupled", {})};
  Budget budget;
  budget.costs = costs(
      "phong,aimed,1.1\nphong,sampled,1.1\nphong,fitted,0.9\ncoupled,exact,1.2\ncoupled,aimed,1.3\ncoupled,sampled,1."
      "3\n"
      "coupled,fitted,0.8\nphong,twin,0.1\n");
  const auto plan = [&](const std::vector<MaterialNeed>& needs, double time, std::optional<double> error = {}) {
    budget.time = time;
    budget.error = error;
    return plan_scene(needs, budget)[0];
  };
  EXPECT_THAT(plan(phong, 1.15).forms, ElementsAre(kAimed)) << "noise falls with time, what a fit is off by does not";
  EXPECT_EQ(why(plan(phong, 1.15), kFitted), "aimed comes first");
  EXPECT_THAT(plan(phong, 1.1).forms, ElementsAre(kAimed));
  EXPECT_THAT(plan(phong, 1).forms, ElementsAre(kFitted));
  EXPECT_EQ(why(plan(phong, 1), kAimed), "costs 1.1x, and 1x is allowed");
  EXPECT_EQ(why(plan(phong, 1), forms::form("twin")), "only where it is asked for");
  EXPECT_THAT(plan(coupled, 1.25).forms, ElementsAre(kExact));
  EXPECT_THAT(plan(coupled, 1.1).forms, ElementsAre(kFitted));

  // Both limits apply together.
  EXPECT_THAT(plan(phong, 1.15, 0.03).forms, ElementsAre(kFitted));
  EXPECT_THAT(plan(phong, 1, 0.03).forms, ElementsAre(kFitted));
  EXPECT_THAT(plan(phong, 1.15, 0.001).forms, ElementsAre(kAimed));
  EXPECT_THAT(plan(phong, 1, 0.001).forms, ElementsAre(kAimed));
  EXPECT_THAT(why(plan(phong, 1, 0.001), kAimed), HasSubstr("no form is known to keep 1x, this is the cheapest"));
  EXPECT_THAT(why(plan(phong, 1, 0.001), kFitted), HasSubstr("0.001 is allowed"));

  EXPECT_THAT(plan(phong, 0.5).forms, ElementsAre(kFitted));
  EXPECT_EQ(why(plan(phong, 0.5), kFitted), "a: no form is known to keep 0.5x, this is the cheapest");
  EXPECT_THAT(plan({need("a", "phong", {"e=20"}, "sampled")}, 0.5).forms, ElementsAre(kSampled)) << "asked for";
  const PlannedModel both = plan({need("a", "phong", {"e=20"}), need("b", "phong", {"e=20"}, "sampled")}, 1);
  EXPECT_THAT(both.forms, ElementsAre(kFitted, kSampled)) << "the first is what a form left open becomes in Blender";

  budget.costs = costs("coupled,exact,1.3\ncoupled,aimed,1\ncoupled,sampled,1\ncoupled,fitted,1.2\n");
  EXPECT_THAT(plan(coupled, 1.1, 0.1).forms, ElementsAre(kAimed));
  EXPECT_EQ(why(plan(coupled, 1.1, 0.1), kExact), "costs 1.3x, and 1.1x is allowed");
  EXPECT_EQ(why(plan(coupled, 1.1, 0.1), kFitted), "costs 1.2x, and 1.1x is allowed");
  EXPECT_EQ(why(plan(coupled, 1.1), kFitted), "aimed comes first");
  EXPECT_THAT(plan(coupled, 1.25, 0.1).forms, ElementsAre(kFitted));
  EXPECT_EQ(why(plan(coupled, 1.25, 0.1), kAimed), "fitted comes first");
  EXPECT_EQ(why(plan(coupled, 1.25, 0.001), kFitted), "off by 0.0043 of the light, and 0.001 is allowed");

  budget.costs = costs("phong,aimed,1.1\nphong,sampled,1.1\nphong,fitted,0.9\n");
  budget.offer = true;
  EXPECT_THAT(plan({need("a", "phong", {"e=20"}, "sampled")}, 1).forms, ElementsAre(kSampled, kFitted));
  EXPECT_THAT(plan({need("a", "phong", {"e=20"}, "sampled")}, 1.15).forms, ElementsAre(kSampled));
  EXPECT_EQ(why(plan({need("a", "phong", {"e=20"}, "sampled")}, 1.15), kFitted), "the materials ask for another");
  EXPECT_THAT(why(plan({need("a", "phong", {"e=20"}, "sampled")}, 1.15, 0.001), kFitted), HasSubstr("off by"));
  budget.costs = costs("phong,aimed,1.1\nphong,sampled,1.1\nphong,fitted,1.3\n");
  EXPECT_EQ(why(plan({need("a", "phong", {"e=20"}, "sampled")}, 1.2, 0.1), kFitted), "costs 1.3x, and 1.2x is allowed");
}

TEST(Plan, SaysThatAFitOfAnotherChoiceIsTooFarOff) {
  Budget budget;
  budget.error = 0.001;
  const std::vector<MaterialNeed> back = {need("a", "radziszewski_alda", {"around=retro", "n=20"})};
  EXPECT_THAT(why(plan_scene(back, budget)[0], kFitted), HasSubstr("0.001 is allowed"));
}

TEST(Plan, SaysWhatAModelLacksBeforeWhatItsMaterialsDifferIn) {
  const std::vector<MaterialNeed> two = {need("a", "fresnel_conductor", {"n_r=0.3"}),
                                         need("b", "fresnel_conductor", {"n_r=0.5"})};
  for (const forms::Form* kind : {kFitted, forms::form("twin")})
    EXPECT_EQ(why(plan_scene(two, {})[0], kind), "it only reflects and refracts ideally");
}

TEST(Plan, SaysWhichCostIsNotKnown) {
  std::vector<MaterialNeed> needs = {need("a", "phong", {"e=20"})};
  Budget budget;
  budget.time = 1;
  PlannedModel plan = plan_scene(needs, budget)[0];
  EXPECT_THAT(plan.forms, ElementsAre(kAimed));
  EXPECT_THAT(why(plan, kAimed), HasSubstr("no cost is known"));
  EXPECT_EQ(why(plan, kFitted), "its cost was not measured");

  budget.costs = costs("phong,fitted,3\n");
  plan = plan_scene(needs, budget)[0];
  EXPECT_THAT(plan.forms, ElementsAre(kFitted)) << "the cheapest that is known";
  EXPECT_EQ(why(plan, kAimed), "its cost was not measured");

  budget.costs = costs("phong,aimed,0.9\n");
  EXPECT_THAT(plan_scene(needs, budget)[0].forms, ElementsAre(kAimed));
}

TEST(Plan, SaysWhatABudgetChangesForEachMaterial) {
  const std::vector<MaterialNeed> needs = {need("open", "phong", {"e=20"}),
                                           need("asked", "phong", {"e=20"}, "sampled")};
  Budget budget;
  budget.costs = costs("phong,aimed,0.9\nphong,fitted,1.5\n");
  budget.error = 1;
  const PlannedModel plan = plan_scene(needs, budget)[0];
  ASSERT_EQ(plan.material_forms.size(), 2u);
  const FormChange &open = plan.material_forms[0], &asked = plan.material_forms[1];
  EXPECT_EQ(open.id, "open");
  EXPECT_EQ(open.before, kAimed);
  EXPECT_EQ(open.cost_before, 0.9);
  EXPECT_EQ(open.after, kFitted);
  EXPECT_EQ(open.cost_after, 1.5);
  EXPECT_EQ(asked.id, "asked");
  EXPECT_EQ(asked.before, kSampled);
  EXPECT_EQ(asked.after, kSampled);
  EXPECT_FALSE(asked.cost_before || asked.cost_after) << "not measured";
}

TEST(Plan, FitsBasesWhereAskedToAndWhereFitsAreMadeAnyway) {
  Budget asked, error, both;
  asked.fit_bases = true;
  error.error = 0.001;
  both = error;
  both.time = 3;
  both.costs = asked.costs = costs("phong,aimed,1.1\n");
  const auto base = [](const std::vector<MaterialNeed>& needs, const Budget& budget) {
    return plan_scene(needs, budget)[0].base;
  };
  const std::vector<MaterialNeed> phong = {need("a", "phong", {"e=20"})};
  EXPECT_EQ(base(phong, {}), forms::AimedBase::Declared) << "nothing is fitted unasked";
  EXPECT_EQ(base(phong, asked), forms::AimedBase::Fitted);
  EXPECT_EQ(base(phong, error), forms::AimedBase::Fitted);
  EXPECT_EQ(base(phong, both), forms::AimedBase::Declared) << "its cost is not known";
  EXPECT_EQ(base({need("a", "ward", {"ax=0.5"})}, asked), forms::AimedBase::Declared) << "it is anisotropic";
  EXPECT_EQ(base({need("a", "phong", {"e=20"}, "sampled")}, asked), forms::AimedBase::Declared) << "nothing is aimed";
  EXPECT_EQ(why(plan_scene(phong, asked)[0], kAimed), "a: the form is left open; closures fitted to it are its base");
  const PlannedModel planned = plan_scene(phong, asked)[0];
  for (const FormChoice& c : planned.choices)
    if (c.form == kAimed) {
      EXPECT_FALSE(c.cost);
    }
}

TEST(Plan, FoldedTablesInterpolateToTheSame) {
  const Model& m = find_model("coupled");
  const measure::AlbedoTable whole = measure::albedo_table_of(m);
  for (const std::vector<std::string>& fixed_text :
       {std::vector<std::string>{"r0=0.137"}, {"rm=0.9,0.5,0.1"}, {"r0=0.137", "rm=0.9,0.5,0.1"}}) {
    const ParamValues all = parse_values(m.info(), {"r0=0.137", "rm=0.9,0.5,0.1"});
    ParamValues fixed;
    for (const std::string& t : fixed_text) fixed[t.substr(0, 2)] = all.at(t.substr(0, 2));
    const measure::AlbedoTable cut = measure::fold(whole, m, fixed);
    EXPECT_LE(cut.size(), 3 * whole.size());
    for (const Table& g : cut.grids)
      for (const TableAxis& a : g.axes) EXPECT_EQ(fixed.count(a.name), 0u);
    for (const double c : {0.01, 0.3, 0.77, 1.0}) {
      const Rgb<double> want = lookup(whole, m, all, c), got = lookup(cut, m, all, c);
      EXPECT_NEAR(got.r, want.r, 1e-6) << fixed_text[0];
      EXPECT_NEAR(got.g, want.g, 1e-6);
      EXPECT_NEAR(got.b, want.b, 1e-6);
    }
  }
}

}  // namespace
}  // namespace brdfc::plan
