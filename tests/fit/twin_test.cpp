// SPDX-License-Identifier: GPL-3.0-or-later
// Twins approximate their models as well as they claim, with weights that Blender's nodes accept.
#include "fit/twin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "fit/roles.h"
#include "fit/settings.h"
#include "forms/form.h"
#include "model/stand_in.h"
#include "support.h"

namespace brdfc::fit {
namespace {

struct TwinRow {
  const char* model;
  std::vector<std::string> values;
  double median;  ///< median of the relative L1 error over views, 25 % above the measured value
};
const TwinRow kTwinRows[] = {
    {"blinn", {"e=100"}, 0.017}, {"phong", {"ks=0.9,0.5,0.1", "e=50"}, 0.05}, {"coupled", {}, 0.048}};

const Twin& twin_of_row(const TwinRow& row) {
  const Model& m = find_model(row.model);
  return twin_of(m, values_of(m, row.values));
}

TEST(Twin, ComesAsCloseAsMeasured) {
  for (const TwinRow& row : kTwinRows) {
    std::vector<double> l1;
    for (const ViewError& e : twin_of_row(row).errors()) {
      l1.push_back(e.relative_l1);
      EXPECT_EQ(e.negative, 0) << row.model << " at " << e.cos_theta_o;
    }
    std::sort(l1.begin(), l1.end());
    EXPECT_LE(l1[l1.size() / 2], row.median) << row.model;
  }
}

/// Relative L1 error, and albedo relative to the model's, in the red channel, by another quadrature: a grid over
/// heights and azimuths.
std::array<double, 2> by_grid(const Brdf<double>& brdf, const ClosureSum<double>& sum, const Vec3<double>& wo) {
  double difference = 0, albedo = 0, of_twin = 0;
  constexpr int kHeights = 600, kTurns = 600;
  for (int i = 0; i < kHeights; ++i)
    for (int j = 0; j < kTurns; ++j) {
      const double theta = (i + 0.5) / kHeights * kPi / 2;
      const Vec3<double> wi = direction(std::cos(theta), (j + 0.5) / kTurns * 2 * kPi);
      const double w = std::sin(theta), f = brdf.eval(wi, wo).r * wi.z, t = evaluate(sum, wi, wo).r;
      difference += w * std::abs(t - f);
      albedo += w * f;
      of_twin += w * t;
    }
  return {difference / albedo, of_twin / albedo};
}

TEST(Twin, StatesItsError) {
  const TwinRow& row = kTwinRows[1];
  const Model& m = find_model(row.model);
  const auto brdf = m.make_double(values_of(m, row.values));
  const Twin& twin = twin_of_row(row);
  for (const std::size_t k : {5u, 30u, 50u}) {
    const ViewError& e = twin.errors()[k];
    const Vec3<double> wo = direction(e.cos_theta_o, 0);
    const auto [l1, albedo] = by_grid(*brdf, twin.closures(wo), wo);
    EXPECT_NEAR(l1, e.relative_l1, 0.1 * e.relative_l1 + 5e-4) << e.cos_theta_o;
    EXPECT_NEAR(albedo, 1, 0.01) << e.cos_theta_o;
  }
}

/// For the twins of the extension, between two rows of their tables, with mixed parameters at the worst of the values
/// that are evaluated.
TEST(Twin, StatesItsErrorAlongANumber) {
  for (const char* name : {"max_phong", "cook_torrance", "schlick", "eon"}) {
    const Model& m = find_model(name);
    const ParamValues given = forms::form("twin")->values(m, {});
    const Twin& twin = twin_of(m, given);
    ASSERT_TRUE(twin.axis()) << name;
    const std::size_t views = kViewSettings.error_views;
    for (const std::size_t k : {4 * views + 7, 9 * views + 20, 12 * views + 40}) {
      const ViewError& e = twin.errors().at(k);
      const Vec3<double> wo = direction(e.cos_theta_o, 0);
      double worst = 0;
      for (const ParamValues& mixed : twin.terms().judged()) {
        ParamValues values = roles_of(m, given).fitted_at(e.number);
        for (const auto& [parameter, value] : mixed) values[parameter] = value;
        const auto brdf = m.make_double(values);
        const auto [l1, albedo] = by_grid(*brdf, twin.closures(wo, varied_of(twin.axis(), twin.terms(), values)), wo);
        worst = std::max(worst, l1);
      }
      EXPECT_NEAR(worst, e.relative_l1, 0.1 * e.relative_l1 + 1e-3) << name << " " << e.number << " " << e.cos_theta_o;
    }
  }
}

/// script/fits stores one for each model that has a twin with tables in the extension.
TEST(Twin, IsKept) {
  for (const auto& [name, model] : models()) {
    const forms::Form& form = *forms::form("twin");
    if (!form.in_whole_pack(*model) || stand_in(*model)) continue;
    EXPECT_TRUE(std::filesystem::exists(stored_twin(*model, form.values(*model, {})).path())) << name;
  }
}

TEST(Twin, TakesWhatNodesAccept) {
  for (const TwinRow& row : third_of(kTwinRows)) {
    const Model& m = find_model(row.model);
    const auto j = nlohmann::json::parse(forms::form("twin")->write(m, {}, {values_of(m, row.values)}).source);
    for (const auto& closure : j.at("closures")) {
      // Without an axis and mixed parameters, there is one term with one row.
      ASSERT_EQ(closure.at("weight").size(), 1u);
      for (const auto& channel : closure.at("weight")[0]) {
        ASSERT_EQ(channel.size(), 1u);
        ASSERT_EQ(channel[0].size(), std::size_t(kTwinKnots));
        for (const double w : channel[0]) EXPECT_GE(w, 0) << row.model;
      }
      if (!closure.contains("roughness")) continue;
      for (const double r : closure.at("roughness")[0]) EXPECT_TRUE(r > 0 && r <= 1) << row.model << " " << r;
    }
    // A mirror has its own colour.
    EXPECT_EQ(j.at("albedo")[0].size(), m.has_mirror() ? 3u : 1u) << row.model;
    EXPECT_EQ(j.at("closures").back().at("kind") == "mirror", m.has_mirror()) << row.model;
  }
}

}  // namespace
}  // namespace brdfc::fit
