// SPDX-License-Identifier: GPL-3.0-or-later
// A fitted form: a few closures of Cycles whose sum comes close to a BRDF for every view, so that Cycles can send light
// to it from lamps. For a material whose parameters are known, but for factors and mixed parameters (terms.h) and one
// number, which the tables run over.
//
// The closures are phong_ramps about axes in the plane of incidence, a diffuse_ramp, and microfacets that lean and are
// stretched in that plane: at low views most models have a lobe that is flat and wide, which no round closure follows.
// Ramps take eight colours that may be negative, so each is a family that is linear in eight numbers, and a view is a
// linear problem: least absolute differences of f cos(theta_i), by iteratively reweighted least squares over directions
// drawn from the model and from lobes of every width; the albedo is a constraint, and a sum below 0 is fined. Axes and
// exponents of ramps come from the moments of the model's own lobe; how facets lean and how rough they are, in the
// plane and across it, is found by a search from one view to the next. All is tabulated over the number and the view
// angle, and linear between.
//
// A file for each step: roles.h, what each parameter is to it; knots.h, the model at places of the number;
// facet_search.h and solution.h, the two parts of the search; make.h, which closures and knots there are; fit_tables.h,
// the tables; evaluate.h, closures of them; file.h and stored.h, how they are kept.
#pragma once

#include <filesystem>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/cosines.h"
#include "fit/evaluate.h"
#include "fit/fit_tables.h"
#include "fit/roles.h"
#include "fit/stored.h"
#include "fit/view_axis.h"
#include "model/model.h"
#include "trace/expr.h"

namespace brdfc::fit {

class Fit {
 public:
  enum class From {
    Store,   ///< a fit along a number is read if it is kept (stored.h), and made with a line on stderr if not
    Scratch  ///< it is made whatever there is
  };
  /// `values` may lack factors, mixed parameters, and one number, which becomes the axis: then parameters that are
  /// mixed when all are open stay open even where `values` have them. Throws ValueError where the model gives a value
  /// that is NaN, infinite or negative; InputError naming the file that is kept if it is damaged.
  Fit(const Model&, const ParamValues& values, From from = From::Store);

  /// write_fit() of this; `values` are those of the constructor. One along an axis that was made with factors of 1 can
  /// be read again.
  void store(const Model&, const ParamValues& values, const std::filesystem::path&) const;
  /// make_knot() of this.
  Fit knot(const Model&, const ParamValues& values, double place) const;
  /// The same for these views alone, of those views its errors; what lies beyond them is shown as the nearest knot.
  Fit cut_to(const Cosines& views) const { return Fit(tables_.cut_to(views)); }
  /// Places of the knots on the axis, in [0, 1].
  const std::vector<double>& knots() const { return tables_.knots; }

  const std::optional<FitAxis>& axis() const { return tables_.axis; }
  const Terms& terms() const { return tables_.terms; }
  /// What closures() takes, from complete values. Throws std::out_of_range for a parameter that they lack.
  Varied<double> varied(const ParamValues& values) const;

  /// closures() of evaluate.h: those for a view above the surface.
  template <class T> ClosureSum<T> closures(const Vec3<T>& wo, const std::type_identity_t<Varied<T>>& varied = {},
                                            const T& share = T(1), bool divided = true) const {
    return fit::closures(tables_, wo, varied, share, divided);
  }
  /// f cos(theta_i) of their sum; directions above the surface.
  template <class T>
  Rgb<T> f_cos(const Vec3<T>& wi, const Vec3<T>& wo, const std::type_identity_t<Varied<T>>& varied = {}) const {
    return fit::f_cos(tables_, wi, wo, varied);
  }

  /// Relative L1, mean over views: with an axis at the worse of the two places of errors() beside `number`, or at the
  /// worst of all where it may be anything.
  double mean_l1(const std::optional<double>& number) const;

  /// How many numbers its tables hold.
  std::size_t size() const;

  /// At cosines evenly spaced from 1 to 0 whatever the tables' knots, and with an axis at both its ends and in the
  /// middle between any two knots.
  const std::vector<ViewError>& errors() const { return tables_.errors; }

 private:
  explicit Fit(FitTables tables) : tables_(std::move(tables)) {}
  FitTables tables_;
};

/// The fit for these values, made or read at first use and kept while the program runs. It has 1 for factors that
/// they lack. Throws as Fit does.
const Fit& fit_of(const Model&, const ParamValues& values);
/// The same for these views alone.
Fit fit_of(const Model&, const ParamValues& values, const Cosines& views);

}  // namespace brdfc::fit
