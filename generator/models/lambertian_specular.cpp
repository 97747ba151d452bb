// SPDX-License-Identifier: GPL-3.0-or-later
// The traditional sum of a matte and a mirror term with constant weights.
//
// P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection Models, Pacific
// Graphics 1997, section 5: f = R_d / pi + R_s delta. It is one of the three models with which the paper compares the
// coupled model: its mirror does not become stronger towards grazing angles. R_s is grey. The user has to ensure
// R_d + R_s <= 1.
#include "model/sampling.h"

namespace brdfc {

template <class T> struct LambertianSpecular {
  T rs;
  Rgb<T> rd;

  static ModelInfo info() {
    return {.name = "lambertian_specular",
            .label = "Lambertian-Specular",
            .look = Look::Glossy,
            .paper =
                "P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection "
                "Models, Pacific Graphics 1997",
            .equations = "section 5, first equation",
            .doc = "Matte surface plus a mirror of constant strength; keep the sum of both at 1 or below.",
            .properties = {.conserving = false, .diffuse_limit = "rs=0", .specular_limit = "rd=0 rs=1"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(rd, ColorSpec{"rd", "Matte Reflectance", {0.8, 0.8, 0.8}, "Reflectance of the matte term, R_d"});
    v(rs, NumberSpec{"rs", "Mirror Reflectance", 0.05, 0, 1, 0, 1, "Reflectance of the mirror term, R_s"}.as(
              Optical::Reflectance));
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), rd / pi<T>(), Rgb<T>(T(0))); }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), cosine_pdf(wi), T(0)); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_cosine(u.y, u.z);
    return sample_if(above(wi, wo), wi, rd, cosine_pdf(wi));
  }

  Rgb<T> mirror(const Vec3<T>&) const { return Rgb<T>(rs); }

  ClosureSum<T> exact(const Vec3<T>& wo) const {
    return {Closure<T>(ClosureKind::Diffuse, rd), Closure<T>(ClosureKind::Reflection, mirror(wo))};
  }
};

BRDFC_MODEL(LambertianSpecular)

}  // namespace brdfc
