// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/grid_table.h"

#include <algorithm>
#include <cmath>

namespace brdfc::measured {
namespace {

constexpr double kDegrees = 180 / kPi;

double theta_of(const Vec3<double>& w) { return kDegrees * std::atan2(std::sqrt(sin2_theta(w)), w.z); }
double phi_of(const Vec3<double>& w) { return kDegrees * std::atan2(w.y, w.x); }

}  // namespace

AngleAxis::Between AngleAxis::locate(double x) const {
  const std::size_t last = at.size() - 1;
  if (ends == Ends::Circle) {
    x = x - 360 * std::floor((x - at[0]) / 360);
    if (last == 0) return {0, 0, 0};
    if (x >= at[last]) return {last, 0, std::min((x - at[last]) / (at[0] + 360 - at[last]), 1.)};
  }
  if (x <= at[0]) return {0, 0, 0};
  if (x >= at[last]) return {last, last, 0};
  const std::size_t second = std::size_t(std::upper_bound(at.begin(), at.end(), x) - at.begin());
  return {second - 1, second, (x - at[second - 1]) / (at[second] - at[second - 1])};
}

Rgb<double> GridTable::eval(const Vec3<double>& wi, const Vec3<double>& wo) const {
  if (!(wi.z > 0 && wo.z > 0)) return Rgb<double>(0);
  const bool isotropic = phi_i.at.size() == 1;
  double azimuth = isotropic ? phi_of(wo) - phi_of(wi) : phi_of(wo);
  if (mirrored) azimuth = std::abs(azimuth - 360 * std::round(azimuth / 360));
  const AngleAxis::Between at[] = {theta_i.locate(theta_of(wi)), phi_i.locate(isotropic ? phi_i.at[0] : phi_of(wi)),
                                   theta_o.locate(theta_of(wo)), phi_o.locate(azimuth)};
  std::array<double, 3> sum{};
  for (int i = 0; i < 16; ++i) {
    double weight = 1;
    std::size_t index[4];
    for (int axis = 0; axis < 4; ++axis) {
      const bool second = i >> axis & 1;
      index[axis] = second ? at[axis].second : at[axis].first;
      weight *= second ? at[axis].weight : 1 - at[axis].weight;
    }
    if (!(weight > 0)) continue;
    const auto& value = values[entry(index[0], index[1], index[2], index[3])];
    for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * double(value[c]);
  }
  return {sum[0], sum[1], sum[2]};
}

}  // namespace brdfc::measured
