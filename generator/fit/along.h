// SPDX-License-Identifier: GPL-3.0-or-later
// A model along a fit's axis: the model at a place on the axis, its terms seen from a view, and the errors that
// closures leave there. Used by fits (make.h) and twins (twin.h).
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

/// A model along an axis. Places run from 0 to 1; without an axis 0 is the only place. All arguments must outlive this
/// object.
class Along {
 public:
  /// `values` must lack the axis and the mixed parameters of `terms`.
  Along(const Model& model, const ParamValues& values, const std::optional<FitAxis>& axis, const Terms& terms)
      : model_(model), values_(values), axis_(axis), terms_(terms) {}

  const std::optional<FitAxis>& axis() const { return axis_; }
  const Terms& terms() const { return terms_; }
  const ParamValues& values() const { return values_; }

  /// The model at a place, with these values of the mixed parameters.
  measure::BoundModel bound(double place, const ParamValues& mixed) const;
  /// All mixed parameters with the same value.
  ParamValues mixed(double value) const;

  /// The model at a place. Its mixed parameters have the value `some` where directions are sampled. Each term is
  /// divided by its scale.
  class At {
   public:
    At(const Along&, double place, double some);
    /// The view from `wo` with about this many points. The columns of f are those of the first term, then of the
    /// second, and so on. `lobe` is the model's lobe; if it is null, it is computed, which is slow.
    View view(const Vec3<double>& wo, int points, const Moments* lobe = nullptr) const;

   private:
    struct Scaled {
      measure::BoundModel model;
      double scale;  ///< divisor of its f
    };
    measure::BoundModel some_;
    std::vector<Scaled> terms_;  ///< empty without mixed parameters
  };

  /// The errors at these places of the closures that `closures` returns for a view and what they depend on. Each error
  /// is that of the worst of Terms::judged(), rounded to six digits as in files.
  std::vector<ViewError> errors(
      const std::vector<double>& places,
      const std::function<ClosureSum<double>(const Vec3<double>& wo, const Varied<double>&)>& closures) const;

 private:
  const Model& model_;
  const ParamValues& values_;
  const std::optional<FitAxis>& axis_;
  const Terms& terms_;
};

/// The places at which errors are measured for tables that have knots at `places` and are linear between them. With an
/// axis: both its ends, and the middle between any two places.
std::vector<double> proof_places(const std::vector<double>& places);

}  // namespace brdfc::fit
