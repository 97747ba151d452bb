// SPDX-License-Identifier: GPL-3.0-or-later
// Shirley's matte base under a polish: the matte term loses the light that the mirror reflects at the same angle.
//
// P. Shirley: Physically Based Lighting Calculations for Computer Graphics, thesis, University of Illinois, 1991, as
// printed in P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection Models,
// Pacific Graphics 1997, section 5: f = R_f(theta) delta + R_d (1 - R_f(theta)) / pi, here with Schlick's R_f.
//
// f depends on only one of the two angles, so it is not reciprocal. Here theta is the angle of the viewer, which a path
// tracer knows when it distributes the energy; with R_d = 1 no light is lost. With the light's angle, grazing views
// would gain up to 20/21 (1 - R_0).
//
// Erratum: the fraction bar in the paper's equation divides the mirror term by pi as well.
#include "model/sampling.h"

namespace brdfc {

template <class T> struct Shirley1991 {
  T r0;
  Rgb<T> rd;

  static ModelInfo info() {
    return {.name = "shirley_1991",
            .label = "Shirley 1991",
            .look = Look::Glossy,
            .paper =
                "P. Shirley: Physically Based Lighting Calculations for Computer Graphics, 1991, in Shirley et al.: A "
                "Practitioners' Assessment of Light Reflection Models, Pacific Graphics 1997",
            .equations = "section 5, second equation; the mirror term not divided by pi",
            .doc = "Matte surface that fades where its polish reflects; not reciprocal.",
            .properties = {.reciprocal = false, .lossless = true, .specular_limit = "r0=1"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(r0,
      NumberSpec{"r0", "Normal Reflectance", 0.05, 0, 1, 0, 0.2, "Reflectance of the polish at normal incidence, R_0"}
          .as(Optical::Reflectance));
    v(rd, ColorSpec{"rd", "Matte Reflectance", {0.8, 0.8, 0.8}, "Reflectance of the matte base, R_d"});
  }

  /// R_f(theta) by Schlick's approximation.
  Rgb<T> mirror(const Vec3<T>& wo) const { return Rgb<T>(r0 + (T(1) - r0) * schlick_weight(wo.z)); }

  /// R_d (1 - R_f(theta))
  Rgb<T> matte(const Vec3<T>& wo) const { return rd * ((T(1) - r0) * one_minus_schlick_weight(wo.z)); }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), matte(wo) / pi<T>(), Rgb<T>(T(0)));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), cosine_pdf(wi), T(0)); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_cosine(u.y, u.z);
    return sample_if(above(wi, wo), wi, matte(wo), cosine_pdf(wi));
  }

  ClosureSum<T> exact(const Vec3<T>& wo) const {
    return {Closure<T>(ClosureKind::Diffuse, matte(wo)), Closure<T>(ClosureKind::Reflection, mirror(wo))};
  }
};

BRDFC_MODEL(Shirley1991)

}  // namespace brdfc
