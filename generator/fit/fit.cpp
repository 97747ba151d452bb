// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "core/data_dir.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/sequence.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "model/horizon.h"
#include "model/power_lobe.h"
#include "model/sampling.h"
#include "tables/table_file.h"

namespace brdfc::fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kViews = 33;
constexpr std::size_t kTrialStride = 4;
constexpr int kPoints = 3000;
/// The axis has knots at its quarters, and more half way between two where the sum would be further off there than it
/// is at the two, down to 1 / kSteps.
constexpr int kFirstSteps = 4, kSteps = 32;
constexpr double kWorseBetween = 1.25, kSlightlyOff = 0.005;
/// What there are terms by, where closures are placed: little, because with much of a reflectance at normal incidence
/// they all follow the lobe that it multiplies, and what is left for it to be dark gets none.
constexpr double kSome = 0.05;
/// Closure columns are scaled to unit integral, so that this is a share of the light: what the fit may not gain by
/// larger colours of opposite signs.
constexpr double kRidge = 1e-5;
/// Those of facets are not negative: they gain nothing, and a strong pull towards the view above would keep light from
/// them that is theirs.
constexpr double kFacetRidge = 1e-8;
/// Of the albedo: what weights of facets add up to, so that those of all closures can add up to it. What facets lose
/// below the surface and behind each other is left to the ramps.
constexpr double kMostOfFacets = 0.99;
/// Searches for the shape of facets, by view.
constexpr int kRounds = 2;
/// What a shape's distance from that where its search began costs, in units of the error by the square of its numbers:
/// neighbours that are alike leave little between them.
constexpr double kDrag = 0.01;
/// Searches from flatter facets: how much flatter, and the share of the error at which what they find is taken. Little
/// better would be worse between two views.
constexpr double kFlatter = 1, kClearlyBetter = 0.9;

struct Placed {
  double offset, exponent;
};
/// Which closures a fit uses.
enum class Family {
  Moving,     ///< seven phong_ramps about the axis of the moments
  Fixed,      ///< seven about the mirror direction, of widths that do not depend on the view
  Microfacet  ///< five from the axis of the moments towards the normal, and facets that lean away from the viewer
};
constexpr Family kFamilies[] = {Family::Moving, Family::Fixed, Family::Microfacet};
/// How far lobes lean at most towards the viewer and past it: their normals by half of it. Closures whose normals lie
/// below the surface are others in Blender 5.0 and 5.2 than in 4.5.
constexpr double kMostBack = 2.8;
/// How far lobes lean towards the surface and below it, in units of the viewer's height.
constexpr double kBelow = 0.8, kFarBelow = 1.3;
/// Three widths on the axis, two pairs beside it; or, as what facets leave at grazing views lies on one side, wider
/// ones there. `height` is the viewer's angle above the surface.
std::vector<Placed> placed(Family family, const Moments& here, const Moments& at_normal, double height) {
  const Moments& m = family == Family::Fixed ? at_normal : here;
  const double offset = family == Family::Fixed ? 0 : m.offset;
  const double e = std::max(m.narrow, 0.5), s = 1 / std::sqrt(std::max(m.wide, 0.5));
  std::vector<Placed> lobes = {{offset, e}, {offset + 0.7 * s, e}, {offset - 0.7 * s, e}};
  if (family == Family::Microfacet)
    lobes.insert(lobes.end(), {{offset + 1.4 * s, e / 4}, {offset + 2.8 * s, e / 16}});
  else
    lobes.insert(lobes.end(), {{offset, e / 4}, {offset, 2 * e}, {offset + 1.5 * s, e / 2}, {offset - 1.5 * s, e / 2}});
  // At -2 times the height, opposite the viewer, a closure's normal would turn over. What would lie below the surface
  // at low views lies in two places, so that two closures are not the same.
  for (Placed& l : lobes)
    l.offset = std::clamp(l.offset, (l.offset < offset - s ? -kFarBelow : -kBelow) * height, kMostBack);
  return lobes;
}

/// Facets whose lobe about the mirror direction leans by `offset`, as those of phong_ramps do. Their roughness is
/// alpha * stretch in the plane of incidence, alpha / stretch across it.
struct Facet {
  ClosureKind kind;
  double offset, alpha, stretch;
};
/// As many points tell how facets lie.
constexpr std::size_t kFewerPoints = 4;
/// How far facets lean, in units of the viewer's height times the sine of its angle: nothing where it looks along the
/// normal. At -2 they would turn away from the viewer. Towards it they do not lean: Blender 4.5 keeps rays between the
/// surface and a facet's horizon, though it evaluates them as 0.
constexpr double kMostLean = -1.7;
constexpr double kLeastAlpha = 1e-3;
/// Of the logarithm of the stretch of facets, in units of the square of the view's sine: along the normal nothing is
/// stretched.
constexpr double kMostStretch = 3;
/// Of roots of alpha: to that of the lobe at normal incidence, and of the second facets to those of the first.
constexpr double kLeastRatio = 0.3, kMostRatio = 2;
/// Facets are sought at as many places of the axis, and at as many-th views.
constexpr std::size_t kShapePlaces = 9, kShapeStride = 2;

/// The normal, turned away from mirror_side() by half of `offset`: then a lobe about its mirror direction has its axis
/// at beside_mirror(wo, offset).
template <class T> Vec3<T> leaning(const Vec3<T>& side, const T& offset) {
  const T half = offset / T(2);
  Vec3<T> n = side * -sin(half);
  n.z = cos(half);
  return n;
}

/// The closure of a lobe without colours.
template <class T> Closure<T> lobe_closure(const Vec3<T>& side, const T& offset, const T& exponent) {
  Closure<T> c(ClosureKind::PhongRamp, Rgb<T>(T(1)));
  c.normal = leaning(side, offset);
  c.turned = true;
  c.exponent = exponent;
  return c;
}

template <class T>
Closure<T> facet_closure(ClosureKind kind, const Vec3<T>& side, const T& offset, const T& alpha, const T& stretch) {
  Closure<T> c(kind, Rgb<T>(T(1)));
  c.normal = leaning(side, offset);
  c.turned = true;
  c.alpha = alpha * stretch;
  c.alpha_across = alpha / stretch;
  c.tangent = cross(Vec3<T>{-side.y, side.x, T(0)}, c.normal);
  c.stretched = Tangent::View;
  return c;
}

/// What each entry of each ramp gives at the points: lobes, the diffuse_ramp, and the facets.
MatrixXd dictionary(const std::vector<Placed>& lobes, const std::vector<Facet>& facets, const Points& points,
                    const Vec3<double>& wo) {
  const Vec3<double> side = mirror_side(wo);
  std::vector<Closure<double>> ramps;
  for (const Placed& l : lobes) ramps.push_back(lobe_closure(side, l.offset, l.exponent));
  ramps.emplace_back(ClosureKind::DiffuseRamp, Rgb<double>(1.0));
  MatrixXd a(Eigen::Index(points.wi.size()), Eigen::Index(ramps.size() * kRampSize + facets.size()));
  Eigen::Index column = 0;
  for (Closure<double>& c : ramps) {
    // Three entries at once, one in each channel.
    for (int k = 0; k < kRampSize; k += 3) {
      for (int i = 0; i < kRampSize; ++i)
        c.ramp[std::size_t(i)] = {double(i == k), double(i == k + 1), double(i == k + 2)};
      for (std::size_t p = 0; p < points.wi.size(); ++p) {
        const Rgb<double> v = evaluate(c, points.wi[p], wo);
        const double channels[] = {v.r, v.g, v.b};
        for (int i = 0; i < 3 && k + i < kRampSize; ++i) a(Eigen::Index(p), column + k + i) = channels[i];
      }
    }
    column += kRampSize;
  }
  for (const Facet& f : facets) {
    const Closure<double> c = facet_closure(f.kind, side, f.offset, f.alpha, f.stretch);
    for (std::size_t p = 0; p < points.wi.size(); ++p) a(Eigen::Index(p), column) = evaluate(c, points.wi[p], wo).r;
    ++column;
  }
  return a;
}

/// Of the last view, as view() and place() measure heights.
double last_place() { return std::sqrt(2 * kInvPi * std::asin(kLowestView)); }
/// How far along its axis of the tables, or along a `part` of it from `first` on, a view is: knots crowd towards the
/// horizon, where lobes change most.
template <class T> T place(const Vec3<T>& wo, double first = 0, double part = 1) {
  // The angle above the surface, from its half, keeps its digits at the horizon.
  const T height = named("height_o", T(2) * atan(wo.z / (T(1) + sqrt(sin2_theta(wo)))));
  const double whole = 1 - last_place();
  return (T(1 - whole * first) - sqrt(maximum(height, T(0)) * T(2 * kInvPi))) / T(whole * part);
}
/// The view at which place() is x.
Vec3<double> view(double x) {
  const double height = kPi / 2 * sqr(1 - x * (1 - last_place()));
  return {std::cos(height), 0, std::sin(height)};
}

/// What was found for a view.
struct Cell {
  const View* view;
  std::vector<Placed> lobes;
  std::vector<Facet> facets;
  MatrixXd a;
  VectorXd scale;  ///< what the columns were divided by
  MatrixXd x;      ///< a column a channel
};
struct Fitted {
  std::vector<Cell> cells;
  double error = 0;  ///< relative L1, mean over the views
};

std::map<std::string, Rgb<double>> shares(const ParamValues& values) {
  std::map<std::string, Rgb<double>> out;
  for (const auto& [name, value] : values) out[name] = as_rgb(value);
  return out;
}

/// How much of each term, a column each, is in each of the mixtures that a fit is judged by.
MatrixXd judged(const Terms& terms) {
  const auto n = Eigen::Index(terms.terms.size());
  if (terms.parameters.empty()) return MatrixXd::Identity(n, n);
  MatrixXd out(n, n);
  for (Eigen::Index row = 0; row < n; ++row) {
    const auto weights = terms.weights(shares(terms.terms[std::size_t(row)].judged));
    for (Eigen::Index t = 0; t < n; ++t) out(row, t) = weights[std::size_t(t)].r;
  }
  return out;
}

/// What facets are sought by: how far each leans, the root of its alpha in units of the one before, the first one's of
/// that which gives the lobe at normal incidence its width, and how much it is stretched.
using Shape = std::vector<double>;
constexpr std::size_t kNumbers = 3;
const Shape kFirstShape = {0, 1, 0, 0, 0.85, 0};
std::vector<Facet> facets(const Shape& shape, const Moments& at_normal, const Vec3<double>& wo) {
  std::vector<Facet> out;
  double root = std::pow(2 * std::max(at_normal.narrow, 0.5) + 1, -0.25);
  for (std::size_t j = 0; j < shape.size(); j += kNumbers) {
    root *= shape[j + 1];
    const double sin2Theta = sin2_theta(wo), alpha = std::clamp(sqr(root), kLeastAlpha, 1.0),
                 most = std::min(1 / alpha, alpha / kLeastAlpha);
    out.push_back({ClosureKind::Beckmann, shape[j] * std::asin(wo.z) * std::sqrt(sin2Theta), alpha,
                   std::clamp(std::exp(shape[j + 2] * sin2Theta), 1 / most, most)});
  }
  return out;
}

/// Relative L1 of facets and a matte closure, mean over the columns of f.
double error_of(const std::vector<Facet>& facets, const View& view) {
  const auto n = Eigen::Index(view.points.wi.size()), count = Eigen::Index(facets.size());
  MatrixXd a(n, count + 1);
  a.leftCols(count) = dictionary({}, facets, view.points, view.wo).rightCols(count);
  for (Eigen::Index i = 0; i < n; ++i) a(i, count) = view.points.wi[std::size_t(i)].z * kInvPi;
  const VectorXd weight = weights_of(view.points);
  double error = 0;
  for (const auto& column : view.f.colwise()) {
    const VectorXd f = column;
    const VectorXd x = solve(a, weight, f, VectorXd::Zero(a.cols()), VectorXd::Constant(a.cols(), kFacetRidge),
                             a.cols(), std::numeric_limits<double>::infinity(), std::nullopt);
    if (const double light = f.dot(weight); light > 0)
      error += (a * x - f).cwiseAbs().dot(weight) / light / double(view.f.cols());
  }
  return error;
}

/// A better shape for a view than `shape`.
Shape improved(const Shape& shape, const Moments& at_normal, const View& whole) {
  View view{whole.wo, whole.lobe, {}, {}};
  for (std::size_t i = 0; i < whole.points.wi.size(); i += kFewerPoints) {
    view.points.wi.push_back(whole.points.wi[i]);
    view.points.weight.push_back(whole.points.weight[i] * double(kFewerPoints));
  }
  view.f = whole.f(Eigen::seqN(0, Eigen::Index(view.points.wi.size()), Eigen::Index(kFewerPoints)), Eigen::all);
  std::vector<Variable> variables;
  for (std::size_t j = 0; j < shape.size(); j += kNumbers) {
    variables.push_back({shape[j], kMostLean, 0, 0.1});
    variables.push_back({shape[j + 1], kLeastRatio, j == 0 ? kMostRatio : 0.9, 0.1 * shape[j + 1]});
    variables.push_back({shape[j + 2], -kMostStretch, kMostStretch, 0.1});
  }
  return argmin(variables, [&](const Shape& x) {
    double distance2 = 0;
    for (std::size_t i = 0; i < x.size(); ++i) distance2 += sqr(x[i] - shape[i]);
    return error_of(facets(x, at_normal, view.wo), view) + kDrag * distance2;
  });
}

/// Fits every `stride`-th view, from that along the normal on, to the terms that its columns are.
/// `shape` is that of facets by view; empty for a family that has none.
Fitted fit_views(const std::vector<View>& views, std::size_t stride, Family family, const Terms& terms,
                 const std::function<Shape(std::size_t view)>& shape) {
  Fitted out;
  const Moments& at_normal = views[0].lobe;
  for (std::size_t i = 0; i < views.size(); i += stride)
    out.cells.push_back({&views[i], {}, facets(shape(i), at_normal, views[i].wo), {}, {}, {}});
  for_all(out.cells.size(), [&](std::size_t i) {
    Cell& c = out.cells[i];
    c.lobes = placed(family, c.view->lobe, at_normal, std::asin(c.view->wo.z));
    c.a = dictionary(c.lobes, c.facets, c.view->points, c.view->wo);
    // About the integral of a column over all directions: that over those above the surface may vanish.
    c.scale = VectorXd::Constant(c.a.cols(), 1.0 / kRampSize);
    for (std::size_t j = 0; j < c.lobes.size(); ++j) {
      const Closure<double> l = lobe_closure(mirror_side(c.view->wo), c.lobes[j].offset, c.lobes[j].exponent);
      c.scale.segment(Eigen::Index(j * kRampSize), kRampSize) *= dot(l.normal, c.view->wo);
    }
    c.scale.tail(Eigen::Index(c.facets.size())).setOnes();
    c.a *= c.scale.cwiseInverse().asDiagonal();
  });

  for (Cell& c : out.cells) c.x = MatrixXd::Zero(c.a.cols(), c.view->f.cols());
  const Eigen::Index channels = views[0].f.cols();
  // Cycles draws diffuse_ramp in proportion to a cosine that its colours need not have: with a first colour other than
  // 0 the variance would be infinite.
  const Eigen::Index first_of_diffuse = Eigen::Index(out.cells[0].lobes.size() * kRampSize);
  // Differences of columns and their light, by cell.
  MatrixXd off(channels, Eigen::Index(out.cells.size())), light = off;
  for_all(std::size_t(channels), [&](std::size_t index) {
    const auto channel = Eigen::Index(index);
    // From one view to the next, so that neighbours are alike and what lies between them is a fit too.
    const auto facets_count = Eigen::Index(out.cells[0].facets.size());
    VectorXd near = VectorXd::Zero(out.cells[0].a.cols()), ridge = VectorXd::Constant(near.size(), kRidge);
    ridge.tail(facets_count).setConstant(kFacetRidge);
    for (std::size_t i = 0; i < out.cells.size(); ++i) {
      Cell& c = out.cells[i];
      const VectorXd weight = weights_of(c.view->points), f = c.view->f.col(channel);
      c.x.col(channel) = near = solve(c.a, weight, f, near, ridge, facets_count, kMostOfFacets, first_of_diffuse);
      off(channel, Eigen::Index(i)) = (c.a * near - f).cwiseAbs().dot(weight);
      light(channel, Eigen::Index(i)) = f.dot(weight);
    }
  });
  const MatrixXd mixtures = judged(terms);
  const Eigen::Index of_term = channels / mixtures.cols();
  for (Eigen::Index k = 0; k < of_term; ++k) {
    const auto rows = Eigen::seqN(k, mixtures.cols(), of_term);
    const MatrixXd off_here = off(rows, Eigen::all), light_here = light(rows, Eigen::all);
    const Eigen::ArrayXXd all_off = mixtures * off_here, all = mixtures * light_here;
    const Eigen::ArrayXd error = (all > 0).select(all_off / all.max(1e-300), 0 * all).rowwise().mean();
    out.error = std::max(out.error, error.maxCoeff());
  }
  for (Cell& c : out.cells) c.a.resize(0, 0);
  return out;
}

struct ScaledModel {
  measure::BoundModel model;
  double scale;  ///< what its f has to be divided by
};
/// The views of a fit, for one set of parameters: f of each of `terms`, at points where `some` of all is seen.
std::vector<View> views_of(const measure::BoundModel& some, const std::vector<ScaledModel>& terms) {
  std::vector<View> views(kViews);
  for_all(kViews, [&](std::size_t i) {
    View& v = views[i] = seen(some, view(double(i) / (kViews - 1)), kPoints);
    if (terms.empty()) return;
    v.f.resize(v.f.rows(), Eigen::Index(3 * terms.size()));
    for (std::size_t t = 0; t < terms.size(); ++t)
      v.f.middleCols(Eigen::Index(3 * t), 3) = scattering(terms[t].model, v.points, v.wo) / terms[t].scale;
  });
  return views;
}

}  // namespace

FitAxis fit_axis(const ParamInfo& p) {
  const ScaledRange slider = p.slider();
  return {p.name, slider.low, slider.high, slider.scale};
}

double FitAxis::at(double x) const { return ScaledRange{scale, low, high}.at(x); }

template <class T> T FitAxis::place(const T& value) const {
  const double first = to_scale(scale, low), span = to_scale(scale, high) - first;
  return (to_scale(scale, minimum(maximum(value, T(low)), T(high))) - T(first)) * T(1 / span);
}
template double FitAxis::place(const double&) const;
template Expr FitAxis::place(const Expr&) const;

Varied<double> Fit::varied(const ParamValues& values) const {
  Varied<double> out;
  if (axis_) out.number = std::get<double>(values.at(axis_->parameter));
  for (const std::string& name : terms_.parameters) out.parameters[name] = as_rgb(values.at(name));
  return out;
}

namespace {

std::array<double*, 6> numbers_of(ViewError& e) {
  return {&e.cos_theta_o, &e.relative_l1, &e.relative_l2, &e.albedo, &e.negative, &e.number};
}

/// A model at places of the axis: 0 without one.
class Knots {
 public:
  /// `grey`: one column of f that serves all channels is sought.
  Knots(const Model& model, const ParamValues& values, const std::optional<FitAxis>& axis, const Terms& terms,
        bool grey)
      : model_(model), values_(values), axis_(axis), terms_(terms), grey_(grey) {}

  /// With these values of what there are terms by.
  measure::BoundModel bound(double x, const ParamValues& of_terms) const {
    ParamValues values = values_;
    if (axis_) values[axis_->parameter] = axis_->at(x);
    for (const auto& [name, value] : of_terms) values[name] = value;
    return measure::bind_model(model_, values);
  }

  /// Sees the model at these places. False where it is not grey there, or of another tint than elsewhere.
  bool see(const std::vector<double>& places) {
    std::vector<View> fresh;
    std::vector<double> at;
    for (const double x : places) {
      if (views_.count(x)) continue;
      at.push_back(x);
      std::ranges::move(views_at(x), std::back_inserter(fresh));
    }
    if (at.empty()) return true;
    if (grey_) {
      const std::optional<Rgb<double>> found = make_grey(fresh);
      if (!found || (tint_ && !(measure::relative(*found, *tint_) < 1e-6))) return false;
      tint_ = found;
    }
    for (std::size_t i = 0; i < at.size(); ++i) {
      const auto first = fresh.begin() + std::ptrdiff_t(i * kViews);
      views_[at[i]].assign(std::make_move_iterator(first), std::make_move_iterator(first + kViews));
    }
    return true;
  }

  const std::optional<Rgb<double>>& tint() const { return tint_; }
  const std::vector<View>& views(double x) const { return views_.at(x); }

  /// Seeks shapes of facets, at few places and views, from one to the next, so that all lie in the same valley: between
  /// shapes that do not, no sum is close. Returns what see() does.
  bool find_shapes() {
    const std::size_t last = axis_ ? kShapePlaces - 1 : 0, middle = last / 2;
    std::vector<double> places;
    for (std::size_t k = 0; k <= last; ++k) places.push_back(axis_ ? double(k) / double(last) : 0);
    if (!see(places)) return false;
    shapes_.assign(places.size(), std::vector<Shape>(kViews / kShapeStride + 1, kFirstShape));
    const auto search = [&](std::size_t k, std::size_t v, const Shape& begin) {
      const std::vector<View>& seen = views(places[k]);
      shapes_[k][v] = improved(begin, seen[0].lobe, seen[v * kShapeStride]);
    };
    const auto error = [&](std::size_t v, const Shape& shape) {
      const std::vector<View>& seen = views(places[middle]);
      const View& view = seen[v * kShapeStride];
      return error_of(facets(shape, seen[0].lobe, view.wo), view);
    };
    for (std::size_t v = 0; v < shapes_[middle].size(); ++v) {
      // A search that begins again where it ended, with wide steps, leaves many a bad place.
      for (int round = 0; round < kRounds; ++round)
        search(middle, v, round > 0 || v == 0 ? shapes_[middle][v] : shapes_[middle][v - 1]);
      for (std::size_t stretch = kNumbers - 1; v > 0 && stretch < kFirstShape.size(); stretch += kNumbers) {
        const Shape before = shapes_[middle][v];
        Shape begin = before;
        begin[stretch] = std::max(begin[stretch] - kFlatter, -kMostStretch);
        search(middle, v, begin);
        if (!(error(v, shapes_[middle][v]) < kClearlyBetter * error(v, before))) shapes_[middle][v] = before;
      }
    }
    for_all(shapes_[middle].size(), [&](std::size_t v) {
      for (std::size_t k = middle + 1; k <= last; ++k) search(k, v, shapes_[k - 1][v]);
      for (std::size_t k = middle; k-- > 0;) search(k, v, shapes_[k + 1][v]);
    });
    return true;
  }

  /// What is fitted to every `stride`-th view. Facets need find_shapes().
  std::vector<Fitted> fitted(const std::vector<double>& places, std::size_t stride, Family family) const {
    std::vector<Fitted> out(places.size());
    for_all(places.size(), [&](std::size_t i) {
      const double x = places[i];
      out[i] = fit_views(views_.at(x), stride, family, terms_,
                         [&](std::size_t view) { return family == Family::Microfacet ? shape(x, view) : Shape(); });
    });
    return out;
  }

 private:
  /// Linear between those that were found.
  Shape shape(double x, std::size_t view) const {
    const auto beside = [](double at, std::size_t count) {
      const std::size_t first = std::min(std::size_t(at), count < 2 ? 0 : count - 2);
      return std::pair(first, count < 2 ? 0 : at - double(first));
    };
    const auto [k, along] = beside(x * double(shapes_.size() - 1), shapes_.size());
    const auto [v, down] = beside(double(view) / kShapeStride, shapes_[0].size());
    Shape out = kFirstShape;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const auto at = [&, v = v, down = down](std::size_t place) {
        return shapes_[place][v][i] * (1 - down) + shapes_[place][v + 1][i] * down;
      };
      out[i] = at(k) * (1 - along) + (along > 0 ? at(k + 1) * along : 0);
    }
    return out;
  }

  std::vector<View> views_at(double x) const {
    if (terms_.parameters.empty()) return views_of(bound(x, {}), {});
    ParamValues some;
    std::vector<ScaledModel> terms;
    for (const Terms::Term& term : terms_.terms) terms.push_back({bound(x, term.values), term.scale});
    for (const std::string& name : terms_.parameters)
      some[name] = as_value(*model_.info().param(name), Rgb<double>(kSome));
    return views_of(bound(x, some), terms);
  }

  const Model& model_;
  const ParamValues& values_;
  const std::optional<FitAxis>& axis_;
  const Terms& terms_;
  bool grey_;
  std::optional<Rgb<double>> tint_;
  std::map<double, std::vector<View>> views_;
  std::vector<std::vector<Shape>> shapes_;  ///< by place, all as far from each other, and by every kShapeStride-th view
};

/// To six digits and single precision: more the shader does not keep, and shorter texts have no more digits.
double rounded(double x) { return double(std::strtof(fmt::format("{:.6g}", x).c_str(), nullptr)); }
std::vector<double> rounded(std::vector<double> numbers) {
  for (double& x : numbers) x = rounded(x);
  return numbers;
}

/// All that a fit depends on but the code; a change of the code that changes fits changes the first number.
std::string settings() {
  return fmt::format("4 {} {} {} {} {} {} {} {}", kViews, kTrialStride, kPoints, kRidge, kFirstSteps, kSteps,
                     kWorseBetween, kSlightlyOff);
}
/// What a model computes along an axis, to five digits. The text of its formula would not do: the order of statements
/// in it is that in which a compiler evaluates arguments.
std::string samples_of(const Model& model, const ParamValues& values, const FitAxis& axis) {
  constexpr int kPairs = 64;
  std::string text;
  for (const double x : {0.0, 0.2, 0.5, 0.8, 1.0}) {
    ParamValues here = values;
    here[axis.parameter] = axis.at(x);
    const auto brdf = model.make_double(here);
    Sequence3 points(1);
    for (int i = 0; i < kPairs; ++i) {
      const Vec3<double> a = points.next(), b = points.next();
      const Vec3<double> wo = direction(0.02 + 0.98 * a.x, 2 * kPi * a.y);
      const Vec3<double> drawn = brdf->sample(wo, b).wi;
      const Rgb<double> f = brdf->eval(i % 2 == 0 && drawn.z > 0 ? drawn : direction(b.x, 2 * kPi * b.y), wo);
      text += fmt::format("{:.5g} {:.5g} {:.5g}\n", f.r, f.g, f.b);
    }
  }
  return text;
}
std::string hash_of(const Model& model, const ParamValues& values) {
  const FitAxis axis = fit_axis(*roles_of(model, values).axis());
  return sha256(fmt::format("{}\n{}\n{} {} {} {}\n{}\n{}", model.info().name, format_values(model.info(), values),
                            axis.parameter, axis.low, axis.high, name_of(axis.scale), settings(),
                            samples_of(model, values, axis)));
}

std::filesystem::path path_of(const Model& model, const std::string& hash) {
  return data_dir() / "data" / "fits" / fmt::format("{}_{}.exr", model.info().name, hash.substr(0, 16));
}

ViewError worse(const ViewError& a, const ViewError& b) {
  return {a.cos_theta_o,
          std::max(a.relative_l1, b.relative_l1),
          std::max(a.relative_l2, b.relative_l2),
          std::max(a.albedo, b.albedo),
          std::max(a.negative, b.negative),
          a.number};
}

double mean_error(const std::vector<Fitted>& knots) {
  double sum = 0;
  for (const Fitted& f : knots) sum += f.error;
  return sum / double(knots.size());
}

}  // namespace

Fit::Fit(const Model& model, const ParamValues& given, From from) {
  const Roles& roles = roles_of(model, given);
  const ParamInfo* p = roles.axis();
  // The same fit whether factors and what is mixed are known or sockets.
  const auto [values, factor] = p ? along_axis(model, roles.fitted()) : Split{roles.fitted(), Rgb<double>(1.0)};
  terms_ = roles_of(model, values).terms();
  if (p) {
    axis_ = fit_axis(*p);
    const std::string hash = hash_of(model, values);
    const std::filesystem::path path = path_of(model, hash);
    if (from == From::Store) {
      if (std::filesystem::exists(path)) {
        read(path, hash);
        apply(factor);
        return;
      }
      note_missing(
          fmt::format("stored fit of {} {} over {}", model.info().name, format_values(model.info(), values), p->name),
          path.parent_path(), "about a minute");
    }
  }
  // Where the channels differ by a factor alone, one fit serves them all.
  if (!make(model, values, true) && !make(model, values, false))
    throw std::logic_error(model.info().name + ": a fit of colours that is not one");
  apply(factor);
}

void Fit::apply(const Rgb<double>& factor) {
  if (!axis_) return;
  const Rgb<double> all = tint_ * factor;
  scale_ = std::max(max_component(all), 1e-30);
  tint_ = all / scale_;
}

bool Fit::make(const Model& model, const ParamValues& values, bool grey) {
  Knots at(model, values, axis_, terms_, grey);
  std::vector<double> knots = {0};
  for (int i = 1; axis_ && i <= kFirstSteps; ++i) knots.push_back(double(i) / kFirstSteps);
  if (!at.see(knots) || !at.find_shapes()) return false;
  // Few views tell which closures suit.
  tint_ = Rgb<double>(1.0);
  Family family = kFamilies[0];
  std::vector<Fitted> trial;
  for (const Family f : kFamilies) {
    std::vector<Fitted> found = at.fitted(knots, kTrialStride, f);
    if (trial.empty() || mean_error(found) < mean_error(trial)) trial = std::move(found), family = f;
  }
  std::set<double> settled;  // middles between knots that need no knot
  while (axis_) {
    tabulate(knots, trial);
    std::vector<double> needed;
    for (std::size_t k = 1; k < knots.size(); ++k) {
      const double x = (knots[k - 1] + knots[k]) / 2;
      if (knots[k] - knots[k - 1] < 1.5 / kSteps || settled.count(x)) continue;
      if (!at.see({x})) return false;
      // At views that are knots.
      double error = 0;
      for (std::size_t v = 0; v < kViews; v += kTrialStride)
        error += l1_at(at.views(x)[v], axis_->at(x)) / double(trial[k].cells.size());
      if (error > kWorseBetween * (trial[k - 1].error + trial[k].error) / 2 + kSlightlyOff)
        needed.push_back(x);
      else
        settled.insert(x);
    }
    if (needed.empty()) break;
    std::vector<Fitted> fresh = at.fitted(needed, kTrialStride, family);
    for (std::size_t i = 0; i < needed.size(); ++i) {
      const auto before = std::ranges::upper_bound(knots, needed[i]) - knots.begin();
      knots.insert(knots.begin() + before, needed[i]);
      trial.insert(trial.begin() + before, std::move(fresh[i]));
    }
  }
  tint_ = at.tint().value_or(Rgb<double>(1.0));
  tint_ = {rounded(tint_.r), rounded(tint_.g), rounded(tint_.b)};
  knots_ = knots, family_ = int(family), grey_ = grey;
  tabulate(knots, at.fitted(knots, 1, family));
  // With an axis at both ends, and half way between knots.
  std::vector<double> proof = {0};
  for (std::size_t k = 1; k < knots.size(); ++k) proof.push_back((knots[k - 1] + knots[k]) / 2);
  if (axis_) proof.push_back(1);
  for (const double x : proof) {
    const double number = axis_ ? axis_->at(x) : 0;
    std::vector<ViewError> worst;
    for (const Terms::Term& term : terms_.terms) {
      Varied<double> varied(number);
      varied.parameters = shares(term.judged);
      const auto errors =
          view_errors(at.bound(x, term.judged), [&](const Vec3<double>& wo) { return closures(wo, varied); });
      if (worst.empty()) worst = errors;
      for (std::size_t i = 0; i < errors.size(); ++i) worst[i] = worse(worst[i], errors[i]);
    }
    for (ViewError e : worst) {
      e.number = number;
      for (double* x : numbers_of(e)) *x = rounded(*x);
      errors_.push_back(e);
    }
  }
  return true;
}

template <class Knot> void Fit::tabulate(const std::vector<double>& places, const std::vector<Knot>& knots) {
  if (axis_) {
    // Knots lie at multiples of 1 / kSteps, so that the way from a place to the number of its knot bends there alone.
    std::vector<double> positions;
    for (int i = 0; i <= kSteps; ++i) {
      const double x = double(i) / kSteps;
      const auto above = std::size_t(std::max(std::ranges::lower_bound(places, x) - places.begin(), std::ptrdiff_t(1)));
      const double between = (x - places[above - 1]) / (places[above] - places[above - 1]);
      positions.push_back((double(above - 1) + between) / double(places.size() - 1));
    }
    position_ = make_table("position_on_axis", {kSteps + 1}, std::move(positions));
  }
  lobes_.clear();
  linear_.clear();
  facets_.clear();
  const std::vector<Cell>& first_cells = knots[0].cells;
  const std::size_t terms = terms_.terms.size();
  const int count = int(knots.size()), views = int(first_cells.size()),
            channels = int(first_cells[0].x.cols()) / int(terms);
  const auto columns_of = [&](std::size_t term, const auto& m) {
    return m.middleCols(Eigen::Index(term) * channels, channels);
  };
  // Mean over channels of what a term reflects. Along an axis it may change by factors: closures' colours are tabulated
  // in units of it.
  const auto albedo_of = [&](const Cell& c, std::size_t term) {
    return std::max((columns_of(term, c.view->f).transpose() * weights_of(c.view->points)).mean(), 1e-30);
  };
  const auto unit = [&](const Cell& c, std::size_t term) { return axis_ ? albedo_of(c, term) : 1.0; };
  const auto name_of_term = [&](const std::string& name, std::size_t term) {
    return terms == 1 ? name : fmt::format("{}_{}", name, term);
  };
  const auto table = [&](const std::string& name, const auto& value) {
    std::vector<double> numbers;
    for (const Knot& knot : knots)
      for (const Cell& c : knot.cells) numbers.push_back(value(c));
    return make_table(name, axis_ ? std::vector<int>{count, views} : std::vector<int>{views}, rounded(numbers));
  };
  amplitude_.clear();
  for (std::size_t t = 0; axis_ && t < terms; ++t)
    amplitude_.push_back(table(name_of_term("amplitude", t), [&](const Cell& c) { return std::log(unit(c, t)); }));
  for (std::size_t i = 0; i < first_cells[0].facets.size(); ++i)
    facets_.push_back(
        {first_cells[0].facets[i].kind,
         table(fmt::format("lean_of_{}", i), [&](const Cell& c) { return c.facets[i].offset; }),
         table(fmt::format("alpha_of_{}", i), [&](const Cell& c) { return std::log(c.facets[i].alpha); }),
         table(fmt::format("stretch_of_{}", i), [&](const Cell& c) { return std::log(c.facets[i].stretch); })});
  const std::size_t lobes = first_cells[0].lobes.size(), closures_count = lobes + 1 + facets_.size();
  for (std::size_t j = 0; j < lobes; ++j)
    lobes_.push_back(
        {table(fmt::format("offset_of_{}", j),
               [&](const Cell& c) { return c.lobes[j].offset * (axis_ ? std::sqrt(c.lobes[j].exponent) : 1); }),
         table(fmt::format("power_of_{}", j),
               [&](const Cell& c) { return axis_ ? std::log(c.lobes[j].exponent) : c.lobes[j].exponent; })});
  for (std::size_t j = 0; j < closures_count; ++j) {
    const bool ramp = j <= lobes;
    const Eigen::Index first = Eigen::Index(ramp ? j * kRampSize : (lobes + 1) * kRampSize + (j - lobes - 1));
    const int entries = ramp ? kRampSize : 1;
    Linear l;
    for (std::size_t t = 0; t < terms; ++t) {
      // What the facets leave of the albedo, by what each ramp's colours add up to without their signs: so the weights
      // add up to the albedo, which is what passes and the denoiser see.
      if (ramp)
        l.weight.push_back(table(name_of_term(fmt::format("share_of_{}", j), t), [&](const Cell& c) {
          const MatrixXd x = columns_of(t, c.x);
          const Eigen::Index of_ramps = Eigen::Index((lobes + 1) * kRampSize);
          const double own = x.middleRows(first, entries).cwiseAbs().sum();
          const double all = std::max(x.topRows(of_ramps).cwiseAbs().sum(), 1e-300);
          const double albedo = albedo_of(c, t), of_facets = x.bottomRows(x.rows() - of_ramps).sum() / channels;
          return std::max(albedo - of_facets, (1 - kMostOfFacets) * albedo) * (own / all + 1e-3) /
                 (1 + 1e-3 * double(lobes + 1)) / unit(c, t);
        }));
      l.colour.emplace_back();
      for (int channel = 0; channel < channels; ++channel) {
        const int column = int(t) * channels + channel;
        std::vector<double> numbers;
        for (const Knot& knot : knots)
          for (const Cell& c : knot.cells)
            for (int k = 0; k < entries; ++k)
              numbers.push_back(c.x(first + k, column) / c.scale[first + k] / unit(c, t));
        std::vector<int> sizes = {views};
        if (axis_) sizes.insert(sizes.begin(), count);
        if (ramp) sizes.push_back(kRampSize);
        l.colour[t].push_back(make_table(fmt::format("colour_of_{}_{}", j, column), sizes, rounded(numbers)));
      }
    }
    linear_.push_back(std::move(l));
  }
}

std::vector<std::shared_ptr<const Table>> Fit::tables() const {
  std::vector<std::shared_ptr<const Table>> out;
  const auto add = [&](const std::shared_ptr<const Table>& table) {
    if (table) out.push_back(table);
  };
  add(position_);
  for (const auto& table : amplitude_) add(table);
  for (const Facets& f : facets_) add(f.offset), add(f.log_alpha), add(f.log_stretch);
  for (const Lobe& l : lobes_) add(l.offset), add(l.exponent);
  for (const Linear& l : linear_) {
    for (const auto& table : l.weight) add(table);
    for (const auto& term : l.colour)
      for (const auto& channel : term) add(channel);
  }
  return out;
}

Fit Fit::seen(const Cosines& views) const {
  const auto knot = [](double cosine) { return fit::place(direction(cosine, 0)) * (kViews - 1); };
  Fit out = *this;
  const int first = std::min(int(std::floor(knot(views.high))), kViews - 2),
            last = std::clamp(int(std::ceil(knot(views.low))), first + 1, kViews - 1);
  out.first_view_ = double(first) / (kViews - 1);
  out.views_ = double(last - first) / (kViews - 1);
  const auto cut = [&](std::shared_ptr<const Table>& table) { table = part(*table, axis_ ? 1 : 0, first, last); };
  for (auto& table : out.amplitude_) cut(table);
  for (Lobe& l : out.lobes_) cut(l.offset), cut(l.exponent);
  for (Facets& f : out.facets_) cut(f.offset), cut(f.log_alpha), cut(f.log_stretch);
  for (Linear& l : out.linear_) {
    for (auto& table : l.weight) cut(table);
    for (auto& term : l.colour)
      for (auto& channel : term) cut(channel);
  }
  // At least one is left.
  const double apart = errors_[0].cos_theta_o - errors_[1].cos_theta_o;
  std::erase_if(out.errors_, [&](const ViewError& e) {
    return e.cos_theta_o < views.low - apart || e.cos_theta_o > views.high + apart;
  });
  return out;
}

std::size_t Fit::size() const {
  std::size_t sum = 0;
  for (const auto& table : tables()) sum += table->values.size();
  return sum;
}

double Fit::mean_l1(const std::optional<double>& number) const {
  std::map<double, std::pair<double, double>> sums;  // by place: of L1, of views
  for (const ViewError& e : errors_) {
    sums[e.number].first += e.relative_l1;
    sums[e.number].second += 1;
  }
  auto first = sums.begin(), last = sums.end();
  if (axis_ && number) {
    last = sums.lower_bound(*number);
    first = last == sums.begin() ? last : std::prev(last);
    if (last != sums.end()) ++last;
  }
  double worst = 0;
  for (auto it = first; it != last; ++it) worst = std::max(worst, it->second.first / it->second.second);
  return worst;
}

Fit Fit::knot(const Model& model, const ParamValues& values, double place) const {
  Knots at(model, values, axis_, terms_, grey_);
  if (!at.see({place}) || (Family(family_) == Family::Microfacet && !at.find_shapes()))
    throw std::logic_error(model.info().name + ": a fit of another tint");
  const Fitted cell = std::move(at.fitted({place}, 1, Family(family_)).front());
  Fit out;
  out.axis_ = axis_;
  out.terms_ = terms_;
  out.tint_ = tint_;
  // Between two knots that are the same, views lie as they do in the whole.
  out.tabulate({0, 1}, std::vector<Fitted>{cell, cell});
  return out;
}

void Fit::store(const Model& model, const ParamValues& values, const std::filesystem::path& path) const {
  using Json = nlohmann::ordered_json;
  std::vector<double> errors;
  for (ViewError e : errors_)
    for (const double* x : numbers_of(e)) errors.push_back(*x);
  const std::vector<int> errors_sizes = {int(errors_.size()), int(errors.size() / errors_.size())};
  std::vector<std::shared_ptr<const Table>> rows = tables();
  rows.push_back(make_table("errors", errors_sizes, std::move(errors)));
  TableImage image;
  image.height = int(rows.size());
  for (const auto& table : rows) image.width = std::max(image.width, int(table->values.size()));
  Json facets = Json::array(), tables = Json::array();
  for (const Facets& f : facets_) facets.push_back(f.kind == ClosureKind::Ggx ? "ggx" : "beckmann");
  for (const auto& table : rows) {
    image.pixels.insert(image.pixels.end(), table->values.begin(), table->values.end());
    image.pixels.resize(std::size_t(image.width) * (tables.size() + 1), 0.f);
    tables.push_back({{"row", tables.size()}, {"name", table->name}, {"sizes", table->sizes}});
  }
  // Each by what its parameters are where f is this term over `scale`.
  Json terms = Json::array();
  for (const Terms::Term& term : terms_.terms)
    terms.push_back({{"values", format_values(model.info(), term.values)}, {"scale", term.scale}});
  const Json axis = axis_ ? Json{{"parameter", axis_->parameter},
                                 {"low", axis_->low},
                                 {"high", axis_->high},
                                 {"scale", name_of(axis_->scale)}}
                          : Json();
  Json meta = {{"model", model.info().name},
               {"quantity", axis_ ? "closures fitted to a model, over a number and the view"
                                  : "closures fitted to a model, over the view"},
               {"values", format_values(model.info(), values)},
               {"axis", axis},
               {"hash", axis_ ? Json(hash_of(model, values)) : Json()},
               {"knots", knots_},
               {"family", family_},
               {"grey", grey_},
               {"tint", {tint_.r, tint_.g, tint_.b}},
               {"lobes", lobes_.size()},
               {"facets", facets},
               {"terms", terms},
               {"channels", linear_.front().colour.front().size()},
               {"layout", "a row a table: row-major, first axis slowest, padded with zeros"},
               {"tables", tables}};
  // Other than 1 only with factors that are known.
  if (scale_ != 1) meta["scale"] = scale_;
  image.meta = meta.dump();
  write_table_image(image, path);
}

void Fit::read(const std::filesystem::path& path, const std::string& hash) {
  const TableImage image = read_table_image(path);
  try {
    const auto meta = nlohmann::json::parse(image.meta);
    if (meta.at("hash") != hash)
      input_error("{}: hash: expected {}, got {}", path.string(), hash, meta.at("hash").dump());
    std::map<std::string, std::shared_ptr<const Table>> tables;
    for (const auto& t : meta.at("tables")) {
      const auto sizes = t.at("sizes").get<std::vector<int>>();
      std::size_t count = 1;
      for (const int n : sizes) count *= std::size_t(n);
      const auto first = image.pixels.begin() + t.at("row").get<std::ptrdiff_t>() * image.width;
      if (count > std::size_t(image.width) || t.at("row").get<int>() >= image.height)
        input_error("{}: tables: {} has more numbers than there are", path.string(), t.at("name").dump());
      const std::string name = t.at("name");
      tables[name] = make_table(name, sizes, {first, first + std::ptrdiff_t(count)});
    }
    knots_ = meta.at("knots").get<std::vector<double>>();
    family_ = meta.at("family");
    grey_ = meta.at("grey");
    tint_ = {meta.at("tint").at(0), meta.at("tint").at(1), meta.at("tint").at(2)};
    position_ = tables.at("position_on_axis");
    const std::size_t terms = terms_.terms.size();
    const auto term = [&](const std::string& name, std::size_t t) {
      return tables.at(terms == 1 ? name : fmt::format("{}_{}", name, t));
    };
    for (std::size_t t = 0; t < terms; ++t) amplitude_.push_back(term("amplitude", t));
    const auto& facets = meta.at("facets");
    for (std::size_t i = 0; i < facets.size(); ++i)
      facets_.push_back({facets[i] == "ggx" ? ClosureKind::Ggx : ClosureKind::Beckmann,
                         tables.at(fmt::format("lean_of_{}", i)), tables.at(fmt::format("alpha_of_{}", i)),
                         tables.at(fmt::format("stretch_of_{}", i))});
    const std::size_t lobes = meta.at("lobes"), channels = meta.at("channels");
    for (std::size_t j = 0; j < lobes; ++j)
      lobes_.push_back({tables.at(fmt::format("offset_of_{}", j)), tables.at(fmt::format("power_of_{}", j))});
    for (std::size_t j = 0; j < lobes + 1 + facets_.size(); ++j) {
      Linear l;
      for (std::size_t t = 0; t < terms; ++t) {
        if (j <= lobes) l.weight.push_back(term(fmt::format("share_of_{}", j), t));
        l.colour.emplace_back();
        for (std::size_t channel = 0; channel < channels; ++channel)
          l.colour[t].push_back(tables.at(fmt::format("colour_of_{}_{}", j, t * channels + channel)));
      }
      linear_.push_back(std::move(l));
    }
    const auto& errors = tables.at("errors");
    for (std::size_t i = 0; i < errors->values.size();) {
      ViewError e;
      for (double* x : numbers_of(e)) *x = errors->values.at(i++);
      errors_.push_back(e);
    }
  } catch (const nlohmann::json::exception& e) {
    input_error("{}: expected a stored fit: {}", path.string(), e.what());
  } catch (const std::out_of_range&) {
    input_error("{}: expected a stored fit, a table is missing", path.string());
  }
}

double Fit::l1_at(const View& view, double number) const {
  const VectorXd weight = weights_of(view.points);
  const MatrixXd mixtures = judged(terms_);
  const Eigen::Index terms = mixtures.cols(), channels = view.f.cols() / terms;
  double worst = 0;
  for (Eigen::Index mixture = 0; mixture < terms; ++mixture) {
    std::vector<Rgb<double>> weights;
    MatrixXd f = MatrixXd::Zero(view.f.rows(), channels);
    for (Eigen::Index t = 0; t < terms; ++t) {
      weights.emplace_back(mixtures(mixture, t));
      f += mixtures(mixture, t) * view.f.middleCols(t * channels, channels);
    }
    const ClosureSum<double> sum = weighted(view.wo, number, weights, 1.0, true);
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

template <class T> std::vector<T> Fit::place(const Vec3<T>& wo, const T& number) const {
  std::vector<T> at;
  if (axis_) at.push_back(named("place_on_axis", lookup(position_, std::vector<T>{axis_->place(number)})));
  at.push_back(named("place", fit::place(wo, first_view_, views_)));
  return at;
}

template <class T> Closure<T> Fit::shape(std::size_t j, const Vec3<T>& side, const std::vector<T>& at) const {
  if (j < lobes_.size()) {
    const T offset = lookup(lobes_[j].offset, at), power = lookup(lobes_[j].exponent, at);
    if (!axis_) return lobe_closure(side, offset, power);
    return lobe_closure(side, offset * exp(power / T(-2)), exp(power));
  }
  if (j == lobes_.size()) return Closure<T>(ClosureKind::DiffuseRamp, Rgb<T>(T(1)));
  const Facets& facets = facets_[j - lobes_.size() - 1];
  return facet_closure(facets.kind, side, lookup(facets.offset, at), exp(lookup(facets.log_alpha, at)),
                       exp(lookup(facets.log_stretch, at)));
}

template <class T> Rgb<T> Fit::tint() const { return {T(tint_.r), T(tint_.g), T(tint_.b)}; }

template <class T> T Fit::amplitude(std::size_t term, const std::vector<T>& at) const {
  return axis_ ? named("amplitude", T(scale_) * exp(lookup(amplitude_[term], at))) : T(1);
}

template <class T> std::vector<Rgb<T>> Fit::counts(const std::vector<T>& at, const std::vector<Rgb<T>>& weights) const {
  std::vector<Rgb<T>> out;
  for (std::size_t t = 0; t < terms_.terms.size() && !terms_.parameters.empty(); ++t) {
    const Rgb<T> coloured = tint<T>() * weights[t];
    out.push_back(named("count_of_term", axis_ ? coloured * amplitude(t, at) : coloured));
  }
  return out;
}

template <class T> std::vector<Rgb<T>> Fit::weights(const Varied<T>& varied) const {
  if (terms_.parameters.empty()) return {Rgb<T>(T(1))};
  return terms_.weights(varied.parameters);
}

template <class T>
Rgb<T> Fit::colour(std::size_t j, const std::vector<T>& at, const std::vector<Rgb<T>>& counts) const {
  const auto term = [&](std::size_t t) {
    const auto& channels = linear_[j].colour[t];
    if (channels.size() == 1) return Rgb<T>(lookup(channels[0], at));
    return Rgb<T>(lookup(channels[0], at), lookup(channels[1], at), lookup(channels[2], at));
  };
  if (counts.empty()) return term(0);
  Rgb<T> sum = counts[0] * term(0);
  for (std::size_t t = 1; t < counts.size(); ++t) sum += counts[t] * term(t);
  return sum;
}

/// Coordinates of a ramp's table.
template <class T> std::vector<T> on_ramp(std::vector<T> at, const T& position) {
  at.push_back(position);
  return at;
}

template <class T> ClosureSum<T> Fit::weighted(const Vec3<T>& wo, const T& number, const std::vector<Rgb<T>>& weights,
                                               const T& share, bool divided) const {
  const std::vector<T> at = place(wo, number);
  const std::vector<Rgb<T>> counts = this->counts(at, weights);
  // With terms both are in their counts.
  const T amplitude = counts.empty() ? this->amplitude(0, at) : T(1);
  const Rgb<T> tint = counts.empty() ? this->tint<T>() : Rgb<T>(T(1));
  const Vec3<T> side = mirror_side(wo);
  ClosureSum<T> sum;
  for (std::size_t j = 0; j < linear_.size(); ++j) {
    Closure<T>& c = sum.emplace_back(shape(j, side, at));
    if (!has_ramp(c.kind)) {
      c.weight = tint * amplitude * colour(j, at, counts);
      continue;
    }
    const auto on = [&](std::size_t k) { return on_ramp(at, T(double(k) / (kRampSize - 1))); };
    const auto share_of = [&](std::size_t t) { return maximum(lookup(linear_[j].weight[t], at), T(1e-20)); };
    if (counts.empty()) {
      const T weight = share_of(0) * amplitude * share;
      c.weight = tint * weight;
      for (std::size_t k = 0; k < kRampSize; ++k)
        c.ramp[k] = colour(j, on(k), counts) * (divided ? amplitude / weight : amplitude);
      continue;
    }
    Rgb<T> weight(T(0));
    for (std::size_t t = 0; t < counts.size(); ++t) weight += counts[t] * share_of(t);
    // Of colours that may be black.
    c.weight = weight * share + Rgb<T>(T(1e-20));
    for (std::size_t k = 0; k < kRampSize; ++k) {
      c.ramp[k] = colour(j, on(k), counts);
      if (divided) c.ramp[k] = c.ramp[k] / c.weight;
    }
  }
  return sum;
}

namespace {

/// The frame about a normal that is turned towards a viewer below kLowestView until it is as high.
class TurnedFrame {
 public:
  explicit TurnedFrame(const Vec3<double>& wo) : side_(mirror_side(wo)) {
    const double angle = std::asin(kLowestView) - std::asin(wo.z);
    cos_ = std::cos(angle), sin_ = std::sin(angle);
  }
  Vec3<double> into(const Vec3<double>& v) const { return turned(v, sin_); }
  Vec3<double> out_of(const Vec3<double>& v) const { return turned(v, -sin_); }

 private:
  Vec3<double> turned(const Vec3<double>& v, double sin) const {
    const double along = dot(side_, v);
    Vec3<double> out = v + side_ * (along * (cos_ - 1) + v.z * sin);
    out.z = v.z * cos_ - along * sin;
    return out;
  }
  Vec3<double> side_;
  double cos_, sin_;
};

}  // namespace

template <class T> ClosureSum<T> Fit::closures(const Vec3<T>& wo, const std::type_identity_t<Varied<T>>& varied,
                                               const T& share, bool divided) const {
  if constexpr (std::is_same_v<T, double>)
    if (wo.z < kLowestView) {
      const TurnedFrame frame(wo);
      ClosureSum<T> sum = weighted(frame.into(wo), varied.number, weights(varied), share, divided);
      for (Closure<T>& c : sum) {
        c.normal = frame.out_of(c.normal);
        c.tangent = frame.out_of(c.tangent);
        c.turned = true;
      }
      return sum;
    }
  return weighted(wo, varied.number, weights(varied), share, divided);
}
template ClosureSum<double> Fit::closures(const Vec3<double>&, const Varied<double>&, const double&, bool) const;
template ClosureSum<Expr> Fit::closures(const Vec3<Expr>&, const Varied<Expr>&, const Expr&, bool) const;

template <class T>
Rgb<T> Fit::f_cos(const Vec3<T>& wi, const Vec3<T>& wo, const std::type_identity_t<Varied<T>>& varied) const {
  if constexpr (std::is_same_v<T, double>)
    if (wo.z < kLowestView) {
      const TurnedFrame frame(wo);
      const Vec3<T> turned = frame.into(wo);
      // No lower, or this would not end.
      return f_cos(frame.into(wi), {turned.x, turned.y, std::max(turned.z, kLowestView)}, varied);
    }
  const std::vector<T> at = place(wo, varied.number);
  const std::vector<Rgb<T>> counts = this->counts(at, weights(varied));
  // Turned into the plane of incidence, where normals have two components.
  const Vec3<T> side = mirror_side(wo), x = {T(1), T(0), T(0)}, o = {-sqrt(sin2_theta(wo)), T(0), wo.z},
                i = {dot(side, wi), side.x * wi.y - side.y * wi.x, wi.z};
  Rgb<T> sum(T(0));
  for (std::size_t j = 0; j < linear_.size(); ++j) {
    Closure<T> c = shape(j, x, at);
    if (!has_ramp(c.kind)) c.weight = colour(j, at, counts);
    sum += evaluate(c, i, o, [&](const T& position) { return colour(j, on_ramp(at, position), counts); });
  }
  return counts.empty() ? tint<T>() * amplitude(0, at) * sum : sum;
}
template Rgb<double> Fit::f_cos(const Vec3<double>&, const Vec3<double>&, const Varied<double>&) const;
template Rgb<Expr> Fit::f_cos(const Vec3<Expr>&, const Vec3<Expr>&, const Varied<Expr>&) const;

std::filesystem::path stored_fit(const Model& model, const ParamValues& values) {
  return path_of(model, hash_of(model, along_axis(model, values).values));
}

const Fit& fit_of(const Model& model, const ParamValues& values) {
  return made_once<Fit>(model, roles_of(model, values).fitted());
}

Fit fit_of(const Model& model, const ParamValues& values, const Cosines& views) {
  const Fit& whole = fit_of(model, values);
  return views.all() ? whole : whole.seen(views);
}

}  // namespace brdfc::fit
