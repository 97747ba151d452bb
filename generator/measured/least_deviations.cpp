// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/least_deviations.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace brdfc::measured {
namespace {

/// Over all rounds the floor falls by the same factor, however many there are.
constexpr double kFloorFalls = 5e-6;
constexpr int kSweeps = 400, kBetweenSteps = 8;
constexpr double kSettled = 1e-12;

/// Solves the normal equations for those x that are within their bounds, and goes as far towards the solution as the
/// bounds allow.
void step_inside(const Eigen::MatrixXd& normal, const Eigen::VectorXd& right, const Eigen::VectorXd& high,
                 Eigen::VectorXd& x) {
  std::vector<Eigen::Index> inside;
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (x[i] > 0 && x[i] < high[i]) inside.push_back(i);
  if (inside.empty()) return;
  const auto n = Eigen::Index(inside.size());
  Eigen::MatrixXd a(n, n);
  Eigen::VectorXd b(n);
  const Eigen::VectorXd rest = right - normal * x;
  for (Eigen::Index i = 0; i < n; ++i) {
    b[i] = rest[inside[std::size_t(i)]];
    for (Eigen::Index j = 0; j < n; ++j) a(i, j) = normal(inside[std::size_t(i)], inside[std::size_t(j)]);
  }
  const Eigen::VectorXd d = a.ldlt().solve(b);
  if (!d.allFinite() || d.dot(b) < 0) return;  // lobes that are nearly alike
  double along = 1;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index k = inside[std::size_t(i)];
    if (d[i] < 0) along = std::min(along, x[k] / -d[i]);
    if (d[i] > 0) along = std::min(along, (high[k] - x[k]) / d[i]);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index k = inside[std::size_t(i)];
    x[k] = std::clamp(x[k] + along * d[i], 0., high[k]);
  }
}

/// The x in [0, high] that minimise the sum of weight (target - columns x)^2: descent along one after another finds
/// which are at their bounds, and now and then the others are solved for.
void least_squares(const Eigen::MatrixXd& columns, const Eigen::VectorXd& target, const Eigen::VectorXd& weight,
                   const Eigen::VectorXd& high, Eigen::VectorXd& x) {
  const Eigen::MatrixXd weighted = weight.asDiagonal() * columns;
  const Eigen::MatrixXd normal = columns.transpose() * weighted;
  const Eigen::VectorXd right = weighted.transpose() * target;
  for (int sweep = 0; sweep < (x.size() > 1 ? kSweeps : 1); ++sweep) {
    if (sweep % kBetweenSteps == 1) step_inside(normal, right, high, x);
    double moved = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      if (!(normal(i, i) > 0)) continue;
      const double before = x[i];
      x[i] = std::clamp(x[i] + (right[i] - normal.row(i).dot(x)) / normal(i, i), 0., high[i]);
      moved = std::max(moved, std::abs(x[i] - before));
    }
    if (moved < kSettled) break;
  }
}

}  // namespace

Eigen::VectorXd least_deviations(const Eigen::MatrixXd& columns, const Eigen::VectorXd& target,
                                 const Eigen::VectorXd& weight, double scale, const Eigen::VectorXd& high, int rounds) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(columns.cols());
  double floor = scale;
  const double falls = std::pow(kFloorFalls, 1. / rounds);
  for (int round = 0; round < rounds; ++round, floor *= falls) {
    const Eigen::VectorXd rest = (target - columns * x).cwiseAbs();
    least_squares(columns, target, weight.array() / (rest.array() + floor + 1e-30), high, x);
  }
  return x;
}

}  // namespace brdfc::measured
