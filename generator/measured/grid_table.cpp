// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/grid_table.h"

#include <algorithm>
#include <cmath>

#include "measured/merl.h"

namespace brdfc::measured {
namespace {

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

Rgb<double> Grid::at(const std::array<const AngleAxis*, 4>& axes, const std::array<double, 4>& degrees) const {
  std::array<AngleAxis::Between, 4> between;
  for (std::size_t k = 0; k < 4; ++k) between[k] = axes[k]->locate(degrees[k]);
  std::array<double, 3> sum{};
  double weights = 0;
  for (int i = 0; i < 16; ++i) {
    double weight = 1;
    std::size_t entry = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const bool second = i >> k & 1;
      entry = entry * axes[k]->at.size() + (second ? between[k].second : between[k].first);
      weight *= second ? between[k].weight : 1 - between[k].weight;
    }
    const auto& value = values[entry];
    if (!(weight > 0) || std::isnan(value[0])) continue;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * double(value[c]);
    weights += weight;
  }
  if (!(weights > 0)) return Rgb<double>(0);
  return Rgb<double>(sum[0], sum[1], sum[2]) / weights;
}

Rgb<double> GridTable::eval(const Vec3<double>& wi, const Vec3<double>& wo) const {
  if (!(wi.z > 0 && wo.z > 0)) return Rgb<double>(0);
  const bool isotropic = phi_i.at.size() == 1;
  double azimuth = isotropic ? phi_of(wo) - phi_of(wi) : phi_of(wo);
  if (mirrored) azimuth = std::abs(azimuth - 360 * std::round(azimuth / 360));
  return at({&theta_i, &phi_i, &theta_o, &phi_o},
            {theta_of(wi), isotropic ? phi_i.at[0] : phi_of(wi), theta_of(wo), azimuth});
}

Rgb<double> HalfGridTable::eval(const Vec3<double>& wi, const Vec3<double>& wo) const {
  if (!(wi.z > 0 && wo.z > 0)) return Rgb<double>(0);
  const HalfDifference a = half_difference(wo, wi);
  double azimuth = kDegrees * a.phi_d;
  if (azimuths != Azimuths::Circle) azimuth -= 180 * std::floor(azimuth / 180);
  if (azimuths == Azimuths::Quarter) azimuth = std::min(azimuth, 180 - azimuth);
  // Half a circle is stretched to one, so that its ends meet.
  if (azimuths == Azimuths::Half) azimuth *= 2;
  return at(
      {&theta_h, &phi_h, &theta_d, &phi_d},
      {kDegrees * a.theta_h, phi_h.at.size() == 1 ? phi_h.at[0] : phi_of(wi + wo), kDegrees * a.theta_d, azimuth});
}

}  // namespace brdfc::measured
