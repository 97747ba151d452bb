// SPDX-License-Identifier: GPL-3.0-or-later
// Tables with one axis as polynomials.
#include "print/node_table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "trace/program.h"

namespace brdfc::print {
namespace {

template <class F> std::shared_ptr<const Table> table_of(const F& f) {
  std::vector<double> values;
  for (int i = 0; i < 257; ++i) values.push_back(f(i / 256.));
  return make_table("some", {even_axis("x", 257)}, values);
}

TEST(NodeTable, OfOneSmoothAxisIsAPolynomial) {
  const auto f = [](double x) { return std::exp(x) / (1 + x); };
  const auto polynomial = polynomial_of(*table_of(f));
  ASSERT_TRUE(polynomial);
  Recorder recorder;
  Program program;
  program.output("y", polynomial_at(*polynomial, Expr::input("x")));
  for (const double x : {0., 0.01, 0.3, 0.77, 1.}) {
    Inputs<float> inputs;
    set_input(inputs, "x", x);
    EXPECT_NEAR(double(program.run<float>(inputs).at("y")[0]), f(x), 2.1e-4 * f(x));
  }
  Inputs<float> beyond;
  set_input(beyond, "x", 1.5);
  EXPECT_NEAR(double(program.run<float>(beyond).at("y")[0]), f(1), 1e-3);
}

TEST(NodeTable, OfAKinkOrOfSeveralAxesIsNone) {
  EXPECT_FALSE(polynomial_of(*table_of([](double x) { return 1 + std::abs(x - 0.3); })));
  EXPECT_FALSE(polynomial_of(*make_table("two", {even_axis("x", 2), even_axis("y", 2)}, {1, 1, 1, 1})));
}

}  // namespace
}  // namespace brdfc::print
