// SPDX-License-Identifier: GPL-3.0-or-later
// From which view a BRDF reflects most of a white world's light: more than comes is what no surface does.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "model/model.h"

namespace brdfc::measured {

/// Views that are tried, in degrees to the normal.
inline constexpr std::array<double, 8> kAlbedoViews{0, 15, 30, 45, 60, 75, 85, 89};

/// The albedo from one view, over all its azimuths unless the BRDF is isotropic; of ideal mirrors, too.
Rgb<double> view_albedo(const Brdf<double>&, bool isotropic, double degrees);

struct Brightest {
  double albedo = 0;  ///< the largest of all channels
  double degrees = 0;
};
Brightest brightest_view(const Brdf<double>&, bool isotropic);
/// A sentence if a sum of lobes reflects more light than it gets.
std::optional<std::string> gain_of_sum(const Brightest&);

}  // namespace brdfc::measured
