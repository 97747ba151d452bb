// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/aimed.h"
#include "model/horizon.h"

namespace brdfc::forms {

AimedSum aimed_sum(const Brdf<double>& brdf, const ClosureSum<double>& base,
                   const std::vector<LampPatch<double>>& patches, const Vec3<double>& wo, const Vec3<double>& u,
                   const std::vector<std::array<double, 2>>& v, const std::vector<LampBeam<double>>& beams,
                   const std::optional<Vec3<double>>& horizon) {
  const auto excess_at = [&](const Vec3<double>& wi) { return excess(brdf, base, wi, wo); };
  AimedSum out;
  std::vector<LampPatch<double>> of;
  std::vector<double> solid_angles;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    LitPart<double> lit{patches[i], patches[i]};
    if (!beams.empty() && beams[i].edge > 0) lit = lit_part(patches[i], beams[i]);
    if (!brdf.scatters_through() && highest(lit.lamp) <= 0) continue;
    if (lit.lamp.centre.z <= kMirrorRise * length(lit.lamp.centre)) continue;
    double room = 1;
    for (const AimedLobe<double>& earlier : out.lobes) room = std::min(room, room_beside(lit.lamp.centre, earlier));
    AimedLamp<double> lamp = aim_at(lit.lamp, lit.mean, room, v[i][0], v[i][1], wo);
    if (horizon && lowest(lit.lamp, *horizon) < 0) lamp = cut_off(lamp, lit.mean, *horizon, v[i][0], v[i][1]);
    const double emphasis = emphasis_of(lamp);
    if (emphasis == 0) continue;
    Excess<double> there = excess_at(lamp.wi);
    for (std::size_t k = 0; k < out.lobes.size(); ++k)
      there.value = there.value - out.values[k] * evaluate(out.lobes[k], lamp.wi);
    of.push_back(lit.lamp);
    solid_angles.push_back(lamp.solid_angle);
    out.lobes.push_back(lamp.lobe);
    out.values.push_back(send(lamp, emphasis, there.value, there.density).value);
  }
  const auto count = double(out.lobes.size());
  const Toss<double> tossed = toss(u.x, count);
  out.drawn = tossed.lobe < 0 ? draw(brdf, base, wo, {tossed.u, u.y, u.z})
                              : sample_under(out.lobes[std::size_t(tossed.lobe)], u.y, u.z);
  Met<double> met;
  met.ray = out.drawn;
  for (std::size_t k = 0; k < out.lobes.size(); ++k)
    met = meet(met, of[k], out.lobes[k], solid_angles[k], out.values[k], out.drawn);
  out.wi = met.ray;
  const Excess<double> drawn = excess_at(out.drawn);
  const Rest<double> left = rest(drawn.value, drawn.density, count, met);
  out.rest = left.colour * left.weight;
  out.density = density_of_drawn(drawn.density, count, met);
  return out;
}

}  // namespace brdfc::forms
