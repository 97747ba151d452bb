// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/aimed.h"
#include "model/horizon.h"

namespace brdfc::forms {

AimedSum aimed_sum(const Brdf<double>& brdf, const ClosureSum<double>& base,
                   const std::vector<LampPatch<double>>& patches, const Vec3<double>& wo, const Vec3<double>& u,
                   const std::vector<std::array<double, 3>>& v, const std::vector<LampBeam<double>>& beams,
                   const std::optional<Vec3<double>>& horizon) {
  const auto excess_at = [&](const Vec3<double>& wi) { return excess(brdf, base, wi, wo); };
  AimedSum out;
  std::vector<LampPatch<double>> of;
  std::vector<double> solid_angles;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const bool has_beam = !beams.empty() && beams[i].edge > 0;
    const LampPatch<double> patch = has_beam ? lit_bounds(patches[i], beams[i]) : patches[i];
    if (!brdf.scatters_through() && highest(patch) <= 0) continue;
    if (patch.centre.z <= kMirrorRise * length(patch.centre)) continue;
    double room = 1;
    for (const AimedLobe<double>& earlier : out.lobes) room = std::min(room, room_beside(patch.centre, earlier));
    AimedLamp<double> lamp = aim_at(patch, room, v[i][0], v[i][1], wo);
    const bool is_cut = horizon && lowest(patch, *horizon) < 0;
    if (is_cut) lamp = cut_off(lamp, patch, *horizon, v[i][0], v[i][1]);
    if (has_beam)
      lamp = lit(lamp, lit_point(patch, patches[i], beams[i], lamp.lobe.half, horizon.value_or(Vec3<double>{0, 0, 1}),
                                 is_cut ? 1. : 0., v[i][0], v[i][1], v[i][2]));
    const double emphasis = emphasis_of(lamp);
    if (emphasis == 0) continue;
    Excess<double> there = excess_at(lamp.wi);
    for (std::size_t k = 0; k < out.lobes.size(); ++k)
      there.value = there.value - out.values[k] * evaluate(out.lobes[k], lamp.wi);
    of.push_back(patch);
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
