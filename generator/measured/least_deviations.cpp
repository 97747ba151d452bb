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
constexpr Eigen::Index kFewColumns = 4;

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

/// The x in [0, high] that solve the normal equations of least squares: descent along one after another finds which are
/// at their bounds, and now and then the others are solved for.
void least_squares(const Eigen::MatrixXd& normal, const Eigen::VectorXd& right, const Eigen::VectorXd& high,
                   Eigen::VectorXd& x) {
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
  const Eigen::Index n = columns.cols();
  // Of few columns the products are kept, so that a round takes a dot product for each of them.
  const bool few = n <= kFewColumns;
  Eigen::MatrixXd products(columns.rows(), few ? n * (n + 1) / 2 + n : 0);
  if (few)
    for (Eigen::Index i = 0, k = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) products.col(k++) = columns.col(i).cwiseProduct(columns.col(j));
      products.col(k++) = columns.col(i).cwiseProduct(target);
    }
  Eigen::MatrixXd normal(n, n);
  Eigen::VectorXd right(n), rest(columns.rows()), weights(columns.rows());
  for (int round = 0; round < rounds; ++round, floor *= falls) {
    rest = target;
    for (Eigen::Index i = 0; i < n; ++i) rest -= x[i] * columns.col(i);
    weights = weight.array() / (rest.array().abs() + floor + 1e-30);
    if (few) {
      for (Eigen::Index i = 0, k = 0; i < n; ++i) {
        for (Eigen::Index j = 0; j <= i; ++j) normal(i, j) = normal(j, i) = products.col(k++).dot(weights);
        right[i] = products.col(k++).dot(weights);
      }
    } else {
      const Eigen::MatrixXd weighted = weights.asDiagonal() * columns;
      normal = columns.transpose() * weighted;
      right = weighted.transpose() * target;
    }
    least_squares(normal, right, high, x);
  }
  return x;
}

}  // namespace brdfc::measured
