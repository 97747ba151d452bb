// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/sequence.h"

#include <random>

namespace brdfc::inline core {

Sequence3::Sequence3(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  state_.x = uniform(random);
  state_.y = uniform(random);
  state_.z = uniform(random);
}

Vec3<double> Sequence3::next() {
  constexpr double g = 1.22074408460575947536;  // g^4 = g + 1
  const Vec3<double> u = state_;
  state_ = {wrap(state_.x + 1 / g), wrap(state_.y + 1 / (g * g)), wrap(state_.z + 1 / (g * g * g))};
  return u;
}

Sequence2::Sequence2(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  state_.x = uniform(random);
  state_.y = uniform(random);
}

Point2 Sequence2::next() {
  constexpr double g = 1.32471795724474602596;  // g^3 = g + 1
  const Point2 u = state_;
  state_ = {wrap(state_.x + 1 / g), wrap(state_.y + 1 / (g * g))};
  return u;
}

}  // namespace brdfc::inline core
