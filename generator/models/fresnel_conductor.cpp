// SPDX-License-Identifier: GPL-3.0-or-later
// Polished metal: a mirror whose reflectance is given by the Fresnel equations with a complex refractive index n + i k.
//
// P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection Models, Pacific
// Graphics 1997, section 2: the average over both polarisations, with n and k at every wavelength.
// Numerically stable form: model/fresnel.h.
//
// Three channels replace the spectrum, each with its own index. model/optical.h computes the channels' indices in the
// working space from the spectral data of a metal or from a user's measurements.
#include "model/fresnel.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct FresnelConductor {
  T n_r, n_g, n_b, k_r, k_g, k_b;

  static ModelInfo info() {
    return {.name = "fresnel_conductor",
            .label = "Fresnel Conductor",
            .look = Look::Metal,
            .paper =
                "P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection "
                "Models, Pacific Graphics 1997",
            .equations = "Fresnel's equations, unpolarised",
            .doc = "Polished metal: a mirror coloured by the metal's refractive index.",
            .properties = {.lossless = false, .positive = false, .smooth = false},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(n_r, NumberSpec{"n_r", "n Red", 0.2, 1e-3, 100, 0.05, 5, "Real part of the refractive index"}.by_factors().as(
               Optical::IndexRed));
    v(n_g, NumberSpec{"n_g", "n Green", 0.9, 1e-3, 100, 0.05, 5, "Real part of the refractive index"}.by_factors().as(
               Optical::IndexGreen));
    v(n_b, NumberSpec{"n_b", "n Blue", 1.1, 1e-3, 100, 0.05, 5, "Real part of the refractive index"}.by_factors().as(
               Optical::IndexBlue));
    v(k_r, NumberSpec{"k_r", "k Red", 3.9, 0, 100, 0, 10, "Imaginary part of the refractive index"}.as(
               Optical::ExtinctionRed));
    v(k_g, NumberSpec{"k_g", "k Green", 2.4, 0, 100, 0, 10, "Imaginary part of the refractive index"}.as(
               Optical::ExtinctionGreen));
    v(k_b, NumberSpec{"k_b", "k Blue", 2.2, 0, 100, 0, 10, "Imaginary part of the refractive index"}.as(
               Optical::ExtinctionBlue));
  }

  Rgb<T> mirror(const Vec3<T>& wo) const {
    const T sin2 = named("sin2", sin2_theta(wo));
    const auto R = [&](const T& n, const T& k) { return fresnel_conductor(wo.z, sin2, n, k); };
    return {R(n_r, k_r), R(n_g, k_g), R(n_b, k_b)};
  }
};

BRDFC_MODEL(FresnelConductor)

}  // namespace brdfc
