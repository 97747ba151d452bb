// SPDX-License-Identifier: GPL-3.0-or-later
// Where a fit searches for a number: on a range, and beyond its ends where there may be better values.
#pragma once

#include <algorithm>
#include <optional>

#include "core/axis_scale.h"

namespace brdfc::measured {

/// Highlights are searched for that are so many times narrower or wider than those of a range, at most: no data resolve
/// more. Exponents go as the inverse square of a width.
inline constexpr double kBeyond = 100, kBeyondExponent = kBeyond * kBeyond;

/// Places on the scale of a range, of which 0 and 1 are its ends.
class SearchRange {
 public:
  explicit SearchRange(const ScaledRange& range) : SearchRange(range, range.low, range.high) {}
  /// The search goes on to the values `least` and `most`, where these are beyond the range.
  SearchRange(const ScaledRange& range, double least, double most)
      : range_(range), least_(std::min(least, range.low)), most_(std::max(most, range.high)) {}

  double place(double value) const { return (scaled(value) - scaled(range_.low)) / width(); }
  double at(double t) const {
    if (t >= 0 && t <= 1) return range_.at(t);
    return std::clamp(from_scale(range_.scale, scaled(range_.low) + t * width()), least_, most_);
  }
  /// The places where the search ends.
  double first() const { return std::min(0., place(least_)); }
  double last() const { return std::max(1., place(most_)); }
  /// The place at a share of the way from the range's end to the narrowest highlight; nullopt if there is no way.
  /// Highlights of small widths and of large exponents are narrow.
  std::optional<double> narrower(double share) const {
    if (range_.scale == AxisScale::Log && first() < 0) return share * first();
    if (range_.scale == AxisScale::Log1p && last() > 1) return 1 + share * (last() - 1);
    return std::nullopt;
  }

 private:
  double scaled(double x) const { return to_scale(range_.scale, x); }
  double width() const { return scaled(range_.high) - scaled(range_.low); }

  ScaledRange range_;
  double least_, most_;
};

}  // namespace brdfc::measured
