// SPDX-License-Identifier: GPL-3.0-or-later
// A model at places on a fit's axis: its views, the shapes of facets, and the solutions fitted to it.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "fit/along.h"
#include "fit/solution.h"

namespace brdfc::fit {

class Knots {
 public:
  /// `grey` states that the channels of f differ only by a factor; then one column for all channels is fitted. `along`
  /// must outlive this object.
  Knots(const Along& along, bool grey) : along_(along), grey_(grey) {}

  /// Evaluates the model at these places, unless that is done already. Returns false if `grey` was claimed but the
  /// channels differ by more than a factor, or the tint differs between places. Throws ValueError for a value of the
  /// model that is NaN, infinite or negative.
  bool see(const std::vector<double>& places);
  /// The FitSettings::views views that see() found at a place.
  const std::vector<View>& views(double place) const { return views_.at(place); }
  /// The factors of the channels, if grey; the largest is 1.
  const std::optional<Rgb<double>>& tint() const { return tint_; }

  /// Finds shapes of facets at a few places and views, from one to the next, so that all belong to the same local
  /// minimum: interpolating between shapes of different minima gives a poor fit. Returns the same as see().
  bool find_shapes();

  /// The solutions for every `stride`-th view at places that see() has evaluated. A family with facets needs
  /// find_shapes() first.
  std::vector<Solution> fitted(const std::vector<double>& places, std::size_t stride, Family) const;

 private:
  /// Interpolates linearly between the shapes that were found.
  FacetShape shape(double place, std::size_t view) const;
  std::vector<View> views_at(double place) const;

  const Along& along_;
  bool grey_;
  std::optional<Rgb<double>> tint_;
  std::map<double, std::vector<View>> views_;
  std::vector<std::vector<FacetShape>> shapes_;  ///< for evenly spaced places and every shape_stride-th view
};

}  // namespace brdfc::fit
