// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/brightest.h"

#include <cmath>

#include "core/sequence.h"

namespace brdfc::measured {
namespace {

constexpr int kSumSamples = 1024, kSumAzimuths = 8;
/// An albedo that is larger by less may be due to the samples.
constexpr double kGain = 0.005;

}  // namespace

Rgb<double> view_albedo(const Brdf<double>& brdf, bool isotropic, double degrees) {
  const double cosTheta_o = std::cos(degrees * kPi / 180);
  Sequence3 points(std::uint64_t(degrees) + 1);
  Rgb<double> sum(0);
  for (int k = 0; k < kSumSamples; ++k) {
    const Vec3<double> wo = direction(cosTheta_o, isotropic ? 0 : 2 * kPi * (k % kSumAzimuths) / kSumAzimuths);
    const Sample<double> s = brdf.sample(wo, points.next());
    if (s.pdf > 0) sum += s.weight / double(kSumSamples);
    sum += brdf.mirror(wo) / double(kSumSamples);
  }
  return sum;
}

Brightest brightest_view(const Brdf<double>& brdf, bool isotropic) {
  Brightest out;
  for (const double degrees : kAlbedoViews)
    if (const double a = max_component(view_albedo(brdf, isotropic, degrees)); a > out.albedo) out = {a, degrees};
  return out;
}

std::optional<std::string> gain_of_sum(const Brightest& b) {
  if (!(b.albedo > 1 + kGain)) return std::nullopt;
  return fmt::format("the sum reflects more light than it gets: {:.3g} times seen at {:g} degrees", b.albedo,
                     b.degrees);
}

}  // namespace brdfc::measured
