// SPDX-License-Identifier: GPL-3.0-or-later
// A fitted form: a few closures of Cycles whose sum comes close to a BRDF for every view, so that Cycles can send light
// to it from lamps. For a material whose parameters are known, but for those that f is proportional to or a polynomial
// of (terms.h) and one number, which the tables run over.
//
// The closures are phong_ramps about axes in the plane of incidence, a diffuse_ramp, and microfacets that lean and are
// stretched in that plane: at low views most models have a lobe that is flat and wide, which no round closure follows.
// Ramps take eight colours that may be negative, so each is a family that is linear in eight numbers, and a view is a
// linear problem: least absolute differences of f cos(theta_i), by iteratively reweighted least squares over directions
// drawn from the model and from lobes of every width; the albedo is a constraint, and a sum below 0 is fined. Axes and
// exponents of ramps come from the moments of the model's own lobe; how facets lean and how rough they are, in the
// plane and across it, is found by a search from one view to the next. All is tabulated over the number and the view
// angle, and linear between.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "closures/closure.h"
#include "core/cosines.h"
#include "fit/roles.h"
#include "fit/terms.h"
#include "fit/view.h"
#include "measure/albedo_table.h"
#include "model/model.h"
#include "tables/table.h"
#include "trace/expr.h"

namespace brdfc::fit {

/// The number that a fit runs over, from one end of its slider to the other.
struct FitAxis {
  std::string parameter;
  double low, high;
  AxisScale scale;

  /// Its value at x in [0, 1], and the other way round; values beyond the ends take places beyond [0, 1].
  double at(double x) const;
  template <class T> T place(const T& value) const;
};
/// The axis that a number of the schema would have.
FitAxis fit_axis(const ParamInfo&);

/// What closures of a fit depend on besides the view: the value of its axis, if it has one, and of the parameters that
/// it has terms by.
template <class T> struct Varied {
  T number = T(0);
  std::map<std::string, Rgb<T>> parameters = {};
  Varied() = default;
  Varied(const T& n) : number(n) {}  // NOLINT: all that most fits need
};

/// The height, as a cosine, of the lowest view that closures are fitted to. Of a lower one, as bent and interpolated
/// normals have it too, the normal is turned towards the viewer until the view is as high: about the normal itself
/// closures would turn black one after the other, and what is left of the sum no longer cancels.
inline constexpr double kLowestView = 2e-3;

class Fit {
 public:
  enum class From { Store, Scratch };
  /// `values` may lack factors, what is mixed, and one number, which becomes the axis (roles.h); then what is mixed
  /// stays open even where it is known, and a fit that is stored is read, unless it has to be made from scratch. Throws
  /// ValueError where the model gives a value that is NaN, infinite or negative; std::logic_error for values that lack
  /// more.
  Fit(const Model&, const ParamValues& values, From from = From::Store);

  /// Writes the tables as a float EXR with a row a table, what they are in its attribute brdfc:table. One along an axis
  /// that was made with factors of 1 can be read again. Throws InputError naming the path.
  void store(const Model&, const ParamValues& values, const std::filesystem::path&) const;
  /// What is fitted at the knot at this place: the same closures for every value of the axis.
  Fit knot(const Model&, const ParamValues& values, double place) const;
  /// The same for these views alone, of those views its errors; what lies beyond them is shown as the nearest knot.
  Fit seen(const Cosines& views) const;
  /// Places of the knots on the axis.
  const std::vector<double>& knots() const { return knots_; }

  const std::optional<FitAxis>& axis() const { return axis_; }
  const Terms& terms() const { return terms_; }
  /// What closures() takes, from complete values.
  Varied<double> varied(const ParamValues& values) const;

  /// The closures for a view above the surface. Their weights add up to the albedo. Those with ramps have `share` of
  /// theirs and colours that make up for it; not `divided`, the colours still have to be divided by the weight: by its
  /// largest channel, with terms by each. Of numbers, a lower view than kLowestView is taken as described there; a
  /// shader that records closures has to turn its normal itself.
  template <class T> ClosureSum<T> closures(const Vec3<T>& wo, const std::type_identity_t<Varied<T>>& varied = {},
                                            const T& share = T(1), bool divided = true) const;
  /// f cos(theta_i) of their sum; directions above the surface.
  template <class T>
  Rgb<T> f_cos(const Vec3<T>& wi, const Vec3<T>& wo, const std::type_identity_t<Varied<T>>& varied = {}) const;

  /// Relative L1, mean over views: with an axis at the worse of the two places of errors() beside `number`, or at the
  /// worst of all where it may be anything.
  double mean_l1(const std::optional<double>& number) const;

  /// How many numbers its tables hold.
  std::size_t size() const;

  /// At cosines evenly spaced from 1 to 0 whatever the tables' knots, and with an axis at both its ends and in the
  /// middle between any two knots.
  const std::vector<ViewError>& errors() const { return errors_; }

 private:
  struct Lobe {
    /// Angle from the mirror direction, towards the normal; and exponent. Along an axis lobes change by factors: then
    /// the angle is in units of 1 / sqrt(exponent), so that they keep their places beside each other, and the exponent
    /// is its logarithm.
    std::shared_ptr<const Table> offset, exponent;
  };
  struct Facets {
    ClosureKind kind;
    std::shared_ptr<const Table> offset, log_alpha, log_stretch;  ///< the angle like that of lobes
  };
  /// A closure's weight, and the colours of its ramp times that weight, by term and channel, over the view and the
  /// position in the ramp; one channel if `tint_` does. Without a ramp, colours over the view and no weight. In units
  /// of the amplitude.
  struct Linear {
    std::vector<std::shared_ptr<const Table>> weight;
    std::vector<std::vector<std::shared_ptr<const Table>>> colour;
  };
  Fit() = default;
  /// Multiplies a fit along an axis.
  void apply(const Rgb<double>& factor);
  void read(const std::filesystem::path&, const std::string& hash);
  std::vector<std::shared_ptr<const Table>> tables() const;
  /// False where `grey` and the channels do not differ by a factor alone.
  bool make(const Model&, const ParamValues& values, bool grey);
  /// Makes the tables of what was fitted at the knots of the axis, which are at these places of [0, 1]; without an axis
  /// of the only one.
  template <class Knot> void tabulate(const std::vector<double>& places, const std::vector<Knot>& knots);
  /// Relative L1 of one view, of the term that is off by most.
  double l1_at(const View&, double number) const;
  /// Coordinates of all tables that run over the view.
  template <class T> std::vector<T> place(const Vec3<T>& wo, const T& number) const;
  /// What each term counts, in the closures' units and with their tint. Empty without parameters that there are terms
  /// by: then all but the amplitude is in the tables.
  template <class T> std::vector<Rgb<T>> counts(const std::vector<T>& at, const std::vector<Rgb<T>>& weights) const;
  /// closures() by the weights of terms.
  template <class T> ClosureSum<T> weighted(const Vec3<T>& wo, const T& number, const std::vector<Rgb<T>>& weights,
                                            const T& share, bool divided) const;
  template <class T> std::vector<Rgb<T>> weights(const Varied<T>&) const;
  /// Closure j without weight and colours; `side` is mirror_side().
  template <class T> Closure<T> shape(std::size_t j, const Vec3<T>& side, const std::vector<T>& place) const;
  /// Colour of closure j, without tint and amplitude unless there are counts; `at` is what its tables run over.
  template <class T> Rgb<T> colour(std::size_t j, const std::vector<T>& at, const std::vector<Rgb<T>>& counts) const;
  template <class T> T amplitude(std::size_t term, const std::vector<T>& at) const;
  template <class T> Rgb<T> tint() const;

  std::optional<FitAxis> axis_;
  Terms terms_;
  std::vector<double> knots_;
  double first_view_ = 0, views_ = 1;      ///< where on their axis tables over the view begin, and how much they have
  int family_ = 0;                         ///< which closures
  bool grey_ = false;                      ///< whether one channel serves all, with a tint
  double scale_ = 1;                       ///< of all closures along an axis, whose fit is made without factors
  std::shared_ptr<const Table> position_;  ///< from the place on the axis to the coordinate that tables take for it
  std::vector<std::shared_ptr<const Table>> amplitude_;  ///< of terms along an axis: the logarithm of what they reflect
  std::vector<Lobe> lobes_;
  std::vector<Linear> linear_;  ///< of the lobes, of the diffuse_ramp, of the facets
  std::vector<Facets> facets_;
  Rgb<double> tint_;  ///< of all closures, in their weights; its largest channel is 1
  std::vector<ViewError> errors_;
};

/// Where a fit along the number that `values` lack is kept, by the hash of all that it depends on but the code: what
/// the model computes, along_axis() of the values, slider, settings.
std::filesystem::path stored_fit(const Model&, const ParamValues& values);

/// The fit for these values, made or read at first use and kept while the program runs. It has 1 for factors that they
/// lack.
const Fit& fit_of(const Model&, const ParamValues& values);
/// The same for these views alone.
Fit fit_of(const Model&, const ParamValues& values, const Cosines& views);

extern template ClosureSum<double> Fit::closures(const Vec3<double>&, const Varied<double>&, const double&, bool) const;
extern template ClosureSum<Expr> Fit::closures(const Vec3<Expr>&, const Varied<Expr>&, const Expr&, bool) const;
extern template Rgb<double> Fit::f_cos(const Vec3<double>&, const Vec3<double>&, const Varied<double>&) const;
extern template Rgb<Expr> Fit::f_cos(const Vec3<Expr>&, const Vec3<Expr>&, const Varied<Expr>&) const;

}  // namespace brdfc::fit
