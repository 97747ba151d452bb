// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/sampling.h"

#include <gtest/gtest.h>

namespace brdfc {
namespace {

/// Newton's method for v^2 = 2 from 1, where the value is off by a rounding error of its own, as where a compiler fuses
/// a product with a sum.
double root_of_two(double error) {
  std::array<double, 3> state{0, 2, 1};
  for (int i = 0; i < 8; ++i) state = bracketed_newton(state, state[2] * state[2] - 2 + error, 2 * state[2]);
  return state[2];
}

// The last steps used to leave the bracket by rounding, and jump to its middle.
TEST(Sampling, BracketedNewtonStaysAtARootThatIsRounded) {
  for (const double error : {0., 3e-16, -3e-16, 4e-16, -4e-16, 1e-9, -1e-9})
    EXPECT_NEAR(root_of_two(error), std::sqrt(2), 1e-9) << error;
  // Away from the root, below and above.
  for (const double v : {1.4, 1.42}) {
    const auto next = bracketed_newton<double>({v, v, v}, 1e-17, 1.);
    EXPECT_NEAR(next[2], v, 1e-15);
  }
}

TEST(Sampling, BracketedNewtonHalvesTheBracketWhereAStepLeavesIt) {
  const auto next = bracketed_newton<double>({0, 2, 1}, -1., 1e-3);
  EXPECT_EQ(next, (std::array<double, 3>{1, 2, 1.5}));
}

}  // namespace
}  // namespace brdfc
