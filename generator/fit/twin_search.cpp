// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/twin_search.h"

#include <algorithm>
#include <limits>

#include "core/parallel.h"

namespace brdfc::fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr TwinDictionary kDictionaries[] = {
    {{ClosureKind::Ggx, ClosureKind::Ggx, ClosureKind::Ggx}, {0, 0, 0}, 0.02},
    {{ClosureKind::Beckmann, ClosureKind::Beckmann, ClosureKind::Ggx}, {0, 0, 0}, 0.02},
    {{ClosureKind::Beckmann, ClosureKind::Beckmann, ClosureKind::Ggx}, {0, 0, 0}, 0.1},
    {{ClosureKind::Ggx, ClosureKind::Ggx, ClosureKind::Ggx}, {0, 0.3, 0.9}, 0.02},
};

/// The lowest lean that is allowed; a little below it the facets would turn away from the viewer.
double least_lean(const Vec3<double>& wo) { return std::max(-0.9 * wo.z / std::max(1 - wo.z, 1e-3), -2.0); }

/// Relative L1 error over all channels, the mean over the mixtures.
double error_of(const TwinDictionary& dictionary, const TwinShape& shape, const View& view, const MatrixXd& mixtures) {
  const MatrixXd a = twin_columns(dictionary, shape, view);
  const VectorXd weight = weights_of(view.points);
  const Eigen::Index terms = mixtures.cols(), channels = view.f.cols() / terms;
  MatrixXd off(view.f.rows(), view.f.cols());
  for (Eigen::Index c = 0; c < view.f.cols(); ++c)
    off.col(c) = a * twin_weights(a, view, c, VectorXd::Zero(a.cols()), kTwinSettings.slight_ridge) - view.f.col(c);
  const VectorXd light = view.f.transpose() * weight;
  double sum = 0;
  for (Eigen::Index m = 0; m < mixtures.rows(); ++m) {
    double of_all = 0, of_off = 0;
    for (Eigen::Index channel = 0; channel < channels; ++channel) {
      VectorXd mixed = VectorXd::Zero(off.rows());
      for (Eigen::Index t = 0; t < terms; ++t) {
        mixed += mixtures(m, t) * off.col(t * channels + channel);
        of_all += mixtures(m, t) * light[t * channels + channel];
      }
      of_off += mixed.cwiseAbs().dot(weight);
    }
    if (of_all > 0) sum += of_off / of_all / double(mixtures.rows());
  }
  return sum;
}

/// Roughness of facets whose lobe is as wide as cos^e about its axis, seen along the normal.
double roughness_of(double e) { return std::pow(1 / (2 * std::max(e, 0.5) + 1), 0.25); }

/// A better shape for a view than `shape`, which is first clamped to the view's bounds.
TwinShape improved(const TwinDictionary& dictionary, const TwinShape& shape, const View& view,
                   const MatrixXd& mixtures) {
  std::vector<Variable> variables;
  for (std::size_t j = 0; j < kTwinFacets; ++j) {
    const double* s = shape.data() + kTwinShape * j;
    // The step is in proportion to the lobe's width: larger steps would leave a narrow lobe.
    const double step = std::min(0.02, 0.5 * sqr(s[1]));
    variables.push_back({s[0], least_lean(view.wo), 1, step});
    variables.push_back({s[1], kTwinSettings.least_roughness, 1, 0.1 * s[1]});
    variables.push_back({s[2], 0, 1, step});
  }
  return argmin(variables, [&](const TwinShape& x) { return error_of(dictionary, x, view, mixtures); });
}

struct Found {
  std::vector<TwinShape> shapes;
  double error = 0;  ///< mean over the views
};
Found search(const TwinDictionary& dictionary, const std::vector<View>& views, const MatrixXd& mixtures) {
  Found found;
  const double e = views.front().lobe.narrow;
  TwinShape shape;
  const double widths[kTwinFacets] = {1, 0.5, 4};
  for (std::size_t j = 0; j < kTwinFacets; ++j)
    shape.insert(shape.end(),
                 {dictionary.lean[j], std::clamp(roughness_of(e / widths[j]), kTwinSettings.least_roughness, 1.0),
                  dictionary.spread});
  for (const View& v : views) {
    // A second search from the point where the first one ended, with large steps again, escapes many poor minima.
    for (std::size_t round = 0; round < kTwinSettings.rounds; ++round) shape = improved(dictionary, shape, v, mixtures);
    found.shapes.push_back(shape);
    found.error += error_of(dictionary, shape, v, mixtures) / double(views.size());
  }
  // Along the normal nothing leans, whatever the numbers say, so those of the next view are used.
  found.shapes[0] = found.shapes[1];
  return found;
}

}  // namespace

Closure<double> twin_facet(ClosureKind kind, double lean, double roughness, double spread, const Vec3<double>& wo) {
  const Vec3<double> n = {0, 0, 1};
  Closure<double> c(kind, Rgb<double>(1.0));
  c.normal = normalize(n * (1 - lean) + wo * lean + cross(n, wo) * spread);
  c.turned = true;
  c.alpha = sqr(roughness);
  return c;
}

MatrixXd twin_columns(const TwinDictionary& dictionary, const TwinShape& shape, const View& view) {
  MatrixXd a(Eigen::Index(view.points.wi.size()), Eigen::Index(kTwinFacets + 1));
  const Closure<double> matte(ClosureKind::Diffuse, Rgb<double>(1.0));
  for (std::size_t j = 0; j <= kTwinFacets; ++j) {
    const double* s = shape.data() + kTwinShape * j;
    const Closure<double> left = j < kTwinFacets ? twin_facet(dictionary.kinds[j], s[0], s[1], s[2], view.wo) : matte,
                          right = j < kTwinFacets ? twin_facet(dictionary.kinds[j], s[0], s[1], -s[2], view.wo) : matte;
    for (std::size_t p = 0; p < view.points.wi.size(); ++p) {
      const Vec3<double>& wi = view.points.wi[p];
      a(Eigen::Index(p), Eigen::Index(j)) = (evaluate(left, wi, view.wo).r + evaluate(right, wi, view.wo).r) / 2;
    }
  }
  return a;
}

VectorXd twin_weights(const MatrixXd& a, const View& view, Eigen::Index column, const VectorXd& near, double ridge) {
  return solve(a, weights_of(view.points), view.f.col(column), near, VectorXd::Constant(a.cols(), ridge), a.cols(),
               std::numeric_limits<double>::infinity(), std::nullopt);
}

TwinShapes find_twin_shapes(const std::vector<std::vector<View>>& views, const MatrixXd& mixtures) {
  constexpr std::size_t kCount = std::size(kDictionaries);
  const std::size_t places = views.size();
  std::vector<std::size_t> trials = {places / 2};
  if (places > 3) trials.insert(trials.end(), {places / 4, 3 * places / 4});
  std::vector<Found> found(kCount * trials.size());
  for_all(found.size(),
          [&](std::size_t i) { found[i] = search(kDictionaries[i % kCount], views[trials[i / kCount]], mixtures); });
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t d = 0; d < kCount; ++d) {
    double error = 0;
    for (std::size_t t = 0; t < trials.size(); ++t) error += found[t * kCount + d].error;
    if (error < least) least = error, best = d;
  }
  std::size_t closest = 0;
  for (std::size_t t = 1; t < trials.size(); ++t)
    if (found[t * kCount + best].error < found[closest * kCount + best].error) closest = t;
  const std::size_t start = trials[closest];
  TwinShapes out{&kDictionaries[best], std::vector<std::vector<TwinShape>>(places)};
  out.shapes[start] = std::move(found[closest * kCount + best].shapes);
  for (std::vector<TwinShape>& of_place : out.shapes) of_place.resize(out.shapes[start].size());
  // Goes from one place to the next, so that all shapes belong to the same local minimum: interpolating between shapes
  // of different minima gives a poor fit.
  for_all(out.shapes[start].size(), [&](std::size_t v) {
    const auto go_on = [&](std::size_t from, std::size_t to) {
      TwinShape shape = out.shapes[from][v];
      const double narrower =
          roughness_of(views[to].front().lobe.narrow) / roughness_of(views[from].front().lobe.narrow);
      for (std::size_t j = 0; j < kTwinFacets; ++j) {
        double* s = shape.data() + kTwinShape * j;
        s[0] *= sqr(narrower);
        s[1] = std::clamp(s[1] * narrower, kTwinSettings.least_roughness, 1.0);
        s[2] = std::min(s[2] * sqr(narrower), 1.0);
      }
      for (std::size_t round = 0; round < kTwinSettings.rounds; ++round)
        shape = improved(*out.dictionary, shape, views[to][v], mixtures);
      out.shapes[to][v] = std::move(shape);
    };
    for (std::size_t k = start + 1; k < places; ++k) go_on(k - 1, k);
    for (std::size_t k = start; k-- > 0;) go_on(k + 1, k);
  });
  for (std::vector<TwinShape>& of_place : out.shapes) of_place[0] = of_place[1];
  return out;
}

}  // namespace brdfc::fit
