// SPDX-License-Identifier: GPL-3.0-or-later
// A model as it looks from one view, least-squares problems and searches for closures that come close to it, and the
// errors that these leave: what fits (fit.h) and twins (twin.h) have in common. Angles are in radians; directions are
// unit vectors in the local frame, the normal along z.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "closures/closure.h"
#include "measure/bound_model.h"

namespace brdfc::fit {

/// Directions above the surface with the solid angle that each stands for: a sum over them, by weight, is an integral.
struct Points {
  std::vector<Vec3<double>> wi;
  std::vector<double> weight;  ///< steradians, as many
};

/// The weights as a column.
Eigen::VectorXd weights_of(const Points&);

/// Along the surface towards the mirror side; at normal incidence any direction will do.
template <class T> Vec3<T> mirror_side(const Vec3<T>& wo) {
  const T sinTheta = sqrt(sin2_theta(wo));
  const auto oblique = sinTheta > T(1e-6);
  const T scale = T(-1) / select(oblique, sinTheta, T(1));
  return {select(oblique, wo.x * scale, T(1)), select(oblique, wo.y * scale, T(0)), T(0)};
}

/// In the plane of incidence, `angle` from the mirror direction towards the normal and on.
inline Vec3<double> beside_mirror(const Vec3<double>& wo, double angle) {
  const Vec3<double> out = mirror_side(wo);
  const double sinTheta = std::sqrt(sin2_theta(wo)), c = std::cos(angle), s = std::sin(angle);
  const double along = sinTheta * c - wo.z * s, up = wo.z * c + sinTheta * s;
  return {out.x * along, out.y * along, up};
}

/// The lobe that f^2 makes, of the brightest channel: squared, because a wide base would draw the axis to itself.
struct Moments {
  double offset = 0;  ///< radians from the mirror direction to its axis, positive towards the normal
  /// Exponents e of lobes cos^e whose squares have the variances of its two widths: `narrow` is the larger.
  double narrow = 1, wide = 1;
};

/// The model as it looks from one view.
struct View {
  Vec3<double> wo;  ///< towards the viewer
  Moments lobe;     ///< the model's
  Points points;    ///< directions of the light
  /// f cos(theta_i), a row a point and a column a channel; of several models, the columns of one after the other's.
  Eigen::MatrixXd f;
};
/// The view of a model from `wo`, at about so many points: some drawn from the model's own samples, some from lobes
/// about that of the model, of its width and wider, down to the whole sphere. Throws ValueError where the model gives a
/// value that is NaN, infinite or negative.
View view_of(const measure::BoundModel&, const Vec3<double>& wo, int points);
/// The same with the lobe given, which takes long to find.
View view_of(const measure::BoundModel&, const Vec3<double>& wo, int points, const Moments& lobe);

/// The largest channel of each point.
Eigen::VectorXd brightest(const Eigen::MatrixXd& f);

/// The same of each model: a column for three.
Eigen::MatrixXd brightest_of_each(const Eigen::MatrixXd& f);

/// f cos(theta_i) at the points, a column a channel. Throws ValueError where the model gives a value that is NaN,
/// infinite or negative.
Eigen::MatrixXd scattering(const measure::BoundModel&, const Points&, const Vec3<double>& wo);

/// Where the channels of all views, and of all models in each, differ by a factor alone: replaces the three columns of
/// each model by the largest, and returns the factors of the channels, the largest of which is 1. Otherwise changes
/// nothing and returns nothing.
std::optional<Rgb<double>> make_grey(std::vector<View>&);

/// Coefficients x for which a x comes close to f, rows being points and `weight` their solid angles: least absolute
/// differences, by iteratively reweighted least squares, with the integral of f kept exactly and sums below 0 fined.
/// Columns of `a` have integrals of about 1. Each coefficient is drawn towards that of `near` by its `ridge`, in units
/// of the mean square of a column. The last `positive` coefficients are not negative, and add up to at most `most`
/// times the integral; the one at index `none`, if given, is 0. All are 0 where f is.
Eigen::VectorXd solve(const Eigen::MatrixXd& a, const Eigen::VectorXd& weight, const Eigen::VectorXd& f,
                      const Eigen::VectorXd& near, const Eigen::VectorXd& ridge, Eigen::Index positive, double most,
                      std::optional<Eigen::Index> none);

/// A number that a search varies.
struct Variable {
  double start;      ///< where it begins
  double low, high;  ///< how far it goes
  double step;       ///< the size of its first steps
};
/// Values of the variables, in their order, for which `error` is least, as far as NLopt's BOBYQA finds it. M. Powell:
/// The BOBYQA algorithm for bound constrained optimization without derivatives, Cambridge NA2009/06.
std::vector<double> argmin(const std::vector<Variable>&,
                           const std::function<double(const std::vector<double>&)>& error);

/// How far a sum of closures is from the model, for one view.
struct ViewError {
  double cos_theta_o = 1;  ///< of the view
  double relative_l1 = 0;  ///< integral of |difference of f cos| over the albedo, largest channel
  double relative_l2 = 0;  ///< root of the integral of its square over that of the model's, largest channel
  double albedo = 0;       ///< difference of the integrals, absolute, largest channel
  double negative = 0;     ///< integral of what lies below 0, over the albedo
  double number = 0;       ///< for a fit along a number: its value, in units of the parameter
};
/// Of one view the larger of each, at the place of the first.
ViewError worse(const ViewError&, const ViewError&);
/// The errors of `closures`, which gives their sum for a view, at ViewSettings::error_views cosines evenly spaced from
/// 1 to 0.
std::vector<ViewError> view_errors(const measure::BoundModel&,
                                   const std::function<ClosureSum<double>(const Vec3<double>& wo)>& closures);

/// The Form(model, values) for these values, made at first use and kept while the program runs.
template <class Form> const Form& made_once(const Model& model, const ParamValues& values) {
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<Form>> made;
  const std::lock_guard lock(mutex);
  std::unique_ptr<Form>& form = made[model.info().name + " " + format_values(model.info(), values)];
  if (!form) form = std::make_unique<Form>(model, values);
  return *form;
}

/// Whether f changes when both directions turn about the normal.
bool turns(const Brdf<double>&);

}  // namespace brdfc::fit
