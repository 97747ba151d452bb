// SPDX-License-Identifier: GPL-3.0-or-later
// Rounding errors of every model over its whole accepted range; and the measurement itself, tested with formulas known
// to be unstable.
#include "measure/stability.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "model/sampling.h"
#include "support.h"

namespace brdfc::measure {

// Not in the anonymous namespace: the model adapter has members of these types.
namespace fragile {

// Formulas as printed in textbooks, one at a time.
enum Formula { kGood, kSineFromCosine, kSumOfOpposites, kHighPower, kNegativeRarely };

template <Formula F> struct Fragile {
  template <class T> struct Type {
    T e;
    static ModelInfo info() {
      return {.name = "fragile",
              .label = "Fragile",
              .paper = "",
              .equations = "",
              .doc = "",
              .properties = {},
              .params = {}};
    }
    template <class Visitor> void parameters(const Visitor& v) { v(e, NumberSpec{"e", "E", 1, 0, 1e8, 0, 1000, ""}); }
    Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
      T f(1);
      if (F == kGood) f = sin2_theta(wi) + wo.z * e;
      if (F == kSineFromCosine) f = T(1) - wi.z * wi.z;
      if (F == kSumOfOpposites) f = sin2_theta(wi + wo);
      if (F == kHighPower) f = pow(maximum(dot(wi, reflect(wo)), tiny<T>()), e);
      if (F == kNegativeRarely) f = select(wi.z < T(1e-9), T(-1), T(1));
      return select(above(wi, wo), Rgb<T>(f), Rgb<T>(T(0)));
    }
    T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), cosine_pdf(wi), T(0)); }
    Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
      const Vec3<T> wi = sample_cosine(u.y, u.z);
      return sample_if(above(wi, wo), wi, eval(wi, wo) * pi<T>(), pdf(wi, wo));
    }
  };
};

}  // namespace fragile

namespace {

using namespace fragile;

double effort() {
  const char* text = std::getenv("BRDFC_EFFORT");
  return text ? std::strtod(text, nullptr) : 1;
}

template <Formula F> double amplified() {
  return hunt_rounding(detail::ModelOf<Fragile<F>::template Type>(), {.points = 5000}).amplified;
}

TEST(Rounding, OfGoodFormulasIsSmall) { EXPECT_LT(amplified<kGood>(), 4); }
TEST(Rounding, SeesASineTakenFromACosine) { EXPECT_GT(amplified<kSineFromCosine>(), 1e6); }
TEST(Rounding, SeesCancellationBetweenOppositeDirections) { EXPECT_GT(amplified<kSumOfOpposites>(), 1e6); }
TEST(Rounding, SeesAHighPowerOfARoundedCosine) { EXPECT_GT(amplified<kHighPower>(), 1e6); }
TEST(Rounding, RareBadValuesAreNamed) {
  const detail::ModelOf<Fragile<kNegativeRarely>::Type> model;
  try {
    evaluate_everywhere(model, 100000, 1);
    FAIL() << "a negative value passed";
  } catch (const ValueError& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("fragile e="));
    EXPECT_THAT(e.what(), testing::HasSubstr("= -1"));
  }
}

/// Column `amplified` of cases.csv: the error, in units of epsilon, that a model's formula may add to the effect of
/// rounding its inputs.
double allowed(const std::string& model) {
  std::ifstream in(std::string(BRDFC_SOURCE_DIR) + "/tests/models/cases.csv");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(model + ",")) return std::strtod(line.substr(line.rfind(',') + 1).c_str(), nullptr);
  ADD_FAILURE() << "tests/models/cases.csv has no row for " << model;
  return 0;
}

class Everywhere : public testing::TestWithParam<std::string> {
 protected:
  const Model& model() const { return find_model(GetParam()); }
};

class Hunted : public Everywhere {};

TEST_P(Hunted, DoubleKeepsItsDigits) {
  const Stability s = hunt_rounding(model(), {.points = long(20000 * effort())});
  EXPECT_GE(s.points, long(19000 * effort()));
  EXPECT_LE(s.amplified, allowed(GetParam())) << s.amplified_where;
}

TEST_P(Everywhere, NoValueIsNanInfiniteOrNegative) {
  // More than 1e7 over all models.
  const long calls = std::max<long>(20000, long(1.2e7 * effort() / double(models().size())));
  EXPECT_GE(evaluate_everywhere(model(), calls, 1), calls);
}

/// Rare inputs at which single precision once gave NaN or infinity, and which only long runs find.
TEST(SinglePrecision, StaysFiniteWhereALongHuntFoundFaults) {
  const auto at = [](const std::string& model, const ParamValues& values, const Vec3<float>& wi,
                     const Vec3<float>& wo) {
    const Model& m = find_model(model);
    const auto brdf = m.make_float(complete(m.info(), values));
    EXPECT_TRUE(std::isfinite(brdf->eval(wi, wo).r)) << model << " f=" << brdf->eval(wi, wo).r;
    EXPECT_TRUE(std::isfinite(brdf->pdf(wi, wo))) << model << " pdf=" << brdf->pdf(wi, wo);
  };
  // The pdf of half vectors divided by a cosine of 1e-12.
  at("schlick", {{"rough", 5.3e-33}, {"p", 0.59}}, {-1, 0, 1.1e-12f}, {1, 0, 1.1e-12f});
  // A Gaussian that underflows divided by a norm that does, for the steepest half vectors.
  at("ward", {{"ax", 1.}, {"ay", 0.00325}}, {-0.6f, -0.8f, 2.7e-13f}, {0.6001f, 0.7999f, 1.1e-12f});
}

/// The same for directions that are opposite except for their heights, where half vectors consist of rounding errors.
TEST(SinglePrecision, StaysFiniteBetweenOppositeDirectionsLowAboveTheSurface) {
  const auto sweep = [](const std::string& model, const ParamValues& values) {
    const Model& m = find_model(model);
    const ParamValues all = complete(m.info(), values);
    const auto brdf = m.make_float(all);
    for (int i = 5; i <= 15; ++i)
      for (int o = 5; o <= 15; ++o)
        for (const float azimuth : {0.f, 0.3f, 0.785398f, 1.2f, 1.570796f})
          for (const float turn : {0.f, 1e-7f, 1e-5f, 1e-3f}) {
            const Vec3<float> wo{cos(azimuth), sin(azimuth), pow(10.f, -float(o))};
            const Vec3<float> wi{-cos(azimuth + turn), -sin(azimuth + turn), 5.3f * pow(10.f, -float(i))};
            const float f = brdf->eval(wi, wo).r, pdf = brdf->pdf(wi, wo);
            ASSERT_TRUE(std::isfinite(f) && f >= 0 && std::isfinite(pdf) && pdf >= 0)
                << model << " " << format_values(m.info(), all) << " wi=(" << wi.x << ", " << wi.y << ", " << wi.z
                << ") wo=(" << wo.x << ", " << wo.y << ", " << wo.z << ") f=" << f << " pdf=" << pdf;
          }
  };
  for (int k = 0; k <= 44; ++k)
    for (const double p : {0.01, 0.59, 1.}) sweep("schlick", {{"rough", 5 * std::pow(10., -k - 1)}, {"p", p}});
  for (const char* normalisation : {"bounded", "duer", "ward"})
    for (const double ax : {1e-4, 0.003, 0.1, 1.})
      for (const double ay : {1e-4, 0.003, 0.1, 1.})
        sweep("ward", {{"normalisation", std::string(normalisation)}, {"ax", ax}, {"ay", ay}});
}

TEST_P(Everywhere, SinglePrecisionAndTheRecordedProgramFollow) {
  for (const auto& [decade, row] : single_precision_by_decade(model(), std::max(4, int(40 * effort())), 100, 1)) {
    const double limit = decade <= 5 ? 1e-3 : 1e-2;
    // For such a narrow lobe, the effect of rounding the directions is not the formula's fault.
    EXPECT_LE(row.native, std::max(limit, 4 * row.inherent)) << "1e" << decade << ": " << row.where;
    EXPECT_LE(row.recorded, std::max(limit, 4 * row.inherent)) << "1e" << decade << ": " << row.where;
  }
}

std::string name_itself(const testing::TestParamInfo<std::string>& info) { return info.param; }
INSTANTIATE_TEST_SUITE_P(Models, Everywhere, testing::ValuesIn(model_names()), name_itself);
INSTANTIATE_TEST_SUITE_P(Models, Hunted, testing::ValuesIn(third_of(model_names())), name_itself);

}  // namespace
}  // namespace brdfc::measure
