// SPDX-License-Identifier: GPL-3.0-or-later
// A model at places of a fit's axis: how each view sees it there, the shapes of facets, and what is fitted to it.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "fit/along.h"
#include "fit/solution.h"

namespace brdfc::fit {

class Knots {
 public:
  /// `grey`: the channels of f differ by a factor alone, and one column that serves all is sought. `along` must outlive
  /// this.
  Knots(const Along& along, bool grey) : along_(along), grey_(grey) {}

  /// Looks at the model at these places, unless it has done so. False where it was said to be grey and is not, or has
  /// another tint there than elsewhere. Throws ValueError for a value of the model that is NaN, infinite or negative.
  bool see(const std::vector<double>& places);
  /// What see() found at a place; FitSettings::views of them.
  const std::vector<View>& views(double place) const { return views_.at(place); }
  /// The factors of the channels, if grey; the largest is 1.
  const std::optional<Rgb<double>>& tint() const { return tint_; }

  /// Seeks shapes of facets at few places and views, from one to the next, so that all lie in the same valley: between
  /// shapes that do not, no sum is close. Returns what see() does.
  bool find_shapes();

  /// What is fitted to every `stride`-th view at places that were seen. Facets need find_shapes().
  std::vector<Solution> fitted(const std::vector<double>& places, std::size_t stride, Family) const;

 private:
  /// Linear between those that were found.
  FacetShape shape(double place, std::size_t view) const;
  std::vector<View> views_at(double place) const;

  const Along& along_;
  bool grey_;
  std::optional<Rgb<double>> tint_;
  std::map<double, std::vector<View>> views_;
  std::vector<std::vector<FacetShape>> shapes_;  ///< by place, evenly spaced, and by every shape_stride-th view
};

}  // namespace brdfc::fit
