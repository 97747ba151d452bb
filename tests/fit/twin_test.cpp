// SPDX-License-Identifier: GPL-3.0-or-later
// Twins come as close to their models as they say, with weights that Blender's nodes take.
#include "fit/twin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "forms/form.h"
#include "support.h"

namespace brdfc::fit {
namespace {

struct Row {
  const char* model;
  std::vector<std::string> values;
  double median;  ///< relative L1 over views, a quarter above what was measured
};
const Row kRows[] = {{"blinn", {"e=100"}, 0.017}, {"phong", {"ks=0.9,0.5,0.1", "e=50"}, 0.05}, {"coupled", {}, 0.048}};

const Twin& twin_of_row(const Row& row) {
  const Model& m = find_model(row.model);
  return twin_of(m, values_of(m, row.values));
}

TEST(Twin, ComesAsCloseAsMeasured) {
  for (const Row& row : kRows) {
    std::vector<double> l1;
    for (const ViewError& e : twin_of_row(row).errors()) {
      l1.push_back(e.relative_l1);
      EXPECT_EQ(e.negative, 0) << row.model << " at " << e.cos_theta_o;
    }
    std::sort(l1.begin(), l1.end());
    EXPECT_LE(l1[l1.size() / 2], row.median) << row.model;
  }
}

/// By another quadrature: a grid over heights and azimuths.
TEST(Twin, StatesItsError) {
  const Row& row = kRows[1];
  const Model& m = find_model(row.model);
  const auto brdf = m.make_double(values_of(m, row.values));
  const Twin& twin = twin_of_row(row);
  for (const std::size_t k : {5u, 30u, 50u}) {
    const ViewError& e = twin.errors()[k];
    const Vec3<double> wo = direction(e.cos_theta_o, 0);
    const ClosureSum<double> sum = twin.closures(wo);
    double difference = 0, albedo = 0, of_twin = 0;
    constexpr int kHeights = 600, kTurns = 600;
    for (int i = 0; i < kHeights; ++i)
      for (int j = 0; j < kTurns; ++j) {
        const double theta = (i + 0.5) / kHeights * kPi / 2;
        const Vec3<double> wi = direction(std::cos(theta), (j + 0.5) / kTurns * 2 * kPi);
        const double w = std::sin(theta), f = brdf->eval(wi, wo).r * wi.z, t = evaluate(sum, wi, wo).r;
        difference += w * std::abs(t - f);
        albedo += w * f;
        of_twin += w * t;
      }
    EXPECT_NEAR(difference / albedo, e.relative_l1, 0.1 * e.relative_l1 + 5e-4) << e.cos_theta_o;
    EXPECT_NEAR(of_twin / albedo, 1, 0.01) << e.cos_theta_o;
  }
}

TEST(Twin, TakesWhatNodesAccept) {
  for (const Row& row : kRows) {
    const Model& m = find_model(row.model);
    const auto j = nlohmann::json::parse(forms::form("twin")->write(m, {}, {values_of(m, row.values)}).source);
    for (const auto& closure : j.at("closures")) {
      for (const auto& channel : closure.at("weight")) {
        ASSERT_EQ(channel.size(), std::size_t(kTwinKnots));
        for (const double w : channel) EXPECT_GE(w, 0) << row.model;
      }
      if (!closure.contains("roughness")) continue;
      for (const double r : closure.at("roughness")) EXPECT_TRUE(r > 0 && r <= 1) << row.model << " " << r;
    }
    // A mirror beside it has a colour of its own.
    EXPECT_EQ(j.at("albedo").size(), m.has_mirror() ? 3u : 1u) << row.model;
    EXPECT_EQ(j.at("closures").back().at("kind") == "mirror", m.has_mirror()) << row.model;
  }
}

}  // namespace
}  // namespace brdfc::fit
