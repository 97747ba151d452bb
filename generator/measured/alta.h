// SPDX-License-Identifier: GPL-3.0-or-later
// Data files of ALTA, as text: a header of lines #KEY VALUE, and a row of numbers for every sample.
//
// L. Belcour, P. Barla, R. Pacanowski: ALTA, a BRDF analysis library, 2013 to 2021. #DIM says how many numbers of a row
// are coordinates and how many are values, #PARAM_IN and #PARAM_OUT what they are; angles are in radians. Rows may come
// in any order, and have to form a grid: for every combination of angles one, unless a direction is below the surface.
#pragma once

#include "measured/measurement.h"

namespace brdfc::measured {

Measurement read_alta(const std::filesystem::path&);

}  // namespace brdfc::measured
