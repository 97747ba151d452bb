// SPDX-License-Identifier: GPL-3.0-or-later
// A model along a fit's axis: what is bound at a place, how its terms look from a view, and what errors closures leave
// there. What fits (make.h) and twins (twin.h) have in common.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "fit/axis.h"
#include "fit/evaluate.h"
#include "fit/terms.h"
#include "fit/view.h"
#include "measure/bound_model.h"
#include "model/model.h"

namespace brdfc::fit {

/// A model along an axis. Places run from 0 to 1; without an axis there is the place 0 alone. All arguments must
/// outlive this.
class Along {
 public:
  /// `values` lack the axis and what is mixed in `terms`.
  Along(const Model& model, const ParamValues& values, const std::optional<FitAxis>& axis, const Terms& terms)
      : model_(model), values_(values), axis_(axis), terms_(terms) {}

  const std::optional<FitAxis>& axis() const { return axis_; }
  const Terms& terms() const { return terms_; }
  const ParamValues& values() const { return values_; }

  /// The model at a place, with these values of mixed parameters.
  measure::BoundModel bound(double place, const ParamValues& mixed) const;
  /// All mixed parameters with one value.
  ParamValues mixed(double value) const;

  /// The model at a place with `some` for what is mixed, where directions are drawn, and each term over its scale.
  class At {
   public:
    At(const Along&, double place, double some);
    /// The view from `wo` at about so many points: the columns of one term after those of the other. The lobe is that
    /// which is given, or sought, which takes long.
    View view(const Vec3<double>& wo, int points, const Moments* lobe = nullptr) const;

   private:
    struct Scaled {
      measure::BoundModel model;
      double scale;  ///< what its f has to be divided by
    };
    measure::BoundModel some_;
    std::vector<Scaled> terms_;  ///< none where nothing is mixed
  };

  /// The errors at these places of the closures that `closures` gives for a view and what they hang on, each of the
  /// worst term; to six digits, as files keep them.
  std::vector<ViewError> errors(
      const std::vector<double>& places,
      const std::function<ClosureSum<double>(const Vec3<double>& wo, const Varied<double>&)>& closures) const;

 private:
  const Model& model_;
  const ParamValues& values_;
  const std::optional<FitAxis>& axis_;
  const Terms& terms_;
};

/// Where errors are measured of what is tabulated at these places, and linear between: with an axis at both its ends
/// and in the middle between any two.
std::vector<double> proof_places(const std::vector<double>& places);

}  // namespace brdfc::fit
