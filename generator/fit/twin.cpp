// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/twin.h"

#include <algorithm>
#include <limits>

#include "core/parallel.h"
#include "fit/roles.h"
#include "measure/bound_model.h"

namespace brdfc::fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Leaning and roughness are sought at every third knot, with fewer points; weights at all.
constexpr int kStride = 3, kFewPoints = 800, kPoints = 3000, kRounds = 2;
/// The view of the first knot, which is level with the surface, is this much above it.
constexpr double kLastCosine = 2e-3;
constexpr std::size_t kFacets = 3;
constexpr double kLeastRoughness = 0.03;
/// How strongly a view is held to the weights of the one above it: what is as good either way would show as rings.
constexpr double kRidge = 1e-3, kSlightRidge = 1e-5;

/// Pairs of facet lobes, and where the search begins: how far each leans towards the viewer, and all to the sides.
struct Dictionary {
  std::array<ClosureKind, kFacets> kinds;
  std::array<double, kFacets> lean;
  double spread;
};
constexpr Dictionary kDictionaries[] = {
    {{ClosureKind::Ggx, ClosureKind::Ggx, ClosureKind::Ggx}, {0, 0, 0}, 0.02},
    {{ClosureKind::Beckmann, ClosureKind::Beckmann, ClosureKind::Ggx}, {0, 0, 0}, 0.02},
    {{ClosureKind::Beckmann, ClosureKind::Beckmann, ClosureKind::Ggx}, {0, 0, 0}, 0.1},
    {{ClosureKind::Ggx, ClosureKind::Ggx, ClosureKind::Ggx}, {0, 0.3, 0.9}, 0.02},
};

/// Lean, roughness and spread of each pair of facet lobes, one after the other.
using Shape = std::vector<double>;
constexpr std::size_t kShape = 3;

/// One of a pair, on the side of the plane of incidence that the sign of `spread` says.
Closure<double> facet(ClosureKind kind, double lean, double roughness, double spread, const Vec3<double>& wo) {
  const Vec3<double> n = {0, 0, 1};
  Closure<double> c(kind, Rgb<double>(1.0));
  c.normal = normalize(n * (1 - lean) + wo * lean + cross(n, wo) * spread);
  c.turned = true;
  c.alpha = sqr(roughness);
  return c;
}

/// A lean below which the facets turn away from the viewer, and a little more.
double least_lean(const Vec3<double>& wo) { return std::max(-0.9 * wo.z / std::max(1 - wo.z, 1e-3), -2.0); }

/// What each closure gives at the points, the matte one last; facets of which nothing is above the surface give 0.
MatrixXd columns(const Dictionary& dictionary, const Shape& shape, const View& view) {
  MatrixXd a(Eigen::Index(view.points.wi.size()), Eigen::Index(kFacets + 1));
  const Closure<double> matte(ClosureKind::Diffuse, Rgb<double>(1.0));
  for (std::size_t j = 0; j <= kFacets; ++j) {
    const double* s = shape.data() + kShape * j;
    const Closure<double> left = j < kFacets ? facet(dictionary.kinds[j], s[0], s[1], s[2], view.wo) : matte,
                          right = j < kFacets ? facet(dictionary.kinds[j], s[0], s[1], -s[2], view.wo) : matte;
    for (std::size_t p = 0; p < view.points.wi.size(); ++p) {
      const Vec3<double>& wi = view.points.wi[p];
      a(Eigen::Index(p), Eigen::Index(j)) = (evaluate(left, wi, view.wo).r + evaluate(right, wi, view.wo).r) / 2;
    }
  }
  return a;
}

VectorXd weights_for(const MatrixXd& a, const View& view, Eigen::Index channel, const VectorXd& near, double ridge) {
  return solve(a, weights_of(view.points), view.f.col(channel), near, VectorXd::Constant(a.cols(), ridge), a.cols(),
               std::numeric_limits<double>::infinity(), std::nullopt);
}

/// Relative L1, over all channels.
double error_of(const Dictionary& dictionary, const Shape& shape, const View& view) {
  const MatrixXd a = columns(dictionary, shape, view);
  const VectorXd weight = weights_of(view.points);
  double off = 0, light = 0;
  for (Eigen::Index channel = 0; channel < view.f.cols(); ++channel) {
    off += (a * weights_for(a, view, channel, VectorXd::Zero(a.cols()), kSlightRidge) - view.f.col(channel))
               .cwiseAbs()
               .dot(weight);
    light += view.f.col(channel).dot(weight);
  }
  return light > 0 ? off / light : 0;
}

/// Roughness of facets whose lobe is as wide as cos^e about its axis, seen along the normal.
double roughness_of(double e) { return std::pow(1 / (2 * std::max(e, 0.5) + 1), 0.25); }

/// A better shape for a view than `shape`, which is moved into the view's bounds.
Shape improved(const Dictionary& dictionary, const Shape& shape, const View& view) {
  std::vector<Variable> variables;
  for (std::size_t j = 0; j < kFacets; ++j) {
    const double* s = shape.data() + kShape * j;
    variables.push_back({s[0], least_lean(view.wo), 1, 0.02});
    variables.push_back({s[1], kLeastRoughness, 1, 0.1 * s[1]});
    variables.push_back({s[2], 0, 1, 0.02});
  }
  return argmin(variables, [&](const Shape& x) { return error_of(dictionary, x, view); });
}

/// Shapes of every kStride-th knot, from that along the normal down.
struct Found {
  std::vector<Shape> shapes;
  double error = 0;  ///< mean over the views
};
Found search(const Dictionary& dictionary, const std::vector<View>& views) {
  Found found;
  const double e = views.front().lobe.narrow;
  Shape shape;
  const double widths[kFacets] = {1, 0.5, 4};
  for (std::size_t j = 0; j < kFacets; ++j)
    shape.insert(shape.end(), {dictionary.lean[j], std::clamp(roughness_of(e / widths[j]), kLeastRoughness, 1.0),
                               dictionary.spread});
  for (const View& v : views) {
    // A search that begins again where it ended, with wide steps, leaves many a bad place.
    for (int round = 0; round < kRounds; ++round) shape = improved(dictionary, shape, v);
    found.shapes.push_back(shape);
    found.error += error_of(dictionary, shape, v) / double(views.size());
  }
  // Along the normal nothing leans, whatever the numbers: those of the next view go on.
  found.shapes[0] = found.shapes[1];
  return found;
}

Vec3<double> view_at(int knot) {
  const double z = std::max(double(knot) / (kTwinKnots - 1), kLastCosine);
  return {std::sqrt(1 - z * z), 0, z};
}

/// One of three channels over the view, or one for all.
Rgb<double> colour(const Channels& channels, const std::array<double, 1>& at) {
  if (channels.size() == 1) return Rgb<double>(lookup(channels[0], at));
  return {lookup(channels[0], at), lookup(channels[1], at), lookup(channels[2], at)};
}

}  // namespace

Twin::Twin(const Model& model, const ParamValues& values) {
  // Searched for without the factors, so that a material's twin is the same whether they are known or sockets.
  const auto [white, factor] = without_factors(model, values);
  const measure::BoundModel bound = measure::bind_model(model, white);
  std::vector<View> views(kTwinKnots);
  for_all(kTwinKnots, [&](std::size_t k) { views[k] = view_of(bound, view_at(int(k)), kPoints); });
  // A mirror has a colour of its own.
  if (!model.has_mirror()) tint_ = make_grey(views);
  const Eigen::Index channels = views.front().f.cols();

  // From the normal down, for what is found of one view is where the next one starts.
  std::vector<View> few;
  for (int k = kTwinKnots - 1; k >= 0; k -= kStride) {
    View v = view_of(bound, view_at(k), kFewPoints, views[std::size_t(k)].lobe);
    if (tint_) v.f = brightest(v.f);
    few.push_back(std::move(v));
  }
  std::vector<Found> found(std::size(kDictionaries));
  for_all(found.size(), [&](std::size_t i) { found[i] = search(kDictionaries[i], few); });
  const auto best =
      std::min_element(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.error < b.error; });
  const Dictionary& dictionary = kDictionaries[best - found.begin()];

  // Rows are knots; columns are numbers of the shape, weights channel by channel, and channels of the albedo.
  const Eigen::Index closures_count = Eigen::Index(kFacets + 1);
  MatrixXd shapes(kTwinKnots, Eigen::Index(kShape * kFacets)), weights(kTwinKnots, closures_count * channels),
      light(kTwinKnots, channels), x = MatrixXd::Zero(closures_count, channels);
  // Along the normal there is none above: a few views from below lead there.
  constexpr int kLead = 9;
  for (int step = -kLead; step < kTwinKnots; ++step) {
    const auto i = std::size_t(std::abs(step));
    const std::size_t k = kTwinKnots - 1 - i, at = std::min(i / kStride, best->shapes.size() - 2);
    const double t = double(i) / kStride - double(at);
    Shape shape;
    for (std::size_t j = 0; j < kShape * kFacets; ++j)
      shape.push_back(best->shapes[at][j] * (1 - t) + best->shapes[at + 1][j] * t);
    const View& view = views[k];
    const MatrixXd a = columns(dictionary, shape, view);
    for (Eigen::Index channel = 0; channel < channels; ++channel)
      x.col(channel) = weights_for(a, view, channel, x.col(channel), step == -kLead ? kSlightRidge : kRidge);
    const auto row = Eigen::Index(k);
    shapes.row(row) = Eigen::Map<const VectorXd>(shape.data(), Eigen::Index(shape.size()));
    weights.row(row) = x.reshaped();
    light.row(row) = view.f.transpose() * weights_of(view.points);
  }
  if (tint_) {
    tint_ = *tint_ * factor;
  } else {
    const double of_channel[] = {factor.r, factor.g, factor.b};
    for (Eigen::Index channel = 0; channel < channels; ++channel) {
      weights.middleCols(channel * closures_count, closures_count) *= of_channel[channel];
      light.col(channel) *= of_channel[channel];
    }
  }
  const auto table = [](const std::string& name, const auto& column) {
    return make_table(name, {even_axis("cos_theta_o", kTwinKnots)}, {column.begin(), column.end()});
  };
  for (std::size_t j = 0; j <= kFacets; ++j) {
    TwinClosure part{j < kFacets ? dictionary.kinds[j] : ClosureKind::Diffuse, {}, {}, {}, {}};
    if (j < kFacets) {
      const auto number = Eigen::Index(kShape * j);
      part.lean = table(fmt::format("lean_of_{}", j), shapes.col(number));
      part.roughness = table(fmt::format("roughness_of_{}", j), shapes.col(number + 1));
      part.spread = table(fmt::format("spread_of_{}", j), shapes.col(number + 2));
    }
    for (Eigen::Index channel = 0; channel < channels; ++channel)
      part.weight.push_back(
          table(fmt::format("weight_of_{}", j), weights.col(channel * closures_count + Eigen::Index(j))));
    parts_.push_back(std::move(part));
  }
  if (model.has_mirror()) {
    MatrixXd mirror(kTwinKnots, channels);
    for (int k = 0; k < kTwinKnots; ++k) {
      const Rgb<double> m = bound.brdf->mirror(view_at(k));
      mirror.row(k) << m.r, m.g, m.b;
    }
    TwinClosure part{ClosureKind::Reflection, {}, {}, {}, {}};
    for (const auto& channel : mirror.colwise()) part.weight.push_back(table("weight_of_mirror", channel));
    parts_.push_back(std::move(part));
  }
  for (const auto& channel : light.colwise()) albedo_.push_back(table("albedo", channel));
  errors_ = view_errors(measure::bind_model(model, values), [&](const Vec3<double>& wo) { return closures(wo); });
}

ClosureSum<double> Twin::closures(const Vec3<double>& wo) const {
  const std::array<double, 1> at = {wo.z};
  ClosureSum<double> sum;
  for (const TwinClosure& part : parts_) {
    const Rgb<double> weight = colour(part.weight, at) * tint_.value_or(Rgb<double>(1.0));
    if (!has_facets(part.kind)) {
      sum.emplace_back(part.kind, weight);
      continue;
    }
    for (const double side : {1, -1}) {
      sum.push_back(
          facet(part.kind, lookup(part.lean, at), lookup(part.roughness, at), side * lookup(part.spread, at), wo));
      sum.back().weight = weight / 2.0;
    }
  }
  return sum;
}

const Twin& twin_of(const Model& model, const ParamValues& values) {
  return made_once<Twin>(model, roles_of(model, values).fitted());
}

}  // namespace brdfc::fit
