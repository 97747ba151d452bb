// SPDX-License-Identifier: GPL-3.0-or-later
// From spectra of reflectance to linear Rec.709, the colour in which models work.
//
// Observer: C. Wyman, P.-P. Sloan, P. Shirley: Simple Analytic Approximations to the CIE XYZ Color Matching
// Functions, Journal of Computer Graphics Techniques 2(2), 2013, the multi-lobe fit. Light: CIE D65, the white of
// Rec.709 (ISO 11664-2). The weights of a channel add up to exactly 1, so that what reflects every wavelength alike is
// grey; some are negative.
#pragma once

#include <array>
#include <functional>

#include "core/vec.h"

namespace brdfc::inline model {

/// Wavelengths in nm at which spectra are summed up.
inline constexpr int kWavelengthMin = 380, kWavelengthMax = 780, kWavelengthStep = 5;
inline constexpr std::size_t kWavelengths = (kWavelengthMax - kWavelengthMin) / kWavelengthStep + 1;

/// The share that each wavelength has in the three channels.
const std::array<Rgb<double>, kWavelengths>& rec709_weights();

/// Linear Rec.709 of a reflectance given over the wavelength in nm. May leave [0, 1]: some colours of surfaces lie
/// outside of Rec.709.
Rgb<double> rec709_of(const std::function<double(double nm)>& reflectance);

}  // namespace brdfc::inline model
