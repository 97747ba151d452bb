// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/chi_square.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>

#include "measure/cubature.h"
#include "measure/guides.h"
#include "measure/probes.h"

namespace brdfc::check {

ChiSquare chi_square(const measure::BoundModel& bound, const Vec3<double>& wo, int samples, std::uint64_t seed) {
  const Brdf<double>& brdf = *bound.brdf;
  const measure::Guides guides(brdf, wo, 8192);
  const auto draw = [&](measure::Random& random, Point2& p) {
    const Sample<double> s = brdf.sample(wo, measure::uniform_cube(random));
    measure::require_value(s.pdf, "pdf", bound.label, s.wi, wo);
    if (!(s.pdf > 0)) return false;
    p = guides.angles(s.wi);
    return true;
  };
  // A k-d tree of medians of pilot samples, so that its cells have about equal probability.
  constexpr int kPilots = 4096, kDepth = 6;
  measure::Random random(seed);
  std::vector<Point2> pilots;
  for (int i = 0; i < kPilots; ++i)
    if (Point2 p; draw(random, p)) pilots.push_back(p);
  struct Cell {
    measure::Rect rect;
    std::vector<Point2> pilots;
  };
  std::vector<Cell> cells{{{0, brdf.scatters_through() ? kPi : kPi / 2, 0, 2 * kPi}, pilots}};
  for (int depth = 0; depth < kDepth; ++depth) {
    std::vector<Cell> halves;
    for (Cell& c : cells) {
      const bool split_x = depth % 2 == 0;
      std::sort(c.pilots.begin(), c.pilots.end(),
                [&](const Point2& a, const Point2& b) { return split_x ? a.x < b.x : a.y < b.y; });
      const std::size_t middle = c.pilots.size() / 2;
      const double at = c.pilots.size() < 2 ? (split_x ? 0.5 * (c.rect.x0 + c.rect.x1) : 0.5 * (c.rect.y0 + c.rect.y1))
                                            : (split_x ? c.pilots[middle].x : c.pilots[middle].y);
      if (split_x ? !(at > c.rect.x0 && at < c.rect.x1) : !(at > c.rect.y0 && at < c.rect.y1)) {
        halves.push_back(std::move(c));
        continue;
      }
      Cell a{c.rect, {}}, b{c.rect, {}};
      (split_x ? a.rect.x1 : a.rect.y1) = at;
      (split_x ? b.rect.x0 : b.rect.y0) = at;
      for (const Point2& p : c.pilots) ((split_x ? p.x : p.y) < at ? a : b).pilots.push_back(p);
      halves.push_back(std::move(a));
      halves.push_back(std::move(b));
    }
    cells = std::move(halves);
  }

  const measure::Integrand2 density = [&](double theta, double phi, double* out) {
    const Vec3<double> wi = guides.direction_at(theta, phi);
    const double pdf = brdf.pdf(wi, wo);
    measure::require_value(pdf, "pdf", bound.label, wi, wo);
    out[0] = pdf * std::sin(theta);
  };
  std::vector<double> expected;
  double total = 0, uncertain = 0;
  ChiSquare result;
  for (const Cell& c : cells) {
    // The integral is computed with two meshes, because one may miss what the other finds.
    const auto probability = [&](std::size_t most) {
      return measure::integrate(density, 1, guides.cells(c.rect, most), {1e-7, 0, 1500});
    };
    // The error of the expected counts must stay small beside their fluctuation. It only grows.
    const auto known = [&] { return uncertain * samples < 0.1 * std::sqrt(double(samples) / double(cells.size())); };
    const measure::CubatureResult r = probability(4);
    uncertain += r.error[0];
    if (known()) uncertain += std::abs(r.value[0] - probability(16).value[0]);
    result.converged = known();
    if (!result.converged) break;
    expected.push_back(r.value[0] * samples);
    total += r.value[0];
  }
  if (!result.converged) {
    // There is nothing to compare with, but invalid values are still found.
    Point2 p;
    for (int i = 0; i < samples; ++i) draw(random, p);
    return result;
  }
  // The last cell contains the lost samples.
  expected.push_back(std::max(0., 1 - total) * samples);
  std::vector<double> observed(expected.size(), 0.);
  for (int i = 0; i < samples; ++i) {
    Point2 p;
    if (!draw(random, p)) {
      ++observed.back();
      continue;
    }
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const measure::Rect& r = cells[k].rect;
      if (p.x >= r.x0 && p.x < r.x1 && p.y >= r.y0 && p.y < r.y1) {
        ++observed[k];
        break;
      }
    }
  }
  std::vector<std::size_t> order(expected.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });
  double pooled_expected = 0, pooled_observed = 0;
  int kept = 0;
  for (std::size_t j = 0; j < order.size(); ++j) {
    pooled_expected += expected[order[j]];
    pooled_observed += observed[order[j]];
    // A remainder too small for a cell of its own is not merged: such cells are (nearly) impossible, and must be empty.
    if (pooled_expected < 5 && j + 1 < order.size()) continue;
    if (pooled_expected > 0) result.statistic += sqr(pooled_observed - pooled_expected) / pooled_expected;
    ++kept;
    pooled_expected = pooled_observed = 0;
  }
  result.degrees = std::max(1, kept - 1);
  result.p = boost::math::cdf(boost::math::complement(boost::math::chi_squared(result.degrees), result.statistic));
  return result;
}

}  // namespace brdfc::check
