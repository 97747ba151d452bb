// SPDX-License-Identifier: GPL-3.0-or-later
// A smooth boundary of two transparent media: ideal reflection and ideal refraction, shared out by Fresnel's equations.
//
// P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection Models, Pacific
// Graphics 1997, section 2. Stable form: model/fresnel.h. An index by channel: model/dispersion.h.
#include "model/dispersion.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct FresnelDielectric {
  T index, dispersion;

  static ModelInfo info() {
    return {.name = "fresnel_dielectric",
            .label = "Fresnel Dielectric",
            .look = Look::Glass,
            .paper =
                "P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection "
                "Models, Pacific Graphics 1997",
            .equations = "Fresnel's equations, unpolarised",
            .doc = "Smooth surface of water or clear glass: reflects and refracts.",
            .properties = {.lossless = true, .positive = false, .smooth = false},
            .params = {}};
  }

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

BRDFC_MODEL(FresnelDielectric)

}  // namespace brdfc
