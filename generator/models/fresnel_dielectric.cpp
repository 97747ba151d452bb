// SPDX-License-Identifier: GPL-3.0-or-later
// A smooth boundary between two transparent media: ideal reflection and refraction, weighted by the Fresnel equations.
//
// P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection Models, Pacific
// Graphics 1997, section 2. Numerically stable form: model/fresnel.h. A separate index for each channel:
// model/dispersion.h.
#include "model/dispersion.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct FresnelDielectric : DielectricBoundary<T> {
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
};

BRDFC_MODEL(FresnelDielectric)

}  // namespace brdfc
