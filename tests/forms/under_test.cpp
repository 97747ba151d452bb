// SPDX-License-Identifier: GPL-3.0-or-later
// The base of the form made of nodes, which is nowhere brighter than the model.
#include "model/under.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "forms/recording.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "model/choices.h"
#include "support.h"

namespace brdfc::forms {
namespace {

/// Random values over the sliders' ranges for all choices, and the ends of all ranges.
std::vector<ParamValues> cases_of(const ModelInfo& info) {
  std::vector<ParamValues> cases = measure::slider_cases(info, 40, 5);
  for (const bool sliders : {true, false})
    for (const ParamValues& values : measure::end_cases(info, sliders)) cases.push_back(values);
  return cases;
}

/// Facets with another masking, or closures of another shape: their light beyond the model's is judged as a whole.
bool exceeds_a_little(const std::string& name) {
  static const std::set<std::string> names = {"blinn",          "cook_torrance",    "disney",  "disney_diffuse",
                                              "edwards",        "glossy_reflector", "kelemen", "microfacet",
                                              "phong_material", "shaped_facets",    "ward"};
  return names.count(name) == 1;
}

TEST(Under, ExceedsTheModelByALittleOfItsLightAtMost) {
  std::vector<std::string> names = model_names();
  std::erase_if(names, [](const std::string& name) { return !exceeds_a_little(name); });
  for (const std::string& name : third_of(names)) {
    const Model* m = &find_model(name);
    measure::Random random(14);  // the same values whatever other models there are
    for (const ParamValues& values : cases_of(m->info())) {
      const measure::BoundModel bound = measure::bind_model(*m, values);
      for (const double height : {1e-4, 0.03, 0.15, 0.4, 0.65, 0.9}) {
        const Vec3<double> wo = direction(height, 2 * kPi * measure::uniform(random));
        const ClosureSum<double> base = under(*m)->bound(m->info(), values, wo);
        double all = 0, beyond = 0;
        for (int i = 0; i < 4000; ++i) {
          // Every second direction is a uniform one: samples of the model hardly meet what is beyond a narrow lobe.
          const Vec3<double> u{measure::uniform(random), measure::uniform(random), measure::uniform(random)};
          const Vec3<double> wi = i % 2 == 0 ? bound.brdf->sample(wo, u).wi : measure::uniform_direction(random);
          if (!(wi.z > 0)) continue;
          const double density = (bound.brdf->pdf(wi, wo) + kInvPi / 2) / 2;
          const Rgb<double> f = bound.brdf->eval(wi, wo) * wi.z, b = evaluate(base, wi, wo);
          all += std::max({f.r, f.g, f.b}) / density;
          beyond += std::max({b.r - f.r, b.g - f.g, b.b - f.b, 0.0}) / density;
        }
        EXPECT_LE(beyond, 2e-4 * all) << bound.label << " height " << height;
      }
    }
  }
}

TEST(Under, IsNowhereAboveTheModel) {
  for (const auto& [name, m] : models()) {
    const Under* of = under(*m);
    if (!of) continue;
    measure::Random random(11);
    for (const ParamValues& values : cases_of(m->info())) {
      const measure::BoundModel bound = measure::bind_model(*m, values);
      for (const auto& [wi, any_wo] : measure::direction_pairs(*bound.brdf, 400, random)) {
        // As forms receive views.
        const Vec3<double> wo = any_wo.z < 1e-4 ? direction(1e-4, 0.3) : any_wo;
        if (wi.z <= 0) continue;
        const ClosureSum<double> base = of->bound(m->info(), values, wo);
        const Rgb<double> f = bound.brdf->eval(wi, wo) * wi.z, b = evaluate(base, wi, wo);
        for (const Closure<double>& c : base)
          measure::require_value(c.weight, "weight of the base", bound.label, c.normal, wo);
        if (exceeds_a_little(name)) continue;
        const auto above = [](double x, double y) { return y - x * (1 + 1e-7) - 1e-12; };
        const double most = std::max({above(f.r, b.r), above(f.g, b.g), above(f.b, b.b)});
        ASSERT_LE(most, 0) << bound.label << " wi " << wi.x << ' ' << wi.y << ' ' << wi.z << " wo " << wo.x << ' '
                           << wo.y << ' ' << wo.z << " f " << f.g << " base " << b.g;
      }
    }
  }
}

struct UnderRow {
  const char* model;
  std::vector<std::string> values;
  double share;  ///< the base's minimum share of the model's light, seen at 45 degrees
};
const UnderRow kUnderRows[] = {{"ashikhmin_shirley", {"rs=0,0,0"}, 0.9},
                               {"ashikhmin_shirley", {"part=diffuse"}, 0.95},
                               {"blinn", {}, 0.7},
                               {"cook_torrance", {}, 0.55},
                               {"cook_torrance", {"m=0.1"}, 0.9},
                               {"coupled", {}, 0.94},
                               {"disney", {}, 0.68},
                               {"disney", {"metallic=1"}, 0.47},
                               {"disney", {"metallic=1", "masking=facets"}, 0.97},
                               {"disney", {"subsurface=1"}, 0.66},
                               {"disney_diffuse", {}, 0.7},
                               {"disney_diffuse", {"r=0"}, 0.58},
                               {"edwards", {}, 0.5},
                               {"edwards", {"e=1"}, 0.15},
                               {"edwards", {"e=1000"}, 0.9},
                               {"eon", {}, 0.97},
                               {"eon", {"rho=1"}, 0.999999},
                               {"glossy_reflector", {}, 0.98},
                               {"glossy_reflector", {"e=1"}, 0.4},
                               {"glossy_reflector", {"e=20", "below=lose"}, 0.94},
                               {"hapke", {}, 0.65},
                               {"hapke", {"b=0", "scattering=single"}, 0.7},
                               {"kelemen", {}, 0.75},
                               {"kelemen", {"f0=1", "rm=0"}, 0.5},
                               {"microfacet", {}, 0.999999},
                               {"microfacet", {"f0=0.04", "tint=0.5"}, 0.9},
                               {"microfacet", {"ax=0.5", "ay=0.04"}, 0.9},
                               {"microfacet", {"distribution=multiscatter_ggx", "ax=0.6", "ay=0.6"}, 0.9},
                               {"microfacet", {"distribution=beckmann", "ax=0.5", "ay=0.1"}, 0.9},
                               {"minnaert", {}, 0.82},
                               {"minnaert", {"k=0.5"}, 0.74},
                               {"minnaert", {"k=1"}, 0.999999},
                               {"minnaert", {"k=4"}, 0.86},
                               {"oren_nayar", {}, 0.75},
                               {"oren_nayar", {"form=qualitative"}, 0.9},
                               {"phong_material", {"ks=0", "kr=0"}, 0.999},
                               {"phong_material", {"ks=0"}, 0.98},
                               {"schlick", {}, 0.75},
                               {"schlick", {"rough=0.9"}, 0.7},
                               {"schlick_double", {}, 0.9},
                               {"shaped_facets", {}, 0.35},
                               {"shaped_facets", {"gamma=4"}, 0.73},
                               {"shaped_facets", {"masking=kelemen", "gamma=4"}, 0.74},
                               {"shaped_facets", {"masking=ashikhmin_premoze", "gamma=4"}, 0.65},
                               {"shaped_facets", {"masking=neumann", "gamma=4"}, 0.67},
                               {"shaped_facets", {"distribution=blinn_phong"}, 0.9},
                               {"shaped_facets", {"distribution=exponential"}, 0.56},
                               {"ward", {}, 0.8},
                               {"ward", {"normalisation=duer", "ax=0.3"}, 0.7}};

TEST(Under, CarriesWhatWasMeasured) {
  std::set<std::string> seen;
  for (const UnderRow& row : kUnderRows) {
    const Model& m = find_model(row.model);
    seen.insert(row.model);
    ASSERT_TRUE(under(m)) << row.model;
    const ParamValues values = complete(m.info(), parse_values(m.info(), row.values));
    const measure::BoundModel bound = measure::bind_model(m, values);
    const Vec3<double> wo = direction(std::sqrt(0.5), 0.4);
    const ClosureSum<double> base = under(m)->bound(m.info(), values, wo);
    measure::Random random(12);
    double of_model = 0, of_base = 0;
    for (int i = 0; i < 1 << 14; ++i) {
      const Vec3<double> wi = measure::uniform_direction(random);
      of_model += bound.brdf->eval(wi, wo).g * wi.z;
      of_base += evaluate(base, wi, wo).g;
    }
    EXPECT_GE(of_base / of_model, row.share) << bound.label;
  }
  for (const auto& [name, m] : models()) EXPECT_EQ(under(*m) != nullptr, seen.count(name) == 1) << name;
}

/// One node tree serves all choices.
TEST(Under, IsRecordedAlikeForAllChoices) {
  for (const auto& [name, m] : models()) {
    const Under* of = under(*m);
    if (!of) continue;
    std::vector<ClosureKind> kinds;
    for (const Choices& choices : choice_combinations(m->info())) {
      Recorder recorder;
      std::vector<ClosureKind> here;
      for (const Closure<Expr>& c : of->record(m->info(), with_choices(m->info(), choices), input3("wo"))) {
        EXPECT_TRUE(c.kind == ClosureKind::Diffuse || c.kind == ClosureKind::OrenNayar ||
                    c.kind == ClosureKind::DiffuseToon || has_facets(c.kind))
            << name;
        // Blender's node has no weight beside the albedo.
        std::array<double, 3> weight;
        EXPECT_TRUE(c.kind != ClosureKind::OrenNayar ||
                    (c.weight.is_constant(&weight) && weight == std::array{1.0, 1.0, 1.0}))
            << name;
        EXPECT_FALSE(c.turned) << name;
        EXPECT_TRUE(c.stretched == Tangent::View ||
                    (c.tangent.x.is_literal(1) && c.tangent.y.is_literal(0) && c.tangent.z.is_literal(0)))
            << name;
        here.push_back(c.kind);
      }
      if (kinds.empty()) kinds = here;
      EXPECT_EQ(here, kinds) << name;
    }
    EXPECT_FALSE(kinds.empty()) << name;
  }
}

/// Of microfacets, Blender's Metallic node has what Cycles' masking and a white tint make of them.
TEST(Under, IsAllOfTheModelWhereItSaysSo) {
  struct Row {
    std::vector<std::string> values;
    bool is_whole;
  };
  const std::vector<Row> rows{
      {{}, true},
      {{"f0=0.04", "ax=0.01", "ay=0.01"}, true},
      {{"f0=1,0.2,0", "ax=0.5", "ay=0.05"}, true},
      {{"f0=0", "ax=0.1", "ay=1"}, true},
      {{"distribution=beckmann", "f0=0.9,0.6,0.3", "ax=1e-4", "ay=1e-4"}, true},
      {{"distribution=beckmann", "ax=0.3", "ay=0.8"}, true},
      {{"tint=1,1,0.999"}, false},
      {{"ax=0.5", "ay=0.0499"}, false},
      {{"distribution=multiscatter_ggx"}, true},
      {{"distribution=multiscatter_ggx", "f0=0.04", "again=0.05", "ax=1", "ay=1"}, true},
      {{"distribution=multiscatter_ggx", "ax=0.9", "ay=0.9"}, false},
      {{"distribution=multiscatter_ggx", "again=0.5,0.4,0.4"}, true},
      {{"distribution=multiscatter_ggx", "f0=1,0.8,0.3", "again=1,0.75,0.3"}, true},
      {{"distribution=multiscatter_ggx", "f0=1,0.8,0.3", "again=0.9,0.6,0.1", "ax=1", "ay=1"}, true},
      {{"distribution=multiscatter_ggx", "f0=0.8,0,0", "again=0.7,0.03,0.03"}, true},
      {{"distribution=multiscatter_ggx", "f0=0.1,0.8,0.3", "again=1,0,0"}, false},
      {{"masking=smith_separable"}, false},
      {{"distribution=beckmann", "masking=v_cavity"}, false}};
  const Model& m = find_model("microfacet");
  measure::Random random(15);
  for (const Row& row : rows) {
    const ParamValues values = complete(m.info(), parse_values(m.info(), row.values));
    const measure::BoundModel bound = measure::bind_model(m, values);
    EXPECT_EQ(under(m)->bound_whole(m.info(), values), row.is_whole ? 1 : 0) << bound.label;
    if (!row.is_whole) continue;
    // Of Beckmann's Lambda Cycles has what is beyond a = 1.6013, and the model what is beyond 1.6, as 0.
    const bool is_beckmann = std::get<std::string>(values.at("distribution")) == "beckmann";
    const double within = is_beckmann ? 1e-4 : 1e-7;
    for (int i = 0; i < 2000; ++i) {
      const Vec3<double> wo = measure::uniform_direction(random);
      const Sample<double> s =
          bound.brdf->sample(wo, {measure::uniform(random), measure::uniform(random), measure::uniform(random)});
      const Vec3<double> wi = i % 2 == 0 || !(s.pdf > 0) ? measure::uniform_direction(random) : s.wi;
      const Rgb<double> f = bound.brdf->eval(wi, wo) * wi.z,
                        b = evaluate(under(m)->bound(m.info(), values, wo), wi, wo);
      for (const auto& [x, y] : {std::pair(f.r, b.r), {f.g, b.g}, {f.b, b.b}})
        EXPECT_NEAR(x, y, within * std::max(std::abs(x), 1e-3)) << bound.label;
    }
  }
  for (const auto& [name, other] : models()) EXPECT_EQ(has_whole(*other), name == "microfacet") << name;
}

}  // namespace
}  // namespace brdfc::forms
