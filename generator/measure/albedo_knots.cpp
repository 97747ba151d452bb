// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/albedo_knots.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace brdfc::measure {

std::vector<TableAxis> place_knots(const AlbedoPolynomial& polynomial, const ParamValues& combination,
                                   const std::vector<std::size_t>& axes, const std::vector<Monomial>& group,
                                   const std::vector<Position>& probes) {
  constexpr int kProfile = 33;
  const std::vector<Coordinate>& coordinates = polynomial.coordinates();
  const std::size_t lines = std::min<std::size_t>(probes.size(), axes.size() > 1 ? 8 : 1);
  std::vector<std::vector<double>> density(axes.size(), std::vector<double>(kProfile, 0.));
  std::vector<std::vector<double>> s(axes.size(), std::vector<double>(kProfile));
  std::vector<double> bend(axes.size(), 0.);  // interpolation error = bend / knots^2
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const Coordinate& c = coordinates[axes[a]];
    for (int j = 0; j < kProfile; ++j) s[a][std::size_t(j)] = to_scale(c.range.scale, c.at(double(j) / (kProfile - 1)));
    std::vector<Coefficients> profile(lines * kProfile);
    for_all(profile.size(), [&](std::size_t i) {
      Position x = probes[i / kProfile];
      x[axes[a]] = c.at(double(i % kProfile) / (kProfile - 1));
      profile[i] =
          polynomial.coefficients(combination, x, kAllAzimuths,
                                  axes.size() > 1 ? kTableSettings.grid_samples : 4 * kTableSettings.proof_samples);
    });
    for (std::size_t line = 0; line < lines; ++line) {
      // With one or two axes the random places find the peaks as well; with full weight the ends would take more knots
      // than they need.
      const double weight = line > 0 && line <= kTableSettings.corners && axes.size() <= 2 ? 0.5 : 1;
      for (int j = 1; j + 1 < kProfile; ++j) {
        const Coefficients* f = &profile[line * kProfile + std::size_t(j)];
        const double h0 = s[a][std::size_t(j)] - s[a][std::size_t(j) - 1],
                     h1 = s[a][std::size_t(j) + 1] - s[a][std::size_t(j)];
        const double noise = kTableSettings.profile_noise * (f[-1].error + f[0].error + f[1].error) / (h0 * h1);
        for (const Monomial& t : group) {
          const Rgb<double> f0 = t.in(f[-1]), f1 = t.in(f[0]), f2 = t.in(f[1]);
          const double second = max_abs((f2 - f1) / h1 - (f1 - f0) / h0) * 2 / (h0 + h1);
          if (second > noise)
            density[a][std::size_t(j)] = std::max(density[a][std::size_t(j)], weight * std::sqrt(second / unit_of(f1)));
        }
      }
    }
    density[a].front() = density[a][1];
    density[a].back() = density[a][kProfile - 2];
    double total = 0;
    for (int j = 0; j + 1 < kProfile; ++j)
      total += 0.5 * (density[a][std::size_t(j)] + density[a][std::size_t(j) + 1]) *
               (s[a][std::size_t(j) + 1] - s[a][std::size_t(j)]);
    bend[a] = total * total / 8;
    // A small density everywhere, because the lines don't show every feature.
    const double floor = 0.3 * total / (s[a].back() - s[a].front()) + 1e-9;
    for (double& d : density[a]) d += floor;
  }
  // Adds one knot at a time, on the axis where it reduces the error most for its cost, until the target error is
  // reached or the grid is full.
  std::vector<int> count(axes.size(), 2);
  for (;;) {
    double error = 0, best = 0;
    std::size_t points = 1, choice = 0;
    for (std::size_t a = 0; a < axes.size(); ++a) {
      const auto e = [&](int n) { return bend[a] / double((n - 1) * (n - 1)); };
      error += e(count[a]);
      points *= std::size_t(count[a]);
      const double gain = (e(count[a]) - e(count[a] + 1)) / std::log1p(1. / count[a]);
      if (gain > best) best = gain, choice = a;
    }
    if (axes.empty() || error <= kTableSettings.aim_error || best <= 0) break;
    if (points / std::size_t(count[choice]) * std::size_t(count[choice] + 1) >
            (axes.size() > 3 ? kTableSettings.max_points_4 : kTableSettings.max_points) ||
        count[choice] >= 128)
      break;
    ++count[choice];
  }
  std::vector<TableAxis> out;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const Coordinate& c = coordinates[axes[a]];
    TableAxis axis{c.name, c.range.scale, {}, false};
    std::vector<double> sum{0};
    for (int j = 0; j + 1 < kProfile; ++j)
      sum.push_back(sum.back() + 0.5 * (density[a][std::size_t(j)] + density[a][std::size_t(j) + 1]) *
                                     (s[a][std::size_t(j) + 1] - s[a][std::size_t(j)]));
    for (int i = 0; i < count[a]; ++i) {
      if (i == 0) {
        axis.values.push_back(c.range.low);
        continue;
      }
      if (i + 1 == count[a]) {
        axis.values.push_back(c.range.high);
        continue;
      }
      const double target = sum.back() * i / (count[a] - 1);
      const std::size_t j = std::min<std::size_t>(
          std::size_t(std::upper_bound(sum.begin(), sum.end(), target) - sum.begin()) - 1, kProfile - 2);
      const double t = (target - sum[j]) / (sum[j + 1] - sum[j]);
      axis.values.push_back(
          std::clamp(from_scale(c.range.scale, s[a][j] + t * (s[a][j + 1] - s[a][j])), c.range.low, c.range.high));
    }
    out.push_back(std::move(axis));
  }
  return out;
}

}  // namespace brdfc::measure
