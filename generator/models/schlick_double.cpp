// SPDX-License-Identifier: GPL-3.0-or-later
// Schlick's "double" surface: a mirror with Schlick's Fresnel term over a matte base that darkens with the half angle.
//
// C. Schlick: A Customizable Reflectance Model for Everyday Rendering, Eurographics Workshop on Rendering 1993, as
// printed in P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection Models,
// Pacific Graphics 1997, section 5: f = R_f(theta) delta + R_d (1 - R_f(alpha)) / pi, where alpha is half the angle
// between the directions. It is reciprocal, but gains energy: at grazing views the mirror reflects all the light, and
// the matte term still reflects most of it.
//
// Erratum: the fraction bar in the paper's equation divides the mirror term by pi as well.
#include "model/base_terms.h"
#include "model/sampling.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct SchlickDouble {
  T r0;
  Rgb<T> rd;

  static ModelInfo info() {
    return {.name = "schlick_double",
            .label = "Schlick Double",
            .look = Look::Glossy,
            .paper =
                "C. Schlick: A Customizable Reflectance Model for Everyday Rendering, 1993, in Shirley et al.: A "
                "Practitioners' Assessment of Light Reflection Models, Pacific Graphics 1997",
            .equations = "section 5, third equation; the mirror term not divided by pi",
            .doc = "Matte surface under a polish whose shares do not add up: it gains light at grazing angles.",
            .properties = {.conserving = false, .exact_sampling = false, .specular_limit = "r0=1"},
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

  /// R_d (1 - R_f(alpha))
  Rgb<T> matte(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T cosAlpha = named("cosAlpha", length(sum_of_units(wi, wo)) / T(2));
    return rd * ((T(1) - r0) * one_minus_schlick_weight(cosAlpha));
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), matte(wi, wo) / pi<T>(), Rgb<T>(T(0)));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), cosine_pdf(wi), T(0)); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_cosine(u.y, u.z);
    return sample_if(above(wi, wo), wi, matte(wi, wo), cosine_pdf(wi));
  }

  /// R_f(alpha) is about R_0 except where both directions are at grazing angles and far apart.
  ClosureSum<T> base(const Vec3<T>&) const { return {Closure<T>(ClosureKind::Diffuse, rd * (T(1) - r0))}; }

  /// Lambert's with the largest R_f for this view: alpha is at most half of a right angle more than theta_o.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const T cosAlpha = wo.z / sqrt(T(2) + T(2) * sqrt(sin2_theta(wo)));
    return {Closure<T>(ClosureKind::Diffuse, rd * ((T(1) - r0) * one_minus_schlick_weight(cosAlpha)))};
  }
};

BRDFC_MODEL(SchlickDouble)
BRDFC_UNDER(SchlickDouble)

}  // namespace brdfc
