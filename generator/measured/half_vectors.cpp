// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/half_vectors.h"

#include <algorithm>
#include <cmath>

#include "core/sequence.h"
#include "model/sampling.h"

namespace brdfc::measured {
namespace {

/// Cosine of theta_h at the beginning of a row. Rows are divided by square root, as MERL's are.
double cosine_at(std::size_t row, std::size_t rows) {
  const double x = double(row) / double(rows);
  return row == rows ? 0 : std::cos(x * x * (kPi / 2));
}

/// Difference vectors for which half vectors of a cell are tried.
constexpr int kDifferences = 128;

}  // namespace

HalfVectors::HalfVectors(const Table& table, bool isotropic)
    : thetas_(isotropic ? 128 : 48),
      phis_(isotropic ? 1 : 48),
      density_(thetas_ * phis_),
      rows_(thetas_),
      cells_(thetas_ * phis_) {
  double total = 0;
  for (std::size_t t = 0; t < thetas_; ++t) {
    const double top = cosine_at(t, thetas_), bottom = cosine_at(t + 1, thetas_);
    double row = 0;
    for (std::size_t p = 0; p < phis_; ++p) {
      Sequence2 first(t * phis_ + p), second(7919 + t * phis_ + p);
      double sum = 0;
      for (int i = 0; i < (isotropic ? 4 : 1) * kDifferences; ++i) {
        const Point2 u = first.next(), v = second.next();
        const Vec3<double> h =
            direction(std::min(top + (bottom - top) * v.x, 1.), 2 * kPi * (double(p) + v.y) / double(phis_));
        // f cos times 4 cos theta_d is the density of half vectors per solid angle that has no noise.
        const Vec3<double> wo = about_axis(h, sample_cosine(u.x, u.y));
        const Vec3<double> wi = h * (2 * dot(h, wo)) - wo;
        if (wi.z > 0 && wo.z > 0) sum += luminance(table.eval(wi, wo)) * wi.z * wo.z;
      }
      density_[t * phis_ + p] = sum;
      row += sum * (top - bottom);
      cells_[t * phis_ + p] = row;
    }
    for (std::size_t p = 0; p < phis_; ++p) cells_[t * phis_ + p] /= row > 0 ? row : 1;
    total += row;
    rows_[t] = total;
  }
  if (!(total > 0)) {  // black, as far as was tried: the cosine lobe alone
    matte_ = 1;
    return;
  }
  for (double& r : rows_) r /= total;
  for (double& d : density_) d /= total * 2 * kPi / double(phis_);
  // The share of the cosine lobe with the least variance, for a few views.
  static constexpr double kShares[] = {0.1, 0.2, 0.35, 0.5, 0.7, 0.9};
  std::array<double, std::size(kShares)> moments{};
  constexpr int kViews = 4, kSamples = 1024;
  for (int view = 0; view < kViews; ++view) {
    Sequence3 points(std::uint64_t(view) + 11);
    const Vec3<double> wo = direction(1 - (view + 0.5) / (kViews + 1), 2.4 * view);
    for (int i = 0; i < kSamples; ++i) {
      const Sample<double> s = sample(wo, points.next());
      if (!(s.pdf > 0)) continue;
      const double value = luminance(table.eval(s.wi, wo)) * s.wi.z, matte = cosine_pdf(s.wi),
                   facet = facet_pdf(normalize(s.wi + wo)) / (4 * dot(wo, normalize(s.wi + wo)));
      for (std::size_t k = 0; k < moments.size(); ++k)
        moments[k] += value * value / (s.pdf * (kShares[k] * matte + (1 - kShares[k]) * facet));
    }
  }
  matte_ = kShares[std::min_element(moments.begin(), moments.end()) - moments.begin()];
}

double HalfVectors::facet_pdf(const Vec3<double>& h) const {
  if (matte_ == 1) return 0;
  const double theta = std::atan2(std::sqrt(sin2_theta(h)), h.z);
  const std::size_t t = std::min(std::size_t(std::sqrt(theta / (kPi / 2)) * double(thetas_)), thetas_ - 1);
  const double turn = wrap(std::atan2(h.y, h.x) / (2 * kPi));
  return density_[t * phis_ + std::min(std::size_t(turn * double(phis_)), phis_ - 1)];
}

double HalfVectors::pdf(const Vec3<double>& wi, const Vec3<double>& wo) const {
  if (!(wi.z > 0 && wo.z > 0)) return 0;
  const Vec3<double> h = normalize(wi + wo);
  return matte_ * cosine_pdf(wi) + (1 - matte_) * facet_pdf(h) / (4 * dot(wo, h));
}

Sample<double> HalfVectors::sample(const Vec3<double>& wo, const Vec3<double>& u) const {
  Vec3<double> wi;
  if (u.x < matte_) {
    wi = sample_cosine(u.y, u.z);
  } else {
    const std::size_t t =
        std::min(std::size_t(std::upper_bound(rows_.begin(), rows_.end(), u.y) - rows_.begin()), thetas_ - 1);
    const double before = t > 0 ? rows_[t - 1] : 0, x = std::clamp((u.y - before) / (rows_[t] - before), 0., 1.);
    const auto first = cells_.begin() + long(t * phis_);
    const std::size_t p = std::min(std::size_t(std::upper_bound(first, first + long(phis_), u.z) - first), phis_ - 1);
    const double from = p > 0 ? first[long(p) - 1] : 0, y = std::clamp((u.z - from) / (first[long(p)] - from), 0., 1.);
    const double top = cosine_at(t, thetas_), bottom = cosine_at(t + 1, thetas_);
    const Vec3<double> h = direction(std::min(top + (bottom - top) * x, 1.), 2 * kPi * (double(p) + y) / double(phis_));
    const double along = dot(h, wo);
    if (!(along > 0)) return {{0, 0, 1}, Rgb<double>(0), 0};
    wi = h * (2 * along) - wo;
  }
  if (!(wi.z > 0 && wo.z > 0)) return {{0, 0, 1}, Rgb<double>(0), 0};
  return {wi, Rgb<double>(0), pdf(wi, wo)};
}

}  // namespace brdfc::measured
