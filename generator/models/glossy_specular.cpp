// SPDX-License-Identifier: GPL-3.0-or-later
// Suffern's glossy specular BRDF: a power of the cosine about the mirror direction.
//
// K. Suffern: Ray Tracing from the Ground Up, 2007, chapter 25. f = c k_s c_s cos^e alpha, eq. 25.2.
//
// The book leaves c open. "book" is 1, as in its listing: with k_s = 1 it gains energy below e = 4.28, and reflects
// less and less as e grows. "estimator" is (e + 1) / (2 pi), the normalisation of the glossy reflector's pdf.
// "conserving" is (e + 2) / (2 pi): it reflects k_s c_s at normal incidence, and never more.
//
// Directions are sampled about r, eq. 25.8; those below the surface are lost. Numerical stability: see power_lobe.h.
#include "model/base_terms.h"
#include "model/power_lobe.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct GlossySpecular {
  T ks, e;
  Rgb<T> cs;
  Choice normalisation;

  enum { Book, Estimator, Conserving };

  static ModelInfo info() {
    return {.name = "glossy_specular",
            .label = "Glossy Specular",
            .look = Look::Glossy,
            .paper = "K. Suffern: Ray Tracing from the Ground Up, chapter 25, 2007",
            .equations = "eqs. 25.2, 25.8",
            .doc = "Specular highlight: a power of the cosine about the mirror direction, with a choice of scale.",
            .properties = {.conserving = false,
                           .positive = false,
                           .smooth = false,  // at e = 1 the lobe ends in an edge
                           .exact_sampling = false,
                           .specular_limit = "e=1e7"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(ks, NumberSpec{"ks", "Specular", 0.65, 0, 1, 0, 1, "Strength of the highlight, k_s"});
    v(cs, ColorSpec{"cs", "Specular Color", {1, 1, 1}, "Color of the highlight, c_s"});
    v(e, NumberSpec{"e", "Exponent", 25, 1, 1e7, 1, 100000, "Width of the highlight; larger is sharper"}.by_factors());
    v(normalisation,
      ChoiceSpec{"normalisation",
                 "Normalisation",
                 {"book", "estimator", "conserving"},
                 "Constant c of eq. 25.2. book: 1; estimator: (e + 1) / (2 pi); conserving: (e + 2) / (2 pi)"});
  }

  T c() const {
    switch (normalisation) {
      case Book:
        return T(1);
      case Estimator:
        return (e + T(1)) / (T(2) * pi<T>());
      default:
        return (e + T(2)) / (T(2) * pi<T>());
    }
  }

  /// eq. 25.2
  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), cs * (c() * ks * power_lobe(e, reflect(wo), wi)), Rgb<T>(T(0)));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), power_lobe_pdf(e, reflect(wo), wi), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = about_axis(reflect(wo), sample_power_lobe(e, u.y, u.z));
    const T share = c() * (T(2) * pi<T>()) / (e + T(1));
    return sample_if(above(wi, wo), wi, cs * (ks * share * wi.z), pdf(wi, wo));
  }

  /// Cycles' ramp closure is this lobe times a ramp, which is constant here; see modified_phong.cpp.
  ClosureSum<T> exact(const Vec3<T>&) const {
    return {power_closure(cs * (c() * ks * T(2) * pi<T>() / (e + T(2))), e)};
  }
};

BRDFC_MODEL(GlossySpecular)

}  // namespace brdfc
