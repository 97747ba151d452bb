// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/view.h"

#include <algorithm>
#include <nlopt.hpp>

#include "core/parallel.h"
#include "core/sequence.h"
#include "fit/settings.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "model/power_lobe.h"
#include "model/sampling.h"

namespace brdfc::fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Directions sampled from the model, and from lobes about `axis` with exponents from `e` down to the whole sphere.
/// Each is weighted by the mixture pdf of all of these techniques. `axis` must not be below the surface.
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

Moments moments(const measure::BoundModel& model, const Vec3<double>& wo) {
  Moments m;
  for (int step = 0; step < 4; ++step) {
    const Points points =
        spread_points(*model.brdf, wo, beside_mirror(wo, m.offset), m.narrow, int(kViewSettings.points));
    const VectorXd f = brightest(scattering(model, points, wo));
    Vec3<double> axis{0, 0, 0};
    double total = 0;
    for (std::size_t i = 0; i < points.wi.size(); ++i) {
      const double q = points.weight[i] * sqr(f[Eigen::Index(i)]);
      axis = axis + points.wi[i] * q;
      total += q;
    }
    if (!(total > 0)) return {};
    // The coordinates in the plane of incidence: x towards the mirror direction, z along the normal.
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

}  // namespace

VectorXd weights_of(const Points& points) {
  return Eigen::Map<const VectorXd>(points.weight.data(), Eigen::Index(points.weight.size()));
}

MatrixXd scattering(const measure::BoundModel& model, const Points& points, const Vec3<double>& wo) {
  MatrixXd f(Eigen::Index(points.wi.size()), 3);
  for (std::size_t i = 0; i < points.wi.size(); ++i) {
    const Rgb<double> v = model.brdf->eval(points.wi[i], wo);
    measure::require_value(v, "f", model.label, points.wi[i], wo);
    f.row(Eigen::Index(i)) << v.r * points.wi[i].z, v.g * points.wi[i].z, v.b * points.wi[i].z;
  }
  return f;
}

VectorXd brightest(const MatrixXd& f) { return f.rowwise().maxCoeff(); }

MatrixXd brightest_of_each(const MatrixXd& f) {
  MatrixXd out(f.rows(), f.cols() / 3);
  for (Eigen::Index model = 0; model < out.cols(); ++model) out.col(model) = brightest(f.middleCols(3 * model, 3));
  return out;
}

View view_of(const measure::BoundModel& bound, const Vec3<double>& wo, int points) {
  return view_of(bound, wo, points, moments(bound, wo));
}

View view_of(const measure::BoundModel& bound, const Vec3<double>& wo, int points, const Moments& lobe) {
  View v{wo, lobe, {}, {}};
  v.points = spread_points(*bound.brdf, wo, beside_mirror(wo, v.lobe.offset), v.lobe.narrow, points);
  v.f = scattering(bound, v.points, wo);
  return v;
}

std::optional<Rgb<double>> make_grey(std::vector<View>& views) {
  Eigen::Array3d ratio = Eigen::Array3d::Zero();
  for (const View& v : views)
    for (Eigen::Index first = 0; first < v.f.cols(); first += 3)
      ratio += (v.f.middleCols(first, 3).transpose() * weights_of(v.points)).array();
  ratio /= std::max(ratio.maxCoeff(), 1e-300);
  for (const View& v : views)
    for (Eigen::Index i = 0; i < v.f.rows(); ++i)
      for (Eigen::Index first = 0; first < v.f.cols(); first += 3) {
        const double grey = v.f.row(i).segment(first, 3).maxCoeff();
        for (int k = 0; k < 3; ++k)
          if (!(std::abs(v.f(i, first + k) - ratio[k] * grey) <= 1e-9 * grey)) return std::nullopt;
      }
  for (View& v : views) v.f = brightest_of_each(v.f);
  return Rgb<double>{ratio[0], ratio[1], ratio[2]};
}

VectorXd solve(const MatrixXd& a, const VectorXd& weight, const VectorXd& f, const VectorXd& near,
               const VectorXd& ridge, Eigen::Index positive, double most, std::optional<Eigen::Index> none) {
  const Eigen::Index n = a.cols();
  const double albedo = f.dot(weight);
  if (!(albedo > 0)) return VectorXd::Zero(n);
  const VectorXd integral = a.transpose() * weight;
  const double scale = f.maxCoeff();
  VectorXd r = weight.cwiseQuotient(f.cwiseMax(1e-3 * scale)), fine = VectorXd::Zero(f.size()), x;
  std::vector<bool> out(std::size_t(n), false);
  if (none) out[std::size_t(*none)] = true;
  for (int step = 0; step < int(kViewSettings.solve_steps); ++step) {
    // At a point with a penalty, the penalty's weight pulls the sum towards 0, beside the pull towards f.
    const MatrixXd scaled = (r + fine).cwiseSqrt().asDiagonal() * a;
    MatrixXd normal = MatrixXd::Zero(n, n);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(scaled.transpose());
    const VectorXd pull = ridge * (normal.trace() / double(n));
    normal.diagonal() += pull;
    normal = MatrixXd(normal.selfadjointView<Eigen::Lower>());
    const VectorXd right_f = a.transpose() * r.cwiseProduct(f) + pull.cwiseProduct(near);
    // An active-set method: a coefficient that became negative is fixed at 0 until increasing it would reduce the
    // error. Rounding may move the same coefficients in and out endlessly; in that case negative ones become 0 at the
    // end.
    bool full = false;  // their sum is at its limit
    for (Eigen::Index trial = 0, in = -1; trial < 4 * (positive + 1) && (trial == 0 || in >= 0); ++trial) {
      MatrixXd m = MatrixXd::Zero(n + 2, n + 2);
      m.topLeftCorner(n, n) = normal;
      m.col(n).head(n) = m.row(n).head(n) = integral;
      m(n + 1, n + 1) = 1;
      VectorXd right(n + 2);
      right << right_f, albedo, 0;
      full = full && std::find(out.end() - positive, out.end(), false) != out.end();
      if (full) {
        m.col(n + 1).segment(n - positive, positive).setOnes();
        m.row(n + 1).segment(n - positive, positive).setOnes();
        m(n + 1, n + 1) = 0;
        right[n + 1] = most * albedo;
      }
      for (Eigen::Index k = 0; k < n; ++k)
        if (out[std::size_t(k)]) {
          m.row(k).setZero();
          m.col(k).setZero();
          m(k, k) = 1;
          right[k] = 0;
        }
      const VectorXd solution = m.partialPivLu().solve(right);
      x = solution.head(n);
      in = -1;
      for (Eigen::Index k = n - positive; k < n; ++k)
        if (x[k] < 0) {
          out[std::size_t(k)] = true;
          in = k;
        }
      if (in >= 0) continue;
      if (!full && x.tail(positive).sum() > most * albedo) {
        full = true;
        in = n;
        continue;
      }
      const VectorXd gain =
          right_f - normal * x - solution[n] * integral - VectorXd::Constant(n, full ? solution[n + 1] : 0);
      for (Eigen::Index k = n - positive; k < n; ++k)
        if (out[std::size_t(k)] && k != none && gain[k] > 1e-9 * normal(k, k) && (in < 0 || gain[k] > gain[in])) in = k;
      if (in >= 0) out[std::size_t(in)] = false;
    }
    x.tail(positive) = x.tail(positive).cwiseMax(0);
    const VectorXd sum = a * x, rest = (sum - f).cwiseAbs();
    const double mean = rest.dot(weight) / weight.sum();
    r = weight.cwiseQuotient((rest.array() + 1e-3 * mean + 1e-12 * scale).matrix());
    r *= weight.sum() / r.sum();
    for (Eigen::Index i = 0; i < f.size(); ++i) fine[i] = sum[i] < 0 ? 2 * fine[i] + 0.02 * r[i] : 0.9 * fine[i];
  }
  return x;
}

std::vector<double> argmin(const std::vector<Variable>& variables,
                           const std::function<double(const std::vector<double>&)>& error) {
  std::vector<double> x, low, high, step;
  for (const Variable& v : variables) {
    x.push_back(std::clamp(v.start, v.low, v.high));
    low.push_back(v.low);
    high.push_back(v.high);
    step.push_back(v.step);
  }
  nlopt::opt search(nlopt::LN_BOBYQA, unsigned(x.size()));
  search.set_lower_bounds(low);
  search.set_upper_bounds(high);
  search.set_initial_step(step);
  search.set_maxeval(int(kViewSettings.search_trials));
  search.set_ftol_rel(kViewSettings.search_tolerance);
  search.set_min_objective(
      [](const std::vector<double>& at, std::vector<double>&, void* f) {
        return (*static_cast<const std::function<double(const std::vector<double>&)>*>(f))(at);
      },
      const_cast<void*>(static_cast<const void*>(&error)));
  double value = 0;
  try {
    search.optimize(x, value);
  } catch (const nlopt::roundoff_limited&) {
    // The best solution so far is in `x`.
  }
  return x;
}

std::vector<ViewError> view_errors(const measure::BoundModel& bound,
                                   const std::function<ClosureSum<double>(const Vec3<double>& wo)>& closures) {
  std::vector<ViewError> errors(kViewSettings.error_views);
  for_all(errors.size(), [&](std::size_t i) {
    const Vec3<double> wo = direction(1 - (double(i) + 0.5) / double(kViewSettings.error_views), 0);
    const View v = view_of(bound, wo, 2 * int(kViewSettings.points));
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
    errors[i] = {wo.z,
                 share(absolute, albedo),
                 std::sqrt(share(square, squares)),
                 signed_difference.abs().maxCoeff(),
                 share(negative, albedo),
                 0};
  });
  return errors;
}

ViewError worse(const ViewError& a, const ViewError& b) {
  return {a.cos_theta_o,
          std::max(a.relative_l1, b.relative_l1),
          std::max(a.relative_l2, b.relative_l2),
          std::max(a.albedo, b.albedo),
          std::max(a.negative, b.negative),
          a.number};
}

bool turns(const Brdf<double>& brdf) {
  measure::Random random(11);
  const double c = std::cos(1.0), s = std::sin(1.0);
  for (const auto& [wi, wo] : measure::direction_pairs(brdf, 256, random, false)) {
    const Rgb<double> f = brdf.eval(wi, wo), turned = brdf.eval(rotate_z(wi, c, s), rotate_z(wo, c, s));
    if (measure::relative(f, turned) > 1e-4 && max_component(f + turned) > 1e-6) return true;
  }
  return false;
}

}  // namespace brdfc::fit
