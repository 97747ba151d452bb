// SPDX-License-Identifier: GPL-3.0-or-later
// Tables: interpolation, arithmetic, and rows of files.
#include "tables/table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/error.h"
#include "tables/algebra.h"
#include "tables/table_file.h"

namespace brdfc {
namespace {

Table grid() {
  Table t;
  t.axes = {{"a", AxisScale::Linear, {0, 1, 4}}, {"b", AxisScale::Log1p, {0, 9, 99}}};
  t.values = {0, 1, 2, 10, 11, 12, 40, 41, 42};
  t.error = 0.25;
  return t;
}

Table random_grid(int channels) {
  Table t = grid();
  t.axes.push_back(even_axis("c", 4));
  t.channels = channels;
  std::vector<double> values;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (int i = 0; i < 3 * 3 * 4 * channels; ++i) values.push_back(double(uniform(random)));
  t.values = values;
  return t;
}

void expect_near(const Rgb<double>& a, const Rgb<double>& b, double tolerance) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
}

TEST(Tables, InterpolationMeetsKnotsAndIsConstantBeyondTheEnds) {
  const Table t = grid();
  EXPECT_NEAR(interpolate(t, {1, 9}).r, 11, 1e-12);
  EXPECT_NEAR(interpolate(t, {2.5, 0}).r, 25, 1e-12);
  EXPECT_NEAR(interpolate(t, {4, std::sqrt(10.) * 10 - 1}).r, 41.5, 1e-12);
  EXPECT_NEAR(interpolate(t, {-5, 1e9}).r, 2, 1e-12);
  EXPECT_NEAR(interpolate(t, {77, -1}).r, 40, 1e-12);
}

TEST(Tables, FormulasLookUpWhatInterpolationGives) {
  const auto t = make_table("t", {even_axis("x", 3), even_axis("y", 2)}, {0, 1, 4, 10, 11, 14});
  for (const double x : {-1., 0., 0.3, 0.5, 0.9, 1., 2.})
    for (const double y : {0., 0.4, 1.})
      EXPECT_NEAR(lookup(t, std::array<double, 2>{x, y}), interpolate(*t, {x, y}).r, 1e-14);
}

TEST(Tables, ValuesMayBeComputedWhenTheyAreFirstRead) {
  int computed = 0;
  const auto t = make_table_later("t", {even_axis("x", 3)}, [&] {
    ++computed;
    return std::vector<double>{0, 1, 4};
  });
  const Table copy = *t;
  EXPECT_EQ(t->axes.size(), 1);
  EXPECT_EQ(computed, 0);
  EXPECT_EQ(lookup(t, std::array<double, 1>{0.75}), 2.5);
  EXPECT_EQ(interpolate(copy, {0.75}).r, 2.5);
  EXPECT_EQ(computed, 1);
  const auto few = make_table_later("t", {even_axis("x", 3)}, [] { return std::vector<double>{0, 1}; });
  EXPECT_THROW(interpolate(*few, {0.5}), std::logic_error);
  EXPECT_THROW(make_table_later("t", {even_axis("x", 1)}, [] { return std::vector<double>{0}; }), std::logic_error);
}

TEST(Tables, OnlyEvenAxesAreLookedUpByFormulas) {
  const auto uneven = make_table("t", {{"x", AxisScale::Linear, {0, 0.2, 1}}}, {0, 1, 2});
  EXPECT_THROW(lookup(uneven, std::vector<double>{0.5}), std::logic_error);
  const auto constant = make_table("t", {}, {7});
  EXPECT_THROW(lookup(constant, std::vector<double>{}), std::logic_error);
  EXPECT_EQ(interpolate(*constant, {}).g, 7);
  EXPECT_THROW(make_table("t", {even_axis("x", 3)}, {0, 1}), std::logic_error);
}

TEST(Tables, ASliceIsTheTableThere) {
  for (const int channels : {1, 3}) {
    const Table t = random_grid(channels), cut = sliced(t, {{"b", 20}, {"nothing", 1}});
    ASSERT_EQ(cut.axes.size(), 2u);
    EXPECT_EQ(cut.axes[1].name, "c");
    EXPECT_EQ(cut.error, t.error);
    for (const double a : {0., 0.7, 3.})
      for (const double c : {0.1, 0.5}) expect_near(interpolate(cut, {a, c}), interpolate(t, {a, 20, c}), 1e-6);
    const Table all = sliced(t, {{"a", 2}, {"b", 20}, {"c", 0.4}});
    EXPECT_TRUE(all.axes.empty());
    expect_near(interpolate(all, {}), interpolate(t, {2, 20, 0.4}), 1e-6);
  }
}

TEST(Tables, APartIsTheTableBetweenItsKnots) {
  const Table t = random_grid(3);
  const Table uneven = part(t, 0, 1, 2);
  expect_near(interpolate(uneven, {2, 20, 0.4}), interpolate(t, {2, 20, 0.4}), 1e-12);
  // Evenly spaced axes are rescaled to 0 to 1: knots 1 to 3 of 0 to 3.
  const Table even = part(t, 2, 1, 3);
  EXPECT_EQ(even.axes[2], even_axis("c", 3));
  expect_near(interpolate(even, {2, 20, 0.25}), interpolate(t, {2, 20, 1 / 3. + 0.25 * 2 / 3}), 1e-12);
}

TEST(Tables, SumsAndProductsAreThoseOfTheirValues) {
  const Table grey = random_grid(1), colored = random_grid(3);
  Table sum = grey;
  add(sum, colored);
  EXPECT_EQ(sum.channels, 3);
  EXPECT_EQ(sum.error, grey.error + colored.error);
  const std::vector<double> x = {2, 20, 0.4};
  expect_near(interpolate(sum, x), interpolate(grey, x) + interpolate(colored, x), 1e-6);
  Table product = grey;
  multiply(product, Rgb<double>(0.5, 0.5, 0.5));
  EXPECT_EQ(product.channels, 1);
  multiply(product, Rgb<double>(1, 0.5, 0));
  EXPECT_EQ(product.channels, 3);
  expect_near(interpolate(product, x), interpolate(grey, x) * Rgb<double>(0.5, 0.25, 0), 1e-6);
  Table rest = grey;
  subtract_from(1, rest);
  expect_near(interpolate(rest, x), Rgb<double>(1.0) - interpolate(grey, x), 1e-6);
  Table other = grid();
  EXPECT_THROW(add(other, grey), std::logic_error);
}

TEST(Tables, RowsOfAnImageAreTables) {
  const Table grey = random_grid(1), colored = random_grid(3), small = grid();
  const TableImage image = image_of({&grey, &small, &colored});
  EXPECT_EQ(image.width, 36);
  EXPECT_EQ(image.height, 3);
  EXPECT_EQ(image.channels, 3);
  EXPECT_EQ(values_in(image, 0, 36, 1), grey.values);
  EXPECT_EQ(values_in(image, 1, 9, 1), small.values);
  EXPECT_EQ(values_in(image, 2, 36, 3), colored.values);
  EXPECT_EQ(values_in(image, 3, 1, 1), std::nullopt);
  EXPECT_EQ(values_in(image, 0, 37, 1), std::nullopt);
  EXPECT_EQ(values_in(image, 0, 36, 4), std::nullopt);
}

}  // namespace
}  // namespace brdfc
