// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/facet_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/settings.h"

namespace brdfc::fit {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<Facet> facets_of(const FacetShape& shape, const Moments& at_normal, const Vec3<double>& wo) {
  std::vector<Facet> out;
  double root = std::pow(2 * std::max(at_normal.narrow, 0.5) + 1, -0.25);
  for (std::size_t j = 0; j < shape.size(); j += kNumbersOfFacet) {
    root *= shape[j + 1];
    const double sin2Theta = sin2_theta(wo), alpha = std::clamp(sqr(root), kSettings.least_alpha, 1.0),
                 most = std::min(1 / alpha, alpha / kSettings.least_alpha);
    out.push_back({ClosureKind::Beckmann, shape[j] * std::asin(wo.z) * std::sqrt(sin2Theta), alpha,
                   std::clamp(std::exp(shape[j + 2] * sin2Theta), 1 / most, most)});
  }
  return out;
}

double facet_error(const std::vector<Facet>& facets, const View& view) {
  const auto n = Eigen::Index(view.points.wi.size()), count = Eigen::Index(facets.size());
  MatrixXd a(n, count + 1);
  a.leftCols(count) = dictionary({}, facets, view.points, view.wo).rightCols(count);
  for (Eigen::Index i = 0; i < n; ++i) a(i, count) = view.points.wi[std::size_t(i)].z * kInvPi;
  const VectorXd weight = weights_of(view.points);
  double error = 0;
  for (const auto& column : view.f.colwise()) {
    const VectorXd f = column;
    const VectorXd x =
        solve(a, weight, f, VectorXd::Zero(a.cols()), VectorXd::Constant(a.cols(), kSettings.facet_ridge), a.cols(),
              std::numeric_limits<double>::infinity(), std::nullopt);
    if (const double light = f.dot(weight); light > 0)
      error += (a * x - f).cwiseAbs().dot(weight) / light / double(view.f.cols());
  }
  return error;
}

FacetShape improved(const FacetShape& shape, const Moments& at_normal, const View& whole) {
  View view{whole.wo, whole.lobe, {}, {}};
  for (std::size_t i = 0; i < whole.points.wi.size(); i += kSettings.fewer_points) {
    view.points.wi.push_back(whole.points.wi[i]);
    view.points.weight.push_back(whole.points.weight[i] * double(kSettings.fewer_points));
  }
  view.f =
      whole.f(Eigen::seqN(0, Eigen::Index(view.points.wi.size()), Eigen::Index(kSettings.fewer_points)), Eigen::all);
  std::vector<Variable> variables;
  for (std::size_t j = 0; j < shape.size(); j += kNumbersOfFacet) {
    variables.push_back({shape[j], kSettings.most_lean, 0, 0.1});
    variables.push_back({shape[j + 1], kSettings.least_ratio, j == 0 ? kSettings.most_ratio : 0.9, 0.1 * shape[j + 1]});
    variables.push_back({shape[j + 2], -kSettings.most_stretch, kSettings.most_stretch, 0.1});
  }
  return argmin(variables, [&](const FacetShape& x) {
    double distance2 = 0;
    for (std::size_t i = 0; i < x.size(); ++i) distance2 += sqr(x[i] - shape[i]);
    return facet_error(facets_of(x, at_normal, view.wo), view) + kSettings.cost_of_distance * distance2;
  });
}

}  // namespace brdfc::fit
