// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/node_table.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace brdfc::print {
namespace {

/// At a higher degree, rounding in single precision exceeds the gain.
constexpr int kDegree = 20;
constexpr double kOff = 2e-4;

double horner(const std::vector<double>& c, double t) {
  double sum = 0;
  for (std::size_t k = c.size(); k-- > 0;) sum = sum * t + c[k];
  return sum;
}

}  // namespace

std::optional<std::vector<double>> polynomial_of(const Table& table) {
  if (table.axes.size() != 1 || table.channels != 1) return std::nullopt;
  const auto value = [&](double x) { return interpolate(table, {x}).r; };
  // Interpolates at Chebyshev nodes with Chebyshev polynomials, then converts to powers with T_k+1 = 2 t T_k - T_k-1.
  constexpr int kCount = kDegree + 1;
  std::vector<double> out(kCount), before(kCount), now(kCount);
  before[0] = 1;
  now[1] = 1;
  for (int k = 0; k < kCount; ++k) {
    double sum = 0;
    for (int j = 0; j < kCount; ++j) {
      const double angle = kPi * (j + 0.5) / kCount;
      sum += value((std::cos(angle) + 1) / 2) * std::cos(k * angle);
    }
    const std::vector<double>& powers = k == 0 ? before : now;
    for (std::size_t i = 0; i < kCount; ++i) out[i] += powers[i] * sum * (k == 0 ? 1. : 2.) / kCount;
    if (k == 0) continue;
    std::vector<double> next(kCount);
    for (std::size_t i = 0; i < kCount; ++i) next[i] = (i > 0 ? 2 * now[i - 1] : 0) - before[i];
    before = std::move(now);
    now = std::move(next);
  }
  for (const double x : table.axes[0].values)
    if (std::abs(horner(out, 2 * x - 1) - value(x)) > kOff * std::abs(value(x))) return std::nullopt;
  return out;
}

Expr polynomial_at(const std::vector<double>& coefficients, const Expr& x) {
  const Expr t = clamp01(x) * Expr(2.0) - Expr(1.0);
  Expr sum(coefficients.back());
  for (std::size_t k = coefficients.size() - 1; k-- > 0;) sum = sum * t + Expr(coefficients[k]);
  return sum;
}

}  // namespace brdfc::print
