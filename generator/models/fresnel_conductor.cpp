// SPDX-License-Identifier: GPL-3.0-or-later
// A polished metal: a mirror whose reflectance follows Fresnel's equations with a complex index n + i k.
//
// P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection Models, Pacific
// Graphics 1997, section 2: the average over both polarisations, with n and k at every wavelength.
// Stable form: model/fresnel.h. Spectra and their sources: model/metals.cpp.
//
// Three channels stand for the spectrum. For each, the index is chosen whose reflectance is as near as can be to the
// integral over all wavelengths, so that one formula serves published metals and indices of one's own. It is off by
// at most 3e-3 (tests/model/fresnel_test.cpp prints it) but for gold's red: gold lies outside of Rec.709, its red
// is 1.035, and no index reflects more than all the light; there it is 0.036 too dark.
#include "model/fresnel.h"
#include "model/metals.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct FresnelConductor {
  Choice metal;
  T n_r, n_g, n_b, k_r, k_g, k_b;

  static ModelInfo info() {
    return {.name = "fresnel_conductor",
            .label = "Fresnel Conductor",
            .paper =
                "P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection "
                "Models, Pacific Graphics 1997",
            .equations = "Fresnel's equations, unpolarised",
            .doc = "Polished metal: a mirror coloured by the metal's refractive index.",
            .properties = {.lossless = false, .positive = false, .smooth = false},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    std::vector<std::string> names;
    for (const Metal& m : metals()) names.push_back(m.name);
    names.push_back("custom");
    v(metal, ChoiceSpec{"metal", "Metal", names, "Copper, gold, silver, aluminium, iron, chromium, or own n and k"});
    v(n_r, NumberSpec{"n_r", "n Red", 0.2, 1e-3, 100, 0.05, 5, "Real part of the refractive index, for custom"}
               .by_factors());
    v(n_g, NumberSpec{"n_g", "n Green", 0.9, 1e-3, 100, 0.05, 5, "Real part of the refractive index, for custom"}
               .by_factors());
    v(n_b, NumberSpec{"n_b", "n Blue", 1.1, 1e-3, 100, 0.05, 5, "Real part of the refractive index, for custom"}
               .by_factors());
    v(k_r, NumberSpec{"k_r", "k Red", 3.9, 0, 100, 0, 10, "Imaginary part of the refractive index, for custom"});
    v(k_g, NumberSpec{"k_g", "k Green", 2.4, 0, 100, 0, 10, "Imaginary part of the refractive index, for custom"});
    v(k_b, NumberSpec{"k_b", "k Blue", 2.2, 0, 100, 0, 10, "Imaginary part of the refractive index, for custom"});
  }

  Rgb<T> mirror(const Vec3<T>& wo) const {
    const T sin2 = named("sin2", sin2_theta(wo));
    const auto R = [&](const T& n, const T& k) { return fresnel_conductor(wo.z, sin2, n, k); };
    const auto index = std::size_t(metal.index);
    if (index == metals().size()) return {R(n_r, k_r), R(n_g, k_g), R(n_b, k_b)};
    const ChannelIndices& i = channel_indices()[index];
    return {R(T(i.n[0]), T(i.k[0])), R(T(i.n[1]), T(i.k[1])), R(T(i.n[2]), T(i.k[2]))};
  }
};

BRDFC_MODEL(FresnelConductor)

}  // namespace brdfc
