// SPDX-License-Identifier: GPL-3.0-or-later
// Dispersive glass: each channel has its own refractive index.
#pragma once

#include <array>

#include "model/fresnel.h"
#include "model/model.h"

namespace brdfc::inline model {

/// Fraunhofer lines in nm, at which the indices of glass are specified.
inline constexpr double kLineC = 656.2725, kLineD = 587.5618, kLineF = 486.1327;

/// Dispersion as a parameter: 20 divided by the Abbe number V_d = (n_d - 1) / (n_F - n_C), as in glTF
/// (KHR_materials_dispersion). 0 is no dispersion, and flint glass is near 1.
inline constexpr double kDispersion = 20;
inline NumberSpec dispersion_spec() {
  return NumberSpec{"dispersion",
                    "Dispersion",
                    0,
                    0,
                    2,
                    0,
                    1,
                    "How far colours are bent apart: 20 over Abbe's number. Crown glass 0.3, diamond 0.36, flint 0.8. "
                    "Costs noise"}
      .as(Optical::Dispersion);
}

/// The wavelengths in nm for red, green and blue: the dominant wavelengths of Rec.709's primaries under D65.
inline constexpr std::array<double, 3> kChannelNm = {611.4, 549.1, 464.2};

/// The refractive index by channel of a glass with the index n_d, from the first two terms of A.-L. Cauchy's series, n
/// = A + B / lambda^2.
template <class T> std::array<T, 3> dispersed(const T& index, const T& dispersion) {
  const auto inverse_square = [](double nm) { return 1 / (nm * nm); };
  const double from_C_to_F = inverse_square(kLineF) - inverse_square(kLineC);
  const T spread = named("spread", (index - T(1)) * dispersion * T(1 / kDispersion));  // n_F - n_C
  const auto channel = [&](double nm) {
    return index + spread * T((inverse_square(nm) - inverse_square(kLineD)) / from_C_to_F);
  };
  return {channel(kChannelNm[0]), channel(kChannelNm[1]), channel(kChannelNm[2])};
}

/// The Fresnel equations for each channel.
template <class T> struct DielectricRgb { Rgb<T> reflected, refracted; };
template <class T> DielectricRgb<T> fresnel_dielectric(const Vec3<T>& wo, const std::array<T, 3>& iors) {
  const Dielectric<T> r = fresnel_dielectric(wo, iors[0]), g = fresnel_dielectric(wo, iors[1]),
                      b = fresnel_dielectric(wo, iors[2]);
  return {{r.reflected, g.reflected, b.reflected}, {r.refracted, g.refracted, b.refracted}};
}

/// The common part of models of a smooth dielectric boundary: ideal reflection and refraction, weighted by the Fresnel
/// equations.
template <class T> struct DielectricBoundary {
  T index, dispersion;

  template <class Visitor> void parameters(const Visitor& v) {
    v(index, NumberSpec{"ior", "IOR", 1.5, 0.1, 10, 1, 2.5, "Refractive index inside over the one outside"}.as(
                 Optical::Index));
    v(dispersion, dispersion_spec());
  }

  T ior() const { return index; }
  auto disperses() const { return dispersion > T(0); }
  std::array<T, 3> channel_iors() const { return dispersed(index, dispersion); }

  Rgb<T> mirror(const Vec3<T>& wo) const { return fresnel_dielectric(wo, channel_iors()).reflected; }
  Rgb<T> transmit(const Vec3<T>& wo) const { return fresnel_dielectric(wo, channel_iors()).refracted; }
};

}  // namespace brdfc::inline model
