// SPDX-License-Identifier: GPL-3.0-or-later
// Metals: their published optical constants, and what stands for these in three channels.
#pragma once

#include <string>
#include <vector>

#include "core/vec.h"

namespace brdfc::inline model {

/// A metal with its spectra.
struct Metal {
  std::string name;              ///< "cu"
  std::string label;             ///< "copper"
  std::string source;            ///< of the spectra
  std::vector<double> nm, n, k;  ///< wavelengths, increasing; complex refractive index n + i k there

  /// Linear between the published wavelengths, constant beyond them; `wavelength` in nm.
  double n_at(double wavelength) const { return at(n, wavelength); }
  double k_at(double wavelength) const { return at(k, wavelength); }
  /// Fresnel reflectance, unpolarised, integrated over the spectrum, as linear Rec.709; `cosTheta` in [0, 1].
  Rgb<double> reflectance(double cosTheta) const;

 private:
  double at(const std::vector<double>& values, double wavelength) const;
};

/// cu, au, ag, al, fe, cr.
const std::vector<Metal>& metals();

/// An index for each channel whose reflectance is as near as can be, by least squares over the cosine, to the one
/// integrated over the spectrum.
struct ChannelIndices {
  std::array<double, 3> n, k;
  Rgb<double> error;  ///< largest |difference| of the reflectance
};
/// In the order of metals(); computed once.
const std::vector<ChannelIndices>& channel_indices();

}  // namespace brdfc::inline model
