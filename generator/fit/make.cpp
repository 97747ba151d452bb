// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/make.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "fit/along.h"
#include "fit/evaluate.h"
#include "fit/knots.h"
#include "fit/roles.h"
#include "fit/settings.h"

namespace brdfc::fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Relative L1 error of one view at a value of the axis, for the worst mixture.
double l1_at(const FitTables& fit, const View& view, double number) {
  const VectorXd weight = weights_of(view.points);
  const MatrixXd mixtures = mixtures_of(fit.terms);
  const Eigen::Index terms = mixtures.cols(), channels = view.f.cols() / terms;
  double worst = 0;
  for (Eigen::Index mixture = 0; mixture < terms; ++mixture) {
    std::vector<Rgb<double>> weights;
    MatrixXd f = MatrixXd::Zero(view.f.rows(), channels);
    for (Eigen::Index t = 0; t < terms; ++t) {
      weights.emplace_back(mixtures(mixture, t));
      f += mixtures(mixture, t) * view.f.middleCols(t * channels, channels);
    }
    const ClosureSum<double> sum = closures_by_weights(fit, view.wo, number, weights);
    MatrixXd off = f;
    for (Eigen::Index i = 0; i < off.rows(); ++i) {
      const Rgb<double> v = evaluate(sum, view.points.wi[std::size_t(i)], view.wo);
      const double of_sum[] = {v.r, v.g, v.b};
      for (Eigen::Index channel = 0; channel < channels; ++channel) off(i, channel) -= of_sum[channel];
    }
    for (Eigen::Index channel = 0; channel < channels; ++channel)
      if (const double albedo = f.col(channel).dot(weight); albedo > 0)
        worst = std::max(worst, off.col(channel).cwiseAbs().dot(weight) / albedo);
  }
  return worst;
}

double mean_error(const std::vector<Solution>& knots) {
  double sum = 0;
  for (const Solution& f : knots) sum += f.error;
  return sum / double(knots.size());
}

/// Fills a fit whose axis and terms are set. Returns false if `grey` is true but the channels differ by more than a
/// factor.
bool make(FitTables& fit, const Model& model, const ParamValues& values, bool grey) {
  const std::optional<FitAxis>& axis = fit.axis;
  const Along along(model, values, fit.axis, fit.terms);
  Knots at(along, grey);
  std::vector<double> knots = {0};
  for (int i = 1; axis && i <= int(kSettings.first_steps); ++i)
    knots.push_back(double(i) / double(kSettings.first_steps));
  if (!at.see(knots) || !at.find_shapes()) return false;
  // A few views suffice to choose the family of closures.
  fit.tint = Rgb<double>(1.0);
  Family family = kFamilies[0];
  std::vector<Solution> trial;
  for (const Family f : kFamilies) {
    std::vector<Solution> found = at.fitted(knots, kSettings.trial_stride, f);
    if (trial.empty() || mean_error(found) < mean_error(trial)) trial = std::move(found), family = f;
  }
  std::set<double> settled;  // middles between knots that need no further knot
  while (axis) {
    fit.tabulate(knots, trial);
    std::vector<double> needed;
    for (std::size_t k = 1; k < knots.size(); ++k) {
      const double x = (knots[k - 1] + knots[k]) / 2;
      if (knots[k] - knots[k - 1] < 1.5 / double(kSettings.steps) || settled.count(x)) continue;
      if (!at.see({x})) return false;
      // At views that are knots.
      double error = 0;
      for (std::size_t v = 0; v < kSettings.views; v += kSettings.trial_stride)
        error += l1_at(fit, at.views(x)[v], axis->at(x)) / double(trial[k].views.size());
      if (error > kSettings.worse_between * (trial[k - 1].error + trial[k].error) / 2 + kSettings.slightly_off)
        needed.push_back(x);
      else
        settled.insert(x);
    }
    if (needed.empty()) break;
    std::vector<Solution> fresh = at.fitted(needed, kSettings.trial_stride, family);
    for (std::size_t i = 0; i < needed.size(); ++i) {
      const auto before = std::ranges::upper_bound(knots, needed[i]) - knots.begin();
      knots.insert(knots.begin() + before, needed[i]);
      trial.insert(trial.begin() + before, std::move(fresh[i]));
    }
  }
  fit.tint = at.tint().value_or(Rgb<double>(1.0));
  fit.tint = {rounded(fit.tint.r), rounded(fit.tint.g), rounded(fit.tint.b)};
  fit.knots = knots, fit.family = int(family), fit.grey = grey;
  fit.tabulate(knots, at.fitted(knots, 1, family));
  fit.errors = along.errors(proof_places(knots), [&](const Vec3<double>& wo, const Varied<double>& varied) {
    return closures(fit, wo, varied);
  });
  return true;
}

}  // namespace

FitTables make_fit(const Model& model, const ParamValues& values) {
  FitTables fit;
  const Roles& roles = roles_of(model, values);
  fit.terms = roles.terms();
  if (const ParamInfo* p = roles.axis()) fit.axis = fit_axis(*p);
  // If the channels differ only by a factor, one fit serves them all.
  if (!make(fit, model, values, true) && !make(fit, model, values, false))
    throw std::logic_error(model.info().name + ": a fit of colours that is not one");
  return fit;
}

FitTables make_knot(const FitTables& fit, const Model& model, const ParamValues& values, double place) {
  const Family family = Family(fit.family);
  const Along along(model, values, fit.axis, fit.terms);
  Knots at(along, fit.grey);
  if (!at.see({place}) || (family == Family::Microfacet && !at.find_shapes()))
    throw std::logic_error(model.info().name + ": a fit of another tint");
  const Solution found = std::move(at.fitted({place}, 1, family).front());
  FitTables out;
  out.axis = fit.axis;
  out.terms = fit.terms;
  out.tint = fit.tint;
  // Two equal knots: the views are placed as in the whole fit.
  out.tabulate({0, 1}, {found, found});
  return out;
}

}  // namespace brdfc::fit
