// SPDX-License-Identifier: GPL-3.0-or-later
// A model at places of a fit's axis: how each view sees it there, the shapes of facets, and what is fitted to it.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "fit/axis.h"
#include "fit/solution.h"
#include "measure/bound_model.h"

namespace brdfc::fit {

/// Places run from 0 to 1; without an axis there is the place 0 alone.
class Knots {
 public:
  /// `grey`: the channels of f differ by a factor alone, and one column that serves all is sought. `values` lack the
  /// axis and mixed parameters. All arguments must outlive this.
  Knots(const Model& model, const ParamValues& values, const std::optional<FitAxis>& axis, const Terms& terms,
        bool grey)
      : model_(model), values_(values), axis_(axis), terms_(terms), grey_(grey) {}

  /// The model at a place, with these values of mixed parameters.
  measure::BoundModel bound(double place, const ParamValues& mixed) const;

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

  const Model& model_;
  const ParamValues& values_;
  const std::optional<FitAxis>& axis_;
  const Terms& terms_;
  bool grey_;
  std::optional<Rgb<double>> tint_;
  std::map<double, std::vector<View>> views_;
  std::vector<std::vector<FacetShape>> shapes_;  ///< by place, evenly spaced, and by every shape_stride-th view
};

}  // namespace brdfc::fit
