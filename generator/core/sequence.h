// SPDX-License-Identifier: GPL-3.0-or-later
// Low-discrepancy sequences: points that cover a square or a cube more evenly than random ones.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/vec.h"

namespace brdfc::inline core {

struct Point2 {
  double x = 0, y = 0;
};

/// The fractional part of a number.
inline double wrap(double u) { return u - std::floor(u); }

/// Points in [0, 1)^3: an additive recurrence on powers of 1 / x, where x > 1 is the root of x^4 = x + 1 (the analogue
/// of the plastic number in three dimensions), with an offset drawn from the seed.
class Sequence3 {
 public:
  explicit Sequence3(std::uint64_t seed);
  Vec3<double> next();

 private:
  Vec3<double> state_;
};

/// The same in [0, 1)^2, with the plastic number.
class Sequence2 {
 public:
  explicit Sequence2(std::uint64_t seed);
  Point2 next();

 private:
  Point2 state_;
};

}  // namespace brdfc::inline core
