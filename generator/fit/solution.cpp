// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solution.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "fit/settings.h"

namespace brdfc::fit {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::map<std::string, Rgb<double>> colours_of(const ParamValues& values) {
  std::map<std::string, Rgb<double>> out;
  for (const auto& [name, value] : values) out[name] = as_rgb(value);
  return out;
}

MatrixXd mixtures_of(const Terms& terms) {
  const auto n = Eigen::Index(terms.terms.size());
  if (terms.parameters.empty()) return MatrixXd::Identity(n, n);
  MatrixXd out(n, n);
  for (Eigen::Index row = 0; row < n; ++row) {
    const auto weights = terms.weights(colours_of(terms.terms[std::size_t(row)].judged));
    for (Eigen::Index t = 0; t < n; ++t) out(row, t) = weights[std::size_t(t)].r;
  }
  return out;
}

Solution solve_views(const std::vector<View>& views, std::size_t stride, Family family, const Terms& terms,
                     const std::function<FacetShape(std::size_t view)>& shape) {
  Solution out;
  const Moments& at_normal = views[0].lobe;
  for (std::size_t i = 0; i < views.size(); i += stride)
    out.views.push_back({&views[i], {}, facets_of(shape(i), at_normal, views[i].wo), {}, {}, {}});
  for_all(out.views.size(), [&](std::size_t i) {
    ViewSolution& c = out.views[i];
    c.lobes = place_lobes(family, c.view->lobe, at_normal, std::asin(c.view->wo.z));
    c.a = dictionary(c.lobes, c.facets, c.view->points, c.view->wo);
    // An estimate of a column's integral over all directions; the integral over those above the surface may be 0.
    c.scale = VectorXd::Constant(c.a.cols(), 1.0 / kRampSize);
    for (std::size_t j = 0; j < c.lobes.size(); ++j) {
      const Closure<double> l = lobe_closure(mirror_side(c.view->wo), c.lobes[j].offset, c.lobes[j].exponent);
      c.scale.segment(Eigen::Index(j * kRampSize), kRampSize) *= dot(l.normal, c.view->wo);
    }
    c.scale.tail(Eigen::Index(c.facets.size())).setOnes();
    c.a *= c.scale.cwiseInverse().asDiagonal();
  });

  for (ViewSolution& c : out.views) c.x = MatrixXd::Zero(c.a.cols(), c.view->f.cols());
  const Eigen::Index channels = views[0].f.cols();
  // Cycles samples diffuse_ramp with a cosine pdf, but its colours need not fall to 0 with the cosine. With a first
  // colour other than 0 the variance would be infinite.
  const Eigen::Index first_of_diffuse = Eigen::Index(out.views[0].lobes.size() * kRampSize);
  // Error and albedo of each column of f at each view.
  MatrixXd off(channels, Eigen::Index(out.views.size())), light = off;
  for_all(std::size_t(channels), [&](std::size_t index) {
    const auto channel = Eigen::Index(index);
    // Goes from one view to the next, so that neighbouring views have similar solutions and interpolation between them
    // is a good fit too.
    const auto facets_count = Eigen::Index(out.views[0].facets.size());
    VectorXd near = VectorXd::Zero(out.views[0].a.cols()), ridge = VectorXd::Constant(near.size(), kSettings.ridge);
    ridge.tail(facets_count).setConstant(kSettings.facet_ridge);
    for (std::size_t i = 0; i < out.views.size(); ++i) {
      ViewSolution& c = out.views[i];
      const VectorXd weight = weights_of(c.view->points), f = c.view->f.col(channel);
      c.x.col(channel) = near =
          solve(c.a, weight, f, near, ridge, facets_count, kSettings.most_of_facets, first_of_diffuse);
      off(channel, Eigen::Index(i)) = (c.a * near - f).cwiseAbs().dot(weight);
      light(channel, Eigen::Index(i)) = f.dot(weight);
    }
  });
  const MatrixXd mixtures = mixtures_of(terms);
  const Eigen::Index of_term = channels / mixtures.cols();
  for (Eigen::Index k = 0; k < of_term; ++k) {
    const auto rows = Eigen::seqN(k, mixtures.cols(), of_term);
    const MatrixXd off_here = off(rows, Eigen::all), light_here = light(rows, Eigen::all);
    const Eigen::ArrayXXd all_off = mixtures * off_here, all = mixtures * light_here;
    const Eigen::ArrayXd error = (all > 0).select(all_off / all.max(1e-300), 0 * all).rowwise().mean();
    out.error = std::max(out.error, error.maxCoeff());
  }
  for (ViewSolution& c : out.views) c.a.resize(0, 0);
  return out;
}

}  // namespace brdfc::fit
