// SPDX-License-Identifier: GPL-3.0-or-later
// A fitted form: a few Cycles closures whose sum approximates a BRDF for every view, so that Cycles can sample them and
// evaluate them for light from lamps. A fit is for a material with known parameters. Exceptions are factors, mixed
// parameters (terms.h) and one number, which the tables run over.
//
// The closures are phong_ramps about axes in the plane of incidence, a diffuse_ramp, and microfacet closures whose
// normals lean in that plane and whose roughness is stretched along it: at grazing views most models have a flat, wide
// lobe, which no isotropic closure matches. A ramp has eight colours, which may be negative, so it is linear in eight
// numbers, and fitting a view is a linear problem. It minimises the absolute differences of f cos(theta_i) by
// iteratively reweighted least squares, over directions sampled from the model and from lobes of every width. The
// albedo is a constraint, and sums below 0 get a penalty. Axes and exponents of ramps are computed from the moments of
// the model's lobe. The lean of the facets and their roughness in the plane and across it are found by a search that
// goes from one view to the next. The results are tabulated over the number and the view angle, with linear
// interpolation.
//
// Each step has its own file: roles.h, the role of each parameter; knots.h, the model at places on the axis;
// facet_search.h and solution.h, the two parts of the search; make.h, the choice of closures and knots; fit_tables.h,
// the tables; evaluate.h, closures from the tables; file.h and stored.h, storage.
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
    Store,   ///< read a stored fit along a number (stored.h); if there is none, make it with a message on stderr
    Scratch  ///< always make it
  };
  /// `values` may lack factors, mixed parameters, and one number, which becomes the axis. In a fit along an axis,
  /// parameters that could be mixed stay open even where `values` have them. Throws ValueError if the model returns a
  /// value that is NaN, infinite or negative; InputError naming the file if a stored fit is damaged.
  Fit(const Model&, const ParamValues& values, From from = From::Store);

  /// Writes this fit with write_fit(). `values` are those of the constructor. A fit along an axis that was made with
  /// factors of 1 can be read again.
  void store(const Model&, const ParamValues& values, const std::filesystem::path&) const;
  /// make_knot() for this fit.
  Fit knot(const Model&, const ParamValues& values, double place) const;
  /// The fit restricted to these views, with the errors of these views. Views outside the range look like the nearest
  /// knot.
  Fit cut_to(const Cosines& views) const { return Fit(tables_.cut_to(views)); }
  /// Places of the knots on the axis, in [0, 1].
  const std::vector<double>& knots() const { return tables_.knots; }

  const std::optional<FitAxis>& axis() const { return tables_.axis; }
  const Terms& terms() const { return tables_.terms; }
  /// The argument of closures(), from complete values. Throws std::out_of_range for a parameter that they lack.
  Varied<double> varied(const ParamValues& values) const;

  /// The closures for a view above the surface: closures() of evaluate.h.
  template <class T> ClosureSum<T> closures(const Vec3<T>& wo, const std::type_identity_t<Varied<T>>& varied = {},
                                            const T& share = T(1), bool divided = true) const {
    return fit::closures(tables_, wo, varied, share, divided);
  }
  /// f cos(theta_i) of their sum, for directions above the surface.
  template <class T>
  Rgb<T> f_cos(const Vec3<T>& wi, const Vec3<T>& wo, const std::type_identity_t<Varied<T>>& varied = {}) const {
    return fit::f_cos(tables_, wi, wo, varied);
  }

  /// Relative L1 error, the mean over views. With an axis: at the worse of the two places of errors() next to `number`,
  /// or at the worst of all places if it is nullopt.
  double mean_l1(const std::optional<double>& number) const;

  /// The number of values in its tables.
  std::size_t size() const;

  /// Errors at cosines evenly spaced from 1 to 0, whatever the tables' knots. With an axis: at both its ends and in the
  /// middle between any two knots.
  const std::vector<ViewError>& errors() const { return tables_.errors; }

 private:
  explicit Fit(FitTables tables) : tables_(std::move(tables)) {}
  FitTables tables_;
};

/// The fit for these values, made or read at first use and cached while the program runs. Factors that `values` lack
/// are 1. Throws the same exceptions as Fit.
const Fit& fit_of(const Model&, const ParamValues& values);
/// The same, restricted to these views.
Fit fit_of(const Model&, const ParamValues& values, const Cosines& views);

}  // namespace brdfc::fit
