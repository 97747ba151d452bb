// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/findings.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/sequence.h"
#include "core/text.h"

namespace brdfc::measured {
namespace {

constexpr int kSamples = 1 << 13, kAzimuths = 8;
constexpr double kVisible = 0.01;

}  // namespace

Findings findings(const Measurement& m, const MeasuredModel& model, const std::vector<double>& degrees) {
  Findings out;
  const auto brdf = model.make_double({});
  for (const double at : degrees) out.views.push_back({at, {}});
  std::vector<double> difference(out.views.size()), sum(out.views.size());
  for_all(out.views.size(), [&](std::size_t i) {
    Findings::View& view = out.views[i];
    Sequence3 points(i + 1);
    const double cos_o = std::cos(view.degrees * kPi / 180);
    for (int k = 0; k < kSamples; ++k) {
      const Vec3<double> wo = direction(cos_o, m.isotropic ? 0 : 2 * kPi * (k % kAzimuths) / kAzimuths);
      const Sample<double> s = brdf->sample(wo, points.next());
      if (!(s.pdf > 0)) continue;
      view.albedo += s.weight / double(kSamples);
      // Views that are spaced evenly in the angle stand for cos sin of it.
      const double weight = s.wi.z / s.pdf * cos_o * std::sqrt(1 - cos_o * cos_o);
      difference[i] += weight * std::abs(luminance(brdf->eval(s.wi, wo)) - luminance(brdf->eval(wo, s.wi)));
      sum[i] += weight * luminance(brdf->eval(s.wi, wo));
    }
  });
  double off = 0, all = 0;
  for (std::size_t i = 0; i < out.views.size(); ++i) off += difference[i], all += sum[i];
  out.non_reciprocal = all > 0 ? off / all : 0;
  if (m.highest < 89)
    out.sentences.push_back(
        fmt::format("nothing was measured beyond {:g} degrees to the normal: what is there holds beyond", m.highest));
  if (out.non_reciprocal > kVisible)
    out.sentences.push_back(fmt::format("not reciprocal: light and view swapped, {} % of the light differs",
                                        in_percent(out.non_reciprocal)));
  const auto brightest =
      std::ranges::max_element(out.views, {}, [](const Findings::View& v) { return max_component(v.albedo); });
  if (max_component(brightest->albedo) > 1 + kVisible)
    out.sentences.push_back(fmt::format("reflects more light than it gets: {:.3g} times seen at {:g} degrees",
                                        max_component(brightest->albedo), brightest->degrees));
  if (!(all > 0)) out.sentences.emplace_back("black: no light is reflected in any direction that was tried");
  return out;
}

}  // namespace brdfc::measured
