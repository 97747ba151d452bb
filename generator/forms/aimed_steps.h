// SPDX-License-Identifier: GPL-3.0-or-later
// Recorded programs for the lamps of an aimed form.
#pragma once

#include <vector>

#include "forms/recording.h"

namespace brdfc::forms {

/// The computations for each lamp and at the end (aimed.h), which are the same for all models. `lobes` counts the lobes
/// so far. lamp_* and lobe_* are the numbers of the current lamp and its lobe, earlier_* those of an earlier lamp and
/// its lobe, and chosen_* those of the lobe that a direction is drawn from.
struct AimedSteps {
  Recording bounds;  ///< reads the lamp and beam*; assigns lit_*, which replaces the lamp
  Recording above;   ///< reads the lamp; assigns lamp_above, the height of its highest point
  Recording room;    ///< reads an earlier lobe and the lamp's centre; assigns lobe_room
  Recording
      aim;  ///< reads the lamp, lobe_room, v_1, v_2, wo_*; assigns wi_*, lamp_density, lamp_rise,
            ///< lamp_solid_angle, lobe_height, and the lobe's to_lamp_*, to_half_*, exponent, radius, end, extent, rise
  Recording low;  ///< reads the lamp and the horizon; assigns lamp_low, the height of its lowest point over the horizon
  Recording cut;  ///< reads the inputs of aim, the lobe and the horizon; changes wi_*, lamp_density, lamp_rise
  Recording lit;  ///< reads the lamp, full_* (the lamp before its bounds), beam*, the lobe, the horizon, lamp_cut, v_1,
                  ///< v_2, v_3; changes wi_*, lamp_density, lamp_rise
  Recording emphasis;  ///< reads wi_*, the lobe, lamp_density and lamp_rise; assigns lamp_emphasis
  Recording less;      ///< reads an earlier lobe and wi_*; subtracts the lobe from excess
  Recording send;   ///< reads excess, drawn_density and the results of aim; assigns the lobe's value, weight and colour
  Recording toss;   ///< assigns u_0 and tossed, the index of a lobe or a negative number
  Recording under;  ///< reads the chosen lobe, u_1, u_2; assigns drawn_*
  Recording meet;   ///< adds an earlier lobe to covered, covered_before, lamp_met and density_under; moves ray_*
  Recording rest;   ///< reads excess, drawn_density, lobes and the results of meet; assigns rest_weight and rest_colour
  Recording alone;  ///< rest without lamps: reads excess and drawn_density

  std::vector<Recording> all() const {
    return {bounds, above, room, aim, low, cut, lit, emphasis, less, send, toss, under, meet, rest, alone};
  }
};
const AimedSteps& aimed_steps();

}  // namespace brdfc::forms
