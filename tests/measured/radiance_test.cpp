// SPDX-License-Identifier: GPL-3.0-or-later
// Matrices over patches, and tensor trees: where their numbers are, and what is in between.
#include <gtest/gtest.h>

#include <random>

#include "measured/patches.h"
#include "measured/tensor_tree.h"

namespace brdfc::measured {
namespace {

/// The direction in the middle of each patch, or about it.
struct Middle {
  double theta, phi;
};
std::vector<Middle> middles(const Patches& patches) {
  std::vector<Middle> out;
  for (const Patches::Ring& ring : patches.rings())
    for (std::size_t k = 0; k < ring.number; ++k)
      out.push_back({ring.number == 1 ? 0 : (ring.from + ring.to) / 2, 360 * double(k) / double(ring.number)});
  return out;
}

TEST(Patches, AreThosePublished) {
  std::vector<std::size_t> sizes;
  for (const Patches& patches : Patches::known()) sizes.push_back(patches.size());
  EXPECT_EQ(sizes, (std::vector<std::size_t>{145, 77, 73, 41, 41}));
  EXPECT_NEAR(Patches::known()[0].widest(), 30 * std::sin(82.5 * kPi / 180), 1e-9);
}

TEST(Patches, AMiddleIsInItsPatchAndHasItsValue) {
  for (const Patches& patches : Patches::known()) {
    std::size_t k = 0;
    for (const Middle& at : middles(patches)) {
      for (const double turn : {-360., 0., 360.}) {
        EXPECT_EQ(patches.patch(at.theta, at.phi + turn), k);
        const Patches::Around around = patches.around(at.theta, at.phi + turn);
        double own = 0, all = 0;
        for (std::size_t i = 0; i < 4; ++i) {
          all += around.weight[i];
          if (around.patch[i] == k) own += around.weight[i];
        }
        EXPECT_NEAR(own, 1, 1e-9) << patches.name() << " " << k;
        EXPECT_NEAR(all, 1, 1e-12);
      }
      ++k;
    }
  }
}

TEST(Patches, ABorderBelongsToThePatchAfterIt) {
  const Patches& full = Patches::known()[0];
  EXPECT_EQ(full.patch(4.999, 200), 0u);
  EXPECT_EQ(full.patch(5, 0), 1u);
  EXPECT_EQ(full.patch(10, 22.49), 1u);
  EXPECT_EQ(full.patch(10, 22.51), 2u);
  EXPECT_EQ(full.patch(10, -22.49), 1u);
  EXPECT_EQ(full.patch(90, 359.9), 133u);
}

/// Three rings, so that a test can look at every pair of patches closely.
Patches few() { return Patches("few", {{0, 30, 1}, {30, 60, 4}, {60, 90, 3}}); }

std::vector<std::array<float, 3>> random_means(std::size_t size) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> any(0, 1);
  std::vector<std::array<float, 3>> out(size * size);
  for (auto& value : out)
    for (float& v : value) v = any(random) < 0.2f ? 0 : any(random);
  return out;
}

TEST(PatchMatrix, PatchesKeepTheirMeans) {
  const Patches patches = few();
  const auto means = random_means(patches.size());
  const PatchMatrix matrix(patches, means);
  // Places in each patch with their weights, the projected solid angle.
  // With 12 azimuths no kink of the interpolation is between two places.
  constexpr int kThetas = 16, kPhis = 12;
  struct Place {
    Middle at;
    double weight;
  };
  std::vector<std::vector<Place>> places;
  for (const Patches::Ring& ring : patches.rings())
    for (std::size_t k = 0; k < ring.number; ++k) {
      places.emplace_back();
      double all = 0;
      for (int t = 0; t < kThetas; ++t) {
        const double theta = ring.from + (ring.to - ring.from) * (t + 0.5) / kThetas,
                     weight = std::sin(2 * theta * kPi / 180);
        for (int p = 0; p < kPhis; ++p) {
          const double phi = 360 * (double(k) - 0.5 + (p + 0.5) / kPhis) / double(ring.number);
          places.back().push_back({{theta, phi}, weight});
          all += weight;
        }
      }
      for (Place& place : places.back()) place.weight /= all;
    }
  for (std::size_t i = 0; i < patches.size(); ++i)
    for (std::size_t o = 0; o < patches.size(); ++o) {
      Rgb<double> sum(0);
      for (const auto& [a, weight_a] : places[i])
        for (const auto& [b, weight_b] : places[o])
          sum += matrix.eval(a.theta, a.phi, b.theta, b.phi) * (weight_a * weight_b);
      const auto& expected = means[i * patches.size() + o];
      EXPECT_NEAR(sum.r, double(expected[0]), 2e-3) << i << " " << o;
      EXPECT_NEAR(sum.g, double(expected[1]), 2e-3) << i << " " << o;
      EXPECT_NEAR(sum.b, double(expected[2]), 2e-3) << i << " " << o;
    }
}

TEST(PatchMatrix, AConstantIsOne) {
  for (const Patches& patches : Patches::known()) {
    const PatchMatrix matrix(patches,
                             std::vector<std::array<float, 3>>(patches.size() * patches.size(), {0.25f, 0.5f, 1e-20f}));
    for (int k = 0; k < 200; ++k) {
      const Rgb<double> f = matrix.eval(0.45 * k, 17. * k, 90 - 0.4 * k, -31. * k);
      EXPECT_NEAR(f.r, 0.25, 1e-6);
      EXPECT_NEAR(f.g, 0.5, 1e-6);
      EXPECT_NEAR(f.b, 1e-20, 1e-26);
    }
  }
}

TEST(PatchMatrix, AMirrorReflectsTheSameFromAllViewsOfAPatch) {
  const Patches& patches = Patches::known()[0];
  const std::size_t size = patches.size();
  std::vector<std::array<float, 3>> means(size * size);
  for (std::size_t i = 0; i < size; ++i) means[i * size + i] = {1, 1, 1};
  const PatchMatrix matrix(patches, std::move(means));
  // The mean over an outgoing patch, from the middle of an incident one and from near its corner.
  const auto reflected = [&](double theta, double phi) {
    double sum = 0, all = 0;
    for (int t = 0; t < 20; ++t)
      for (int p = 0; p < 20; ++p) {
        const double theta_o = 35 + 10 * (t + 0.5) / 20, weight = std::sin(2 * theta_o * kPi / 180);
        sum += weight * matrix.eval(theta, phi, theta_o, 15 * ((p + 0.5) / 20 - 0.5)).r;
        all += weight;
      }
    return sum / all;
  };
  EXPECT_NEAR(reflected(40, 0), 1, 0.15);
  EXPECT_NEAR(reflected(44, 6), 1, 0.15);
}

TEST(PatchMatrix, ADarkPatchStaysDark) {
  const Patches patches = few();
  const std::size_t size = patches.size();
  std::vector<std::array<float, 3>> means(size * size, {1, 1, 1});
  means[2 * size + 3] = {};
  const PatchMatrix matrix(patches, std::move(means));
  for (const double theta : {31., 45., 59.})
    for (const double phi : {-40., 0., 40.}) EXPECT_EQ(matrix.eval(theta, 90 + phi, 45, 180 + phi).r, 0);
  EXPECT_GT(matrix.eval(45, 90, 45, 90).r, 0);
}

TensorTree tree_of(const std::string& text, std::size_t dimensions) {
  return TensorTree(NumberText(text, "tree"), dimensions);
}

TEST(TensorTree, BranchesAndGridsAreInTheirOrder) {
  // Bit d of a branch is the half of dimension d; of a grid the last dimension runs fastest.
  const TensorTree tree = tree_of("{{1}{2}{3}{4}{5}{6}{7}\n{ 10 11, 12 13,14 15 16\t17 }}", 3);
  EXPECT_EQ(tree.size(), 15u);
  EXPECT_EQ(tree.finest(), 4u);
  EXPECT_EQ(tree.at({0.9, 0.1, 0.1}), 2);
  EXPECT_EQ(tree.at({0.1, 0.9, 0.1}), 3);
  EXPECT_EQ(tree.at({0.1, 0.1, 0.9}), 5);
  EXPECT_EQ(tree.at({0.6, 0.6, 0.9}), 11);
  EXPECT_EQ(tree.at({0.6, 0.9, 0.6}), 12);
  EXPECT_EQ(tree.at({0.9, 0.6, 0.6}), 14);
  EXPECT_EQ(tree.at({1, 1, 1}), 17);
  EXPECT_EQ(tree.largest(), 17);
  std::size_t cells = 0;
  tree.for_each([&](const TensorTree::Place& at, float value) {
    EXPECT_EQ(tree.at(at), value);
    ++cells;
  });
  EXPECT_EQ(cells, 15u);
}

TEST(TensorTree, WhatIsWrongIsSaid) {
  const auto said = [](const std::string& text) -> std::string {
    try {
      tree_of(text, 3);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(said("{1}"), "");
  EXPECT_EQ(said(""), "tree: expected '{' after 0 numbers, found the end: truncated?");
  // A message has one line.
  EXPECT_EQ(said("{ {1} #ALTA\nmore }"), "tree: expected '{' after 1 number, found '#ALTA'");
  EXPECT_EQ(said("{{1}{2}"), "tree: expected '{' after 2 numbers, found the end: truncated?");
  EXPECT_EQ(said("{1 2 3 4 5 6 7"), "tree: expected 1, 8, 64 or so numbers in braces, n x n x n cells, found 7");
  EXPECT_EQ(said("{1}{2}"), "tree: expected nothing after the closing brace, found '{2}'");
  EXPECT_EQ(said("{nan}"), "tree: number 1: expected a finite number up to 1e+30, got 'nan'");
  EXPECT_EQ(said("{1e31}"), "tree: number 1: expected a finite number up to 1e+30, got '1e31'");
  EXPECT_NE(said(std::string(1000, '{')).find("at most 17 braces in each other"), std::string::npos);
  EXPECT_EQ(tree_of("{-1}", 4).negative(), 1u);
  EXPECT_EQ(tree_of("{-1}", 4).at({}), 0);
}

TEST(SquareOfDisk, KeepsAreasAndFillsTheSquare) {
  // Points spread evenly over the disk are spread evenly over the square.
  constexpr int kRings = 300, kCells = 6;
  std::array<double, kCells * kCells> share{};
  for (int r = 0; r < kRings; ++r)
    for (int p = 0; p < kRings; ++p) {
      const double radius = std::sqrt((r + 0.5) / kRings), phi = 2 * kPi * (p + 0.5) / kRings;
      const auto at = square_of_disk(radius * std::cos(phi), radius * std::sin(phi));
      ASSERT_TRUE(at[0] >= 0 && at[0] <= 1 && at[1] >= 0 && at[1] <= 1);
      share[std::size_t(at[0] * kCells) * kCells + std::size_t(at[1] * kCells)] += 1. / (kRings * kRings);
    }
  for (const double s : share) EXPECT_NEAR(s, 1. / (kCells * kCells), 1e-3);
  // The axes are as in Shirley's and Chiu's figure.
  EXPECT_EQ(square_of_disk(1, 0), (std::array<double, 2>{1, 0.5}));
  EXPECT_NEAR(square_of_disk(0, 1)[1], 1, 1e-12);
  EXPECT_NEAR(square_of_disk(-1, 0)[0], 0, 1e-12);
  EXPECT_NEAR(square_of_disk(0, -1)[1], 0, 1e-12);
  const auto corner = square_of_disk(std::sqrt(0.5), -std::sqrt(0.5));
  EXPECT_NEAR(corner[0], 1, 1e-9);
  EXPECT_NEAR(corner[1], 0, 1e-9);
}

}  // namespace
}  // namespace brdfc::measured
