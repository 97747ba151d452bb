// SPDX-License-Identifier: GPL-3.0-or-later
// Sums of lobes: fits to data that are sums, and the sum in the place of a model.
#include <gtest/gtest.h>

#include "check/chi_square.h"
#include "forms/form.h"
#include "measure/albedo.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "measured/fit_lobes.h"
#include "measured/least_deviations.h"
#include "measured/sum_table.h"
#include "support.h"

namespace brdfc::measured {
namespace {

std::vector<LobeSum> fitted(const std::vector<Part>& parts, std::size_t most, const std::vector<std::string>& from = {},
                            bool isotropic = true) {
  Measurement m;
  m.file = "made";
  m.isotropic = isotropic;
  m.table = std::make_shared<SumTable>(parts);
  return fit_lobes(m, MeasuredModel(m), lobe_kinds(from, isotropic), most);
}

TEST(LeastDeviations, OutliersAndBoundsAreNoMatter) {
  Eigen::MatrixXd a(60, 3);
  Eigen::VectorXd b(60);
  for (Eigen::Index k = 0; k < 60; ++k) {
    a.row(k) << 1, std::sin(double(k)), std::cos(3. * double(k));
    b[k] = 0.25 + 0.5 * a(k, 1);
    if (k % 9 == 4) b[k] += 7;
  }
  const Eigen::VectorXd w = Eigen::VectorXd::Ones(60);
  Eigen::VectorXd x = least_deviations(a, b, w, 1, Eigen::VectorXd::Ones(3));
  EXPECT_NEAR(x[0], 0.25, 1e-4);
  EXPECT_NEAR(x[1], 0.5, 1e-4);
  EXPECT_NEAR(x[2], 0, 1e-4);
  x = least_deviations(a, b, w, 1, Eigen::Vector3d(1, 0.4, 1));
  EXPECT_EQ(x[1], 0.4);
  x = least_deviations(a, -b, w, 1, Eigen::VectorXd::Ones(3));
  EXPECT_EQ(x[0], 0);
  EXPECT_EQ(x[1], 0);
}

TEST(LeastDeviations, ColumnsThatAreNearlyAlikeAreToldApart) {
  Eigen::MatrixXd a(40, 2);
  for (Eigen::Index k = 0; k < 40; ++k) a.row(k) << 1, 1 + 1e-3 * double(k);
  const Eigen::VectorXd x =
      least_deviations(a, a * Eigen::Vector2d(0.3, 0.6), Eigen::VectorXd::Ones(40), 0.9, Eigen::VectorXd::Ones(2));
  EXPECT_NEAR(x[0], 0.3, 1e-3);
  EXPECT_NEAR(x[1], 0.6, 1e-3);
}

TEST(FitLobes, HighlightsMayBeNarrow) {
  for (const char* alpha : {"0.008", "0.004"}) {
    const std::string along = std::string("ax=") + alpha, across = std::string("ay=") + alpha;
    const auto sums =
        fitted({{"microfacet", {along, across}}, {"lambert", {"rho=0.06"}}}, 2, {"lambert", "microfacet"});
    ASSERT_EQ(sums.size(), 2u) << alpha;
    EXPECT_LT(sums.back().error, 0.02) << alpha;
  }
}

struct Known {
  const char* name;
  std::vector<Part> parts;
  bool isotropic = true;
};
/// Numbers away from all places where a search begins.
const Known kKnown[] = {
    {"matte, a wide and a narrow highlight",
     {{"lambert", {"rho=0.3,0.2,0.1"}},
      {"ward", {"ks=0.2", "ax=0.37", "ay=0.37"}},
      {"ward", {"ks=0.1,0.12,0.15", "ax=0.06", "ay=0.06"}}}},
    {"two of the paper's lobes",
     {{"radziszewski_alda", {"n=2", "tint=0.5,0.4,0.3"}}, {"radziszewski_alda", {"n=20", "tint=0.3,0.4,0.5"}}}},
    {"a retroreflector under a coat",
     {{"lambert", {"rho=0.2,0.15,0.1"}},
      {"lafortune", {"cxy=1", "cz=0.9", "e=12", "ks=0.2,0.25,0.1"}},
      {"cook_torrance", {"m=0.2", "f0=0.05"}}}},
    {"brushed metal", {{"ward", {"ks=0.5,0.4,0.3", "ax=0.08", "ay=0.33"}}, {"lambert", {"rho=0.05"}}}, false},
    {"cloth with fibres that stand off it",
     {{"lambert", {"rho=0.2,0.05,0.05"}}, {"charlie", {"r=0.17", "tint=0.5,0.3,0.3"}}}},
    {"plastic: less matte light leaves it where its coat reflects more",
     {{"ashikhmin_shirley", {"part=diffuse", "rs=0", "rd=0.5,0.4,0.1"}}, {"blinn", {"ks=0.2", "e=130"}}}},
};

TEST(FitLobes, KnownSumsAreFound) {
  for (const Known& known : third_of(kKnown)) {
    const auto sums = fitted(known.parts, known.parts.size(), {}, known.isotropic);
    ASSERT_EQ(sums.size(), known.parts.size()) << known.name;
    EXPECT_LT(sums.back().error, 0.005) << known.name;
    EXPECT_GT(sums.front().error, 0.05) << known.name;
    double all = 0;
    for (const double share : sums.back().share) all += share;
    EXPECT_NEAR(all, 1, 1e-9);
    EXPECT_TRUE(std::ranges::is_sorted(sums.back().share, std::greater()));
  }
}

TEST(FitLobes, TheErrorFallsWithTheNumberSumTable) {
  // None of the lobes is of the data's kind.
  const auto sums = fitted(kKnown[0].parts, 6, {"radziszewski_alda", "lambert"});
  ASSERT_GE(sums.size(), 3u);
  for (std::size_t k = 0; k < sums.size(); ++k) {
    EXPECT_EQ(sums[k].lobes.size(), k + 1);
    EXPECT_LT(sums[k].error, k > 0 ? sums[k - 1].error : 1);
    for (const Lobe& lobe : sums[k].lobes)
      EXPECT_TRUE(lobe.model->info().name == "radziszewski_alda" || lobe.model->info().name == "lambert");
  }
  EXPECT_LT(sums.back().error, 0.5 * sums.front().error);
}

/// The error by its definition, over other pairs of directions than a fit uses.
double misplaced(const Table& data, const LobeSum& sum) {
  const auto brdf = SumModel(sum.lobes).make_double({});
  measure::Random random(77);
  double off = 0, light = 0;
  for (int i = 0; i < 200000; ++i) {
    const Vec3<double> wi = measure::uniform_direction(random), wo = measure::uniform_direction(random);
    if (!(wi.z > 0 && wo.z > 0)) continue;
    const Rgb<double> f = brdf->eval(wi, wo), d = data.eval(wi, wo), e = magnitude(f - d);
    off += (e.r + e.g + e.b) * wi.z * wo.z, light += (d.r + d.g + d.b) * wi.z * wo.z;
  }
  return off / light;
}

TEST(FitLobes, TheErrorIsTheLightThatIsMisplaced) {
  const auto sums = fitted(kKnown[1].parts, 3, {"blinn", "lambert"});
  for (const LobeSum& sum : sums)
    EXPECT_NEAR(sum.error, misplaced(SumTable(kKnown[1].parts), sum), 0.03 * sum.error + 1e-3);
}

TEST(FitLobes, ARetroreflectorNeedsALobeOfItsKind) {
  const auto with = fitted(kKnown[2].parts, 4),
             without = fitted(kKnown[2].parts, 4, {"lambert", "ward", "blinn", "cook_torrance", "schlick", "phong"});
  EXPECT_LT(with.back().error, 0.1 * without.back().error);
}

// Where models gain at grazing angles whatever their colours, as Schlick's Fresnel term makes them, the excess is said.
TEST(FitLobes, ASumReflectsNoMoreThanComesOrSaysSo) {
  for (const bool gains : {false, true}) {
    const auto sums = fitted(
        {{"radziszewski_alda", {"n=6", "tint=1,0.9,0.8"}}}, 3,
        gains ? std::vector<std::string>{"cook_torrance", "lambert"} : std::vector<std::string>{"lossless", "lambert"});
    ASSERT_FALSE(sums.empty());
    const auto brdf = SumModel(sums.back().lobes).make_double({});
    double most = 0;
    for (const double degrees : {0., 15., 30., 45., 60., 75., 85., 89.})
      most = std::max(most, max_component(measure::sampled_albedo(*brdf, std::cos(degrees * kPi / 180)).scattered));
    EXPECT_NEAR(sums.back().brightest.albedo, most, 0.02);
    EXPECT_EQ(most < 1.01, !gains) << most;
  }
}

TEST(FitLobes, BlackDataHaveNone) { EXPECT_TRUE(fitted({{"lambert", {"rho=0"}}}, 3).empty()); }

/// Whether the extension has a form of a model for these choices.
bool takes(const forms::Form& form, const Model& model, const ParamValues& values) {
  return std::ranges::all_of(form.values(model, {}), [&](const auto& v) { return values.at(v.first) == v.second; });
}

TEST(LobeKinds, AreWhereTheyClaimToBe) {
  std::set<std::string> without_nodes;
  for (const bool isotropic : {true, false})
    for (const LobeKind& kind : lobe_kinds({}, isotropic)) {
      const ModelInfo& info = kind.model->info();
      const ParamInfo* color = info.param(kind.color);
      ASSERT_TRUE(color && color->kind == ParamKind::Color) << info.name;
      for (const LobeKind::Number& number : kind.numbers)
        for (const std::string& name : number.names) {
          const ParamInfo* p = info.param(name);
          ASSERT_TRUE(p && p->kind == ParamKind::Number) << info.name << " " << name;
          EXPECT_GE(number.range.low, p->min) << info.name << " " << name;
          EXPECT_LE(number.range.high, p->max) << info.name << " " << name;
        }
      // In the middle of its ranges it scatters, and has no mirror, which no data show.
      ParamValues values = kind.values;
      for (const LobeKind::Number& number : kind.numbers)
        for (const std::string& name : number.names) values[name] = number.range.at(0.3);
      const auto brdf = kind.model->make_double(values);
      EXPECT_GT(luminance(brdf->eval(normalize(Vec3<double>{0.3, 0.1, 1}), normalize(Vec3<double>{-0.3, 0, 1}))), 0);
      EXPECT_EQ(luminance(brdf->mirror({0.6, 0, 0.8})), 0) << info.name;
      const auto of_model = forms::forms_of(*kind.model);
      const bool nodes = std::ranges::any_of(of_model, [&](const forms::Form* form) {
        return form->name() == std::string("nodes") && takes(*form, *kind.model, kind.values);
      });
      EXPECT_EQ(nodes, kind.everywhere) << info.name << " " << format_values(info, values);
    }
  EXPECT_THROW(lobe_kinds({"wart"}, true), InputError);
  EXPECT_THROW(lobe_kinds({"coupled"}, true), InputError);
}

const Part kMixed[] = {{"lambert", {"rho=0.3,0.1,0.2"}},
                       {"ward", {"ks=0.3", "ax=0.3", "ay=0.1"}},
                       {"cook_torrance", {"m=0.08", "f0=0.1,0.2,0.3"}},
                       {"lafortune", {"cxy=1", "cz=0.9", "e=40"}}};

measure::BoundModel bound(const SumModel& model) { return {&model, {}, model.make_double({}), "sum"}; }

TEST(SumModel, SamplesFollowThePdf) {
  const SumModel sum(lobes_of({std::begin(kMixed), std::end(kMixed)}));
  const measure::BoundModel b = bound(sum);
  double least = 1;
  std::uint64_t seed = 1;
  for (const double cosine : {0.98, 0.7, 0.3, 0.15}) {
    const check::ChiSquare c = check::chi_square(b, direction(cosine, 0.4 + cosine), 20000, seed++);
    EXPECT_TRUE(c.converged) << cosine;
    EXPECT_GT(c.degrees, 20) << cosine;
    least = std::min(least, c.p);
  }
  EXPECT_GT(least, 1e-3);
}

TEST(SumModel, ReflectsWhatItsLobesReflect) {
  const std::vector<Lobe> lobes = lobes_of({std::begin(kMixed), std::end(kMixed)});
  const auto sum = SumModel(lobes).make_double({});
  for (const double cosine : {1., 0.6, 0.2}) {
    Rgb<double> expected(0);
    for (const Lobe& lobe : lobes)
      expected += measure::albedo(*lobe.model->make_double(lobe.values), cosine, 0.3, "lobe").scattered;
    const auto sampled = measure::sampled_albedo(*sum, cosine, 0.3, "sum", 1 << 15);
    for (const auto& [a, e] : {std::pair(sampled.scattered.r, expected.r),
                               {sampled.scattered.g, expected.g},
                               {sampled.scattered.b, expected.b}})
      EXPECT_NEAR(a, e, 0.003 * e + 5 * sampled.standard_error) << cosine;
  }
}

TEST(SumModel, MirrorsAddUpAndLooksAreTheLeastMatte) {
  const SumModel sum(lobes_of({{"lambert", {}}, {"schlick", {"rough=0.2"}}}));
  EXPECT_TRUE(sum.has_mirror() && sum.has_scatter());
  const Vec3<double> wo = direction(0.7, 0.2);
  const auto schlick = find_model("schlick").make_double(parse_values(find_model("schlick").info(), {"rough=0.2"}));
  EXPECT_GT(luminance(schlick->mirror(wo)), 0);
  EXPECT_EQ(sum.make_double({})->mirror(wo).g, schlick->mirror(wo).g);
  EXPECT_EQ(sum.info().look, Look::Glossy);
  EXPECT_EQ(SumModel(lobes_of({{"lambert", {}}, {"oren_nayar", {}}})).info().look, Look::Matte);
}

/// Varnish over a matte surface over white.
const Part kLayers[] = {
    {"microfacet", {"f0=0.04,0.05,0.06", "ax=0.1", "ay=0.1"}}, {"schlick", {"rough=0.3"}}, {"lambert", {"rho=1"}}};

TEST(Layers, LoseNoLight) {
  const SumModel layers(lobes_of({kLayers[0], kLayers[2]}), Stack::Layers);
  const auto brdf = layers.make_double({});
  for (const double cosine : {1., 0.6, 0.2, 0.05}) {
    const Rgb<double> a = measure::sampled_albedo(*brdf, cosine, 0.3, "layers", 1 << 15).scattered;
    EXPECT_NEAR(a.b, 1, 1e-3) << cosine << ": blue, of which the varnish reflects most";
    EXPECT_LT(a.r, a.b) << cosine;
  }
  EXPECT_FALSE(layers.info().properties.reciprocal);
}

TEST(Layers, PassWhatTheOnesAboveLeave) {
  const std::vector<Lobe> lobes = lobes_of({std::begin(kLayers), std::end(kLayers)});
  const auto whole = SumModel(lobes, Stack::Layers).make_double({});
  for (const double cosine : {0.9, 0.45, 0.1}) {
    const Vec3<double> wo = direction(cosine, 0.4), wi = direction(0.7, 2.5);
    Rgb<double> f(0), mirror(0);
    double passed = 1;
    for (const Lobe& lobe : lobes) {
      const auto one = lobe.model->make_double(lobe.values);
      f += one->eval(wi, wo) * passed;
      mirror += one->mirror(wo) * passed;
      passed *= 1 - max_component(measure::albedo(*one, cosine, 0.4).total());
    }
    EXPECT_NEAR(whole->eval(wi, wo).g, f.g, 1e-3 * f.g) << cosine;
    EXPECT_NEAR(whole->mirror(wo).g, mirror.g, 1e-3 * mirror.g) << cosine;
  }
}

TEST(Layers, SamplesFollowThePdf) {
  const SumModel layers(lobes_of({kLayers[0], kLayers[2]}), Stack::Layers);
  const check::ChiSquare c = check::chi_square(bound(layers), direction(0.5, 0.9), 20000, 1);
  EXPECT_TRUE(c.converged);
  EXPECT_GT(c.degrees, 20);
  EXPECT_GT(c.p, 1e-3);
}

class Stacks : public testing::TestWithParam<Stack> {};
INSTANTIATE_TEST_SUITE_P(All, Stacks, testing::Values(Stack::Sum, Stack::Layers));

TEST_P(Stacks, EightAtOnceAreOneByOne) {
  const SumModel sum(lobes_of({std::begin(kMixed), std::end(kMixed)}), GetParam());
  const auto packed = sum.make_packed({});
  const auto one = sum.make_double({});
  measure::Random random(9);
  int lost = 0;
  for (int round = 0; round < 64; ++round) {
    Vec3<Pack> wi, wo, u;
    std::array<Vec3<double>, kLanes> i, o, v;
    for (std::size_t k = 0; k < kLanes; ++k) {
      i[k] = measure::uniform_direction(random), o[k] = measure::uniform_direction(random);
      o[k].z = std::abs(o[k].z);
      v[k] = measure::uniform_cube(random);
      wi.x[k] = i[k].x, wi.y[k] = i[k].y, wi.z[k] = i[k].z;
      wo.x[k] = o[k].x, wo.y[k] = o[k].y, wo.z[k] = o[k].z;
      u.x[k] = v[k].x, u.y[k] = v[k].y, u.z[k] = v[k].z;
    }
    const PackedEvaluation e = packed->evaluate(wi, wo);
    const Sample<Pack> s = packed->sample(wo, u);
    for (std::size_t k = 0; k < kLanes; ++k) {
      const Rgb<double> f = one->eval(i[k], o[k]);
      EXPECT_NEAR(e.f.g[k], f.g, 1e-9 * f.g);
      const double p = one->pdf(i[k], o[k]);
      EXPECT_NEAR(e.pdf[k], p, 1e-9 * p);
      const Sample<double> t = one->sample(o[k], v[k]);
      ASSERT_EQ(s.pdf[k] > 0, t.pdf > 0);
      lost += !(t.pdf > 0);
      if (!(t.pdf > 0)) {
        EXPECT_EQ(s.weight.g[k], 0);
        continue;
      }
      EXPECT_NEAR(s.wi.x[k], t.wi.x, 1e-7);
      EXPECT_NEAR(s.pdf[k], t.pdf, 1e-5 * t.pdf);
      EXPECT_NEAR(s.weight.b[k], t.weight.b, 1e-5 * t.weight.b);
    }
  }
  EXPECT_GT(lost, 0);
}

}  // namespace
}  // namespace brdfc::measured
