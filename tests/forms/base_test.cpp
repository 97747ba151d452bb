// SPDX-License-Identifier: GPL-3.0-or-later
// The closures that a model declares as its base.
#include "forms/base.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "closures/lobe.h"
#include "forms/recording.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "model/choices.h"
#include "support.h"
#include "trace/program.h"

namespace brdfc::forms {
namespace {

Vec3<Expr> recorded(const char* name) {
  const std::string n = name;
  return {Expr::input(n + "_x"), Expr::input(n + "_y"), Expr::input(n + "_z")};
}

using InputValues = std::map<std::string, std::array<double, 3>>;
void give(InputValues& inputs, const std::string& name, const Vec3<double>& v) {
  inputs[name + "_x"] = {v.x, v.x, v.x};
  inputs[name + "_y"] = {v.y, v.y, v.y};
  inputs[name + "_z"] = {v.z, v.z, v.z};
}

/// The conformance tests compare Lobe, with any tangent, with Cycles.
TEST(Closure, StretchesFacetsAlongATangentOfTheSurface) {
  measure::Random random(4);
  for (const auto& [kind, lobe_kind] :
       {std::pair{ClosureKind::Ggx, LobeKind::Ggx}, {ClosureKind::Beckmann, LobeKind::Beckmann}}) {
    Recorder recorder;
    Closure<Expr> recorded_closure(kind, Rgb<Expr>::input("weight"));
    recorded_closure.alpha = Expr::input("alpha");
    recorded_closure.alpha_across = Expr::input("across");
    recorded_closure.tangent = {cos(Expr::input("angle")), sin(Expr::input("angle")), Expr(0)};
    recorded_closure.stretched = Tangent::Surface;
    Program program;
    program.output("f_cos", evaluate(recorded_closure, recorded("wi"), recorded("wo")));
    EXPECT_LE(program.operations(), 100) << "a base is evaluated for every lamp";

    for (int i = 0; i < 200; ++i) {
      const Vec3<double> wi = measure::uniform_direction(random), wo = measure::uniform_direction(random);
      const double angle = 6 * measure::uniform(random), alpha = 0.05 + 0.9 * measure::uniform(random),
                   across = 0.05 + 0.9 * measure::uniform(random);
      Closure<double> c(kind, Rgb<double>(0.2, 0.5, 1));
      c.alpha = alpha, c.alpha_across = across;
      c.tangent = {std::cos(angle), std::sin(angle), 0};
      c.stretched = Tangent::Surface;
      Lobe lobe;
      lobe.kind = lobe_kind;
      lobe.weight = c.weight;
      lobe.tangent = c.tangent;
      lobe.alpha_x = alpha, lobe.alpha_y = across;
      const Rgb<double> expected = evaluate(lobe, wi, wo), found = evaluate(c, wi, wo);
      EXPECT_NEAR(found.g, expected.g, 1e-12 * (1 + expected.g));
      EXPECT_NEAR(found.r, expected.r, 1e-12 * (1 + expected.r));

      InputValues inputs = {{"weight", {0.2, 0.5, 1}},
                            {"alpha", {alpha, alpha, alpha}},
                            {"across", {across, across, across}},
                            {"angle", {angle, angle, angle}}};
      give(inputs, "wi", wi);
      give(inputs, "wo", wo);
      EXPECT_NEAR(program.run<double>(inputs).at("f_cos")[1], expected.g, 1e-12 * (1 + expected.g));
    }
  }
}

TEST(Closure, IsLevelWithinAConeAndFallsBesideIt) {
  Closure<double> c(ClosureKind::GlossyToon, Rgb<double>(0.5));
  c.size = 0.2, c.smooth = 0.3;
  const Vec3<double> wo = direction(std::cos(0.4), 2), mirror{-wo.x, -wo.y, wo.z};
  const auto at = [&](double angle) {
    return evaluate(c, normalize(about_axis(mirror, {0, std::sin(angle), std::cos(angle)})), wo).g;
  };
  // Relative to the solid angle of the whole cone.
  const double height = 0.5 / (2 * kPi * (1 - std::cos(0.25 * kPi)));
  EXPECT_NEAR(at(0), height, 1e-12);
  EXPECT_NEAR(at(0.09 * kPi), height, 1e-12);
  EXPECT_NEAR(at(0.175 * kPi), height / 2, 1e-12);
  EXPECT_EQ(at(0.26 * kPi), 0);
  EXPECT_EQ(evaluate(c, {0, 0.8, -0.6}, wo).g, 0) << "below the surface";
  c.smooth = 0;
  EXPECT_NEAR(at(0.09 * kPi), 0.5 / (2 * kPi * (1 - std::cos(0.1 * kPi))), 1e-12);
  EXPECT_EQ(at(0.11 * kPi), 0);
}

TEST(Closure, LooksARampUpWithoutAnIndex) {
  Closure<double> c(ClosureKind::DiffuseRamp, Rgb<double>(0.5));
  Recorder recorder;
  Closure<Expr> constant(ClosureKind::DiffuseRamp, Rgb<Expr>(Expr(0.5))), varied = constant;
  for (std::size_t i = 0; i < kRampSize; ++i) {
    c.ramp[i] = {double(i * i), -double(i), 1};
    varied.ramp[i] = {Expr(c.ramp[i].r), Expr(c.ramp[i].g), Expr(c.ramp[i].b)};
    constant.ramp[i] = Rgb<Expr>(Expr(1));
  }
  Program of_varied, of_constant;
  of_varied.output("f_cos", evaluate(varied, recorded("wi"), recorded("wo")));
  of_constant.output("f_cos", evaluate(constant, recorded("wi"), recorded("wo")));
  EXPECT_LE(of_constant.operations(), 4) << "a constant ramp is no look-up";
  const Vec3<double> wo{0, 0, 1};
  for (int i = 0; i <= 100; ++i) {
    const double z = i / 100.;
    const Vec3<double> wi{std::sqrt(1 - z * z), 0, z};
    InputValues inputs;
    give(inputs, "wi", wi);
    const std::array<double, 3> found = of_varied.run<double>(inputs).at("f_cos");
    const Rgb<double> expected = evaluate(c, wi, wo);
    EXPECT_NEAR(found[0], expected.r, 1e-12);
    EXPECT_NEAR(found[1], expected.g, 1e-12);
    EXPECT_NEAR(found[2], expected.b, 1e-12);
  }
  for (const double outside : {-0.5, 0., 1., 2.}) EXPECT_EQ(ramp8(c.ramp, outside).r, outside > 0.5 ? 49 : 0);
}

struct BaseRow {
  const char* model;
  std::vector<std::string> values;
  double above, low;  ///< relative L1 error seen at 10 and 75 degrees
};
/// Bounds are 25 % above the measured errors.
const BaseRow kBaseRows[] = {{"ashikhmin_shirley", {}, 0.008, 0.18},
                             {"ashikhmin_shirley", {"part=specular", "rs=0.9", "nu=100", "nv=1000"}, 0.03, 0.2},
                             {"ashikhmin_shirley", {"diffuse=tabulated"}, 0.035, 0.15},
                             {"blinn", {}, 0.03, 0.04},
                             {"cook_torrance", {}, 0.007, 0.16},
                             {"coupled", {}, 0.006, 0.006},
                             {"coupled", {"fresnel=dielectric"}, 0.006, 0.006},
                             {"disney", {}, 0.0023, 0.043},
                             {"disney", {"masking=facets", "roughness=0.3"}, 2e-5, 0.092},
                             {"disney", {"metallic=1", "anisotropic=0.8"}, 0.028, 0.19},
                             {"disney", {"subsurface=1"}, 0.0035, 0.052},
                             {"disney", {"sheen=1", "clearcoat=1"}, 0.0135, 0.106},
                             {"edwards", {}, 0.081, 0.384},
                             {"edwards", {"e=1"}, 0.383, 0.847},
                             {"edwards", {"e=1000"}, 0.011, 0.061},
                             {"factors", {}, 0.048, 0.48},
                             {"factors", {"ax=0.05", "ay=0.4"}, 0.061, 0.35},
                             {"glossy_reflector", {}, 0.023, 0.026},
                             {"glossy_reflector", {"below=lose", "e=10"}, 0.023, 0.023},
                             {"hapke", {}, 0.085, 0.2},
                             {"hapke", {"b=0", "b0=0"}, 0.003, 0.009},
                             {"kelemen", {}, 0.05, 0.17},
                             {"kelemen", {"f0=1", "rm=0", "m=0.1"}, 0.013, 0.079},
                             {"lafortune", {}, 0.007, 0.05},
                             {"lossless", {}, 0.1, 0.034},
                             {"lossless", {"n=1"}, 0.006, 0.004},
                             {"max_phong", {}, 0.01, 0.23},
                             {"max_phong", {"e=100"}, 0.01, 0.14},
                             {"microfacet", {}, 6e-5, 0.068},
                             {"microfacet", {"masking=v_cavity"}, 0.047, 0.45},
                             {"microfacet", {"masking=smith_separable"}, 6e-5, 0.061},
                             {"microfacet", {"distribution=beckmann"}, 2e-5, 0.062},
                             {"microfacet", {"distribution=multiscatter_ggx"}, 6e-5, 0.068},
                             {"minnaert", {}, 0.0136, 0.0136},
                             {"minnaert", {"k=0.5"}, 0.0135, 0.0135},
                             {"minnaert", {"k=1"}, 1e-9, 1e-9},
                             {"minnaert", {"k=4"}, 0.054, 0.054},
                             {"minnaert", {"k=10"}, 0.16, 0.16},
                             {"oren_nayar", {}, 0.0005, 0.021},
                             {"oren_nayar", {"form=qualitative"}, 0.012, 0.059},
                             {"phong", {}, 0.021, 0.021},
                             {"phong", {"e=3"}, 0.022, 0.02},
                             {"phong", {"e=1"}, 0.044, 0.041},
                             {"phong_material", {}, 0.01, 0.18},
                             {"schlick", {}, 0.035, 0.08},
                             {"schlick", {"p=0.3"}, 0.24, 0.2},
                             {"schlick_double", {}, 0.001, 0.017},
                             {"shaped_facets", {}, 0.283, 0.339},
                             {"shaped_facets", {"gamma=3"}, 0.052, 0.096},
                             {"shaped_facets", {"masking=kelemen"}, 0.227, 0.228},
                             {"shaped_facets", {"masking=neumann"}, 0.185, 0.39},
                             {"shaped_facets", {"distribution=blinn_phong", "alpha=0.3"}, 0.051, 0.15},
                             {"shaped_facets", {"distribution=exponential"}, 0.041, 0.206},
                             {"thin_film", {}, 0.018, 0.095},
                             {"thin_film", {"thickness=800"}, 0.03, 0.095},
                             {"ward", {}, 0.002, 0.085},
                             {"ward", {"ax=0.5", "ay=0.05"}, 0.02, 0.2},
                             {"ward", {"normalisation=duer"}, 0.013, 0.045},
                             {"ward", {"normalisation=ward"}, 0.03, 0.24}};

TEST(Base, CarriesWhatWasMeasured) {
  std::set<std::string> seen;
  for (const BaseRow& row : kBaseRows) {
    const Model& m = find_model(row.model);
    ASSERT_TRUE(m.has_base()) << row.model;
    seen.insert(row.model);
    const measure::BoundModel bound = measure::bind_model(m, values_of(m, row.values));
    for (const auto& [angle, most] : {std::pair{10., row.above}, {75., row.low}}) {
      const BaseWorth w = base_worth(bound, direction(std::cos(angle * kPi / 180), 0.4), 1 << 14);
      EXPECT_LE(w.relative_l1, most) << bound.label << " at " << angle;
      EXPECT_LE(w.share, 1.3) << bound.label << " at " << angle;
      EXPECT_LE(w.white_rest, 1) << bound.label << " at " << angle;
    }
  }
  for (const auto& [name, m] : models()) EXPECT_EQ(m->has_base(), seen.count(name) == 1) << name;
}

/// In double and float, for all parameters and views; within the sliders' ranges the base never exceeds the model by
/// much.
TEST(Base, HasWeightsThatClosuresMayHave) {
  for (const auto& [name, m] : models()) {
    if (!m->has_base()) continue;
    measure::Random random(8);  // the same values whatever other models there are
    std::vector<ParamValues> cases = measure::slider_cases(m->info(), 20, 3);
    const std::size_t random_ones = cases.size();
    for (const bool sliders : {true, false})
      for (const ParamValues& values : measure::end_cases(m->info(), sliders)) cases.push_back(values);
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const measure::BoundModel bound = measure::bind_model(*m, cases[i]);
      const auto in_float = m->make_float(cases[i]);
      for (int view = 0; view < 12; ++view) {
        const double height = view < 8 ? measure::uniform(random) : std::pow(10, -view / 2.);
        const Vec3<double> wo = direction(view == 0 ? 1 : std::max(height, 1e-6), 6 * measure::uniform(random));
        for (const Closure<double>& c : bound.brdf->base(wo))
          measure::require_value(c.weight, "weight of the base", bound.label, c.normal, wo);
        for (const Closure<float>& c : in_float->base(Vec3<float>::from(wo))) {
          measure::require_value(measure::to_double(c.weight), "weight of the base in float", bound.label,
                                 measure::to_double(c.normal), wo);
          if (has_facets(c.kind)) {
            EXPECT_GE(c.alpha, 1e-4f) << bound.label;
            EXPECT_LE(std::max(c.alpha, c.alpha_across), 1) << bound.label;
          }
        }
        if (view > 2 || i >= random_ones) continue;
        const BaseWorth w = base_worth(bound, wo, 512);
        EXPECT_LE(w.share, 1.3) << bound.label << " at " << wo.z;
        EXPECT_LE(w.largest, 30) << bound.label << " at " << wo.z;
      }
    }
  }
}

/// The generator requires this, as it prints one shader for all choices; and it requires few operations.
TEST(Base, IsRecordedAlikeForAllChoices) {
  measure::Random random(9);
  for (const auto& [name, m] : models()) {
    if (!m->has_base()) continue;
    std::vector<std::tuple<ClosureKind, bool, Tangent>> kinds;
    int operations = 0, of_lamp = 0;
    for (const Choices& choices : choice_combinations(m->info())) {
      const ParamValues fixed = with_choices(m->info(), choices);
      Recorder recorder;
      const auto brdf = m->record(fixed);
      const Vec3<Expr> wo = recorded("wo");
      const ClosureSum<Expr> base = brdf->base(wo);
      std::vector<std::tuple<ClosureKind, bool, Tangent>> here;
      for (const Closure<Expr>& c : base) here.push_back({c.kind, c.turned, c.stretched});
      if (here.empty()) continue;  // a choice without a base
      if (kinds.empty()) kinds = here;
      EXPECT_EQ(here, kinds) << name;
      Program program;
      program.output("f_cos", evaluate(base, recorded("wi"), wo));
      operations = std::max(operations, program.operations());
      Program given;
      given.output("f_cos", evaluate(input_closures(base), recorded("wi"), wo));
      of_lamp = std::max(of_lamp, given.operations());

      const measure::BoundModel bound = measure::bind_model(*m, complete(m->info(), fixed));
      InputValues inputs;
      for (const auto& [parameter, value] : bound.values) {
        if (const double* v = std::get_if<double>(&value)) inputs[parameter] = {*v, *v, *v};
        if (const auto* c = std::get_if<std::array<double, 3>>(&value)) inputs[parameter] = *c;
      }
      for (int i = 0; i < 20; ++i) {
        const Vec3<double> wi = measure::uniform_direction(random), w = measure::uniform_direction(random);
        give(inputs, "wi", wi);
        give(inputs, "wo", w);
        const double expected = evaluate(bound.brdf->base(w), wi, w).g;
        EXPECT_NEAR(program.run<double>(inputs).at("f_cos")[1], expected, 1e-9 * (1 + expected)) << bound.label;
      }
    }
    EXPECT_FALSE(kinds.empty()) << name;
    EXPECT_LE(of_lamp, 200) << name << ": a base is evaluated for every lamp";
    EXPECT_LE(operations, 600) << name << ": and placed once";
    RecordProperty(name, operations);
  }
}

}  // namespace
}  // namespace brdfc::forms
