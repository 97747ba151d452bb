// SPDX-License-Identifier: GPL-3.0-or-later
// Low-discrepancy sequences: points that fill a square or a cube more evenly than random ones.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/vec.h"

namespace brdfc::inline core {

struct Point2 {
  double x = 0, y = 0;
};

/// What is left of a number without its integer part.
inline double wrap(double u) { return u - std::floor(u); }

/// In [0, 1)^3: additive recurrence on the powers of the plastic number's sister in three
/// dimensions (root of x^4 = x + 1), shifted by numbers drawn from the seed.
class Sequence3 {
 public:
  explicit Sequence3(std::uint64_t seed);
  Vec3<double> next();

 private:
  Vec3<double> state_;
};

/// The same in [0, 1)^2, on the plastic number.
class Sequence2 {
 public:
  explicit Sequence2(std::uint64_t seed);
  Point2 next();

 private:
  Point2 state_;
};

}  // namespace brdfc::inline core
