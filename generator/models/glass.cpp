// SPDX-License-Identifier: GPL-3.0-or-later
// Coloured glass: a smooth dielectric boundary around a medium that absorbs light, exp(-a t) over a distance t.
//
// P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection Models, Pacific
// Graphics 1997, section 2. Numerically stable form of the Fresnel equations: model/fresnel.h.
//
// a is specified by the colour of white light after one unit of length: attenuation = exp(-a / density).
#include "model/dispersion.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct Glass : DielectricBoundary<T> {
  T density;
  Rgb<T> attenuation;

  static ModelInfo info() {
    return {.name = "glass",
            .label = "Glass",
            .look = Look::Glass,
            .paper =
                "P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection "
                "Models, Pacific Graphics 1997",
            .equations = "Fresnel's equations, unpolarised; exp(-a t)",
            .doc = "Clear or coloured glass: reflects, refracts, and absorbs along the way inside.",
            .properties = {.lossless = true, .positive = false, .smooth = false},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    DielectricBoundary<T>::parameters(v);
    v(attenuation, ColorSpec{"attenuation",
                             "Attenuation",
                             {0.5, 0.9, 0.7},
                             "Share of the light that is left after one unit of length inside, at density 1"}
                       .as(Optical::Attenuation));
    v(density,
      NumberSpec{"density", "Density", 1, 0, 1e6, 0, 10, "Multiplies the absorption per length"}.by_factors().as(
          Optical::PerLength));
  }

  Rgb<T> transmittance(const T& distance) const {
    const T d = named("depth", density * distance);
    // 0 to the power of 0 is 1: even a medium that absorbs everything absorbs nothing over a distance of 0.
    const auto left = [&](const T& c) {
      return select(c > T(0), exp(d * log(maximum(c, tiny<T>()))), select(d > T(0), T(0), T(1)));
    };
    // The components of a recorded colour can't be accessed. Here two channels are black, so the maximum is the third.
    const auto channel = [&](const Rgb<T>& one) { return left(max_component(attenuation * one)); };
    return {channel({T(1), T(0), T(0)}), channel({T(0), T(1), T(0)}), channel({T(0), T(0), T(1)})};
  }
};

BRDFC_MODEL(Glass)

}  // namespace brdfc
