// SPDX-License-Identifier: GPL-3.0-or-later
// A fitted form: a few closures of Cycles whose sum comes close to a BRDF for every view, so that Cycles can send light
// to it from lamps. For a material whose parameters are known, but for those that f is proportional to and one number,
// which the tables run over.
//
// The closures are phong_ramps about axes in the plane of incidence, and a diffuse_ramp. Both take eight colours that
// may be negative, so each is a family that is linear in eight numbers, and a view is a linear problem: least absolute
// differences of f cos(theta_i), by iteratively reweighted least squares over directions drawn from the model and from
// lobes of every width; the albedo is a constraint, and a sum below 0 is fined. Axes and exponents come from the
// moments of the model's own lobe. All is tabulated over the number and the view angle, and linear between.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analysis/albedo_table.h"
#include "core/table.h"
#include "model/model.h"
#include "represent/closure.h"
#include "represent/view.h"

namespace brdfc {

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

/// Parameters that f is proportional to, the other parameters being as they are: colours, and numbers that may be 1.
/// Closures are fitted without them, and take them as factors of their weights, so they need not be known. Those that
/// `known` lacks have their defaults, and numbers the ends of their sliders, too.
std::set<std::string> factors(const Model&, const ParamValues& known);
/// `known` with 1 for every factor that it lacks. Throws std::logic_error where it then lacks more than one number.
ParamValues without_factors(const Model&, const ParamValues& known);
/// `values`, in which factors are, with 1 for each, and their product.
std::pair<ParamValues, Rgb<double>> split_factors(const Model&, ParamValues values);
/// Complete values, `number` being that which `values` may lack.
ParamValues with_number(const Model&, const ParamValues& values, double number);

/// Why closures can't be fitted to a model with these parameters; nothing if they can. They may lack one number.
std::optional<std::string> unfit(const Model&, const ParamValues&);

class Fit {
 public:
  enum class From { Store, Scratch };
  /// `values` may lack one number, which becomes the axis; then a fit that is stored is read, unless it has to be made
  /// from scratch. Throws ValueError where the model gives a value that is NaN, infinite or negative.
  Fit(const Model&, const ParamValues& values, From from = From::Store);

  /// Writes the tables as a float EXR with a row a table, what they are in its attribute brdfc:table. One along an axis
  /// that was made with factors of 1 can be read again. Throws InputError naming the path.
  void store(const Model&, const ParamValues& values, const std::filesystem::path&) const;
  /// What is fitted at the knot at this place: the same closures for every value of the axis.
  Fit knot(const Model&, const ParamValues& values, double place) const;
  /// Places of the knots on the axis.
  const std::vector<double>& knots() const { return knots_; }

  const std::optional<FitAxis>& axis() const { return axis_; }

  /// The closures for a view above the surface and a value of the axis, if there is one. Their weights add up to the
  /// albedo, or where facets shadow each other to a little more. Those with ramps have `share` of theirs and colours
  /// that make up for it; not `divided`, the colours still have to be divided by the weight's largest channel.
  template <class T>
  ClosureSum<T> closures(const Vec3<T>& wo, const T& number = T(0), const T& share = T(1), bool divided = true) const;
  /// f cos(theta_i) of their sum; directions above the surface.
  template <class T> Rgb<T> f_cos(const Vec3<T>& wi, const Vec3<T>& wo, const T& number = T(0)) const;

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
    double alpha;
    std::shared_ptr<const Table> log_alpha;  ///< over the axis, if there is one
  };
  /// A closure's weight, and the colours of its ramp times that weight, by channel, over the view and the position in
  /// the ramp; one channel if `tint_` does. Without a ramp, one colour over the view. In units of the amplitude.
  struct Linear {
    std::shared_ptr<const Table> weight;
    std::vector<std::shared_ptr<const Table>> colour;
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
  /// Relative L1 of one view.
  double l1_at(const View&, double number) const;
  /// Coordinates of all tables that run over the view.
  template <class T> std::vector<T> place(const Vec3<T>& wo, const T& number) const;
  /// Closure j without weight and colours.
  template <class T> Closure<T> shape(std::size_t j, const Vec3<T>& wo, const std::vector<T>& place) const;
  /// Colour of closure j without tint and amplitude; `at` is what its tables run over.
  template <class T> Rgb<T> colour(std::size_t j, const std::vector<T>& at) const;
  template <class T> T amplitude(const std::vector<T>& at) const;

  std::optional<FitAxis> axis_;
  std::vector<double> knots_;
  int family_ = 0;                          ///< which closures
  bool grey_ = false;                       ///< whether one channel serves all, with a tint
  double scale_ = 1;                        ///< of all closures along an axis, whose fit is made without factors
  std::shared_ptr<const Table> position_;   ///< from the place on the axis to the coordinate that tables take for it
  std::shared_ptr<const Table> amplitude_;  ///< with an axis, the logarithm of what the model reflects; else 1
  std::vector<Lobe> lobes_;
  std::vector<Linear> linear_;  ///< of the lobes, of the diffuse_ramp, of the facets
  std::vector<Facets> facets_;
  Rgb<double> tint_;  ///< of all closures, in their weights; its largest channel is 1
  std::vector<ViewError> errors_;
};

/// Where a fit along the number that `values` lack is kept, by the hash of all that it depends on but the code:
/// formula, values, slider, settings.
std::filesystem::path stored_fit(const Model&, const ParamValues& values);

/// The fit for these values, made or read at first use and kept while the program runs.
const Fit& fit_of(const Model&, const ParamValues& values);

extern template ClosureSum<double> Fit::closures(const Vec3<double>&, const double&, const double&, bool) const;
extern template ClosureSum<Expr> Fit::closures(const Vec3<Expr>&, const Expr&, const Expr&, bool) const;
extern template Rgb<double> Fit::f_cos(const Vec3<double>&, const Vec3<double>&, const double&) const;
extern template Rgb<Expr> Fit::f_cos(const Vec3<Expr>&, const Vec3<Expr>&, const Expr&) const;

}  // namespace brdfc
