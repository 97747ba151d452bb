// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of measured BRDFs: indices, and sampling. Files are tested by tests/cli/test_measured.py.
#include <gtest/gtest.h>

#include <set>

#include "measure/albedo.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "measured/fit_models.h"
#include "measured/grid_table.h"
#include "measured/measured_model.h"
#include "measured/merl.h"
#include "measured/sum_table.h"
#include "model/sampling.h"
#include "support.h"

namespace brdfc::measured {
namespace {

TEST(Merl, EveryEntryIsFoundFromTheMiddleOfItsCell) {
  std::size_t above = 0;
  for (std::size_t entry = 0; entry < kMerlEntries; ++entry) {
    const HalfDifference angles = merl_angles(entry);
    ASSERT_EQ(merl_entry(angles), entry);
    const auto [wi, wo] = directions(angles);
    ASSERT_NEAR(length(wi), 1, 1e-12);
    ASSERT_NEAR(length(wo), 1, 1e-12);
    if (!(wi.z > 0 && wo.z > 0)) continue;
    ++above;
    ASSERT_EQ(merl_entry(half_difference(wi, wo)), entry);
    ASSERT_EQ(merl_entry(half_difference(wo, wi)), entry);  // phi_d is modulo pi
    // The half vector's azimuth does not matter.
    ASSERT_EQ(merl_entry(half_difference(rotate_z(wi, 0.6, 0.8), rotate_z(wo, 0.6, 0.8))), entry);
  }
  EXPECT_GT(above, kMerlEntries / 2);
}

TEST(Merl, AnglesAreThoseOfTheDirections) {
  measure::Random random(5);
  for (int i = 0; i < 1000; ++i) {
    const Vec3<double> wi = measure::uniform_direction(random), wo = measure::uniform_direction(random);
    const HalfDifference a = half_difference(wi, wo);
    EXPECT_NEAR(std::cos(a.theta_h), normalize(wi + wo).z, 1e-12);
    EXPECT_NEAR(std::cos(a.theta_d), dot(wi, normalize(wi + wo)), 1e-12);
    const auto [i2, o2] = directions(a);
    EXPECT_NEAR(i2.z, wi.z, 1e-12);
    EXPECT_NEAR(o2.z, wo.z, 1e-12);
    EXPECT_NEAR(dot(i2, o2), dot(wi, wo), 1e-12);
  }
}

TEST(AngleAxis, ACircleCloses) {
  const AngleAxis circle{{0, 90, 270}, AngleAxis::Ends::Circle};
  EXPECT_EQ(circle.locate(315).first, 2u);
  EXPECT_EQ(circle.locate(315).second, 0u);
  EXPECT_DOUBLE_EQ(circle.locate(315).weight, 0.5);
  EXPECT_DOUBLE_EQ(circle.locate(-45).weight, 0.5);
  EXPECT_EQ(circle.locate(180 + 720).first, 1u);
  const AngleAxis ends{{10, 20}, AngleAxis::Ends::Constant};
  EXPECT_EQ(ends.locate(5).first, 0u);
  EXPECT_EQ(ends.locate(25).first, 1u);
  EXPECT_DOUBLE_EQ(ends.locate(12.5).weight, 0.25);
}

/// A table that is a model of this project.
class OfModel final : public Table {
 public:
  OfModel(const char* name, const ParamValues& values) : brdf_(find_model(name).make_double(values)) {}
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override { return brdf_->eval(wi, wo); }

 private:
  std::unique_ptr<Brdf<double>> brdf_;
};

struct Case {
  const char* model;
  ParamValues values;
  bool isotropic;
  double most;  ///< largest variance of f cos / pdf over its mean squared
};

measure::BoundModel bound(const Case& c, std::unique_ptr<MeasuredModel>& model) {
  Measurement m;
  m.file = c.model;
  m.isotropic = c.isotropic;
  m.table = std::make_shared<OfModel>(c.model, complete(find_model(c.model).info(), c.values));
  model = std::make_unique<MeasuredModel>(m);
  return {model.get(), {}, model->make_double({}), c.model};
}

const Case kCases[] = {
    {"lambert", {}, true, 0.5},
    {"cook_torrance", {{"m", 0.05}}, true, 4},
    {"cook_torrance", {{"m", 0.5}}, true, 4},
    {"ward", {{"ax", 0.3}, {"ay", 0.1}}, false, 6},
};

/// One of 8 x 4 x 2 cells: by the angle of the half vector, its azimuth, and the height of wi.
std::size_t cell_of(const Vec3<double>& wi, const Vec3<double>& wo) {
  const Vec3<double> h = normalize(wi + wo);
  const double tangent = std::sqrt(sin2_theta(h)) / h.z;
  const std::size_t t = std::size_t(std::clamp(std::log2(tangent) + 6, 0., 7.)),
                    p = std::size_t((std::atan2(h.y, h.x) / (2 * kPi) + 0.5) * 3.999);
  return (t * 4 + p) * 2 + (wi.z > 0.6);
}

// The pdf has steps, which the quadrature of check::chi_square() does not get along with: its integral over each cell
// is a mean over other samples here.
TEST(HalfVectors, SamplesFollowThePdf) {
  constexpr int kSamples = 200000;
  for (const Case& c : kCases) {
    std::unique_ptr<MeasuredModel> model;
    const measure::BoundModel b = bound(c, model);
    const auto of_model = find_model(c.model).make_double(complete(find_model(c.model).info(), c.values));
    for (const double cosine : {1., 0.7, 0.2}) {
      const Vec3<double> wo = direction(cosine, 0.4);
      measure::Random random(7);
      std::array<double, 64> drawn{}, mean{}, square{};
      double lost = 0, whole = 0, spread = 0;
      for (int i = 0; i < kSamples; ++i) {
        const Sample<double> s = b.brdf->sample(wo, measure::uniform_cube(random));
        if (s.pdf > 0) {
          ASSERT_DOUBLE_EQ(s.pdf, b.brdf->pdf(s.wi, wo));
          drawn[cell_of(s.wi, wo)] += 1. / kSamples;
        } else {
          lost += 1. / kSamples;
        }
        const Vec3<double> u = measure::uniform_cube(random);
        const Vec3<double> wi = u.x < 0.5 ? sample_cosine(u.y, u.z) : of_model->sample(wo, {2 * u.x - 1, u.y, u.z}).wi;
        if (!(wi.z > 0)) continue;
        const double value = b.brdf->pdf(wi, wo) / (0.5 * cosine_pdf(wi) + 0.5 * of_model->pdf(wi, wo)) / kSamples;
        mean[cell_of(wi, wo)] += value;
        square[cell_of(wi, wo)] += value * value;
        whole += value, spread += value * value;
      }
      for (std::size_t k = 0; k < mean.size(); ++k)
        EXPECT_NEAR(drawn[k], mean[k], 5 * std::sqrt(square[k] + drawn[k] / kSamples) + 1e-4)
            << c.model << " " << cosine << " cell " << k;
      EXPECT_NEAR(whole + lost, 1, 5 * std::sqrt(spread + lost / kSamples)) << c.model << " " << cosine;
    }
  }
}

TEST(HalfVectors, SamplesHaveTheAlbedoOfTheModelAndLittleVariance) {
  for (const Case& c : kCases) {
    std::unique_ptr<MeasuredModel> model;
    const measure::BoundModel b = bound(c, model);
    const auto of_model = find_model(c.model).make_double(complete(find_model(c.model).info(), c.values));
    for (const double cosine : {0.95, 0.6, 0.3}) {
      const auto sampled = measure::sampled_albedo(*b.brdf, cosine, 0.4, c.model, 1 << 15);
      const auto exact = measure::albedo(*of_model, cosine, 0.4, c.model);
      EXPECT_NEAR(sampled.scattered.g, exact.scattered.g, 0.01 * exact.scattered.g + 5 * sampled.standard_error)
          << c.model << " " << cosine;
      measure::Random random(3);
      double mean = 0, square = 0;
      constexpr int kSamples = 20000;
      for (int i = 0; i < kSamples; ++i) {
        const double weight = b.brdf->sample(direction(cosine, 0.4), measure::uniform_cube(random)).weight.g / kSamples;
        mean += weight, square += weight * weight * kSamples;
      }
      EXPECT_LT(square / (mean * mean) - 1, c.most) << c.model << " " << cosine;
    }
  }
}

TEST(MeasuredModel, EightAtOnceAreOneByOne) {
  std::unique_ptr<MeasuredModel> model;
  const measure::BoundModel b = bound(kCases[1], model);
  const auto packed = model->make_packed({});
  measure::Random random(9);
  Vec3<Pack> wi, wo, u;
  std::array<Vec3<double>, kLanes> i, o, v;
  for (std::size_t k = 0; k < kLanes; ++k) {
    i[k] = measure::uniform_direction(random), o[k] = measure::uniform_direction(random);
    v[k] = measure::uniform_cube(random);
    wi.x[k] = i[k].x, wi.y[k] = i[k].y, wi.z[k] = i[k].z;
    wo.x[k] = o[k].x, wo.y[k] = o[k].y, wo.z[k] = o[k].z;
    u.x[k] = v[k].x, u.y[k] = v[k].y, u.z[k] = v[k].z;
  }
  const PackedEvaluation e = packed->evaluate(wi, wo);
  const Sample<Pack> s = packed->sample(wo, u);
  for (std::size_t k = 0; k < kLanes; ++k) {
    EXPECT_EQ(e.f.g[k], b.brdf->eval(i[k], o[k]).g);
    EXPECT_EQ(e.pdf[k], b.brdf->pdf(i[k], o[k]));
    EXPECT_EQ(s.pdf[k], b.brdf->sample(o[k], v[k]).pdf);
    EXPECT_EQ(s.weight.b[k], b.brdf->sample(o[k], v[k]).weight.b);
  }
}

/// Noise of a few percent that depends on the directions alone.
class Noisy final : public Table {
 public:
  Noisy(std::shared_ptr<const Table> table, double share) : table_(std::move(table)), share_(share) {}
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    const auto noise = [&](double k) { return 1 + share_ * std::sqrt(2.) * std::sin(1e5 * (dot(wi, wo) + k * wi.z)); };
    return table_->eval(wi, wo) * Rgb<double>(noise(1), noise(2), noise(3));
  }

 private:
  std::shared_ptr<const Table> table_;
  double share_;
};

Measurement as_measured(std::shared_ptr<const Table> table, bool isotropic = true) {
  Measurement m;
  m.file = "made";
  m.isotropic = isotropic;
  m.table = std::move(table);
  return m;
}

ModelFit fit_of(const Measurement& m, const char* model, Matte matte = Matte::Added) {
  const MeasuredModel data(m);
  return fit_models(m, data, {&find_model(model)}, matte).at(0);
}

struct Found {
  const char* model;
  ParamValues values;              ///< those that differ from the defaults
  std::vector<const char*> names;  ///< numbers and colours that the data determine
};
/// Away from the defaults, at which the search begins.
const Found kFound[] = {
    {"ashikhmin_shirley", {{"nu", 40.}, {"nv", 40.}}, {"rs", "rd", "nu"}},
    {"blinn", {{"e", 35.}}, {"ks", "e"}},
    {"cook_torrance", {{"m", 0.45}}, {"f0", "m"}},
    {"glossy_reflector", {{"e", 30.}}, {"e"}},
    {"glossy_specular", {{"e", 30.}}, {"e"}},
    {"hapke", {{"b", 0.45}, {"h", 0.2}}, {"w", "b"}},
    {"lafortune", {}, {"ks", "e", "cxy", "cz"}},
    {"lambert", {}, {"rho"}},
    {"lossless", {{"n", 7.}}, {"tint", "n"}},
    {"max_phong", {{"e", 30.}}, {"ks", "e"}},
    {"modified_phong", {{"e", 30.}}, {"ks", "e"}},
    {"oren_nayar", {{"sigma", 0.6}}, {"rho", "sigma"}},
    {"phong", {{"e", 30.}}, {"ks", "e"}},
    {"phong_material", {{"kr", 0.}, {"es", 30.}}, {"es"}},
    {"radziszewski_alda", {{"n", 7.}}, {"tint", "n"}},
    {"schlick", {{"p", 0.6}, {"rough", 0.35}}, {"r", "p", "rough"}},
    {"ward", {{"ax", 0.1}, {"ay", 0.3}}, {"ks", "ax", "ay"}},
};

std::vector<double> numbers_of(const ParamValue& value) {
  if (const auto* number = std::get_if<double>(&value)) return {*number};
  const auto& c = std::get<std::array<double, 3>>(value);
  return {c.begin(), c.end()};
}

void expect_found(double noise, double tolerance, double most, const std::vector<std::string>& of) {
  const auto fitted = [&](const Model& model, const ParamValues& truth) {
    const std::string& name = model.info().name;
    const auto table = std::make_shared<Noisy>(std::make_shared<OfModel>(name.c_str(), truth), noise);
    const ModelFit fit = fit_of(as_measured(table, name != "ward"), name.c_str());
    EXPECT_LT(fit.error, most) << name << " " << format_values(model.info(), fit.values);
    EXPECT_FALSE(fit.matte) << name;
    return fit;
  };
  std::set<std::string> named;
  for (const Found& c : kFound) {
    named.insert(c.model);
    if (std::ranges::find(of, c.model) == of.end()) continue;
    const Model& model = find_model(c.model);
    const ParamValues truth = complete(model.info(), c.values);
    const ModelFit fit = fitted(model, truth);
    for (const char* name : c.names) {
      const auto found = numbers_of(fit.values.at(name)), expected = numbers_of(truth.at(name));
      for (std::size_t k = 0; k < found.size(); ++k)
        EXPECT_NEAR(found[k], expected[k], tolerance * std::abs(expected[k]))
            << c.model << " " << format_values(model.info(), fit.values);
    }
  }
  // The parameters of others are not determined by f: some are factors of one another, some are of mirrors.
  for (const std::string& name : of)
    if (const Model& m = find_model(name); m.has_scatter() && !m.two_sided() && !named.count(name))
      fitted(m, complete(m.info(), {}));
}

TEST(FitModels, ModelsAreFoundToOnePercent) { expect_found(0, 0.01, 2e-3, third_of(model_names())); }
TEST(FitModels, ModelsAreFoundToFivePercentUnderNoiseOfTwo) {
  expect_found(0.02, 0.05, 0.025, third_of(model_names()));
}

/// A sum of two tables.
class Sum final : public Table {
 public:
  Sum(std::shared_ptr<const Table> a, std::shared_ptr<const Table> b) : a_(std::move(a)), b_(std::move(b)) {}
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    return a_->eval(wi, wo) + b_->eval(wi, wo);
  }

 private:
  std::shared_ptr<const Table> a_, b_;
};

TEST(FitModels, MatteLightIsAddedWhereAModelHasNone) {
  const auto lobe = std::make_shared<OfModel>("blinn", complete(find_model("blinn").info(), {}));
  const ParamValues rho{{"rho", std::array<double, 3>{0.1, 0.3, 0.2}}};
  const auto matte = std::make_shared<OfModel>("lambert", rho);
  const Measurement m = as_measured(std::make_shared<Sum>(lobe, matte));
  const ModelFit fit = fit_of(m, "blinn");
  ASSERT_TRUE(fit.matte);
  EXPECT_NEAR(fit.matte->r, 0.1, 1e-3);
  EXPECT_NEAR(fit.matte->g, 0.3, 3e-3);
  EXPECT_NEAR(fit.matte->b, 0.2, 2e-3);
  EXPECT_NEAR(std::get<double>(fit.values.at("e")), 50, 0.5);
  EXPECT_LT(fit.error, 1e-3);
  const ModelFit alone = fit_of(m, "blinn", Matte::None);
  EXPECT_FALSE(alone.matte);
  EXPECT_GT(alone.error, 0.1);
}

// What is accepted goes on beyond the sliders.
TEST(FitModels, NumbersAreFoundBeyondTheSliders) {
  struct Narrow {
    Part part;
    const char* name;
    double value;
    bool matte = true;
  };
  const Narrow cases[] = {{{"cook_torrance", {"m=0.03", "f0=0.9,0.6,0.3"}}, "m", 0.03, false},
                          {{"cook_torrance", {"m=0.01", "f0=0.9,0.6,0.3"}}, "m", 0.01, false},
                          {{"ward", {"ax=0.01", "ay=0.01", "ks=0.5"}}, "ax", 0.01},
                          {{"microfacet", {"ax=0.012", "ay=0.012"}}, "ay", 0.012},
                          {{"microfacet", {"ax=0.004", "ay=0.004", "distribution=ggx"}}, "ax", 0.004},
                          {{"blinn", {"e=1e4"}}, "e", 1e4}};
  for (const Narrow& c : cases) {
    std::vector<Part> parts{c.part};
    if (c.matte) parts.push_back({"lambert", {"rho=0.06"}});
    const ModelFit fit = fit_of(as_measured(std::make_shared<SumTable>(parts)), c.part.model);
    EXPECT_LT(fit.error, 0.02) << c.part.model;
    EXPECT_NEAR(std::get<double>(fit.values.at(c.name)), c.value, 0.05 * c.value) << c.part.model;
    EXPECT_TRUE(fit.stopped.empty()) << c.part.model;
  }
}

TEST(FitModels, ANumberAtTheEndOfItsRangeIsNamed) {
  // Facets that face everywhere are wider than any slope of 1 makes them.
  const Part part{"microfacet", {"ax=1", "ay=1", "distribution=ggx"}};
  const ModelFit fit = fit_of(as_measured(std::make_shared<SumTable>(std::vector{part})), "cook_torrance");
  EXPECT_EQ(fit.stopped, std::vector<std::string>{"m"}) << std::get<double>(fit.values.at("m"));
  EXPECT_NE(remarks(fit).find("; stopped at the end of the range of m"), std::string::npos);
}

/// A table turned about the normal.
class TurnedTable final : public Table {
 public:
  TurnedTable(std::shared_ptr<const Table> table, double angle) : table_(std::move(table)), angle_(angle) {}
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    const double c = std::cos(angle_), s = std::sin(angle_);
    return table_->eval(rotate_z(wi, c, s), rotate_z(wo, c, s));
  }

 private:
  std::shared_ptr<const Table> table_;
  double angle_;
};

TEST(FitModels, TheRotationOfAnisotropicDataIsFound) {
  const Part part{"ashikhmin_shirley", {"rs=0.2", "rd=0.1", "nu=85", "nv=6", "rotation=0.5"}};
  const ModelFit fit = fit_of(as_measured(std::make_shared<SumTable>(std::vector{part}), false), part.model);
  EXPECT_LT(fit.error, 0.01);
  // nu and nv may have changed places.
  EXPECT_NEAR(std::remainder(std::get<double>(fit.values.at("rotation")) - 0.5, kPi / 2), 0, 0.01);
}

TEST(FitModels, ModelsWithoutARotationSayHowTheDataHaveToBeTurned) {
  for (const double degrees : {0., 30., -60., 90.}) {
    const auto straight = std::make_shared<SumTable>(
        std::vector<Part>{{"ward", {"ax=0.1", "ay=0.4", "ks=0.5"}}, {"lambert", {"rho=0.1"}}});
    const auto table = std::make_shared<TurnedTable>(straight, degrees * kPi / 180);
    const ModelFit fit = fit_of(as_measured(table, false), "ward");
    const bool aligned = degrees == 0 || degrees == 90;
    EXPECT_EQ(fit.turned.has_value(), !aligned) << degrees << " " << fit.error;
    if (!fit.turned) continue;
    EXPECT_LT(fit.turned->error, 0.02) << degrees;
    EXPECT_LE(std::abs(fit.turned->angle), kPi / 4) << degrees << " " << fit.turned->error;
    EXPECT_NEAR(std::remainder(fit.turned->angle * 180 / kPi + degrees, 90), 0, 1) << degrees;
    EXPECT_NE(remarks(fit).find("degrees about the normal"), std::string::npos);
  }
}

// Phong's material has a lobe like this among others.
TEST(FitModels, OfModelsThatComeAsCloseTheSimplerIsFirst) {
  const Model& simple = find_model("glossy_specular");
  const Measurement m = as_measured(std::make_shared<OfModel>("glossy_specular", complete(simple.info(), {})));
  const MeasuredModel data(m);
  const auto fits = fit_models(m, data, {&find_model("phong_material"), &simple, &find_model("lambert")}, Matte::Added);
  ASSERT_EQ(fits.size(), 3u);
  EXPECT_LT(fits[1].error, 2e-3);
  EXPECT_EQ(fits[0].model, &simple);
  EXPECT_GT(fits[2].error, 0.1);
}

TEST(FitModels, TheErrorIsTheLightThatIsMisplaced) {
  // A black model misplaces all of it: glossy light from a mirror that is not there.
  const ParamValues black{{"rho", std::array<double, 3>{0, 0, 0}}};
  const Measurement m = as_measured(std::make_shared<OfModel>("lambert", black));
  const MeasuredModel data(m);
  EXPECT_EQ(fit_models(m, data, {&find_model("blinn")}, Matte::None).at(0).error, 0);
  // Half of the hemisphere of view is black: Lambert does best with the value of the brighter half or with none.
  class Half final : public Table {
   public:
    Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
      return Rgb<double>(wi.z > 0 && wo.z * wo.z > 0.4 ? 0.2 : 0);
    }
  };
  const ModelFit fit = fit_of(as_measured(std::make_shared<Half>()), "lambert");
  EXPECT_NEAR(fit.error, 0.4 / 0.6, 0.02);
}

}  // namespace
}  // namespace brdfc::measured
