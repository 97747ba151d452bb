// SPDX-License-Identifier: GPL-3.0-or-later
// What an aimed form does with lamps, recorded.
#pragma once

#include "forms/recording.h"

namespace brdfc::forms {

/// What is done with each lamp and at the end, which is the same for all models (aimed.h). `lobes` counts the lobes so
/// far: arrays of lamp_* and lobe_* hold their numbers, at `earlier` one of them and at `lobes` the one to come.
struct AimedSteps {
  Recording beam;   ///< reads the lamp and beam*; assigns shining_*, what f is averaged over, and lit_*, the lamp anew
  Recording above;  ///< reads the lamp; assigns lamp_above, how high it reaches
  Recording room;   ///< of `earlier` and the lamp's centre: assigns lobe_room
  Recording aim;    ///< reads the lamp, shining_*, lobe_room, v_1, v_2, wo_*; assigns wi_*, lamp_emphasis,
                  ///< lamp_solid_angle, lobe_height and of the lobe to_lamp_*, to_half_*, exponent, radius, end, extent
  Recording low;  ///< reads the lamp and horizon; assigns lamp_low, how high over that its lowest point is
  Recording cut;  ///< reads what aim reads and assigned, the lobe `lobes` and horizon; assigns wi_*, lamp_emphasis anew
  Recording less;   ///< reads the lobe `earlier` and wi_*; takes it off excess
  Recording send;   ///< reads excess, drawn_density and what aim assigned; assigns the lobe's value, weight and colour
  Recording toss;   ///< assigns tossed, the number of a lobe or less than 0, and u_0
  Recording under;  ///< reads the lobe `chosen`, u_1, u_2; assigns drawn_*
  Recording meet;   ///< adds `earlier` to covered, covered_before, lamp_met and density_under; moves ray_*
  Recording rest;   ///< reads excess, drawn_density, lobes and what meet assigned; assigns rest_weight and rest_colour
  Recording alone;  ///< the same without lamps: reads excess and drawn_density
};
const AimedSteps& aimed_steps();

}  // namespace brdfc::forms
