// SPDX-License-Identifier: GPL-3.0-or-later
#include "represent/fit.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>

#include "analysis/albedo.h"
#include "analysis/probes.h"
#include "model/horizon.h"
#include "model/power_lobe.h"
#include "model/sampling.h"

namespace brdfc {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kViews = 33;
constexpr std::size_t kTrialStride = 4;
/// The height of the last view; below it the closures keep their shape.
constexpr double kLastCosine = 2e-3;
constexpr int kPoints = 3000;
/// Closure columns are scaled to unit integral, so that this is a share of the light: what the fit may not gain by
/// larger colours of opposite signs.
constexpr double kRidge = 1e-5;

struct Placed {
  double offset, exponent;
};
/// Which closures a fit uses.
enum class Family {
  Moving,     ///< seven phong_ramps about the axis of the moments
  Fixed,      ///< seven about the mirror direction, of widths that do not depend on the view
  Microfacet  ///< four about the axis of the moments, and facets about the normal
};
constexpr Family kFamilies[] = {Family::Moving, Family::Fixed, Family::Microfacet};
constexpr std::size_t kFacets = 3;
/// Three widths on the axis, two pairs beside it; `height` is the viewer's angle above the surface.
std::vector<Placed> placed(Family family, const Moments& here, const Moments& at_normal, double height) {
  const Moments& m = family == Family::Fixed ? at_normal : here;
  const double offset = family == Family::Fixed ? 0 : m.offset;
  const double e = std::max(m.narrow, 0.5), s = 1 / std::sqrt(std::max(m.wide, 0.5));
  std::vector<Placed> lobes = {{offset, e}, {offset, e / 4}, {offset + 0.7 * s, e}, {offset - 0.7 * s, e}};
  if (family != Family::Microfacet)
    lobes.insert(lobes.end(), {{offset, 2 * e}, {offset + 1.5 * s, e / 2}, {offset - 1.5 * s, e / 2}});
  // No axis below the surface: opposite the viewer the closure's normal would turn over.
  for (Placed& l : lobes) l.offset = std::max(l.offset, -height);
  return lobes;
}
/// Facets that give the lobe at normal incidence its width, and others about it.
std::vector<Closure<double>> facets(Family family, const Moments& at_normal) {
  if (family != Family::Microfacet) return {};
  const double alpha = std::sqrt(1 / (2 * std::max(at_normal.narrow, 0.5) + 1));
  std::vector<Closure<double>> out(kFacets, Closure<double>(ClosureKind::Beckmann, Rgb<double>(1.0)));
  const double factors[kFacets] = {1, 0.6, 1};
  out.back().kind = ClosureKind::Ggx;
  for (std::size_t i = 0; i < kFacets; ++i) out[i].alpha = std::clamp(alpha * factors[i], 1e-3, 1.0);
  return out;
}

/// The closure of a lobe without colours. Its axis is beside_mirror(wo, offset), so its normal, halfway between axis
/// and viewer, is turned towards the viewer by half of that.
template <class T> Closure<T> lobe_closure(const Vec3<T>& wo, const T& offset, const T& exponent) {
  Closure<T> c(ClosureKind::PhongRamp, Rgb<T>(T(1)));
  const T half = offset / T(2);
  c.normal = mirror_side(wo) * -sin(half);
  c.normal.z = cos(half);
  c.turned = true;
  c.exponent = exponent;
  return c;
}

/// What each entry of each ramp gives at the points: lobes, the diffuse_ramp, and the facets.
MatrixXd dictionary(const std::vector<Placed>& lobes, const std::vector<Closure<double>>& facets, const Points& points,
                    const Vec3<double>& wo) {
  std::vector<Closure<double>> ramps;
  for (const Placed& l : lobes) ramps.push_back(lobe_closure(wo, l.offset, l.exponent));
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
  for (const Closure<double>& c : facets) {
    for (std::size_t p = 0; p < points.wi.size(); ++p) a(Eigen::Index(p), column) = evaluate(c, points.wi[p], wo).r;
    ++column;
  }
  return a;
}

/// Of the last view, as view() and place() measure heights.
double last_place() { return std::sqrt(2 * kInvPi * std::asin(kLastCosine)); }
/// How far along its axis of the tables a view is: knots crowd towards the horizon, where lobes change most.
template <class T> T place(const Vec3<T>& wo) {
  // The angle above the surface, from its half, keeps its digits at the horizon.
  const T height = named("height_o", T(2) * atan(wo.z / (T(1) + sqrt(sin2_theta(wo)))));
  return (T(1) - sqrt(maximum(height, T(0)) * T(2 * kInvPi))) / T(1 - last_place());
}
/// The view at which place() is x.
Vec3<double> view(double x) {
  const double height = kPi / 2 * sqr(1 - x * (1 - last_place()));
  return {std::cos(height), 0, std::sin(height)};
}

/// A view and what was found for it.
struct Cell : View {
  std::vector<Placed> lobes;
  MatrixXd a;
  VectorXd scale;  ///< what the columns were divided by
  MatrixXd x;      ///< a column a channel
};
struct Fitted {
  std::vector<Cell> cells;
  std::vector<Closure<double>> facets;
  double error = 0;  ///< relative L1, mean over the views
};

/// Fits every `stride`-th view, from that along the normal on.
Fitted fit_views(const std::vector<View>& views, std::size_t stride, Family family) {
  Fitted out;
  const Moments& at_normal = views[0].lobe;
  out.facets = facets(family, at_normal);
  for (std::size_t i = 0; i < views.size(); i += stride) out.cells.push_back({views[i], {}, {}, {}, {}});
  tbb::parallel_for(std::size_t(0), out.cells.size(), [&](std::size_t i) {
    Cell& c = out.cells[i];
    c.lobes = placed(family, c.lobe, at_normal, std::asin(c.wo.z));
    c.a = dictionary(c.lobes, out.facets, c.points, c.wo);
    // About the integral of a column over all directions: that over those above the surface may vanish.
    c.scale = VectorXd::Constant(c.a.cols(), 1.0 / kRampSize);
    for (std::size_t j = 0; j < c.lobes.size(); ++j) {
      const Closure<double> l = lobe_closure(c.wo, c.lobes[j].offset, c.lobes[j].exponent);
      c.scale.segment(Eigen::Index(j * kRampSize), kRampSize) *= dot(l.normal, c.wo);
    }
    c.scale.tail(Eigen::Index(out.facets.size())).setOnes();
    c.a *= c.scale.cwiseInverse().asDiagonal();
  });

  for (Cell& c : out.cells) c.x = MatrixXd::Zero(c.a.cols(), c.f.cols());
  const Eigen::Index channels = views[0].f.cols();
  // Cycles draws diffuse_ramp in proportion to a cosine that its colours need not have: with a first colour other than
  // 0 the variance would be infinite.
  const Eigen::Index first_of_diffuse = Eigen::Index(out.cells[0].lobes.size() * kRampSize);
  std::vector<double> error(std::size_t(channels), 0.0);
  tbb::parallel_for(Eigen::Index(0), channels, [&](Eigen::Index channel) {
    // From one view to the next, so that neighbours are alike and what lies between them is a fit too.
    VectorXd near = VectorXd::Zero(out.cells[0].a.cols());
    for (Cell& c : out.cells) {
      const VectorXd weight = weights_of(c.points), f = c.f.col(channel);
      c.x.col(channel) = near = solve(c.a, weight, f, near, kRidge, Eigen::Index(out.facets.size()), first_of_diffuse);
      const double albedo = f.dot(weight);
      if (albedo > 0)
        error[std::size_t(channel)] += (c.a * near - f).cwiseAbs().dot(weight) / albedo / double(out.cells.size());
    }
  });
  out.error = *std::max_element(error.begin(), error.end());
  return out;
}

}  // namespace

std::set<std::string> factors(const Model& model, const ParamValues& values) {
  if (!model.has_scatter()) return {};
  std::set<std::string> out;
  for (const ParamInfo& p : model.info().params) {
    if (p.kind != ParamKind::Color) continue;
    const Rgb<double> colour{0.3, 0.6, 0.8};
    ParamValues white = values, coloured = values;
    white[p.name] = std::array<double, 3>{1, 1, 1};
    coloured[p.name] = std::array<double, 3>{colour.r, colour.g, colour.b};
    const auto of_white = model.make_double(white), of_coloured = model.make_double(coloured);
    Random random(12);
    bool proportional = true;
    for (const auto& [wi, wo] : direction_pairs(*of_white, 256, random, model.two_sided()))
      proportional = proportional && relative(of_white->eval(wi, wo) * colour, of_coloured->eval(wi, wo)) < 1e-9;
    if (proportional) out.insert(p.name);
  }
  return out;
}

ParamValues without_factors(const Model& model, const ParamValues& known) {
  ParamValues values = known;
  for (const std::string& name : factors(model, complete(model.info(), known)))
    values.emplace(name, std::array<double, 3>{1, 1, 1});
  for (const ParamInfo& p : model.info().params)
    if (!values.count(p.name)) throw std::logic_error(model.info().name + ": a fit without " + p.name);
  return values;
}

std::optional<std::string> unfit(const Model& model, const ParamValues& values) {
  if (!model.has_scatter()) return "it only reflects and refracts ideally";
  const auto brdf = model.make_double(values);
  if (model.has_transmit() || model.has_medium() || brdf->scatters_through()) return "it lets light through";
  if (!model.info().properties.isotropic && turns(*brdf)) return "it is anisotropic";
  return std::nullopt;
}

Fit::Fit(const Model& model, const ParamValues& values) {
  const BoundModel bound = bind_model(model, values);
  std::vector<View> views(kViews);
  tbb::parallel_for(0, kViews,
                    [&](int i) { views[std::size_t(i)] = seen(bound, view(double(i) / (kViews - 1)), kPoints); });
  // Where the channels differ by a factor alone, one fit serves them all.
  const std::optional<Rgb<double>> tint = make_grey(views);
  tint_ = tint.value_or(Rgb<double>(1.0));
  // Few views tell which closures suit.
  Family family = kFamilies[0];
  double least = std::numeric_limits<double>::infinity();
  for (const Family f : kFamilies) {
    const double error = fit_views(views, kTrialStride, f).error;
    if (error < least) least = error, family = f;
  }
  const Fitted fitted = fit_views(views, 1, family);
  const std::vector<Cell>& cells = fitted.cells;
  const int channels = tint ? 1 : 3;
  facets_ = fitted.facets;
  const auto table = [&](const std::string& name, const auto& value) {
    std::vector<double> numbers;
    for (const Cell& c : cells) numbers.push_back(value(c));
    return make_table(name, {kViews}, std::move(numbers));
  };
  const std::size_t lobes = cells[0].lobes.size(), closures_count = lobes + 1 + facets_.size();
  for (std::size_t j = 0; j < lobes; ++j)
    lobes_.push_back({table(fmt::format("offset_of_{}", j), [&](const Cell& c) { return c.lobes[j].offset; }),
                      table(fmt::format("power_of_{}", j), [&](const Cell& c) { return c.lobes[j].exponent; })});
  for (std::size_t j = 0; j < closures_count; ++j) {
    const bool ramp = j <= lobes;
    const Eigen::Index first = Eigen::Index(ramp ? j * kRampSize : (lobes + 1) * kRampSize + (j - lobes - 1));
    const int entries = ramp ? kRampSize : 1;
    Linear l;
    // What the facets leave of the albedo, by what each ramp's colours add up to without their signs: so the weights
    // add up to the albedo, which is what passes and the denoiser see.
    if (ramp)
      l.weight = table(fmt::format("share_of_{}", j), [&](const Cell& c) {
        const Eigen::Index of_ramps = Eigen::Index((lobes + 1) * kRampSize);
        const double own = c.x.middleRows(first, entries).cwiseAbs().sum();
        const double all = std::max(c.x.topRows(of_ramps).cwiseAbs().sum(), 1e-300);
        const double albedo = (c.f.transpose() * weights_of(c.points)).sum() / channels;
        const double of_facets = c.x.bottomRows(c.x.rows() - of_ramps).sum() / channels;
        return std::max(albedo - of_facets, 1e-2 * albedo) * (own / all + 1e-3) / (1 + 1e-3 * double(lobes + 1));
      });
    for (int channel = 0; channel < channels; ++channel) {
      std::vector<double> numbers;
      for (const Cell& c : cells)
        for (int k = 0; k < entries; ++k) numbers.push_back(c.x(first + k, channel) / c.scale[first + k]);
      const std::vector<int> sizes = ramp ? std::vector<int>{kViews, kRampSize} : std::vector<int>{kViews};
      l.colour.push_back(make_table(fmt::format("colour_of_{}_{}", j, channel), sizes, std::move(numbers)));
    }
    linear_.push_back(std::move(l));
  }

  errors_ = view_errors(bound, [&](const Vec3<double>& wo) { return closures(wo); });
}

template <class T> Closure<T> Fit::shape(std::size_t j, const Vec3<T>& wo, const T& place) const {
  const std::array<T, 1> x = {place};
  if (j < lobes_.size()) return lobe_closure(wo, lookup(lobes_[j].offset, x), lookup(lobes_[j].exponent, x));
  if (j == lobes_.size()) return Closure<T>(ClosureKind::DiffuseRamp, Rgb<T>(T(1)));
  const Closure<double>& facet = facets_[j - lobes_.size() - 1];
  Closure<T> c(facet.kind, Rgb<T>(T(1)));
  c.alpha = T(facet.alpha);
  return c;
}

template <class T, std::size_t D> Rgb<T> Fit::colour(std::size_t j, const std::array<T, D>& at) const {
  const auto& channels = linear_[j].colour;
  if (channels.size() == 1) return Rgb<T>(lookup(channels[0], at));
  return Rgb<T>(lookup(channels[0], at), lookup(channels[1], at), lookup(channels[2], at));
}

template <class T> ClosureSum<T> Fit::closures(const Vec3<T>& wo, const T& share, bool divided) const {
  const T x = named("place", place(wo));
  const Rgb<T> tint(T(tint_.r), T(tint_.g), T(tint_.b));
  ClosureSum<T> sum;
  for (std::size_t j = 0; j < linear_.size(); ++j) {
    Closure<T>& c = sum.emplace_back(shape(j, wo, x));
    if (!has_ramp(c.kind)) {
      c.weight = tint * colour(j, std::array<T, 1>{x});
      continue;
    }
    const T weight = maximum(lookup(linear_[j].weight, std::array<T, 1>{x}), T(1e-20)) * share;
    c.weight = tint * weight;
    for (std::size_t k = 0; k < kRampSize; ++k)
      c.ramp[k] = colour(j, std::array<T, 2>{x, T(double(k) / (kRampSize - 1))}) / (divided ? weight : T(1));
  }
  return sum;
}
template ClosureSum<double> Fit::closures(const Vec3<double>&, const double&, bool) const;
template ClosureSum<Expr> Fit::closures(const Vec3<Expr>&, const Expr&, bool) const;

template <class T> Rgb<T> Fit::f_cos(const Vec3<T>& wi, const Vec3<T>& wo) const {
  const T x = named("place", place(wo));
  Rgb<T> sum(T(0));
  for (std::size_t j = 0; j < linear_.size(); ++j) {
    Closure<T> c = shape(j, wo, x);
    if (!has_ramp(c.kind)) c.weight = colour(j, std::array<T, 1>{x});
    sum += evaluate(c, wi, wo, [&](const T& position) { return colour(j, std::array<T, 2>{x, position}); });
  }
  return Rgb<T>(T(tint_.r), T(tint_.g), T(tint_.b)) * sum;
}
template Rgb<double> Fit::f_cos(const Vec3<double>&, const Vec3<double>&) const;
template Rgb<Expr> Fit::f_cos(const Vec3<Expr>&, const Vec3<Expr>&) const;

const Fit& fit_of(const Model& model, const ParamValues& values) { return made_once<Fit>(model, values); }

}  // namespace brdfc
