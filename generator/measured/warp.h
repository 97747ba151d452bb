// SPDX-License-Identifier: GPL-3.0-or-later
// Distributions over the unit square that depend on parameters, as RGL's files use them: bilinear between the entries
// of a slice, linear between slices. Row by row and column by column, a cumulative sum maps the distribution to a
// uniform one.
#pragma once

#include <array>
#include <vector>

#include "core/sequence.h"

namespace brdfc::measured {

/// The slices around a place in the space of two parameters, with their weights, which add up to 1.
struct Blend {
  std::array<std::size_t, 4> slice;
  std::array<double, 4> weight;
  std::size_t count;
};
/// `phis` and `thetas` are increasing; slices are ordered by phi, then theta. Beyond the ends the last slice holds.
Blend blend(const std::vector<float>& phis, const std::vector<float>& thetas, double phi, double theta);

class Warp {
 public:
  Warp() = default;
  /// `data` holds slices of height rows of `width` numbers. `width` and `height` are at least 2. With `cumulative`
  /// each slice is scaled to have an integral of 1, which must be positive.
  Warp(std::vector<float> data, std::size_t width, std::size_t height, bool cumulative);
  /// Index of the first slice whose integral is not positive; `slices` if there is none.
  static std::size_t empty_slice(const std::vector<float>& data, std::size_t width, std::size_t height);

  double eval(const Point2& at, const Blend&) const;
  /// The place in the square of uniform numbers that is mapped to `at`.
  Point2 invert(const Point2& at, const Blend&) const;
  /// The place to which a uniform number is mapped; its density is that of eval().
  Point2 sample(const Point2& u, const Blend&) const;

 private:
  struct Cell {
    std::size_t x, y;
    double u, v;
  };
  Cell cell(const Point2& at) const;
  double value(std::size_t x, std::size_t y, const Blend&) const;
  double row_sum(std::size_t x, std::size_t y, const Blend&) const;
  double column_sum(std::size_t y, const Blend&) const;

  std::vector<float> data_, rows_, columns_;  // values; cumulative sums along each row; cumulative sums of rows
  std::size_t width_ = 0, height_ = 0;
};

}  // namespace brdfc::measured
