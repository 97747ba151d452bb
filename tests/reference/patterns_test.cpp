// SPDX-License-Identifier: GPL-3.0-or-later
// The defining property of each sampling pattern, and the benefit of patterns with a lobe.
#include "reference/patterns.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <numeric>
#include <set>

#include "reference/procedural.h"
#include "reference/scene.h"

namespace brdfc::reference {
namespace {

using Point2 = std::array<double, 2>;

std::vector<Point2> points(Pattern pattern, int count, std::uint64_t key) {
  const PatternPoints p(pattern, count);
  std::vector<Point2> out;
  for (int i = 0; i < count; ++i) out.push_back(p.point(i, key));
  return out;
}

/// The cells of a grid that contain points.
std::set<std::pair<int, int>> cells(const std::vector<Point2>& points, int columns, int rows) {
  std::set<std::pair<int, int>> out;
  for (const Point2& p : points) {
    EXPECT_TRUE(p[0] >= 0 && p[0] < 1 && p[1] >= 0 && p[1] < 1) << p[0] << ' ' << p[1];
    out.insert({int(p[0] * columns), int(p[1] * rows)});
  }
  return out;
}

const int kCounts[] = {1, 2, 7, 12, 16, 25, 64, 100, 256};

TEST(Patterns, RadicalInverseMirrorsBinaryDigits) {
  const double expected[] = {0, 1. / 2, 1. / 4, 3. / 4, 1. / 8, 5. / 8, 3. / 8, 7. / 8, 1. / 16};
  for (std::uint32_t i = 0; i < 9; ++i) EXPECT_EQ(radical_inverse(i), expected[i]) << i;
  EXPECT_EQ(radical_inverse(0xffffffffu), 1 - 0x1p-32);
}

TEST(Patterns, PermutedIsAPermutationThatDependsOnItsKey) {
  for (const std::uint32_t n : {1u, 2u, 3u, 7u, 16u, 100u, 1000u}) {
    std::set<std::uint32_t> first_places;
    for (std::uint64_t key = 0; key < 200; ++key) {
      std::set<std::uint32_t> seen;
      for (std::uint32_t i = 0; i < n; ++i) seen.insert(permuted(i, n, key));
      ASSERT_EQ(seen.size(), n);
      ASSERT_LT(*seen.rbegin(), n);
      first_places.insert(permuted(0, n, key));
    }
    // With 200 keys all of 16 positions occur, and on average all but 14 of 100.
    EXPECT_GE(first_places.size(), n <= 16 ? n : 70u);
  }
  // All positions are about equally frequent: chi-square with 9 degrees of freedom, whose 1 - 1e-6 quantile is 46.
  std::array<int, 10> counts{};
  for (std::uint64_t key = 0; key < 5000; ++key) ++counts[permuted(3, 10, key)];
  double chi2 = 0;
  for (const int c : counts) chi2 += (c - 500) * (c - 500) / 500.0;
  EXPECT_LT(chi2, 46);
}

TEST(Patterns, CellsAreAsSquareAsTheCountAllows) {
  const auto grid = [](int n) {
    const PatternPoints p(Pattern::Jittered, n);
    return std::pair(p.columns(), p.rows());
  };
  EXPECT_EQ(grid(1), std::pair(1, 1));
  EXPECT_EQ(grid(7), std::pair(1, 7));
  EXPECT_EQ(grid(12), std::pair(3, 4));
  EXPECT_EQ(grid(100), std::pair(10, 10));
}

TEST(Patterns, RegularPointsAreTheMiddlesOfTheCells) {
  EXPECT_THAT(points(Pattern::Regular, 4, 5),
              testing::ElementsAre(Point2{.25, .25}, Point2{.75, .25}, Point2{.25, .75}, Point2{.75, .75}));
}

TEST(Patterns, JitteredHasOneInEachCell) {
  for (const int n : kCounts) {
    const PatternPoints p(Pattern::Jittered, n);
    EXPECT_EQ(int(cells(points(Pattern::Jittered, n, 3), p.columns(), p.rows()).size()), n);
  }
  // Uniform inside the cell: the mean of a coordinate is 1/2, within 4.5 standard errors.
  double sum = 0;
  for (std::uint64_t key = 0; key < 4000; ++key) {
    const double x = PatternPoints(Pattern::Jittered, 25).point(7, key)[0] * 5;
    sum += x - std::floor(x);
  }
  EXPECT_NEAR(sum / 4000, 0.5, 4.5 / std::sqrt(12.0 * 4000));
}

TEST(Patterns, MultiJitteredHasOneInEachCellColumnAndRow) {
  for (const int n : kCounts)
    for (std::uint64_t key = 0; key < 20; ++key) {
      const PatternPoints p(Pattern::MultiJittered, n);
      const auto all = points(Pattern::MultiJittered, n, key);
      ASSERT_EQ(int(cells(all, p.columns(), p.rows()).size()), n);
      ASSERT_EQ(int(cells(all, n, 1).size()), n);
      ASSERT_EQ(int(cells(all, 1, n).size()), n);
    }
}

TEST(Patterns, HammersleyHasOneInEachColumnAndInEachElementaryInterval) {
  const auto all = points(Pattern::Hammersley, 64, 0);
  EXPECT_EQ(all, points(Pattern::Hammersley, 64, 1));
  for (int columns = 1; columns <= 64; columns *= 2)  // a (0, 6, 2)-net in base 2
    EXPECT_EQ(int(cells(all, columns, 64 / columns).size()), 64) << columns;
}

TEST(Patterns, RandomHasNoSuchOrder) {
  const auto all = points(Pattern::Random, 64, 0);
  EXPECT_LT(cells(all, 8, 8).size(), 55u);  // 64 (1 - 1/e) = 40 are expected
}

TEST(Patterns, DimensionsOfAPathKnowNothingOfEachOther) {
  // Each pair of dimensions of a pixel's samples has the pattern, and there is no correlation between pairs beyond 4.5
  // standard errors over 2,000 pixels of 16 samples.
  const PatternPoints p(Pattern::MultiJittered, 16);
  double sum = 0;
  for (std::uint64_t pixel = 0; pixel < 2000; ++pixel) {
    std::vector<Point2> first;
    for (int s = 0; s < 16; ++s) {
      PathSampler sampler(p, 1, pixel, s);
      first.push_back(sampler.two(0));
      sum += (first.back()[0] - 0.5) * (sampler.two(5)[0] - 0.5) * 12;
    }
    ASSERT_EQ(cells(first, 4, 4).size(), 16u);
  }
  EXPECT_NEAR(sum / std::sqrt(32000.0), 0, 4.5);
}

/// Variance of the mean of 64 radiances that a cos^e lobe about r samples from a world, averaged over many r.
double variance(Pattern pattern, double e, const Environment& world) {
  const PatternPoints p(pattern, 64);
  constexpr int kLobes = 64, kPatterns = 64;
  double total = 0;
  for (int k = 0; k < kLobes; ++k) {
    const Vec3<double> r = direction((k + 0.5) / kLobes, 2 * kPi * radical_inverse(std::uint32_t(k)));
    double sum = 0, squares = 0;
    for (std::uint64_t key = 0; key < kPatterns; ++key) {
      double mean = 0;
      for (int i = 0; i < 64; ++i) {
        const Point2 u = p.point(i, key * kLobes + std::uint64_t(k));
        const double cosine = std::pow(1 - u[1], 1 / (e + 1));
        mean += luminance(world.radiance(about_axis(r, direction(cosine, 2 * kPi * u[0])))) / 64;
      }
      sum += mean;
      squares += mean * mean;
    }
    total += (squares - sum * sum / kPatterns) / (kPatterns - 1) / kLobes;
  }
  return total;
}

/// By which factor patterns reduce the noise of random points, for lobes from diffuse to mirror. Cells of the square
/// become pieces of the lobe: the narrower the lobe, the more pieces have a single colour, and the more a pattern
/// helps.
TEST(Patterns, StratificationSurvivesTheLobe) {
  Environment world;
  world.image = std::make_shared<const Image>(procedural_environment("interior", 256));
  std::printf("       e  jittered  multi-jittered  (times less variance than random, 64 samples)\n");
  for (const double e : {1.0, 10.0, 100.0, 1e3, 1e4, 1e5}) {
    const double random = variance(Pattern::Random, e, world);
    const double jittered = random / variance(Pattern::Jittered, e, world);
    const double multi = random / variance(Pattern::MultiJittered, e, world);
    std::printf("%8g %9.2f %15.2f\n", e, jittered, multi);
    EXPECT_GT(jittered, 1.5) << e;
    EXPECT_GT(multi, 1.5) << e;
  }
}

}  // namespace
}  // namespace brdfc::reference
