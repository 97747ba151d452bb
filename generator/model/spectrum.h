// SPDX-License-Identifier: GPL-3.0-or-later
// From spectra of reflectance to colour: X, Y and Z of the CIE's standard observer of 1931 (2 degrees) under D65.
//
// data/color/observer.csv has the observer (ISO/CIE 11664-1) and the relative power of D65 (ISO/CIE 11664-2), in steps
// of 5 nm from 380 to 780, what CIE 15 asks of colorimetry. X, Y and Z are those over a perfect reflector's, so that
// what reflects every wavelength alike is grey in every working space; a ColorConfig turns them into one.
#pragma once

#include <array>
#include <functional>

namespace brdfc::inline model {

/// Wavelengths in nm at which spectra are summed up.
inline constexpr int kWavelengthMin = 380, kWavelengthMax = 780, kWavelengthStep = 5;
inline constexpr std::size_t kWavelengths = (kWavelengthMax - kWavelengthMin) / kWavelengthStep + 1;

/// X, Y and Z, each over that of a perfect reflector.
using Xyz = std::array<double, 3>;

/// The share that each wavelength has in X, Y and Z; each adds up to 1. Throws InputError naming the file of the
/// observer if that is not as above.
const std::array<Xyz, kWavelengths>& xyz_weights();

/// X, Y and Z of what is given over the wavelength in nm: a reflectance, or any number that is to be averaged alike.
Xyz xyz_of(const std::function<double(double nm)>& spectrum);

}  // namespace brdfc::inline model
