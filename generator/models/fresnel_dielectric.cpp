// SPDX-License-Identifier: GPL-3.0-or-later
// A smooth boundary between two transparent media: ideal reflection and refraction, weighted by the Fresnel equations.
//
// P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection Models, Pacific
// Graphics 1997, section 2. Numerically stable form: model/fresnel.h. A separate index for each channel:
// model/dispersion.h.
//
// The paper's boundary is white. The two tints are those of Blender's Glass node, which has one colour for both, and of
// its Principled node, which tints what is refracted.
#include "model/dispersion.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct FresnelDielectric : DielectricBoundary<T> {
  Rgb<T> refracted, reflected;

  static ModelInfo info() {
    return {.name = "fresnel_dielectric",
            .label = "Fresnel Dielectric",
            .look = Look::Glass,
            .paper =
                "P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection "
                "Models, Pacific Graphics 1997",
            .equations = "Fresnel's equations, unpolarised",
            .doc = "Smooth surface of water or clear glass: reflects and refracts, with a tint if wanted.",
            .properties = {.lossless = true, .positive = false, .smooth = false},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    DielectricBoundary<T>::parameters(v);
    v(refracted, ColorSpec{"refracted",
                           "Refraction Tint",
                           {1, 1, 1},
                           "Share of the refracted light that is left each time it passes the surface"});
    v(reflected,
      ColorSpec{"reflected", "Reflection Tint", {1, 1, 1}, "Fraction of the reflected light that is not absorbed"});
  }

  Rgb<T> mirror(const Vec3<T>& wo) const { return DielectricBoundary<T>::mirror(wo) * reflected; }
  Rgb<T> transmit(const Vec3<T>& wo) const { return DielectricBoundary<T>::transmit(wo) * refracted; }
};

BRDFC_MODEL(FresnelDielectric)

}  // namespace brdfc
