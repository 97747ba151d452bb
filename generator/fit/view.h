// SPDX-License-Identifier: GPL-3.0-or-later
// A model as seen from one view, least-squares problems and searches for closures that approximate it, and the errors
// that remain. Used by fits (fit.h) and twins (twin.h). Angles are in radians; directions are unit vectors in the local
// frame, with the normal along z.
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
#include "model/mirror_side.h"

namespace brdfc::fit {

/// Directions above the surface, each with the solid angle that it represents: a sum weighted by these is an integral.
struct Points {
  std::vector<Vec3<double>> wi;
  std::vector<double> weight;  ///< steradians, one per direction
};

/// The weights as a column.
Eigen::VectorXd weights_of(const Points&);

/// The direction in the plane of incidence that is `angle` from the mirror direction, in the sense towards the normal
/// and past it.
inline Vec3<double> beside_mirror(const Vec3<double>& wo, double angle) {
  const Vec3<double> out = mirror_side(wo);
  const double sinTheta = std::sqrt(sin2_theta(wo)), c = std::cos(angle), s = std::sin(angle);
  const double along = sinTheta * c - wo.z * s, up = wo.z * c + sinTheta * s;
  return {out.x * along, out.y * along, up};
}

/// The lobe of f^2, for the brightest channel. f is squared because otherwise a wide base would shift the axis.
struct Moments {
  double offset = 0;  ///< radians from the mirror direction to its axis, positive towards the normal
  /// Exponents e of lobes cos^e whose squares have the same variances as this lobe across its two axes; `narrow` is the
  /// larger.
  double narrow = 1, wide = 1;
};

/// The model as seen from one view.
struct View {
  Vec3<double> wo;  ///< towards the viewer
  Moments lobe;     ///< the model's lobe
  Points points;    ///< light directions
  /// f cos(theta_i), one row per point and one column per channel; with several models, the columns of the first, then
  /// those of the second, and so on.
  Eigen::MatrixXd f;
};
/// The view of a model from `wo` with about this many points: some sampled from the model, others from lobes about the
/// model's lobe, from its width up to the whole sphere. Throws ValueError if the model returns a value that is NaN,
/// infinite or negative.
View view_of(const measure::BoundModel&, const Vec3<double>& wo, int points);
/// The same for a known lobe, because computing the lobe is slow.
View view_of(const measure::BoundModel&, const Vec3<double>& wo, int points, const Moments& lobe);

/// The largest channel at each point.
Eigen::VectorXd brightest(const Eigen::MatrixXd& f);

/// The same for each model: one column for each three.
Eigen::MatrixXd brightest_of_each(const Eigen::MatrixXd& f);

/// f cos(theta_i) at the points, one column per channel. Throws ValueError if the model returns a value that is NaN,
/// infinite or negative.
Eigen::MatrixXd scattering(const measure::BoundModel&, const Points&, const Vec3<double>& wo);

/// If the channels of all views, and of all models in them, differ only by a factor: replaces the three columns of each
/// model by one, the largest, and returns the factors of the channels, of which the largest is 1. Otherwise returns
/// nullopt and changes nothing.
std::optional<Rgb<double>> make_grey(std::vector<View>&);

/// Coefficients x for which a x approximates f; rows are points, and `weight` has their solid angles. Minimises the
/// absolute differences by iteratively reweighted least squares. The integral of f is kept exactly, and sums below 0
/// get a penalty. Columns of `a` must have integrals of about 1. Each coefficient is pulled towards that of `near` with
/// the strength `ridge`, in units of the mean square of a column. The last `positive` coefficients are not negative,
/// and their sum is at most `most` times the integral. The coefficient with index `none`, if given, is 0. If f is 0,
/// all coefficients are 0.
Eigen::VectorXd solve(const Eigen::MatrixXd& a, const Eigen::VectorXd& weight, const Eigen::VectorXd& f,
                      const Eigen::VectorXd& near, const Eigen::VectorXd& ridge, Eigen::Index positive, double most,
                      std::optional<Eigen::Index> none);

/// A variable of a search.
struct Variable {
  double start;      ///< the start of the search
  double low, high;  ///< its range
  double step;       ///< the size of the first steps
};
/// The values of the variables, in their order, that minimise `error`, found with NLopt's BOBYQA. M. Powell: The BOBYQA
/// algorithm for bound constrained optimization without derivatives, Cambridge NA2009/06.
std::vector<double> argmin(const std::vector<Variable>&,
                           const std::function<double(const std::vector<double>&)>& error);

/// The error of a sum of closures, for one view.
struct ViewError {
  double cos_theta_o = 1;  ///< of the view
  double relative_l1 = 0;  ///< integral of |difference of f cos| divided by the albedo, largest channel
  double relative_l2 = 0;  ///< root of the ratio of the integrals of (difference)^2 and (model)^2, largest channel
  double albedo = 0;       ///< absolute difference of the albedos, largest channel
  double negative = 0;     ///< integral of the part below 0, divided by the albedo
  double number = 0;       ///< for a fit along a number: its value, in units of the parameter
};
/// For each error, the larger of the two, which are of the same view; `number` is that of the first.
ViewError worse(const ViewError&, const ViewError&);
/// The errors of `closures`, which returns their sum for a view, at ViewSettings::error_views cosines evenly spaced
/// from 1 to 0.
std::vector<ViewError> view_errors(const measure::BoundModel&,
                                   const std::function<ClosureSum<double>(const Vec3<double>& wo)>& closures);

/// The object Form(model, values) for these values, made at first use and cached while the program runs.
template <class Form> const Form& made_once(const Model& model, const ParamValues& values) {
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<Form>> made;
  const std::lock_guard lock(mutex);
  std::unique_ptr<Form>& form = made[model.info().name + " " + format_values(model.info(), values)];
  if (!form) form = std::make_unique<Form>(model, values);
  return *form;
}

/// True if f changes when both directions are rotated about the normal.
bool turns(const Brdf<double>&);

}  // namespace brdfc::fit
