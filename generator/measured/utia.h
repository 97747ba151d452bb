// SPDX-License-Identifier: GPL-3.0-or-later
// The UTIA database's .bin files: an anisotropic BRDF at theta of 0, 15, ... 75 degrees and phi of 0, 7.5, ... 352.5.
//
// Planes of doubles for red, green and blue, each a matrix of 288 x 288: rows are the light's directions, columns the
// viewer's, and the azimuth runs faster than the polar angle in both. There is no header, so the size alone identifies
// the format. Values are taken for a linear BRDF in 1/sr.
#pragma once

#include "measured/measurement.h"

namespace brdfc::measured {

Measurement read_utia(const std::filesystem::path&);

}  // namespace brdfc::measured
