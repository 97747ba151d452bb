// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/kernel_fit.h"

#include <algorithm>
#include <cmath>

#include "measure/albedo.h"

namespace brdfc::measure {
namespace {

constexpr std::size_t kHeights = 4;
using Heights = std::array<double, kHeights>;
using Four = DrawnKernel<double, EvenKnots<double, int(kHeights)>>;

/// The curve extended to start at u = 0, with its maximum scaled to 1.
KernelCurve normalised(const KernelCurve& drawn) {
  KernelCurve c = drawn;
  if (c.u.front() > 0) {
    c.u.insert(c.u.begin(), 0.);
    c.k.insert(c.k.begin(), c.k.front());
  }
  const double top = *std::max_element(c.k.begin(), c.k.end());
  for (double& k : c.k) k /= top;
  return c;
}

/// The curve's height at the nodes of a quadrature over the distance u = |x' - y'| in a square of side n. The points of
/// the square at distance u form a line of length n - u, which is the weight.
struct Target {
  std::vector<double> u, k, weight;
};

Target make_target(const KernelCurve& curve, double n) {
  const double end = std::min(curve.u.back(), n);
  std::vector<double> ends{0, n};
  for (const double u : curve.u)
    if (u < n) ends.push_back(u);
  // Equal steps for the curve; geometric steps for a peak at 0 and for the range beyond the last point.
  for (int i = 1; i <= 512; ++i) ends.push_back(end * i / 512);
  for (double u = 1e-5 * end; u < n; u *= 1.03) ends.push_back(u);
  std::sort(ends.begin(), ends.end());
  const auto lobe = kernel_lobe(curve, n);
  Target t;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const double half = 0.5 * (ends[i + 1] - ends[i]), middle = 0.5 * (ends[i + 1] + ends[i]);
    if (!(half > 0)) continue;
    for (const double at : {-std::sqrt(1 / 3.), std::sqrt(1 / 3.)}) {
      t.u.push_back(middle + half * at);
      t.k.push_back(lobe.drawn.k(t.u.back()));
      t.weight.push_back(half * (n - t.u.back()));
    }
  }
  return t;
}

/// The heights with the smallest L1 error for knots `step` apart, and that error. Found by least squares with weights
/// recomputed from the residuals.
struct Candidate {
  double step = 0, l1 = 0;
  Heights heights{};
};

Candidate best_heights(const Target& target, double step, double lowest) {
  constexpr int kRounds = 60, kSweeps = 40;
  // Each node lies between two knots: the index of the first and the weight of the second.
  const std::size_t count = target.u.size();
  std::vector<std::size_t> knot(count);
  std::vector<double> share(count), residual(count, 1.);
  for (std::size_t j = 0; j < count; ++j) {
    const double x = target.u[j] / step;
    knot[j] = std::min(std::size_t(x), kHeights - 2);
    share[j] = std::min(x - double(knot[j]), 1.);
  }
  Candidate c{step, 0, {}};
  c.heights.fill(0.5);
  double floor = 0.1;
  for (int round = 0; round < kRounds; ++round, floor = std::max(floor / 2, 1e-14)) {
    Heights diagonal{}, right{};
    std::array<double, kHeights - 1> beside{};
    for (std::size_t j = 0; j < count; ++j) {
      const double w = target.weight[j] / std::max(std::abs(residual[j]), floor), b = share[j], a = 1 - b;
      const std::size_t i = knot[j];
      diagonal[i] += w * a * a;
      diagonal[i + 1] += w * b * b;
      beside[i] += w * a * b;
      right[i] += w * a * target.k[j];
      right[i + 1] += w * b * target.k[j];
    }
    for (int sweep = 0; sweep < kSweeps; ++sweep)
      for (std::size_t i = 0; i < kHeights; ++i) {
        // A knot beyond every distance that occurs continues the line.
        if (i > 0 && !(diagonal[i] > 0)) {
          c.heights[i] = c.heights[i - 1];
          continue;
        }
        double rest = right[i];
        if (i > 0) rest -= beside[i - 1] * c.heights[i - 1];
        if (i + 1 < kHeights) rest -= beside[i] * c.heights[i + 1];
        c.heights[i] = std::clamp(rest / diagonal[i], lowest, 1.);
      }
    c.l1 = 0;
    for (std::size_t j = 0; j < count; ++j) {
      residual[j] = (1 - share[j]) * c.heights[knot[j]] + share[j] * c.heights[knot[j] + 1] - target.k[j];
      c.l1 += target.weight[j] * std::abs(residual[j]);
    }
  }
  return c;
}

Candidate best_step(const Target& target, double shortest, double longest, double lowest) {
  constexpr int kPerDecade = 20;
  const int steps = std::max(2, int(std::ceil(kPerDecade * std::log10(longest / shortest))));
  const double ratio = std::pow(longest / shortest, 1. / steps);
  const auto at = [&](double i) {
    return best_heights(target, i <= 0 ? longest : longest * std::pow(ratio, -i), lowest);
  };
  // Starts with the longest step: of two equally good results, the one with the smaller n is kept.
  std::vector<Candidate> grid;
  for (int i = 0; i <= steps; ++i) grid.push_back(at(i));
  Candidate best = grid[0];
  double whole = 0;
  for (std::size_t j = 0; j < target.u.size(); ++j) whole += target.weight[j] * target.k[j];
  const auto consider = [&](const Candidate& c) {
    if (c.l1 < best.l1 - 1e-9 * whole) best = c;
  };
  for (int i = 0; i <= steps; ++i) {
    const auto l1 = [&](int j) { return grid[std::size_t(std::clamp(j, 0, steps))].l1; };
    consider(grid[std::size_t(i)]);
    if (l1(i) > l1(i - 1) || l1(i) > l1(i + 1)) continue;
    // Golden-section search between the neighbours of a local minimum.
    const double golden = 0.5 * (std::sqrt(5.) - 1);
    double a = std::max(i - 1, 0), b = std::min(i + 1, steps);
    Candidate low = at(b - golden * (b - a)), high = at(a + golden * (b - a));
    for (int k = 0; k < 48; ++k)
      if (low.l1 < high.l1) {
        b -= (1 - golden) * (b - a);
        high = low;
        low = at(b - golden * (b - a));
      } else {
        a += (1 - golden) * (b - a);
        low = high;
        high = at(a + golden * (b - a));
      }
    consider(low.l1 < high.l1 ? low : high);
  }
  return best;
}

/// The sum of |f - g| cos over the light directions. Both f and g must reflect all light and must not depend on the
/// azimuth. The integral is over x = cos^2 theta_i, in cells that are small near the kernel's peak at y.
double relative_l1(const KernelLobe<double, FreeKnots<double>>& f, const Brdf<double>& g, double y) {
  std::vector<double> ends{0, y, 1};
  for (int i = 1; i < 256; ++i) ends.push_back(i / 256.);
  for (double far = 0.5; far > 1e-7; far *= 0.94)
    for (const double x : {y - far, y + far})
      if (x > 0 && x < 1) ends.push_back(x);
  std::sort(ends.begin(), ends.end());
  const Vec3<double> wo = direction(std::sqrt(y), 0);
  double sum = 0;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const Vec3<double> wi = direction(std::sqrt(0.5 * (ends[i] + ends[i + 1])), kPi);
    sum += std::abs(f.eval(wi, wo).r - g.eval(wi, wo).r) * (ends[i + 1] - ends[i]);
  }
  return kPi * sum;
}

double to_six_digits(double v) { return std::stod(fmt::format("{:.6g}", v)); }

}  // namespace

KernelLobe<double, FreeKnots<double>> kernel_lobe(const KernelCurve& drawn, double n) {
  const KernelCurve curve = normalised(drawn);
  KernelLobe<double, FreeKnots<double>> lobe;
  lobe.kernel.index = lobe.Table;
  lobe.n = n;
  lobe.drawn.places = curve.u;
  lobe.drawn.heights = curve.k;
  lobe.tint = Rgb<double>(1);
  return lobe;
}

KernelFit fit_kernel(const KernelCurve& drawn, double n) {
  const Model& model = find_model("lossless");
  const auto range = [&](const char* name) -> const ParamInfo& { return *model.info().param(name); };
  const KernelCurve curve = normalised(drawn);
  const double end = std::min(curve.u.back(), n);
  const Candidate best =
      best_step(make_target(curve, n), std::max(1e-4 * end, n / range("n").max), end, range("h0").min);

  KernelFit fit;
  const double fitted_n = to_six_digits(n / best.step);
  const double top = *std::max_element(best.heights.begin(), best.heights.end());
  Four four;
  fit.values["n"] = fitted_n;
  fit.values["kernel"] = std::string("table");
  for (std::size_t i = 0; i < kHeights; ++i) {
    const std::string name = fmt::format("h{}", i);
    four.heights[i] = std::max(to_six_digits(best.heights[i] / top), range(name.c_str()).min);
    fit.values[name] = four.heights[i];
  }

  // The quotient of two linear functions has its extremes at the ends of an interval.
  const auto truth = kernel_lobe(curve, n);
  std::vector<double> ends = curve.u;
  for (std::size_t i = 0; i < kHeights; ++i) ends.push_back(double(i) * n / fitted_n);
  ends.push_back(n);
  for (const double u : ends)
    if (u <= n) fit.kernel = std::max(fit.kernel, std::abs(four.k(u * fitted_n / n) / truth.drawn.k(u) - 1));

  // Views at the centres of intervals with equal shares of all directions.
  constexpr int kViews = 8;
  const auto g = model.make_double(fit.values);
  for (int view = 0; view < kViews; ++view) {
    const double l1 = relative_l1(truth, *g, (view + 0.5) / kViews);
    fit.l1 += l1 / kViews;
    fit.l1_view = std::max(fit.l1_view, l1);
  }
  return fit;
}

}  // namespace brdfc::measure
