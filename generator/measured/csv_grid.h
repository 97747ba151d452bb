// SPDX-License-Identifier: GPL-3.0-or-later
// A measured BRDF as a CSV file: a row for every combination of angles.
//
// Columns are theta_i, phi_i, theta_o, phi_o in degrees, or the unit vectors wi_x, wi_y, wi_z, wo_x, wo_y, wo_z, and
// r, g, b in 1/sr. With one value of phi_i the data are isotropic, and phi_o counts from it; if phi_o then lies within
// [0, 180], the other half is its mirror image. Where theta is 0 one azimuth will do.
#pragma once

#include "measured/measurement.h"

namespace brdfc::measured {

Measurement read_csv_grid(const std::filesystem::path&);

}  // namespace brdfc::measured
