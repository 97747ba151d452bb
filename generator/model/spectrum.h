// SPDX-License-Identifier: GPL-3.0-or-later
// Conversion of reflectance spectra to colour: X, Y and Z of the CIE 1931 standard observer (2 degrees) under D65.
//
// data/color/observer.csv contains the observer (ISO/CIE 11664-1) and the relative power of D65 (ISO/CIE 11664-2), in
// steps of 5 nm from 380 to 780, as CIE 15 requires for colorimetry. X, Y and Z are divided by those of a perfect
// reflector, so that a surface with constant reflectance is grey in every working space. A ColorConfig converts them to
// a working space.
#pragma once

#include <array>
#include <functional>

namespace brdfc::inline model {

/// The wavelengths in nm at which spectra are sampled.
inline constexpr int kWavelengthMin = 380, kWavelengthMax = 780, kWavelengthStep = 5;
inline constexpr std::size_t kWavelengths = (kWavelengthMax - kWavelengthMin) / kWavelengthStep + 1;

/// X, Y and Z, each divided by that of a perfect reflector.
using Xyz = std::array<double, 3>;

/// The weight of each wavelength in X, Y and Z; each sums to 1. Throws InputError naming the observer's file if it is
/// not as described above.
const std::array<Xyz, kWavelengths>& xyz_weights();

/// X, Y and Z of a function of the wavelength in nm: a reflectance, or any number that is to be averaged in the same
/// way.
Xyz xyz_of(const std::function<double(double nm)>& spectrum);

}  // namespace brdfc::inline model
