// SPDX-License-Identifier: GPL-3.0-or-later
// A fitted form: a few closures of Cycles whose sum comes close to a BRDF for every view, so that Cycles can send light
// to it from lamps. For a material whose parameters are all known, but for a colour that f is proportional to.
//
// The closures are phong_ramps about axes in the plane of incidence, and a diffuse_ramp. Both take eight colours that
// may be negative, so each is a family that is linear in eight numbers, and a view is a linear problem: least absolute
// differences of f cos(theta_i), by iteratively reweighted least squares over directions drawn from the model and from
// lobes of every width; the albedo is a constraint, and a sum below 0 is fined. Axes and exponents come from the
// moments of the model's own lobe. All is tabulated over the view angle, and linear between.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/table.h"
#include "model/model.h"
#include "represent/closure.h"
#include "represent/view.h"

namespace brdfc {

/// Colours that f is proportional to, the other parameters being as they are. Closures are fitted without them, and
/// take them as factors of their weights, so they need not be known.
std::set<std::string> factors(const Model&, const ParamValues& values);
/// `known` with 1 for every factor that it lacks. Throws std::logic_error where it lacks another parameter.
ParamValues without_factors(const Model&, const ParamValues& known);

/// Why closures can't be fitted to a model with these parameters; nothing if they can.
std::optional<std::string> unfit(const Model&, const ParamValues&);

class Fit {
 public:
  /// `values` are complete. Throws ValueError where the model gives a value that is NaN, infinite or negative.
  Fit(const Model&, const ParamValues& values);

  /// The closures for a view above the surface. Their weights add up to the albedo, or where facets
  /// shadow each other to a little more. Those with ramps have `share` of theirs and colours that make up for it; not
  /// `divided`, the colours still have to be divided by the weight's largest channel.
  template <class T> ClosureSum<T> closures(const Vec3<T>& wo, const T& share = T(1), bool divided = true) const;
  /// f cos(theta_i) of their sum; directions above the surface.
  template <class T> Rgb<T> f_cos(const Vec3<T>& wi, const Vec3<T>& wo) const;

  /// At cosines evenly spaced from 1 to 0, whatever the tables' knots.
  const std::vector<ViewError>& errors() const { return errors_; }

 private:
  struct Lobe {
    std::shared_ptr<const Table> offset, exponent;  ///< angle from the mirror direction, towards the normal
  };
  /// A closure's weight, and the colours of its ramp times that weight, by channel, over the view and the position in
  /// the ramp; one channel if `tint_` does. Without a ramp, one colour over the view.
  struct Linear {
    std::shared_ptr<const Table> weight;
    std::vector<std::shared_ptr<const Table>> colour;
  };
  /// Closure j without weight and colours.
  template <class T> Closure<T> shape(std::size_t j, const Vec3<T>& wo, const T& place) const;
  /// Colour of closure j without tint; `at` is what its tables run over.
  template <class T, std::size_t D> Rgb<T> colour(std::size_t j, const std::array<T, D>& at) const;

  std::vector<Lobe> lobes_;
  std::vector<Linear> linear_;  ///< of the lobes, of the diffuse_ramp, of the facets
  std::vector<Closure<double>> facets_;
  Rgb<double> tint_;  ///< of all closures, in their weights; its largest channel is 1
  std::vector<ViewError> errors_;
};

/// The fit for these values, made at first use and kept while the program runs.
const Fit& fit_of(const Model&, const ParamValues& values);

extern template ClosureSum<double> Fit::closures(const Vec3<double>&, const double&, bool) const;
extern template ClosureSum<Expr> Fit::closures(const Vec3<Expr>&, const Expr&, bool) const;
extern template Rgb<double> Fit::f_cos(const Vec3<double>&, const Vec3<double>&) const;
extern template Rgb<Expr> Fit::f_cos(const Vec3<Expr>&, const Vec3<Expr>&) const;

}  // namespace brdfc
