// SPDX-License-Identifier: GPL-3.0-or-later
// Curves of microfacet factors: fits to data that models and formulas make.
#include <gtest/gtest.h>

#include "forms/closure_nodes.h"
#include "measured/fit_factors.h"
#include "measured/sum_table.h"
#include "support.h"

namespace brdfc::measured {
namespace {

/// B. Walter, S. Marschner, H. Li, K. Torrance: Microfacet Models for Refraction through Rough Surfaces, EGSR 2007,
/// with height-correlated shadowing and Schlick's Fresnel term, over a matte surface.
class Ggx final : public Table {
 public:
  explicit Ggx(double alpha) : alpha_(alpha) {}
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    if (!(wi.z > 0 && wo.z > 0)) return Rgb<double>(0);
    const Vec3<double> h = normalize(wi + wo);
    const double d = sqr(alpha_) / (kPi * sqr(sqr(h.z) * (sqr(alpha_) - 1) + 1));
    const auto lambda = [&](double z) { return (std::sqrt(1 + sqr(alpha_) * (1 / sqr(z) - 1)) - 1) / 2; };
    const double f = 0.04 + 0.96 * pow5(1 - dot(wi, h));
    return Rgb<double>(0.2, 0.05, 0.1) / kPi +
           Rgb<double>(d * f / (1 + lambda(wi.z) + lambda(wo.z)) / (4 * wi.z * wo.z));
  }

 private:
  double alpha_;
};

ModelFit fitted(std::shared_ptr<const Table> table, bool isotropic = true) {
  Measurement m;
  m.file = "made";
  m.isotropic = isotropic;
  m.table = std::move(table);
  const auto fits = fit_models(m, MeasuredModel(m), {&find_model("factors")}, Matte::None);
  EXPECT_EQ(fits.size(), 1u);
  // Every value is within its range.
  EXPECT_NO_THROW(complete(fits.at(0).model->info(), fits.at(0).values));
  return fits.at(0);
}

TEST(FitFactors, OnlyAModelOfCurvesHasCurves) {
  const auto roles = curve_roles(find_model("factors"));
  ASSERT_TRUE(roles && roles->matte && roles->rim && roles->strength);
  EXPECT_EQ(roles->shape.size(), 2u);
  EXPECT_EQ(roles->roughness.size(), 2u);
  EXPECT_EQ(roles->colors.size() + roles->numbers.size() + 7, find_model("factors").info().params.size());
  EXPECT_FALSE(curve_roles(find_model("ward")));
}

TEST(FitFactors, FacetsThatNoOtherModelHereIsAreFound) {
  for (const double alpha : third_of(std::vector{0.07, 0.15, 0.3, 0.5, 0.8}))
    EXPECT_LT(fitted(std::make_shared<Ggx>(alpha)).error, 0.01) << alpha;
}

TEST(FitModels, ParametersThatTheChoicesLeaveUnreadHaveTheirDefaults) {
  Measurement m;
  m.file = "made";
  m.isotropic = true;
  m.table = std::make_shared<Ggx>(0.3);
  const auto fits = fit_models(m, MeasuredModel(m), {&find_model("microfacet")}, Matte::Added);
  ASSERT_EQ(fits.size(), 1u);
  ASSERT_NE(std::get<std::string>(fits[0].values.at("distribution")), "multiscatter_ggx");
  EXPECT_EQ(fits[0].values.at("again"), (ParamValue{std::array<double, 3>{1, 1, 1}}));
}

TEST(FitFactors, ColouredCurvesAreFound) {
  const Part made{"factors",
                  {"rho=0.1,0.2,0.05", "ax=0.13", "ay=0.13", "strength=0.7", "d1=0.9,0.8,0.6", "d3=0.6,0.5,0.3",
                   "d5=0.5,0.2,0.2", "d7=0.3,0.1,0.1", "f0=0.3,0.2,0.1", "f3=0.35,0.25,0.15", "g3=0.6"}};
  // The data's curves bend sharply at their knots, which lie elsewhere for the roughness that the search finds.
  EXPECT_LT(fitted(std::make_shared<SumTable>(std::vector{made})).error, 0.015);
}

TEST(FitFactors, TwoHighlightsOverAMatteSurface) {
  const std::vector<Part> paint{{"lambert", {"rho=0.3,0.02,0.01"}},
                                {"cook_torrance", {"m=0.4", "f0=0.3,0.05,0.02"}},
                                {"cook_torrance", {"m=0.06", "f0=0.04"}}};
  // Their Fresnel terms differ, so they are no product; but no formula comes as near.
  Measurement m;
  m.file = "made";
  m.isotropic = true;
  m.table = std::make_shared<SumTable>(paint);
  const auto formulas =
      fit_models(m, MeasuredModel(m), {&find_model("cook_torrance"), &find_model("ward")}, Matte::Added);
  const double error = fitted(m.table).error;
  EXPECT_LT(error, 0.1);
  EXPECT_LT(error, 0.6 * formulas.front().error);
}

TEST(FitFactors, BrushedMetal) {
  const std::vector<Part> metal{{"ward", {"ks=0.5,0.4,0.3", "ax=0.08", "ay=0.33"}}, {"lambert", {"rho=0.05"}}};
  const ModelFit fit = fitted(std::make_shared<SumTable>(metal), false);
  EXPECT_LT(fit.error, 0.03);
  EXPECT_NEAR(std::get<double>(fit.values.at("ay")) / std::get<double>(fit.values.at("ax")), 0.33 / 0.08, 0.3);
}

/// Lobes that are not about the half vector.
TEST(FitFactors, LobesOfOtherShapes) {
  struct Row {
    Part made;
    double widening, heights, error;
  };
  for (const Row& row : {Row{{"modified_phong", {"e=20"}}, 2, 0.5, 0.012}, Row{{"lafortune", {}}, 2.2, 0.5, 0.025},
                         Row{{"max_phong", {}}, 2, 0.55, 0.035}, Row{{"coupled", {}}, 2, 0, 0.01},
                         Row{{"lossless", {}}, 3.8, 1, 0.08}, Row{{"radziszewski_alda", {"n=4"}}, 1.3, 0.45, 0.11}}) {
    const ModelFit fit = fitted(std::make_shared<SumTable>(std::vector{row.made}));
    EXPECT_LT(fit.error, row.error) << row.made.model;
    EXPECT_NEAR(std::get<double>(fit.values.at("widening")), row.widening, 0.3) << row.made.model;
    EXPECT_NEAR(std::get<double>(fit.values.at("heights")), row.heights, 0.1) << row.made.model;
  }
}

TEST(FitFactors, FacetsKeepTheirShape) {
  const ModelFit fit = fitted(std::make_shared<Ggx>(0.3));
  EXPECT_EQ(std::get<double>(fit.values.at("widening")), 0);
  EXPECT_EQ(std::get<double>(fit.values.at("heights")), 0);
}

/// What J. Löw, J. Kronander, A. Ynnerman and J. Unger found for materials of MERL's database with their model of
/// smooth surfaces (BRDF Models for Accurate and Efficient Rendering of Glossy Surfaces, ACM TOG 31(1), 2012, equations
/// 10 to 14): A / (1 + B |D|^2)^C, where D is the difference of the light's and the mirror direction, projected onto
/// the surface, times the Fresnel term of a dielectric.
struct Smooth final : Table {
  const char* material;
  Rgb<double> rho, a;
  double b, c, eta;

  Smooth(const char* material, const Rgb<double>& rho, const Rgb<double>& a, double b, double c, double eta)
      : material(material), rho(rho), a(a), b(b), c(c), eta(eta) {}
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    if (!(wi.z > 0 && wo.z > 0)) return Rgb<double>(0);
    const double d2 = sqr(wi.x + wo.x) + sqr(wi.y + wo.y), apart = sqr(wi.x - wo.x) + sqr(wi.y - wo.y),
                 cd = std::sqrt(1 - apart / 4), g = std::sqrt(eta * eta + cd * cd - 1),
                 fresnel = sqr((g - cd) / (g + cd)) / 2 * (1 + sqr((cd * (g + cd) - 1) / (cd * (g - cd) + 1)));
    return rho / kPi + a * (fresnel * std::pow(1 + b * d2, -c));
  }
};

TEST(FitFactors, PublishedFitsOfMeasuredMaterials) {
  const std::vector<Smooth> materials{
      {"gold-metallic-paint", {0.0094, 0.0024, 0}, {5.34906, 3.69027, 1.31988}, 9.81648, 1.545613, 1.91911},
      {"blue-fabric", {0.0187, 0.0206, 0.0492}, {1.15592, 1.3681, 2.1739}, 26.236933, 0.140902, 1.10946},
      {"chrome", {0.0036, 0.0033, 0.0038}, {901.24337, 704.41989, 639.11621}, 14859.786129, 1.927413, 9.05481},
      {"steel", {0.0061, 0.0086, 0.0112}, {1538.27729, 1253.70115, 1194.10439}, 68390.138636, 1.369086, 7.25842},
  };
  for (const Smooth& m : materials) {
    const ModelFit fit = fitted(std::make_shared<Smooth>(m));
    EXPECT_LT(fit.error, 0.02) << m.material;
    // What EEVEE shows of it: the mean over all light that is reflected is from 0.10 to 0.17.
    double off = 0, light = 0;
    for (const fit::ViewError& view : forms::stand_in_errors(*fit.model, fit.values)) {
      off += view.cos_theta_o * view.relative_l1;
      light += view.cos_theta_o;
    }
    EXPECT_LT(off, 0.2 * light) << m.material;
  }
}

TEST(FitFactors, MatteLightThatIsDarkerAtTheRim) {
  const ModelFit fit = fitted(std::make_shared<SumTable>(std::vector<Part>{{"ashikhmin_shirley", {}}}));
  EXPECT_LT(fit.error, 0.025);
  EXPECT_GT(std::get<double>(fit.values.at("rim")), 0.6);
}

TEST(FitFactors, WhatIsNoProductOfFactorsHasALargeError) {
  // Its light and view can't be swapped.
  EXPECT_GT(fitted(std::make_shared<SumTable>(std::vector<Part>{{"phong", {}}})).error, 0.05);
}

TEST(FitFactors, AMatteSurfaceHasNoHighlight) {
  const ModelFit fit = fitted(std::make_shared<SumTable>(std::vector<Part>{{"lambert", {"rho=0.5,0.3,0.2"}}}));
  EXPECT_LT(fit.error, 0.002);
}

TEST(FitFactors, BlackDataAreBlack) {
  const ModelFit fit = fitted(std::make_shared<SumTable>(std::vector<Part>{{"lambert", {"rho=0"}}}));
  EXPECT_EQ(fit.error, 0);
  const auto brdf = find_model("factors").make_double(fit.values);
  EXPECT_LT(brdf->eval({0, 0, 1}, {0.6, 0, 0.8}).g, 1e-25) << "a logarithm of 0 has a bound";
}

// Curves that are found with few pairs may be anything between these.
TEST(FitFactors, NoPeakIsFurtherOffThanAMatteSurface) {
  for (const double alpha : third_of(std::vector{3e-4, 0.003, 0.01, 0.04})) {
    const auto data = std::make_shared<Ggx>(alpha);
    Measurement m;
    m.file = "made";
    m.isotropic = true;
    m.table = data;
    const auto matte = fit_models(m, MeasuredModel(m), {&find_model("lambert")}, Matte::None);
    EXPECT_LT(fitted(data).error, matte.front().error * 1.05) << alpha;
  }
}

TEST(FitFactors, TheColourIsInTheFresnelTerm) {
  const ModelFit fit = fitted(std::make_shared<SumTable>(
      std::vector<Part>{{"cook_torrance", {"m=0.3", "f0=0.9,0.6,0.2"}}, {"lambert", {"rho=0.05"}}}));
  const auto color = [&](const char* name) { return std::get<std::array<double, 3>>(fit.values.at(name)); };
  double highest = 0;
  for (int k = 0; k < 14; ++k) highest = std::max(highest, color(("d" + std::to_string(k)).c_str())[1]);
  for (int k = 0; k < 14; ++k) {
    const auto d = color(("d" + std::to_string(k)).c_str());
    if (d[1] == highest) {
      EXPECT_NEAR(d[0], d[2], 1e-9) << k;
    }
  }
  EXPECT_GT(color("f0")[0], 2 * color("f0")[2]);
}

}  // namespace
}  // namespace brdfc::measured
