// SPDX-License-Identifier: GPL-3.0-or-later
// The mean light of a lamp over a cone of directions, against sums over many directions.
#include "forms/node_light.h"

#include <gtest/gtest.h>

#include "measure/probes.h"

namespace brdfc::forms {
namespace {

/// The mean over the directions of a cone of this radius, as a chord, about an axis with this cosine to the z axis.
template <class Light> double over_cone(double cosine, double chord, const Light& light) {
  constexpr int kSteps = 64;
  const double sine = std::sqrt(1 - cosine * cosine);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double drop = (i + 0.5) / kSteps * chord * chord / 2, away = std::sqrt(drop * (2 - drop));
      sum += light(cosine * (1 - drop) + sine * away * std::cos(2 * kPi * (j + 0.5) / kSteps));
    }
  return sum / (kSteps * kSteps);
}

struct Errors {
  double squares = 0, worst = 0;
  int count = 0;

  void add(double error) { squares += error * error, worst = std::max(worst, std::abs(error)), ++count; }
  double rms() const { return std::sqrt(squares / count); }
};

TEST(NodeLight, TheMeanOfASpotsLight) {
  for (const auto& [widest, rms, worst] : {std::array{0.3, 0.0045, 0.03}, {0.6, 0.0065, 0.035}}) {
    measure::Random random(5);
    Errors errors;
    for (int i = 0; i < 4000; ++i) {
      const double half = 0.1 + 0.685 * measure::uniform(random), blend = 1e-4 + measure::uniform(random);
      const double chord = 0.01 + (widest - 0.01) * measure::uniform(random);
      const double cosine = std::cos((1.1 * half + chord) * measure::uniform(random)), edge = std::cos(half);
      const SpotCone<double> spot{true, edge, std::min(blend, 1.0) * (1 - edge)};
      errors.add(spot.mean(cosine, chord) - over_cone(cosine, chord, [&](double c) { return spot.light(c); }));
    }
    EXPECT_LT(errors.rms(), rms) << widest;
    EXPECT_LT(errors.worst, worst) << widest;
  }
}

/// Cones that are no wider than the light of the lamp, whose Spread is 30 to 160 degrees.
TEST(NodeLight, TheMeanOfASpreadsLight) {
  measure::Random random(6);
  Errors errors;
  for (int i = 0; i < 4000; ++i) {
    const double half = kPi / 180 * (15 + 65 * measure::uniform(random));
    const double chord = std::min(half, 0.7) * (0.02 + 0.98 * measure::uniform(random));
    const double cosine = std::cos(half * measure::uniform(random));
    LampSlot<double> slot{};
    slot.kind = 3 + 0.499 - 0.998 * half / kPi;
    LampAxes<double> lamp{};
    lamp.away = {0, 0, 1};
    const Spread<double> spread = spread_of(slot);
    const auto light = [&](double c) { return c > 0 ? spread.light(c) : 0; };
    const Vec3<double> axis{std::sqrt(1 - cosine * cosine), 0, cosine};
    errors.add(mean_light(slot, lamp, axis, chord) - over_cone(cosine, chord, light));
  }
  EXPECT_LT(errors.rms(), 0.007);
  EXPECT_LT(errors.worst, 0.042);
}

}  // namespace
}  // namespace brdfc::forms
