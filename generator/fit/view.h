// SPDX-License-Identifier: GPL-3.0-or-later
// A model as one view sees it, and closures held against it: what fits have in common.
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

/// Directions above the surface with the solid angle that each stands for.
struct Points {
  std::vector<Vec3<double>> wi;
  std::vector<double> weight;
};

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
  double offset = 0;            ///< of its axis from the mirror direction
  double narrow = 1, wide = 1;  ///< exponents that have the variances of its two widths
};

/// The model from one view.
struct View {
  Vec3<double> wo;
  Moments lobe;
  Points points;
  Eigen::MatrixXd f;  ///< f cos(theta_i) of the points, a column a channel; of several models one after the other
};
/// Throws ValueError where the model gives a value that is NaN, infinite or negative.
View view_of(const measure::BoundModel&, const Vec3<double>& wo, int points);
/// The same where the lobe is known.
View view_of(const measure::BoundModel&, const Vec3<double>& wo, int points, const Moments& lobe);

/// The largest channel of each point.
Eigen::VectorXd brightest(const Eigen::MatrixXd& f);

/// f cos(theta_i), three columns. Throws ValueError where the model gives a value that is NaN, infinite or negative.
Eigen::MatrixXd scattering(const measure::BoundModel&, const Points&, const Vec3<double>& wo);

/// Where the channels of all views, and of all models in each, differ by a factor alone, leaves one column of a model
/// that serves them all, and returns the factors.
std::optional<Rgb<double>> make_grey(std::vector<View>&);

/// Least absolute differences over the columns of `a`, whose integrals are about 1, with the integral of f kept, and
/// each coefficient drawn towards that of `near` by its `ridge`, in units of the mean square of a column. The last
/// `positive` coefficients are not negative and add up to at most `most` times that integral; that at `none` is 0.
Eigen::VectorXd solve(const Eigen::MatrixXd& a, const Eigen::VectorXd& weight, const Eigen::VectorXd& f,
                      const Eigen::VectorXd& near, const Eigen::VectorXd& ridge, Eigen::Index positive, double most,
                      std::optional<Eigen::Index> none);

/// What a search varies: where it begins, how far it goes, and its first steps.
struct Variable {
  double start, low, high, step;
};
/// Where `error` is least, as far as NLopt's BOBYQA finds it. M. Powell: The BOBYQA algorithm for bound constrained
/// optimization without derivatives, Cambridge NA2009/06.
std::vector<double> argmin(const std::vector<Variable>&,
                           const std::function<double(const std::vector<double>&)>& error);

/// The closures of a view against the model.
struct ViewError {
  double cos_theta_o = 1;
  double relative_l1 = 0;  ///< integral of |difference of f cos| over the albedo, largest channel
  double relative_l2 = 0;  ///< root of the integral of its square over that of the model's, largest channel
  double albedo = 0;       ///< largest difference
  double negative = 0;     ///< integral of what lies below 0, over the albedo
  double number = 0;       ///< value of the axis, of a fit that has one
};
/// At cosines evenly spaced from 1 to 0.
std::vector<ViewError> view_errors(const measure::BoundModel&,
                                   const std::function<ClosureSum<double>(const Vec3<double>& wo)>& closures);

/// The form of these values, made at first use and kept while the program runs.
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
