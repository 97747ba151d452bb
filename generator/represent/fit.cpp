// SPDX-License-Identifier: GPL-3.0-or-later
#include "represent/fit.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <map>
#include <mutex>

#include "analysis/albedo.h"
#include "analysis/probes.h"
#include "model/horizon.h"
#include "model/power_lobe.h"
#include "model/sampling.h"

namespace brdfc {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kViews = 33, kErrorViews = 64;
constexpr std::size_t kTrialStride = 4;
/// The height of the last view; below it the closures keep their shape.
constexpr double kLastCosine = 2e-3;
constexpr int kPoints = 3000, kSteps = 14;
/// Closure columns are scaled to unit integral, so that this is a share of the light: what the fit may not gain by
/// larger colours of opposite signs.
constexpr double kRidge = 1e-5;

/// Directions above the surface with the solid angle that each stands for.
struct Points {
  std::vector<Vec3<double>> wi;
  std::vector<double> weight;
};

/// In the plane of incidence, `angle` from the mirror direction towards the normal and on.
template <class T> Vec3<T> beside_mirror(const Vec3<T>& wo, const T& angle) {
  const T sinTheta = sqrt(sin2_theta(wo));
  // Towards the mirror side, along the surface; at normal incidence any direction will do.
  const auto oblique = sinTheta > T(1e-6);
  const T scale = T(-1) / select(oblique, sinTheta, T(1));
  const Vec3<T> out = {select(oblique, wo.x * scale, T(1)), select(oblique, wo.y * scale, T(0)), T(0)};
  const T c = cos(angle), s = sin(angle);
  const T along = sinTheta * c - wo.z * s, up = wo.z * c + sinTheta * s;
  return {out.x * along, out.y * along, up};
}

/// What is drawn about `axis`, which is not below the surface: the model's own samples, and lobes from exponent `e`
/// down to the whole sphere, each direction counted by the density of all of them together.
Points spread_points(const Brdf<double>& brdf, const Vec3<double>& wo, const Vec3<double>& axis, double e, int count) {
  std::vector<double> exponents;
  for (double x = std::max(4 * e, 1.0); x > 0.5; x /= 5) exponents.push_back(x);
  const int strata = 1 + int(exponents.size());
  const int of_model = count * 2 / 5, of_lobe = (count - of_model) / strata;
  const double share_model = double(of_model), share_lobe = double(of_lobe);
  const auto density = [&](const Vec3<double>& wi) {
    double p = share_model * brdf.pdf(wi, wo) + share_lobe * kInvPi / 2;
    for (const double x : exponents) p += share_lobe * power_lobe_pdf(x, axis, wi);
    return p;
  };
  Points points;
  const auto add = [&](const Vec3<double>& wi) {
    if (!(wi.z > 1e-9)) return;
    points.wi.push_back(wi);
    points.weight.push_back(1 / density(wi));
  };
  Sequence3 sequence(7);
  for (int i = 0; i < of_model; ++i) {
    const Sample<double> s = brdf.sample(wo, sequence.next());
    if (s.pdf > 0) add(s.wi);
  }
  for (const double x : exponents)
    for (int i = 0; i < of_lobe; ++i) {
      const Vec3<double> u = sequence.next();
      add(about_axis(axis, sample_power_lobe(x, u.x, u.y)));
    }
  for (int i = 0; i < of_lobe; ++i) {
    const Vec3<double> u = sequence.next();
    add(direction(1 - u.x, 2 * kPi * u.y));
  }
  return points;
}

/// f cos(theta_i) of the points, a column a channel. Throws ValueError for a bad value.
MatrixXd scattering(const BoundModel& model, const Points& points, const Vec3<double>& wo) {
  MatrixXd f(Eigen::Index(points.wi.size()), 3);
  for (std::size_t i = 0; i < points.wi.size(); ++i) {
    const Rgb<double> v = model.brdf->eval(points.wi[i], wo);
    require_value(v, "f", model.label, points.wi[i], wo);
    f.row(Eigen::Index(i)) << v.r * points.wi[i].z, v.g * points.wi[i].z, v.b * points.wi[i].z;
  }
  return f;
}

VectorXd weights_of(const Points& points) {
  return Eigen::Map<const VectorXd>(points.weight.data(), Eigen::Index(points.weight.size()));
}

/// The lobe that f^2 makes, of the brightest channel: squared, because a wide base would draw the axis to itself.
struct Moments {
  double offset = 0;            ///< of its axis from the mirror direction
  double narrow = 1, wide = 1;  ///< exponents that have the variances of its two widths
};
Moments moments(const BoundModel& model, const Vec3<double>& wo) {
  Moments m;
  for (int step = 0; step < 4; ++step) {
    const Points points = spread_points(*model.brdf, wo, beside_mirror(wo, m.offset), m.narrow, kPoints);
    const VectorXd f = scattering(model, points, wo).rowwise().maxCoeff();
    Vec3<double> axis{0, 0, 0};
    double total = 0;
    for (std::size_t i = 0; i < points.wi.size(); ++i) {
      const double q = points.weight[i] * sqr(f[Eigen::Index(i)]);
      axis = axis + points.wi[i] * q;
      total += q;
    }
    if (!(total > 0)) return {};
    // What lies in the plane of incidence: x towards the mirror direction, z along the normal.
    const double sinTheta = std::sqrt(sin2_theta(wo));
    const Vec3<double> out =
        sinTheta > 1e-6 ? Vec3<double>{-wo.x / sinTheta, -wo.y / sinTheta, 0} : Vec3<double>{1, 0, 0};
    const double along = dot(axis, out), up = axis.z;
    m.offset = std::atan2(sinTheta, wo.z) - std::atan2(along, up);
    if (sinTheta <= 1e-6) m.offset = 0;
    const Vec3<double> centre = beside_mirror(wo, m.offset), across = {-out.y, out.x, 0},
                       inside = cross(across, centre);
    double variance_in = 0, variance_across = 0;
    for (std::size_t i = 0; i < points.wi.size(); ++i) {
      const double q = points.weight[i] * sqr(f[Eigen::Index(i)]) / total;
      variance_in += q * sqr(dot(points.wi[i], inside));
      variance_across += q * sqr(dot(points.wi[i], across));
    }
    // (cos^e)^2 has the variance 1 / (2 e) in each direction.
    m.narrow = 0.5 / std::max(std::min(variance_in, variance_across), 1e-12);
    m.wide = 0.5 / std::max(std::max(variance_in, variance_across), 1e-12);
  }
  return m;
}

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

/// The closure of a lobe without colours.
template <class T> Closure<T> lobe_closure(const Vec3<T>& wo, const T& offset, const T& exponent) {
  Closure<T> c(ClosureKind::PhongRamp, Rgb<T>(T(1)));
  c.normal = normalize(beside_mirror(wo, offset) + wo);
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

/// Least absolute differences over the columns of `a`, whose integrals are about 1, with the integral of f kept, and
/// drawn towards `near`. towards `near`. The last `positive` coefficients are not negative.
VectorXd solve(const MatrixXd& a, const VectorXd& weight, const VectorXd& f, const VectorXd& near,
               Eigen::Index positive) {
  // Cycles draws diffuse_ramp in proportion to a cosine that its colours need not have: with a first colour other than
  // 0 the variance would be infinite.
  const Eigen::Index first_of_diffuse = a.cols() - positive - kRampSize;
  const Eigen::Index n = a.cols();
  const double albedo = f.dot(weight);
  if (!(albedo > 0)) return VectorXd::Zero(n);
  const VectorXd integral = a.transpose() * weight;
  const double scale = f.maxCoeff();
  VectorXd r = weight.cwiseQuotient(f.cwiseMax(1e-3 * scale)), fine = VectorXd::Zero(f.size()), x;
  std::vector<bool> out(std::size_t(n), false);
  out[std::size_t(first_of_diffuse)] = true;
  for (int step = 0; step < kSteps; ++step) {
    // A fined point pulls towards 0 with its own weight, beside the pull towards f.
    const MatrixXd scaled = (r + fine).cwiseSqrt().asDiagonal() * a;
    MatrixXd normal = MatrixXd::Zero(n, n);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(scaled.transpose());
    const double ridge = kRidge * normal.trace() / double(n);
    normal.diagonal().array() += ridge;
    const VectorXd right_f = a.transpose() * r.cwiseProduct(f) + ridge * near;
    for (bool again = true; again;) {
      MatrixXd m(n + 1, n + 1);
      m << MatrixXd(normal.selfadjointView<Eigen::Lower>()), integral, integral.transpose(), 0;
      VectorXd right(n + 1);
      right << right_f, albedo;
      for (Eigen::Index k = 0; k < n; ++k)
        if (out[std::size_t(k)]) {
          m.row(k).setZero();
          m.col(k).setZero();
          m(k, k) = 1;
          right[k] = 0;
        }
      x = m.partialPivLu().solve(right).head(n);
      again = false;
      for (Eigen::Index k = n - positive; k < n; ++k)
        if (x[k] < 0) again = out[std::size_t(k)] = true;
    }
    const VectorXd sum = a * x, rest = (sum - f).cwiseAbs();
    const double mean = rest.dot(weight) / weight.sum();
    r = weight.cwiseQuotient((rest.array() + 1e-3 * mean + 1e-12 * scale).matrix());
    r *= weight.sum() / r.sum();
    for (Eigen::Index i = 0; i < f.size(); ++i) fine[i] = sum[i] < 0 ? 2 * fine[i] + 0.02 * r[i] : 0.9 * fine[i];
  }
  return x;
}

/// Whether f changes when both directions turn about the normal.
bool turns(const Brdf<double>& brdf) {
  Random random(11);
  const double c = std::cos(1.0), s = std::sin(1.0);
  for (const auto& [wi, wo] : direction_pairs(brdf, 256, random, false)) {
    const Rgb<double> f = brdf.eval(wi, wo), turned = brdf.eval(rotate_z(wi, c, s), rotate_z(wo, c, s));
    if (relative(f, turned) > 1e-4 && max_component(f + turned) > 1e-6) return true;
  }
  return false;
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

/// The model from one view.
struct View {
  Vec3<double> wo;
  Moments lobe;
  Points points;
  MatrixXd f;
};
View seen(const BoundModel& bound, const Vec3<double>& wo, int points) {
  View v{wo, moments(bound, wo), {}, {}};
  v.points = spread_points(*bound.brdf, wo, beside_mirror(wo, v.lobe.offset), v.lobe.narrow, points);
  v.f = scattering(bound, v.points, wo);
  return v;
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
  Rgb<double> tint{1, 1, 1};
  int channels = 3;
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

  // Where the channels differ by a factor alone, one fit serves them all.
  Eigen::Array3d ratio = Eigen::Array3d::Zero();
  for (const Cell& c : out.cells) ratio += (c.f.transpose() * weights_of(c.points)).array();
  ratio /= std::max(ratio.maxCoeff(), 1e-300);
  bool proportional = true;
  for (const Cell& c : out.cells)
    for (Eigen::Index i = 0; i < c.f.rows() && proportional; ++i) {
      const double grey = c.f.row(i).maxCoeff();
      for (int k = 0; k < 3; ++k) proportional = proportional && std::abs(c.f(i, k) - ratio[k] * grey) <= 1e-9 * grey;
    }
  if (proportional) {
    out.channels = 1;
    out.tint = {ratio[0], ratio[1], ratio[2]};
    for (Cell& c : out.cells) c.f = MatrixXd(c.f.rowwise().maxCoeff());
  }

  for (Cell& c : out.cells) c.x = MatrixXd::Zero(c.a.cols(), out.channels);
  std::vector<double> error(std::size_t(out.channels), 0.0);
  tbb::parallel_for(0, out.channels, [&](int channel) {
    // From one view to the next, so that neighbours are alike and what lies between them is a fit too.
    VectorXd near = VectorXd::Zero(out.cells[0].a.cols());
    for (Cell& c : out.cells) {
      const VectorXd weight = weights_of(c.points), f = c.f.col(channel);
      c.x.col(channel) = near = solve(c.a, weight, f, near, Eigen::Index(out.facets.size()));
      const double albedo = f.dot(weight);
      if (albedo > 0)
        error[std::size_t(channel)] += (c.a * near - f).cwiseAbs().dot(weight) / albedo / double(out.cells.size());
    }
  });
  out.error = *std::max_element(error.begin(), error.end());
  return out;
}

}  // namespace

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
  // Few views tell which closures suit.
  Family family = kFamilies[0];
  double least = std::numeric_limits<double>::infinity();
  for (const Family f : kFamilies) {
    const double error = fit_views(views, kTrialStride, f).error;
    if (error < least) least = error, family = f;
  }
  const Fitted fitted = fit_views(views, 1, family);
  const std::vector<Cell>& cells = fitted.cells;
  tint_ = fitted.tint;
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
        const double albedo = (c.f.transpose() * weights_of(c.points)).sum() / fitted.channels;
        const double of_facets = c.x.bottomRows(c.x.rows() - of_ramps).sum() / fitted.channels;
        return std::max(albedo - of_facets, 1e-2 * albedo) * (own / all + 1e-3) / (1 + 1e-3 * double(lobes + 1));
      });
    for (int channel = 0; channel < fitted.channels; ++channel) {
      l.colour.emplace_back();
      for (int k = 0; k < entries; ++k)
        l.colour.back().push_back(table(fmt::format("colour_of_{}_{}_{}", j, k, channel),
                                        [&](const Cell& c) { return c.x(first + k, channel) / c.scale[first + k]; }));
    }
    linear_.push_back(std::move(l));
  }

  errors_.resize(kErrorViews);
  tbb::parallel_for(std::size_t(0), errors_.size(), [&](std::size_t i) {
    const Vec3<double> wo = direction(1 - (double(i) + 0.5) / kErrorViews, 0);
    const View v = seen(bound, wo, 2 * kPoints);
    const Points& points = v.points;
    const MatrixXd& f = v.f;
    const ClosureSum<double> sum = closures(wo);
    Eigen::Array3d absolute = Eigen::Array3d::Zero(), square = absolute, albedo = absolute, squares = absolute,
                   signed_difference = absolute, negative = absolute;
    for (std::size_t p = 0; p < points.wi.size(); ++p) {
      const Rgb<double> sum_here = evaluate(sum, points.wi[p], wo);
      const Eigen::Array3d fit(sum_here.r, sum_here.g, sum_here.b), truth = f.row(Eigen::Index(p)).transpose().array();
      const Eigen::Array3d d = fit - truth;
      const double w = points.weight[p];
      absolute += w * d.abs();
      signed_difference += w * d;
      square += w * d.square();
      albedo += w * truth;
      squares += w * truth.square();
      negative -= w * fit.min(0);
    }
    // A channel without light has no relative error.
    const auto share = [](const Eigen::Array3d& a, const Eigen::Array3d& b) {
      return (b > 0).select(a / b.max(1e-300), 0 * a).maxCoeff();
    };
    errors_[i] = {wo.z, share(absolute, albedo), std::sqrt(share(square, squares)), signed_difference.abs().maxCoeff(),
                  share(negative, albedo)};
  });
}

template <class T> ClosureSum<T> Fit::closures(const Vec3<T>& wo) const {
  const std::array<T, 1> x = {named("place", place(wo))};
  const Rgb<T> tint(T(tint_.r), T(tint_.g), T(tint_.b));
  ClosureSum<T> sum;
  for (std::size_t j = 0; j < linear_.size(); ++j) {
    if (j < lobes_.size())
      sum.push_back(lobe_closure(wo, lookup(lobes_[j].offset, x), lookup(lobes_[j].exponent, x)));
    else if (j == lobes_.size())
      sum.emplace_back(ClosureKind::DiffuseRamp, Rgb<T>(T(1)));
    else {
      const Closure<double>& facet = facets_[j - lobes_.size() - 1];
      sum.emplace_back(facet.kind, Rgb<T>(T(1)));
      sum.back().alpha = T(facet.alpha);
    }
    Closure<T>& c = sum.back();
    const auto& colour = linear_[j].colour;
    const auto entry = [&](std::size_t k) {
      const auto channel = [&](std::size_t i) { return lookup(colour[i][k], x); };
      return colour.size() == 1 ? tint * channel(0) : Rgb<T>(channel(0), channel(1), channel(2));
    };
    if (!has_ramp(c.kind)) {
      c.weight = entry(0);
      continue;
    }
    const T weight = maximum(lookup(linear_[j].weight, x), T(1e-20));
    c.weight = Rgb<T>(weight);
    for (std::size_t k = 0; k < kRampSize; ++k) c.ramp[k] = entry(k) / weight;
  }
  return sum;
}
template ClosureSum<double> Fit::closures(const Vec3<double>&) const;
template ClosureSum<Expr> Fit::closures(const Vec3<Expr>&) const;

const Fit& fit_of(const Model& model, const ParamValues& values) {
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<Fit>> made;
  const std::lock_guard lock(mutex);
  std::unique_ptr<Fit>& fit = made[model.info().name + " " + format_values(model.info(), values)];
  if (!fit) fit = std::make_unique<Fit>(model, values);
  return *fit;
}

}  // namespace brdfc
