// SPDX-License-Identifier: GPL-3.0-or-later
// Sampling patterns: positions of a pixel's samples in the unit square.
//
// K. Suffern, Ray Tracing from the Ground Up, 2007, chapter 5. Multi-jittered points: K. Chiu, P. Shirley, C. Wang,
// Multi-Jittered Sampling, Graphics Gems IV, 1994. The square is divided into columns x rows = count cells, where
// columns is the largest divisor of count that is not above its square root. Any count therefore has as many points as
// cells.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "reference/random.h"

namespace brdfc::reference {

enum class Pattern {
  Random,         ///< independent points
  Regular,        ///< the centres of the cells
  Jittered,       ///< one random point in each cell
  MultiJittered,  ///< one point in each cell, and also one in each of `count` columns and `count` rows
  Hammersley,     ///< (i / count, radical inverse of i); the same points everywhere
};

/// The names in scene files and on the command line, in the order of Pattern.
const std::vector<std::string>& pattern_names();
/// The pattern with one of pattern_names(). Throws std::out_of_range for another name.
Pattern pattern_named(const std::string& name);

/// Van der Corput's sequence: the binary digits of i, mirrored at the binary point, in [0, 1).
double radical_inverse(std::uint32_t i);

/// The place of i in a permutation of 0 .. n - 1 that depends on the key. 0 <= i < n.
std::uint32_t permuted(std::uint32_t i, std::uint32_t n, std::uint64_t key);

/// The points of a pattern.
class PatternPoints {
 public:
  /// count > 0
  PatternPoints(Pattern pattern, int count);

  Pattern pattern() const { return pattern_; }
  int count() const { return int(count_); }
  int columns() const { return int(columns_); }
  int rows() const { return int(rows_); }
  /// Point `index` of count(), in [0, 1)^2. The key selects one of many patterns of the kind; there is only one Regular
  /// and one Hammersley pattern.
  std::array<double, 2> point(int index, std::uint64_t key) const;

 private:
  Pattern pattern_;
  std::uint32_t count_, columns_, rows_;
};

/// The random numbers of one path, by dimension. Each is to be used once. Under Pattern::Random they are those of
/// Random. Otherwise the samples of a pixel share a pattern for each dimension, in an order that differs between
/// dimensions, so that the dimensions are independent.
class PathSampler {
 public:
  /// For sample number `sample` of the points.count() samples of a pixel. Later samples are random.
  PathSampler(const PatternPoints& points, std::uint64_t seed, std::uint64_t pixel, int sample)
      : points_(points),
        random_key_(Random(seed, pixel, std::uint64_t(sample)).key()),
        sample_(sample),
        in_pattern_(points.pattern() != Pattern::Random && sample < points.count()) {
    if (in_pattern_) pattern_key_ = pattern_key(seed, pixel);
  }

  /// The key for Random::at(). The first number of a dimension has index first(), the second the next index.
  std::uint64_t random_key() const { return random_key_; }
  static constexpr std::uint64_t first(std::uint64_t dimension) { return 2 * dimension; }

  /// A random number that is not from the pattern.
  double random(std::uint64_t dimension) const { return Random::at(random_key_, first(dimension)); }
  double one(std::uint64_t dimension) const { return in_pattern_ ? point(dimension)[0] : random(dimension); }
  std::array<double, 2> two(std::uint64_t dimension) const {
    if (in_pattern_) return point(dimension);
    return {random(dimension), Random::at(random_key_, first(dimension) + 1)};
  }

 private:
  static std::uint64_t pattern_key(std::uint64_t seed, std::uint64_t pixel);
  std::array<double, 2> point(std::uint64_t dimension) const;

  const PatternPoints& points_;
  std::uint64_t random_key_, pattern_key_ = 0;
  const int sample_;
  const bool in_pattern_;
};

}  // namespace brdfc::reference
