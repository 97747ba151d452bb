// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/terms.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fit/fit.h"
#include "measure/probes.h"
#include "support.h"

namespace brdfc::fit {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Terms terms_by(const char* model, const std::vector<std::string>& names, const std::vector<std::string>& values = {}) {
  const Model& m = find_model(model);
  ParamValues known = complete(m.info(), parse_values(m.info(), values));
  for (const std::string& name : names) known.erase(name);
  return roles_of(m, known).terms();
}

TEST(Terms, AreFoundByEvaluatingTheModel) {
  const auto names = [](const char* model, const std::vector<std::string>& open,
                        const std::vector<std::string>& values = {}) {
    return terms_by(model, open, values).parameters;
  };
  const auto count = [](const char* model, const std::vector<std::string>& open,
                        const std::vector<std::string>& values = {}) {
    return terms_by(model, open, values).terms.size();
  };
  EXPECT_THAT(names("cook_torrance", {"f0"}), ElementsAre("f0"));
  EXPECT_EQ(count("cook_torrance", {"f0"}), 2u) << "without and with reflectance at normal incidence";
  EXPECT_THAT(names("cook_torrance", {"f0", "m"}), ElementsAre("f0")) << "for any slope";
  EXPECT_EQ(count("oren_nayar", {"rho"}), 2u) << "once and twice reflected";
  EXPECT_THAT(names("oren_nayar", {"rho"}, {"form=qualitative"}), IsEmpty()) << "a factor";
  EXPECT_THAT(names("oren_nayar", {"sigma"}), IsEmpty()) << "no polynomial";
  EXPECT_THAT(names("eon", {"rho", "r"}), ElementsAre("rho")) << "nearly, for any roughness";
  EXPECT_EQ(count("eon", {"rho"}), 2u) << "once and again";
  EXPECT_THAT(names("eon", {"rho"}, {"r=0"}), IsEmpty()) << "a factor";
  EXPECT_EQ(count("ashikhmin_shirley", {"rs", "rd"}), 4u);
  EXPECT_EQ(count("ashikhmin_shirley", {"rd"}), 2u);
  EXPECT_EQ(count("phong_material", {"kd", "ks", "kr", "cd", "cs", "cr"}), 3u) << "a share times a colour each";
  EXPECT_THAT(names("phong_material", {"kd"}, {"ks=0", "kr=0"}), IsEmpty()) << "a factor where nothing else shines";
  EXPECT_EQ(count("schlick_double", {"r0"}), 1u) << "the base of a perfect mirror is black";
  EXPECT_THAT(names("radziszewski_alda", {"n_theta"}), IsEmpty()) << "which it does not depend on";
  EXPECT_THAT(names("glass", {"r0"}), IsEmpty()) << "nothing is scattered";
}

/// For all models, and any values of the parameters that terms are powers of.
TEST(Terms, AddUpToTheModel) {
  int models_with_terms = 0;
  measure::Random random(8);
  for (const auto& [name, model] : models()) {
    const Terms terms = roles_of(*model, {}).terms();
    if (terms.parameters.empty()) continue;
    ++models_with_terms;
    for (int round = 0; round < 8; ++round) {
      ParamValues values = complete(model->info(), {});
      std::map<std::string, Rgb<double>> shares;
      for (const std::string& parameter : terms.parameters) {
        Rgb<double> c(measure::uniform(random), measure::uniform(random), measure::uniform(random));
        if (round == 0) c = Rgb<double>(0.0);
        if (round == 1) c = Rgb<double>(1.0);
        if (model->info().param(parameter)->kind == ParamKind::Number) c = Rgb<double>(c.r);
        shares[parameter] = c;
        values[parameter] = model->info().param(parameter)->kind == ParamKind::Number
                                ? ParamValue(c.r)
                                : ParamValue(std::array<double, 3>{c.r, c.g, c.b});
      }
      const auto brdf = model->make_double(values);
      const std::vector<Rgb<double>> weights = terms.weights(shares);
      ASSERT_EQ(weights.size(), terms.terms.size());
      for (const Rgb<double>& w : weights) EXPECT_GE(std::min({w.r, w.g, w.b}), -2e-6) << name;
      std::vector<std::unique_ptr<Brdf<double>>> of_terms;
      for (const Terms::Term& term : terms.terms) {
        ParamValues there = values;
        for (const auto& [parameter, value] : term.values) there[parameter] = value;
        of_terms.push_back(model->make_double(there));
      }
      for (const auto& [wi, wo] : measure::direction_pairs(*of_terms.back(), 100, random)) {
        Rgb<double> sum(0.0);
        double scale = 1e-12;
        for (std::size_t t = 0; t < weights.size(); ++t) {
          const Rgb<double> f = of_terms[t]->eval(wi, wo) / terms.terms[t].scale;
          sum += f * weights[t];
          scale = std::max(scale, max_component(f));
        }
        const Rgb<double> truth = brdf->eval(wi, wo);
        const double most = (terms.furthest ? kNearlyThere : 1e-9) * scale;
        EXPECT_NEAR(sum.r, truth.r, most) << name;
        EXPECT_NEAR(sum.g, truth.g, most) << name;
        EXPECT_NEAR(sum.b, truth.b, most) << name;
      }
    }
  }
  EXPECT_GE(models_with_terms, 7);
}

}  // namespace
}  // namespace brdfc::fit
