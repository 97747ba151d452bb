// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/aimed.h"

namespace brdfc::forms {

AimedSum aimed_sum(const Brdf<double>& brdf, const ClosureSum<double>& base,
                   const std::vector<LampPatch<double>>& patches, const Vec3<double>& wo, const Vec3<double>& u,
                   const std::vector<std::array<double, 2>>& v) {
  const auto excess_at = [&](const Vec3<double>& wi) {
    return excess(brdf, !base.empty(), evaluate(base, wi, wo), wi, wo);
  };
  AimedSum out;
  out.drawn = out.wi = draw(brdf, !base.empty(), wo, u);
  Rgb<double> covered(0.0), before(0.0);
  double met = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const LampPatch<double>& patch = patches[i];
    double room = 1;
    for (const AimedLobe<double>& earlier : out.lobes) room = std::min(room, room_beside(patch.centre, earlier));
    const AimedLamp<double> lamp = aim_at(patch, room, v[i][0], v[i][1], out.drawn, wo);
    if (lamp.emphasis == 0) continue;
    out.wi = beside(patch, out.wi);
    if (lamp.met > 0) {
      met = lamp.solid_angle;
      before = covered;
    }
    Excess<double> there = excess_at(lamp.wi);
    for (std::size_t k = 0; k < out.lobes.size(); ++k)
      there.value = there.value - out.values[k] * evaluate(out.lobes[k], lamp.wi);
    const Sent<double> sent = send(lamp, there.value, there.density);
    out.lobes.push_back(lamp.lobe);
    out.values.push_back(sent.value);
    covered += sent.covered;
  }
  const Excess<double> drawn = excess_at(out.drawn);
  if (met > 0) out.wi = out.drawn;
  const Rest<double> left = rest(drawn.value, drawn.density, covered, met, before);
  out.rest = left.colour * left.weight;
  return out;
}

}  // namespace brdfc::forms
